//! One suite for both databases: what the records promise, whichever keeps them.

use std::{collections::BTreeSet, time::Duration};

use jiff::Timestamp;
use retargetd::store::{
    Added, AfterCrash, AssetId, AssetRecord, Claim, DocumentChange, DocumentKind, EventReach, FinishedJob, GiveBack,
    Held, Holdings, Idempotency, InputRole, JobFilter, JobId, JobInput, JobKind, JobRecord, JobRequest, JobState,
    JobTask, Lane, LeaseId, NewDocument, Precondition, Principal, Records, ResultId, ResultRecord, StoreError,
    StoredProgress,
};

use super::{
    batch_records::{
        a_batch_goes_with_the_last_of_its_jobs, a_batch_is_stopped_whatever_its_jobs_do,
        a_batch_is_written_with_all_its_jobs_or_not_at_all, a_failure_stops_what_waits_in_its_transaction,
        an_item_that_is_asked_for_again_counts_once, jobs_of_batches_wait_behind_single_ones_and_callers_take_turns,
    },
    named_records::{bounds, documents_have_versions_and_one_writer_at_a_time, keys_are_found_bounded_and_revoked},
    turns::{time_that_was_not_asked_for_is_not_saved_up, who_has_long_jobs_waits_for_who_has_short_ones},
};

pub(super) const HOUR: Duration = Duration::from_secs(3600);

pub(super) fn principal(name: &str) -> Principal {
    Principal::parse(name).expect("a name")
}

pub(super) fn asset(owner: &str, sha256: &str) -> AssetRecord {
    AssetRecord {
        id: AssetId::new(),
        principal: principal(owner),
        sha256: sha256.to_owned(),
        bytes: 10,
        format: "bvh".to_owned(),
        file_name: "walk\0.bvh".to_owned(),
        created_at: Timestamp::UNIX_EPOCH,
        expires_at: Timestamp::UNIX_EPOCH + HOUR,
    }
}

/// One of the owner of the file.
pub(super) fn job(input: &AssetRecord, priority: i32) -> JobRecord {
    let principal = input.principal.clone();
    let input = JobInput { asset: input.id.clone(), sha256: input.sha256.clone(), file_name: input.file_name.clone() };
    JobRecord {
        id: JobId::new(),
        state: JobState::Queued,
        request: JobRequest {
            task: JobTask::Retarget,
            inputs: [(InputRole::Source, input.clone()), (InputRole::Target, input)].into(),
            config: None,
            formats: Vec::new(),
            labels: [("shot".to_owned(), "010 \u{0} ü".to_owned())].into(),
            preset: None,
            rigs: Vec::new(),
            result_name: None,
            skip_cache: false,
            webhook: None,
        },
        input_bytes: 20,
        attempt: 0,
        retry_of: None,
        created_at: Timestamp::UNIX_EPOCH,
        started_at: None,
        finished_at: None,
        expires_at: None,
        warnings: 0,
        judgment: None,
        failure: None,
        principal,
        priority,
        inputs_sha256: "inputs".to_owned(),
        memory_bytes: 1 << 40,
        crashes: 0,
        retries: 0,
        idempotency: None,
        lease: None,
        progress: None,
        trace_context: Some("00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01 a=1".to_owned()),
        cache_key: None,
        cached_from: None,
        batch: None,
    }
}

pub(super) fn end(state: JobState, results: Vec<ResultRecord>) -> FinishedJob {
    FinishedJob {
        state,
        finished_at: Timestamp::UNIX_EPOCH,
        expires_at: Timestamp::UNIX_EPOCH + HOUR,
        failure: None,
        stops_batch: None,
        report: Some("{}".to_owned()),
        resolved_spec: None,
        warnings: 3,
        judgment: None,
        results,
        cache_key: None,
        cached_from: None,
    }
}

fn result(job: &JobId, sha256: &str) -> ResultRecord {
    ResultRecord {
        id: ResultId::new(),
        job_id: job.clone(),
        format: "glb".to_owned(),
        file_name: "out.glb".to_owned(),
        sha256: sha256.to_owned(),
        bytes: 5,
        created_at: Timestamp::UNIX_EPOCH,
        expires_at: Timestamp::UNIX_EPOCH + HOUR,
    }
}

pub(super) async fn claim(records: &Records) -> Option<JobRecord> {
    match records.claim_job(&LeaseId::new(), HOUR, Timestamp::UNIX_EPOCH, Lane::Batch).await.expect("claims") {
        Claim::Job(job) | Claim::Suspect(job) => Some(*job),
        _ => None,
    }
}

pub(super) async fn added(records: &Records, owner: &str, priority: i32) -> JobRecord {
    let asset = records.add_asset(&asset(owner, "aa")).await.expect("writes").0;
    let job = job(&asset, priority);
    assert_eq!(records.add_job(&job).await.expect("writes"), Added::New, "its file is there");
    job
}

async fn a_job_reads_back_as_it_was_written(records: &Records) {
    let written = added(records, "anonymous", 7).await;
    let read = records.job(&written.id).await.expect("reads").expect("is there");
    assert_eq!(read, written, "every field");
    assert!(matches!(records.add_job(&written).await.expect("writes"), Added::Before(_)), "the same again is no fault");
    assert_eq!(records.queue_depth().await.expect("counts").jobs, 1, "and no second job");
    let lease = LeaseId::new();
    let missing = job(&asset("anonymous", "bb"), 0);
    assert_eq!(
        records.add_job(&missing).await.expect("answers"),
        Added::FileMissing,
        "without its file there is no job"
    );
    assert!(records.job(&missing.id).await.expect("reads").is_none(), "not even half of one");
    assert!(records.leased(&lease).await.expect("reads").is_none(), "nobody has that lease");
}

async fn a_job_and_the_files_that_came_with_it_are_written_together(records: &Records) {
    let known = records.add_asset(&asset("anonymous", "known")).await.expect("writes").0;
    let came = [asset("anonymous", "known"), asset("anonymous", "new")];
    let mut both = job(&came[0], 0);
    let target = job(&came[1], 0).request.inputs[&InputRole::Target].clone();
    both.request.inputs.insert(InputRole::Target, target);
    let (added, kept) = records.add_job_with_assets(&mut both, &came).await.expect("writes");
    assert_eq!(added, Added::New, "its files are there");
    let kept: Vec<_> = kept.into_iter().map(|(asset, is_new)| (asset.id, is_new)).collect();
    assert_eq!(
        kept,
        [(known.id.clone(), false), (came[1].id.clone(), true)],
        "the record that stands, and the new one"
    );
    let read = records.job(&both.id).await.expect("reads").expect("is there");
    let named = [&read.request.inputs[&InputRole::Source].asset, &read.request.inputs[&InputRole::Target].asset];
    assert_eq!(named, [&known.id, &came[1].id], "the job names those");
    assert!(
        matches!(records.remove_asset(&known.principal, &known.id).await, Err(StoreError::InUse(_))),
        "and needs them"
    );

    let stray = [asset("anonymous", "stray")];
    let mut without = job(&asset("anonymous", "nowhere"), 0);
    let (added, _) = records.add_job_with_assets(&mut without, &stray).await.expect("answers");
    assert_eq!(added, Added::FileMissing, "one of its files is not there");
    let owner = &stray[0].principal;
    assert!(records.asset(owner, &stray[0].id).await.expect("reads").is_none(), "so no file is there either");
}

async fn only_who_holds_the_lease_writes_the_end(records: &Records) {
    let job = added(records, "anonymous", 0).await;
    let taken = claim(records).await.expect("a job");
    assert_eq!((&taken.id, taken.state, taken.attempt), (&job.id, JobState::Running, 1), "it, and counted");
    assert!(claim(records).await.is_none(), "nobody else gets it");
    let (mine, other) = (taken.lease.clone().expect("a lease"), LeaseId::new());
    let done = end(JobState::Succeeded, vec![result(&job.id, "cc")]);
    for lease in [None, Some(&other)] {
        let written =
            records.finish_job(&job.id, (JobState::Running, lease), &done).await.expect("answers").is_written();
        assert!(!written, "not in these hands");
    }
    assert!(records.job_results(&job.id).await.expect("reads").is_empty(), "nothing is visible before the end");
    assert!(
        records.finish_job(&job.id, (JobState::Running, Some(&mine)), &done).await.expect("writes").is_written(),
        "the holder"
    );
    assert!(
        !records.finish_job(&job.id, (JobState::Running, Some(&mine)), &done).await.expect("answers").is_written(),
        "once"
    );
    let ended = records.job(&job.id).await.expect("reads").expect("is there");
    assert_eq!((ended.state, ended.lease, ended.warnings), (JobState::Succeeded, Some(mine), 3), "whose end it was");
    assert_eq!(records.job_results(&job.id).await.expect("reads").len(), 1, "with its results");
    assert_eq!(
        records.job_report(&job.principal, &job.id).await.expect("reads").as_deref(),
        Some("{}"),
        "and its report"
    );
}

async fn callers_take_turns_and_priorities_count_among_a_callers_own(records: &Records) {
    let mut expected = Vec::new();
    for (principal, priority) in [("ann", 0), ("ann", 5), ("ann", 0), ("bob", 0), ("cy", -3)] {
        expected.push(added(records, principal, priority).await.id);
    }
    let mut order = Vec::new();
    while let Some(job) = claim(records).await {
        order.push(expected.iter().position(|id| *id == job.id).expect("one of them"));
    }
    assert_eq!(order, [1, 3, 4, 0, 2], "ann's greatest, bob, cy, then ann's others by age");
}

async fn what_runs_out_goes_back_and_what_was_canceled_ends(records: &Records) {
    let (first, second) = (added(records, "anonymous", 0).await, added(records, "anonymous", 0).await);
    let short = LeaseId::new();
    assert!(matches!(
        records.claim_job(&short, Duration::ZERO, Timestamp::UNIX_EPOCH, Lane::Batch).await,
        Ok(Claim::Job(_))
    ));
    let held = claim(records).await.expect("the second");
    assert!(records.request_cancel(&second.id).await.expect("writes"), "it runs");
    assert!(!records.request_cancel(&second.id).await.expect("answers"), "and was told already");
    let decide = |job: &JobRecord, _: bool| match job.state {
        JobState::Running => AfterCrash::Requeue,
        _ => AfterCrash::End(Box::new(end(JobState::Canceled, Vec::new()))),
    };
    let lost = records.take_from_lost_workers(10, false, decide).await.expect("works");
    assert_eq!(lost.iter().map(|(job, _)| &job.id).collect::<Vec<_>>(), [&first.id], "only whose lease has run out");
    let again = records.job(&first.id).await.expect("reads").expect("is there");
    assert_eq!(
        (again.state, again.attempt, again.crashes, again.lease),
        (JobState::Queued, 1, 0, None),
        "back, and not alone to blame"
    );
    let progress = StoredProgress { phase: "retarget".to_owned(), done: 3, total: 9 };
    let of = |id: &JobId, lease: &LeaseId| Held { id: id.clone(), lease: lease.clone(), progress: progress.clone() };
    let lease = held.lease.expect("a lease");
    let states = records.extend_leases(&[of(&first.id, &short), of(&second.id, &lease)], HOUR).await.expect("extends");
    assert_eq!(states, [None, Some(JobState::Canceling)], "lost, and to be stopped");
    assert_eq!(records.job(&second.id).await.expect("reads").expect("is there").progress, Some(progress), "kept");
    records.take_from_lost_workers(10, true, decide).await.expect("works");
    let ended = records.job(&second.id).await.expect("reads").expect("is there");
    assert_eq!(ended.state, JobState::Canceled, "a canceled job never runs again");
}

async fn a_job_that_was_given_back_waits_its_time(records: &Records) {
    let job = added(records, "anonymous", 0).await;
    let lease = claim(records).await.expect("a job").lease.expect("a lease");
    assert!(records.give_back(&job.id, &lease, GiveBack::RetryAfter(HOUR)).await.expect("writes"), "the holder may");
    assert!(!records.give_back(&job.id, &lease, GiveBack::Drained).await.expect("answers"), "once");
    let look = records.claim_job(&LeaseId::new(), HOUR, Timestamp::UNIX_EPOCH, Lane::Batch).await.expect("looks");
    assert!(matches!(look, Claim::NothingFor(wait) if wait > HOUR / 2), "not yet: {look:?}");
    let waiting = records.job(&job.id).await.expect("reads").expect("is there");
    assert_eq!((waiting.attempt, waiting.retries), (1, 1), "counted");
    let drained = added(records, "anonymous", 0).await;
    let lease = claim(records).await.expect("the other").lease.expect("a lease");
    assert!(records.give_back(&drained.id, &lease, GiveBack::Drained).await.expect("writes"), "at once");
    assert_eq!(claim(records).await.expect("again").attempt, 1, "the attempt was not counted");
}

async fn what_belongs_to_others_is_not_there(records: &Records) {
    let (ann, bob) = (added(records, "ann", 0).await, added(records, "bob", 0).await);
    let (hers, his) = (&ann.request.inputs[&InputRole::Source].asset, &bob.request.inputs[&InputRole::Source].asset);
    assert_ne!(hers, his, "the same bytes are a file of each");
    let (her, him) = (&ann.principal, &bob.principal);
    assert!(records.asset(her, hers).await.expect("reads").is_some(), "her own");
    assert!(records.asset(him, hers).await.expect("reads").is_none(), "not his");
    assert!(records.remove_asset(him, hers).await.expect("answers").is_none(), "nor his to remove");
    let ids = async |owner: &Principal| -> Vec<String> {
        let files =
            records.assets(owner, None, 9).await.expect("lists").items.into_iter().map(|file| file.id.to_string());
        let jobs = records
            .jobs(owner, &JobFilter::default(), None, 9)
            .await
            .expect("lists")
            .items
            .into_iter()
            .map(|job| job.id.to_string());
        files.chain(jobs).collect()
    };
    assert_eq!(ids(her).await, [hers.to_string(), ann.id.to_string()], "she sees what is hers");
    assert_eq!(ids(him).await, [his.to_string(), bob.id.to_string()], "he sees what is his");
    let stolen = JobRecord { id: JobId::new(), principal: him.clone(), ..ann.clone() };
    assert_eq!(records.add_job(&stolen).await.expect("answers"), Added::FileMissing, "nobody works on files of others");

    let taken = claim(records).await.expect("a job");
    let owner = if taken.id == ann.id { her } else { him };
    let result = result(&taken.id, "cc");
    let done = end(JobState::Succeeded, vec![result.clone()]);
    assert!(
        records
            .finish_job(&taken.id, (JobState::Running, taken.lease.as_ref()), &done)
            .await
            .expect("ends")
            .is_written()
    );
    let other = if owner == her { him } else { her };
    assert!(records.result(owner, &result.id).await.expect("reads").is_some(), "the file that it gave");
    assert!(records.result(other, &result.id).await.expect("reads").is_none(), "is the asker's alone");
    assert!(records.job_report(owner, &taken.id).await.expect("reads").is_some(), "what was measured");
    assert!(records.job_report(other, &taken.id).await.expect("reads").is_none(), "is the asker's alone, too");

    let put = async |owner: &Principal, text: &str| {
        let new = NewDocument { owner, kind: DocumentKind::Rig, name: "hero", sha256: text, document: text };
        records.put_document(new, &Precondition::Absent, bounds(1), Timestamp::UNIX_EPOCH).await.expect("writes")
    };
    assert!(matches!(put(her, "1").await, DocumentChange::Created(_)), "hers");
    assert!(matches!(put(him, "2").await, DocumentChange::Created(_)), "his of the same name, and counted by itself");
    let read = async |owner: &Principal| records.documents(owner, DocumentKind::Rig).await.expect("lists");
    assert_eq!(read(her).await.into_iter().map(|rig| rig.document).collect::<Vec<_>>(), ["1"], "only hers");
    let gone =
        records.remove_document(him, DocumentKind::Rig, "hero", &Precondition::Always, Timestamp::UNIX_EPOCH).await;
    assert!(matches!(gone, Ok(DocumentChange::Removed)), "his");
    assert!(records.document(her, DocumentKind::Rig, "hero", None).await.expect("reads").is_some(), "hers stays");
}

async fn one_word_is_one_job_for_each_caller(records: &Records) {
    let file = records.add_asset(&asset("ann", "aa")).await.expect("writes").0;
    let word = |key: &str| Some(Idempotency { key: key.to_owned(), asked_sha256: "cc".to_owned() });
    let askers = (0..64).map(|_| {
        let (records, new) = (records.clone(), JobRecord { idempotency: word("monday"), ..job(&file, 0) });
        async move { (records.add_job(&new).await.expect("answers"), new.id) }
    });
    let answers = futures::future::join_all(askers).await;
    let made: Vec<&JobId> = answers.iter().filter(|(added, _)| *added == Added::New).map(|(_, id)| id).collect();
    assert_eq!(made.len(), 1, "one of many who come at the same time");
    let told =
        |added: &Added| matches!(added, Added::Before(job) if job.id == *made[0] && job.idempotency == word("monday"));
    assert_eq!(answers.iter().filter(|(added, _)| told(added)).count(), 63, "the others are told of it");
    let asked = records.job_asked_with(&file.principal, "monday").await.expect("reads").expect("is there");
    assert_eq!(asked.id, *made[0], "found by the word");
    let other = JobRecord { idempotency: word("tuesday"), ..job(&file, 0) };
    assert_eq!(records.add_job(&other).await.expect("writes"), Added::New, "another word");
    let his = records.add_asset(&asset("bob", "aa")).await.expect("writes").0;
    let his = JobRecord { idempotency: word("monday"), ..job(&his, 0) };
    assert_eq!(records.add_job(&his).await.expect("writes"), Added::New, "words of others are others");
}

async fn quarantine_names_the_files_and_passes(records: &Records) {
    let (_, now) = (added(records, "anonymous", 0).await, Timestamp::UNIX_EPOCH);
    claim(records).await.expect("a job");
    let until = now + HOUR;
    let decide = |_: &JobRecord, _: bool| AfterCrash::Quarantine(Box::new(end(JobState::Failed, Vec::new())), until);
    records.take_from_lost_workers(10, true, decide).await.expect("works");
    assert_eq!(records.quarantined(&["inputs"], now).await.expect("reads").get("inputs"), Some(&until), "for an hour");
    assert_eq!(records.quarantined(&["inputs"], until).await.expect("reads").get("inputs"), None, "not longer");
    assert_eq!(records.quarantined(&["others"], now).await.expect("reads").get("others"), None, "and only these");
}

async fn files_stay_for_unfinished_jobs_and_go_with_the_last_record(records: &Records) {
    let job = added(records, "anonymous", 0).await;
    let file = &job.request.inputs[&InputRole::Source].asset;
    assert!(
        matches!(records.remove_asset(&job.principal, file).await, Err(StoreError::InUse(user)) if user == job.id),
        "in use"
    );
    assert!(records.names_blob("aa").await.expect("reads"), "its bytes are named");
    assert_eq!(records.stored_bytes().await.expect("counts"), 10, "and counted once");
    assert!(
        records
            .finish_job(&job.id, (JobState::Queued, None), &end(JobState::Canceled, Vec::new()))
            .await
            .expect("ends")
            .is_written()
    );
    let kept = records.asset(&job.principal, file).await.expect("reads").expect("is there");
    assert_eq!(kept.file_name, "walk.bvh", "without its NUL");
    assert!(records.remove_asset(&job.principal, file).await.expect("removes").is_some(), "free");
    assert!(!records.names_blob("aa").await.expect("reads"), "nobody names it");
    assert!(records.remove_job(&job.id).await.expect("removes").is_some(), "an ended job can go");
}

async fn lists_are_filtered_and_holdings_counted(records: &Records) {
    let shot = |job: JobRecord, shot: &str| {
        let labels = [("shot".to_owned(), shot.to_owned()), ("take\0".to_owned(), "1".to_owned())].into();
        JobRecord { id: JobId::new(), request: JobRequest { labels, ..job.request.clone() }, ..job }
    };
    let first = added(records, "ann", 0).await;
    let mut second = shot(first.clone(), "012\0");
    second.request.task = JobTask::Edit;
    let third = JobRecord { created_at: Timestamp::UNIX_EPOCH + HOUR, ..shot(first.clone(), "013") };
    for job in [&second, &third] {
        assert_eq!(records.add_job(job).await.expect("writes"), Added::New, "another one");
    }
    assert_eq!(claim(records).await.expect("a job").id, first.id, "the oldest runs");
    let ann = first.principal.clone();
    let listed = async |filter: JobFilter| -> Vec<JobId> {
        let page = records.jobs(&ann, &filter, None, 9).await.expect("lists");
        page.items.into_iter().map(|job| job.id).collect()
    };
    let label =
        |name: &str, text: &str| JobFilter { label: Some((name.to_owned(), text.to_owned())), ..JobFilter::default() };
    assert_eq!(listed(label("shot", "012")).await, std::slice::from_ref(&second.id), "by a label, which has no NUL");
    assert_eq!(listed(label("take", "1")).await, [third.id.clone(), second.id.clone()], "newest first");
    assert!(listed(label("shot", "014")).await.is_empty(), "of that text");
    let edits = JobFilter { kind: Some(JobKind::Edit), ..JobFilter::default() };
    assert_eq!(listed(edits).await, std::slice::from_ref(&second.id), "by kind");
    let since = Some(Timestamp::UNIX_EPOCH + HOUR);
    assert_eq!(listed(JobFilter { since, ..JobFilter::default() }).await, std::slice::from_ref(&third.id), "by time");
    let waiting = JobFilter { state: Some(JobState::Queued), since, ..label("shot", "012") };
    assert!(listed(waiting).await.is_empty(), "all together");

    let holdings = records.holdings(&ann).await.expect("counts");
    assert_eq!(holdings.jobs, [(JobState::Queued, 2), (JobState::Running, 1)].into(), "by state");
    assert_eq!((holdings.assets, holdings.asset_bytes, holdings.results), (1, 10, 0), "files");
    assert_eq!(records.unfinished_jobs(&ann).await.expect("counts"), 3, "none has ended");
    assert_eq!(records.holdings(&principal("bob")).await.expect("counts"), Holdings::default(), "nobody else's");
}

async fn what_was_computed_is_found_by_its_key(records: &Records) {
    let job = added(records, "ann", 0).await;
    let (ann, now) = (job.principal.clone(), Timestamp::UNIX_EPOCH);
    let found = async |owner: &Principal, key: &str, now: Timestamp| {
        records.cached_results(owner, key, now).await.expect("looks up").map(|found| found.job)
    };
    assert_eq!(found(&ann, "key", now).await, None, "nothing is computed yet");
    let lease = claim(records).await.expect("a job").lease.expect("a lease");
    let done =
        FinishedJob { cache_key: Some("key".to_owned()), ..end(JobState::Succeeded, vec![result(&job.id, "cc")]) };
    assert!(
        records.finish_job(&job.id, (JobState::Running, Some(&lease)), &done).await.expect("ends").is_written(),
        "the holder"
    );
    assert_eq!(found(&ann, "key", now).await.as_ref(), Some(&job.id), "the same again");
    assert_eq!(found(&ann, "other", now).await, None, "something else");
    assert_eq!(found(&principal("bob"), "key", now).await, None, "somebody else");
    assert_eq!(found(&ann, "key", now + HOUR).await, None, "what has expired");
    let again = added(records, "ann", 0).await;
    let lease = claim(records).await.expect("a job").lease.expect("a lease");
    let taken = FinishedJob { cached_from: Some(job.id.clone()), results: vec![result(&again.id, "cc")], ..done };
    assert!(
        records.finish_job(&again.id, (JobState::Running, Some(&lease)), &taken).await.expect("ends").is_written(),
        "again"
    );
    let read = records.job(&again.id).await.expect("reads").expect("is there");
    assert_eq!((read.cache_key.as_deref(), read.cached_from), (Some("key"), Some(job.id)), "kept with the job");
    assert_eq!(found(&ann, "key", now).await, Some(again.id), "the newest");
}

async fn every_change_of_state_is_an_event_in_order(records: &Records) {
    let first = added(records, "ann", 0).await;
    let lease = claim(records).await.expect("a job").lease.expect("a lease");
    let second = added(records, "ann", 0).await;
    added(records, "bob", 0).await;
    assert!(records.give_back(&first.id, &lease, GiveBack::Drained).await.expect("writes"), "the holder may");
    let canceled = end(JobState::Canceled, Vec::new());
    assert!(
        records.finish_job(&second.id, (JobState::Queued, None), &canceled).await.expect("ends").is_written(),
        "it waits"
    );
    assert!(
        !records.finish_job(&second.id, (JobState::Queued, None), &canceled).await.expect("answers").is_written(),
        "once"
    );

    let ann = principal("ann");
    let events = records.events_after(&ann, 0, 100).await.expect("reads");
    let seen: Vec<(u64, &JobId, JobState)> =
        events.iter().map(|event| (event.number, &event.job, event.state)).collect();
    let expected = [
        (1, &first.id, JobState::Queued),
        (2, &first.id, JobState::Running),
        (3, &second.id, JobState::Queued),
        (4, &first.id, JobState::Queued),
        (5, &second.id, JobState::Canceled),
    ];
    assert_eq!(seen, expected, "each once, without gaps, and nothing of others");
    assert_eq!(records.events_after(&ann, 3, 1).await.expect("reads"), events[3..4], "behind a number, and as many");
    assert_eq!(records.job_events_after(&second.id, 3, 9).await.expect("reads"), events[4..], "of one job");
    assert_eq!(records.event_reach(&ann).await.expect("reads"), EventReach { last: 5, removed: 0 }, "how far");

    let end = events[4].created_at;
    assert_eq!(records.remove_events_until(end).await.expect("removes"), 6, "all that are that old, of everybody");
    assert_eq!(records.event_reach(&ann).await.expect("reads"), EventReach { last: 5, removed: 5 }, "remembered");
    added(records, "ann", 0).await;
    assert_eq!(records.events_after(&ann, 0, 9).await.expect("reads")[0].number, 6, "numbers are never used again");
}

/// Whoever reads while many write sees no number before the one in front of it.
async fn events_become_visible_in_the_order_of_their_numbers(records: &Records) {
    let writers = (0..6).map(|_| {
        let records = records.clone();
        tokio::spawn(async move {
            for _ in 0..15 {
                added(&records, "ann", 0).await;
            }
        })
    });
    let writers: Vec<_> = writers.collect();
    let (ann, mut seen) = (principal("ann"), 0);
    while seen < 90 {
        for event in records.events_after(&ann, seen, 100).await.expect("reads") {
            assert_eq!(event.number, seen + 1, "no gap that is filled later");
            seen = event.number;
        }
    }
    for writer in writers {
        writer.await.expect("no panic");
    }
}

async fn many_claim_at_the_same_time_and_each_job_has_one(records: &Records) {
    let mut jobs = BTreeSet::new();
    for number in 0..60 {
        jobs.insert(added(records, ["ann", "bob", "cy"][number % 3], 0).await.id);
    }
    let workers = (0..8).map(|_| {
        let records = records.clone();
        tokio::spawn(async move {
            let mut mine = Vec::new();
            loop {
                match records
                    .claim_job(&LeaseId::new(), HOUR, Timestamp::UNIX_EPOCH, Lane::Batch)
                    .await
                    .expect("claims")
                {
                    Claim::Job(job) | Claim::Suspect(job) => mine.push(job.id),
                    Claim::Contended => tokio::time::sleep(Duration::from_millis(1)).await,
                    Claim::Nothing | Claim::NothingFor(_) => return mine,
                }
            }
        })
    });
    let taken: Vec<JobId> =
        futures::future::join_all(workers).await.into_iter().flat_map(|mine| mine.expect("no panic")).collect();
    assert_eq!((taken.len(), taken.into_iter().collect()), (jobs.len(), jobs), "every job, once");
}

suite![
    sqlite_keeps_every_promise,
    postgres_keeps_every_promise:
    a_job_reads_back_as_it_was_written,
    a_job_and_the_files_that_came_with_it_are_written_together,
    only_who_holds_the_lease_writes_the_end,
    callers_take_turns_and_priorities_count_among_a_callers_own,
    what_runs_out_goes_back_and_what_was_canceled_ends,
    a_job_that_was_given_back_waits_its_time,
    quarantine_names_the_files_and_passes,
    files_stay_for_unfinished_jobs_and_go_with_the_last_record,
    documents_have_versions_and_one_writer_at_a_time,
    what_belongs_to_others_is_not_there,
    one_word_is_one_job_for_each_caller,
    keys_are_found_bounded_and_revoked,
    lists_are_filtered_and_holdings_counted,
    what_was_computed_is_found_by_its_key,
    every_change_of_state_is_an_event_in_order,
    events_become_visible_in_the_order_of_their_numbers,
    many_claim_at_the_same_time_and_each_job_has_one,
    a_batch_is_written_with_all_its_jobs_or_not_at_all,
    jobs_of_batches_wait_behind_single_ones_and_callers_take_turns,
    a_failure_stops_what_waits_in_its_transaction,
    an_item_that_is_asked_for_again_counts_once,
    a_batch_is_stopped_whatever_its_jobs_do,
    a_batch_goes_with_the_last_of_its_jobs,
    who_has_long_jobs_waits_for_who_has_short_ones,
    time_that_was_not_asked_for_is_not_saved_up,
];
