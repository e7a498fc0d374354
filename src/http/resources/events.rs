//! `/v1/events`, `/v1/jobs/{id}/events` and `/v1/batches/{id}/events`: what happens, as server-sent events.

use std::{collections::BTreeMap, convert::Infallible, time::Duration};

use axum::{
    Json,
    extract::State,
    http::{HeaderMap, HeaderName, HeaderValue, StatusCode},
    response::{
        IntoResponse, Response,
        sse::{Event, KeepAlive, Sse},
    },
};
use futures::{Stream, StreamExt, stream};
use serde::Serialize;
use utoipa::ToSchema;
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{
    http::{
        ApiState,
        auth::{Caller, shown_key},
        code::Code,
        extract::{self, Id},
        problem::Problem,
        views::ProgressView,
    },
    jobs::{BatchId, EventRecord, EventStream, Followed, JobId, Principal, StreamToken, Told},
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new()
        .routes(routes!(of_everything))
        .routes(routes!(of_job))
        .routes(routes!(of_batch))
        .routes(routes!(make_token))
}

/// How long a caller shall wait before coming again when the connection breaks.
const COME_AGAIN: Duration = Duration::from_secs(1);

/// A job came into a state. Everything in it can also be asked for at the job.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = JobEvent)]
pub(in crate::http) struct JobEventView {
    /// `job.` and the state.
    #[serde(rename = "type")]
    #[schema(example = "job.succeeded")]
    kind: String,
    /// Its place among your events, from 1 and without gaps; also the `id` of the event.
    number: u64,
    /// When it happened.
    #[schema(format = DateTime)]
    created_at: String,
    /// The job.
    #[schema(example = "job_01j9z3k8m0q4r6t8v0x2y4a6c8")]
    job: String,
    /// The state that it came into.
    #[schema(example = "succeeded")]
    state: &'static str,
    /// The batch that the job was asked for with.
    #[serde(skip_serializing_if = "Option::is_none")]
    batch: Option<String>,
    /// Which item of the batch it is for, from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    batch_item: Option<u64>,
    /// The labels of the job, while its record is there.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    labels: BTreeMap<String, String>,
    /// What the report says of the result: `pass`, `warn`, `fail` or `not_applicable`. Only of a job that has succeeded.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, example = "pass")]
    verdict: Option<&'static str>,
    /// For people: what the verdict is about.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    verdict_reason: Option<String>,
    /// The share of the target's body that is driven, from 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    coverage: Option<f64>,
    /// Where the job is.
    href: String,
}

impl From<EventRecord> for JobEventView {
    fn from(event: EventRecord) -> Self {
        let EventRecord { number, job, state, created_at, batch, labels, judgment } = event;
        Self {
            kind: format!("job.{}", state.name()),
            number,
            created_at: created_at.to_string(),
            href: format!("/v1/jobs/{job}"),
            job: job.to_string(),
            state: state.name(),
            batch: batch.as_ref().map(|place| place.batch.to_string()),
            batch_item: batch.map(|place| place.item),
            labels,
            coverage: judgment.as_ref().and_then(|judgment| judgment.coverage),
            verdict: judgment.as_ref().map(|judgment| judgment.verdict.name()),
            verdict_reason: judgment.map(|judgment| judgment.reason),
        }
    }
}

/// How far a job is.
#[derive(Debug, Serialize)]
struct JobProgressView {
    job: String,
    progress: ProgressView,
}

#[derive(Debug, Serialize)]
struct ReasonView {
    reason: &'static str,
}

/// One event of a stream, as lines of `name: value`.
#[derive(ToSchema)]
#[allow(dead_code, reason = "only its schema is used: events are written as lines")]
struct ServerSentEvent {
    /// Where to go on after it; absent where nothing has happened.
    id: Option<String>,
    /// What it is: the `type` of a `JobEvent`, `job.progress`, `reset` or `bye`.
    event: Option<String>,
    /// A JSON document as text: a `JobEvent`, how far the job is, or the `reason` of `reset` and `bye`.
    data: String,
    /// After how many milliseconds to come back when the stream breaks off.
    retry: Option<u64>,
}

/// Follows all jobs of the caller.
///
/// A stream of server-sent events, from now on or behind `Last-Event-ID`: `job.queued`, `job.running`,
/// `job.canceling`, `job.succeeded`, `job.failed` and `job.canceled`, each once and in order, with a `JobEvent` as
/// data. `reset` says that missed events are no longer available, so the client has to list the jobs. `bye` says that
/// the stream ends (`shutting_down`, `time_is_over`, `unavailable`) and the client has to reconnect. Events are kept
/// for the period of the limit `event_retention`; the limit `event_streams` bounds the open streams of a principal.
#[utoipa::path(get, path = "/v1/events", operation_id = "follow_everything", tag = "events",
    params(("token" = Option<String>, Query, description = "of `POST /v1/stream-tokens`, where no header can be sent"),
        ("Last-Event-ID" = Option<String>, Header, description = "the `id` of the last received event")),
    responses((status = 200, body = ServerSentEvent, content_type = "text/event-stream", description = "the event stream")))]
async fn of_everything(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    answer(&state, &owner, Followed::Everything, &headers).await
}

/// Follows a job to its end.
///
/// The same events as of `GET /v1/events`, those of this job alone, from its first or behind `Last-Event-ID`, and
/// between them `job.progress` (without an `id`) with `phase`, `done` and `total`. The stream ends with the job. A
/// client that has received the end and reconnects gets 204, at which browsers stop reconnecting.
#[utoipa::path(get, path = "/v1/jobs/{id}/events", operation_id = "follow_job", tag = "events",
    params(("id" = String, Path, description = "the job"),
        ("token" = Option<String>, Query, description = "of `POST /v1/stream-tokens`, where no header can be sent"),
        ("Last-Event-ID" = Option<String>, Header, description = "the `id` of the last received event")),
    responses((status = 200, body = ServerSentEvent, content_type = "text/event-stream", description = "the event stream"),
        (status = 204, description = "the job has finished, and the client has received its end")))]
async fn of_job(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    Id(id): Id<JobId>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    answer(&state, &owner, Followed::Job(id), &headers).await
}

/// Follows the jobs of a batch until all have ended.
///
/// The same events as of `GET /v1/events`, those of this batch alone, from its first or behind `Last-Event-ID`; `batch_item` and `labels`
/// say which item an event is about. The stream ends when every item has ended. A client that has received the end and reconnects gets 204.
#[utoipa::path(get, path = "/v1/batches/{id}/events", operation_id = "follow_batch", tag = "events",
    params(("id" = String, Path, description = "the batch"),
        ("token" = Option<String>, Query, description = "of `POST /v1/stream-tokens`, where no header can be sent"),
        ("Last-Event-ID" = Option<String>, Header, description = "the `id` of the last received event")),
    responses((status = 200, body = ServerSentEvent, content_type = "text/event-stream", description = "the event stream"),
        (status = 204, description = "all jobs have finished, and the client has received their end")))]
async fn of_batch(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    Id(id): Id<BatchId>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    answer(&state, &owner, Followed::Batch(id), &headers).await
}

/// What opens an event stream for a minute.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = StreamToken)]
struct StreamTokenView {
    /// To be given as `token` in the address of a stream: `/v1/events?token=…`. Streams that it has opened go on when it ends.
    #[schema(example = "rts_01j9z3k8m0q4r6t8v0x2y4a6c8_1790000000000_…")]
    token: String,
    /// When it opens nothing any more.
    #[schema(format = DateTime)]
    expires_at: String,
}

/// Makes a token that opens event streams.
///
/// For browsers, whose `EventSource` sends no header: the holder of a key requests a token, and the page opens
/// `/v1/events?token=…` or `/v1/jobs/{id}/events?token=…` with it within a minute. It allows what the key allows of streams, and ends with it.
/// Where no key is required, streams open without one.
#[utoipa::path(post, path = "/v1/stream-tokens", operation_id = "create_stream_token", tag = "events",
    responses((status = 201, body = StreamTokenView, description = "made")))]
async fn make_token(State(state): State<ApiState>, headers: HeaderMap) -> Result<Response, Problem> {
    let key = shown_key(&state, &headers).await?.ok_or_else(|| {
        Problem::new(Code::Forbidden, "tokens for event streams are made with a key, and the request has none")
            .with_hint("where no key is required, open the stream without a token; send identity tokens in the header 'Authorization'")
    })?;
    let StreamToken { text, expires_at } = state.keys.stream_token(&key);
    let view = StreamTokenView { token: text.reveal().to_owned(), expires_at: expires_at.to_string() };
    Ok((StatusCode::CREATED, Json(view)).into_response())
}

async fn answer(
    state: &ApiState,
    owner: &Principal,
    followed: Followed,
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let after = last_heard(headers)?;
    let Some(stream) = state.jobs.follow(owner, followed, after).await? else {
        return Ok(StatusCode::NO_CONTENT.into_response());
    };
    let heartbeat = KeepAlive::new().interval(state.settings.event_heartbeat.0);
    let mut response = Sse::new(events(stream)).keep_alive(heartbeat).into_response();
    // Proxies that gather what they pass on would hold events back.
    let name = HeaderName::from_static("x-accel-buffering");
    response.headers_mut().insert(name, HeaderValue::from_static("no"));
    Ok(response)
}

/// The number behind which the caller wants to go on.
fn last_heard(headers: &HeaderMap) -> Result<Option<u64>, Problem> {
    let text = extract::text(headers, &HeaderName::from_static("last-event-id"));
    if text.is_empty() {
        return Ok(None);
    }
    text.parse().map(Some).map_err(|_| {
        let shown: String = text.chars().take(64).collect();
        Problem::new(Code::MalformedRequest, format!("'Last-Event-ID: {shown}' is the id of no event"))
            .with_hint("send the id of the last event that was heard, or leave the header out")
    })
}

fn events(stream: EventStream) -> impl Stream<Item = Result<Event, Infallible>> {
    let first = Event::default().retry(COME_AGAIN).comment("following");
    let told = stream::unfold(stream, async |mut stream| {
        let told = stream.next().await?;
        Some((told, stream))
    });
    stream::iter([first]).chain(told.map(event)).map(Ok)
}

fn event(told: Told) -> Event {
    match told {
        Told::Happened(event) => {
            let view = JobEventView::from(event);
            data(Event::default().id(view.number.to_string()).event(view.kind.clone()), &view)
        }
        Told::Progress(job, progress) => {
            let view = JobProgressView { job: job.to_string(), progress: progress.into() };
            data(Event::default().event("job.progress"), &view)
        }
        Told::Reset { number, reason } => {
            data(Event::default().id(number.to_string()).event("reset"), &ReasonView { reason })
        }
        Told::Bye(reason) => data(Event::default().event("bye"), &ReasonView { reason }),
    }
}

fn data(event: Event, view: &impl Serialize) -> Event {
    event.json_data(view).unwrap_or_else(|error| {
        tracing::error!(%error, "an event could not be written");
        Event::default().comment("an event could not be written")
    })
}
