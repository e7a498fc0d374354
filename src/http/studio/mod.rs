//! The page with which people see, correct and decide: files of `studio/`, which the binary carries, and the samples that it begins with.

mod files;

use std::{io::Write as _, sync::OnceLock};

use axum::{
    Json, Router,
    extract::{Path, State},
    http::{HeaderMap, HeaderValue, StatusCode, Uri, header},
    response::{IntoResponse, Redirect, Response},
    routing::get,
};
use flate2::{Compression, write::GzEncoder};
use sha2::{Digest, Sha256};

use files::FILES;

use super::{
    ApiState, Shared, auth::Caller, code::Code, download::ascii, extract, precondition, problem::Problem,
    views::AssetView,
};
use crate::{
    config::Settings,
    jobs::{Assets, hexadecimal},
    samples::Sample,
};

/// A file as it goes out.
struct Served {
    path: String,
    media_type: &'static str,
    bytes: Vec<u8>,
    compressed: Vec<u8>,
    sha256: String,
}

/// The page and what it is made of.
pub(super) fn pages() -> Router<ApiState> {
    Router::new()
        .route("/studio", get(async || Redirect::permanent("/studio/")))
        .route("/studio/", get(file))
        .route("/studio/sample/{name}", get(file).post(keep_sample))
        .route("/studio/{*path}", get(file))
}

/// All files, made once.
fn served() -> &'static [Served] {
    static SERVED: OnceLock<Vec<Served>> = OnceLock::new();
    SERVED.get_or_init(|| {
        let of_page = FILES.iter().map(|(path, bytes)| served_file((*path).to_owned(), bytes.to_vec()));
        let samples = Sample::ALL.map(|sample| served_file(format!("sample/{}", sample.name), sample.bytes()));
        of_page.chain(samples).collect()
    })
}

fn served_file(path: String, bytes: Vec<u8>) -> Served {
    let sha256 = hexadecimal(&Sha256::digest(&bytes));
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    // A vector takes everything.
    let compressed = encoder.write_all(&bytes).and_then(|()| encoder.finish()).unwrap_or_default();
    Served { media_type: media_type(&path), path, bytes, compressed, sha256 }
}

fn media_type(path: &str) -> &'static str {
    match path.rsplit('.').next().unwrap_or_default() {
        "html" => "text/html; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "json" => "application/json",
        "svg" => "image/svg+xml",
        "glb" => "model/gltf-binary",
        "zip" => "application/zip",
        _ => "text/plain; charset=utf-8",
    }
}

async fn file(State(settings): State<Shared<Settings>>, uri: Uri, headers: HeaderMap) -> Response {
    let path = uri.path().strip_prefix("/studio/").unwrap_or_default();
    let path = if path.is_empty() { "index.html" } else { path };
    let Some(file) = served().iter().find(|file| file.path == path) else {
        return Problem::new(Code::NotFound, "the studio has no such file").into_response();
    };
    let is_known = precondition::caller_has(&headers, &file.sha256);
    let takes_gzip = extract::text(&headers, &header::ACCEPT_ENCODING).contains("gzip") && !file.compressed.is_empty();
    let mut response = match (is_known, takes_gzip) {
        (true, _) => StatusCode::NOT_MODIFIED.into_response(),
        (false, true) => ([(header::CONTENT_ENCODING, "gzip")], file.compressed.as_slice()).into_response(),
        (false, false) => file.bytes.as_slice().into_response(),
    };
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(file.media_type));
    headers.insert(header::ETAG, ascii(format!("\"{}\"", file.sha256)));
    headers.insert(header::VARY, HeaderValue::from_static("accept-encoding"));
    // Another version of the service has another page.
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    headers.insert(header::CONTENT_SECURITY_POLICY, ascii(policy(&settings)));
    response
}

/// Makes a sample an asset of the caller's, without a way to the browser and back.
async fn keep_sample(
    State(assets): State<Assets>,
    Caller(owner): Caller,
    Path(name): Path<String>,
) -> Result<Json<AssetView>, Problem> {
    let Some(sample) = Sample::ALL.iter().find(|sample| sample.name == name) else {
        return Err(Problem::new(Code::NotFound, "the studio has no such sample"));
    };
    Ok(Json(assets.keep_bytes(&owner, &name, &sample.bytes()).await?.into()))
}

/// The page runs its own scripts and asks its own service. It may be shown inside pages of the origins that may call the service.
fn policy(settings: &Settings) -> String {
    let origins: String = settings.cors_origins.0.iter().map(|origin| format!(" {origin}")).collect();
    format!(
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; base-uri 'none'; \
         form-action 'none'; frame-ancestors 'self'{origins}"
    )
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// The files of `studio/`, without the folder.
    fn on_disk() -> BTreeSet<String> {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("studio");
        let (mut files, mut folders) = (BTreeSet::new(), vec![root.clone()]);
        while let Some(folder) = folders.pop() {
            for entry in folder.read_dir().expect("a folder") {
                let path = entry.expect("an entry").path();
                if path.is_dir() {
                    folders.push(path);
                } else {
                    let path = path.strip_prefix(&root).expect("below the root");
                    files.insert(path.to_string_lossy().replace('\\', "/"));
                }
            }
        }
        files
    }

    #[test]
    fn every_file_of_the_page_is_carried() {
        let carried: BTreeSet<String> = FILES.iter().map(|(path, _)| (*path).to_owned()).collect();
        assert_eq!(carried, on_disk(), "src/http/studio/files.rs lists what lies in studio/");
    }

    #[test]
    fn everything_together_is_small() {
        const MAX_BYTES: usize = 350 << 10;
        // Samples are made assets here, and never sent; a test in the browser counts what is.
        let of_page = served().iter().filter(|file| !file.path.starts_with("sample/"));
        let bytes: usize = of_page.map(|file| file.compressed.len()).sum();
        assert!(bytes <= MAX_BYTES, "{bytes} bytes compressed");
    }

    #[test]
    fn modules_are_short() {
        for (path, bytes) in FILES.iter().filter(|(path, _)| path.ends_with(".js") && !path.starts_with("vendor/")) {
            let lines = bytes.iter().filter(|byte| **byte == b'\n').count();
            assert!(lines <= 300, "{path} has {lines} lines");
        }
    }

    #[test]
    fn pages_of_origins_that_may_call_may_show_it() {
        let mut settings = Settings::default();
        assert!(policy(&settings).ends_with("frame-ancestors 'self'"), "else none");
        settings.cors_origins.0.push("https://pipeline.example".to_owned());
        assert!(policy(&settings).ends_with("frame-ancestors 'self' https://pipeline.example"));
    }
}
