//! The binary with the real engine and real files.

use reqwest::{Client, Response, StatusCode};

use super::support::{PATIENCE, ServiceProcess, header, json, problem, start_service};
use crate::support::corpus_file;

async fn retarget(server: &ServiceProcess, config: Option<&'static str>) -> Option<Response> {
    retarget_onto(server, "decentraland/walk.glb", config).await
}

async fn retarget_onto(server: &ServiceProcess, target: &str, config: Option<&'static str>) -> Option<Response> {
    let source = std::fs::read(corpus_file("mixamo/bvh/ortiz_salsa.bvh")?).expect("reads");
    let target = std::fs::read(corpus_file(target)?).expect("reads");
    let part = |bytes: Vec<u8>, name: &'static str| reqwest::multipart::Part::bytes(bytes).file_name(name);
    let mut form = reqwest::multipart::Form::new()
        .part("target", part(target, "walk.glb"))
        .part("source", part(source, "salsa.bvh"));
    if let Some(config) = config {
        form = form.part("config", part(config.into(), "config.json"));
    }
    let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
    Some(client.post(format!("{}/v1/retarget", server.url)).multipart(form).send().await.expect("an answer"))
}

#[tokio::test(flavor = "multi_thread")]
async fn real_files_give_a_real_file_which_survives_a_restart() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let Some(answer) = retarget(&server, None).await else { return };
    assert_eq!(answer.status(), StatusCode::OK, "ended within the wait");
    let job = header(&answer, "job-id").to_owned();
    let made = answer.bytes().await.expect("a body");
    assert!(made.starts_with(b"glTF"), "a GLB");
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
    let server = start_service(data.path(), &[]);
    let get = |path: String| reqwest::get(format!("{}{path}", server.url));
    let job = json(get(format!("/v1/jobs/{job}")).await.expect("an answer")).await;
    let content = job["results"][0]["content"].as_str().expect("a place").to_owned();
    assert_eq!(get(content).await.expect("an answer").bytes().await.expect("a body"), made, "the same bytes");
    let asset = job["inputs"]["target"]["asset"].as_str().expect("an asset");
    let skeleton = json(get(format!("/v1/assets/{asset}/skeleton")).await.expect("an answer")).await;
    assert_eq!(skeleton["format"], "glb", "what it holds: {skeleton}");
}

/// Frameworks have limits of their own, of 2 MB.
#[tokio::test(flavor = "multi_thread")]
async fn characters_of_several_megabytes_are_taken() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let Some(answer) = retarget_onto(&server, "mixamo/gltf/Xbot.glb", None).await else { return };
    assert_eq!(answer.status(), StatusCode::OK, "{:?}", answer.text().await);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_wrong_config_is_refused_with_a_pointer() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let Some(answer) = retarget(&server, Some(r#"{"sorce": {}}"#)).await else { return };
    let refused = problem(answer, 422, "unknown_field").await;
    assert_eq!(refused["errors"][0]["pointer"], "/sorce", "where: {refused}");
    let Some(answer) = retarget(&server, Some("{")).await else { return };
    problem(answer, 422, "malformed_config").await;
}
