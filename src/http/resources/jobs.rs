//! `/v1/jobs`: retargets that run by themselves.

use std::time::Duration;

use axum::{
    Json,
    body::Body,
    extract::{FromRequest, Request, State},
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use serde::Deserialize;
use utoipa::{IntoParams, ToSchema};
use utoipa_axum::{router::OpenApiRouter, routes};

use super::{
    new_job::NewJobBody,
    proposals::{ProposalView, validate},
};
use crate::{
    config::Settings,
    engine::{PreviewOptions, is_drawable},
    http::{
        ApiState, Shared,
        accepted::accepted,
        auth::Caller,
        caching,
        extract::{self, Id, JsonBody, QueryOf, known, known_job_state, known_verdict, unusable},
        idempotency::{IdempotencyKey, replayed},
        json_text, negotiate, page, page_text,
        prefer::Prefer,
        problem::Problem,
        quota, upload,
        views::{JobPageView, JobView},
    },
    jobs::{JobFilter, JobId, JobKind, Jobs, NewJob, Pictured, Principal, Submitted},
    report::{Illustration, report_page},
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new()
        .routes(routes!(create, list))
        .routes(routes!(show, delete))
        .routes(routes!(cancel))
        .routes(routes!(retry))
        .routes(routes!(report))
        .routes(routes!(config))
}

/// Submits a job.
///
/// Either JSON that names uploaded files, or the same multipart form as `POST /v1/retarget`. Once answered, the job
/// survives a restart of the service. If principals have a quota of unfinished jobs, `RateLimit` has the remainder.
#[utoipa::path(post, path = "/v1/jobs", operation_id = "create_job", tag = "jobs",
    params(("Prefer" = Option<String>, Header, description = "`wait=N` to wait up to N seconds for its end"),
        ("Idempotency-Key" = Option<String>, Header, description = "a unique key of this request, chosen by the client: a repeated request with the same key returns the same job"),
        ("Cache-Control" = Option<String>, Header, description = "`no-cache` to compute it even if results are cached")),
    request_body(description = "the job", content(
        (NewJobBody = "application/json"), (super::retarget::RetargetForm = "multipart/form-data"))),
    responses((status = 202, body = JobView, description = "accepted", headers(("Location" = String), ("Retry-After" = u32))),
        (status = 200, body = EndedOrChecked, description = "finished within the wait; with `validate_only`, what the job would do")))]
async fn create(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    IdempotencyKey(idempotency_key): IdempotencyKey,
    prefer: Prefer,
    request: Request<Body>,
) -> Result<Response, Problem> {
    let ApiState { jobs, settings, .. } = &state;
    let new = match asked(request, &state, &owner, idempotency_key).await? {
        Submission::Run(new) => new,
        Submission::Validate(new) => return Ok(Json(validate(&state.assets, &owner, new).await?).into_response()),
    };
    let Submitted { job: submitted, is_repeated, quota } = jobs.submit(&owner, new).await?;
    let longest = settings.max_wait.0;
    let wait = prefer.wait(Duration::ZERO, longest);
    // Who does not wait is told what was taken on, however quick the worker is: the status is no race.
    let snapshot =
        if wait.is_zero() { jobs.seen(submitted).await? } else { jobs.wait(&owner, &submitted.id, wait).await? };
    let status = if snapshot.record.state.is_final() { StatusCode::OK } else { StatusCode::ACCEPTED };
    let mut response = accepted(snapshot, status);
    response.headers_mut().extend(prefer.applied(longest).into_iter().chain(replayed(is_repeated)));
    response.headers_mut().extend(quota::headers(quota));
    Ok(response)
}

/// A job that has ended, or what a job would do.
#[derive(ToSchema)]
#[serde(untagged)]
#[allow(dead_code, reason = "only its schema is used: each answer is written by itself")]
enum EndedOrChecked {
    /// The job.
    Job(Box<JobView>),
    /// With `validate_only`.
    Proposal(Box<ProposalView>),
}

/// What is to be done with a job that somebody describes.
enum Submission {
    Run(NewJob),
    Validate(NewJob),
}

/// Reads the description, in either form.
async fn asked(
    request: Request<Body>,
    state: &ApiState,
    owner: &Principal,
    idempotency_key: Option<String>,
) -> Result<Submission, Problem> {
    let has_files = extract::is_media_type(request.headers(), "multipart/form-data");
    let skip_cache = caching::is_skipped(request.headers());
    // What was asked for before is answered also when nothing new is taken.
    if has_files || idempotency_key.is_none() {
        state.jobs.check_admission().await?;
    }
    if has_files {
        let new = upload::read_job(request, state).await?.keep(&state.assets, owner).await?;
        return Ok(Submission::Run(NewJob { idempotency_key, skip_cache, ..new }));
    }
    let JsonBody(body) = JsonBody::<NewJobBody>::from_request(request, state).await?;
    let (validate_only, new) = (body.validate_only, body.read(&state.settings)?);
    Ok(if validate_only {
        Submission::Validate(new)
    } else {
        Submission::Run(NewJob { idempotency_key, skip_cache, ..new })
    })
}

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct ListQuery {
    /// Only jobs in this state.
    state: Option<String>,
    /// Only jobs of this kind: `retarget`, `edit`, `pose` or `draw`.
    kind: Option<String>,
    /// Only jobs with this verdict: `pass`, `warn`, `fail` or `not_applicable`.
    verdict: Option<String>,
    /// Only jobs with this label, as `name=text`.
    #[param(example = "shot=012")]
    label: Option<String>,
    /// Only jobs that were submitted at this time (RFC 3339) or later.
    #[param(example = "2026-11-22T08:00:00Z")]
    since: Option<String>,
    /// Entries of the page; capped by the limit `page_items`.
    #[param(value_type = Option<u32>, format = Int64, minimum = 1, maximum = 4_294_967_295_u32)]
    limit: Option<String>,
    /// `next_cursor` of the previous page.
    cursor: Option<String>,
}

/// Lists jobs, newest first.
#[utoipa::path(get, path = "/v1/jobs", operation_id = "list_jobs", tag = "jobs", params(ListQuery),
    responses((status = 200, body = JobPageView, description = "a page")))]
async fn list(
    State(jobs): State<Jobs>,
    State(settings): State<Shared<Settings>>,
    Caller(owner): Caller,
    QueryOf(query): QueryOf<ListQuery>,
) -> Result<Json<JobPageView>, Problem> {
    let (filter, words) = (query.filter()?, query.words());
    let before = page::read_cursor(query.cursor.as_deref(), &words, |text| JobId::parse(text).ok())?;
    let found = jobs
        .list(&owner, &filter, before.as_ref(), page::items(query.limit.as_deref(), settings.max_page_items)?)
        .await?;
    let next_cursor = page::next_cursor(&found, &words, |job| job.record.id.to_string());
    let items = found.items.into_iter().map(JobView::from).collect();
    Ok(Json(JobPageView { items, next_cursor }))
}

impl ListQuery {
    /// What a cursor of this list is made with.
    fn words(&self) -> String {
        let words = [&self.state, &self.kind, &self.verdict, &self.label, &self.since];
        serde_json::json!(words).to_string()
    }

    fn filter(&self) -> Result<JobFilter, Problem> {
        let label = self
            .label
            .as_deref()
            .map(|text| text.split_once('=').ok_or_else(|| unusable("label", text, "name=text", "shot=012")));
        let since = self.since.as_deref().map(|text| {
            text.parse().map_err(|_| unusable("since", text, "a time with its date and zone", "2026-11-22T08:00:00Z"))
        });
        Ok(JobFilter {
            state: known_job_state(self.state.as_deref())?,
            kind: known("kind", self.kind.as_deref(), JobKind::from_name, || {
                JobKind::ALL.map(JobKind::name).join(", ")
            })?,
            verdict: known_verdict(self.verdict.as_deref())?,
            label: label.transpose()?.map(|(name, text)| (name.to_owned(), text.to_owned())),
            since: since.transpose()?,
        })
    }
}

/// Shows a job.
///
/// With `Prefer: wait=N` the answer comes when the job has finished, or after N seconds.
#[utoipa::path(get, path = "/v1/jobs/{id}", operation_id = "show_job", tag = "jobs", params(("id" = String, Path, description = "the job"),
    ("Prefer" = Option<String>, Header, description = "`wait=N` to wait up to N seconds for its end")),
    responses((status = 200, body = JobView, description = "the job; `Retry-After` while it is unfinished")))]
async fn show(
    State(jobs): State<Jobs>,
    State(settings): State<Shared<Settings>>,
    Caller(owner): Caller,
    Id(id): Id<JobId>,
    prefer: Prefer,
) -> Result<Response, Problem> {
    let longest = settings.max_wait.0;
    let snapshot = jobs.wait(&owner, &id, prefer.wait(Duration::ZERO, longest)).await?;
    let mut response = accepted(snapshot, StatusCode::OK);
    response.headers_mut().extend(prefer.applied(longest));
    Ok(response)
}

/// Cancels a job.
///
/// May be repeated, whatever the load. A finished job stays as it is.
#[utoipa::path(post, path = "/v1/jobs/{id}/cancel", operation_id = "cancel_job", tag = "jobs", params(("id" = String, Path, description = "the job")),
    responses((status = 200, body = JobView, description = "the job as it is now")))]
async fn cancel(State(jobs): State<Jobs>, Caller(owner): Caller, Id(id): Id<JobId>) -> Result<Response, Problem> {
    Ok(accepted(jobs.cancel(&owner, &id).await?, StatusCode::OK))
}

/// Repeats a job as a new job.
#[utoipa::path(post, path = "/v1/jobs/{id}/retry", operation_id = "retry_job", tag = "jobs", params(("id" = String, Path, description = "the job")),
    responses((status = 202, body = JobView, description = "the new job", headers(("Location" = String)))))]
async fn retry(State(jobs): State<Jobs>, Caller(owner): Caller, Id(id): Id<JobId>) -> Result<Response, Problem> {
    Ok(accepted(jobs.retry(&owner, &id).await?, StatusCode::ACCEPTED))
}

/// Deletes a job and its results.
///
/// Refused while it is unfinished.
#[utoipa::path(delete, path = "/v1/jobs/{id}", operation_id = "delete_job", tag = "jobs", params(("id" = String, Path, description = "the job")),
    responses((status = 204, description = "removed")))]
async fn delete(State(jobs): State<Jobs>, Caller(owner): Caller, Id(id): Id<JobId>) -> Result<StatusCode, Problem> {
    jobs.delete(&owner, &id).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// What is wanted beside the report.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct ReportQuery {
    /// `curves` for measures at every frame.
    #[param(inline)]
    include: Option<Included>,
}

/// What is available beside a report.
#[derive(Clone, Copy, Debug, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum Included {
    /// Measures at every frame.
    Curves,
}

/// Shows the report.
///
/// As JSON, or as a page with plots for clients that prefer `text/html`, such as browsers. The curves of
/// `measures.curves` have at most 120 values; with `include=curves` those of the JSON have one for every frame, and
/// there are those of `limb_twist` and `end_orientation`: that takes about as long as the job did.
#[utoipa::path(get, path = "/v1/jobs/{id}/report", operation_id = "show_report", tag = "jobs", params(("id" = String, Path, description = "the job"), ReportQuery,
    ("Accept" = Option<String>, Header, description = "`text/html` for a page")),
    responses((status = 200, description = "timings, counts, warnings and measures",
            content((Object = "application/json"), (String = "text/html")))))]
async fn report(
    State(jobs): State<Jobs>,
    Caller(owner): Caller,
    Id(id): Id<JobId>,
    QueryOf(query): QueryOf<ReportQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let report = jobs.report(&owner, &id).await?;
    let wants_page = negotiate::prefers_page(extract::text(&headers, &header::ACCEPT));
    let mut response = if wants_page {
        let report = serde_json::from_str(&report).map_err(|error| Problem::internal(&error))?;
        page_text(report_page(&report, &illustration(&jobs, &owner, &id).await))
    } else if query.include.is_some() {
        with_curves(&report, jobs.curves(&owner, &id).await?)?
    } else {
        json_text(report)
    };
    response.headers_mut().insert(header::VARY, HeaderValue::from_static("accept"));
    Ok(response)
}

/// The report with those curves in place of its own.
fn with_curves(report: &str, curves: serde_json::Value) -> Result<Response, Problem> {
    let mut report: serde_json::Value = serde_json::from_str(report).map_err(|error| Problem::internal(&error))?;
    if let Some(of_report) = report.pointer_mut("/measures/curves") {
        *of_report = curves;
    }
    Ok(json_text(report.to_string()))
}

/// What the page of a report shows of its job. A result that cannot be drawn is left out: the report is what was asked for.
async fn illustration(jobs: &Jobs, owner: &Principal, id: &JobId) -> Illustration {
    let Ok(job) = jobs.get(owner, id).await else { return Illustration::default() };
    let shown = job.results.into_iter().find(|result| is_drawable(&result.format));
    let mut about = vec![("job", id.to_string())];
    about.extend(shown.iter().map(|result| ("result", result.file_name.clone())));
    let picture = match shown {
        Some(result) => {
            jobs.preview(&Pictured::of_result(owner.clone(), result), PreviewOptions::of_report()).await.ok()
        }
        None => None,
    };
    Illustration { about, picture: picture.map(Vec::from) }
}

/// Shows the resolved spec.
///
/// Everything that was detected is filled in; run again, it gives the same result.
#[utoipa::path(get, path = "/v1/jobs/{id}/config", operation_id = "show_config", tag = "jobs", params(("id" = String, Path, description = "the job")),
    responses((status = 200, body = Object, description = "the resolved spec")))]
async fn config(State(jobs): State<Jobs>, Caller(owner): Caller, Id(id): Id<JobId>) -> Result<Response, Problem> {
    Ok(json_text(jobs.resolved_spec(&owner, &id).await?))
}
