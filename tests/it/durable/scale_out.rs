//! Many processes on one database and one file store.

use std::time::{Duration, Instant};

use reqwest::StatusCode;

use super::{
    studio::{CLIP, Customer, Place},
    support::{PATIENCE, S3, ServiceProcess},
};
use crate::event_stream::EventReader;

/// The main job through a database and a bucket, by two APIs and two workers; then one of each goes, as in a rolling restart.
#[tokio::test(flavor = "multi_thread")]
async fn apis_and_workers_share_a_database_and_a_bucket() {
    let Some(place) = Place::cloud() else { return };
    let apis = [place.serve(&["--workers", "0"], &[]), place.serve(&["--workers", "0"], &[])];
    let mut workers: Vec<ServiceProcess> = (0..2).map(|_| place.worker(&["--workers", "1"], &[])).collect();
    let mut customer = Customer::new();
    // Larger than one part of a multipart upload.
    let large = format!("{CLIP}{}", "0 90 0 0 0 0 0 0 0\n".repeat(400_000)).replace("Frames: 2", "Frames: 400002");
    let large = customer.upload(&apis[0].url, &large).await.expect("is taken");
    assert_eq!(
        customer.status(&apis[1].url, &format!("/v1/assets/{large}/content")).await,
        StatusCode::OK,
        "there too"
    );
    let asset = customer.upload(&apis[0].url, CLIP).await.expect("is taken");
    let again = customer.upload(&apis[1].url, CLIP).await.expect("is taken");
    assert_eq!(asset, again, "the same bytes have one record");
    for number in 0..30 {
        assert!(customer.ask(&apis[number % 2].url, &asset).await, "is taken");
        if number == 15 {
            let old = workers.remove(0);
            workers.push(place.worker(&["--workers", "1"], &[]));
            assert_eq!(old.terminate(), Some(0), "a rolling restart");
        }
    }
    let states = customer.collect(&apis[1].url).await;
    assert_eq!(states.get("succeeded"), Some(&30), "whoever was asked: {states:?}");
}

/// A listener hears of what others ask for and run elsewhere, and goes on at another process when its own dies.
#[tokio::test(flavor = "multi_thread")]
async fn events_are_heard_at_any_process_and_taken_up_at_another() {
    let Some(place) = Place::shared() else { return };
    let mut first = place.serve(&["--workers", "0"], &[]);
    let second = place.serve(&["--workers", "0"], &[]);
    let _worker = place.worker(&["--workers", "2"], &[]);
    let mut customer = Customer::new();
    let client = reqwest::Client::builder().no_proxy().build().expect("a client");
    let mut stream = EventReader::open(client.get(format!("{}/v1/events", first.url)), None).await;
    let asset = customer.upload(&second.url, CLIP).await.expect("is taken");
    let mut heard = Vec::new();
    for number in 0..12 {
        assert!(customer.ask(&second.url, &asset).await, "is taken");
        if number == 5 {
            heard.push(stream.next().await.expect("an event"));
            heard.push(stream.next().await.expect("an event"));
            first.kill();
            heard.extend(stream.rest().await);
            let last = heard.last().map(|heard| heard.id.clone());
            stream = EventReader::open(client.get(format!("{}/v1/events", second.url)), last.as_deref()).await;
        }
    }
    while heard.len() < 36 {
        heard.push(stream.next().await.expect("an event"));
    }
    for (index, event) in heard.iter().enumerate() {
        assert_eq!(event.id, (index + 1).to_string(), "each once and in order: {event:?}");
    }
    for job in &customer.promised {
        let states: Vec<&str> =
            heard.iter().filter(|heard| heard.data["job"] == job.as_str()).map(|heard| heard.event.as_str()).collect();
        assert_eq!(states, ["job.queued", "job.running", "job.succeeded"], "the whole life of {job}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_download_can_be_sent_to_the_bucket() {
    let Some(place) = Place::cloud() else { return };
    let service = place.serve(&["--workers", "1", "--download-link-period", "5m"], &[]);
    let mut customer = Customer::new();
    let asset = customer.upload(&service.url, CLIP).await.expect("is taken");
    assert!(customer.ask(&service.url, &asset).await, "is taken");
    // Follows the redirect, and finds the bytes of the digest.
    let states = customer.collect(&service.url).await;
    assert_eq!(states.get("succeeded"), Some(&1), "{states:?}");
    let url = customer.redirect(&service.url).await;
    assert!(url.contains("X-Amz-Signature") && url.contains("/clips/studio/blobs/"), "a signed link: {url}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_database_that_restarts_costs_nothing_but_time() {
    let Some(mut place) = Place::shared() else { return };
    let service = place.serve(&["--workers", "2", "--lease-period", "2s"], &[]);
    let mut customer = Customer::new();
    let asset = customer.upload(&service.url, CLIP).await.expect("is taken");
    let mut refused = 0;
    for number in 0..60 {
        if number == 20
            && let Place::Shared(database, _) = &mut place
        {
            database.restart();
        }
        // What is refused says that it may be tried again; `ask` checks that.
        if !customer.ask(&service.url, &asset).await {
            refused += 1;
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }
    assert!(customer.promised.len() + refused == 60 && customer.promised.len() > 30, "most were taken");
    let states = customer.collect(&service.url).await;
    assert_eq!(states.get("succeeded"), Some(&customer.promised.len()), "all that were taken: {states:?}");
    assert_eq!(service.terminate(), Some(0), "it ends well");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_is_canceled_wherever_it_is() {
    let Some(place) = Place::shared() else { return };
    let api = place.serve(&["--workers", "0", "--max-queued-jobs", "3"], &[]);
    let mut customer = Customer::new();
    let asset = customer.upload(&api.url, CLIP).await.expect("is taken");
    while customer.ask(&api.url, &asset).await {}
    assert_eq!(customer.promised.len(), 3, "the queue is full");
    let canceled = customer.cancel(&api.url, &customer.promised[1]).await;
    assert_eq!(canceled["state"], "canceled", "at once, also with a full queue: {canceled}");
    assert!(customer.ask(&api.url, &asset).await, "and there is room again");
    let _worker = place.worker(&["--workers", "1"], &[]);
    let states = customer.collect(&api.url).await;
    assert_eq!((states.get("succeeded"), states.get("canceled")), (Some(&3), Some(&1)), "{states:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_answers_probes_and_tells_what_it_did() {
    let Some(place) = Place::shared() else { return };
    let api = place.serve(&["--workers", "0"], &[]);
    let worker = place.worker_with_probes();
    let client = reqwest::Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
    let ask = async |path: &str| client.get(format!("{}{path}", worker.url)).send().await.expect("an answer");
    for path in ["/livez", "/readyz"] {
        assert!(ask(path).await.status().is_success(), "{path}: it is well");
    }
    assert_eq!(ask("/v1/jobs").await.status(), 404, "nothing else is there, so no key is asked for");
    let mut customer = Customer::new();
    let asset = customer.upload(&api.url, CLIP).await.expect("is taken");
    assert!(customer.ask(&api.url, &asset).await, "is taken");
    customer.collect(&api.url).await;
    let metrics = ask("/metrics").await.text().await.expect("text");
    let ended = "retargetd_jobs_finished_total{state=\"succeeded\",code=\"\"} 1";
    assert!(metrics.contains(ended), "the job that it did: {metrics}");
    assert!(metrics.contains("retargetd_jobs_oldest_queued_seconds 0"), "and that none waits: {metrics}");
}

#[test]
fn a_worker_says_what_it_needs() {
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args(["worker", "--log", "error"])
        .output()
        .expect("it runs");
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(4), "not started: {text}");
    assert!(text.contains("--database postgres://") && text.contains("--blobs"), "says what is missing: {text}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bucket_that_does_not_answer_is_said_to_be_away() {
    let Some(place) = Place::cloud() else { return };
    let service = place.serve(&["--workers", "1"], &[]);
    let mut customer = Customer::new();
    let Place::Cloud(_, files) = &place else { return };
    let files: &S3 = files;
    files.freeze(true);
    let asked = Instant::now();
    assert!(customer.upload(&service.url, CLIP).await.is_none(), "not taken, and said to be worth another try");
    assert!(asked.elapsed() < PATIENCE, "after some time");
    files.freeze(false);
    let asset = customer.upload(&service.url, CLIP).await.expect("it has recovered by itself");
    assert!(customer.ask(&service.url, &asset).await, "is taken");
    assert_eq!(customer.collect(&service.url).await.get("succeeded"), Some(&1), "and works");
}
