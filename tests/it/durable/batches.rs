//! Batches of the real binary, on one process's folder and on a database that processes share.

use std::time::Instant;

use reqwest::Client;
use serde_json::{Value, json};

use super::{
    studio::{CLIP, Customer, Place, edit_of},
    support::{PATIENCE, count_of},
};

async fn ask(client: &Client, url: &str, asset: &str, count: usize) -> Value {
    let item = |number: usize| json!({"labels": {"number": number.to_string()}});
    let body = json!({"defaults": edit_of(asset), "items": (0..count).map(item).collect::<Vec<_>>()});
    let answer = client.post(format!("{url}/v1/batches")).json(&body).send().await.expect("an answer");
    assert_eq!(answer.status(), 202, "taken on");
    answer.json().await.expect("JSON")
}

async fn look(client: &Client, url: &str, id: &str) -> Value {
    client.get(format!("{url}/v1/batches/{id}")).send().await.expect("an answer").json().await.expect("JSON")
}

/// Killed as by a power cut while a batch runs, the process comes back and ends every job of it, once.
async fn survives_a_power_cut(place: Place) {
    let flags = ["--workers", "2", "--lease-period", "1s", "--max-attempts", "50"];
    let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
    let mut process = place.serve(&flags, &[]);
    let customer = Customer::new();
    let asset = customer.upload(&process.url, CLIP).await.expect("is taken");
    let count = count_of("RETARGETD_TEST_JOBS", 120);
    let id = ask(&client, &process.url, &asset, count).await["id"].as_str().expect("an id").to_owned();
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
        tokio::time::sleep(std::time::Duration::from_millis(20)).await;
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
        let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
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
