//! What callers send costs no more than it is worth: memory, connections, processes and the share of others.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use reqwest::{Client, Method, StatusCode, header};
use retargetd::jobs::Scope;
use serde_json::json;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
    task::JoinSet,
};

use super::support::{BVH, PATIENCE, Service, ServiceProcess, json as read, problem, start_service, taken};

fn client() -> Client {
    Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client")
}

async fn connect(server: &ServiceProcess) -> TcpStream {
    TcpStream::connect(server.url.trim_start_matches("http://")).await.expect("connects")
}

/// Sends a head and then the same chunk up to so many times, as long as it is taken. Gives the answer, and how many chunks were sent.
async fn send_chunks(
    server: &ServiceProcess,
    head: &str,
    chunk: &str,
    times: usize,
    pause: Duration,
) -> (String, usize) {
    let (mut reader, mut writer) = connect(server).await.into_split();
    let framed = format!("{:x}\r\n{chunk}\r\n", chunk.len());
    let head = head.to_owned();
    let sender = tokio::spawn(async move {
        writer.write_all(head.as_bytes()).await.expect("writes");
        let mut sent = 0;
        while sent < times && writer.write_all(framed.as_bytes()).await.is_ok() {
            sent += 1;
            tokio::time::sleep(pause).await;
        }
        sent
    });
    let mut answer = vec![0; 4096];
    let count = tokio::time::timeout(PATIENCE, reader.read(&mut answer)).await.expect("it ends").unwrap_or(0);
    drop(reader);
    let sent = tokio::time::timeout(PATIENCE, sender).await.expect("nobody takes more").expect("no panic");
    (String::from_utf8_lossy(&answer[..count]).into_owned(), sent)
}

/// How much memory something takes at its peak, in MiB. Only on Linux; 0 elsewhere.
async fn extra_memory(server: &ServiceProcess, work: impl Future<Output = ()>) -> f64 {
    let before = server.memory_mebibytes();
    work.await;
    server.most_memory_mebibytes() as f64 - before
}

const ID: &str = "ast_01j9z3k8m0q4r6t8v0x2y4a6c8";

/// Bodies of about a mebibyte that ask for very much more.
fn bombs() -> [(&'static str, String); 3] {
    let file = format!(r#"{{"asset":"{ID}"}}"#);
    let files = |count: usize| vec![file.as_str(); count].join(",");
    let values = format!("[{}0]", "0,".repeat(490_000));
    let text = "x".repeat(1_000_000);
    let matrix = |config: &str| {
        format!(
            r#"{{"matrix":{{"specs":[{{"config":{{"x":{config}}}}}],"sources":[{}],"targets":[{}]}}}}"#,
            files(32),
            files(31)
        )
    };
    let items = vec![r#"{"labels":{}}"#; 1000].join(",");
    let defaults = format!(
        r#"{{"defaults":{{"source":{file},"target":{file},"config":{{"x":"{text}"}}}},"items":[{items}],"validate_only":true}}"#
    );
    [
        ("values in a matrix", matrix(&values)),
        ("a text in a matrix", matrix(&format!("\"{text}\""))),
        ("defaults", defaults),
    ]
}

#[tokio::test(flavor = "multi_thread")]
async fn a_batch_is_multiplied_before_it_is_made() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let (client, url) = (client(), format!("{}/v1/batches", server.url));
    // The first request takes what the next ones have.
    client.post(&url).json(&json!({"items": []})).send().await.expect("an answer");
    for (name, body) in bombs() {
        assert!(body.len() <= 1 << 20, "{name}: small enough to be read: {}", body.len());
        let began = Instant::now();
        let extra = extra_memory(&server, async {
            let request = client.post(&url).header("content-type", "application/json").body(body);
            let refused = problem(request.send().await.expect("an answer"), 413, "body_too_large").await;
            assert!(refused["limit"].is_string(), "{name}: the limit is named: {refused}");
        })
        .await;
        let took = began.elapsed();
        assert!(extra < 32.0, "{name}: {extra} MiB");
        let most = if cfg!(debug_assertions) { 2000 } else { 50 };
        assert!(took < Duration::from_millis(most), "{name}: {took:?}");
    }
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

#[tokio::test(flavor = "multi_thread")]
async fn items_with_the_same_config_are_as_good_as_before() {
    let service = Service::start(&[]).await;
    let asset = service.upload(BVH).await;
    let file = json!({"asset": asset});
    let matrix = json!({"sources": vec![&file; 20], "targets": vec![&file; 20], "specs": [{"config": {"note": "x".repeat(20_000)}}]});
    let body = json!({"matrix": matrix, "labels": {"name": "many"}});
    let batch = read(service.post("/v1/batches", &body).await).await;
    assert_eq!(batch["items"], 400, "8 MB of configs are taken: {batch}");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_stands_before_and_between_parts_is_short() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let head = |path: &str, begin: &str| {
        format!(
            "POST {path} HTTP/1.1\r\nhost: localhost\r\ncontent-type: multipart/form-data; boundary=b\r\ntransfer-encoding: \
             chunked\r\n\r\n{:x}\r\n{begin}\r\n",
            begin.len()
        )
    };
    let chunk = "x".repeat(64 << 10);
    for path in ["/v1/retarget", "/v1/jobs", "/v1/edits", "/v1/mapping-suggestions", "/v1/config-checks"] {
        for (what, begin) in [
            ("a preamble", "hello"),
            ("headers", "--b\r\nX: "),
            ("a name", "--b\r\ncontent-disposition: form-data; name=\""),
        ] {
            let extra = extra_memory(&server, async {
                let (answer, _) = send_chunks(&server, &head(path, begin), &chunk, 2000, Duration::ZERO).await;
                assert!(answer.starts_with("HTTP/1.1 400"), "{path}, {what}: {answer}");
            })
            .await;
            assert!(extra < 32.0, "{path}, {what}: {extra} MiB");
        }
    }
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_form_without_a_length_is_bounded_as_a_whole() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &["--max-request-bytes", "256KiB"]);
    let part = "--b\r\ncontent-disposition: form-data; name=\"config\"\r\n\r\n";
    let head = format!(
        "POST /v1/retarget HTTP/1.1\r\nhost: localhost\r\ncontent-type: multipart/form-data; boundary=b\r\ntransfer-encoding: \
         chunked\r\n\r\n{:x}\r\n{part}\r\n",
        part.len()
    );
    let (answer, _) = send_chunks(&server, &head, &"x".repeat(32 << 10), 100, Duration::ZERO).await;
    assert!(answer.starts_with("HTTP/1.1 413") && answer.contains("request_bytes"), "the limit is named: {answer}");
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

#[tokio::test(flavor = "multi_thread")]
async fn an_upload_that_trickles_ends() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &["--upload-idle-timeout", "1s"]);
    let head = "POST /v1/assets?filename=a.bvh HTTP/1.1\r\nhost: localhost\r\ntransfer-encoding: chunked\r\n\r\n";
    let began = Instant::now();
    let (answer, _) = send_chunks(&server, head, "x", 200, Duration::from_millis(100)).await;
    assert!(answer.starts_with("HTTP/1.1 408") && answer.contains("min_transfer_rate"), "{answer}");
    assert!(began.elapsed() < Duration::from_secs(10), "soon: {:?}", began.elapsed());
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

#[tokio::test(flavor = "multi_thread")]
async fn answers_that_are_not_read_give_their_places_back() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let flags = ["--max-connections", "8", "--answer-idle-timeout", "2s"];
    let server = start_service(data.path(), &flags);
    let client = client();
    let mut unread = Vec::new();
    for _ in 0..8 {
        let mut stream = connect(&server).await;
        let request = "GET /openapi.json HTTP/1.1\r\nhost: localhost\r\n\r\n".repeat(100);
        stream.write_all(request.as_bytes()).await.expect("writes");
        unread.push(stream);
    }
    tokio::time::sleep(Duration::from_millis(500)).await;
    let ask = async |path: &str| client.get(format!("{}{path}", server.url)).send().await;
    let alive = ask("/livez").await.expect("an answer, although there are no places");
    assert_eq!(alive.status(), StatusCode::OK, "alive");
    let health =
        std::process::Command::new(env!("CARGO_BIN_EXE_retargetd")).args(["health", "--url", &server.url]).status();
    assert!(health.expect("it runs").success(), "what containers ask is answered");
    let refused = ask("/v1/jobs").await.expect("an answer");
    assert_eq!(refused.status(), StatusCode::SERVICE_UNAVAILABLE, "others are told");
    assert!(refused.headers().contains_key(header::RETRY_AFTER), "and when to come again");
    let began = Instant::now();
    while !ask("/v1/jobs").await.is_ok_and(|answer| answer.status() == StatusCode::OK) {
        assert!(began.elapsed() < Duration::from_secs(20), "who does not read is cut off");
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    drop(unread);
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

#[tokio::test(flavor = "multi_thread")]
async fn one_address_cannot_have_all_connections() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &["--max-connections", "16", "--max-peer-connections", "4"]);
    let mut silent = Vec::new();
    for _ in 0..12 {
        silent.push(connect(&server).await);
    }
    let from = |address: [u8; 4]| {
        let client = Client::builder().timeout(PATIENCE).no_proxy().local_address(std::net::IpAddr::from(address));
        let request = client.build().expect("a client").get(format!("{}/v1/jobs", server.url));
        async { request.send().await.map(|answer| answer.status()) }
    };
    let same = from([127, 0, 0, 1]).await;
    assert!(same.is_err() || same.is_ok_and(|status| status == StatusCode::SERVICE_UNAVAILABLE), "it has its share");
    assert_eq!(from([127, 0, 0, 2]).await.expect("an answer"), StatusCode::OK, "others come in");
    drop(silent);
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

/// A file that is taken for a BVH and takes a while to be refused.
fn large_bvh() -> String {
    format!("{BVH}{}", " {\n".repeat(4 << 20))
}

#[tokio::test(flavor = "multi_thread")]
async fn files_are_read_when_it_is_their_turn() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &["--workers", "1"]);
    let client = client();
    let upload = client.post(format!("{}/v1/assets?filename=a.bvh", server.url)).body(large_bvh());
    let id = taken(upload.send().await.expect("an answer")).await;
    let file = json!({"asset": id});
    let job = json!({"source": file, "target": file, "source_rest": file, "target_rest": file});
    let extra = extra_memory(&server, async {
        let mut asked = JoinSet::new();
        for number in 0..48 {
            let request = match number % 3 {
                0 => client.get(format!("{}/v1/assets/{id}/skeleton", server.url)),
                1 => client.post(format!("{}/v1/mapping-suggestions", server.url)).json(&job),
                _ => client.post(format!("{}/v1/explanations?frame=0&joint=Hips", server.url)).json(&job),
            };
            asked.spawn(async move { request.send().await.expect("an answer").status() });
        }
        for status in asked.join_all().await {
            assert!(status.is_client_error() || status == StatusCode::SERVICE_UNAVAILABLE, "it is no BVH: {status}");
        }
    })
    .await;
    // Four files of 12 MiB at a time, and the same on their way to the engine.
    assert!(extra < 160.0, "{extra} MiB");
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

#[tokio::test(flavor = "multi_thread")]
async fn configs_of_batches_take_turns() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &["--workers", "2", "--sweep-interval", "1s"]);
    let client = client();
    let upload = client.post(format!("{}/v1/assets?filename=a.bvh", server.url)).body(BVH);
    let file = json!({"asset": taken(upload.send().await.expect("an answer")).await});
    let mut asked = JoinSet::new();
    for number in 0..40 {
        let item = |item: usize| json!({"source": file, "target": file, "config": {"edit": {"fps": 10 + item, "range": [0, number]}}});
        let body = json!({"items": (0..20).map(item).collect::<Vec<_>>(), "validate_only": true});
        let request = client.post(format!("{}/v1/batches", server.url)).json(&body);
        asked.spawn(async move { request.send().await.expect("an answer").status() });
    }
    let mut most = 0;
    while !asked.is_empty() {
        most = most.max(server.children());
        while let Some(status) = asked.try_join_next() {
            assert_eq!(status.expect("no panic"), StatusCode::OK, "it is checked");
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    assert!(most <= 5, "{most} engine processes for two workers");
    assert!(server.children() <= 3, "{} of them stay", server.children());
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

#[tokio::test(flavor = "multi_thread")]
async fn pages_of_others_do_not_come_in_where_nobody_is_asked_for_a_key() {
    let service =
        Service::start(&[("cors_origins", "https://studio.example"), ("allowed_hosts", "retarget.lan")]).await;
    let own = format!("http://{}", service.address());
    let ask = |method: Method, path: &str, name: &str, value: &str| {
        service.client.request(method, service.at(path)).header(name.to_owned(), value.to_owned()).send()
    };
    for host in ["evil.example", "evil.example:8080", "127.0.0.1.evil.example"] {
        for (method, path) in
            [(Method::GET, "/v1/jobs"), (Method::POST, "/v1/assets?filename=a.bvh"), (Method::GET, "/metrics")]
        {
            problem(ask(method, path, "host", host).await.expect("an answer"), 403, "foreign_page").await;
        }
    }
    for origin in ["https://evil.example", "null", "http://127.0.0.1:1"] {
        for (method, path) in [(Method::GET, "/v1/jobs"), (Method::POST, "/v1/retarget")] {
            problem(ask(method, path, "origin", origin).await.expect("an answer"), 403, "foreign_page").await;
        }
    }
    for (name, value) in
        [("host", "retarget.lan"), ("host", "localhost:1"), ("origin", &*own), ("origin", "https://studio.example")]
    {
        let answer = ask(Method::GET, "/v1/jobs", name, value).await.expect("an answer");
        assert_eq!(answer.status(), StatusCode::OK, "{name}: {value}");
    }
    let key = json!({"principal": "me", "scopes": ["admin"]});
    problem(service.post("/v1/keys", &key).await, 403, "forbidden").await;
    problem(service.get("/v1/keys").await, 403, "forbidden").await;
    service.stop().await;

    let guarded = Service::start(&[("authentication", "keys")]).await;
    let ann = guarded.key("ann", &[Scope::Read]).await;
    let behind_proxy = guarded.client.get(guarded.at("/v1/jobs")).header("host", "retarget.example");
    let answer = behind_proxy.bearer_auth(ann.reveal()).send().await.expect("an answer");
    assert_eq!(answer.status(), StatusCode::OK, "whoever shows a key may call it as they like");
    guarded.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn one_principal_cannot_have_all_requests() {
    let settings = [("authentication", "keys"), ("max_principal_requests", "8"), ("max_concurrent_requests", "24")];
    let service = Arc::new(Service::start(&settings).await);
    let all = [Scope::Read, Scope::Write];
    let (ann, bob) = (service.key("ann", &all).await, service.key("bob", &all).await);
    let upload = service.client.post(service.at("/v1/assets?filename=a.bvh")).bearer_auth(ann.reveal()).body(BVH);
    let asset = taken(upload.send().await.expect("an answer")).await;
    let body = json!({"source": {"asset": asset}, "target": {"asset": asset}, "config": {"say": "wait"}});
    let job = service.client.post(service.at("/v1/jobs")).bearer_auth(ann.reveal()).json(&body);
    let job = taken(job.send().await.expect("an answer")).await;
    let path = service.at(&format!("/v1/jobs/{job}"));
    let mut polls = JoinSet::new();
    for _ in 0..64 {
        let poll = service.client.get(&path).bearer_auth(ann.reveal()).header("prefer", "wait=30");
        polls.spawn(async move { poll.send().await.expect("an answer").status() });
    }
    // Refusals come at once; those who may wait do.
    for _ in 0..56 {
        let status = polls.join_next().await.expect("an answer").expect("no panic");
        assert_eq!(status, StatusCode::SERVICE_UNAVAILABLE, "more than its share");
    }
    let metrics = service.client.get(service.at("/metrics")).bearer_auth(bob.reveal()).send().await.expect("an answer");
    problem(metrics, 403, "forbidden").await;
    let began = Instant::now();
    let other = service.client.get(service.at("/v1/jobs")).bearer_auth(bob.reveal()).send().await.expect("an answer");
    assert_eq!(other.status(), StatusCode::OK, "others come in");
    assert!(began.elapsed() < Duration::from_secs(2), "at once: {:?}", began.elapsed());
    polls.abort_all();
}

#[tokio::test(flavor = "multi_thread")]
async fn places_in_the_queue_are_told_by_a_job_and_by_lists() {
    let service = Service::start(&[("workers", "0")]).await;
    let asset = service.upload(BVH).await;
    let job = read(service.job(&asset, "nothing").await).await;
    let path = format!("/v1/jobs/{}", job["id"].as_str().expect("an id"));
    assert_eq!(read(service.get(&path).await).await["queue_position"], 1, "it waits");
    let list = read(service.get("/v1/jobs?state=queued").await).await;
    assert_eq!(list["items"][0]["queue_position"], 1, "one query counts for the whole page: {list}");
    service.stop().await;
}
