//! `GET /v1/assets/{id}/display` and that of results, on the binary with the real engine; and the page that shows them.

use std::path::Path;

use reqwest::{Client, Response, StatusCode, redirect::Policy};
use retargetd::samples;
use serde_json::{Value, json};

use super::support::{PATIENCE, ServiceProcess, header, problem, start_service, taken};
use crate::support::{gltf_json, validate_gltf};

fn client() -> Client {
    Client::builder().timeout(PATIENCE).no_proxy().redirect(Policy::none()).build().expect("a client")
}

async fn upload(server: &ServiceProcess, name: &str, bytes: Vec<u8>) -> String {
    let request = client().post(format!("{}/v1/assets?filename={name}", server.url)).body(bytes);
    taken(request.send().await.expect("an answer")).await
}

async fn get(server: &ServiceProcess, path: &str, accept: &str) -> Response {
    client().get(format!("{}{path}", server.url)).header("accept", accept).send().await.expect("an answer")
}

/// What the GLB says to viewers.
fn facts(document: &Value) -> &Value {
    &document["scenes"][0]["extras"]["retargetd"]
}

#[tokio::test(flavor = "multi_thread")]
async fn any_file_is_a_plain_glb_for_viewers() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let walk = upload(&server, "walk.glb", samples::walk_clip()).await;
    let mannequin = upload(&server, "mannequin.glb", samples::mannequin()).await;

    let shown = get(&server, &format!("/v1/assets/{walk}/display"), "*/*").await;
    assert_eq!((shown.status(), header(&shown, "content-type")), (StatusCode::OK, "model/gltf-binary"));
    let tag = header(&shown, "etag").to_owned();
    let bytes = shown.bytes().await.expect("a body");
    let document = gltf_json(&bytes);
    assert_eq!(
        document["nodes"][0]["extras"]["joint"], "mixamorig:Hips",
        "the file's nodes come first, with their labels"
    );
    let primitives: usize = document["meshes"].as_array().expect("capsules").len();
    assert!(primitives <= 2, "a body of capsules is drawn at once: {primitives}");
    assert_eq!(document["animations"].as_array().map(Vec::len), Some(1), "one clip");
    let of_walk = facts(&document);
    assert_eq!((&of_walk["clips"][0]["frames"], &of_walk["front"]), (&json!(121), &json!([0.0, 0.0, 1.0])));
    assert_eq!(of_walk["key_times_seconds"].as_array().map(Vec::len), Some(121), "a time for each frame");
    assert_eq!(of_walk["roles"]["pelvis"], json!([0]), "roles by node: {of_walk}");
    let known = client().get(format!("{}/v1/assets/{walk}/display", server.url)).header("if-none-match", &tag);
    assert_eq!(known.send().await.expect("an answer").status(), StatusCode::NOT_MODIFIED);

    let packed =
        client().get(format!("{}/v1/assets/{walk}/display", server.url)).header("accept-encoding", "gzip").send();
    let packed = packed.await.expect("an answer");
    assert_eq!(header(&packed, "content-encoding"), "gzip", "plain vertices are packed on the way");
    let length = packed.bytes().await.expect("a body").len();
    assert!(length * 3 < bytes.len(), "{length} of {}", bytes.len());

    let light = get(&server, &format!("/v1/assets/{mannequin}/display?mesh=false"), "*/*").await;
    assert_ne!(header(&light, "etag"), tag, "another file");
    let document = gltf_json(&light.bytes().await.expect("a body"));
    assert!(document["meshes"].is_null() && document["animations"].is_null(), "nodes alone");

    let body = json!({"source": {"asset": walk}, "target": {"asset": mannequin}, "output": ["bvh"]});
    let job = client().post(format!("{}/v1/jobs", server.url)).header("prefer", "wait=30").json(&body).send().await;
    let job: Value = job.expect("an answer").json().await.expect("JSON");
    let result = job["results"][0]["id"].as_str().expect("a result").to_owned();
    let shown = get(&server, &format!("/v1/results/{result}/display"), "*/*").await;
    assert_eq!(shown.status(), StatusCode::OK);
    let of_result = shown.bytes().await.expect("a body");
    assert_eq!(facts(&gltf_json(&of_result))["clips"][0]["frames"], 121, "a BVH is shown too");

    let folder = tempfile::tempdir().expect("a folder");
    let files = [("walk.glb", &bytes), ("result.glb", &of_result)].map(|(name, bytes)| {
        let file = folder.path().join(name);
        std::fs::write(&file, bytes).expect("written");
        file
    });
    let paths: Vec<&Path> = files.iter().map(std::path::PathBuf::as_path).collect();
    for (file, report) in validate_gltf(&paths).into_iter().flatten() {
        assert_eq!((&report["errors"], &report["warnings"]), (&json!(0), &json!(0)), "{}: {report}", file.display());
    }

    let unknown = get(&server, &format!("/v1/assets/{walk}/display?clip=run"), "*/*").await;
    let refused = problem(unknown, 422, "unknown_name").await;
    assert!(refused["hint"].as_str().is_some_and(|hint| hint.contains("Walk") || hint.contains("walk")), "{refused}");
    problem(get(&server, "/v1/assets/ast_01j9z3k8m0q4r6t8v0x2y4a6c8/display", "*/*").await, 404, "not_found").await;
    problem(get(&server, &format!("/v1/assets/{walk}/display?mash=1"), "*/*").await, 400, "malformed_request").await;
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

#[tokio::test(flavor = "multi_thread")]
async fn browsers_are_led_to_the_page_and_programs_are_not() {
    const BROWSER: &str = "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8";
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &["--cors-origins", "https://pipeline.example"]);
    let led = get(&server, "/", BROWSER).await;
    assert_eq!((led.status(), header(&led, "location")), (StatusCode::TEMPORARY_REDIRECT, "/studio/"));
    assert_eq!(header(&led, "vary"), "accept");
    let told = get(&server, "/", "*/*").await;
    assert_eq!(told.status(), StatusCode::OK);
    assert_eq!(told.json::<Value>().await.expect("JSON")["links"]["studio"], "/studio/");
    assert_eq!(get(&server, "/studio", BROWSER).await.status(), StatusCode::PERMANENT_REDIRECT);

    let page = get(&server, "/studio/", BROWSER).await;
    assert_eq!((page.status(), header(&page, "content-type")), (StatusCode::OK, "text/html; charset=utf-8"));
    let policy = header(&page, "content-security-policy");
    assert!(
        policy.contains("script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'"),
        "{policy}"
    );
    assert!(policy.ends_with("frame-ancestors 'self' https://pipeline.example"), "who may call may show it: {policy}");
    let tag = header(&page, "etag").to_owned();
    let known = client().get(format!("{}/studio/", server.url)).header("if-none-match", tag).send().await;
    assert_eq!(known.expect("an answer").status(), StatusCode::NOT_MODIFIED);
    let script = client().get(format!("{}/studio/main.js", server.url)).header("accept-encoding", "gzip").send().await;
    let script = script.expect("an answer");
    assert_eq!(header(&script, "content-type"), "text/javascript; charset=utf-8");
    assert_eq!(header(&script, "content-encoding"), "gzip");
    problem(get(&server, "/studio/../Cargo.toml", "*/*").await, 404, "not_found").await;
    problem(get(&server, "/studio/no/such.js", "*/*").await, 404, "not_found").await;

    // Samples become assets without a way to the browser and back.
    let kept = client().post(format!("{}/studio/sample/drawing.zip", server.url)).send().await.expect("an answer");
    let asset: Value = kept.json().await.expect("JSON");
    assert_eq!((&asset["file_name"], &asset["format"]), (&json!("drawing.zip"), &json!("drawing")));
    let id = asset["id"].as_str().expect("an id");
    let found = get(&server, &format!("/v1/assets/{id}/skeleton"), "*/*").await.json::<Value>().await.expect("JSON");
    assert_eq!(
        found["drawing"]["joints"][2],
        json!({"name": "torso", "parent": "hip", "loc": [180.0, 188.0]}),
        "{found}"
    );
    let none = client().post(format!("{}/studio/sample/none.glb", server.url)).send().await.expect("an answer");
    problem(none, 404, "not_found").await;
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");

    let server = start_service(data.path(), &["--authentication", "keys"]);
    let kept = client().post(format!("{}/studio/sample/walk.glb", server.url)).send().await.expect("an answer");
    problem(kept, 401, "unauthenticated").await;
    assert_eq!(get(&server, "/studio/", BROWSER).await.status(), StatusCode::OK, "the page itself is for everybody");
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");

    let server = start_service(data.path(), &["--studio", "off"]);
    let led = get(&server, "/", BROWSER).await;
    assert_eq!(
        (led.status(), header(&led, "location")),
        (StatusCode::TEMPORARY_REDIRECT, "/docs"),
        "what pages there are"
    );
    let told = get(&server, "/", "*/*").await;
    assert!(told.json::<Value>().await.expect("JSON")["links"]["studio"].is_null());
    problem(get(&server, "/studio/", "*/*").await, 404, "not_found").await;
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}
