//! `/v1/usage`: what the caller has.

use std::collections::BTreeMap;

use axum::{Json, extract::State};
use serde::Serialize;
use utoipa::ToSchema;
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{
    http::{ApiState, auth::Caller, problem::Problem},
    jobs::{Holdings, JobState, Jobs, Usage},
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new().routes(routes!(usage))
}

/// What a caller has.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Usage)]
struct UsageView {
    /// Who that is.
    #[schema(example = "studio")]
    principal: String,
    /// Jobs that are kept, by their state.
    jobs: BTreeMap<&'static str, u64>,
    /// Uploaded files.
    assets: FilesView,
    /// Files that jobs gave.
    results: FilesView,
    /// Event streams that are open at the process that answers.
    event_streams: u64,
    /// How many unfinished jobs there are and may be; absent where only the queue bounds them.
    #[serde(skip_serializing_if = "Option::is_none")]
    unfinished_jobs: Option<QuotaView>,
}

/// Files together. The same bytes may belong to several.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = FileUsage)]
struct FilesView {
    /// How many.
    count: u64,
    /// Their bytes.
    bytes: u64,
}

/// A quota.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Quota)]
struct QuotaView {
    /// How many there are.
    count: u64,
    /// How many there may be: the limit `principal_jobs`.
    maximum: u64,
}

/// Shows the usage of the caller.
#[utoipa::path(get, path = "/v1/usage", operation_id = "show_usage", tag = "service",
    responses((status = 200, body = UsageView, description = "jobs, files and streams of the caller")))]
async fn usage(State(jobs): State<Jobs>, Caller(owner): Caller) -> Result<Json<UsageView>, Problem> {
    let Usage { holdings, event_streams, quota } = jobs.usage(&owner).await?;
    let Holdings { jobs, assets, asset_bytes, results, result_bytes } = holdings;
    Ok(Json(UsageView {
        principal: owner.to_string(),
        jobs: JobState::ALL.into_iter().map(|state| (state.name(), jobs.get(&state).copied().unwrap_or(0))).collect(),
        assets: FilesView { count: assets, bytes: asset_bytes },
        results: FilesView { count: results, bytes: result_bytes },
        event_streams,
        unfinished_jobs: quota.map(|quota| QuotaView { count: quota.unfinished, maximum: quota.most }),
    }))
}
