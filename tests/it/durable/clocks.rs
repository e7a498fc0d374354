//! Clocks that are set while the service works: no job is lost or taken from who has it, and no result goes before its time.
//!
//! The real binary and the real database are told another time of day by libfaketime (Debian's package of that name, which `tests/run`
//! installs). Lengths of time stay as they are, as when somebody sets a machine's clock.

use std::{fs, os::unix::fs::PermissionsExt, time::Duration};

use jiff::Timestamp;
use retargetd::telemetry::Clock;
use serde_json::json;

use super::{
    studio::{CLIP, Customer, Place},
    support::ServiceProcess,
};
use crate::{service_process::signal, support::skip};

const HOUR: i64 = 3600;
/// As short as a busy machine can keep up with, and a job runs for longer.
const FLAGS: [&str; 4] = ["--lease-period", "3s", "--sweep-interval", "200ms"];

/// A time of day that is told to processes, as far from the machine's as a file says.
struct FalseClock(tempfile::TempDir);

impl FalseClock {
    /// `None`, said aloud, where there is no libfaketime; `tests/run` installs it.
    fn new() -> Option<Self> {
        if Self::library().is_none() {
            skip("libfaketime is not installed; tests/run installs it");
            return None;
        }
        let folder = tempfile::tempdir().expect("a temporary folder");
        // A database runs as somebody else.
        fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o755)).expect("it can be opened to others");
        let clock = Self(folder);
        clock.set(0);
        Some(clock)
    }

    fn library() -> Option<String> {
        let places = fs::read_dir("/usr/lib").into_iter().flatten().flatten();
        let mut places = places.map(|entry| entry.path().join("faketime/libfaketimeMT.so.1"));
        places.find(|path| path.exists()).map(|path| path.display().to_string())
    }

    /// Sets it that many hours before or behind the machine's.
    fn set(&self, hours: i64) {
        let (file, new) = (self.0.path().join("offset"), self.0.path().join("new"));
        fs::write(&new, format!("{:+}\n", hours * HOUR)).expect("it can be written");
        fs::rename(new, file).expect("it can be renamed");
    }

    fn variables(&self) -> Vec<(&'static str, String)> {
        vec![
            ("LD_PRELOAD", Self::library().expect("was there")),
            ("FAKETIME_TIMESTAMP_FILE", self.0.path().join("offset").display().to_string()),
            // Looked at each time.
            ("FAKETIME_NO_CACHE", "1".to_owned()),
            ("FAKETIME_DONT_FAKE_MONOTONIC", "1".to_owned()),
        ]
    }
}

/// A job that takes several leases, on a clip of its own.
async fn long_job(customer: &mut Customer, url: &str) -> String {
    let seconds = if cfg!(debug_assertions) { "400" } else { "900" };
    let clip = customer.upload(url, &CLIP.replace("0.0333333", seconds)).await.expect("is taken");
    let config = json!({"task": "edit", "edit": {"fps": 1000}});
    let body = json!({"source": {"asset": clip}, "config": config, "output": ["poses_json"]});
    let id = customer.ask_for(url, &body, "").await.expect("is taken");
    while customer.job(url, &id).await.expect("an answer")["state"] != "running" {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    id
}

async fn asked(customer: &mut Customer, url: &str, count: usize) {
    let asset = customer.upload(url, CLIP).await.expect("is taken");
    for _ in 0..count {
        assert!(customer.ask(url, &asset).await, "is taken");
    }
}

/// Every job has what it gave, and nobody took it from who had it.
async fn all_were_done_once(customer: &Customer, url: &str) {
    let states = customer.collect(url).await;
    assert_eq!(states.get("succeeded"), Some(&customer.promised.len()), "all of them: {states:?}");
    let jobs = customer.list(url, "/v1/jobs").await;
    assert_eq!(jobs.len(), customer.promised.len(), "none is lost, none comes twice");
    for job in jobs {
        assert_eq!(job["attempt"], 1, "begun once: {job}");
    }
}

/// Of two jobs, one was with a worker that died.
async fn one_was_taken_up(customer: &Customer, url: &str, jobs: &[String; 2]) {
    let states = customer.collect(url).await;
    assert_eq!(states.get("succeeded"), Some(&customer.promised.len()), "also what the dead had: {states:?}");
    let mut attempts = Vec::new();
    for id in jobs {
        attempts.push(customer.job(url, id).await.expect("an answer")["attempt"].as_u64());
    }
    attempts.sort_unstable();
    assert_eq!(attempts, [Some(1), Some(2)], "one was taken up by another, the other was not");
}

async fn is_running(customer: &Customer, url: &str, id: &str) -> bool {
    customer.job(url, id).await.expect("an answer")["state"] == "running"
}

#[tokio::test(flavor = "multi_thread")]
async fn one_process_lives_with_a_clock_that_is_set() {
    let Some(clock) = FalseClock::new() else { return };
    let place = Place::folder();
    let service = place.serve(&[&FLAGS[..], &["--workers", "2"]].concat(), &clock.variables());
    let mut customer = Customer::new();
    for hours in [1, -1] {
        asked(&mut customer, &service.url, 5).await;
        let long = long_job(&mut customer, &service.url).await;
        clock.set(hours);
        asked(&mut customer, &service.url, 5).await;
        let job = customer.job(&service.url, customer.promised.last().expect("asked")).await.expect("an answer");
        let told: Timestamp = job["created_at"].as_str().expect("a time").parse().expect("a time");
        let off = told.duration_since(Clock::system().now()).as_secs();
        assert!((off - hours * HOUR).abs() < HOUR / 2, "the service goes by the clock that was set: {off} s off");
        assert!(is_running(&customer, &service.url, &long).await, "while a job runs");
        all_were_done_once(&customer, &service.url).await;
    }
    assert_eq!(service.terminate(), Some(0), "it ends well");
}

/// Leases go by the database's time, whatever the workers take it for.
#[tokio::test(flavor = "multi_thread")]
async fn workers_whose_clocks_disagree_leave_one_another_their_jobs() {
    let (Some(ahead), Some(behind)) = (FalseClock::new(), FalseClock::new()) else { return };
    let Some(place) = Place::shared() else { return };
    let api = place.serve(&[&FLAGS[..], &["--workers", "0"]].concat(), &ahead.variables());
    let flags = [&FLAGS[..], &["--workers", "1"]].concat();
    let _ahead = place.worker(&flags, &ahead.variables());
    let mut behind_worker = place.worker(&flags, &behind.variables());
    ahead.set(1);
    behind.set(-1);
    let mut customer = Customer::new();
    long_job(&mut customer, &api.url).await;
    long_job(&mut customer, &api.url).await;
    asked(&mut customer, &api.url, 10).await;
    all_were_done_once(&customer, &api.url).await;

    let long = [long_job(&mut customer, &api.url).await, long_job(&mut customer, &api.url).await];
    behind_worker.kill();
    one_was_taken_up(&customer, &api.url, &long).await;
}

/// Where the clock that leases go by is set itself, nobody loses a job who works on it, and who is gone is noticed all the same.
#[tokio::test(flavor = "multi_thread")]
async fn a_database_whose_clock_is_set_takes_no_job_from_who_has_it() {
    let Some(clock) = FalseClock::new() else { return };
    let Some(place) = Place::shared_under(&clock.variables()) else { return };
    let api = place.serve(&[&FLAGS[..], &["--workers", "0"]].concat(), &[]);
    let flags = [&FLAGS[..], &["--workers", "1"]].concat();
    let mut workers: Vec<ServiceProcess> = (0..2).map(|_| place.worker(&flags, &[])).collect();
    let mut customer = Customer::new();
    let long = [long_job(&mut customer, &api.url).await, long_job(&mut customer, &api.url).await];
    // Everybody has looked at the clock before.
    tokio::time::sleep(Duration::from_millis(1100)).await;
    clock.set(1);
    for id in &long {
        assert!(is_running(&customer, &api.url, id).await, "while both have one");
    }
    all_were_done_once(&customer, &api.url).await;

    let long = [long_job(&mut customer, &api.url).await, long_job(&mut customer, &api.url).await];
    // Gone before it could say by the new time that it is there.
    signal(workers[0].id(), "-STOP");
    clock.set(0);
    workers[0].kill();
    // Within the patience of a test, and not an hour later.
    one_was_taken_up(&customer, &api.url, &long).await;
}
