//! `GET /v1/assets/{id}/preview.png` and the like, on the binary with the real engine.

use reqwest::{Client, Response, StatusCode};
use retargetd::samples;
use serde_json::Value;

use super::support::{PATIENCE, ServiceProcess, header, start_service};

async fn get(server: &ServiceProcess, path: &str, known: &str) -> Response {
    let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
    client.get(format!("{}{path}", server.url)).header("if-none-match", known).send().await.expect("an answer")
}

async fn document(answer: Response) -> Value {
    answer.json().await.expect("JSON")
}

#[tokio::test(flavor = "multi_thread")]
async fn assets_and_results_have_pictures() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
    let upload = |name: &'static str, bytes: Vec<u8>| {
        let request = client.post(format!("{}/v1/assets?filename={name}", server.url));
        request.header("content-type", "application/octet-stream").body(bytes).send()
    };
    let walk = document(upload("walk.glb", samples::walk_clip()).await.expect("an answer")).await;
    let mannequin = document(upload("mannequin.glb", samples::mannequin()).await.expect("an answer")).await;
    let id = walk["id"].as_str().expect("an id");

    let thumbnail = walk["thumbnail"].as_str().expect("a link");
    let picture = get(&server, thumbnail, "").await;
    assert_eq!((picture.status(), header(&picture, "content-type")), (StatusCode::OK, "image/png"));
    assert_eq!(header(&picture, "cache-control"), "private, max-age=31536000, immutable");
    let tag = header(&picture, "etag").to_owned();
    let bytes = picture.bytes().await.expect("a body");
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    assert_eq!(u32::from_be_bytes([bytes[16], bytes[17], bytes[18], bytes[19]]), 256, "as wide as asked for");
    assert_eq!(get(&server, thumbnail, &tag).await.status(), StatusCode::NOT_MODIFIED);
    assert_eq!(get(&server, thumbnail, "").await.bytes().await.expect("a body"), bytes, "remembered");

    let moving = get(&server, &format!("/v1/assets/{id}/preview.gif?size=64&fps=5&camera=orbit&labels=true"), "").await;
    assert_eq!((moving.status(), header(&moving, "content-type")), (StatusCode::OK, "image/gif"));
    assert_ne!(header(&moving, "etag"), tag, "another picture");

    let job = serde_json::json!({"source": {"asset": id}, "target": {"asset": mannequin["id"]}, "output": ["glb"]});
    let job = client.post(format!("{}/v1/jobs", server.url)).header("prefer", "wait=30").json(&job).send().await;
    let job = document(job.expect("an answer")).await;
    let result = job["results"][0]["id"].as_str().expect("a result").to_owned();
    let picture = get(&server, &format!("/v1/results/{result}/preview.webp?size=64&at=0.5&style=both"), "").await;
    assert_eq!((picture.status(), header(&picture, "content-type")), (StatusCode::OK, "image/webp"));
    let page = client.get(format!("{}/v1/jobs/{}/report", server.url, job["id"].as_str().expect("an id")));
    let page = page.header("accept", "text/html").send().await.expect("an answer");
    assert!(header(&page, "content-security-policy").contains("img-src data:"), "it may show what it holds");
    let page = page.text().await.expect("a page");
    assert!(page.contains("<img src=\"data:image/png;base64,"), "the report shows the result");

    let view = serde_json::json!({"size": [64, 64], "fps": 5, "layout": "side_by_side"});
    let outputs = serde_json::json!([{"format": "gif", "view": view}, {"format": "glb"}]);
    let config = serde_json::json!({"output": outputs});
    let drawn = serde_json::json!({"source": {"asset": id}, "target": {"asset": mannequin["id"]}, "config": config});
    let drawn = client.post(format!("{}/v1/jobs", server.url)).header("prefer", "wait=30").json(&drawn).send().await;
    let drawn = document(drawn.expect("an answer")).await;
    assert_eq!(drawn["results"][0]["format"], "gif", "{drawn}");
    assert!(drawn["results"][0]["thumbnail"].is_string(), "a moving picture has a small one too");
    assert!(drawn["results"][1]["thumbnail"].is_string(), "the other has one");
    let content = get(&server, drawn["results"][0]["content"].as_str().expect("a link"), "").await;
    assert_eq!(header(&content, "content-type"), "image/gif");

    let shown = get(&server, &format!("/v1/results/{result}"), "").await;
    assert_eq!(document(shown).await["thumbnail"], format!("/v1/results/{result}/preview.png?size=256"));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_cannot_be_drawn_is_a_problem() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
    let upload = client.post(format!("{}/v1/assets?filename=walk.glb", server.url)).body(samples::walk_clip());
    let asset =
        document(upload.header("content-type", "application/octet-stream").send().await.expect("an answer")).await;
    let id = asset["id"].as_str().expect("an id");
    let cases = [
        ("preview.jpg", 404, "'jpg' is the ending of no picture"),
        ("preview.png?size=4000", 400, "size: both sides are 16 to 1920 pixels"),
        ("preview.png?size=wide", 400, "pixels, as 512 or 640x360"),
        ("preview.png?camera=below", 400, "camera"),
        ("preview.png?zoom=2", 400, "zoom"),
        ("preview.png?clip=Run", 422, "there is no clip 'Run'"),
        ("preview.gif?fps=1000", 400, "fps: it is 1 to 60"),
    ];
    for (path, status, says) in cases {
        let answer = get(&server, &format!("/v1/assets/{id}/{path}"), "").await;
        assert_eq!(answer.status().as_u16(), status, "{path}");
        let problem = document(answer).await;
        assert!(problem["detail"].as_str().is_some_and(|detail| detail.contains(says)), "{path}: {problem}");
    }
    let missing = get(&server, "/v1/assets/ast_01j9z3k8m0q4r6t8v0x2y4a6c8/preview.png", "").await;
    assert_eq!(missing.status(), StatusCode::NOT_FOUND);
}
