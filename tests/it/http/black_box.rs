//! The binary as a process: bad requests, restarts, signals.

use std::{path::Path, process::Command};

use reqwest::{Client, Response, StatusCode, multipart};
use retargetd::samples;
use serde_json::{Value, json};

use super::support::{BVH, PATIENCE, ServiceProcess, form, header, json as read, problem, start_service, taken};

fn client() -> Client {
    Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client")
}

async fn upload(server: &ServiceProcess, body: &str) -> Response {
    let url = format!("{}/v1/assets?filename=a.bvh", server.url);
    client().post(url).body(body.to_owned()).send().await.expect("an answer")
}

async fn upload_of(server: &ServiceProcess, name: &str, bytes: Vec<u8>) -> Value {
    let url = format!("{}/v1/assets?filename={name}", server.url);
    read(client().post(url).body(bytes).send().await.expect("an answer")).await
}

#[tokio::test(flavor = "multi_thread")]
async fn every_bad_request_has_its_own_code_and_the_service_goes_on() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &["--max-file-bytes", "64KiB", "--max-document-bytes", "2KiB"]);
    let (client, url) = (client(), server.url.clone());
    let at = |path: &str| format!("{url}{path}");
    let post = |path: &str, body: String, media_type: &str| {
        client.post(at(path)).header("content-type", media_type).body(body).send()
    };
    let parts = |parts: &[(&'static str, &str)]| client.post(at("/v1/retarget")).multipart(form(parts)).send();

    problem(post("/v1/jobs", "x".into(), "text/csv").await.expect("an answer"), 415, "unsupported_media_type").await;
    problem(post("/v1/retarget", "x".into(), "text/csv").await.expect("an answer"), 415, "unsupported_media_type")
        .await;
    problem(post("/v1/jobs", "{".into(), "application/json").await.expect("an answer"), 400, "malformed_request").await;
    let typo = json!({"source": {"asset": "a"}, "target": {"asset": "a"}, "sorce_rest": {}}).to_string();
    let typo =
        problem(post("/v1/jobs", typo, "application/json").await.expect("an answer"), 422, "unknown_field").await;
    assert_eq!(typo["errors"][0]["did_you_mean"][0], "source_rest", "the nearest name: {typo}");
    let ids = json!({"source": {"asset": "a"}, "target": {"asset": "a"}}).to_string();
    let ids = problem(post("/v1/jobs", ids, "application/json").await.expect("an answer"), 422, "invalid_value").await;
    assert_eq!(ids["errors"][0]["pointer"], "/source/asset", "where: {ids}");
    let unknown = "ast_00000000000000000000000000";
    let gone = json!({"source": {"asset": unknown}, "target": {"asset": unknown}}).to_string();
    problem(post("/v1/jobs", gone, "application/json").await.expect("an answer"), 422, "unknown_asset").await;
    let large = format!("{{\"labels\": {{\"a\": \"{}\"}}}}", "x".repeat(4096));
    let large =
        problem(post("/v1/jobs", large, "application/json").await.expect("an answer"), 413, "body_too_large").await;
    assert_eq!((&large["limit"], &large["maximum"]), (&json!("document_bytes"), &json!(2048)), "which limit");

    problem(parts(&[("source", BVH)]).await.expect("an answer"), 422, "missing_part").await;
    let part = problem(parts(&[("source", BVH), ("taget", BVH)]).await.expect("an answer"), 422, "unknown_part").await;
    assert_eq!(part["errors"][0]["did_you_mean"][0], "target", "the nearest name: {part}");
    problem(parts(&[("source", BVH), ("source", BVH)]).await.expect("an answer"), 422, "repeated_part").await;
    let nonsense = problem(parts(&[("source", "nonsense")]).await.expect("an answer"), 415, "unsupported_format").await;
    assert_eq!(nonsense["part"], "source", "which part: {nonsense}");
    let cut = "--b\r\ncontent-disposition: form-data; name=\"source\"; filename=\"a.bvh\"\r\n\r\nHIERARCHY";
    let cut = post("/v1/retarget", cut.into(), "multipart/form-data; boundary=b").await.expect("an answer");
    problem(cut, 400, "malformed_request").await;

    problem(upload(&server, "nonsense").await, 415, "unsupported_format").await;
    problem(upload(&server, "").await, 415, "unsupported_format").await;
    let too_large = problem(upload(&server, &"HIERARCHY".repeat(10_000)).await, 413, "body_too_large").await;
    assert_eq!(too_large["limit"], "file_bytes", "which limit: {too_large}");
    let digest = "sha-256=:47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=:";
    let wrong = client.post(at("/v1/assets")).header("content-digest", digest).body(BVH).send().await;
    problem(wrong.expect("an answer"), 400, "digest_mismatch").await;

    let get = |path: &str| client.get(at(path)).send();
    problem(get(&format!("/v1/assets/{unknown}")).await.expect("an answer"), 404, "not_found").await;
    problem(get("/v1/jobs/../../etc/passwd").await.expect("an answer"), 404, "not_found").await;
    problem(get("/v1/results/res_").await.expect("an answer"), 404, "not_found").await;
    let method = client.put(at("/v1/jobs")).send().await.expect("an answer");
    assert!(header(&method, "allow").contains("POST"), "what is allowed");
    problem(method, 405, "method_not_allowed").await;

    let blobs = std::fs::read_dir(data.path().join("blobs")).expect("a folder").count();
    assert_eq!(blobs, 0, "none of this was kept");
    assert_eq!(upload(&server, BVH).await.status(), StatusCode::CREATED, "the service goes on");
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_restart_keeps_assets_and_jobs() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &["--workers", "1"]);
    let asset = taken(upload(&server, BVH).await).await;
    let body = json!({"source": {"asset": asset}, "target": {"asset": asset}});
    let answer = client().post(format!("{}/v1/jobs", server.url)).json(&body).send().await.expect("an answer");
    assert_eq!(answer.status(), StatusCode::ACCEPTED, "taken on");
    let job = taken(answer).await;
    // Killed, not stopped: what was acknowledged must be there without any goodbye.
    drop(server);
    let server = start_service(data.path(), &["--workers", "1"]);
    let again = upload(&server, BVH).await;
    assert_eq!(again.status(), StatusCode::OK, "the same bytes are there");
    assert_eq!(read(again).await["id"], asset.as_str(), "under the same id");
    let wait = client().get(format!("{}/v1/jobs/{job}", server.url)).header("prefer", "wait=30");
    let ended = read(wait.send().await.expect("an answer")).await;
    let state = ended["state"].as_str().unwrap_or_default();
    assert!(["succeeded", "failed"].contains(&state), "the job came to an end: {ended}");
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

#[test]
fn one_server_per_data_folder_and_all_bad_settings_at_once() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let _server = start_service(data.path(), &[]);
    let (code, text) = serve(data.path(), &["--listen", "127.0.0.1:0"]);
    assert_eq!(code, Some(4), "not started: {text}");
    assert!(text.contains("another server is using the data folder"), "says why: {text}");
    let (code, text) = serve(data.path(), &["--listen", "here", "--job-timeout", "soon"]);
    assert_eq!(code, Some(2), "bad usage: {text}");
    assert!(text.contains("--listen") && text.contains("RETARGETD_JOB_TIMEOUT"), "both are named: {text}");
}

fn serve(data: &Path, flags: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
    let output = command.args(["serve", "--log", "error", "--data"]).arg(data).args(flags).output().expect("it runs");
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn health_tells_ready_from_gone() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let health = |url: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
        command.args(["health", "--url", url]).output().expect("it runs").status.code()
    };
    assert_eq!(health(&server.url), Some(0), "ready");
    let url = server.url.clone();
    drop(server);
    assert_eq!(health(&url), Some(4), "gone");
}

/// The addresses that a page names in `src` and `href`.
fn places(page: &str) -> Vec<String> {
    let named = ["src=\"", "href=\""].into_iter().flat_map(|key| page.split(key).skip(1));
    named
        .filter_map(|rest| rest.split(['"', '#']).next().map(str::to_owned))
        .filter(|place| !place.is_empty())
        .collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn the_docs_load_nothing_from_elsewhere() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let client = client();
    let get = |path: &str| client.get(format!("{}{path}", server.url)).send();
    let explorer = get("/docs/api/").await.expect("an answer");
    assert!(header(&explorer, "content-security-policy").starts_with("default-src 'self'"), "nothing else may load");
    let text = explorer.text().await.expect("a page");
    let loaded = places(&text);
    assert!(loaded.len() >= 3, "scripts and styles: {text}");
    for place in loaded {
        assert!(!place.contains("//"), "'{place}' is no place of our own");
        let path = format!("/docs/api/{}", place.trim_start_matches("./"));
        assert_eq!(get(&path).await.expect("an answer").status(), StatusCode::OK, "'{path}' is there");
    }
    let edits = get("/docs/edits").await.expect("an answer").text().await.expect("a page");
    assert!(edits.contains("<svg") && !edits.contains("https://"), "edits are drawn, with nothing from elsewhere");
    assert!(edits.contains("<nav>") && edits.contains("/docs/guide/editing"), "and lead to the other pages");
    let script = get("/docs/api/swagger-initializer.js").await.expect("an answer").text().await.expect("a script");
    assert!(script.contains("/openapi.json") && !script.contains("https://"), "it shows our document: {script}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_documents_are_served_linked_and_searchable() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let client = client();
    let get = |path: &str| client.get(format!("{}{path}", server.url)).send();
    let home = get("/docs").await.expect("an answer");
    assert!(header(&home, "content-security-policy").starts_with("default-src 'self'"), "nothing else may load");
    let links = places(&home.text().await.expect("a page"));
    assert!(links.len() >= 30, "the home page links to every page: {links:?}");
    for link in links.iter().filter(|link| !link.contains("://")) {
        assert_eq!(get(link).await.expect("an answer").status(), StatusCode::OK, "'{link}' is there");
    }
    let feet = get("/docs/guide/feet").await.expect("an answer").text().await.expect("a page");
    assert!(feet.contains("<h1 id=\"feet\">Feet</h1>") && feet.contains("<pre><code"), "Markdown is rendered");
    let index: serde_json::Value =
        get("/docs/site/search.json").await.expect("an answer").json().await.expect("the index of the search");
    let found = |word: &str| {
        index
            .as_array()
            .into_iter()
            .flatten()
            .any(|section| section["text"].as_str().is_some_and(|text| text.contains(word)))
    };
    assert!(found("webhook-signature") && found("floor_penetration"), "guide and reference are searched");
    assert_eq!(get("/docs/nothing").await.expect("an answer").status(), StatusCode::NOT_FOUND, "no such page");
    let problems = client.get(format!("{}/problems", server.url)).header("accept", "text/html").send();
    let problems = problems.await.expect("an answer").text().await.expect("a page");
    assert!(problems.contains("<tr id=\"queue_full\">"), "the type of a problem leads to its row");
}

#[tokio::test(flavor = "multi_thread")]
async fn browsers_are_told_problems_on_a_page() {
    const BROWSER: &str = "text/html,application/xhtml+xml,*/*;q=0.8";
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let get = async |path: &str, accept: &str| {
        let request = client().get(format!("{}{path}", server.url)).header("accept", accept);
        request.send().await.expect("an answer")
    };
    let cases = [
        ("/nothing", "there is no such route"),
        ("/docs/nothing", "GET /docs lists"),
        ("/v1/jobs/7", "GET /v1/jobs lists"),
        ("/v1/presets/%3Cb%3E", "&lt;b&gt;"),
    ];
    for (path, told) in cases {
        let answer = get(path, BROWSER).await;
        let kind = (answer.status().as_u16(), header(&answer, "content-type"));
        assert_eq!(kind, (404, "text/html; charset=utf-8"), "{path}");
        assert!(header(&answer, "content-security-policy").contains("style-src 'self'"), "it may have its style");
        let page = answer.text().await.expect("text");
        assert!(page.contains("<nav>") && page.contains("/problems#not_found"), "{path}: {page}");
        assert!(page.contains(told) && !page.contains("<b>"), "{path}: {page}");
    }
    problem(get("/nothing", "*/*").await, 404, "not_found").await;
    let similar = problem(get("/v1/job", "*/*").await, 404, "not_found").await;
    assert!(similar["hint"].as_str().is_some_and(|hint| hint.starts_with("did you mean /v1/jobs?")), "{similar}");
}

/// What is wrong with a config that stands in a JSON body is pointed to in the body.
#[tokio::test(flavor = "multi_thread")]
async fn pointers_lead_into_the_body_that_was_sent() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let walk = json!({"asset": upload_of(&server, "walk.glb", samples::walk_clip()).await["id"]});
    let hero = json!({"asset": upload_of(&server, "hero.glb", samples::mannequin()).await["id"]});
    let body = json!({"source": walk, "target": hero, "config": {"alighn": "off"}});
    for path in ["/v1/retarget", "/v1/edits", "/v1/mapping-suggestions", "/v1/config-checks"] {
        let mut body = body.clone();
        if path == "/v1/edits" {
            body.as_object_mut().expect("an object").remove("target");
        }
        let request = client().post(format!("{}{path}", server.url)).json(&body).send();
        let told = problem(request.await.expect("an answer"), 422, "unknown_field").await;
        assert_eq!(told["errors"][0]["pointer"], "/config/alighn", "{path}: {told}");
    }
    let batch = json!({"items": [body], "validate_only": true});
    let request = client().post(format!("{}/v1/batches", server.url)).json(&batch).send();
    let told = read(request.await.expect("an answer")).await;
    assert_eq!(told["bad_items"][0]["problem"]["errors"][0]["pointer"], "/items/0/config/alighn", "{told}");
    let part = |bytes: Vec<u8>, name: &'static str| multipart::Part::bytes(bytes).file_name(name);
    let parts = multipart::Form::new()
        .part("source", part(samples::walk_clip(), "walk.glb"))
        .part("target", part(samples::mannequin(), "hero.glb"))
        .text("config", r#"{"alighn": "off"}"#);
    let request = client().post(format!("{}/v1/retarget", server.url)).multipart(parts).send();
    let told = problem(request.await.expect("an answer"), 422, "unknown_field").await;
    assert_eq!((&told["part"], &told["errors"][0]["pointer"]), (&json!("config"), &json!("/alighn")), "of a part");
}

/// What the last look at a worker saw is nothing to tell of a job that has ended, however soon after its end it is looked at.
#[tokio::test(flavor = "multi_thread")]
async fn a_job_that_has_ended_has_no_progress_and_is_called_after_its_files() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let walk = upload_of(&server, "walk.glb", samples::walk_clip()).await;
    let first = upload_of(&server, "m.glb", samples::mannequin()).await;
    // The same bytes come again under another name, which counts from then on.
    let again = upload_of(&server, "hero_v2.glb", samples::mannequin()).await;
    assert_eq!((&again["id"], &again["file_name"]), (&first["id"], &json!("hero_v2.glb")), "{again}");
    let body = json!({"source": {"asset": walk["id"]}, "target": {"asset": first["id"]}});
    for _ in 0..8 {
        let request = client().post(format!("{}/v1/jobs", server.url)).json(&body).header("cache-control", "no-cache");
        let job = read(request.header("prefer", "wait=30").send().await.expect("an answer")).await;
        assert!(job["state"] == "succeeded" && job["progress"].is_null(), "{job}");
        assert_eq!(job["results"][0]["file_name"], "walk_on_hero_v2.glb", "{job}");
    }
}
