//! Pages of lists. A cursor is opaque, and holds the filter that it was made with.

use base64::{Engine as _, engine::general_purpose::URL_SAFE_NO_PAD};
use serde::Deserialize;
use utoipa::IntoParams;

use super::{code::Code, extract::unusable, problem::Problem};
use crate::jobs::Page;

/// How many entries a page has, unless the caller says otherwise.
const DEFAULT_ITEMS: usize = 50;

/// What is asked of a list that has no filter.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct PageQuery {
    /// Entries of the page; capped by the limit `page_items`.
    #[param(value_type = Option<u32>, format = Int64, minimum = 1, maximum = 4_294_967_295_u32)]
    pub(super) limit: Option<String>,
    /// `next_cursor` of the previous page.
    pub(super) cursor: Option<String>,
}

/// The number of entries asked for, cut down to what is allowed.
///
/// # Errors
/// When none are asked for, or it is no number.
pub(super) fn items(asked: Option<&str>, most: u64) -> Result<usize, Problem> {
    let most = usize::try_from(most).unwrap_or(usize::MAX);
    let Some(text) = asked else { return Ok(DEFAULT_ITEMS.clamp(1, most)) };
    // More than a number can hold is more than there may be.
    let is_number = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let number = is_number.then(|| text.parse().unwrap_or(usize::MAX));
    let number = number.filter(|number| *number > 0);
    number.map(|number| number.min(most)).ok_or_else(|| unusable("limit", text, "a whole number from 1", "50"))
}

/// The cursor for what comes after a page, where anything does: `name_of` names the last entry of the page.
pub(super) fn next_cursor<T>(page: &Page<T>, filter: &str, name_of: impl Fn(&T) -> String) -> Option<String> {
    let last = page.items.last().filter(|_| page.has_more)?;
    Some(URL_SAFE_NO_PAD.encode(format!("{filter}:{}", name_of(last))))
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
        Problem::new(Code::MalformedRequest, "the cursor does not belong to this list")
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
        let mut page = Page { items: vec!["job_2", "job_1"], has_more: true };
        let made = next_cursor(&page, filter, |id| (*id).to_owned());
        assert_eq!(read_cursor(made.as_deref(), filter, text).ok(), Some(Some("job_1".to_owned())), "reads back");
        assert!(read_cursor(made.as_deref(), "", text).is_err(), "another filter");
        page.has_more = false;
        assert_eq!(next_cursor(&page, filter, |id| (*id).to_owned()), None, "the last page");
        assert!(read_cursor(Some("%%%"), "", text).is_err(), "no cursor");
        assert_eq!(items(Some("10000"), 100).ok(), Some(100), "cut down");
        assert_eq!(items(Some("99999999999999999999999"), 100).ok(), Some(100), "whatever it is");
        assert_eq!(items(None, 20).ok(), Some(20), "unless it is said");
        for wrong in ["0", "-1", "many", "1.5", "+1"] {
            let problem = items(Some(wrong), 100).expect_err("no number of entries");
            assert_eq!(problem.detail, format!("'{wrong}' is not a valid 'limit'; it is a whole number from 1"));
        }
    }
}
