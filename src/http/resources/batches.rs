//! `/v1/batches`: jobs that are asked for together.

use std::{collections::BTreeMap, time::Duration};

use axum::{
    Json,
    body::Body,
    extract::{FromRequest, Request, State},
    http::{HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};
use utoipa_axum::{router::OpenApiRouter, routes};

use super::new_batch::NewBatchBody;
use crate::{
    config::Settings,
    http::{
        ApiState, Shared,
        auth::Caller,
        caching,
        download::{ascii, disposition},
        extract::{Id, JsonBody, QueryOf, known_job_state, known_verdict},
        idempotency::{IdempotencyKey, replayed},
        page::{self, PageQuery},
        prefer::Prefer,
        problem::{Problem, ProblemView},
        quota,
        views::{JobPageView, JobView},
    },
    jobs::{ArchiveContents, BadItem, BatchId, BatchSnapshot, JobState, JobVerdict, Jobs, NewBatch, SubmittedBatch},
    report::batch_page,
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new()
        .routes(routes!(create, list))
        .routes(routes!(show))
        .routes(routes!(jobs_of))
        .routes(routes!(cancel))
        .routes(routes!(retry_failed))
        .routes(routes!(archive))
}

/// Jobs that were asked for together.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Batch)]
pub(super) struct BatchView {
    /// Names it.
    #[schema(example = "bat_01j9z3k8m0q4r6t8v0x2y4a6c8")]
    id: String,
    /// `queued` until one of its jobs starts, `running` or `canceling` until all have ended, then `succeeded` when all did, `failed` when
    /// one failed, else `canceled`. `retry-failed` leads back to the beginning.
    #[schema(example = "running")]
    state: &'static str,
    /// How many items there are.
    items: u64,
    /// How many of them are in each state; of an item that was asked for again, the newest job counts.
    counts: BatchCounts,
    /// How many of those that have results are how good.
    verdicts: BatchVerdicts,
    /// How far the whole is.
    progress: BatchProgressView,
    /// How many jobs were asked for again by `retry-failed`, all times together.
    retried: u64,
    /// `continue` or `stop`.
    #[schema(example = "continue")]
    on_error: &'static str,
    /// The user's own words about it.
    labels: BTreeMap<String, String>,
    /// Where to see what it gives, as soon as an item has succeeded: its first result.
    #[serde(skip_serializing_if = "Option::is_none")]
    thumbnail: Option<String>,
    /// When it was asked for.
    #[schema(format = DateTime)]
    created_at: String,
    /// When the first of its jobs started.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    started_at: Option<String>,
    /// When the last of its jobs ended, once all have.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    finished_at: Option<String>,
    /// When the last of its jobs may be removed, and the batch with it; known once all have ended.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    expires_at: Option<String>,
    /// Where to go from here.
    links: BatchLinks,
}

/// Items of a batch by the state of their jobs. What was removed by itself is not counted any more.
#[derive(Debug, Serialize, ToSchema)]
struct BatchCounts {
    /// Wait for a worker.
    queued: u64,
    /// Are at work.
    running: u64,
    /// Were told to stop.
    canceling: u64,
    /// Have results.
    succeeded: u64,
    /// Ended without results; `problem` of the job says why.
    failed: u64,
    /// Were stopped on request, or since another item failed.
    canceled: u64,
}

/// Items of a batch by the verdicts of their reports. What was not measured is in none.
#[derive(Debug, Serialize, ToSchema)]
struct BatchVerdicts {
    /// As good as one could wish.
    pass: u64,
    /// Worth a look.
    warn: u64,
    /// Visibly wrong.
    fail: u64,
    /// Nothing could be measured.
    not_applicable: u64,
}

/// How far a batch is.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = BatchProgress)]
struct BatchProgressView {
    /// Items that have ended.
    done: u64,
    /// Items.
    total: u64,
}

/// Where to go from a batch.
#[derive(Debug, Serialize, ToSchema)]
struct BatchLinks {
    /// The batch itself.
    #[serde(rename = "self")]
    own: String,
    /// Its jobs.
    jobs: String,
    /// What happens to its jobs, as server-sent events.
    events: String,
    /// Its results, as one zip archive.
    archive: String,
    /// To stop it.
    #[serde(skip_serializing_if = "Option::is_none")]
    cancel: Option<String>,
    /// To ask again for what failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    retry_failed: Option<String>,
}

impl From<BatchSnapshot> for BatchView {
    fn from(batch: BatchSnapshot) -> Self {
        let (state, count) = (batch.state(), |state| batch.count(state));
        let own = format!("/v1/batches/{}", batch.record.id);
        let link = |there: bool, name: &str| there.then(|| format!("{own}/{name}"));
        let text = |time: Option<jiff::Timestamp>| time.map(|time| time.to_string());
        let ended = |time| text(time).filter(|_| state.is_final());
        Self {
            id: batch.record.id.to_string(),
            state: state.name(),
            items: batch.record.items,
            counts: BatchCounts {
                queued: count(JobState::Queued),
                running: count(JobState::Running),
                canceling: count(JobState::Canceling),
                succeeded: count(JobState::Succeeded),
                failed: count(JobState::Failed),
                canceled: count(JobState::Canceled),
            },
            verdicts: BatchVerdicts {
                pass: batch.judged(JobVerdict::Pass),
                warn: batch.judged(JobVerdict::Warn),
                fail: batch.judged(JobVerdict::Fail),
                not_applicable: batch.judged(JobVerdict::NotApplicable),
            },
            progress: BatchProgressView { done: batch.ended(), total: batch.record.items },
            retried: batch.progress.retried,
            on_error: batch.record.on_error.name(),
            created_at: batch.record.created_at.to_string(),
            started_at: text(batch.progress.started_at),
            finished_at: ended(batch.progress.finished_at),
            expires_at: ended(batch.progress.expires_at),
            thumbnail: link(count(JobState::Succeeded) > 0, "preview.png?size=256"),
            links: BatchLinks {
                jobs: format!("{own}/jobs"),
                events: format!("{own}/events"),
                archive: format!("{own}/archive"),
                cancel: link(!state.is_final(), "cancel"),
                retry_failed: link(count(JobState::Failed) > 0, "retry-failed"),
                own,
            },
            labels: batch.record.labels,
        }
    }
}

/// A page of batches, newest first.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = BatchPage)]
struct BatchPageView {
    /// The batches.
    items: Vec<BatchView>,
    /// To be given as `cursor` for the next page; absent on the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    next_cursor: Option<String>,
}

/// What a batch would be.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = BatchCheck)]
struct BatchCheckView {
    /// How many items there are.
    items: u64,
    /// Those that could not be run.
    bad_items: Vec<BadItemView>,
}

/// What asking for a batch is answered with: generated clients have one type for it, whatever the status.
#[derive(ToSchema)]
#[serde(untagged)]
#[allow(dead_code, reason = "only its schema is used: each answer is written by itself")]
enum BatchOrCheck {
    /// The batch.
    Batch(Box<BatchView>),
    /// With `validate_only`.
    Check(BatchCheckView),
}

/// An item that cannot be run.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = BadItem)]
struct BadItemView {
    /// Which one, from 0.
    item: u64,
    /// Why.
    problem: ProblemView,
}

impl From<BadItem> for BadItemView {
    fn from(BadItem { item, failure }: BadItem) -> Self {
        let problem = Problem::of_job(&failure).below(&format!("/items/{item}"));
        Self { item, problem: problem.view("/v1/batches", "") }
    }
}

fn shown(batch: BatchSnapshot, status: StatusCode) -> Response {
    /// Most batches take longer than this.
    const LOOK_AGAIN_SECONDS: &str = "2";
    let (id, is_final) = (batch.record.id.to_string(), batch.state().is_final());
    let mut response = (status, Json(BatchView::from(batch))).into_response();
    let headers = response.headers_mut();
    if status == StatusCode::ACCEPTED {
        headers.insert(header::LOCATION, ascii(format!("/v1/batches/{id}")));
    }
    if !is_final {
        headers.insert(header::RETRY_AFTER, HeaderValue::from_static(LOOK_AGAIN_SECONDS));
    }
    response
}

/// Submits a batch of jobs.
///
/// All are accepted or none: once answered, all of them survive a restart of the service. A body that cannot be read
/// is refused as a whole, with a pointer to every error. An item that cannot be run (its asset or preset does not
/// exist, its config cannot be used) becomes a failed job with its problem, and the others run; with `atomic`, the
/// answer is that problem and no job is submitted. Batch jobs wait behind jobs that are submitted individually.
#[utoipa::path(post, path = "/v1/batches", operation_id = "create_batch", tag = "batches",
    params(("Idempotency-Key" = Option<String>, Header, description = "a unique key of this request, chosen by the client: a repeated request with the same key returns the same batch"),
        ("Cache-Control" = Option<String>, Header, description = "`no-cache` to compute everything even if results are cached")),
    request_body(description = "the batch", content = NewBatchBody),
    responses((status = 202, body = BatchView, description = "accepted", headers(("Location" = String), ("Retry-After" = u32))),
        (status = 200, body = BatchOrCheck, description = "with `validate_only`: what could not be run")))]
async fn create(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    IdempotencyKey(idempotency_key): IdempotencyKey,
    request: Request<Body>,
) -> Result<Response, Problem> {
    // What was asked for before is answered also when nothing new is taken.
    if idempotency_key.is_none() {
        state.jobs.check_batch_admission().await?;
    }
    let skip_cache = caching::is_skipped(request.headers());
    let JsonBody(body) = JsonBody::<NewBatchBody>::from_request(request, &state).await?;
    let (validate_only, settings) = (body.validate_only, Shared::clone(&state.settings));
    // Items are made one by one; a thousand of them take a while.
    let read = tokio::task::spawn_blocking(move || body.read(&settings)).await;
    let mut new = read.map_err(|fault| Problem::internal(&fault))??;
    for item in &mut new.items {
        item.skip_cache = skip_cache;
    }
    if validate_only {
        let items = new.items.len() as u64;
        let bad_items = state.jobs.check_batch(&owner, new).await?.into_iter().map(BadItemView::from).collect();
        return Ok(Json(BatchCheckView { items, bad_items }).into_response());
    }
    let SubmittedBatch { batch, is_repeated, quota } =
        state.jobs.submit_batch(&owner, NewBatch { idempotency_key, ..new }).await?;
    let mut response = shown(batch, StatusCode::ACCEPTED);
    response.headers_mut().extend(replayed(is_repeated).into_iter().chain(quota::headers(quota)));
    Ok(response)
}

/// Lists batches, newest first.
#[utoipa::path(get, path = "/v1/batches", operation_id = "list_batches", tag = "batches", params(PageQuery),
    responses((status = 200, body = BatchPageView, description = "a page")))]
async fn list(
    State(jobs): State<Jobs>,
    State(settings): State<Shared<Settings>>,
    Caller(owner): Caller,
    QueryOf(query): QueryOf<PageQuery>,
) -> Result<Json<BatchPageView>, Problem> {
    const WORDS: &str = "batches";
    let before = page::read_cursor(query.cursor.as_deref(), WORDS, |text| BatchId::parse(text).ok())?;
    let found =
        jobs.batches(&owner, before.as_ref(), page::items(query.limit.as_deref(), settings.max_page_items)?).await?;
    let next_cursor = page::next_cursor(&found, WORDS, |batch| batch.record.id.to_string());
    let items = found.items.into_iter().map(BatchView::from).collect();
    Ok(Json(BatchPageView { items, next_cursor }))
}

/// Shows a batch.
///
/// With `Prefer: wait=N` the answer comes when all its jobs have finished, or after N seconds.
#[utoipa::path(get, path = "/v1/batches/{id}", operation_id = "show_batch", tag = "batches", params(("id" = String, Path, description = "the batch"),
    ("Prefer" = Option<String>, Header, description = "`wait=N` to wait up to N seconds for its end")),
    responses((status = 200, body = BatchView, description = "the batch; `Retry-After` while it is unfinished")))]
async fn show(
    State(jobs): State<Jobs>,
    State(settings): State<Shared<Settings>>,
    Caller(owner): Caller,
    Id(id): Id<BatchId>,
    prefer: Prefer,
) -> Result<Response, Problem> {
    let longest = settings.max_wait.0;
    let batch = jobs.wait_for_batch(&owner, &id, prefer.wait(Duration::ZERO, longest)).await?;
    let mut response = shown(batch, StatusCode::OK);
    response.headers_mut().extend(prefer.applied(longest));
    Ok(response)
}

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct JobsQuery {
    /// Only jobs in this state.
    #[param(example = "failed")]
    state: Option<String>,
    /// Only jobs whose report says so of the result: `pass`, `warn`, `fail` or `not_applicable`.
    verdict: Option<String>,
    /// Entries of the page; capped by the limit `page_items`.
    #[param(value_type = Option<u32>, format = Int64, minimum = 1, maximum = 4_294_967_295_u32)]
    limit: Option<String>,
    /// `next_cursor` of the previous page.
    cursor: Option<String>,
}

/// Lists the jobs of a batch, in the order of its items.
///
/// For a retried item, the newest job.
#[utoipa::path(get, path = "/v1/batches/{id}/jobs", operation_id = "list_batch_jobs", tag = "batches",
    params(("id" = String, Path, description = "the batch"), JobsQuery),
    responses((status = 200, body = JobPageView, description = "a page")))]
async fn jobs_of(
    State(jobs): State<Jobs>,
    State(settings): State<Shared<Settings>>,
    Caller(owner): Caller,
    Id(id): Id<BatchId>,
    QueryOf(query): QueryOf<JobsQuery>,
) -> Result<Json<JobPageView>, Problem> {
    let filter = (known_job_state(query.state.as_deref())?, known_verdict(query.verdict.as_deref())?);
    let words = serde_json::json!([id.as_str(), query.state, query.verdict]).to_string();
    let after = page::read_cursor(query.cursor.as_deref(), &words, |text| text.parse::<u32>().ok().map(u64::from))?;
    let most = page::items(query.limit.as_deref(), settings.max_page_items)?;
    let found = jobs.batch_jobs(&owner, &id, filter, after, most).await?;
    let next_cursor = page::next_cursor(&found, &words, |job| {
        job.record.batch.as_ref().map_or_else(String::new, |place| place.item.to_string())
    });
    Ok(Json(JobPageView { items: found.items.into_iter().map(JobView::from).collect(), next_cursor }))
}

/// Cancels a batch.
///
/// Waiting jobs end immediately, running jobs are asked to stop, finished jobs stay as they are. May be repeated,
/// whatever the load.
#[utoipa::path(post, path = "/v1/batches/{id}/cancel", operation_id = "cancel_batch", tag = "batches", params(("id" = String, Path, description = "the batch")),
    responses((status = 200, body = BatchView, description = "the batch as it is now")))]
async fn cancel(State(jobs): State<Jobs>, Caller(owner): Caller, Id(id): Id<BatchId>) -> Result<Response, Problem> {
    Ok(shown(jobs.cancel_batch(&owner, &id).await?, StatusCode::OK))
}

/// Which items are tried again.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
struct RetryQuery {
    /// Whether items that were canceled are tried again, too.
    canceled: Option<bool>,
}

/// Retries the failed items of a batch.
///
/// Every item whose newest job failed, or did not start because another one failed, gets a new job (`retry_of` names
/// the old one). With `canceled=true`, items that were canceled get one too. The others stay as they are.
#[utoipa::path(post, path = "/v1/batches/{id}/retry-failed", operation_id = "retry_failed_of_batch", tag = "batches",
    params(("id" = String, Path, description = "the batch"), RetryQuery),
    responses((status = 202, body = BatchView, description = "the batch, with the new jobs", headers(("Location" = String))),
        (status = 200, body = BatchView, description = "the batch; nothing in it had failed")))]
async fn retry_failed(
    State(jobs): State<Jobs>,
    Caller(owner): Caller,
    Id(id): Id<BatchId>,
    QueryOf(query): QueryOf<RetryQuery>,
) -> Result<Response, Problem> {
    let (batch, count) = jobs.retry_failed(&owner, &id, query.canceled.unwrap_or(false)).await?;
    Ok(shown(batch, if count > 0 { StatusCode::ACCEPTED } else { StatusCode::OK }))
}

/// What an archive has beside results.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct ArchiveQuery {
    /// Whether there is a moving picture of each item, which `index.html` shows. Default false.
    #[serde(default)]
    previews: bool,
}

/// Downloads the results of a batch as one zip archive.
///
/// All results that are available now, whatever the state of the other items: `manifest.json` comes first and lists
/// state, files and problem of every item; `index.html` comes last and shows the same in a browser, with verdicts.
/// Files are named after their source, in a folder per target if there are several, or by the item's label `name`,
/// and are stored uncompressed. The archive is streamed; an interrupted one has no central directory. With
/// `previews=true` it has a moving picture of each item that can be drawn, which takes about a tenth of a second for
/// each.
#[utoipa::path(get, path = "/v1/batches/{id}/archive", operation_id = "download_batch", tag = "batches",
    params(("id" = String, Path, description = "the batch"), ArchiveQuery),
    responses((status = 200, content_type = "application/zip", body = String, description = "the archive")))]
async fn archive(
    State(jobs): State<Jobs>,
    Caller(owner): Caller,
    Id(id): Id<BatchId>,
    QueryOf(query): QueryOf<ArchiveQuery>,
) -> Result<Response, Problem> {
    let contents = ArchiveContents { previews: query.previews, page: batch_page };
    let headers = [
        (header::CONTENT_TYPE, HeaderValue::from_static("application/zip")),
        (header::CONTENT_DISPOSITION, disposition(&format!("{id}.zip"))),
        (header::CACHE_CONTROL, HeaderValue::from_static("no-store")),
    ];
    Ok((headers, Body::from_stream(jobs.batch_archive(&owner, &id, contents).await?)).into_response())
}
