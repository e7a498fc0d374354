//! `/v1/webhooks` and `/v1/deliveries`: being told of the ends of jobs, and what was told.

use axum::{
    Json,
    body::Body,
    extract::{FromRequest, Request, State},
    http::{StatusCode, header},
    response::{IntoResponse, Response},
};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{
    config::Settings,
    http::{
        ApiState, Shared,
        auth::Caller,
        code::Code,
        download::ascii,
        extract::{Id, JsonBody, QueryOf, known},
        page,
        problem::{Problem, ProblemView},
    },
    jobs::{
        DeliveryEvent, DeliveryId, DeliveryRecord, DeliveryState, JobState, NewWebhook, WebhookId, WebhookRecord,
        Webhooks,
    },
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new()
        .routes(routes!(create, list))
        .routes(routes!(show, delete))
        .routes(routes!(ping))
        .routes(routes!(rotate_secret))
        .routes(routes!(deliveries))
        .routes(routes!(delivery))
        .routes(routes!(redeliver))
}

/// The events that a webhook can listen to.
const EVENTS: [(&str, JobState); 3] =
    [("job.succeeded", JobState::Succeeded), ("job.failed", JobState::Failed), ("job.canceled", JobState::Canceled)];

/// A webhook that is to be made.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewWebhook)]
struct NewWebhookBody {
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

const MOST_DESCRIPTION_BYTES: usize = 256;

/// A webhook, without its secret.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Webhook)]
struct WebhookView {
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
struct WebhookWithSecretView {
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
struct WebhookListView {
    /// The oldest first.
    items: Vec<WebhookView>,
}

/// Something that a webhook is told.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Delivery)]
struct DeliveryView {
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
struct DeliveryPageView {
    /// The deliveries.
    items: Vec<DeliveryView>,
    /// To be given as `cursor` for the next page; absent on the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    next_cursor: Option<String>,
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
    fn read(self) -> Result<NewWebhook, Problem> {
        let invalid =
            |detail: String, pointer: String| Problem::new(Code::InvalidValue, detail).at(pointer, Vec::new());
        let event = |(place, name): (usize, &String)| {
            EVENTS.iter().find(|(known, _)| known == name).map(|(_, state)| *state).ok_or_else(|| {
                let shown: String = name.chars().take(64).collect();
                let all = EVENTS.map(|(name, _)| name).join(", ");
                invalid(format!("'{shown}' is no event; they are {all}"), format!("/events/{place}"))
            })
        };
        let events = match &self.events {
            Some(names) => names.iter().enumerate().map(event).collect::<Result<_, _>>()?,
            None => EVENTS.map(|(_, state)| state).to_vec(),
        };
        if self.description.len() > MOST_DESCRIPTION_BYTES {
            let detail = format!("a description has at most {MOST_DESCRIPTION_BYTES} bytes");
            return Err(invalid(detail, "/description".to_owned()));
        }
        Ok(NewWebhook { url: self.url, events, description: self.description })
    }
}

/// Makes a webhook.
///
/// It is told of the ends of jobs by `POST`s that are signed by the Standard Webhooks scheme, at least once each; `webhook-id` tells what
/// came before. Everything that it is told, `GET /v1/jobs/{id}` says too.
#[utoipa::path(post, path = "/v1/webhooks", operation_id = "create_webhook", tag = "webhooks", request_body = NewWebhookBody,
    responses((status = 201, body = WebhookWithSecretView, description = "made; the secret is told this once", headers(("Location" = String))),
        (status = "default", body = ProblemView, content_type = "application/problem+json", description = "a problem")))]
async fn create(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    request: Request<Body>,
) -> Result<Response, Problem> {
    let JsonBody(body) = JsonBody::<NewWebhookBody>::from_request(request, &state).await?;
    let webhook = state.webhooks.create(&owner, body.read()?).await?;
    let location = [(header::LOCATION, ascii(format!("/v1/webhooks/{}", webhook.id)))];
    Ok((StatusCode::CREATED, location, Json(WebhookWithSecretView::from(webhook))).into_response())
}

/// Lists all webhooks of the caller.
#[utoipa::path(get, path = "/v1/webhooks", operation_id = "list_webhooks", tag = "webhooks",
    responses((status = 200, body = WebhookListView, description = "all of them"),
        (status = "default", body = ProblemView, content_type = "application/problem+json", description = "a problem")))]
async fn list(State(webhooks): State<Webhooks>, Caller(owner): Caller) -> Result<Json<WebhookListView>, Problem> {
    Ok(Json(WebhookListView { items: webhooks.list(&owner).await?.into_iter().map(WebhookView::from).collect() }))
}

/// Shows a webhook.
#[utoipa::path(get, path = "/v1/webhooks/{id}", operation_id = "show_webhook", tag = "webhooks", params(("id" = String, Path, description = "the webhook")),
    responses((status = 200, body = WebhookView, description = "the webhook"),
        (status = "default", body = ProblemView, content_type = "application/problem+json", description = "a problem")))]
async fn show(
    State(webhooks): State<Webhooks>,
    Caller(owner): Caller,
    Id(id): Id<WebhookId>,
) -> Result<Json<WebhookView>, Problem> {
    Ok(Json(webhooks.get(&owner, &id).await?.into()))
}

/// Removes a webhook.
///
/// What it has not heard yet, it never hears.
#[utoipa::path(delete, path = "/v1/webhooks/{id}", operation_id = "delete_webhook", tag = "webhooks", params(("id" = String, Path, description = "the webhook")),
    responses((status = 204, description = "removed"),
        (status = "default", body = ProblemView, content_type = "application/problem+json", description = "a problem")))]
async fn delete(
    State(webhooks): State<Webhooks>,
    Caller(owner): Caller,
    Id(id): Id<WebhookId>,
) -> Result<StatusCode, Problem> {
    webhooks.delete(&owner, &id).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Sends a webhook a `ping`.
///
/// Once: who pings wants to know now. A webhook that was disabled and answers is enabled again.
#[utoipa::path(post, path = "/v1/webhooks/{id}/ping", operation_id = "ping_webhook", tag = "webhooks", params(("id" = String, Path, description = "the webhook")),
    responses((status = 202, body = DeliveryView, description = "on its way; the delivery tells how it went", headers(("Location" = String))),
        (status = "default", body = ProblemView, content_type = "application/problem+json", description = "a problem")))]
async fn ping(
    State(webhooks): State<Webhooks>,
    Caller(owner): Caller,
    Id(id): Id<WebhookId>,
) -> Result<Response, Problem> {
    Ok(on_its_way(webhooks.ping(&owner, &id).await?))
}

/// Gives a webhook another secret.
///
/// The one before signs along for a day, so that the receiver can be changed over in between.
#[utoipa::path(post, path = "/v1/webhooks/{id}/secret-rotations", operation_id = "rotate_webhook_secret", tag = "webhooks",
    params(("id" = String, Path, description = "the webhook")),
    responses((status = 200, body = WebhookWithSecretView, description = "the new secret, told this once"),
        (status = "default", body = ProblemView, content_type = "application/problem+json", description = "a problem")))]
async fn rotate_secret(
    State(webhooks): State<Webhooks>,
    Caller(owner): Caller,
    Id(id): Id<WebhookId>,
) -> Result<Json<WebhookWithSecretView>, Problem> {
    Ok(Json(webhooks.rotate_secret(&owner, &id).await?.into()))
}

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct DeliveriesQuery {
    /// Only deliveries in this state: `pending`, `delivered` or `failed`.
    state: Option<String>,
    /// Entries of the page; cut down to the limit `page_items`.
    #[param(format = Int64, maximum = 4_294_967_295_u32)]
    limit: Option<u32>,
    /// `next_cursor` of the page before.
    cursor: Option<String>,
}

/// Lists what a webhook is told, newest first.
///
/// Kept for as long as the limit `delivery_retention` says after it was delivered or given up.
#[utoipa::path(get, path = "/v1/webhooks/{id}/deliveries", operation_id = "list_deliveries", tag = "webhooks",
    params(("id" = String, Path, description = "the webhook"), DeliveriesQuery),
    responses((status = 200, body = DeliveryPageView, description = "a page"),
        (status = "default", body = ProblemView, content_type = "application/problem+json", description = "a problem")))]
async fn deliveries(
    State(webhooks): State<Webhooks>,
    State(settings): State<Shared<Settings>>,
    Caller(owner): Caller,
    Id(id): Id<WebhookId>,
    QueryOf(query): QueryOf<DeliveriesQuery>,
) -> Result<Json<DeliveryPageView>, Problem> {
    let state = known("state", query.state.as_deref(), DeliveryState::from_name, || {
        DeliveryState::ALL.map(DeliveryState::name).join(", ")
    })?;
    let made_with = query.state.unwrap_or_default();
    let before = page::read_cursor(query.cursor.as_deref(), &made_with, |text| DeliveryId::parse(text).ok())?;
    let most = page::items(query.limit, settings.max_page_items);
    let found = webhooks.deliveries(&owner, &id, state, before.as_ref(), most).await?;
    let last = found.items.last().filter(|_| found.has_more);
    let next_cursor = last.map(|delivery| page::cursor(&made_with, delivery.id.as_str()));
    let items = found.items.into_iter().map(DeliveryView::from).collect();
    Ok(Json(DeliveryPageView { items, next_cursor }))
}

/// Shows how a delivery went.
#[utoipa::path(get, path = "/v1/deliveries/{id}", operation_id = "show_delivery", tag = "webhooks", params(("id" = String, Path, description = "the delivery")),
    responses((status = 200, body = DeliveryView, description = "the delivery"),
        (status = "default", body = ProblemView, content_type = "application/problem+json", description = "a problem")))]
async fn delivery(
    State(webhooks): State<Webhooks>,
    Caller(owner): Caller,
    Id(id): Id<DeliveryId>,
) -> Result<Json<DeliveryView>, Problem> {
    Ok(Json(webhooks.delivery(&owner, &id).await?.into()))
}

/// Tells a webhook once more.
///
/// At once, whatever became of the delivery, under the same `webhook-id`, with all retries before it again.
#[utoipa::path(post, path = "/v1/deliveries/{id}/redeliver", operation_id = "redeliver", tag = "webhooks", params(("id" = String, Path, description = "the delivery")),
    responses((status = 202, body = DeliveryView, description = "on its way", headers(("Location" = String))),
        (status = "default", body = ProblemView, content_type = "application/problem+json", description = "a problem")))]
async fn redeliver(
    State(webhooks): State<Webhooks>,
    Caller(owner): Caller,
    Id(id): Id<DeliveryId>,
) -> Result<Response, Problem> {
    Ok(on_its_way(webhooks.redeliver(&owner, &id).await?))
}

fn on_its_way(delivery: DeliveryRecord) -> Response {
    let location = [(header::LOCATION, ascii(format!("/v1/deliveries/{}", delivery.id)))];
    (StatusCode::ACCEPTED, location, Json(DeliveryView::from(delivery))).into_response()
}
