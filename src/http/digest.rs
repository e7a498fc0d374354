//! Digests that a sender announces (`Content-Digest`, `Repr-Digest`, RFC 9530).

use axum::http::HeaderMap;
use base64::{Engine as _, engine::general_purpose::STANDARD};

use super::{code::Code, problem::Problem};
use crate::jobs::hexadecimal;

/// The SHA-256 that the headers announce, in hexadecimal. Other algorithms are ignored, as the RFC allows.
///
/// # Errors
/// When a header announces a SHA-256 that is none.
pub(super) fn announced(headers: &HeaderMap) -> Result<Option<String>, Problem> {
    let values = ["content-digest", "repr-digest"].into_iter().flat_map(|name| headers.get_all(name));
    for value in values {
        let entries = value.to_str().unwrap_or_default().split(',').map(str::trim);
        if let Some(digest) = entries.filter_map(|entry| entry.strip_prefix("sha-256=")).next() {
            return read(digest).map(Some);
        }
    }
    Ok(None)
}

fn read(digest: &str) -> Result<String, Problem> {
    let encoded = digest.strip_prefix(':').and_then(|digest| digest.strip_suffix(':'));
    let bytes = encoded.and_then(|encoded| STANDARD.decode(encoded).ok()).filter(|bytes| bytes.len() == 32);
    let bytes = bytes.ok_or_else(|| {
        Problem::new(Code::MalformedRequest, format!("'sha-256={digest}' is not a digest"))
            .with_hint("the form is sha-256=:<32 bytes in base64>:")
    })?;
    Ok(hexadecimal(&bytes))
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    fn of(value: &'static str) -> Result<Option<String>, Code> {
        let headers = HeaderMap::from_iter([(
            axum::http::HeaderName::from_static("content-digest"),
            HeaderValue::from_static(value),
        )]);
        announced(&headers).map_err(|problem| problem.code)
    }

    #[test]
    fn sha_256_is_read_and_others_are_ignored() {
        let empty = "sha-512=:AA==:, sha-256=:47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=:";
        let expected = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
        assert_eq!(of(empty), Ok(Some(expected.to_owned())), "the digest of nothing");
        assert_eq!(of("md5=:AA==:"), Ok(None), "ignored");
        for wrong in ["sha-256=:AA==:", "sha-256=47DEQpj8", "sha-256=:!:"] {
            assert_eq!(of(wrong), Err(Code::MalformedRequest), "{wrong}");
        }
    }
}
