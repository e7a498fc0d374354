//! What both databases promise of the outbox of webhooks.

use std::{collections::BTreeSet, time::Duration};

use jiff::Timestamp;
use retargetd::{
    config::Secret,
    store::{
        AfterAttempt, AttemptEnd, DeliveryClaim, DeliveryEvent, DeliveryId, DeliveryRecord, DeliveryState,
        DisabledReason, JobId, JobState, Records, WebhookId, WebhookRecord,
    },
};

use super::records::{HOUR, added, end, principal};

async fn webhook(records: &Records, owner: &str, events: &[JobState]) -> WebhookRecord {
    let webhook = WebhookRecord {
        id: WebhookId::new(),
        principal: principal(owner),
        url: "https://studio.example/".to_owned(),
        events: events.to_vec(),
        description: "ours".to_owned(),
        secret: Secret("whsec_AAAA".to_owned()),
        old_secret: None,
        created_at: Timestamp::UNIX_EPOCH,
        failing_since: None,
        disabled: None,
    };
    assert!(records.add_webhook(&webhook, 16).await.expect("writes"), "there is room");
    webhook
}

/// A job that ends at once.
async fn ended(records: &Records, owner: &str, state: JobState) -> JobId {
    let job = added(records, owner, 0).await;
    let done = records.finish_job(&job.id, (JobState::Queued, None), &end(state, Vec::new())).await;
    assert!(done.expect("writes").is_written(), "it waited");
    job.id
}

async fn claim(records: &Records, busy: &[WebhookId], period: Duration) -> Option<DeliveryRecord> {
    match records.claim_delivery(busy, period).await.expect("claims") {
        DeliveryClaim::Delivery(delivery) => Some(*delivery),
        _ => None,
    }
}

async fn all(records: &Records, webhook: &WebhookRecord) -> Vec<DeliveryRecord> {
    records.deliveries(&webhook.principal, &webhook.id, None, None, 100).await.expect("reads").items
}

fn went(status: u16, then: AfterAttempt) -> AttemptEnd {
    AttemptEnd { status: Some(status), error: None, then }
}

async fn an_end_is_in_the_outbox_of_everybody_who_listens(records: &Records) {
    let all_ends = webhook(records, "ann", &[JobState::Succeeded, JobState::Failed, JobState::Canceled]).await;
    let failures = webhook(records, "ann", &[JobState::Failed]).await;
    let nothing = webhook(records, "ann", &[]).await;
    let his = webhook(records, "bob", &[JobState::Failed]).await;
    assert_eq!(records.webhook(&all_ends.id).await.expect("reads"), Some(all_ends.clone()), "reads back");
    let failed = ended(records, "ann", JobState::Failed).await;
    let canceled = ended(records, "ann", JobState::Canceled).await;
    let job = added(records, "ann", 0).await;
    let refused = records.finish_job(&job.id, (JobState::Running, None), &end(JobState::Failed, Vec::new())).await;
    assert!(!refused.expect("looks").is_written(), "it does not run");

    let events: Vec<_> = all(records, &all_ends).await.into_iter().map(|delivery| delivery.event).collect();
    let (failed, canceled) =
        (DeliveryEvent::JobEnded(failed, JobState::Failed), DeliveryEvent::JobEnded(canceled, JobState::Canceled));
    assert!(
        events.len() == 2 && events.contains(&failed) && events.contains(&canceled),
        "both ends, no more: {events:?}"
    );
    assert_eq!(all(records, &failures).await[0].event, failed, "what it listens to");
    for other in [&nothing, &his] {
        assert_eq!(all(records, other).await, [], "not theirs");
    }
    assert_eq!(records.deliveries(&his.principal, &all_ends.id, None, None, 9).await.expect("reads").items, [], "hers");

    let mut named =
        super::records::job(&records.add_asset(&super::records::asset("ann", "bb")).await.expect("writes").0, 0);
    named.request.webhook = Some(nothing.id.clone());
    records.add_job(&named).await.expect("writes");
    records
        .finish_job(&named.id, (JobState::Queued, None), &end(JobState::Canceled, Vec::new()))
        .await
        .expect("writes");
    assert_eq!(all(records, &nothing).await.len(), 1, "a job names it");

    assert!(!records.remove_webhook(&his.principal, &all_ends.id).await.expect("looks"), "not his");
    assert!(records.remove_webhook(&all_ends.principal, &all_ends.id).await.expect("writes"), "removed");
    assert_eq!(all(records, &all_ends).await, [], "with what it had not heard");
    assert!(!records.add_webhook(&webhook(records, "ann", &[]).await, 3).await.expect("looks"), "bounded");
}

async fn a_delivery_is_one_attempts_until_its_time_is_over(records: &Records) {
    let hook = webhook(records, "ann", &[JobState::Canceled]).await;
    let job = ended(records, "ann", JobState::Canceled).await;
    assert_eq!(claim(records, std::slice::from_ref(&hook.id), HOUR).await, None, "it is busy");
    // The process dies at once.
    let first = claim(records, &[], Duration::ZERO).await.expect("is due");
    assert_eq!(
        (&first.event, first.attempts),
        (&DeliveryEvent::JobEnded(job, JobState::Canceled), 1),
        "the first attempt"
    );
    let second = claim(records, &[], HOUR).await.expect("is due again");
    assert_eq!((&second.id, second.attempts), (&first.id, 2), "the same, again");
    assert_eq!(claim(records, &[], HOUR).await, None, "it is in hand");
    assert!(!records.end_attempt(&first, &went(200, AfterAttempt::Deliver)).await.expect("looks"), "another has it");

    let retry = went(500, AfterAttempt::RetryAfter(HOUR));
    assert!(records.end_attempt(&second, &retry).await.expect("writes"), "it failed");
    let wait = records.claim_delivery(&[], HOUR).await.expect("looks");
    assert!(matches!(wait, DeliveryClaim::NothingFor(wait) if wait > HOUR / 2), "not yet: {wait:?}");
    let failing = records.webhook(&hook.id).await.expect("reads").expect("is there");
    assert!(failing.failing_since.is_some() && failing.disabled.is_none(), "it fails: {failing:?}");
    let again = records.redeliver(&hook.principal, &first.id).await.expect("writes").expect("is there");
    assert_eq!((again.state, again.retries, again.status), (DeliveryState::Pending, 0, Some(500)), "at once");
    assert_eq!(records.redeliver(&principal("bob"), &first.id).await.expect("looks"), None, "not his");
    let third = claim(records, &[], HOUR).await.expect("is due");
    assert!(records.end_attempt(&third, &went(204, AfterAttempt::Deliver)).await.expect("writes"), "it is there");
    assert_eq!(records.claim_delivery(&[], HOUR).await.expect("looks"), DeliveryClaim::Nothing, "no more");
    assert_eq!(records.webhook(&hook.id).await.expect("reads").expect("is there").failing_since, None, "it works");
    let made = records.delivery(&hook.principal, &first.id).await.expect("reads").expect("is there");
    assert_eq!((made.state, made.status, made.attempts), (DeliveryState::Delivered, Some(204), 3), "as it went");
    assert_eq!(records.remove_deliveries_until(Timestamp::UNIX_EPOCH).await.expect("writes"), 0, "too early");
    assert_eq!(records.remove_deliveries_until(made.finished_at.expect("an end")).await.expect("writes"), 1, "gone");
}

async fn who_is_disabled_hears_nothing_but_pings(records: &Records) {
    let hook = webhook(records, "ann", &[JobState::Canceled]).await;
    for _ in 0..2 {
        ended(records, "ann", JobState::Canceled).await;
    }
    let taken = claim(records, &[], HOUR).await.expect("is due");
    records.end_attempt(&taken, &went(410, AfterAttempt::Disable)).await.expect("writes");
    let gone = records.webhook(&hook.id).await.expect("reads").expect("is there");
    assert!(matches!(gone.disabled, Some((_, DisabledReason::Gone))), "{gone:?}");
    ended(records, "ann", JobState::Canceled).await;
    let states: Vec<_> = all(records, &hook).await.into_iter().map(|delivery| delivery.state).collect();
    assert_eq!(states, [DeliveryState::Failed; 2], "what it had not heard has failed, and nothing new came");
    assert!(records.add_ping(&principal("bob"), &hook.id, 1).await.expect("looks").is_none(), "not his");
    let ping = records.add_ping(&hook.principal, &hook.id, 1).await.expect("writes").expect("is there");
    assert!(records.add_ping(&hook.principal, &hook.id, 1).await.expect("looks").is_none(), "one waits already");
    assert!(DeliveryId::parse(ping.id.as_str()).is_ok(), "an id as others");
    let taken = claim(records, &[], HOUR).await.expect("is due");
    assert_eq!((&taken.id, &taken.event), (&ping.id, &DeliveryEvent::Ping), "the ping");
    records.end_attempt(&taken, &went(204, AfterAttempt::Deliver)).await.expect("writes");
    let back = records.webhook(&hook.id).await.expect("reads").expect("is there");
    assert_eq!((back.disabled, back.failing_since), (None, None), "it is there again");

    ended(records, "ann", JobState::Canceled).await;
    let taken = claim(records, &[], HOUR).await.expect("is due");
    let give_up = |failing_period| went(500, AfterAttempt::GiveUp { failing_period });
    records.end_attempt(&taken, &give_up(HOUR)).await.expect("writes");
    assert!(records.webhook(&hook.id).await.expect("reads").expect("is there").disabled.is_none(), "not for long yet");
    records.redeliver(&hook.principal, &taken.id).await.expect("writes");
    let taken = claim(records, &[], HOUR).await.expect("is due");
    records.end_attempt(&taken, &give_up(Duration::ZERO)).await.expect("writes");
    let failing = records.webhook(&hook.id).await.expect("reads").expect("is there");
    assert!(matches!(failing.disabled, Some((_, DisabledReason::Failing))), "{failing:?}");
}

async fn many_take_from_the_outbox_and_each_delivery_has_one(records: &Records) {
    webhook(records, "ann", &[JobState::Canceled]).await;
    for _ in 0..40 {
        ended(records, "ann", JobState::Canceled).await;
    }
    let couriers = (0..8).map(|_| {
        let records = records.clone();
        tokio::spawn(async move {
            let mut mine = Vec::new();
            loop {
                match records.claim_delivery(&[], HOUR).await.expect("claims") {
                    DeliveryClaim::Delivery(delivery) => mine.push(delivery.id),
                    DeliveryClaim::NothingFor(wait) if wait.is_zero() => {}
                    DeliveryClaim::NothingFor(_) | DeliveryClaim::Nothing => return mine,
                }
            }
        })
    });
    let taken = futures::future::join_all(couriers).await.into_iter().flat_map(|mine| mine.expect("no panic"));
    let taken: Vec<DeliveryId> = taken.collect();
    let different: BTreeSet<&DeliveryId> = taken.iter().collect();
    assert_eq!((taken.len(), different.len()), (40, 40), "every delivery, once");
}

suite![
    sqlite_keeps_the_outbox,
    postgres_keeps_the_outbox:
    an_end_is_in_the_outbox_of_everybody_who_listens,
    a_delivery_is_one_attempts_until_its_time_is_over,
    who_is_disabled_hears_nothing_but_pings,
    many_take_from_the_outbox_and_each_delivery_has_one,
];
