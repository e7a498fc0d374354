//! `/v1/mapping-suggestions` and `/v1/config-checks`: what a retarget would do, without doing it.

use axum::{
    Json,
    body::Body,
    extract::{FromRequest, Request, State},
};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use utoipa_axum::{router::OpenApiRouter, routes};

use super::{
    new_job::{InputBody, SuggestionBody, config_document, read_inputs},
    retarget::RetargetForm,
};
use crate::{
    engine::{self, NamedBytes},
    http::{
        ApiState,
        auth::Caller,
        code::Code,
        extract::{self, JsonBody},
        problem::Problem,
        upload,
        views::{JobInputView, inputs_view},
    },
    jobs::{Assets, ConfigDocument, InputRole, NewJob, Principal},
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new().routes(routes!(suggest)).routes(routes!(check))
}

/// A config, and the two files that it is for.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewConfigCheck)]
struct CheckBody {
    /// The config.
    #[schema(value_type = Object)]
    config: serde_json::Map<String, serde_json::Value>,
    /// The file with the animation. Without files, only what a config can be wrong about by itself is checked.
    source: Option<InputBody>,
    /// The file with the character that it goes onto; needed when there is a source.
    target: Option<InputBody>,
    /// The source rig in its rest pose.
    source_rest: Option<InputBody>,
    /// The target rig in its rest pose.
    target_rest: Option<InputBody>,
    /// A preset that the config is laid over; only with files.
    preset: Option<String>,
}

/// What a retarget would do.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Proposal)]
pub(super) struct ProposalView {
    /// The files that were looked at; those of a form are kept as assets.
    inputs: std::collections::BTreeMap<&'static str, JobInputView>,
    /// The spec with everything found out filled in: edit it and send it as the `config` of a job. Sent as it is, it gives what
    /// was proposed.
    #[schema(value_type = Object)]
    resolved_spec: serde_json::Value,
    /// `rigs`, `counts`, `roles` (role, source and target joints, confidence, alternatives, reasons), `joints` (for each target
    /// joint its `driver`, `sources` with weights, modes, `ops` that change it later, and the `reason`), `alignment` (what is left
    /// between the rest poses, by joint) and `warnings`.
    #[serde(flatten)]
    #[schema(value_type = Object)]
    proposal: serde_json::Map<String, serde_json::Value>,
}

/// A config that can be used.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = CheckedConfig)]
struct CheckedConfig {
    /// The config as it is understood, defaults and all.
    #[schema(value_type = Object)]
    spec: serde_json::Value,
}

/// What came of checking a config.
#[derive(Debug, Serialize, ToSchema)]
#[serde(untagged)]
#[schema(as = ConfigCheck)]
enum ConfigCheckView {
    /// With two files: what a retarget with it would do.
    Proposal(Box<ProposalView>),
    /// By itself.
    Alone(CheckedConfig),
}

/// Suggests a mapping between two rigs.
///
/// Nothing is retargeted. The answer has the full spec, the confidence of each role on both sides with reasons and
/// alternatives, and for each joint of the target what would drive it, or why nothing does. Either JSON that names
/// uploaded files, or the same multipart form as `POST /v1/retarget`.
#[utoipa::path(post, path = "/v1/mapping-suggestions", tag = "rigs",
    request_body(description = "two files", content(
        (SuggestionBody = "application/json"), (RetargetForm = "multipart/form-data"))),
    responses((status = 200, body = ProposalView, description = "the proposal")))]
async fn suggest(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    request: Request<Body>,
) -> Result<Json<ProposalView>, Problem> {
    let new = read_files(request, &state, &owner).await?;
    propose(&state.assets, &owner, new).await.map(Json)
}

/// Two files and perhaps a config, as a form or as JSON.
pub(super) async fn read_files(request: Request<Body>, state: &ApiState, owner: &Principal) -> Result<NewJob, Problem> {
    if extract::is_media_type(request.headers(), "multipart/form-data") {
        return upload::read_job(request, state).await?.keep(&state.assets, owner).await;
    }
    let JsonBody(body) = JsonBody::<SuggestionBody>::from_request(request, state).await?;
    body.read()
}

/// Checks a config.
///
/// With two files, every name in the config is checked against them and the answer is the same as that of `POST
/// /v1/mapping-suggestions`; without files, the answer is the parsed config. For a config that cannot be used the
/// answer is the problem that a job with it would fail with; `errors` lists all errors, with pointers.
#[utoipa::path(post, path = "/v1/config-checks", operation_id = "check_config", tag = "rigs",
    request_body(description = "a config, and perhaps two files", content(
        (CheckBody = "application/json"), (RetargetForm = "multipart/form-data"))),
    responses((status = 200, body = ConfigCheckView, description = "the config is valid")))]
async fn check(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    request: Request<Body>,
) -> Result<Json<ConfigCheckView>, Problem> {
    let assets = &state.assets;
    let (alone, new) = if extract::is_media_type(request.headers(), "multipart/form-data") {
        let mut form = upload::read_form(request, &state).await?;
        match form.only_config() {
            Some(config) => (Some(config), NewJob::default()),
            None => (None, form.with(&[InputRole::Source, InputRole::Target])?.keep(assets, &owner).await?),
        }
    } else {
        JsonBody::<CheckBody>::from_request(request, &state).await?.0.read()?
    };
    let answer = match alone {
        Some(config) => ConfigCheckView::Alone(CheckedConfig { spec: assets.check_config(&owner, config).await? }),
        None => ConfigCheckView::Proposal(Box::new(propose(assets, &owner, new).await?)),
    };
    Ok(Json(answer))
}

impl CheckBody {
    /// The config by itself, or a job to be proposed.
    fn read(self) -> Result<(Option<ConfigDocument>, NewJob), Problem> {
        let config = config_document(self.config);
        let missing = match (&self.source, &self.target) {
            (Some(_), Some(_)) => None,
            (None, None) if self.source_rest.is_none() && self.target_rest.is_none() && self.preset.is_none() => {
                return Ok((Some(config), NewJob::default()));
            }
            (None, _) => Some("source"),
            (_, None) => Some("target"),
        };
        if let Some(name) = missing {
            let detail = format!("'{name}' is missing: a config is checked against both files, or alone");
            return Err(Problem::new(Code::MissingPart, detail)
                .at(format!("/{name}"), Vec::new())
                .with_hint("name the assets of both, or send the config alone"));
        }
        let inputs = read_inputs([self.source, self.target, self.source_rest, self.target_rest, None])?;
        Ok((None, NewJob { inputs, config: Some(config), preset: self.preset, ..NewJob::default() }))
    }
}

/// What a job would do, with what it would be refused or fail for.
pub(super) async fn validate(assets: &Assets, owner: &Principal, new: NewJob) -> Result<ProposalView, Problem> {
    let config = new.config.as_ref();
    let config = config.map(|config| NamedBytes { name: &config.file_name, bytes: config.text.as_bytes() });
    let is_pose = engine::task_of(config) == engine::TaskKind::Pose;
    let view = propose(assets, owner, new).await?;
    let warnings = view.proposal.get("warnings").and_then(serde_json::Value::as_array);
    // A proposal is also made for files that hold no animation yet; a job needs one.
    let missing = warnings.into_iter().flatten().find(|warning| warning["code"] == "no_animation").filter(|_| !is_pose);
    match missing {
        Some(warning) => Err(Problem::new(Code::NoAnimation, warning["detail"].as_str().unwrap_or_default())),
        None => Ok(view),
    }
}

async fn propose(assets: &Assets, owner: &Principal, new: NewJob) -> Result<ProposalView, Problem> {
    let (request, proposal) = assets.propose(owner, new).await?;
    let serde_json::Value::Object(mut proposal) = proposal else {
        return Err(Problem::internal(&"a proposal is not an object"));
    };
    let resolved_spec = proposal.remove("resolved_spec").unwrap_or_default();
    Ok(ProposalView { inputs: inputs_view(&request), resolved_spec, proposal })
}
