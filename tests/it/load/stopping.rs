//! SIGTERM while callers press: nobody is told a fault, nothing that was acknowledged is lost.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use reqwest::StatusCode;
use serde_json::Value;
use tokio::task::JoinSet;

use super::support::{Pressed, Pressure};

/// What one caller was promised until the service was gone.
async fn call_until_gone(service: Arc<Pressed>) -> Vec<String> {
    let mut promised = Vec::new();
    loop {
        let answer = match service.ask().send().await {
            Ok(answer) => answer,
            Err(error) => {
                assert!(error.is_connect() || error.is_request(), "gone, not in the middle of an answer: {error:?}");
                return promised;
            }
        };
        match answer.status() {
            StatusCode::ACCEPTED => {
                let job: Value = answer.json().await.expect("a whole answer");
                promised.push(job["id"].as_str().expect("an id").to_owned());
            }
            StatusCode::TOO_MANY_REQUESTS | StatusCode::SERVICE_UNAVAILABLE => {
                assert!(answer.headers().contains_key("retry-after"), "says when to try again: {}", answer.status());
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
            status => panic!("{status} while stopping: {}", answer.text().await.unwrap_or_default()),
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stop_under_load_loses_nothing_and_tells_no_fault() {
    let pressure = Pressure::of(2);
    let data = tempfile::tempdir().expect("a temporary folder");
    let flags = ["--workers", "2", "--max-queued-jobs", "64", "--drain-delay", "500ms", "--grace-period", "1s"];
    let mut service = Pressed::start(data.path(), &flags).await;
    let stop = service.process.stopper();
    let shared = Arc::new(service);
    let mut callers = JoinSet::new();
    for _ in 0..8 {
        callers.spawn(call_until_gone(Arc::clone(&shared)));
    }
    tokio::time::sleep(pressure.lasts.min(Duration::from_secs(30))).await;
    let asked = Instant::now();
    stop.terminate();
    let promised = callers.join_all().await.concat();
    service = Arc::into_inner(shared).expect("all callers are gone");
    assert_eq!(service.process.exit_code(), Some(0), "stopped as it was told");
    assert!(!promised.is_empty(), "something was promised");
    let stopped = asked.elapsed();

    let again = Pressed::start(data.path(), &["--workers", "2"]).await;
    let mut succeeded = 0;
    for id in &promised {
        let job = again.end_of(id).await;
        assert_eq!(job["state"], "succeeded", "every promise is kept: {job}");
        succeeded += 1;
    }
    let figure = format!("{succeeded} of {} jobs kept; stopped after {:.1} s", promised.len(), stopped.as_secs_f64());
    pressure.holds(stopped < Duration::from_secs(30), &figure);
}
