//! Pages of lists. A cursor is opaque, and holds the filter that it was made with.

use base64::{Engine as _, engine::general_purpose::URL_SAFE_NO_PAD};

use super::{code::Code, problem::Problem};

/// How many entries a page has, unless the caller says otherwise.
const DEFAULT_ITEMS: usize = 50;

/// The number of entries asked for, cut down to what is allowed.
pub(super) fn items(asked: Option<u32>, most: u64) -> usize {
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    asked.map_or(DEFAULT_ITEMS, |asked| asked as usize).clamp(1, most)
}

/// The cursor for what comes after `last`.
pub(super) fn cursor(filter: &str, last: &str) -> String {
    URL_SAFE_NO_PAD.encode(format!("{filter}:{last}"))
}

/// The id that a cursor stands for.
///
/// # Errors
/// When it is no cursor, or one of a list with another filter.
pub(super) fn read_cursor<T>(
    cursor: Option<&str>,
    filter: &str,
    parse: impl Fn(&str) -> Option<T>,
) -> Result<Option<T>, Problem> {
    let Some(cursor) = cursor else { return Ok(None) };
    let bytes = URL_SAFE_NO_PAD.decode(cursor).ok();
    let text = bytes.and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default();
    let id = text.rsplit_once(':').filter(|(made_with, _)| *made_with == filter).and_then(|(_, id)| parse(id));
    id.map(Some).ok_or_else(|| {
        Problem::new(Code::MalformedRequest, "the cursor is not one of this list")
            .with_hint("take next_cursor from the page before, and leave the filters as they were")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cursor_reads_back_with_its_own_filter_only() {
        let text = |text: &str| Some(text.to_owned());
        let filter = "failed,2026-01-01T00:00:00Z";
        let made = cursor(filter, "job_1");
        assert_eq!(read_cursor(Some(&made), filter, text).ok(), Some(Some("job_1".to_owned())), "reads back");
        assert!(read_cursor(Some(&made), "", text).is_err(), "another filter");
        assert!(read_cursor(Some("%%%"), "", text).is_err(), "no cursor");
        assert_eq!(items(Some(10_000), 100), 100, "cut down");
        assert_eq!(items(Some(0), 100), 1, "at least one");
    }
}
