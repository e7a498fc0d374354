//! What webhooks and deliveries look like on the wire.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::{
    http::{code::Code, problem::Problem},
    jobs::{DeliveryEvent, DeliveryId, DeliveryRecord, DeliveryState, JobState, NewWebhook, WebhookId, WebhookRecord},
};

/// The events that a webhook can listen to.
const EVENTS: [(&str, JobState); 3] =
    [("job.succeeded", JobState::Succeeded), ("job.failed", JobState::Failed), ("job.canceled", JobState::Canceled)];

/// A webhook that is to be made.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewWebhook)]
pub(super) struct NewWebhookBody {
    /// Where it is: `https`, without user and password, and at an address that is public or in a network that the operator names.
    #[schema(example = "https://studio.example/hooks/retargetd")]
    url: String,
    /// What it is told of all your jobs: `job.succeeded`, `job.failed`, `job.canceled`. Left out, all three. With none, it is told of jobs
    /// that name it in `webhook`, and only of these.
    #[schema(example = json!(["job.succeeded", "job.failed"]))]
    events: Option<Vec<String>>,
    /// Words of your own, of 256 bytes at most.
    #[serde(default)]
    description: String,
}

const MAX_DESCRIPTION_BYTES: usize = 256;

/// A webhook, without its secret.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Webhook)]
pub(super) struct WebhookView {
    /// What it is called; jobs name it in `webhook`.
    #[schema(value_type = String, example = "whk_01j9z3k8m0q4r6t8v0x2y4a6c8")]
    id: WebhookId,
    /// Where it is.
    url: String,
    /// What it is told of all jobs.
    events: Vec<&'static str>,
    /// The owner's own words.
    description: String,
    /// `enabled`, or `disabled` where it is told nothing.
    #[schema(example = "enabled")]
    state: &'static str,
    /// Why it is told nothing: `gone` where its receiver answered 410, `failing` where it has failed for longer than the limit
    /// `webhook_failing_period`. A ping that is answered enables it again.
    #[serde(skip_serializing_if = "Option::is_none")]
    disabled_reason: Option<&'static str>,
    /// Since when it is told nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    disabled_at: Option<String>,
    /// Since when no delivery has succeeded; absent while they do.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    failing_since: Option<String>,
    /// When it was made.
    #[schema(format = DateTime)]
    created_at: String,
    /// Where to see what it was told.
    deliveries: String,
}

/// A webhook whose secret is new.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = WebhookWithSecret)]
pub(super) struct WebhookWithSecretView {
    #[serde(flatten)]
    webhook: WebhookView,
    /// What signs every message, for the libraries of Standard Webhooks. It is told now and never again.
    #[schema(example = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSwMfKQ9r8GKYo=")]
    secret: String,
    /// Until when the secret from before signs along, where there was one.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    old_secret_until: Option<String>,
}

/// All webhooks of the caller. There are as many as the limit `webhooks` allows, so there is one page.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = WebhookList)]
pub(super) struct WebhookListView {
    /// The oldest first.
    pub(super) items: Vec<WebhookView>,
}

/// Something that a webhook is told.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Delivery)]
pub(super) struct DeliveryView {
    /// What it is called: the `webhook-id` of the message, the same however often it is sent.
    #[schema(value_type = String, example = "dlv_0199f3a2c4d50123456789abcd")]
    id: DeliveryId,
    /// Who is told.
    #[schema(value_type = String)]
    webhook: WebhookId,
    /// `job.succeeded`, `job.failed`, `job.canceled` or `ping`.
    #[serde(rename = "type")]
    #[schema(example = "job.succeeded")]
    kind: String,
    /// The job that it is of.
    #[serde(skip_serializing_if = "Option::is_none")]
    job: Option<String>,
    /// `pending`, `delivered` or `failed`.
    #[schema(example = "delivered")]
    state: &'static str,
    /// How often it was sent.
    attempts: u64,
    /// When it happened.
    #[schema(format = DateTime)]
    created_at: String,
    /// When it was last sent.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    last_attempt_at: Option<String>,
    /// The HTTP status of the last answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    last_status: Option<u16>,
    /// Why there was none: `timeout`, `unreachable`, `forbidden_address`, or `disabled`.
    #[serde(skip_serializing_if = "Option::is_none")]
    last_error: Option<String>,
    /// When it is sent next, while it is pending.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    next_attempt_at: Option<String>,
    /// When it was delivered or given up.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    finished_at: Option<String>,
}

/// A page of deliveries, newest first.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = DeliveryPage)]
pub(super) struct DeliveryPageView {
    /// The deliveries.
    pub(super) items: Vec<DeliveryView>,
    /// To be given as `cursor` for the next page; absent on the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) next_cursor: Option<String>,
}

impl From<WebhookRecord> for WebhookView {
    fn from(webhook: WebhookRecord) -> Self {
        let (disabled_at, reason) = webhook.disabled.unzip();
        let listens = |(_, state): &&(&'static str, JobState)| webhook.events.contains(state);
        Self {
            deliveries: format!("/v1/webhooks/{}/deliveries", webhook.id),
            id: webhook.id,
            url: webhook.url,
            events: EVENTS.iter().filter(listens).map(|(name, _)| *name).collect(),
            description: webhook.description,
            state: if reason.is_some() { "disabled" } else { "enabled" },
            disabled_reason: reason.map(|reason| reason.name()),
            disabled_at: disabled_at.map(|time| time.to_string()),
            failing_since: webhook.failing_since.map(|time| time.to_string()),
            created_at: webhook.created_at.to_string(),
        }
    }
}

impl From<WebhookRecord> for WebhookWithSecretView {
    fn from(webhook: WebhookRecord) -> Self {
        let (secret, old) = (webhook.secret.0.clone(), webhook.old_secret.clone());
        Self { webhook: webhook.into(), secret, old_secret_until: old.map(|(_, until)| until.to_string()) }
    }
}

impl From<DeliveryRecord> for DeliveryView {
    fn from(delivery: DeliveryRecord) -> Self {
        let is_pending = delivery.state == DeliveryState::Pending;
        Self {
            id: delivery.id,
            webhook: delivery.webhook,
            kind: delivery.event.name(),
            job: match delivery.event {
                DeliveryEvent::JobEnded(job, _) => Some(job.to_string()),
                DeliveryEvent::Ping => None,
            },
            state: delivery.state.name(),
            attempts: delivery.attempts,
            created_at: delivery.created_at.to_string(),
            last_attempt_at: delivery.attempted_at.map(|time| time.to_string()),
            last_status: delivery.status,
            last_error: delivery.error,
            next_attempt_at: is_pending.then(|| delivery.due_at.to_string()),
            finished_at: delivery.finished_at.map(|time| time.to_string()),
        }
    }
}

impl NewWebhookBody {
    pub(super) fn read(self) -> Result<NewWebhook, Problem> {
        let invalid =
            |detail: String, pointer: String| Problem::new(Code::InvalidValue, detail).at(pointer, Vec::new());
        let event = |(place, name): (usize, &String)| {
            EVENTS.iter().find(|(known, _)| known == name).map(|(_, state)| *state).ok_or_else(|| {
                let shown: String = name.chars().take(64).collect();
                let all = EVENTS.map(|(name, _)| name).join(", ");
                invalid(format!("'{shown}' is not an event; the events are {all}"), format!("/events/{place}"))
            })
        };
        let events = match &self.events {
            Some(names) => names.iter().enumerate().map(event).collect::<Result<_, _>>()?,
            None => EVENTS.map(|(_, state)| state).to_vec(),
        };
        if self.description.len() > MAX_DESCRIPTION_BYTES {
            let detail = format!("a description has at most {MAX_DESCRIPTION_BYTES} bytes");
            return Err(invalid(detail, "/description".to_owned()));
        }
        Ok(NewWebhook { url: self.url, events, description: self.description })
    }
}
