//! Event streams: in order, from where somebody left off, and not for ever.

use std::time::Duration;

use retargetd::jobs::Scope;
use serde_json::{Value, json};

use super::support::{BVH, Service, header, problem, taken};
use crate::event_stream::{EventReader, Heard};

async fn follow(service: &Service, path: &str, last_id: Option<&str>) -> EventReader {
    EventReader::open(service.client.get(service.at(path)), last_id).await
}

fn names(heard: &[Heard]) -> Vec<&str> {
    heard.iter().map(|heard| heard.event.as_str()).collect()
}

async fn ended_job(service: &Service, word: &str) -> String {
    let asset = service.upload(BVH).await;
    let job = taken(service.job(&asset, word).await).await;
    let wait = service.client.get(service.at(&format!("/v1/jobs/{job}"))).header("prefer", "wait=30");
    wait.send().await.expect("an answer");
    job
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_is_followed_to_its_end_and_not_further() {
    let service = Service::start(&[]).await;
    let asset = service.upload(BVH).await;
    let job = taken(service.job(&asset, "wait").await).await;
    let path = format!("/v1/jobs/{job}/events");
    let mut stream = follow(&service, &path, None).await;
    let first = stream.next().await.expect("an event");
    assert_eq!((first.event.as_str(), first.id.as_str()), ("job.queued", "1"), "from its beginning");
    let shown = &first.data;
    assert!(
        shown["job"] == job.as_str() && shown["state"] == "queued" && shown["type"] == "job.queued",
        "what happened: {shown}"
    );
    assert_eq!(stream.next().await.expect("an event").event, "job.running", "then");
    let told = stream.next().await.expect("an event");
    assert_eq!((told.event.as_str(), told.id.as_str()), ("job.progress", "2"), "which has no id of its own");
    assert!(told.data["progress"]["phase"].is_string(), "how far: {}", told.data);
    service.client.post(service.at(&format!("/v1/jobs/{job}/cancel"))).send().await.expect("an answer");
    let rest: Vec<Heard> = stream.rest().await.into_iter().filter(|heard| heard.event != "job.progress").collect();
    assert_eq!(names(&rest), ["job.canceling", "job.canceled"], "to its end");

    let again = follow(&service, &path, Some("2")).await.rest().await;
    assert_eq!(again, rest, "the same from where somebody left off");
    let known = service.client.get(service.at(&path)).header("last-event-id", "4").send().await.expect("an answer");
    assert_eq!(known.status().as_u16(), 204, "who knows the end need not come again");
    let ahead = follow(&service, &path, Some("77")).await.rest().await;
    assert_eq!(names(&ahead), ["reset"], "a number that has never been");
    let nonsense = service.client.get(service.at(&path)).header("last-event-id", "x").send().await.expect("an answer");
    problem(nonsense, 400, "malformed_request").await;
    problem(service.get("/v1/jobs/job_00000000000000000000000000/events").await, 404, "not_found").await;
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn everything_is_followed_from_now_or_from_a_number() {
    let service = Service::start(&[("event_heartbeat", "50ms")]).await;
    let before = ended_job(&service, "nothing").await;
    let mut stream = follow(&service, "/v1/events", None).await;
    let failing = ended_job(&service, "refuse").await;
    let mut heard = Vec::new();
    for _ in 0..3 {
        heard.push(stream.next().await.expect("an event"));
    }
    assert_eq!(names(&heard), ["job.queued", "job.running", "job.failed"], "nothing from before");
    assert!(heard.iter().all(|heard| heard.data["job"] == failing.as_str()), "of that job");
    let all = [&before, &failing];
    let mut again = follow(&service, "/v1/events", Some("0")).await;
    for number in 1..=6 {
        let event = again.next().await.expect("an event");
        assert_eq!(event.id, number.to_string(), "no gap");
        assert_eq!(event.data["job"], all[usize::from(number > 3)].as_str(), "in order");
    }
    let waiting = tokio::time::timeout(Duration::from_millis(400), again.next()).await;
    assert!(waiting.is_err() && again.comments >= 3, "heartbeats while nothing happens: {}", again.comments);
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_gone_is_said_to_be() {
    let service = Service::start(&[("event_retention", "1h"), ("sweep_interval", "50ms")]).await;
    let job = ended_job(&service, "nothing").await;
    service.clock.advance(Duration::from_secs(7200));
    loop {
        let first = follow(&service, "/v1/events", Some("1")).await.next().await.expect("an event");
        if first.event == "reset" {
            assert_eq!(first.id, "3", "what the next comes after");
            break;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let gone = follow(&service, &format!("/v1/jobs/{job}/events"), None).await.rest().await;
    assert_eq!(names(&gone), ["reset"], "the job is still there, its events are not");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn streams_are_bounded_end_in_time_and_say_goodbye() {
    let service = Service::start(&[("max_event_streams", "2")]).await;
    let mut streams = [follow(&service, "/v1/events", None).await, follow(&service, "/v1/events", None).await];
    let refused = service.get("/v1/events").await;
    assert_eq!(header(&refused, "retry-after"), "2", "when to come again");
    assert_eq!(problem(refused, 429, "too_many_streams").await["limit"], "event_streams", "which limit");
    let [first, second] = &mut streams;
    // Heard of before the connection is closed, so that nobody takes it for a fault.
    let stopping = tokio::spawn(service.stop());
    for stream in [first, second] {
        let bye = stream.next().await.expect("an event");
        assert_eq!((bye.event.as_str(), &bye.data), ("bye", &json!({"reason": "shutting_down"})), "goodbye");
        assert_eq!(stream.next().await, None, "and it ends");
    }
    stopping.await.expect("it stops although streams were open");

    let service = Service::start(&[("max_event_streams", "1"), ("event_stream_period", "100ms")]).await;
    for _ in 0..3 {
        let told = follow(&service, "/v1/events", None).await.rest().await;
        assert_eq!(told[0].data, json!({"reason": "time_is_over"}), "no stream lasts for ever, and its place is free");
    }
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn callers_hear_nothing_of_one_another() {
    let service = Service::start(&[("authentication", "keys"), ("max_event_streams", "1")]).await;
    let mut streams = Vec::new();
    for name in ["ann", "bob"] {
        let key = service.key(name, &[Scope::Read, Scope::Write]).await;
        let request = service.client.get(service.at("/v1/events")).bearer_auth(key.reveal());
        streams.push((key, EventReader::open(request, None).await));
    }
    for (key, _) in &streams {
        let upload = service.client.post(service.at("/v1/assets?filename=walk.bvh")).bearer_auth(key.reveal());
        let asset = taken(upload.body(BVH).send().await.expect("an answer")).await;
        let body = json!({"source": {"asset": asset}, "target": {"asset": asset}});
        let job = service.client.post(service.at("/v1/jobs")).bearer_auth(key.reveal()).json(&body);
        job.header("prefer", "wait=30").send().await.expect("an answer");
    }
    let mut jobs: Vec<Value> = Vec::new();
    for (_, stream) in &mut streams {
        let mut heard = Vec::new();
        for _ in 0..3 {
            heard.push(stream.next().await.expect("an event"));
        }
        let numbers: Vec<&str> = heard.iter().map(|heard| heard.id.as_str()).collect();
        assert_eq!(numbers, ["1", "2", "3"], "each has numbers of their own");
        assert!(heard.iter().all(|one| one.data["job"] == heard[0].data["job"]), "one job: {heard:?}");
        jobs.push(heard[0].data["job"].clone());
    }
    assert_ne!(jobs[0], jobs[1], "each hears of their own");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_batch_is_followed_to_the_end_of_its_last_job() {
    let service = Service::start(&[]).await;
    let asset = service.upload(BVH).await;
    ended_job(&service, "another").await;
    let item = |word: &str| json!({"source": {"asset": asset}, "target": {"asset": asset}, "config": {"name": word}, "labels": {"shot": word}});
    let body = json!({"items": [item("nothing"), item("refuse")]});
    let batch =
        taken(service.client.post(service.at("/v1/batches")).json(&body).send().await.expect("an answer")).await;
    let path = format!("/v1/batches/{batch}/events");
    let heard = follow(&service, &path, None).await.rest().await;
    let mut ends: Vec<(u64, &str, &str)> = Vec::new();
    for heard in &heard {
        assert_eq!(heard.data["batch"], batch.as_str(), "of no other job: {}", heard.data);
        let item = heard.data["batch_item"].as_u64().expect("an item");
        if ["job.succeeded", "job.failed"].contains(&heard.event.as_str()) {
            ends.push((item, heard.event.as_str(), heard.data["labels"]["shot"].as_str().expect("its label")));
        }
    }
    ends.sort_unstable();
    assert_eq!(ends, [(0, "job.succeeded", "nothing"), (1, "job.failed", "refuse")], "both, with their labels");
    assert_eq!(names(&heard[..2]), ["job.queued", "job.queued"], "from its first");

    let last = &heard[heard.len() - 1].id;
    let known = service.client.get(service.at(&path)).header("last-event-id", last).send().await.expect("an answer");
    assert_eq!(known.status().as_u16(), 204, "who knows the end need not come again");
    let again = follow(&service, &path, Some(&heard[2].id)).await.rest().await;
    assert_eq!(again, heard[3..], "the same from where somebody left off");
    problem(service.get("/v1/batches/bat_00000000000000000000000000/events").await, 404, "not_found").await;
    service.stop().await;
}
