//! Batches of the real binary, on one process's folder and on a database that processes share.

use std::time::{Duration, Instant};

use reqwest::Client;
use serde_json::{Value, json};

use super::{
    studio::{CLIP, Customer, Place, edit_of},
    support::PATIENCE,
};
use crate::support::Extent;

fn client() -> Client {
    Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client")
}

/// Asks for a batch that writes these clips again, each so many times; gives its id.
async fn ask(client: &Client, url: &str, clips: &[(&str, usize)]) -> String {
    let clips = clips.iter().flat_map(|(asset, count)| std::iter::repeat_n(*asset, *count));
    let item = |(number, asset): (usize, &str)| {
        let mut item = edit_of(asset);
        item["labels"] = json!({"number": number.to_string()});
        item
    };
    let body = json!({"items": clips.enumerate().map(item).collect::<Vec<_>>()});
    let answer = client.post(format!("{url}/v1/batches")).json(&body).send().await.expect("an answer");
    assert_eq!(answer.status(), 202, "taken on");
    let batch: Value = answer.json().await.expect("JSON");
    batch["id"].as_str().expect("an id").to_owned()
}

async fn post(client: &Client, url: &str, id: &str, what: &str) -> Value {
    let answer = client.post(format!("{url}/v1/batches/{id}/{what}")).send().await.expect("an answer");
    assert!(answer.status().is_success(), "{what}: {}", answer.status());
    answer.json().await.expect("JSON")
}

/// The batch, once that is true of it.
async fn until(client: &Client, url: &str, id: &str, is_so: impl Fn(&Value) -> bool) -> Value {
    let began = Instant::now();
    loop {
        let batch = look(client, url, id).await;
        if is_so(&batch) {
            return batch;
        }
        assert!(began.elapsed() < PATIENCE, "the batch comes to that: {batch}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

fn counts(batch: &Value) -> [u64; 3] {
    ["succeeded", "failed", "canceled"].map(|state| batch["counts"][state].as_u64().expect("a count"))
}

async fn look(client: &Client, url: &str, id: &str) -> Value {
    client.get(format!("{url}/v1/batches/{id}")).send().await.expect("an answer").json().await.expect("JSON")
}

/// Killed as by a power cut while a batch runs, the process comes back and ends every job of it, once.
async fn survives_a_power_cut(place: Place) {
    let flags = ["--workers", "2", "--lease-period", "1s", "--max-attempts", "50"];
    let client = client();
    let mut process = place.serve(&flags, &[]);
    let customer = Customer::new();
    let asset = customer.upload(&process.url, CLIP).await.expect("is taken");
    let extent = Extent::of("RETARGETD_TEST_JOBS", 120);
    let (count, asked) = (extent.amount, Instant::now());
    let id = ask(&client, &process.url, &[(&asset, count)]).await;
    extent.holds(true, &format!("a batch of {count} items was taken on in {:.0?}", asked.elapsed()));
    let (began, mut kills) = (Instant::now(), 0);
    loop {
        assert!(began.elapsed() < PATIENCE, "the batch ends");
        let batch = look(&client, &process.url, &id).await;
        let done = batch["progress"]["done"].as_u64().expect("a count");
        if batch["state"] == "succeeded" {
            assert_eq!(batch["counts"]["succeeded"], count, "every item: {batch}");
            break;
        }
        assert!(["queued", "running"].contains(&batch["state"].as_str().unwrap_or_default()), "{batch}");
        if kills < 2 && done > (kills + 1) * count as u64 / 4 {
            kills += 1;
            process.kill();
            process = place.serve(&flags, &[]);
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    assert!(kills > 0, "it was killed while the batch ran");
    let jobs = customer.list(&process.url, &format!("/v1/batches/{id}/jobs")).await;
    for (number, job) in jobs.iter().enumerate() {
        assert_eq!(
            (&job["batch_item"], &job["labels"]["number"]),
            (&json!(number), &json!(number.to_string())),
            "{job}"
        );
        assert_eq!(job["results"].as_array().map(Vec::len), Some(1), "one result: {job}");
    }
    assert_eq!(jobs.len(), count, "none is lost, none comes twice");
    assert_eq!(process.terminate(), Some(0), "it ends well");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_batch_in_a_folder_survives_a_power_cut() {
    survives_a_power_cut(Place::folder()).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_batch_in_a_database_survives_a_power_cut() {
    let Some(place) = Place::shared() else { return };
    survives_a_power_cut(place).await;
}

/// A process that dies just before a batch is written has none of it, and one that dies just after has all.
#[tokio::test(flavor = "multi_thread")]
async fn a_batch_is_taken_on_whole_or_not_at_all() {
    for (failpoint, expected) in [("before_job_record", 0), ("after_job_record", 30)] {
        let place = Place::folder();
        let client = client();
        let armed = [("RETARGETD_FAILPOINT", format!("{failpoint}:1"))];
        let mut process = place.serve(&["--workers", "1"], &armed);
        let asset = Customer::new().upload(&process.url, CLIP).await.expect("is taken");
        let body = json!({"defaults": edit_of(&asset), "items": vec![json!({}); 30]});
        let request = || client.post(format!("{}/v1/batches", process.url)).header("idempotency-key", "x").json(&body);
        assert!(request().send().await.is_err(), "it dies under the request");
        process.exit_code();
        let process = place.serve(&["--workers", "1"], &[]);
        let listed: Value = client
            .get(format!("{}/v1/batches", process.url))
            .send()
            .await
            .expect("an answer")
            .json()
            .await
            .expect("JSON");
        let items =
            listed["items"].as_array().map_or(0, |items| items.iter().filter_map(|one| one["items"].as_u64()).sum());
        assert_eq!(items, expected, "after '{failpoint}': {listed}");
        let again = client.post(format!("{}/v1/batches", process.url)).header("idempotency-key", "x").json(&body);
        let again: Value = again.send().await.expect("an answer").json().await.expect("JSON");
        let id = again["id"].as_str().expect("asking again gives the batch");
        let wait = client.get(format!("{}/v1/batches/{id}", process.url)).header("prefer", "wait=30");
        let ended: Value = wait.send().await.expect("an answer").json().await.expect("JSON");
        assert_eq!(ended["counts"]["succeeded"], 30, "and all its jobs: {ended}");
    }
}

/// Canceled by the API while a worker elsewhere is in the middle of it.
#[tokio::test(flavor = "multi_thread")]
async fn a_batch_in_a_database_is_canceled_half_way() {
    let Some(place) = Place::shared() else { return };
    let api = place.serve(&["--workers", "0"], &[]);
    let (client, customer) = (client(), Customer::new());
    let asset = customer.upload(&api.url, CLIP).await.expect("is taken");
    let id = ask(&client, &api.url, &[(&asset, 200)]).await;
    let _worker = place.worker(&["--workers", "1"], &[]);
    until(&client, &api.url, &id, |batch| counts(batch)[0] > 2).await;
    assert_eq!(post(&client, &api.url, &id, "cancel").await["counts"]["queued"], 0, "nothing waits any more");
    let batch = until(&client, &api.url, &id, |batch| batch["finished_at"].is_string()).await;
    let [succeeded, failed, canceled] = counts(&batch);
    assert_eq!((batch["state"].as_str(), failed, succeeded + canceled), (Some("canceled"), 0, 200), "{batch}");
    assert!(canceled > 0, "it was canceled half way: {batch}");
    let jobs = customer.list(&api.url, &format!("/v1/batches/{id}/jobs")).await;
    let done = jobs.iter().filter(|job| job["results"].as_array().is_some_and(|results| results.len() == 1)).count();
    assert_eq!((jobs.len(), done as u64), (200, succeeded), "who was canceled gave nothing");
    tokio::time::sleep(Duration::from_millis(300)).await;
    assert_eq!(counts(&look(&client, &api.url, &id).await), counts(&batch), "and nothing runs afterwards");
}

/// What one worker is not allowed to read, another reads when it is asked for again.
#[tokio::test(flavor = "multi_thread")]
async fn what_failed_of_a_batch_in_a_database_is_asked_for_again() {
    let Some(place) = Place::shared() else { return };
    let api = place.serve(&["--workers", "0"], &[]);
    let (client, customer) = (client(), Customer::new());
    let small = customer.upload(&api.url, CLIP).await.expect("is taken");
    let long = format!("{CLIP}{}", "0 90 0 0 0 0 0 0 0\n".repeat(198)).replace("Frames: 2", "Frames: 200");
    let long = customer.upload(&api.url, &long).await.expect("is taken");
    let id = ask(&client, &api.url, &[(&small, 3), (&long, 2)]).await;
    let strict = place.worker(&["--workers", "1", "--max-frames-per-clip", "100"], &[]);
    let batch = until(&client, &api.url, &id, |batch| batch["finished_at"].is_string()).await;
    assert_eq!((counts(&batch), batch["state"].as_str()), ([3, 2, 0], Some("failed")), "{batch}");
    assert_eq!(strict.terminate(), Some(0), "it ends well");

    let _worker = place.worker(&["--workers", "1"], &[]);
    assert_eq!(post(&client, &api.url, &id, "retry-failed").await["retried"], 2, "those that failed, no others");
    let batch = until(&client, &api.url, &id, |batch| batch["finished_at"].is_string()).await;
    assert_eq!((counts(&batch), batch["state"].as_str()), ([5, 0, 0], Some("succeeded")), "{batch}");
    let jobs = customer.list(&api.url, &format!("/v1/batches/{id}/jobs")).await;
    let again = jobs.iter().filter(|job| !job["retry_of"].is_null()).count();
    assert_eq!((jobs.len(), again), (5, 2), "an item has one job, two of them the newer one");
}
