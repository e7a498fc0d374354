//! What a collector hears of a request, whoever works on it; and that a collector that is away costs nothing.

use std::{
    collections::BTreeMap,
    time::{Duration, Instant},
};

use reqwest::{Client, multipart};
use retargetd::samples;
use serde_json::Value;

use super::{
    collector::{Collector, SeenSpan},
    studio::{CLIP, Customer, Place},
    support::PATIENCE,
};

const TRACE: &str = "4bf92f3577b34da6a3ce929d0e0e4736";
const CALLER: &str = "00f067aa0ba902b7";

/// Retargets the samples and gives the answer's status.
async fn retarget(client: &Client, url: &str, flags: &str, target: Vec<u8>) -> u16 {
    let part = |bytes: Vec<u8>, name: &str| multipart::Part::bytes(bytes).file_name(name.to_owned());
    let form = multipart::Form::new()
        .part("source", part(samples::walk_clip(), "walk.glb"))
        .part("target", part(target, "mannequin.glb"));
    let request =
        client.post(format!("{url}/v1/retarget")).header("traceparent", format!("00-{TRACE}-{CALLER}-{flags}"));
    request.multipart(form).send().await.expect("an answer").status().as_u16()
}

fn client() -> Client {
    Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client")
}

fn named<'a>(spans: &'a [SeenSpan], name: &str) -> &'a SeenSpan {
    let found = spans.iter().find(|span| span.name == name);
    found.unwrap_or_else(|| panic!("'{name}' is among {:?}", spans.iter().map(|span| &span.name).collect::<Vec<_>>()))
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_is_one_trace_from_the_caller_to_the_phases_of_the_engine() {
    let (collector, place, client) = (Collector::start().await, Place::folder(), client());
    let server = place.serve(&["--otlp-endpoint", &collector.url], &[]);
    assert_eq!(retarget(&client, &server.url, "01", samples::mannequin()).await, 200, "it works");
    client.get(format!("{}/readyz", server.url)).send().await.expect("an answer");
    assert_eq!(server.terminate(), Some(0), "what is left is sent before the end");

    let spans = collector.spans();
    assert!(spans.iter().all(|span| span.trace == TRACE), "of one trace, probes not among them: {spans:?}");
    // It has a worker to itself, so the work began when the files were there, and none were fetched.
    let below: BTreeMap<&str, &str> = [
        ("wait in queue", "POST /v1/retarget"),
        ("run job", "POST /v1/retarget"),
        ("engine", "run job"),
        ("keep results", "run job"),
        ("read", "engine"),
        ("plan", "engine"),
        ("retarget", "engine"),
        ("write", "engine"),
    ]
    .into();
    let request = named(&spans, "POST /v1/retarget");
    assert_eq!(request.parent, CALLER, "below the caller's own");
    for (name, above) in &below {
        let (span, above) = (named(&spans, name), named(&spans, above));
        assert_eq!(span.parent, above.id, "'{name}' is below '{}'", above.name);
        // Records keep milliseconds.
        let is_inside = span.times.0 + 2_000_000 >= above.times.0 && span.times.0 <= span.times.1;
        assert!(is_inside, "'{name}' begins after '{}': {spans:?}", above.name);
    }
    assert_eq!(spans.len(), below.len() + 1, "and nothing else: {spans:?}");
    let fact = |span: &SeenSpan, name: &str| span.facts.get(name).cloned().unwrap_or_default();
    assert_eq!(fact(request, "http.response.status_code"), "200", "what came of it");
    assert_eq!(fact(request, "http.route"), "/v1/retarget", "the route");
    let work = named(&spans, "run job");
    assert!(fact(work, "retargetd.job_id").starts_with("job_") && !work.is_failed, "which job: {work:?}");
    assert_eq!((fact(work, "retargetd.attempt"), fact(work, "service.name")), ("1".to_owned(), "retargetd".to_owned()));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_the_caller_does_not_sample_is_not_sent_and_failures_are_told() {
    let (collector, place, client) = (Collector::start().await, Place::folder(), client());
    let server = place.serve(&["--otlp-endpoint", &format!("{}/v1/traces", collector.url)], &[]);
    assert_eq!(retarget(&client, &server.url, "00", samples::mannequin()).await, 200, "it works");
    let refused = retarget(&client, &server.url, "01", CLIP.replace("JOINT", "KNEE").into_bytes()).await;
    assert_eq!(refused, 422, "a file that breaks the rules");
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
    let spans = collector.spans();
    let jobs: Vec<_> = spans.iter().filter(|span| span.name == "run job").collect();
    assert_eq!(jobs.len(), 1, "the one that was to be sampled: {spans:?}");
    assert!(jobs[0].is_failed && jobs[0].facts.contains_key("error.type"), "that it failed, and how: {jobs:?}");
    assert!(!named(&spans, "POST /v1/retarget").is_failed, "that a file is refused is no fault of the service");
}

/// Somebody who sends any word for a key decides nothing of what is recorded.
#[tokio::test(flavor = "multi_thread")]
async fn who_is_not_known_has_no_trace_of_their_own() {
    let (collector, place, client) = (Collector::start().await, Place::folder(), client());
    let server = place.serve(&["--otlp-endpoint", &collector.url, "--authentication", "keys"], &[]);
    let request = client.get(format!("{}/v1/jobs", server.url)).bearer_auth("rtg_nobody");
    let answer = request.header("traceparent", format!("00-{TRACE}-{CALLER}-01")).send().await.expect("an answer");
    assert_eq!(answer.status(), 401, "refused");
    assert_eq!(server.terminate(), Some(0), "what is left is sent before the end");
    assert!(collector.spans().iter().all(|span| span.trace != TRACE), "{:?}", collector.spans());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_trace_goes_on_in_the_process_that_works() {
    let Some(place) = Place::shared() else { return };
    let collector = Collector::start().await;
    let variables = [("OTEL_EXPORTER_OTLP_ENDPOINT", collector.url.clone())];
    let api = place.serve(&["--workers", "0"], &variables);
    let worker = place.worker(&["--workers", "1"], &variables);
    let processes = [api.id().to_string(), worker.id().to_string()];
    let mut customer = Customer::new();
    let asset = customer.upload(&api.url, CLIP).await.expect("is taken");
    assert!(customer.ask(&api.url, &asset).await, "is taken");
    let states = customer.collect(&api.url).await;
    assert_eq!(states.get("succeeded"), Some(&1), "{states:?}");
    assert_eq!((api.terminate(), worker.terminate()), (Some(0), Some(0)), "what is left is sent");

    let spans = collector.spans();
    let (request, work) = (named(&spans, "POST /v1/jobs"), named(&spans, "run job"));
    assert_eq!((&work.trace, &work.parent), (&request.trace, &request.id), "of one trace: {spans:?}");
    let process = |span: &SeenSpan| span.facts["process.pid"].clone();
    assert_eq!([process(request), process(work)], processes, "in two processes");
    assert_eq!(named(&spans, "fetch inputs").parent, work.id, "its files come from the store");
    assert_ne!(named(&spans, "POST /v1/assets").trace, request.trace, "another request is another trace");
}

/// One that refuses connections, and one that takes them and never answers.
#[tokio::test(flavor = "multi_thread")]
async fn a_collector_that_is_away_costs_nothing() {
    let hanging = tokio::net::TcpListener::bind("127.0.0.1:0").await.expect("a port");
    let closed = std::net::TcpListener::bind("127.0.0.1:0").and_then(|gone| gone.local_addr()).expect("an address");
    for address in [closed, hanging.local_addr().expect("an address")] {
        let (place, client) = (Place::folder(), client());
        let server = place.serve(&["--otlp-endpoint", &format!("http://{address}")], &[]);
        for _ in 0..3 {
            assert_eq!(retarget(&client, &server.url, "01", samples::mannequin()).await, 200, "it works as ever");
        }
        let answer = client.get(format!("{}/v1/jobs", server.url)).send().await.expect("an answer");
        let jobs: Value = answer.json().await.expect("JSON");
        assert_eq!(jobs["items"].as_array().map(Vec::len), Some(3), "every job is there");
        let began = Instant::now();
        assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
        assert!(
            began.elapsed() < Duration::from_secs(30),
            "and does not wait for the collector: {:?}",
            began.elapsed()
        );
    }
}
