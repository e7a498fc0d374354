//! `POST /v1/edits`, and edits in jobs, on the binary with the real engine.

use reqwest::{Client, Response, StatusCode, multipart::Form, multipart::Part};
use retargetd::samples;
use serde_json::json;

use super::support::{PATIENCE, ServiceProcess, header, json as read, problem, start_service, taken};

fn client() -> Client {
    Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client")
}

async fn send(server: &ServiceProcess, path: &str, parts: &[(&'static str, Vec<u8>)]) -> Response {
    let form = parts.iter().fold(Form::new(), |form, (name, bytes)| {
        let ending = if *name == "config" { "json" } else { "glb" };
        form.part(*name, Part::bytes(bytes.clone()).file_name(format!("{name}.{ending}")))
    });
    let request = client().post(format!("{}{path}", server.url)).multipart(form);
    request.header("accept", "application/json").send().await.expect("an answer")
}

#[tokio::test(flavor = "multi_thread")]
async fn a_clip_comes_back_edited() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let (walk, mannequin) = (("source", samples::walk_clip()), ("target", samples::mannequin()));
    let edit = json!({"edit": {"range": [0.5, 1.5], "fps": 24, "reverse": true, "mirror": true}});
    let config = ("config", edit.to_string().into_bytes());

    let answer = send(&server, "/v1/edits", &[walk.clone(), config.clone()]).await;
    assert_eq!(answer.status(), StatusCode::OK, "ended within the wait");
    let job = header(&answer, "job-id").to_owned();
    let poses = read(answer).await;
    assert_eq!(poses["times"].as_array().map(Vec::len), Some(25), "a second at 24 frames");
    let names = poses["joint_names"].as_array().expect("names");
    assert!(names.contains(&json!("mixamorig:Hips")), "on its own rig: {names:?}");
    let done = read(client().get(format!("{}/v1/jobs/{job}/config", server.url)).send().await.expect("a config")).await;
    assert_eq!((&done["task"], &done["edit"]["fps"]), (&json!("edit"), &json!(24.0)), "what was done is on record");

    let answer = send(&server, "/v1/retarget", &[walk.clone(), mannequin.clone(), config]).await;
    assert_eq!(answer.status(), StatusCode::OK, "the same around a retarget");
    assert_eq!(read(answer).await["times"].as_array().map(Vec::len), Some(25), "as long");

    problem(send(&server, "/v1/edits", std::slice::from_ref(&mannequin)).await, 422, "unknown_part").await;
    let nothing = ("config", b"{}".to_vec());
    problem(send(&server, "/v1/edits", &[nothing]).await, 422, "missing_part").await;
    let outside = ("config", br#"{"edit": {"range": [90, 91]}}"#.to_vec());
    let refused = problem(send(&server, "/v1/edits", &[walk.clone(), outside]).await, 422, "invalid_value").await;
    assert_eq!(refused["errors"][0]["pointer"], "/edit/range", "where: {refused}");
    let pose = ("config", br#"{"pose": {"to": "t"}, "edit": {"fps": 24}}"#.to_vec());
    let answer = send(&server, "/v1/edits", &[walk.clone(), pose]).await;
    assert_eq!(header(&answer, "warnings-count"), "1", "the pose is said to count for nothing");
    let job = header(&answer, "job-id").to_owned();
    assert!(read(answer).await["times"].as_array().is_some_and(|times| times.len() > 1), "the route says what is done");
    let job = read(client().get(format!("{}/v1/jobs/{job}", server.url)).send().await.expect("a job")).await;
    let inputs: Vec<&String> = job["inputs"].as_object().expect("files").keys().collect();
    assert_eq!((&job["kind"], inputs), (&json!("edit"), vec![&"source".to_owned()]), "an edit has no target");
    let foreign = ("config", br#"{"SourceChains": [], "TargetChains": []}"#.to_vec());
    problem(send(&server, "/v1/edits", &[walk, foreign]).await, 422, "invalid_value").await;
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_that_edits_needs_no_target() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let upload = client().post(format!("{}/v1/assets?filename=walk.glb", server.url)).body(samples::walk_clip());
    let asset = taken(upload.send().await.expect("an asset")).await;
    let ask = |config: serde_json::Value| {
        let body = json!({"source": {"asset": asset}, "config": config, "output": ["poses_json"]});
        client().post(format!("{}/v1/jobs", server.url)).header("prefer", "wait=30").json(&body).send()
    };
    let job = read(ask(json!({"task": "edit", "edit": {"reverse": true}})).await.expect("an answer")).await;
    assert_eq!(job["state"], "succeeded", "{job}");
    let refused = problem(ask(json!({})).await.expect("an answer"), 422, "invalid_value").await;
    assert_eq!(refused["errors"][0]["pointer"], "/target", "what is missing: {refused}");
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}
