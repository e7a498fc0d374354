//! A service to press, what presses it, and what is read off it.

use std::{
    collections::BTreeMap,
    path::Path,
    process::Command,
    time::{Duration, Instant},
};

use reqwest::{Client, StatusCode};
use serde_json::{Value, json};

use crate::{
    service_process::{ServiceProcess, taken},
    support::Extent,
};

/// Long enough for a busy machine; nothing waits this long when all is well.
const PATIENCE: Duration = Duration::from_secs(120);

/// For how long the service is pressed, and whether it is held to figures: only where somebody asked for a length.
pub(super) struct Pressure {
    pub(super) lasts: Duration,
    extent: Extent,
}

impl Pressure {
    /// `usual_seconds`, or as long as `RETARGETD_TEST_SECONDS` says.
    pub(super) fn of(usual_seconds: usize) -> Self {
        let extent = Extent::of("RETARGETD_TEST_SECONDS", usual_seconds);
        Self { lasts: Duration::from_secs(extent.amount as u64), extent }
    }

    /// Asserts what only a measurement can say, and prints it.
    pub(super) fn holds(&self, is_true: bool, figure: &str) {
        self.extent.holds(is_true, figure);
    }

    /// The same for several, all of which are printed.
    pub(super) fn all_hold(&self, figures: &[(bool, String)]) {
        self.extent.all_hold(figures);
    }
}

/// A server with its folder, and a client that knows a source and a target there.
pub(super) struct Pressed {
    pub(super) process: ServiceProcess,
    pub(super) client: Client,
    job: Value,
}

impl Pressed {
    pub(super) async fn start(data: &Path, flags: &[&str]) -> Self {
        let process = ServiceProcess::listening(
            Command::new(env!("CARGO_BIN_EXE_retargetd"))
                .args(["serve", "--listen", "127.0.0.1:0", "--log", "error", "--result-cache", "off", "--data"])
                .arg(data)
                .args(flags),
        );
        let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
        let mut pressed = Self { process, client, job: Value::Null };
        let source = pressed.upload("walk.glb", retargetd::samples::walk_clip()).await;
        let target = pressed.upload("mannequin.glb", retargetd::samples::mannequin()).await;
        // Enough work that the requests themselves are little beside it, in builds that are fast as in those that are not.
        let fps = if cfg!(debug_assertions) { 10 } else { 480 };
        let config = json!({"edit": {"fps": fps}});
        pressed.job =
            json!({"source": {"asset": source}, "target": {"asset": target}, "config": config, "output": ["npz"]});
        pressed
    }

    pub(super) fn at(&self, path: &str) -> String {
        format!("{}{path}", self.process.url)
    }

    pub(super) async fn upload(&self, name: &str, bytes: Vec<u8>) -> String {
        let answer = self.client.post(self.at(&format!("/v1/assets?filename={name}"))).body(bytes).send().await;
        taken(answer.expect("an answer")).await
    }

    /// Asks for a job.
    pub(super) fn ask(&self) -> reqwest::RequestBuilder {
        self.client.post(self.at("/v1/jobs")).json(&self.job)
    }

    /// The job in its last state.
    pub(super) async fn end_of(&self, id: &str) -> Value {
        let began = Instant::now();
        loop {
            let job = self.client.get(self.at(&format!("/v1/jobs/{id}"))).header("prefer", "wait=30");
            let job: Value = job.send().await.expect("an answer").json().await.expect("JSON");
            if ["succeeded", "failed", "canceled"].iter().any(|state| job["state"] == *state) {
                return job;
            }
            assert!(began.elapsed() < PATIENCE, "every acknowledged job ends: {job}");
        }
    }

    pub(super) async fn books(&self) -> Books {
        let text = self.client.get(self.at("/metrics")).send().await.expect("an answer");
        Books::read(&text.text().await.expect("text"))
    }

    /// The books, once nothing waits and nothing runs.
    pub(super) async fn books_at_rest(&self) -> Books {
        let began = Instant::now();
        loop {
            let books = self.books().await;
            if books.queued == 0 && books.running == 0 {
                return books;
            }
            assert!(began.elapsed() < PATIENCE, "the queue empties: {books:?}");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }
}

/// What the metrics say of jobs.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Books {
    pub(super) submitted: u64,
    /// By state.
    pub(super) finished: BTreeMap<String, u64>,
    pub(super) queued: u64,
    pub(super) running: u64,
}

impl Books {
    fn read(text: &str) -> Self {
        let mut books = Self::default();
        for line in text.lines().filter(|line| !line.starts_with('#')) {
            let Some((name, value)) = line.rsplit_once(' ') else { continue };
            let value = value.parse::<f64>().unwrap_or_default() as u64;
            match name.split('{').next().unwrap_or_default() {
                "retargetd_jobs_submitted_total" => books.submitted += value,
                "retargetd_jobs_queued" => books.queued = value,
                "retargetd_jobs_running" => books.running = value,
                "retargetd_jobs_finished_total" => {
                    let state = name.split("state=\"").nth(1).and_then(|rest| rest.split('"').next());
                    *books.finished.entry(state.unwrap_or_default().to_owned()).or_default() += value;
                }
                _ => {}
            }
        }
        books
    }

    /// How many came to an end.
    pub(super) fn ended(&self) -> u64 {
        self.finished.values().sum()
    }

    /// Nothing is lost and nothing is counted twice.
    pub(super) fn assert_balanced(&self) {
        assert_eq!(self.submitted, self.ended() + self.queued + self.running, "the books balance: {self:?}");
    }
}

/// How long answers took, and of which status they were.
#[derive(Debug, Default)]
pub(super) struct Answers(BTreeMap<u16, Vec<Duration>>);

impl Answers {
    pub(super) fn add(&mut self, status: StatusCode, took: Duration) {
        self.0.entry(status.as_u16()).or_default().push(took);
    }

    pub(super) fn count(&self, status: u16) -> usize {
        self.0.get(&status).map_or(0, Vec::len)
    }

    pub(super) fn statuses(&self) -> Vec<u16> {
        self.0.keys().copied().collect()
    }

    /// What 99 of 100 answers of that status took at most.
    pub(super) fn p99(&mut self, status: u16) -> Duration {
        let Some(times) = self.0.get_mut(&status) else { return Duration::ZERO };
        times.sort_unstable();
        times[(times.len() * 99 / 100).min(times.len() - 1)]
    }
}
