//! `POST /v1/retarget`: files in, file out. A job with a wait, not a second way of working.

use axum::{
    body::Body,
    extract::{FromRequest, Request, State},
    http::StatusCode,
    response::{IntoResponse, Response},
};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;
use utoipa_axum::{router::OpenApiRouter, routes};

use super::new_job::SuggestionBody;
use crate::{
    http::{
        ApiState,
        accepted::accepted,
        auth::Caller,
        caching,
        code::Code,
        download::{File, ascii},
        extract::{JsonBody, is_media_type},
        idempotency::{IdempotencyKey, replayed},
        judgment,
        one_shot::OneShotHeaders,
        prefer::Prefer,
        problem::Problem,
        quota,
        upload::{self, Parts},
        views::JobView,
    },
    jobs::{Awaited, HandedFile, JobId, JobRecord, JobSnapshot, JobState, Jobs, NewJob, Principal, Submitted},
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new().routes(routes!(retarget))
}

/// The parts of a retarget, in any order.
#[derive(ToSchema)]
#[allow(dead_code, reason = "only its schema is used: parts are streamed, never held in one value")]
pub(in crate::http) struct RetargetForm {
    /// The file with the animation.
    #[schema(content_media_type = "application/octet-stream")]
    source: String,
    /// The file with the character that it goes onto.
    #[schema(content_media_type = "application/octet-stream")]
    target: String,
    /// The source rig in its rest pose, where the source file does not hold it.
    #[schema(content_media_type = "application/octet-stream")]
    source_rest: Option<String>,
    /// The target rig in its rest pose, where the target file does not hold it.
    #[schema(content_media_type = "application/octet-stream")]
    target_rest: Option<String>,
    /// The retarget spec (JSON or YAML), or a config of another tool that is understood.
    #[schema(content_media_type = "application/json")]
    config: Option<String>,
    /// The name of a preset that the config is laid over.
    preset: Option<String>,
}

/// Stops the job when the caller goes away while waiting for it.
struct StopUnlessAnswered {
    jobs: Jobs,
    owner: Principal,
    id: Option<JobId>,
}

impl Drop for StopUnlessAnswered {
    fn drop(&mut self) {
        if let Some(id) = self.id.take() {
            let (jobs, owner) = (self.jobs.clone(), self.owner.clone());
            tokio::spawn(async move {
                if let Err(error) = jobs.cancel(&owner, &id).await {
                    tracing::warn!(job_id = %id, %error, "a job whose caller went away could not be stopped");
                }
            });
        }
    }
}

/// Retargets files and returns the result.
///
/// The format is that of `Accept`, else of the config's `output.format`, else GLB. If it takes longer than the wait,
/// the answer is 202 with the job, which continues.
#[utoipa::path(post, path = "/v1/retarget", tag = "retarget",
    params(("Prefer" = Option<String>, Header, description = "`wait=N` to wait up to N seconds"),
        ("Idempotency-Key" = Option<String>, Header, description = "a unique key of this request, chosen by the client: a repeated request with the same key returns the same job"),
        ("Cache-Control" = Option<String>, Header, description = "`no-cache` to compute it even if results are cached"),
        ("Accept" = Option<String>, Header, description = "media type of the requested format")),
    request_body(description = "the files, or the ids of uploaded ones", content(
        (RetargetForm = "multipart/form-data"), (SuggestionBody = "application/json"))),
    responses((status = 200, description = "the file", content((String = "model/gltf-binary"), (String = "model/gltf+json"),
            (String = "text/plain"), (String = "application/x-npz"), (Object = "application/json")),
            headers(("Job-Id" = String), ("ETag" = String), ("Server-Timing" = String), ("Warnings-Count" = u64), ("Cache-Status" = String),
                ("Content-Disposition" = String))),
        (status = 202, body = JobView, description = "not finished within the wait", headers(("Location" = String), ("Retry-After" = u32)))))]
async fn retarget(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    idempotency_key: IdempotencyKey,
    prefer: Prefer,
    request: Request<Body>,
) -> Result<Response, Problem> {
    let headers = OneShotHeaders::read(&state, request.headers(), idempotency_key).await?;
    let Parts { files, mut new } = if is_media_type(request.headers(), "application/json") {
        Parts::of_assets(JsonBody::<SuggestionBody>::from_request(request, &state).await?.0.read()?)
    } else {
        upload::read_job(request, &state).await?
    };
    headers.apply(&mut new);
    answer(&state, &owner, &prefer, Parts { files, new }).await
}

/// Somebody waits for the answer, so these go before what was left to run by itself.
const AWAITED_PRIORITY: i32 = 10;

/// Runs a job and answers with its first file, or with the job itself when it takes longer than the wait.
pub(in crate::http) async fn answer(
    state: &ApiState,
    owner: &Principal,
    prefer: &Prefer,
    Parts { files, new }: Parts,
) -> Result<Response, Problem> {
    let ApiState { jobs, assets, settings, .. } = state;
    let will_ask_again = new.idempotency_key.is_some();
    let new = NewJob { priority: AWAITED_PRIORITY, ..new };
    let (Submitted { job: JobRecord { id, .. }, is_repeated, quota }, awaiting) =
        assets.submit_awaited(owner, files, new).await?;
    // Who has a word for the request comes back for the answer.
    let stopped = Some(id.clone()).filter(|_| !will_ask_again);
    let mut stop = StopUnlessAnswered { jobs: jobs.clone(), owner: owner.clone(), id: stopped };
    let longest = settings.max_wait.0;
    let awaited = jobs.wait_for_file(owner, &id, awaiting, prefer.wait(settings.default_wait.0, longest)).await?;
    stop.id = None;
    let mut response = match awaited {
        Awaited::File(file) => hand_out(*file),
        Awaited::Job(job) => present(*job, jobs).await.unwrap_or_else(IntoResponse::into_response),
    };
    response.headers_mut().insert("job-id", ascii(id.to_string()));
    response.headers_mut().extend(prefer.applied(longest).into_iter().chain(replayed(is_repeated)));
    response.headers_mut().extend(quota::headers(quota));
    Ok(response)
}

fn hand_out(file: HandedFile) -> Response {
    let HandedFile { record, result, bytes, timings } = file;
    about(&record, &timings, File::from(result).at_hand(bytes))
}

/// The first file of a job, with what there is to say of the job.
fn about(record: &JobRecord, timings: &impl Serialize, mut response: Response) -> Response {
    let headers = response.headers_mut();
    headers.insert("warnings-count", record.warnings.into());
    headers.extend(judgment::headers(record.judgment.as_ref()));
    headers.extend(caching::status(record));
    headers.insert("server-timing", ascii(server_timing(timings)));
    response
}

async fn present(snapshot: JobSnapshot, jobs: &Jobs) -> Result<Response, Problem> {
    let JobSnapshot { record, results, .. } = &snapshot;
    match (record.state, &record.failure) {
        (JobState::Succeeded, _) => {
            let first =
                results.first().cloned().ok_or_else(|| Problem::internal(&"a job succeeded without results"))?;
            let report = jobs.report(&record.principal, &record.id).await?;
            Ok(about(record, &timings_of(&report), File::from(first).whole(jobs).await?))
        }
        (JobState::Failed, Some(failure)) => Err(Problem::of_job(failure)),
        (JobState::Failed, None) => Err(Problem::internal(&"a job failed without a reason")),
        (JobState::Canceled, _) => Err(Problem::new(Code::Canceled, "the job was canceled while it was waited for")),
        (JobState::Queued | JobState::Running | JobState::Canceling, _) => Ok(accepted(snapshot, StatusCode::ACCEPTED)),
    }
}

/// What a report says of how long each phase took.
fn timings_of(report: &str) -> Map<String, Value> {
    #[derive(Deserialize, Default)]
    struct Report {
        #[serde(default)]
        timings: Map<String, Value>,
    }
    serde_json::from_str::<Report>(report).unwrap_or_default().timings
}

/// Timings as a `Server-Timing` header, in milliseconds.
fn server_timing(timings: &impl Serialize) -> String {
    let Ok(Value::Object(timings)) = serde_json::to_value(timings) else { return String::new() };
    let phases = timings.iter().filter_map(|(name, seconds)| {
        let name = name.strip_suffix("_seconds")?;
        Some(format!("{name};dur={:.1}", seconds.as_f64()? * 1e3))
    });
    phases.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timings_become_a_header() {
        let report = r#"{"timings": {"read_seconds": 0.0125, "total_seconds": 1.5}, "counts": {}}"#;
        assert_eq!(server_timing(&timings_of(report)), "read;dur=12.5, total;dur=1500.0", "milliseconds");
        assert_eq!(server_timing(&timings_of("{}")), "", "nothing known");
    }
}
