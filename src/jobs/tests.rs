//! Scheduling, with an engine that does what the config says.

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use super::{
    Answer, AssetId, Assets, ConfigDocument, Engine, EngineRequest, InputRole, JobSnapshot, JobState, Jobs, NewJob,
    Principal, Question, Refusal, Workers,
};
use crate::{
    config::Settings,
    engine::{Control, Failure, FailureCode, Format, NamedBytes, Outcome, Output, Report},
    outbound::Outbound,
    store::{Claim, DataFolder, Lane, LeaseId, Store},
    telemetry::Clock,
};

/// Long enough for a busy machine; nothing waits this long when all is well.
const PATIENCE: Duration = Duration::from_secs(30);

fn me() -> Principal {
    Principal::anonymous()
}

struct Obedient;

impl Engine for Obedient {
    fn ask(&self, asked: &EngineRequest<'_>, control: &Control) -> Result<Answer, Failure> {
        let files = &asked.files;
        let bytes = |file: Option<NamedBytes<'_>>| file.map_or_else(Vec::new, |file| file.bytes.to_vec());
        match &asked.question {
            Question::Retarget | Question::Edit | Question::Pose { .. } | Question::Draw => {}
            Question::Inspect => return Ok(Answer::Document(serde_json::json!({"format": "bvh"}))),
            other => panic!("nobody asks for that: {other:?}"),
        }
        match bytes(files.config).as_slice() {
            b"panic" => panic!("as the config says"),
            b"refuse" => return Err(Failure::new(FailureCode::NoAnimation, "the source has no animation")),
            b"wait" => loop {
                control.check().map_err(|_| Failure::new(FailureCode::Canceled, "canceled"))?;
                std::thread::sleep(Duration::from_millis(1));
            },
            _ => {}
        }
        let output = Output { format: Format::Glb, name: "out.glb".to_owned(), bytes: bytes(files.target) };
        let outcome =
            Outcome { outputs: vec![output], report: Report::default(), resolved_spec: serde_json::json!({}) };
        Ok(Answer::EngineResult(Box::new(outcome.try_into()?)))
    }
}

struct Fixture {
    jobs: Jobs,
    assets: Assets,
    asset: AssetId,
    clock: Clock,
    _root: tempfile::TempDir,
    _folder: DataFolder,
}

impl Fixture {
    async fn new(settings: &[(&str, &str)]) -> Self {
        let given: BTreeMap<_, _> = settings.iter().copied().collect();
        let settings = Settings::read(|setting| given.get(setting.name).map(ToString::to_string)).expect("settings");
        let root = tempfile::tempdir().expect("a temporary folder");
        let folder = DataFolder::take(root.path()).expect("nobody has it");
        let store = Arc::new(Store::open(&folder).await.expect("the store opens"));
        let clock = Clock::system();
        let jobs = Jobs::new(store, Arc::new(Obedient), Arc::new(settings), clock.clone(), &[]);
        let assets = Assets::new(&jobs, Outbound::new(&Settings::default(), Clock::system()));
        let mut upload = assets.begin("walk.bvh", None).await.expect("begins");
        upload.write(b"HIERARCHY").await.expect("writes");
        let file = upload.finish(None).await.expect("finishes");
        let asset = assets.keep(&me(), file).await.expect("is kept").0.id;
        Self { jobs, assets, asset, clock, _root: root, _folder: folder }
    }

    async fn submit(&self, config: &str) -> Result<JobSnapshot, Refusal> {
        let inputs = [InputRole::Source, InputRole::Target].map(|role| (role, self.asset.clone())).into();
        let config = Some(ConfigDocument { file_name: "config.json".to_owned(), text: config.into() });
        let job = self.jobs.submit(&me(), NewJob { inputs, config, ..NewJob::default() }).await?.job;
        self.jobs.seen(job).await
    }

    async fn until(&self, job: &JobSnapshot, state: JobState) {
        let reached = async {
            while self.jobs.get(&me(), &job.record.id).await.expect("is there").record.state != state {
                tokio::time::sleep(Duration::from_millis(2)).await;
            }
        };
        tokio::time::timeout(PATIENCE, reached).await.expect("the state is reached");
    }

    async fn until_not(&self, job: &JobSnapshot, state: JobState) {
        while self.jobs.get(&me(), &job.record.id).await.expect("is there").record.state == state {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    }

    async fn end_of(&self, job: &JobSnapshot) -> JobSnapshot {
        self.jobs.wait(&me(), &job.record.id, PATIENCE).await.expect("is there")
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_succeed_fail_and_panic_each_by_itself() {
    for isolation in ["thread", "inline"] {
        each_job_has_its_own_end(Fixture::new(&[("workers", "2"), ("isolation", isolation)]).await).await;
    }
}

async fn each_job_has_its_own_end(fixture: Fixture) {
    let workers = Workers::start(&fixture.jobs, 2);
    let mut ends = Vec::new();
    for config in ["panic", "refuse", "fine", "panic", "fine"] {
        ends.push(fixture.submit(config).await.expect("is taken"));
    }
    let mut codes = Vec::new();
    for job in &ends {
        let end = fixture.end_of(job).await;
        codes.push(end.record.failure.map_or_else(|| end.record.state.name().to_owned(), |failure| failure.code));
    }
    assert_eq!(codes, ["internal", "no_animation", "succeeded", "internal", "succeeded"], "each has its own end");
    let end = fixture.end_of(&ends[2]).await;
    let result = end.results.first().expect("a result");
    assert!(result.expires_at > result.created_at && end.record.expires_at.is_some(), "expiry is visible");
    assert_eq!(fixture.jobs.resolved_spec(&me(), &end.record.id).await.expect("is there"), "{}", "the resolved spec");
    workers.stop(PATIENCE).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn cancel_works_on_running_and_on_queued_jobs_with_a_full_queue() {
    let fixture = Fixture::new(&[("workers", "1"), ("max_queued_jobs", "1")]).await;
    let workers = Workers::start(&fixture.jobs, 1);
    let running = fixture.submit("wait").await.expect("is taken");
    fixture.until(&running, JobState::Running).await;
    let queued = fixture.submit("fine").await.expect("is taken");
    assert_eq!(queued.queue_position, Some(1), "it waits");
    let refused = fixture.submit("fine").await;
    assert!(matches!(refused, Err(Refusal::QueueFull { most: 1, .. })), "full: {refused:?}");
    let canceled = fixture.jobs.cancel(&me(), &queued.record.id).await.expect("works");
    assert_eq!(canceled.record.state, JobState::Canceled, "at once");
    let canceling = fixture.jobs.cancel(&me(), &running.record.id).await.expect("works").record.state;
    assert!(matches!(canceling, JobState::Canceling | JobState::Canceled), "on its way: {canceling:?}");
    assert_eq!(fixture.end_of(&running).await.record.state, JobState::Canceled, "canceled");
    let again = fixture.jobs.cancel(&me(), &running.record.id).await.expect("any number of times");
    assert_eq!(again.record.state, JobState::Canceled, "final states never change");
    workers.stop(PATIENCE).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn cancel_wins_or_loses_every_race_cleanly() {
    let fixture = Fixture::new(&[("workers", "2")]).await;
    let workers = Workers::start(&fixture.jobs, 2);
    for number in 0..60 {
        let job = fixture.submit(if number % 3 == 0 { "fine" } else { "wait" }).await.expect("is taken");
        if number % 2 == 0 {
            fixture.until_not(&job, JobState::Queued).await;
        }
        fixture.jobs.cancel(&me(), &job.record.id).await.expect("works");
        let state = fixture.end_of(&job).await.record.state;
        let may_have_been_done = number % 3 == 0 && state == JobState::Succeeded;
        assert!(state == JobState::Canceled || may_have_been_done, "job {number} ended {state:?}");
    }
    workers.stop(PATIENCE).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_that_runs_too_long_is_stopped() {
    let fixture = Fixture::new(&[("workers", "1"), ("job_timeout", "1s")]).await;
    let workers = Workers::start(&fixture.jobs, 1);
    let job = fixture.submit("wait").await.expect("is taken");
    let failure = fixture.end_of(&job).await.record.failure.expect("it failed");
    assert_eq!(failure.code, "job_timeout", "with its own code");
    assert_eq!(
        fixture.end_of(&fixture.submit("fine").await.expect("is taken")).await.results.len(),
        1,
        "the worker goes on"
    );
    workers.stop(PATIENCE).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drain_gives_running_jobs_back_and_the_next_start_ends_them() {
    let fixture = Fixture::new(&[("workers", "1")]).await;
    let workers = Workers::start(&fixture.jobs, 1);
    let running = fixture.submit("wait").await.expect("is taken");
    fixture.until(&running, JobState::Running).await;
    let queued = fixture.submit("fine").await.expect("is taken");
    fixture.jobs.drain();
    assert!(matches!(fixture.submit("fine").await, Err(Refusal::Draining)), "takes nothing new");
    workers.stop(Duration::ZERO).await;
    let record = fixture.jobs.get(&me(), &running.record.id).await.expect("is there").record;
    assert_eq!((record.state, record.attempt), (JobState::Queued, 0), "handed back, and the attempt does not count");

    let inner = &fixture.jobs.0;
    let next =
        Jobs::new(Arc::clone(&inner.store), Arc::new(Obedient), Arc::clone(&inner.settings), Clock::system(), &[]);
    assert_eq!(next.recover().await.expect("recovers"), 2, "both are taken up");
    let workers = Workers::start(&next, 2);
    let end = next.wait(&me(), &queued.record.id, PATIENCE).await.expect("is there");
    assert_eq!(end.record.state, JobState::Succeeded, "ended by the next start");
    next.cancel(&me(), &running.record.id).await.expect("works");
    workers.stop(PATIENCE).await;
}

#[tokio::test]
async fn a_job_that_the_process_died_under_too_often_is_not_tried_again() {
    let fixture = Fixture::new(&[("max_attempts", "2")]).await;
    let job = fixture.submit("fine").await.expect("is taken");
    let crash = async || {
        let records = fixture.jobs.0.store.records();
        let lease = LeaseId::new();
        match records.claim_job(&lease, Duration::from_secs(60), fixture.clock.now(), Lane::Batch).await {
            Ok(Claim::Job(taken)) => assert_eq!(taken.id, job.record.id, "as if it had started"),
            Ok(Claim::Suspect(taken)) => {
                assert!(records.mark_alone(&taken.id, &lease).await.expect("notes"), "as if it had started alone");
            }
            other => panic!("there is a job: {other:?}"),
        }
        fixture.jobs.recover().await.expect("recovers");
        fixture.jobs.get(&me(), &job.record.id).await.expect("is there").record
    };
    let first = crash().await;
    assert_eq!((first.state, first.attempt, first.crashes), (JobState::Queued, 1, 1), "tried again");
    let second = crash().await;
    assert_eq!(second.failure.map(|failure| failure.code).as_deref(), Some("worker_crashed"), "given up");
    let same_files = fixture.submit("fine").await;
    assert!(matches!(same_files, Err(Refusal::Quarantined { .. })), "nor is the same again: {same_files:?}");
    assert!(fixture.submit("another config").await.is_ok(), "what it does with another config is not known");
    fixture.clock.advance(Duration::from_secs(7200));
    assert!(fixture.submit("fine").await.is_ok(), "for a while");
}

#[tokio::test(flavor = "multi_thread")]
async fn inputs_of_unfinished_jobs_stay_and_what_has_expired_goes() {
    let fixture = Fixture::new(&[("workers", "1"), ("asset_retention", "1h"), ("result_retention", "1h")]).await;
    let job = fixture.submit("fine").await.expect("is taken");
    let in_use = fixture.assets.delete(&me(), &fixture.asset).await;
    assert!(matches!(in_use, Err(Refusal::InUse(_))), "a queued job needs it: {in_use:?}");
    fixture.clock.advance(Duration::from_secs(7200));
    fixture.jobs.sweep().await;
    let expired = fixture.assets.get(&me(), &fixture.asset).await;
    assert!(matches!(expired, Err(Refusal::Expired { .. })), "expired, but still there for its job: {expired:?}");
    let workers = Workers::start(&fixture.jobs, 1);
    let result = fixture.end_of(&job).await.results.first().expect("a result").clone();
    fixture.jobs.sweep().await;
    let gone = fixture.assets.get(&me(), &fixture.asset).await;
    assert!(matches!(gone, Err(Refusal::NotFound { .. })), "now nobody needs it: {gone:?}");
    assert!(fixture.jobs.content(&result.sha256, None).await.is_ok(), "the result has the same bytes, so they stay");
    fixture.clock.advance(Duration::from_secs(7200));
    fixture.jobs.sweep().await;
    assert!(fixture.jobs.content(&result.sha256, None).await.is_err(), "and go when it expires");
    workers.stop(PATIENCE).await;
}
