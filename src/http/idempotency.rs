//! The `Idempotency-Key` header: the caller's own word for a request, so that asking again after a broken connection gives the same job.

use axum::{
    extract::FromRequestParts,
    http::{HeaderName, HeaderValue, request::Parts},
};

use super::{code::Code, problem::Problem};

const NAME: HeaderName = HeaderName::from_static("idempotency-key");
const REPLAYED: HeaderName = HeaderName::from_static("idempotent-replayed");
const MAX_LETTERS: usize = 255;

/// The word, where there is one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct IdempotencyKey(pub(super) Option<String>);

impl<S: Send + Sync> FromRequestParts<S> for IdempotencyKey {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        // What clients send without a value is what they left out.
        let given = parts.headers.get(NAME).filter(|value| !value.is_empty());
        given.map(read).transpose().map(Self)
    }
}

/// The draft has the word in quotes, and most clients send it without.
fn read(value: &HeaderValue) -> Result<String, Problem> {
    let text = value.to_str().unwrap_or_default().trim();
    let word = text.strip_prefix('"').and_then(|text| text.strip_suffix('"')).unwrap_or(text);
    if word.is_empty() || word.len() > MAX_LETTERS || !word.bytes().all(|byte| byte.is_ascii_graphic()) {
        let detail =
            format!("the header 'Idempotency-Key' must have 1 to {MAX_LETTERS} letters, digits and signs of ASCII");
        return Err(Problem::new(Code::MalformedRequest, detail).with_hint("a UUID for each request does"));
    }
    Ok(word.to_owned())
}

/// Says that the answer is about a request from before.
pub(super) fn replayed(is_repeated: bool) -> Option<(HeaderName, HeaderValue)> {
    is_repeated.then_some((REPLAYED, HeaderValue::from_static("true")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_is_read_with_quotes_and_without() {
        let word = |text: &'static str| read(&HeaderValue::from_static(text)).ok();
        assert_eq!(word("\"8e03978e\"").as_deref(), Some("8e03978e"), "as the draft has it");
        assert_eq!(word("8e03978e").as_deref(), Some("8e03978e"), "as most send it");
        for none in ["", "\"\"", "two words"] {
            assert_eq!(word(none), None, "{none:?}");
        }
        assert!(read(&HeaderValue::try_from("a".repeat(256)).expect("a header")).is_err(), "too long");
    }
}
