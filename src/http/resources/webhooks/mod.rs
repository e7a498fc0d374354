//! `/v1/webhooks` and `/v1/deliveries`: being told of the ends of jobs, and what was told.

mod views;

use axum::{
    Json,
    body::Body,
    extract::{FromRequest, Request, State},
    http::{StatusCode, header},
    response::{IntoResponse, Response},
};
use serde::Deserialize;
use utoipa::IntoParams;
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{
    config::Settings,
    http::{
        ApiState, Shared,
        auth::Caller,
        download::ascii,
        extract::{Id, JsonBody, QueryOf, known},
        page,
        problem::Problem,
    },
    jobs::{DeliveryId, DeliveryRecord, DeliveryState, WebhookId, Webhooks},
};
use views::{DeliveryPageView, DeliveryView, NewWebhookBody, WebhookListView, WebhookView, WebhookWithSecretView};

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

/// Creates a webhook.
///
/// It receives a `POST` when a job finishes, signed by the Standard Webhooks scheme, at least once each; `webhook-id`
/// identifies repetitions. Everything that it receives is also in `GET /v1/jobs/{id}`.
#[utoipa::path(post, path = "/v1/webhooks", operation_id = "create_webhook", tag = "webhooks", request_body = NewWebhookBody,
    responses((status = 201, body = WebhookWithSecretView, description = "created; the secret is shown only once", headers(("Location" = String)))))]
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
    responses((status = 200, body = WebhookListView, description = "all of them")))]
async fn list(State(webhooks): State<Webhooks>, Caller(owner): Caller) -> Result<Json<WebhookListView>, Problem> {
    Ok(Json(WebhookListView { items: webhooks.list(&owner).await?.into_iter().map(WebhookView::from).collect() }))
}

/// Shows a webhook.
#[utoipa::path(get, path = "/v1/webhooks/{id}", operation_id = "show_webhook", tag = "webhooks", params(("id" = String, Path, description = "the webhook")),
    responses((status = 200, body = WebhookView, description = "the webhook")))]
async fn show(
    State(webhooks): State<Webhooks>,
    Caller(owner): Caller,
    Id(id): Id<WebhookId>,
) -> Result<Json<WebhookView>, Problem> {
    Ok(Json(webhooks.get(&owner, &id).await?.into()))
}

/// Deletes a webhook.
///
/// Pending deliveries are dropped.
#[utoipa::path(delete, path = "/v1/webhooks/{id}", operation_id = "delete_webhook", tag = "webhooks", params(("id" = String, Path, description = "the webhook")),
    responses((status = 204, description = "removed")))]
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
/// Without retries. A disabled webhook that answers is enabled again.
#[utoipa::path(post, path = "/v1/webhooks/{id}/ping", operation_id = "ping_webhook", tag = "webhooks", params(("id" = String, Path, description = "the webhook")),
    responses((status = 202, body = DeliveryView, description = "accepted; the delivery has the outcome", headers(("Location" = String)))))]
async fn ping(
    State(webhooks): State<Webhooks>,
    Caller(owner): Caller,
    Id(id): Id<WebhookId>,
) -> Result<Response, Problem> {
    Ok(on_its_way(webhooks.ping(&owner, &id).await?))
}

/// Rotates the secret of a webhook.
///
/// The previous secret also signs for a day, so that the receiver can be switched over.
#[utoipa::path(post, path = "/v1/webhooks/{id}/secret-rotations", operation_id = "rotate_webhook_secret", tag = "webhooks",
    params(("id" = String, Path, description = "the webhook")),
    responses((status = 200, body = WebhookWithSecretView, description = "the new secret, shown only once")))]
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
    /// Entries of the page; capped by the limit `page_items`.
    #[param(value_type = Option<u32>, format = Int64, minimum = 1, maximum = 4_294_967_295_u32)]
    limit: Option<String>,
    /// `next_cursor` of the previous page.
    cursor: Option<String>,
}

/// Lists the deliveries of a webhook, newest first.
///
/// Kept for the period of the limit `delivery_retention` after they were completed or abandoned.
#[utoipa::path(get, path = "/v1/webhooks/{id}/deliveries", operation_id = "list_deliveries", tag = "webhooks",
    params(("id" = String, Path, description = "the webhook"), DeliveriesQuery),
    responses((status = 200, body = DeliveryPageView, description = "a page")))]
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
    let most = page::items(query.limit.as_deref(), settings.max_page_items)?;
    let found = webhooks.deliveries(&owner, &id, state, before.as_ref(), most).await?;
    let next_cursor = page::next_cursor(&found, &made_with, |delivery| delivery.id.to_string());
    let items = found.items.into_iter().map(DeliveryView::from).collect();
    Ok(Json(DeliveryPageView { items, next_cursor }))
}

/// Shows a delivery.
#[utoipa::path(get, path = "/v1/deliveries/{id}", operation_id = "show_delivery", tag = "webhooks", params(("id" = String, Path, description = "the delivery")),
    responses((status = 200, body = DeliveryView, description = "the delivery")))]
async fn delivery(
    State(webhooks): State<Webhooks>,
    Caller(owner): Caller,
    Id(id): Id<DeliveryId>,
) -> Result<Json<DeliveryView>, Problem> {
    Ok(Json(webhooks.delivery(&owner, &id).await?.into()))
}

/// Repeats a delivery.
///
/// Immediately, whatever the state of the delivery, under the same `webhook-id` and with the full retry schedule.
#[utoipa::path(post, path = "/v1/deliveries/{id}/redeliver", operation_id = "redeliver", tag = "webhooks", params(("id" = String, Path, description = "the delivery")),
    responses((status = 202, body = DeliveryView, description = "accepted", headers(("Location" = String)))))]
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
