//! The task that empties the outbox: takes what is due, sends it, and writes down how that went.
//!
//! Beside the jobs, never in their way. Any number of processes share one outbox; what a process had when it died is due again soon. A
//! receiver that is slow takes up its own share of what a process sends at the same time, and not that of others; and a principal whose
//! receivers are all slow never has more of it than is left for everybody else.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use tokio::{sync::Semaphore, task::JoinHandle, time::sleep};
use tokio_util::{sync::CancellationToken, task::TaskTracker};

use super::{message, schedule};
use crate::{
    jobs::{Jobs, Refusal},
    outbound::{Answer, Outbound, SendError, signatures},
    store::{
        AfterAttempt, AttemptEnd, DeliveryClaim, DeliveryEvent, DeliveryRecord, JobState, Principal, StoreError,
        WebhookId, WebhookRecord,
    },
    telemetry::Metric,
};

/// Deliveries that one process makes at the same time.
const MAX_AT_ONCE: usize = 32;
/// And those of them to one webhook.
const MAX_TO_ONE: usize = 4;
/// How often to look into an outbox that was empty. Jobs that end here come with a word.
const LOOK_AGAIN: Duration = Duration::from_secs(2);
/// How long to leave a store alone that has failed, and an outbox that others are emptying.
const AFTER_FAILURE: Duration = Duration::from_millis(500);
const LEAVE_TO_OTHERS: Duration = Duration::from_millis(5);
/// How much longer than an answer may take a delivery is left to who has it.
const TIME_TO_WRITE_DOWN: Duration = Duration::from_secs(10);
/// How long deliveries may go on when the process goes down. What is not made by then is made by another.
const GRACE: Duration = Duration::from_secs(1);

/// Tells webhooks what happened, from the outbox of the store.
#[derive(Debug)]
pub struct WebhookDispatcher {
    running: TaskTracker,
    stop: CancellationToken,
    task: JoinHandle<()>,
}

impl WebhookDispatcher {
    /// Starts it.
    #[must_use]
    pub fn start(jobs: &Jobs, outbound: Outbound) -> Self {
        let (running, stop) = (TaskTracker::new(), CancellationToken::new());
        let round = Round { jobs: jobs.clone(), outbound, in_hand: Arc::default() };
        let task = tokio::spawn(round.run(running.clone(), stop.clone()));
        Self { running, stop, task }
    }

    /// Takes nothing new, and gives what is on its way a moment.
    pub async fn stop(self) {
        self.stop.cancel();
        if let Err(error) = self.task.await {
            tracing::error!(%error, "the task that tells webhooks ended with a fault");
        }
        self.running.close();
        // What is cut off is due again when its time is over.
        let _ = tokio::time::timeout(GRACE, self.running.wait()).await;
    }
}

/// How many deliveries to each webhook this process is making, and whose it is.
type InHand = Arc<Mutex<BTreeMap<WebhookId, (Principal, usize)>>>;

#[derive(Clone)]
struct Round {
    jobs: Jobs,
    outbound: Outbound,
    in_hand: InHand,
}

/// What there is to do.
enum Claimed {
    Delivery(Box<DeliveryRecord>, Box<WebhookRecord>),
    /// Nothing before so long, unless news come.
    NothingFor(Duration),
}

impl Round {
    async fn run(self, running: TaskTracker, stop: CancellationToken) {
        let slots = Arc::new(Semaphore::new(MAX_AT_ONCE));
        while let Some(Ok(slot)) = stop.run_until_cancelled(Arc::clone(&slots).acquire_owned()).await {
            let Some((delivery, webhook)) = stop.run_until_cancelled(self.next()).await else { return };
            let (round, hold) = (self.clone(), Hold::new(&self.in_hand, &webhook));
            running.spawn(async move {
                round.deliver(&delivery, &webhook).await;
                drop((hold, slot));
                // There may be more for the same webhook.
                round.jobs.0.outbox.notify_one();
            });
        }
    }

    /// The next delivery that is due, and its webhook; waits for it.
    async fn next(&self) -> (DeliveryRecord, WebhookRecord) {
        loop {
            // A word from here on is remembered, so none is missed between looking and waiting.
            let news = self.jobs.0.outbox.notified();
            let wait = match self.claim().await {
                Ok(Claimed::Delivery(delivery, webhook)) => return (*delivery, *webhook),
                Ok(Claimed::NothingFor(wait)) => wait,
                Err(error) => {
                    tracing::error!(%error, "the outbox of webhooks cannot be read");
                    sleep(AFTER_FAILURE).await;
                    continue;
                }
            };
            let _ = tokio::time::timeout(wait, news).await;
        }
    }

    async fn claim(&self) -> Result<Claimed, StoreError> {
        let (records, settings) = (self.jobs.0.store.records(), &self.jobs.0.settings);
        let busy = self.busy().await?;
        let delivery = match records.claim_delivery(&busy, settings.webhook_timeout.0 + TIME_TO_WRITE_DOWN).await? {
            DeliveryClaim::Delivery(delivery) => delivery,
            DeliveryClaim::NothingFor(wait) => return Ok(Claimed::NothingFor(wait.clamp(LEAVE_TO_OTHERS, LOOK_AGAIN))),
            DeliveryClaim::Nothing => return Ok(Claimed::NothingFor(LOOK_AGAIN)),
        };
        Ok(match records.webhook(&delivery.webhook).await? {
            Some(webhook) => Claimed::Delivery(delivery, Box::new(webhook)),
            // It was removed in the meantime, with its deliveries.
            None => Claimed::NothingFor(LEAVE_TO_OTHERS),
        })
    }

    /// The webhooks that have as many deliveries on their way as may be, or whose owners have.
    async fn busy(&self) -> Result<Vec<WebhookId>, StoreError> {
        let (mut busy, owners) = (busy(&self.in_hand), full_owners(&self.in_hand));
        for owner in owners {
            let webhooks = self.jobs.0.store.records().webhooks(&owner).await?;
            busy.extend(webhooks.into_iter().map(|webhook| webhook.id));
        }
        Ok(busy)
    }

    async fn deliver(&self, delivery: &DeliveryRecord, webhook: &WebhookRecord) {
        match self.attempt(delivery, webhook).await {
            Ok(Some((result, end))) => {
                Metric::WebhookDeliveries.count([("result", result.to_owned())], 1);
                let (id, webhook, status) = (&delivery.id, &delivery.webhook, end.status);
                tracing::info!(delivery_id = %id, webhook_id = %webhook, status, error = end.error, result, "a webhook was told");
            }
            // It was removed in the meantime, or somebody else has the delivery by now.
            Ok(None) => {}
            Err(error) => tracing::error!(delivery_id = %delivery.id, %error, "a delivery could not be made"),
        }
    }

    /// One attempt, and how it went, in one word for metrics and in whole.
    async fn attempt(
        &self,
        delivery: &DeliveryRecord,
        webhook: &WebhookRecord,
    ) -> Result<Option<(&'static str, AttemptEnd)>, Refusal> {
        let (inner, records) = (&self.jobs.0, self.jobs.0.store.records());
        let body = self.body(delivery).await?;
        let headers = self.headers(delivery, webhook, &body)?;
        let answer = self.outbound.post_json(&webhook.url, &headers, body, inner.settings.webhook_timeout.0).await;
        let end = self.end(delivery, answer);
        let result = match end.then {
            AfterAttempt::Deliver => "delivered",
            AfterAttempt::RetryAfter(_) => "retried",
            AfterAttempt::GiveUp { .. } => "given_up",
            AfterAttempt::Disable => "gone",
        };
        Ok(records.end_attempt(delivery, &end).await?.then_some((result, end)))
    }

    async fn body(&self, delivery: &DeliveryRecord) -> Result<String, Refusal> {
        let records = self.jobs.0.store.records();
        let DeliveryEvent::JobEnded(id, _) = &delivery.event else { return Ok(message::body(delivery, None)) };
        let Some(job) = records.job(id).await? else { return Ok(message::body(delivery, None)) };
        let results = match job.state {
            JobState::Succeeded => records.job_results(id).await?,
            _ => Vec::new(),
        };
        Ok(message::body(delivery, Some((&job, &results))))
    }

    /// The headers of the Standard Webhooks scheme, made anew for each attempt.
    fn headers(
        &self,
        delivery: &DeliveryRecord,
        webhook: &WebhookRecord,
        body: &str,
    ) -> Result<[(&'static str, String); 3], Refusal> {
        let now = self.jobs.0.clock.now();
        let old = webhook.old_secret.as_ref().filter(|(_, until)| *until > now).map(|(secret, _)| secret);
        let secrets = [Some(&webhook.secret), old].into_iter().flatten();
        let signature = signatures(secrets, delivery.id.as_str(), now.as_second(), body)
            .map_err(|error| StoreError::Unreadable { record: webhook.id.to_string(), reason: error.to_string() })?;
        Ok([
            ("webhook-id", delivery.id.to_string()),
            ("webhook-timestamp", now.as_second().to_string()),
            ("webhook-signature", signature),
        ])
    }

    fn end(&self, delivery: &DeliveryRecord, answer: Result<Answer, SendError>) -> AttemptEnd {
        let settings = &self.jobs.0.settings;
        let (status, error, asked) = match answer {
            Ok(Answer { status, retry_after }) => (Some(status), None, retry_after),
            Err(error) => (None, Some(error.name()), None),
        };
        let delays = match delivery.event {
            // Who pings wants to know now.
            DeliveryEvent::Ping => &[][..],
            DeliveryEvent::JobEnded(..) => &settings.webhook_retries.0,
        };
        let then = match status {
            Some(200..=299) => AfterAttempt::Deliver,
            Some(410) => AfterAttempt::Disable,
            _ => match schedule::delay(delays, delivery.retries, asked, chance()) {
                Some(delay) => AfterAttempt::RetryAfter(delay),
                None => AfterAttempt::GiveUp { failing_period: settings.webhook_failing_period.0 },
            },
        };
        AttemptEnd { status, error, then }
    }
}

/// From 0 to 1.
fn chance() -> f64 {
    getrandom::u32().map_or(0.5, |number| f64::from(number) / f64::from(u32::MAX))
}

fn lock(in_hand: &InHand) -> MutexGuard<'_, BTreeMap<WebhookId, (Principal, usize)>> {
    in_hand.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The webhooks that have as many deliveries on their way as may be.
fn busy(in_hand: &InHand) -> Vec<WebhookId> {
    lock(in_hand).iter().filter(|(_, (_, count))| *count >= MAX_TO_ONE).map(|(id, _)| id.clone()).collect()
}

/// The principals that have as many deliveries on their way as there is room for others': so there always is some.
fn full_owners(in_hand: &InHand) -> Vec<Principal> {
    let mut of_owners: BTreeMap<Principal, usize> = BTreeMap::new();
    for (owner, count) in lock(in_hand).values() {
        *of_owners.entry(owner.clone()).or_default() += count;
    }
    let room = MAX_AT_ONCE.saturating_sub(of_owners.values().sum());
    of_owners.into_iter().filter(|(_, count)| *count >= room).map(|(owner, _)| owner).collect()
}

/// One delivery on its way to a webhook, until it is dropped.
struct Hold(InHand, WebhookId);

impl Hold {
    fn new(in_hand: &InHand, webhook: &WebhookRecord) -> Self {
        lock(in_hand).entry(webhook.id.clone()).or_insert_with(|| (webhook.principal.clone(), 0)).1 += 1;
        Self(Arc::clone(in_hand), webhook.id.clone())
    }
}

impl Drop for Hold {
    fn drop(&mut self) {
        let mut counts = lock(&self.0);
        match counts.get_mut(&self.1) {
            Some((_, count)) if *count > 1 => *count -= 1,
            _ => drop(counts.remove(&self.1)),
        }
    }
}
