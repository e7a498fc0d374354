//! Records have bounds: they are counted whatever writes them, the oldest ended go first, old versions go, and crashes are laid at the right
//! door.

use jiff::Timestamp;
use retargetd::store::{
    AfterCrash, Claim, DocumentChange, DocumentKind, JobRecord, JobState, Lane, LeaseId, NewDocument, Precondition,
    RecordCounts, Records,
};

use super::{
    named_records::bounds,
    records::{HOUR, asset, end, job, principal},
};

suite! { record_bounds_hold_on_sqlite, record_bounds_hold_on_postgres:
    records_are_counted_as_they_come_and_go,
    templates_are_bounded_by_bytes_and_versions,
    one_of_several_jobs_that_were_lost_together_is_tried_alone,
}

async fn claim(records: &Records) -> (JobRecord, LeaseId, bool) {
    let lease = LeaseId::new();
    match records.claim_job(&lease, HOUR, Timestamp::UNIX_EPOCH, Lane::Batch).await.expect("claims") {
        Claim::Job(job) => (*job, lease, false),
        Claim::Suspect(job) => (*job, lease, true),
        other => panic!("there is a job: {other:?}"),
    }
}

async fn records_are_counted_as_they_come_and_go(records: &Records) {
    let ann = principal("ann");
    let file = asset("ann", "aa");
    records.add_assets(std::slice::from_ref(&file)).await.expect("writes");
    assert_eq!(records.record_counts(&ann).await.expect("counts"), RecordCounts::default(), "nothing yet");
    let mut sizes = Vec::new();
    for _ in 0..3 {
        records.add_job(&job(&file, 0)).await.expect("writes");
        sizes.push(records.record_counts(&ann).await.expect("counts").bytes);
    }
    assert!(sizes.windows(2).all(|pair| pair[0] + 1024 < pair[1]), "each takes room: {sizes:?}");
    let (first, lease, _) = claim(records).await;
    let finished = end(JobState::Succeeded, Vec::new());
    records.finish_job(&first.id, (JobState::Running, Some(&lease)), &finished).await.expect("ends");
    let counts = records.record_counts(&ann).await.expect("counts");
    assert!(counts.jobs == 3 && counts.bytes > sizes[2], "a report takes room: {counts:?}");
    assert_eq!(records.all_record_counts().await.expect("counts"), counts, "nobody else has any");
    records.remove_job(&first.id).await.expect("removes").expect("it had ended");
    let counts = records.record_counts(&ann).await.expect("counts");
    assert!(counts.jobs == 2 && counts.bytes == sizes[1], "what goes gives its room back: {counts:?} {sizes:?}");
}

async fn templates_are_bounded_by_bytes_and_versions(records: &Records) {
    let ann = principal("ann");
    let put = async |name: &str, document: &str, most| {
        let new = NewDocument { owner: &ann, kind: DocumentKind::Rig, name, sha256: document, document };
        records.put_document(new, &Precondition::Always, most, Timestamp::UNIX_EPOCH).await.expect("answers")
    };
    let narrow = retargetd::store::DocumentBounds { bytes: 10, versions: 3, ..bounds(5) };
    assert!(matches!(put("one", "123456", narrow).await, DocumentChange::Created(_)), "the first");
    assert!(matches!(put("two", "12345", narrow).await, DocumentChange::TooLarge(11)), "bytes of all together");
    assert!(
        matches!(put("one", "1234567890", narrow).await, DocumentChange::Replaced(_)),
        "the old one does not count"
    );
    assert!(matches!(put("one", "12345678", narrow).await, DocumentChange::Replaced(_)), "a third version");
    assert!(matches!(put("one", "1", narrow).await, DocumentChange::TooManyVersions), "old versions are counted");
    let heads = records.document_heads(&ann, DocumentKind::Rig).await.expect("lists");
    assert_eq!(heads.iter().map(|head| (head.name.as_str(), head.version)).collect::<Vec<_>>(), [("one", 3)], "heads");
}

async fn one_of_several_jobs_that_were_lost_together_is_tried_alone(records: &Records) {
    let file = asset("ann", "aa");
    records.add_assets(std::slice::from_ref(&file)).await.expect("writes");
    for _ in 0..2 {
        records.add_job(&job(&file, 0)).await.expect("writes");
    }
    assert!(!claim(records).await.2 && !claim(records).await.2, "nobody suspects anybody");
    let requeue = |_: &JobRecord, _: bool| AfterCrash::Requeue;
    let lost = records.take_from_lost_workers(10, true, requeue).await.expect("works");
    assert_eq!(
        lost.iter().map(|(_, was_alone)| *was_alone).collect::<Vec<_>>(),
        [false, false],
        "either may have been it"
    );
    let (suspect, lease, is_suspect) = claim(records).await;
    assert!(is_suspect && suspect.crashes == 0, "to be tried by itself, and nothing is laid at its door yet");
    assert!(records.mark_alone(&suspect.id, &lease).await.expect("notes"), "it runs alone");
    let lost = records.take_from_lost_workers(10, true, requeue).await.expect("works");
    assert_eq!(lost.iter().map(|(_, was_alone)| *was_alone).collect::<Vec<_>>(), [true], "it was it");
    assert_eq!(records.job(&suspect.id).await.expect("reads").expect("is there").crashes, 1, "which is counted");
}
