//! Webhooks: telling somebody's server that a job has come to its end.
//!
//! [`Webhooks`] is what owners ask: make one, look, remove, ping, rotate its secret, look at what it was told and tell it again. What is to
//! be told is in the outbox of the store since the transaction of the job's end; the [`WebhookDispatcher`] of every process takes it from there. A
//! webhook says nothing that the job itself does not say, so that whoever asks instead misses nothing.

mod courier;
mod message;
mod schedule;

pub use courier::WebhookDispatcher;

use std::time::Duration;

use super::{Jobs, Refusal};
use crate::{
    outbound::{self, Outbound},
    store::{
        DeliveryId, DeliveryRecord, DeliveryState, JobState, Page, Principal, StoreError, WebhookId, WebhookRecord,
    },
};

/// How long the secret from before a rotation signs along.
const OLD_SECRET_PERIOD: Duration = Duration::from_hours(24);
/// Pings that wait to be sent to one webhook, and those sent that are remembered.
const MAX_PINGS: u64 = 100;

/// A webhook that is to be made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewWebhook {
    /// Where it is.
    pub url: String,
    /// The ends that it hears of, of every job. May be none: it then hears of jobs that name it.
    pub events: Vec<JobState>,
    /// The owner's own words about it.
    pub description: String,
}

/// The webhooks. Cheap to clone; all clones are the same.
#[derive(Clone, Debug)]
pub struct Webhooks {
    jobs: Jobs,
    outbound: Outbound,
}

impl Webhooks {
    /// Those that are told of `jobs`.
    #[must_use]
    pub fn new(jobs: &Jobs, outbound: Outbound) -> Self {
        Self { jobs: jobs.clone(), outbound }
    }

    /// Makes a webhook. Its secret is told to its owner with this, and never again.
    ///
    /// # Errors
    /// When the URL leads where the service does not go, or the owner has as many as may be.
    pub async fn create(&self, owner: &Principal, new: NewWebhook) -> Result<WebhookRecord, Refusal> {
        self.outbound.check(&new.url).map_err(Refusal::ForbiddenUrl)?;
        let mut events = new.events;
        events.sort_unstable();
        events.dedup();
        let webhook = WebhookRecord {
            id: WebhookId::new(),
            principal: owner.clone(),
            url: new.url,
            events,
            description: new.description,
            secret: outbound::new_secret().map_err(StoreError::from)?,
            old_secret: None,
            created_at: self.jobs.0.clock.now(),
            failing_since: None,
            disabled: None,
        };
        let most = self.jobs.0.settings.max_webhooks;
        match self.jobs.0.store.records().add_webhook(&webhook, most).await? {
            true => Ok(webhook),
            false => Err(Refusal::TooManyWebhooks { most }),
        }
    }

    /// All webhooks of one owner, the oldest first.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn list(&self, owner: &Principal) -> Result<Vec<WebhookRecord>, Refusal> {
        Ok(self.jobs.0.store.records().webhooks(owner).await?)
    }

    /// A webhook.
    ///
    /// # Errors
    /// When its owner has none of that id.
    pub async fn get(&self, owner: &Principal, id: &WebhookId) -> Result<WebhookRecord, Refusal> {
        let webhook = self.jobs.0.store.records().webhook(id).await?;
        webhook.filter(|webhook| webhook.principal == *owner).ok_or_else(|| no_webhook(id))
    }

    /// Removes a webhook, and what it has not heard yet with it.
    ///
    /// # Errors
    /// When its owner has none of that id.
    pub async fn delete(&self, owner: &Principal, id: &WebhookId) -> Result<(), Refusal> {
        match self.jobs.0.store.records().remove_webhook(owner, id).await? {
            true => Ok(()),
            false => Err(no_webhook(id)),
        }
    }

    /// Gives a webhook another secret, which is told with this and never again. The one before signs along for a day.
    ///
    /// # Errors
    /// When its owner has none of that id.
    pub async fn rotate_secret(&self, owner: &Principal, id: &WebhookId) -> Result<WebhookRecord, Refusal> {
        let secret = outbound::new_secret().map_err(StoreError::from)?;
        let until = self.jobs.0.clock.after(OLD_SECRET_PERIOD);
        let records = self.jobs.0.store.records();
        records.rotate_webhook_secret(owner, id, &secret, until).await?.ok_or_else(|| no_webhook(id))
    }

    /// Sends a webhook a word, once, to see whether it is there. One that was disabled and answers is enabled again.
    ///
    /// # Errors
    /// When its owner has none of that id.
    pub async fn ping(&self, owner: &Principal, id: &WebhookId) -> Result<DeliveryRecord, Refusal> {
        let webhook = self.get(owner, id).await?;
        let ping = self.jobs.0.store.records().add_ping(owner, &webhook.id, MAX_PINGS).await?;
        let ping = ping.ok_or(Refusal::TooManyRecords { limit: "pings", most: MAX_PINGS, actual: MAX_PINGS + 1 })?;
        self.jobs.0.outbox.notify_one();
        Ok(ping)
    }

    /// Up to `most` deliveries to a webhook, in that state where one is given, newest first, that are older than `before`.
    ///
    /// # Errors
    /// When its owner has no such webhook.
    pub async fn deliveries(
        &self,
        owner: &Principal,
        id: &WebhookId,
        state: Option<DeliveryState>,
        before: Option<&DeliveryId>,
        most: usize,
    ) -> Result<Page<DeliveryRecord>, Refusal> {
        let webhook = self.get(owner, id).await?;
        Ok(self.jobs.0.store.records().deliveries(owner, &webhook.id, state, before, most).await?)
    }

    /// A delivery.
    ///
    /// # Errors
    /// When there is none of that id to a webhook of that owner.
    pub async fn delivery(&self, owner: &Principal, id: &DeliveryId) -> Result<DeliveryRecord, Refusal> {
        self.jobs.0.store.records().delivery(owner, id).await?.ok_or_else(|| no_delivery(id))
    }

    /// Tells a webhook once more what it was told, or has not heard yet, at once and under the same id.
    ///
    /// # Errors
    /// When there is no such delivery to a webhook of that owner, or the webhook is disabled.
    pub async fn redeliver(&self, owner: &Principal, id: &DeliveryId) -> Result<DeliveryRecord, Refusal> {
        let delivery = self.delivery(owner, id).await?;
        let webhook = self.get(owner, &delivery.webhook).await?;
        if webhook.disabled.is_some() {
            return Err(Refusal::WebhookDisabled { id: webhook.id });
        }
        let delivery = self.jobs.0.store.records().redeliver(owner, id).await?.ok_or_else(|| no_delivery(id))?;
        self.jobs.0.outbox.notify_one();
        Ok(delivery)
    }
}

fn no_webhook(id: &WebhookId) -> Refusal {
    Refusal::NotFound { kind: "webhook", id: id.to_string() }
}

fn no_delivery(id: &DeliveryId) -> Refusal {
    Refusal::NotFound { kind: "delivery", id: id.to_string() }
}
