//! What a one-shot costs beside the engine: how much longer it takes, and how many there are at once.

use std::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use reqwest::{StatusCode, multipart};
use retargetd::{
    engine::{self, Inputs, Limits, NamedBytes},
    model::Control,
    samples,
};

use super::{
    caller::Caller,
    support::{Pressed, Pressure},
};

/// A clip and a character, as small jobs have them: 301 frames, 65 joints.
struct Files {
    clip: String,
    character: Vec<u8>,
}

impl Files {
    /// The sample walk at another rate, as a BVH that the service itself writes.
    async fn of(service: &Pressed) -> Self {
        let clip = multipart::Part::bytes(samples::walk_clip()).file_name("walk.glb");
        let config = multipart::Part::text(r#"{"edit": {"fps": 75}, "output": {"format": "bvh"}}"#);
        let form = multipart::Form::new().part("source", clip).part("config", config.file_name("config.json"));
        let answer = service.client.post(service.at("/v1/edits")).multipart(form).send().await.expect("an answer");
        assert_eq!(answer.status(), StatusCode::OK, "the clip");
        Self { clip: answer.text().await.expect("a BVH"), character: samples::mannequin() }
    }

    /// Somebody who has them retargeted.
    fn caller(&self, service: &str) -> Caller {
        let parts = [("source", "walk.bvh", self.clip.as_bytes()), ("target", "mannequin.glb", &self.character)];
        Caller::of(service, parts)
    }

    /// As many callers as that, each of whom asks again when it is answered. Gives of each answer how long it took, and how long the
    /// engine by itself.
    fn ask(&self, service: &str, callers: usize, lasts: Duration) -> Vec<(Duration, Duration)> {
        let (answers, began) = (Mutex::new(Vec::new()), Instant::now());
        std::thread::scope(|scope| {
            for _ in 0..callers {
                scope.spawn(|| {
                    let mut caller = self.caller(service);
                    loop {
                        let answer = caller.ask();
                        answers.lock().expect("nobody panics").push(answer);
                        if began.elapsed() >= lasts {
                            return;
                        }
                    }
                });
            }
        });
        answers.into_inner().expect("nobody panics")
    }

    /// Jobs a second of the engine in as many loops, each with threads of its own.
    fn by_the_engine_alone(&self, loops: usize, threads: usize, lasts: Duration) -> f64 {
        let (done, began) = (AtomicU64::new(0), Instant::now());
        std::thread::scope(|scope| {
            for _ in 0..loops {
                scope.spawn(|| {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
                    while began.elapsed() < lasts {
                        let source = NamedBytes { name: "walk.bvh", bytes: self.clip.as_bytes() };
                        let target = NamedBytes { name: "mannequin.glb", bytes: &self.character };
                        let (source_rest, target_rest, config) = (None, None, None);
                        let inputs = Inputs { source, target, source_rest, target_rest, config, formats: &[] };
                        let outcome = pool
                            .install(|| engine::retarget(&inputs, &Limits::default(), &Control::new()))
                            .expect("fits");
                        assert!(outcome.outputs[0].bytes.starts_with(b"glTF"), "a GLB");
                        done.fetch_add(1, Ordering::Relaxed);
                    }
                });
            }
        });
        done.into_inner() as f64 / began.elapsed().as_secs_f64()
    }
}

/// In milliseconds.
fn median(mut times: Vec<Duration>) -> f64 {
    times.sort_unstable();
    times[times.len() / 2].as_secs_f64() * 1e3
}

/// One caller, and then twice as many as there are workers.
#[tokio::test(flavor = "multi_thread")]
async fn one_shots_cost_little_beside_the_engine() {
    let pressure = Pressure::of(2);
    let (data, part) = (tempfile::tempdir().expect("a temporary folder"), pressure.lasts / 3);
    let workers = std::thread::available_parallelism().map_or(2, std::num::NonZero::get);
    let service = Pressed::start(data.path(), &["--workers", &workers.to_string()]).await;
    let (files, url) = (Arc::new(Files::of(&service).await), service.process.url.clone());

    let asked = tokio::task::spawn_blocking({
        let files = Arc::clone(&files);
        move || {
            let one_by_one = files.ask(&url, 1, part);
            let began = Instant::now();
            let together = files.ask(&url, workers * 2, part).len();
            (one_by_one, together, together as f64 / began.elapsed().as_secs_f64())
        }
    });
    let (one_by_one, together, rate) = asked.await.expect("it runs");
    let books = service.books_at_rest().await;
    books.assert_balanced();
    let all = (one_by_one.len() + together) as u64 + 1;
    assert_eq!(books.finished.get("succeeded"), Some(&all), "every job is in the books: {books:?}");

    let alone = tokio::task::spawn_blocking(move || {
        [(1, workers), (workers, 1)].map(|(loops, threads)| files.by_the_engine_alone(loops, threads, part))
    });
    let [in_a_loop, in_loops] = alone.await.expect("it runs");
    let beyond = median(one_by_one.iter().map(|(took, engine)| took.saturating_sub(*engine)).collect());
    let engine = median(one_by_one.iter().map(|(_, engine)| *engine).collect());
    pressure.all_hold(&[
        (
            beyond < 5.0,
            format!("{} one-shots, in the median {beyond:.1} ms beyond the engine's own {engine:.1}", one_by_one.len()),
        ),
        (
            rate > in_a_loop * 0.85 && rate > in_loops * 0.4,
            format!(
                "{rate:.1} one-shots a second, with those who ask on the same cores; the engine in a loop, with all cores for \
                 each, {in_a_loop:.1} ({:.0} %); in {workers} loops, with one core each, {in_loops:.1} ({:.0} %)",
                rate / in_a_loop * 1e2,
                rate / in_loops * 1e2,
            ),
        ),
    ]);
}
