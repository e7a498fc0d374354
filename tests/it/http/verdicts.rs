//! The verdict of a report, wherever a result is spoken of, with the real engine.

use std::{io::Read as _, process::Command};

use reqwest::{Client, Response, multipart};
use retargetd::samples;
use serde_json::{Value, json};

use super::support::{PATIENCE, header, json as read, problem, start_service, taken};

fn client() -> Client {
    Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client")
}

/// The walk onto the mannequin, by a config.
fn form(config: &str) -> multipart::Form {
    let part = |bytes: Vec<u8>, name: &'static str| multipart::Part::bytes(bytes).file_name(name);
    multipart::Form::new()
        .part("source", part(samples::walk_clip(), "walk.glb"))
        .part("target", part(samples::mannequin(), "mannequin.glb"))
        .part("config", part(config.as_bytes().to_vec(), "config.json"))
}

/// A config whose result fails: nothing but the pelvis is driven.
const FAILS: &str = r#"{"ops": [{"op": "pelvis"}]}"#;
/// Nothing is measured.
const UNMEASURED: &str = r#"{"report": "none"}"#;

#[tokio::test(flavor = "multi_thread")]
async fn the_verdict_is_told_wherever_a_result_is_spoken_of() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let at = |path: &str| format!("{}{path}", server.url);
    let get = async |path: &str| -> Value { read(client().get(at(path)).send().await.expect("an answer")).await };
    let ask = async |config: &str| -> Response {
        client().post(at("/v1/retarget")).multipart(form(config)).send().await.expect("an answer")
    };

    let good = ask("{}").await;
    let job = get(&format!("/v1/jobs/{}", header(&good, "job-id"))).await;
    let report = get(&format!("/v1/jobs/{}/report", header(&good, "job-id"))).await["measures"].clone();
    assert_eq!(job["verdict"], report["verdict"], "of the report: {job}");
    assert_eq!(job["verdict_reason"], report["verdict_reason"], "and why: {job}");
    assert_eq!(job["coverage"], report["coverage"], "and how much of the body: {job}");
    assert_eq!(header(&good, "verdict"), report["verdict"], "in the headers of what was waited for");
    assert!(header(&good, "verdict-reason").len() > 3, "and why");
    assert_eq!(header(&good, "coverage").parse::<f64>().ok(), report["coverage"].as_f64(), "and how much");

    let again = ask("{}").await;
    assert_eq!(header(&again, "verdict"), header(&good, "verdict"), "what was computed before is as good");
    let bad = ask(FAILS).await;
    assert_eq!(header(&bad, "verdict"), "fail", "limbs that are not driven: {}", header(&bad, "verdict-reason"));
    let unmeasured = ask(UNMEASURED).await;
    assert!(unmeasured.headers().get("verdict").is_none(), "nothing was measured");

    let events =
        client().get(at(&format!("/v1/jobs/{}/events", header(&bad, "job-id")))).send().await.expect("an answer");
    let events = events.text().await.expect("text");
    assert!(events.contains("\"verdict\":\"fail\""), "in the event of its end: {events}");
    assert_eq!(events.matches("\"verdict\":").count(), 1, "and in no other: {events}");

    let failed = get("/v1/jobs?verdict=fail").await;
    let ids: Vec<&Value> = failed["items"].as_array().expect("a list").iter().map(|job| &job["id"]).collect();
    assert_eq!(ids, [&json!(header(&bad, "job-id"))], "those alone");
    problem(client().get(at("/v1/jobs?verdict=bad")).send().await.expect("an answer"), 400, "malformed_request").await;

    let metrics = client().get(at("/metrics")).send().await.expect("an answer").text().await.expect("text");
    assert!(metrics.contains("retargetd_verdicts_total{verdict=\"fail\"} 1"), "counted: {metrics}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_batch_and_its_archive_tell_the_verdicts() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let at = |path: &str| format!("{}{path}", server.url);
    let mut files = json!({});
    for (role, bytes) in [("source", samples::walk_clip()), ("target", samples::mannequin())] {
        let upload = client().post(at(&format!("/v1/assets?filename={role}.glb"))).body(bytes).send();
        files[role] = json!({"asset": taken(upload.await.expect("an answer")).await});
    }
    let fails: Value = serde_json::from_str(FAILS).expect("JSON");
    let batch = json!({"defaults": files, "items": [{"config": fails}, {}]});
    let id = taken(client().post(at("/v1/batches")).json(&batch).send().await.expect("an answer")).await;
    let path = at(&format!("/v1/batches/{id}"));
    let ended = client().get(&path).header("prefer", "wait=60").send().await.expect("an answer");
    let ended: Value = read(ended).await;
    assert_eq!(ended["counts"]["succeeded"], 2, "{ended}");
    assert_eq!(ended["verdicts"]["fail"], 1, "how good they are: {ended}");
    let sum: u64 = ended["verdicts"].as_object().expect("counts").values().filter_map(Value::as_u64).sum();
    assert_eq!(sum, 2, "each has one: {ended}");

    let archive = client().get(format!("{path}/archive")).send().await.expect("an answer");
    let bytes = archive.bytes().await.expect("bytes");
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(bytes)).expect("an archive");
    let mut text = String::new();
    archive.by_name("manifest.json").expect("is there").read_to_string(&mut text).expect("text");
    let manifest: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(manifest["items"][0]["verdict"], "fail", "{manifest}");
    assert!(manifest["items"][1]["verdict_reason"].is_string(), "{manifest}");
    let mut page = String::new();
    archive.by_name("index.html").expect("is there").read_to_string(&mut page).expect("text");
    assert!(page.contains("✗ fail: 1") && page.contains("source.glb on target.glb"), "for people: {page}");
    assert!(!page.contains("<img"), "pictures were not asked for: {page}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_batch_and_its_archive_can_be_seen() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let at = |path: &str| format!("{}{path}", server.url);
    let upload = client().post(at("/v1/assets?filename=walk.glb")).body(samples::walk_clip()).send();
    let walk = json!({"asset": taken(upload.await.expect("an answer")).await});
    let upload = client().post(at("/v1/assets?filename=hero.glb")).body(samples::mannequin()).send();
    let hero = json!({"asset": taken(upload.await.expect("an answer")).await});
    let nobody = json!({"asset": "ast_00000000000000000000000000"});
    let items = json!([{"target": nobody}, {}, {"output": ["npz"]}, {"config": {"output": {"format": "png", "view": {"size": [64, 64]}}}}]);
    let batch = json!({"defaults": {"source": walk, "target": hero}, "items": items});
    let id = taken(client().post(at("/v1/batches")).json(&batch).send().await.expect("an answer")).await;
    let path = at(&format!("/v1/batches/{id}"));
    let ended: Value = read(client().get(&path).header("prefer", "wait=60").send().await.expect("an answer")).await;
    let picture = client().get(at(ended["thumbnail"].as_str().expect("a picture"))).send().await.expect("an answer");
    assert_eq!((picture.status().as_u16(), header(&picture, "content-type")), (200, "image/png"), "of the batch");
    let jobs: Value = read(client().get(format!("{path}/jobs")).send().await.expect("an answer")).await;
    let thumbnails: Vec<bool> =
        jobs["items"].as_array().expect("jobs").iter().map(|job| job["thumbnail"].is_string()).collect();
    assert_eq!(thumbnails, [false, true, true, true], "of each job that has what can be drawn: {jobs}");

    let archive = client().get(format!("{path}/archive?previews=true")).send().await.expect("an answer");
    let bytes = archive.bytes().await.expect("bytes");
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(bytes)).expect("an archive");
    let names: Vec<String> = archive.file_names().map(|name| name.expect("text").into_owned()).collect();
    let expected = [
        "manifest.json",
        "hero/walk.glb",
        "previews/hero/walk.webp",
        "hero/walk.npz",
        "previews/hero/walk-2.webp",
        "hero/walk.png",
        "index.html",
    ];
    assert_eq!(names, expected, "each with its picture behind it");
    let mut page = String::new();
    archive.by_name("index.html").expect("is there").read_to_string(&mut page).expect("text");
    for part in [
        "./previews/hero/walk.webp",
        "./previews/hero/walk-2.webp",
        "./hero/walk.png",
        "unknown_asset",
        "without a result: 1",
    ] {
        assert!(page.contains(part), "{part} in {page}");
    }
    let mut picture = Vec::new();
    archive.by_name("previews/hero/walk.webp").expect("is there").read_to_end(&mut picture).expect("whole");
    assert!(picture.starts_with(b"RIFF") && picture.windows(4).any(|word| word == b"ANIM"), "it moves");
    problem(
        client().get(at("/v1/batches/bat_00000000000000000000000000/preview.png")).send().await.expect("an answer"),
        404,
        "not_found",
    )
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn who_submits_is_told_the_verdict() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let files = tempfile::tempdir().expect("a temporary folder");
    for (name, bytes) in [("walk.glb", samples::walk_clip()), ("mannequin.glb", samples::mannequin())] {
        std::fs::write(files.path().join(name), bytes).expect("written");
    }
    let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
    command.args(["submit", "--service", &server.url, "--source", "walk.glb", "--target", "mannequin.glb"]);
    command.args(["--output", "out.glb"]).current_dir(files.path());
    let done = tokio::task::spawn_blocking(move || command.output()).await.expect("runs").expect("runs");
    let told = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.success() && told.contains("verdict: "), "{told}");
}
