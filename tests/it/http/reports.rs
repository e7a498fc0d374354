//! Reports as JSON and as pages, and explanations, with the real engine.

use reqwest::{Client, StatusCode, multipart};
use retargetd::samples;
use serde_json::{Value, json};

use super::support::{PATIENCE, json as read, problem, start_service, taken};

fn client() -> Client {
    Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client")
}

fn form() -> multipart::Form {
    let part = |bytes: Vec<u8>, name: &'static str| multipart::Part::bytes(bytes).file_name(name);
    multipart::Form::new()
        .part("source", part(samples::walk_clip(), "walk.glb"))
        .part("target", part(samples::mannequin(), "mannequin.glb"))
}

#[tokio::test(flavor = "multi_thread")]
async fn a_report_is_json_for_programs_and_a_page_for_people() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let request = client().post(format!("{}/v1/jobs", server.url)).multipart(form()).header("prefer", "wait=30");
    let job = read(request.send().await.expect("an answer")).await;
    let report = format!("{}{}", server.url, job["links"]["report"].as_str().expect("/v1/jobs/{id}/report"));
    let get = |accept: &'static str| client().get(&report).header("accept", accept).send();

    let answer = get("*/*").await.expect("an answer");
    assert_eq!(answer.headers()["vary"], "accept", "caches know");
    let measured = read(answer).await;
    let metrics = measured["measures"]["metrics"].as_object().expect("metrics");
    assert!(metrics.values().all(|metric| metric["verdict"].is_string() && metric["unit"].is_string()), "{metrics:?}");

    let page = get("text/html,application/xhtml+xml,*/*;q=0.8").await.expect("an answer");
    assert_eq!(page.headers()["content-type"], "text/html; charset=utf-8", "a page");
    let policy = page.headers()["content-security-policy"].to_str().expect("text").to_owned();
    assert!(policy.contains("default-src 'none'") && !policy.contains("script-src"), "nothing may run: {policy}");
    let page = page.text().await.expect("text");
    assert!(page.contains("<svg") && page.contains("foot slide"), "plots and verdicts");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_joint_is_explained_by_form_and_by_asset() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let url = |query: &str| format!("{}/v1/explanations?{query}", server.url);
    let by_form = client().post(url("frame=20&joint=lowerarm_l")).multipart(form()).send().await.expect("an answer");
    assert_eq!(by_form.status(), StatusCode::OK, "it can be explained");
    let by_form: Value = read(by_form).await;
    assert_eq!((&by_form["joint"], &by_form["frame"]), (&json!("lowerarm_l"), &json!(20)), "what was asked");
    let names: Vec<&str> =
        by_form["contributions"].as_array().expect("a list").iter().filter_map(|step| step["name"].as_str()).collect();
    assert_eq!(names[..3], ["rest", "alignment", "delta"], "from the rest pose on");

    let mut files = json!({});
    for (role, bytes) in [("source", samples::walk_clip()), ("target", samples::mannequin())] {
        let upload = client().post(format!("{}/v1/assets?filename={role}.glb", server.url)).body(bytes).send();
        files[role] = json!({"asset": taken(upload.await.expect("an answer")).await});
    }
    let by_asset = client().post(url("frame=20&joint=lowerarm_l")).json(&files).send().await.expect("an answer");
    assert_eq!(read(by_asset).await, by_form, "the same files, the same answer");

    let wrong = client().post(url("frame=20&joint=lowerarm")).json(&files).send().await.expect("an answer");
    let wrong = problem(wrong, 422, "unknown_joint").await;
    assert_eq!(wrong["errors"][0]["pointer"], "/joint", "{wrong}");
    let late = client().post(url("frame=9999&joint=lowerarm_l")).json(&files).send().await.expect("an answer");
    problem(late, 422, "invalid_value").await;
}
