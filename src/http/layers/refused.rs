//! Requests that no route understands, whatever it is: told once and here.

use axum::{
    extract::Request,
    http::{HeaderMap, Version, header},
    middleware::Next,
    response::{IntoResponse, Response},
};

use crate::http::{code::Code, extract, problem::Problem};

pub(super) async fn refuse_what_nobody_understands(request: Request, next: Next) -> Response {
    match understood(request.version(), request.headers()) {
        Ok(()) => next.run(request).await,
        Err(problem) => problem.into_response(),
    }
}

fn understood(version: Version, headers: &HeaderMap) -> Result<(), Problem> {
    if version == Version::HTTP_11 && !headers.contains_key(header::HOST) {
        return Err(Problem::new(Code::MalformedRequest, "the request has no header 'Host'")
            .with_hint("HTTP/1.1 asks for it; every HTTP library sends it by itself"));
    }
    let coding = extract::text(headers, &header::CONTENT_ENCODING);
    if coding.is_empty() || coding.eq_ignore_ascii_case("identity") {
        return Ok(());
    }
    let shown: String = coding.chars().take(32).collect();
    let detail = format!("the body is compressed ('Content-Encoding: {shown}'), and compressed bodies are not taken");
    Err(Problem::new(Code::UnsupportedMediaType, detail)
        .with_hint("send the body as it is, without 'Content-Encoding'"))
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    #[test]
    fn a_compressed_body_and_a_request_to_nobody_are_refused() {
        let headers = |pairs: &[(header::HeaderName, &'static str)]| {
            HeaderMap::from_iter(pairs.iter().map(|(name, value)| (name.clone(), HeaderValue::from_static(value))))
        };
        let code = |version, pairs: &[_]| understood(version, &headers(pairs)).map_err(|problem| problem.code);
        let host = (header::HOST, "localhost");
        assert_eq!(code(Version::HTTP_11, std::slice::from_ref(&host)), Ok(()), "as it is");
        assert_eq!(code(Version::HTTP_11, &[]), Err(Code::MalformedRequest), "to nobody");
        assert_eq!(code(Version::HTTP_2, &[]), Ok(()), "HTTP/2 says it elsewhere");
        let gzip = [host, (header::CONTENT_ENCODING, "gzip")];
        assert_eq!(code(Version::HTTP_11, &gzip), Err(Code::UnsupportedMediaType), "compressed");
    }
}
