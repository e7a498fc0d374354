//! One-shots on files that were uploaded before, as JSON that names them.

use reqwest::{Client, Response, StatusCode};
use retargetd::samples;
use serde_json::{Value, json};

use super::support::{PATIENCE, ServiceProcess, header, json as read, problem, start_service, taken};

fn client() -> Client {
    Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client")
}

async fn upload(server: &ServiceProcess, name: &str, bytes: Vec<u8>) -> String {
    let request = client().post(format!("{}/v1/assets?filename={name}", server.url)).body(bytes);
    taken(request.send().await.expect("an answer")).await
}

async fn post(server: &ServiceProcess, path: &str, body: &Value) -> Response {
    let request = client().post(format!("{}{path}", server.url)).header("prefer", "wait=60").json(body);
    request.header("accept", "model/gltf-binary").send().await.expect("an answer")
}

#[tokio::test(flavor = "multi_thread")]
async fn files_that_are_there_need_not_be_sent_again() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let walk = upload(&server, "walk.glb", samples::walk_clip()).await;
    let mannequin = upload(&server, "mannequin.glb", samples::mannequin()).await;
    let (walk, mannequin) = (json!({"asset": walk}), json!({"asset": mannequin}));

    let pair = json!({"source": walk, "target": mannequin, "config": {"align": "full"}});
    let answer = post(&server, "/v1/retarget", &pair).await;
    assert_eq!((answer.status(), header(&answer, "content-type")), (StatusCode::OK, "model/gltf-binary"));
    assert!(!header(&answer, "verdict").is_empty(), "it is measured");
    let job = header(&answer, "job-id").to_owned();
    let by_asset = answer.bytes().await.expect("a file");
    let part = |name: &str, bytes: Vec<u8>| reqwest::multipart::Part::bytes(bytes).file_name(format!("{name}.glb"));
    let form = reqwest::multipart::Form::new()
        .part("source", part("walk", samples::walk_clip()))
        .part("target", part("mannequin", samples::mannequin()))
        .text("config", r#"{"align": "full"}"#);
    let sent = client().post(format!("{}/v1/retarget", server.url)).multipart(form).send().await.expect("an answer");
    assert_eq!(sent.bytes().await.expect("a file"), by_asset, "the same as with the files in the request");

    let report = |query: &str| client().get(format!("{}/v1/jobs/{job}/report{query}", server.url)).send();
    let coarse = read(report("").await.expect("an answer")).await;
    let fine = read(report("?include=curves").await.expect("an answer")).await;
    let values =
        |report: &Value, name: &str| report["measures"]["curves"][name]["times_seconds"].as_array().map(Vec::len);
    assert_eq!(
        (values(&coarse, "limb_direction"), values(&fine, "limb_direction")),
        (Some(120), Some(121)),
        "every frame"
    );
    assert_eq!((values(&coarse, "limb_twist"), values(&fine, "limb_twist")), (None, Some(121)), "and more of them");
    assert_eq!(coarse["measures"]["metrics"], fine["measures"]["metrics"], "the metrics are those of the job");
    problem(report("?include=all").await.expect("an answer"), 400, "malformed_request").await;

    let edit = json!({"source": walk, "config": {"edit": {"range": [0, 1]}}});
    let answer = post(&server, "/v1/edits", &edit).await;
    assert_eq!(answer.status(), StatusCode::OK, "an edit");
    let job = header(&answer, "job-id").to_owned();
    let curves = read(
        client().get(format!("{}/v1/jobs/{job}/report?include=curves", server.url)).send().await.expect("an answer"),
    )
    .await;
    assert!(curves["measures"].is_null(), "an edit is not measured: {curves}");
    let answer = post(&server, "/v1/poses?to=source", &json!({"target": mannequin, "source": walk})).await;
    assert_eq!(answer.status(), StatusCode::OK, "a pose as another character's");
    assert_eq!(post(&server, "/v1/poses", &json!({"target": mannequin})).await.status(), StatusCode::OK, "a T pose");

    problem(post(&server, "/v1/poses?to=source", &json!({"target": mannequin})).await, 422, "missing_part").await;
    let refused = problem(post(&server, "/v1/retarget", &json!({"source": walk})).await, 422, "invalid_value").await;
    assert!(refused["detail"].as_str().is_some_and(|detail| detail.contains("target")), "what is missing: {refused}");
    let typo = json!({"source": walk, "target": mannequin, "confg": {}});
    let refused = problem(post(&server, "/v1/retarget", &typo).await, 422, "unknown_field").await;
    assert_eq!(refused["errors"][0]["did_you_mean"][0], "config", "the nearest name: {refused}");
    let gone = json!({"source": {"asset": "ast_01j9z3k8m0q4r6t8v0x2y4a6c8"}, "target": mannequin});
    problem(post(&server, "/v1/retarget", &gone).await, 422, "unknown_asset").await;
    let idle = json!({"source": walk, "target": mannequin, "config": {"edit": {"range": [0, 1]}}});
    problem(post(&server, "/v1/edits", &idle).await, 422, "unknown_field").await;
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}
