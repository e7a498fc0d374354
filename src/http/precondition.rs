//! `If-Match` and `If-None-Match` (RFC 9110) on what can be changed. Tags are digests in quotes.

use axum::http::{HeaderMap, header};

use super::{code::Code, problem::Problem};
use crate::jobs::Precondition;

/// What must hold for a change.
///
/// # Errors
/// When a header is not a list of entity tags, or both are there.
pub(super) fn of_change(headers: &HeaderMap) -> Result<Precondition, Problem> {
    let (matching, none_matching) = (joined(headers, &header::IF_MATCH), joined(headers, &header::IF_NONE_MATCH));
    match (matching.as_deref(), none_matching.as_deref()) {
        (None, None) => Ok(Precondition::Always),
        (Some("*"), None) => Ok(Precondition::Exists),
        (Some(tags), None) => Ok(Precondition::Is(read_tags(tags)?)),
        (None, Some("*")) => Ok(Precondition::Absent),
        (None, Some(_)) => Err(Problem::new(Code::MalformedRequest, "'If-None-Match' of a change can only be '*'")
            .with_hint(
                "'If-None-Match: *' writes only if there is nothing yet; 'If-Match: \"…\"' changes only that version",
            )),
        (Some(_), Some(_)) => {
            Err(Problem::new(Code::MalformedRequest, "'If-Match' and 'If-None-Match' contradict each other"))
        }
    }
}

/// What `If-Match` asks for when something is only read: that it is this version.
///
/// # Errors
/// When it is another, or the header is not a list of entity tags.
pub(super) fn check_read(headers: &HeaderMap, sha256: &str) -> Result<(), Problem> {
    let Some(tags) = joined(headers, &header::IF_MATCH).filter(|tags| tags != "*") else { return Ok(()) };
    if read_tags(&tags)?.iter().any(|tag| tag == sha256) {
        return Ok(());
    }
    let detail = format!("its ETag is \"{sha256}\", which 'If-Match' does not name");
    Err(Problem::new(Code::PreconditionFailed, detail).with_hint("leave the header out to have it as it is"))
}

/// Whether the caller has what has this digest.
pub(super) fn caller_has(headers: &HeaderMap, sha256: &str) -> bool {
    let Some(tags) = joined(headers, &header::IF_NONE_MATCH) else { return false };
    // Weak tags count here, and what is no tag is nothing that the caller has.
    tags == "*" || tags.split(',').any(|tag| tag.trim().trim_start_matches("W/").trim_matches('"') == sha256)
}

fn joined(headers: &HeaderMap, name: &header::HeaderName) -> Option<String> {
    let values: Vec<&str> =
        headers.get_all(name).iter().map(|value| value.to_str().unwrap_or_default().trim()).collect();
    // What clients send without a value is what they left out.
    let values = values.join(",");
    (!values.is_empty()).then_some(values)
}

/// A weak tag never matches, as the RFC has it; it stays in the list as a text that no digest is.
fn read_tags(tags: &str) -> Result<Vec<String>, Problem> {
    let read = |tag: &str| {
        let inner = tag.trim().trim_start_matches("W/").strip_prefix('"')?.strip_suffix('"')?;
        Some(if tag.trim().starts_with("W/") { String::new() } else { inner.to_owned() })
    };
    tags.split(',').map(read).collect::<Option<_>>().ok_or_else(|| {
        let shown: String = tags.chars().take(64).collect();
        Problem::new(Code::MalformedRequest, format!("'If-Match: {shown}' is not a list of entity tags"))
            .with_hint("a tag is the ETag of an answer, including its quotes")
    })
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    fn headers(pairs: &[(header::HeaderName, &'static str)]) -> HeaderMap {
        pairs.iter().map(|(name, value)| (name.clone(), HeaderValue::from_static(value))).collect()
    }

    #[test]
    fn headers_become_preconditions() {
        let of = |pairs: &[_]| of_change(&headers(pairs)).map_err(|problem| problem.code);
        assert_eq!(of(&[]), Ok(Precondition::Always), "nothing");
        assert_eq!(of(&[(header::IF_MATCH, "")]), Ok(Precondition::Always), "left empty");
        assert_eq!(of(&[(header::IF_MATCH, "*")]), Ok(Precondition::Exists), "any");
        assert_eq!(of(&[(header::IF_NONE_MATCH, "*")]), Ok(Precondition::Absent), "none");
        let two = Precondition::Is(vec!["a".to_owned(), String::new()]);
        assert_eq!(of(&[(header::IF_MATCH, "\"a\", W/\"b\"")]), Ok(two), "weak tags match nothing");
        assert_eq!(of(&[(header::IF_MATCH, "a")]), Err(Code::MalformedRequest), "no tag");
        assert_eq!(of(&[(header::IF_NONE_MATCH, "\"a\"")]), Err(Code::MalformedRequest), "not of a change");
        let both = [(header::IF_MATCH, "*"), (header::IF_NONE_MATCH, "*")];
        assert_eq!(of(&both), Err(Code::MalformedRequest), "opposites");
    }

    #[test]
    fn what_is_read_has_to_be_the_version_that_is_named() {
        let read =
            |tag: &'static str| check_read(&headers(&[(header::IF_MATCH, tag)]), "a").map_err(|problem| problem.code);
        assert_eq!((read("*"), read("\"b\", \"a\""), read("")), (Ok(()), Ok(()), Ok(())), "it is");
        assert_eq!(read("\"b\""), Err(Code::PreconditionFailed), "another");
        assert_eq!(read("W/\"a\""), Err(Code::PreconditionFailed), "weak tags match nothing");
        assert_eq!(read("b"), Err(Code::MalformedRequest), "no tag");
    }

    #[test]
    fn who_has_it_is_told_so() {
        assert!(caller_has(&headers(&[(header::IF_NONE_MATCH, "\"x\", W/\"a\"")]), "a"), "in the list");
        assert!(!caller_has(&headers(&[(header::IF_NONE_MATCH, "\"x\"")]), "a"), "not in the list");
        assert!(!caller_has(&headers(&[]), "a"), "no list");
    }
}
