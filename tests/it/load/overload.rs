//! Ten times as much as the service can do: it refuses fast, goes on at its pace, and is at rest soon after.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use reqwest::StatusCode;
use tokio::{task::JoinSet, time::MissedTickBehavior};

use super::support::{Answers, Pressed, Pressure};

/// What the service may use, with all that it is sent.
const MAX_MEMORY_MEBIBYTES: u64 = 512;

/// How many jobs a second come to their end while there is always one to begin with, and never many.
async fn capacity(service: &Arc<Pressed>, lasts: Duration) -> f64 {
    let before = service.books_at_rest().await.ended();
    let began = Instant::now();
    let mut callers = JoinSet::new();
    for _ in 0..4 {
        let service = Arc::clone(service);
        callers.spawn(async move {
            while began.elapsed() < lasts {
                let answer = service.ask().header("prefer", "wait=30").send().await.expect("an answer");
                assert!(answer.status().is_success(), "four at a time are no overload: {}", answer.status());
            }
        });
    }
    callers.join_all().await;
    (service.books().await.ended() - before) as f64 / began.elapsed().as_secs_f64()
}

/// Asks for `rate` jobs a second, whether or not the ones before were answered.
async fn press(service: &Arc<Pressed>, rate: f64, lasts: Duration) -> Answers {
    let mut tick = tokio::time::interval(Duration::from_secs_f64(1.0 / rate));
    tick.set_missed_tick_behavior(MissedTickBehavior::Burst);
    let (began, mut asked, mut answers) = (Instant::now(), JoinSet::new(), Answers::default());
    while began.elapsed() < lasts {
        tick.tick().await;
        let request = service.ask();
        asked.spawn(async move {
            let asked = Instant::now();
            let answer = request.send().await.expect("an answer, also when it is a refusal");
            let (status, has_advice) = (answer.status(), answer.headers().contains_key("retry-after"));
            assert!(status == StatusCode::ACCEPTED || has_advice, "a refusal says when to try again: {status}");
            (status, asked.elapsed())
        });
        while let Some(answered) = asked.try_join_next() {
            let (status, took) = answered.expect("no caller fails");
            answers.add(status, took);
        }
    }
    for (status, took) in asked.join_all().await {
        answers.add(status, took);
    }
    answers
}

/// Asks again and again whether the service is alive.
async fn probe(service: Arc<Pressed>, lasts: Duration) -> Answers {
    let (began, mut answers) = (Instant::now(), Answers::default());
    while began.elapsed() < lasts {
        let asked = Instant::now();
        let answer = service.client.get(service.at("/livez")).send().await.expect("an answer");
        answers.add(answer.status(), asked.elapsed());
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    answers
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_too_much_is_refused_at_once_and_the_rest_is_done() {
    let pressure = Pressure::of(3);
    let data = tempfile::tempdir().expect("a temporary folder");
    let service = Arc::new(Pressed::start(data.path(), &["--workers", "2", "--max-queued-jobs", "16"]).await);
    let capacity = capacity(&service, (pressure.lasts / 4).min(Duration::from_secs(10))).await;
    let before = service.books_at_rest().await;

    let began = Instant::now();
    let probes = tokio::spawn(probe(Arc::clone(&service), pressure.lasts));
    let mut answers = press(&service, capacity * 10.0, pressure.lasts).await;
    let goodput = (service.books().await.ended() - before.ended()) as f64 / began.elapsed().as_secs_f64();
    let mut probes = probes.await.expect("probes are answered");
    let books = service.books_at_rest().await;
    books.assert_balanced();

    assert_eq!(answers.statuses(), [202, 429], "taken or refused, nothing else: {:?}", answers.statuses());
    assert_eq!(probes.statuses(), [200], "alive all the time");
    let taken = books.submitted - before.submitted;
    assert_eq!(answers.count(202) as u64, taken, "what was acknowledged is what was taken");
    assert_eq!(books.finished.get("succeeded"), Some(&books.submitted), "all of it is done: {books:?}");
    let memory = service.process.most_memory_mebibytes();
    assert!(memory < MAX_MEMORY_MEBIBYTES, "{memory} MiB");

    let (refused, alive) = (answers.p99(429), probes.p99(200));
    let (asked, share) = (answers.count(202) + answers.count(429), goodput / capacity);
    pressure.holds(
        refused < Duration::from_millis(50),
        &format!("{asked} jobs asked for, {taken} taken; p99 of refusals {:.1} ms", refused.as_secs_f64() * 1e3),
    );
    pressure.holds(alive < Duration::from_millis(100), &format!("p99 of /livez {:.1} ms", alive.as_secs_f64() * 1e3));
    pressure.holds(
        share >= 0.9,
        &format!("capacity {capacity:.1} jobs a second, goodput {goodput:.1} ({:.0} %)", share * 1e2),
    );
    pressure.holds(memory < MAX_MEMORY_MEBIBYTES, &format!("most memory {memory} MiB"));
}
