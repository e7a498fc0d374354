//! Webhooks: every end is told at least once, signed, to nobody who must not be reached, and never in the way of jobs.

use std::{
    io::{BufRead, BufReader, Write},
    path::Path,
    process::{Command, Stdio},
    time::Duration,
};

use reqwest::StatusCode;
use retargetd::jobs::Scope;
use serde_json::{Value, json};

use super::{
    receiver::{Heard, Receiver, Reply},
    support::{BVH, PATIENCE, Service, ServiceProcess, header, json as read, problem, taken},
};
use crate::support::{python_with, skip};

/// Receivers on this machine, and retries that a test can wait for.
const LOCAL: [(&str, &str); 3] =
    [("outbound_allow", "127.0.0.0/8"), ("webhook_retries", "50ms,50ms,50ms,50ms"), ("webhook_timeout", "500ms")];

async fn local(more: &[(&str, &str)]) -> Service {
    Service::start(&[&LOCAL[..], more].concat()).await
}

/// A webhook, with its secret.
async fn webhook(service: &Service, url: &str, events: Value) -> Value {
    let answer = service.post("/v1/webhooks", &json!({"url": url, "events": events})).await;
    assert_eq!(answer.status(), StatusCode::CREATED, "it is made");
    let place = header(&answer, "location").to_owned();
    let webhook = read(answer).await;
    assert_eq!(place, format!("/v1/webhooks/{}", text(&webhook, "id")), "where it is");
    webhook
}

fn text<'a>(value: &'a Value, member: &str) -> &'a str {
    value[member].as_str().unwrap_or_else(|| panic!("'{member}' is a text: {value}"))
}

/// A job that has ended, whose config says that.
async fn ended(service: &Service, word: &str) -> Value {
    let asset = service.upload(BVH).await;
    let job = read(service.job(&asset, word).await).await;
    let path = format!("/v1/jobs/{}", text(&job, "id"));
    if word == "wait" {
        service.until(text(&job, "id"), "running").await;
        service.post(&format!("{path}/cancel"), &json!({})).await;
    }
    let wait = service.client.get(service.at(&path)).header("prefer", "wait=30");
    read(wait.send().await.expect("an answer")).await
}

/// The newest delivery to a webhook, when it is in that state.
async fn delivery(service: &Service, webhook: &Value, state: &str) -> Value {
    let path = format!("/v1/webhooks/{}/deliveries", text(webhook, "id"));
    let reached = async {
        loop {
            let page = read(service.get(&path).await).await;
            if page["items"][0]["state"] == state {
                return page["items"][0].clone();
            }
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    };
    tokio::time::timeout(PATIENCE, reached).await.unwrap_or_else(|_| panic!("a delivery is '{state}'"))
}

async fn counted(service: &Service, line: &str) -> bool {
    service.get("/metrics").await.text().await.expect("text").lines().any(|seen| seen.starts_with(line))
}

/// Whether everything that `part` says, `whole` says too.
fn is_said_by(part: &Value, whole: &Value) -> bool {
    match (part, whole) {
        (Value::Object(part), Value::Object(whole)) => {
            part.iter().all(|(name, part)| whole.get(name).is_some_and(|whole| is_said_by(part, whole)))
        }
        (Value::Array(part), Value::Array(whole)) => {
            part.len() == whole.len() && part.iter().zip(whole).all(|(part, whole)| is_said_by(part, whole))
        }
        _ => part == whole,
    }
}

/// Checks the signatures with the library of the scheme.
fn assert_signed(secret: &str, heard: &[Heard]) {
    let Some(python) = python_with("standardwebhooks") else {
        return skip("signatures by the library of Standard Webhooks, which is not installed; tests/run installs it");
    };
    let messages: Vec<Value> =
        heard.iter().map(|heard| json!({"headers": heard.headers, "body": heard.body})).collect();
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tools/standard_webhooks/verify.py");
    let mut command = Command::new(python);
    let mut child = command.arg(tool).arg(secret).stdin(Stdio::piped()).spawn().expect("the library runs");
    let input = json!(messages).to_string();
    child.stdin.take().expect("is piped").write_all(input.as_bytes()).expect("it reads");
    assert!(child.wait().expect("it ends").success(), "every message is signed");
}

#[tokio::test(flavor = "multi_thread")]
async fn every_end_is_told_signed_and_says_what_the_job_says() {
    let service = local(&[]).await;
    let receiver = Receiver::start(&[]);
    let all = webhook(&service, &receiver.url, json!(["job.succeeded", "job.failed", "job.canceled"])).await;
    let failures = Receiver::start(&[]);
    let picky = webhook(&service, &failures.url, json!(["job.failed"])).await;

    for (number, word) in ["nothing", "refuse", "wait"].into_iter().enumerate() {
        let job = ended(&service, word).await;
        let heard = receiver.hears(number + 1).await.pop().expect("a message");
        let message = heard.json();
        assert_eq!(text(&message, "type"), format!("job.{}", text(&job, "state")), "what happened");
        assert!(is_said_by(&message["data"], &job), "the job says all of this: {message} {job}");
        for member in ["id", "state", "kind", "labels", "results", "links"] {
            assert!(!message["data"][member].is_null(), "it has '{member}': {message}");
        }
        assert!(heard.body.len() < 20_000, "no more than receivers take");
        assert_eq!(
            (heard.path.as_str(), heard.headers["content-type"].as_str()),
            ("/hook", "application/json"),
            "where"
        );
    }
    let heard = receiver.heard();
    assert!(heard[0].json()["data"]["results"][0]["content"].is_string(), "what to fetch");
    assert_eq!(heard[1].json()["data"]["problem"]["code"], "no_animation", "why there is nothing to fetch");
    assert_signed(text(&all, "secret"), &heard);
    let told = failures.hears(1).await;
    assert_eq!((told.len(), told[0].json()["type"].as_str()), (1, Some("job.failed")), "only what it listens to");
    assert_signed(text(&picky, "secret"), &told);

    let list = service.get("/v1/webhooks").await.text().await.expect("text");
    assert!(list.contains(text(&all, "id")) && !list.contains("whsec_"), "no secrets afterwards: {list}");
    let made = delivery(&service, &all, "delivered").await;
    assert_eq!((&made["attempts"], &made["last_status"]), (&json!(1), &json!(204)), "how it went: {made}");
    assert_eq!(text(&made, "id"), heard[2].id(), "the same id everywhere");
    assert!(counted(&service, "retargetd_webhook_deliveries_total{result=\"delivered\"}").await, "counted");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_tells_the_webhook_that_it_names() {
    let service = local(&[]).await;
    let receiver = Receiver::start(&[]);
    let quiet = webhook(&service, &receiver.url, json!([])).await;
    ended(&service, "nothing").await;
    let asset = service.upload(BVH).await;
    let body = json!({"source": {"asset": asset}, "target": {"asset": asset}, "webhook": quiet["id"]});
    let job = read(service.post("/v1/jobs", &body).await).await;
    assert_eq!(job["webhook"], quiet["id"], "the job says so");
    let heard = receiver.hears(1).await;
    assert_eq!(heard[0].json()["data"]["id"], job["id"], "of that job, and of no other");
    service.until(text(&job, "id"), "succeeded").await;
    let again = service.post(&format!("/v1/jobs/{}/retry", text(&job, "id")), &json!({})).await;
    let again = read(again).await;
    let heard = receiver.hears(2).await;
    assert_eq!(heard[1].json()["data"]["retry_of"], job["id"], "and of its repetition {again}");

    let nobodys =
        json!({"source": {"asset": asset}, "target": {"asset": asset}, "webhook": "whk_00000000000000000000000000"});
    problem(service.post("/v1/jobs", &nobodys).await, 422, "unknown_webhook").await;
    let nonsense = json!({"source": {"asset": asset}, "target": {"asset": asset}, "webhook": "https://studio.example"});
    let nonsense = problem(service.post("/v1/jobs", &nonsense).await, 422, "invalid_value").await;
    assert_eq!(nonsense["errors"][0]["pointer"], "/webhook", "where");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_fails_is_sent_again_until_it_is_there() {
    let service = local(&[]).await;
    let receiver = Receiver::start(&[
        Reply::Silence,
        Reply::Status(500, ""),
        Reply::Status(302, "location: /elsewhere"),
        Reply::Status(429, "retry-after: 1"),
        Reply::EndlessBody,
    ]);
    let hook = webhook(&service, &receiver.url, json!(["job.succeeded"])).await;
    let job = ended(&service, "nothing").await;
    assert_eq!(job["state"], "succeeded", "the job does not wait for the receiver");
    let made = delivery(&service, &hook, "delivered").await;
    let heard = receiver.heard();
    assert_eq!(
        (heard.len(), &made["attempts"], &made["last_status"]),
        (5, &json!(5), &json!(200)),
        "each once: {made}"
    );
    assert!(heard.iter().all(|heard| heard.id() == text(&made, "id")), "one message under one id");
    assert!(heard.iter().all(|heard| heard.path == "/hook"), "redirects are not followed");
    let wait = heard[4].at - heard[3].at;
    assert!(wait >= Duration::from_millis(950), "left alone for as long as it asked: {wait:?}");
    assert_signed(text(&hook, "secret"), &heard);
    assert!(counted(&service, "retargetd_webhook_deliveries_total{result=\"retried\"}").await, "counted");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn who_is_gone_is_told_nothing_until_it_answers_a_ping() {
    let service = local(&[]).await;
    let receiver = Receiver::start(&[Reply::Status(410, ""), Reply::Status(503, "")]);
    let hook = webhook(&service, &receiver.url, json!(["job.succeeded"])).await;
    let path = format!("/v1/webhooks/{}", text(&hook, "id"));
    ended(&service, "nothing").await;
    let lost = delivery(&service, &hook, "failed").await;
    assert_eq!(lost["last_status"], 410, "why: {lost}");
    let disabled = read(service.get(&path).await).await;
    assert_eq!((text(&disabled, "state"), text(&disabled, "disabled_reason")), ("disabled", "gone"), "{disabled}");
    ended(&service, "nothing").await;
    let redeliver = format!("/v1/deliveries/{}/redeliver", text(&lost, "id"));
    problem(service.post(&redeliver, &json!({})).await, 409, "webhook_disabled").await;

    let ping = async || {
        let answer = service.post(&format!("{path}/ping"), &json!({})).await;
        assert_eq!(answer.status(), StatusCode::ACCEPTED, "on its way");
        header(&answer, "location").to_owned()
    };
    let missed = ping().await;
    delivery(&service, &hook, "failed").await;
    assert_eq!(read(service.get(&missed).await).await["attempts"], 1, "who pings wants to know now");
    assert_eq!(read(service.get(&path).await).await["state"], "disabled", "still");
    ping().await;
    delivery(&service, &hook, "delivered").await;
    assert_eq!(read(service.get(&path).await).await["state"], "enabled", "it is there again");
    assert_eq!(service.post(&redeliver, &json!({})).await.status(), StatusCode::ACCEPTED, "what it missed");
    let heard = receiver.hears(4).await;
    let kinds: Vec<_> = heard.iter().map(|heard| heard.json()["type"].as_str().expect("a type").to_owned()).collect();
    assert_eq!(kinds, ["job.succeeded", "ping", "ping", "job.succeeded"], "nothing in between");
    assert_eq!(heard[3].id(), text(&lost, "id"), "under the id that it had");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn who_fails_for_too_long_is_disabled() {
    let service = local(&[("webhook_retries", "20ms,100ms"), ("webhook_failing_period", "50ms")]).await;
    let receiver = Receiver::start(&vec![Reply::Status(500, ""); 20]);
    let hook = webhook(&service, &receiver.url, json!(["job.succeeded"])).await;
    ended(&service, "nothing").await;
    let lost = delivery(&service, &hook, "failed").await;
    assert_eq!((&lost["attempts"], &lost["last_status"]), (&json!(3), &json!(500)), "given up: {lost}");
    let disabled = read(service.get(&format!("/v1/webhooks/{}", text(&hook, "id"))).await).await;
    assert_eq!(disabled["disabled_reason"], "failing", "{disabled}");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_new_secret_signs_at_once_and_the_old_one_along_for_a_day() {
    let service = local(&[]).await;
    let receiver = Receiver::start(&[]);
    let hook = webhook(&service, &receiver.url, json!(["job.succeeded"])).await;
    let rotated = service.post(&format!("/v1/webhooks/{}/secret-rotations", text(&hook, "id")), &json!({})).await;
    let rotated = read(rotated).await;
    assert!(rotated["secret"] != hook["secret"] && rotated["old_secret_until"].is_string(), "another: {rotated}");
    ended(&service, "nothing").await;
    let heard = receiver.hears(1).await;
    assert_eq!(heard[0].headers["webhook-signature"].split(' ').count(), 2, "both sign");
    assert_signed(text(&rotated, "secret"), &heard);
    assert_signed(text(&hook, "secret"), &heard);
    service.clock.advance(Duration::from_hours(25));
    ended(&service, "nothing").await;
    let heard = receiver.hears(2).await;
    assert_eq!(heard[1].headers["webhook-signature"].split(' ').count(), 1, "the old one no more");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_service_goes_nowhere_that_it_must_not() {
    let service = Service::start(&[("max_webhooks", "2"), ("webhook_retries", "")]).await;
    let refused = async |url: &str| {
        let problem = problem(service.post("/v1/webhooks", &json!({"url": url})).await, 422, "forbidden_url").await;
        assert_eq!(problem["errors"][0]["pointer"], "/url", "where");
    };
    for url in
        ["http://studio.example/", "https://127.0.0.1/", "https://[::ffff:10.0.0.1]/", "https://a:b@studio.example/"]
    {
        refused(url).await;
    }
    refused("https://169.254.169.254/latest/meta-data").await;
    assert!(counted(&service, "retargetd_outbound_blocked_total{reason=\"link_local\"}").await, "counted");

    // A name tells nothing; what it stands for does.
    let receiver = Receiver::start(&[]);
    let port = receiver.url.rsplit(':').next().expect("a port").trim_end_matches("/hook");
    let hook = webhook(&service, &format!("https://localhost:{port}/hook"), json!(["job.succeeded"])).await;
    ended(&service, "nothing").await;
    let lost = delivery(&service, &hook, "failed").await;
    assert_eq!(lost["last_error"], "forbidden_address", "{lost}");
    assert!(receiver.heard().is_empty(), "nobody came");

    webhook(&service, "https://studio.example/", json!([])).await;
    let full = problem(
        service.post("/v1/webhooks", &json!({"url": "https://studio.example/"})).await,
        409,
        "too_many_webhooks",
    );
    assert_eq!(full.await["limit"], "webhooks", "which limit");
    let path = format!("/v1/webhooks/{}", text(&hook, "id"));
    let gone = service.client.delete(service.at(&path)).send().await.expect("an answer");
    assert_eq!(gone.status(), StatusCode::NO_CONTENT, "removed");
    problem(service.get(&path).await, 404, "not_found").await;
    problem(service.get(&format!("/v1/deliveries/{}", text(&lost, "id"))).await, 404, "not_found").await;
    let unknown = json!({"url": "https://studio.example/", "events": ["job.done"]});
    let unknown = problem(service.post("/v1/webhooks", &unknown).await, 422, "invalid_value").await;
    assert_eq!(unknown["errors"][0]["pointer"], "/events/0", "which event");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn callers_are_told_of_their_own_jobs_only() {
    let service = local(&[("authentication", "keys")]).await;
    let mut receivers = Vec::new();
    for name in ["ann", "bob"] {
        let (key, receiver) = (service.key(name, &[Scope::Read, Scope::Write]).await, Receiver::start(&[]));
        let asked = service.client.post(service.at("/v1/webhooks")).bearer_auth(key.reveal());
        let made = asked.json(&json!({"url": receiver.url})).send().await.expect("an answer");
        receivers.push((key, receiver, taken(made).await));
    }
    let (ann, hers, _) = &receivers[0];
    let upload = service.client.post(service.at("/v1/assets?filename=walk.bvh")).bearer_auth(ann.reveal());
    let asset = taken(upload.body(BVH).send().await.expect("an answer")).await;
    let ask = |body: Value| service.client.post(service.at("/v1/jobs")).bearer_auth(ann.reveal()).json(&body).send();
    let inputs = json!({"source": {"asset": asset}, "target": {"asset": asset}});
    ask(inputs.clone()).await.expect("an answer");
    hers.hears(1).await;
    let mut stolen = inputs;
    stolen["webhook"] = receivers[1].2.clone().into();
    problem(ask(stolen).await.expect("an answer"), 422, "unknown_webhook").await;
    assert!(receivers[1].1.heard().is_empty(), "he hears nothing");
    service.stop().await;
}

/// As many webhooks as somebody may have, all of which take everything and answer nothing.
#[tokio::test(flavor = "multi_thread")]
async fn receivers_of_one_who_answer_nothing_do_not_hold_up_the_words_for_others() {
    let service = Service::start(&[
        ("authentication", "keys"),
        ("outbound_allow", "127.0.0.0/8"),
        ("webhook_timeout", "20s"),
        ("webhook_retries", "1s"),
    ])
    .await;
    let tar = tokio::net::TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let silent = format!("http://{}/", tar.local_addr().expect("an address"));
    let told = Receiver::start(&[]);
    let made = async |name: &str, url: &str, webhooks: usize, pings: usize| {
        let key = service.key(name, &[Scope::Read, Scope::Write]).await;
        let post = async |path: String, body: Value| {
            let request = service.client.post(service.at(&path)).bearer_auth(key.reveal()).json(&body);
            read(request.send().await.expect("an answer")).await
        };
        for _ in 0..webhooks {
            let webhook = post("/v1/webhooks".to_owned(), json!({"url": url})).await;
            for _ in 0..pings {
                post(format!("/v1/webhooks/{}/ping", text(&webhook, "id")), json!({})).await;
            }
        }
    };
    made("mallory", &silent, 12, 4).await;
    // Until as much of it is on its way as may be.
    tokio::time::sleep(Duration::from_millis(500)).await;
    let began = std::time::Instant::now();
    made("carol", &told.url, 1, 1).await;
    told.hears(1).await;
    assert!(began.elapsed() < Duration::from_secs(8), "long before the others are given up: {:?}", began.elapsed());
    drop(tar);
    service.stop().await;
}

/// The job ends, and the process dies before anybody is told.
#[tokio::test(flavor = "multi_thread")]
async fn a_process_that_dies_between_the_end_and_the_word_loses_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let receiver = Receiver::start(&[]);
    let start = |failpoint: &str| {
        ServiceProcess::listening(
            Command::new(env!("CARGO_BIN_EXE_retargetd"))
                .args([
                    "serve",
                    "--listen",
                    "127.0.0.1:0",
                    "--log",
                    "warn",
                    "--outbound-allow",
                    "127.0.0.0/8",
                    "--data",
                ])
                .arg(folder.path())
                .env("RETARGETD_FAILPOINT", failpoint),
        )
    };
    let mut dying = start("job_ended");
    let client = reqwest::Client::builder().no_proxy().timeout(PATIENCE).build().expect("a client");
    let post = |path: &str, body: Value| client.post(format!("{}{path}", dying.url)).json(&body).send();
    let hook = read(post("/v1/webhooks", json!({"url": receiver.url})).await.expect("an answer")).await;
    let upload = client.post(format!("{}/v1/assets?filename=clip.bvh", dying.url)).body(crate::durable::CLIP);
    let asset = taken(upload.send().await.expect("an answer")).await;
    let job = read(
        post("/v1/jobs", json!({"source": {"asset": asset}, "target": {"asset": asset}})).await.expect("an answer"),
    )
    .await;
    assert_ne!(dying.exit_code(), Some(0), "it dies when the job has ended");

    let second = start("");
    let heard = receiver.hears(1).await;
    assert_eq!(heard[0].json()["data"]["id"], job["id"], "told by the next");
    assert_signed(text(&hook, "secret"), &heard);
    assert_eq!(second.terminate(), Some(0), "SIGTERM ends it well");
    assert_eq!(receiver.heard().len(), 1, "once");
}

/// The example receiver of the documentation, against the real thing.
#[tokio::test(flavor = "multi_thread")]
async fn the_example_receiver_hears_what_is_genuine_and_nothing_else() {
    let service = local(&[]).await;
    // The secret is known when the webhook is there, and the address when the receiver is: the first webhook only tells the secret.
    let port = std::net::TcpListener::bind("127.0.0.1:0")
        .and_then(|listener| listener.local_addr())
        .expect("a free port")
        .port();
    let hook = webhook(&service, &format!("http://127.0.0.1:{port}/"), json!(["job.succeeded"])).await;
    let mut child = Command::new("python3")
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("openapi/examples/receive.py"))
        .arg(port.to_string())
        .env("RETARGETD_WEBHOOK_SECRET", text(&hook, "secret"))
        .stdout(Stdio::piped())
        .spawn()
        .expect("the example runs");
    let mut lines = BufReader::new(child.stdout.take().expect("is piped")).lines();
    let url = lines.next().expect("a line").expect("text").replace("listens on ", "");
    let forged = service.client.post(&url).header("webhook-id", "dlv_1").body("{}").send().await.expect("an answer");
    assert_eq!(forged.status(), StatusCode::UNAUTHORIZED, "not signed");
    let job = ended(&service, "nothing").await;
    let line = lines.next().expect("a line").expect("text");
    let (kind, data) = line.split_once(' ').expect("what happened, and to what");
    let data: Value = serde_json::from_str(data).expect("JSON");
    assert_eq!((kind, &data["id"]), ("job.succeeded", &job["id"]), "{line}");
    child.kill().and_then(|()| child.wait()).expect("it ends");
    service.stop().await;
}
