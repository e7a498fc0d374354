//! Many workers on one database do many times as much as one, until the cores are used up.
//!
//! `RETARGETD_TEST_JOBS=1000` is the long form, which is held to its figures and prints them.

use std::{collections::BTreeMap, path::Path, sync::Arc, time::Duration};

use jiff::Timestamp;
use reqwest::Client;
use retargetd::{
    app::{self, Running},
    config::Settings,
    telemetry::Clock,
};
use serde_json::json;

use super::{
    studio::{CLIP, Customer, Place},
    support::{PATIENCE, Postgres, ServiceProcess},
};
use crate::{
    http::support::{NAP, Obedient},
    support::Extent,
};

/// From the start of the first job to the end of the last one, by what the database writes down of each.
async fn time_of(customer: &Customer, url: &str, count: usize) -> Duration {
    let mut stream = customer.follow(url, "0").await;
    let (mut first, mut last, mut ended) = (Timestamp::MAX, Timestamp::MIN, 0);
    while ended < count {
        let heard = stream.next().await.expect("an event");
        let at: Timestamp = heard.data["created_at"].as_str().expect("a time").parse().expect("a time");
        match heard.event.as_str() {
            "job.running" => first = first.min(at),
            "job.succeeded" => (last, ended) = (last.max(at), ended + 1),
            "job.queued" => {}
            other => panic!("'{other}' is no part of a good day"),
        }
    }
    last.duration_since(first).unsigned_abs()
}

/// Small jobs that wait for that many processes: how long all take, and how much of the processor one takes from whom works on it.
async fn with_processes(place: &Place, workers: usize, count: usize) -> (Duration, Duration) {
    let Place::Shared(database, _) = place else { unreachable!("workers share a database") };
    let api = place.serve(&["--workers", "0", "--max-queued-jobs", "100000"], &[]);
    let mut customer = Customer::new();
    let asset = customer.upload(&api.url, CLIP).await.expect("is taken");
    for _ in 0..count {
        assert!(customer.ask(&api.url, &asset).await, "is taken");
    }
    let workers: Vec<ServiceProcess> = (0..workers).map(|_| place.worker(&["--workers", "1"], &[])).collect();
    let lasted = time_of(&customer, &api.url, count).await;
    let spent: Duration = workers.iter().map(ServiceProcess::processor_time).sum();
    assert_eq!(customer.collect(&api.url).await.get("succeeded"), Some(&count), "all of them");
    drop((api, workers));
    database.empty().await;
    (lasted, spent / count as u32)
}

/// The engine keeps the processor busy, so cores are what limits: what one job takes of them is the same with four processes as with one.
#[tokio::test(flavor = "multi_thread")]
async fn four_processes_spend_on_a_job_what_one_does() {
    let extent = Extent::of("RETARGETD_TEST_JOBS", 16);
    let Some(place) = Place::shared() else { return };
    let mut spent = Vec::new();
    for workers in [1, 4] {
        let (lasted, each) = with_processes(&place, workers, extent.amount).await;
        let rate = extent.amount as f64 / lasted.as_secs_f64();
        let figure = format!("{workers} processes: {rate:.1} jobs a second, {each:.1?} of the processor per job");
        extent.holds(true, &figure);
        spent.push(each.as_secs_f64());
    }
    extent.holds(spent[1] < spent[0] * 1.5, &format!("{:.2} times as much per job with four", spent[1] / spent[0]));
}

async fn service(database: &Postgres, folder: &Path, workers: &str) -> Running {
    let folder = folder.display();
    let given: BTreeMap<&str, String> = [
        ("listen", "127.0.0.1:0".to_owned()),
        ("database", database.url()),
        ("blobs", format!("file://{folder}/blobs")),
        ("data", format!("{folder}/data")),
        ("workers", workers.to_owned()),
        ("result_cache", "off".to_owned()),
        ("max_queued_jobs", "100000".to_owned()),
    ]
    .into();
    let settings = Settings::read(|setting| given.get(setting.name).cloned()).expect("the settings are valid");
    app::start_with(settings, Arc::new(Obedient), Clock::system()).await.expect("it starts")
}

/// Where the engine leaves the processor alone, four workers do four times as much as one: the queue is not what limits.
#[tokio::test(flavor = "multi_thread")]
async fn four_workers_on_one_database_do_four_times_as_much() {
    let extent = Extent::of("RETARGETD_TEST_JOBS", 8);
    // Each takes a while.
    let count = extent.amount.min(200);
    let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
    let Some(database) = Postgres::start() else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut rates = Vec::new();
    for workers in [1, 4] {
        let api = service(&database, folder.path(), "0").await;
        let customer = Customer::new();
        let asset = customer.upload(&api.url(), CLIP).await.expect("is taken");
        let input = json!({"asset": asset});
        let body = json!({"source": input, "target": input, "config": {"say": "doze"}});
        for _ in 0..count {
            let answer = client.post(format!("{}/v1/jobs", api.url())).json(&body).send().await.expect("an answer");
            assert_eq!(answer.status(), 202, "taken on");
        }
        let mut running = Vec::new();
        for _ in 0..workers {
            running.push(service(&database, folder.path(), "1").await);
        }
        let lasted = time_of(&customer, &api.url(), count).await;
        rates.push(count as f64 / lasted.as_secs_f64());
        for service in running.into_iter().chain([api]) {
            service.stop().await.expect("it stops");
        }
        database.empty().await;
    }
    let (one, four) = (rates[0], rates[1]);
    let most = 1.0 / NAP.as_secs_f64();
    let figure = format!(
        "jobs that wait for {} ms: {one:.2} a second with 1 worker ({:.0} % of what can be), {four:.2} with 4: {:.2} times as many",
        NAP.as_millis(),
        one / most * 1e2,
        four / one
    );
    extent.holds(four > one * 3.6, &figure);
}
