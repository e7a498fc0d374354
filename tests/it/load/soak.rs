//! Everything that callers do, for a long time: memory and file handles stay where they were, and the books balance.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use serde_json::{Value, json};
use tokio::task::JoinSet;

use super::support::{Pressed, Pressure};

/// How much memory may grow between the second quarter and the last: what allocators and caches do by themselves.
const MAX_GROWTH: f64 = 1.1;
const MAX_GROWTH_MEBIBYTES: f64 = 16.0;

/// One caller's day: a file of one's own, a job that runs, one that is canceled, results, lists, mistakes, and tidying up.
async fn visit(service: &Pressed, number: u64) {
    let clip = crate::durable::CLIP.replace("OFFSET 0 10 0", &format!("OFFSET 0 10.{number:09} 0"));
    let asset = service.upload("clip.bvh", clip.into_bytes()).await;
    let ask = async |method: reqwest::Method, path: &str, body: Value| -> (u16, Value) {
        let request = service.client.request(method, service.at(path));
        let request = if body.is_null() { request } else { request.json(&body) };
        let answer = request.send().await.expect("an answer");
        (answer.status().as_u16(), answer.json().await.unwrap_or_default())
    };
    let (get, post, delete) = (reqwest::Method::GET, reqwest::Method::POST, reqwest::Method::DELETE);
    let edit = json!({"source": {"asset": asset}, "config": {"task": "edit"}, "output": ["bvh"]});
    let (status, job) = ask(post.clone(), "/v1/jobs", edit.clone()).await;
    assert_eq!(status, 202, "taken: {job}");
    let kept = service.end_of(job["id"].as_str().expect("an id")).await;
    assert_eq!(kept["state"], "succeeded", "{kept}");
    let content = kept["results"][0]["content"].as_str().expect("a place").to_owned();
    let bytes = service.client.get(service.at(&content)).send().await.expect("an answer").bytes().await;
    assert!(bytes.expect("its bytes").starts_with(b"HIERARCHY"), "the result");

    let (_, canceled) = ask(post.clone(), "/v1/jobs", edit).await;
    let canceled = canceled["id"].as_str().expect("an id").to_owned();
    let (status, _) = ask(post.clone(), &format!("/v1/jobs/{canceled}/cancel"), Value::Null).await;
    assert!([200, 409].contains(&status), "canceled, or it has ended: {status}");
    service.end_of(&canceled).await;
    assert_eq!(ask(get.clone(), "/v1/jobs?limit=5", Value::Null).await.0, 200, "a list");
    assert_eq!(ask(post, "/v1/jobs", json!({"sorce": {}})).await.0, 422, "a mistake");
    for path in [format!("/v1/jobs/{}", kept["id"].as_str().expect("an id")), format!("/v1/jobs/{canceled}")] {
        assert!(ask(delete.clone(), &path, Value::Null).await.0 < 300, "{path} is removed");
    }
    assert!(ask(delete, &format!("/v1/assets/{asset}"), Value::Null).await.0 < 300, "the file is removed");
    let (status, job) = ask(get, &format!("/v1/jobs/{canceled}"), Value::Null).await;
    assert!([404, 410].contains(&status), "and gone: {job}");
    let retarget = service.ask().header("prefer", "wait=30").send().await.expect("an answer");
    assert!(retarget.status().is_success(), "a job of some size: {}", retarget.status());
}

/// Memory in MiB and open files, now and then.
async fn watch(service: Arc<Pressed>, lasts: Duration) -> Vec<(f64, u64)> {
    let (began, mut seen) = (Instant::now(), Vec::new());
    while began.elapsed() < lasts {
        tokio::time::sleep((lasts / 80).max(Duration::from_millis(50))).await;
        seen.push((service.process.memory_mebibytes(), service.process.open_files()));
    }
    seen
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

#[tokio::test(flavor = "multi_thread")]
async fn a_long_time_changes_nothing() {
    let pressure = Pressure::of(3);
    let data = tempfile::tempdir().expect("a temporary folder");
    let flags = ["--workers", "2", "--sweep-interval", "1s", "--result-retention", "20s", "--job-retention", "20s"];
    let service = Arc::new(Pressed::start(data.path(), &flags).await);
    let watching = tokio::spawn(watch(Arc::clone(&service), pressure.lasts));
    let (began, mut callers) = (Instant::now(), JoinSet::new());
    for caller in 0..4 {
        let (service, lasts) = (Arc::clone(&service), pressure.lasts);
        callers.spawn(async move {
            let mut visits = 0;
            while began.elapsed() < lasts {
                visit(&service, caller * 1_000_000 + visits).await;
                visits += 1;
            }
            visits
        });
    }
    let visits: u64 = callers.join_all().await.iter().sum();
    let seen = watching.await.expect("it was watched");
    let books = service.books_at_rest().await;
    books.assert_balanced();
    assert_eq!(books.submitted, visits * 3, "every visit is in the books: {books:?}");
    assert_eq!(books.finished.get("failed").copied().unwrap_or_default(), 0, "and none failed: {books:?}");

    let quarter = seen.len() / 4;
    let (early, late) = (&seen[quarter..quarter * 2], &seen[quarter * 3..]);
    let (before, after) = (mean(early.iter().map(|at| at.0)), mean(late.iter().map(|at| at.0)));
    let most_files = |part: &[(f64, u64)]| part.iter().map(|at| at.1).max().unwrap_or_default();
    let figure = format!("{visits} visits; memory {before:.0} MiB, later {after:.0} MiB");
    pressure.holds(after < (before * MAX_GROWTH).max(before + MAX_GROWTH_MEBIBYTES), &figure);
    let figure = format!("open files {}, later {}", most_files(early), most_files(late));
    pressure.holds(most_files(late) <= most_files(early) + 8, &figure);
}
