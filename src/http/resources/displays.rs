//! Assets and results as plain GLB, for viewers that know nothing else.

use axum::{extract::State, http::HeaderMap, response::Response};
use serde::Deserialize;
use utoipa::IntoParams;
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{
    engine::DisplayOptions,
    http::{
        ApiState,
        auth::Caller,
        extract::{Id, QueryOf},
        layers::Unpacked,
        problem::Problem,
        unchanging::unchanging,
    },
    jobs::{AssetId, Assets, Jobs, Pictured, ResultId},
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new().routes(routes!(of_asset)).routes(routes!(of_result))
}

/// What of a file is wanted.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct DisplayQuery {
    /// The clip that is in it. Default: the first that moves.
    clip: Option<String>,
    /// Whether meshes are in it; without them there are the nodes and the clip. Default true.
    mesh: Option<bool>,
}

/// Gives any file that can be read as a plain GLB.
///
/// In meters, +Y up and +Z front, for viewers that know nothing of other formats, compression and extensions: decoded triangles, or capsules
/// along the bones where there is no mesh; four joints a vertex; materials of one color and one PNG or JPEG of at most 1,024 pixels a side; one
/// clip. The first nodes are those of the file in its order, and `extras.joint` of each is the name by which the API calls it.
/// `extras.retargetd` of the scene has `clips`, `clip`, `key_times_seconds`, `floor_meters`, `front`, `roles` (nodes by role) and `triangles`.
/// What a file looks like never changes: it may be cached for as long as the file is kept.
#[utoipa::path(get, path = "/v1/assets/{id}/display", operation_id = "display_asset", tag = "assets",
    params(("id" = String, Path, description = "the asset"), DisplayQuery,
        ("If-None-Match" = Option<String>, Header, description = "`ETag` of the caller's copy")),
    responses((status = 200, content_type = "model/gltf-binary", body = String, description = "the GLB"),
        (status = 304, description = "not modified")))]
async fn of_asset(
    State(assets): State<Assets>,
    State(jobs): State<Jobs>,
    Caller(owner): Caller,
    Id(id): Id<AssetId>,
    QueryOf(query): QueryOf<DisplayQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    answer(&jobs, assets.get(&owner, &id).await?.into(), query, &headers).await
}

/// Gives a result as a plain GLB.
///
/// As `GET /v1/assets/{id}/display`.
#[utoipa::path(get, path = "/v1/results/{id}/display", operation_id = "display_result", tag = "results",
    params(("id" = String, Path, description = "the result"), DisplayQuery,
        ("If-None-Match" = Option<String>, Header, description = "`ETag` of the caller's copy")),
    responses((status = 200, content_type = "model/gltf-binary", body = String, description = "the GLB"),
        (status = 304, description = "not modified")))]
async fn of_result(
    State(jobs): State<Jobs>,
    Caller(owner): Caller,
    Id(id): Id<ResultId>,
    QueryOf(query): QueryOf<DisplayQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let result = jobs.result(&owner, &id).await?;
    answer(&jobs, Pictured::of_result(owner, result), query, &headers).await
}

async fn answer(jobs: &Jobs, file: Pictured, query: DisplayQuery, headers: &HeaderMap) -> Result<Response, Problem> {
    let options = DisplayOptions { clip: query.clip, mesh: query.mesh.unwrap_or(true) };
    let key = file.key(&options);
    let mut response = unchanging(headers, &key, "model/gltf-binary", jobs.display(&file, options)).await?;
    // Decoded vertices take a fifth on the way.
    response.extensions_mut().insert(Unpacked);
    Ok(response)
}
