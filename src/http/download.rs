//! Files that go out: conditional requests, ranges, names to save them under.

use std::ops::Range;

use axum::{
    body::{Body, Bytes},
    http::{HeaderMap, HeaderValue, Method, StatusCode, header},
    response::{IntoResponse, Response},
};
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};

use super::{code::Code, extract, problem::Problem};
use crate::{
    engine::Format,
    jobs::{AssetRecord, Jobs, ResultRecord},
};

/// What is written in percent in the extended form of a file name.
const UNSAFE_IN_NAMES: AsciiSet = NON_ALPHANUMERIC.remove(b'.').remove(b'_').remove(b'-');

/// A file as it goes out.
#[derive(Clone, Debug)]
pub(super) struct File {
    sha256: String,
    bytes: u64,
    media_type: &'static str,
    file_name: String,
}

fn media_type(format: &str, file_name: &str) -> &'static str {
    let format = Format::from_name(format);
    if format == Some(Format::Drawing) {
        // It may be an archive or a picture.
        let (_, ending) = file_name.rsplit_once('.').unwrap_or_default();
        return match &*ending.to_ascii_lowercase() {
            "png" => "image/png",
            "jpg" | "jpeg" => "image/jpeg",
            "webp" => "image/webp",
            "zip" => Format::Drawing.info().media_type,
            _ => "application/octet-stream",
        };
    }
    format.map_or("application/octet-stream", |format| format.info().media_type)
}

impl From<AssetRecord> for File {
    fn from(asset: AssetRecord) -> Self {
        let file_name = if asset.file_name.is_empty() { asset.id.to_string() } else { asset.file_name };
        Self { sha256: asset.sha256, bytes: asset.bytes, media_type: media_type(&asset.format, &file_name), file_name }
    }
}

impl From<ResultRecord> for File {
    fn from(result: ResultRecord) -> Self {
        let ResultRecord { sha256, bytes, format, file_name, .. } = result;
        Self { sha256, bytes, media_type: media_type(&format, &file_name), file_name }
    }
}

/// What of the file is wanted.
#[derive(Debug, PartialEq, Eq)]
enum RangeDecision {
    All,
    Part(Range<u64>),
    Nothing,
    OutOfRange,
    /// Nothing, since the caller wants it only if it is another one.
    Other,
}

impl File {
    fn entity_tag(&self) -> String {
        format!("\"{}\"", self.sha256)
    }

    /// All of it, whatever the request's conditions: the answer to a request that made the file.
    pub(super) async fn whole(self, jobs: &Jobs) -> Result<Response, Problem> {
        self.send(&Method::GET, &HeaderMap::new(), jobs).await
    }

    /// All of it, where its bytes are at hand.
    pub(super) fn at_hand(self, bytes: Bytes) -> Response {
        let length = self.bytes;
        self.with_content(StatusCode::OK, Body::from(bytes), length)
    }

    /// What the request's method and headers ask for, or where it can be had.
    pub(super) async fn answer(self, method: &Method, headers: &HeaderMap, jobs: &Jobs) -> Result<Response, Problem> {
        let is_known =
            matches!(wanted(headers, &self.entity_tag(), self.bytes), RangeDecision::Nothing | RangeDecision::Other);
        if *method == Method::GET
            && !is_known
            && let Some(link) = jobs.download_link(&self.sha256, text(&disposition(&self.file_name))).await?
        {
            let mut response = StatusCode::TEMPORARY_REDIRECT.into_response();
            response.headers_mut().insert(header::LOCATION, ascii(link));
            response.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
            return Ok(response);
        }
        self.send(method, headers, jobs).await
    }

    async fn send(self, method: &Method, headers: &HeaderMap, jobs: &Jobs) -> Result<Response, Problem> {
        let (status, range) = match wanted(headers, &self.entity_tag(), self.bytes) {
            RangeDecision::Nothing => return Ok(self.with_headers(StatusCode::NOT_MODIFIED.into_response())),
            RangeDecision::OutOfRange => return Ok(self.out_of_range()),
            RangeDecision::Other => {
                let detail = format!("the file's ETag is {}, which 'If-Match' does not name", self.entity_tag());
                return Err(Problem::new(Code::PreconditionFailed, detail)
                    .with_hint("leave the header out to have the file as it is"));
            }
            RangeDecision::All => (StatusCode::OK, None),
            RangeDecision::Part(range) => (StatusCode::PARTIAL_CONTENT, Some(range)),
        };
        let length = range.as_ref().map_or(self.bytes, |range| range.end - range.start);
        let body = if *method == Method::HEAD {
            Body::empty()
        } else {
            Body::from_stream(jobs.content(&self.sha256, range.clone()).await?)
        };
        let mut response = self.with_content(status, body, length);
        let headers = response.headers_mut();
        if let Some(Range { start, end }) = range {
            let text = format!("bytes {start}-{}/{}", end - 1, self.bytes);
            headers.insert(header::CONTENT_RANGE, ascii(text));
        }
        Ok(response)
    }

    fn with_content(&self, status: StatusCode, body: Body, length: u64) -> Response {
        let mut response = self.with_headers((status, body).into_response());
        let headers = response.headers_mut();
        headers.insert(header::CONTENT_LENGTH, HeaderValue::from(length));
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(self.media_type));
        headers.insert(header::CONTENT_DISPOSITION, disposition(&self.file_name));
        response
    }

    fn with_headers(&self, mut response: Response) -> Response {
        let headers = response.headers_mut();
        headers.insert(header::ETAG, ascii(self.entity_tag()));
        headers.insert(header::ACCEPT_RANGES, HeaderValue::from_static("bytes"));
        headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("private, max-age=31536000, immutable"));
        response
    }

    fn out_of_range(&self) -> Response {
        let detail = format!("the range lies outside the file, which has {} bytes", self.bytes);
        let mut response = Problem::new(Code::RangeNotSatisfiable, detail).into_response();
        response.headers_mut().insert(header::CONTENT_RANGE, ascii(format!("bytes */{}", self.bytes)));
        response
    }
}

fn wanted(headers: &HeaderMap, entity_tag: &str, bytes: u64) -> RangeDecision {
    let required = extract::text(headers, &header::IF_MATCH);
    if !required.is_empty() && !required.split(',').map(str::trim).any(|tag| tag == "*" || tag == entity_tag) {
        return RangeDecision::Other;
    }
    let known = extract::text(headers, &header::IF_NONE_MATCH);
    let is_known = |tag: &str| tag == "*" || tag.strip_prefix("W/").unwrap_or(tag) == entity_tag;
    if !known.is_empty() && known.split(',').map(str::trim).any(is_known) {
        return RangeDecision::Nothing;
    }
    let condition = extract::text(headers, &header::IF_RANGE);
    if !condition.is_empty() && condition != entity_tag {
        return RangeDecision::All;
    }
    read_range(extract::text(headers, &header::RANGE), bytes)
}

/// One range of bytes. Several, or another unit, are answered with the whole file, as RFC 9110 allows.
fn read_range(text: &str, bytes: u64) -> RangeDecision {
    let Some((first, last)) = text.strip_prefix("bytes=").and_then(|range| range.trim().split_once('-')) else {
        return RangeDecision::All;
    };
    let range = match (first.parse::<u64>(), last.parse::<u64>()) {
        (Ok(first), Ok(last)) if first <= last => first..last.saturating_add(1).min(bytes),
        (Ok(first), Err(_)) if last.is_empty() => first..bytes,
        (Err(_), Ok(count)) if first.is_empty() => bytes.saturating_sub(count)..bytes,
        _ => return RangeDecision::All,
    };
    if range.is_empty() { RangeDecision::OutOfRange } else { RangeDecision::Part(range) }
}

/// A download under a name; what is not plain ASCII goes into the extended form (RFC 6266, RFC 8187).
pub(super) fn disposition(file_name: &str) -> HeaderValue {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b" ._-()".contains(&byte);
    let plain: String = file_name
        .chars()
        .map(|letter| if letter.is_ascii() && is_plain(letter as u8) { letter } else { '_' })
        .collect();
    if plain == file_name {
        return ascii(format!("attachment; filename=\"{plain}\""));
    }
    let encoded = utf8_percent_encode(file_name, &UNSAFE_IN_NAMES);
    ascii(format!("attachment; filename=\"{plain}\"; filename*=UTF-8''{encoded}"))
}

/// The text of a header value that was made from text.
fn text(value: &HeaderValue) -> &str {
    value.to_str().unwrap_or("attachment")
}

/// A header value of text that is known to be ASCII.
pub(super) fn ascii(text: String) -> HeaderValue {
    HeaderValue::try_from(text).unwrap_or_else(|_| HeaderValue::from_static(""))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_cut_to_the_file() {
        let cases = [
            ("", RangeDecision::All),
            ("bytes=0-9", RangeDecision::Part(0..10)),
            ("bytes=90-", RangeDecision::Part(90..100)),
            ("bytes=-10", RangeDecision::Part(90..100)),
            ("bytes=-1000", RangeDecision::Part(0..100)),
            ("bytes=0-18446744073709551615", RangeDecision::Part(0..100)),
            ("bytes=100-", RangeDecision::OutOfRange),
            ("bytes=-0", RangeDecision::OutOfRange),
            ("bytes=9-0", RangeDecision::All),
            ("bytes=0-1,5-6", RangeDecision::All),
            ("joints=0-1", RangeDecision::All),
        ];
        for (text, expected) in cases {
            assert_eq!(read_range(text, 100), expected, "{text}");
        }
        assert_eq!(read_range("bytes=0-", 0), RangeDecision::OutOfRange, "an empty file has no first byte");
    }

    #[test]
    fn conditions_come_before_ranges() {
        let headers = |name: &'static str, value: &'static str| {
            let mut headers = HeaderMap::from_iter([(header::RANGE, HeaderValue::from_static("bytes=0-0"))]);
            headers.insert(name, HeaderValue::from_static(value));
            headers
        };
        assert_eq!(wanted(&headers("if-none-match", "\"x\", W/\"a\""), "\"a\"", 9), RangeDecision::Nothing, "known");
        assert_eq!(
            wanted(&headers("if-match", "\"x\""), "\"a\"", 9),
            RangeDecision::Other,
            "not the one that is wanted"
        );
        assert_eq!(
            wanted(&headers("if-match", "\"x\", \"a\""), "\"a\"", 9),
            RangeDecision::Part(0..1),
            "the one that is wanted"
        );
        assert_eq!(wanted(&headers("if-range", "\"old\""), "\"a\"", 9), RangeDecision::All, "another file by now");
        assert_eq!(wanted(&headers("if-range", "\"a\""), "\"a\"", 9), RangeDecision::Part(0..1), "the same file");
    }

    #[test]
    fn names_cannot_break_out_of_the_header() {
        let value = disposition("a\"b\r\nX: y é.glb");
        let text = value.to_str().expect("ASCII");
        assert!(!text.contains('\r') && text.matches('"').count() == 2, "quoted: {text}");
        assert!(text.contains("%C3%A9.glb"), "the real name is there: {text}");
    }
}
