//! Which format an `Accept` header asks for.

use super::{code::Code, problem::Problem};
use crate::engine::Format;

/// The formats that a caller can ask for by media type. Where several share one, the first is meant.
fn writable() -> impl Iterator<Item = (Format, &'static str)> {
    let infos = Format::ALL.into_iter().map(|format| (format, format.info()));
    infos.filter(|(_, info)| info.writes).map(|(format, info)| (format, info.media_type))
}

/// The format to make, or `None` when the caller leaves it open.
///
/// A header that takes anything as gladly as something in particular leaves it open: that is what HTTP libraries send when
/// their user said nothing (`application/json, text/plain, */*`).
///
/// # Errors
/// When the caller takes nothing that can be made.
pub(super) fn wanted_format(accept: &str) -> Result<Option<Format>, Problem> {
    if accept.trim().is_empty() {
        return Ok(None);
    }
    let mut best: Option<(f32, Format)> = None;
    let mut open = 0.0_f32;
    for (media_type, quality) in accept.split(',').map(read_range) {
        // Bytes of whatever kind are what clients ask for that were generated from the OpenAPI document.
        if media_type == "*/*" || media_type == "application/octet-stream" {
            open = open.max(quality);
        }
        let found = writable().find(|(_, written)| matches(&media_type, written));
        if let Some((format, _)) = found.filter(|_| quality > best.map_or(0.0, |(best, _)| best)) {
            best = Some((quality, format));
        }
    }
    match best {
        Some((quality, format)) if quality > open => Ok(Some(format)),
        _ if open > 0.0 => Ok(None),
        _ => Err(Problem::new(Code::NotAcceptable, format!("no writable format matches 'Accept: {accept}'"))
            .with_hint("leave the header out for GLB, or ask for one of the media types that GET /v1/formats lists")),
    }
}

/// Whether a caller would rather have a page than JSON, as browsers do.
pub(super) fn prefers_page(accept: &str) -> bool {
    let quality = |wanted: &str| {
        let named = accept.split(',').map(read_range).filter(|(range, _)| range == wanted);
        named.map(|(_, quality)| quality).fold(0.0, f32::max)
    };
    quality("text/html") > quality("application/json")
}

/// Whether a caller would rather have a zip archive than JSON; so would who says nothing, or takes anything as gladly.
///
/// # Errors
/// When the caller takes neither.
pub(super) fn prefers_archive(accept: &str) -> Result<bool, Problem> {
    let accept = if accept.trim().is_empty() { "*/*" } else { accept };
    let quality = |wanted: &str| {
        let fitting = accept.split(',').map(read_range).filter(|(range, _)| range != "*/*" && matches(range, wanted));
        fitting.map(|(_, quality)| quality).fold(0.0, f32::max)
    };
    let anything = accept.split(',').map(read_range).filter(|(range, _)| range == "*/*");
    let open = anything.map(|(_, quality)| quality).fold(0.0, f32::max);
    let (archive, document) = (quality("application/zip"), quality("application/json"));
    match archive.max(document) {
        best if best > open => Ok(archive >= document),
        _ if open > 0.0 => Ok(true),
        _ => Err(Problem::new(Code::NotAcceptable, format!("nothing that can be made fits 'Accept: {accept}'"))
            .with_hint("ask for application/zip or application/json")),
    }
}

fn read_range(range: &str) -> (String, f32) {
    let mut parts = range.split(';').map(str::trim);
    let media_type = parts.next().unwrap_or_default().to_ascii_lowercase();
    let quality = parts.find_map(|parameter| parameter.strip_prefix("q=")).and_then(|text| text.parse().ok());
    (media_type, quality.unwrap_or(1.0_f32).clamp(0.0, 1.0))
}

fn matches(range: &str, media_type: &str) -> bool {
    range == media_type || range.strip_suffix("/*").is_some_and(|kind| media_type.split('/').next() == Some(kind))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_chooses_and_openness_leaves_it_open() {
        let cases = [
            ("", None),
            ("*/*", None),
            ("application/json, text/plain, */*", None),
            ("application/octet-stream", None),
            ("model/gltf-binary", Some(Format::Glb)),
            ("application/x-npz", Some(Format::PosesNpz)),
            ("application/json", Some(Format::PosesJson)),
            ("text/plain", Some(Format::Bvh)),
            ("model/*", Some(Format::Glb)),
            ("model/gltf+json;q=0.9, application/x-npz;q=0.5", Some(Format::Gltf)),
            ("application/x-npz, */*;q=0.1", Some(Format::PosesNpz)),
        ];
        for (accept, format) in cases {
            assert_eq!(wanted_format(accept).expect("acceptable"), format, "{accept}");
        }
    }

    #[test]
    fn archives_are_given_unless_json_is_preferred() {
        let cases = [
            ("", true),
            ("*/*", true),
            ("application/json, text/plain, */*", true),
            ("application/json", false),
            ("application/*", true),
            ("application/zip;q=0.2, application/json", false),
            ("application/json, */*;q=0.1", false),
        ];
        for (accept, is_archive) in cases {
            assert_eq!(prefers_archive(accept).expect("acceptable"), is_archive, "{accept}");
        }
        assert!(prefers_archive("image/png").is_err(), "neither");
    }

    #[test]
    fn browsers_get_pages_and_programs_json() {
        let browser = "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8";
        let cases = [
            (browser, true),
            ("text/html", true),
            ("", false),
            ("*/*", false),
            ("application/json", false),
            ("application/json, text/html;q=0.5", false),
        ];
        for (accept, page) in cases {
            assert_eq!(prefers_page(accept), page, "{accept}");
        }
    }

    #[test]
    fn what_cannot_be_made_is_refused() {
        for accept in ["video/quicktime", "model/gltf-binary;q=0", "*/*;q=0"] {
            assert_eq!(wanted_format(accept).map_err(|problem| problem.code), Err(Code::NotAcceptable), "{accept}");
        }
    }
}
