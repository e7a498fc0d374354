//! What a one-shot costs beside the engine: how much longer it takes, and how many there are at once.

use std::{
    sync::{
        Arc,
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
use tokio::task::JoinSet;

use super::support::{Pressed, Pressure};

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

    /// Asks for one file and waits for it. Gives how long that took, and how long the engine by itself.
    async fn retarget(&self, service: &Pressed) -> (Duration, Duration) {
        let source = multipart::Part::text(self.clip.clone()).file_name("walk.bvh");
        let target = multipart::Part::bytes(self.character.clone()).file_name("mannequin.glb");
        let form = multipart::Form::new().part("source", source).part("target", target);
        let began = Instant::now();
        let answer = service.client.post(service.at("/v1/retarget")).multipart(form).send().await.expect("an answer");
        assert_eq!(answer.status(), StatusCode::OK, "the file");
        let timing = answer.headers()["server-timing"].to_str().expect("text").to_owned();
        let bytes = answer.bytes().await.expect("all of it");
        let took = began.elapsed();
        assert!(bytes.starts_with(b"glTF"), "a GLB");
        let total = timing.split("total;dur=").nth(1).and_then(|rest| rest.split(',').next()?.parse::<f64>().ok());
        (took, Duration::from_secs_f64(total.expect("the engine's total") / 1e3))
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

fn median(mut times: Vec<Duration>) -> Duration {
    times.sort_unstable();
    times[times.len() / 2]
}

/// One caller after the other's answer, and then as many callers as there are workers.
#[tokio::test(flavor = "multi_thread")]
async fn one_shots_cost_little_beside_the_engine() {
    let pressure = Pressure::of(2);
    let (data, part) = (tempfile::tempdir().expect("a temporary folder"), pressure.lasts / 3);
    let workers = std::thread::available_parallelism().map_or(2, std::num::NonZero::get);
    let service = Arc::new(Pressed::start(data.path(), &["--workers", &workers.to_string()]).await);
    let files = Arc::new(Files::of(&service).await);

    let (mut beyond, mut by_itself, began) = (Vec::new(), Vec::new(), Instant::now());
    while began.elapsed() < part || beyond.is_empty() {
        let (took, engine) = files.retarget(&service).await;
        beyond.push(took.saturating_sub(engine));
        by_itself.push(engine);
    }
    let (asked, began) = (Arc::new(AtomicU64::new(0)), Instant::now());
    let mut callers = JoinSet::new();
    for _ in 0..workers * 2 {
        let (service, files, asked) = (Arc::clone(&service), Arc::clone(&files), Arc::clone(&asked));
        callers.spawn(async move {
            while began.elapsed() < part {
                files.retarget(&service).await;
                asked.fetch_add(1, Ordering::Relaxed);
            }
        });
    }
    callers.join_all().await;
    let rate = asked.load(Ordering::Relaxed) as f64 / began.elapsed().as_secs_f64();
    let books = service.books_at_rest().await;
    books.assert_balanced();
    let all = beyond.len() as u64 + asked.load(Ordering::Relaxed) + 1;
    assert_eq!(books.finished.get("succeeded"), Some(&all), "every job is in the books: {books:?}");

    let alone = tokio::task::spawn_blocking(move || {
        [(1, workers), (workers, 1)].map(|(loops, threads)| files.by_the_engine_alone(loops, threads, part))
    });
    let [in_a_loop, in_loops] = alone.await.expect("it runs");
    let (count, beyond, by_itself) = (beyond.len(), median(beyond).as_secs_f64() * 1e3, median(by_itself));
    pressure.all_hold(&[
        (
            beyond < 5.0,
            format!(
                "{count} one-shots, in the median {beyond:.1} ms beyond the engine's own {:.1}",
                by_itself.as_secs_f64() * 1e3
            ),
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
