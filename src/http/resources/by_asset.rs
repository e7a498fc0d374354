//! One-shots whose files have been uploaded before: JSON that names assets in place of a form that carries files.

use axum::{
    body::Body,
    extract::{FromRequest, Request},
};
use serde::Deserialize;
use serde_json::{Map, Value};
use utoipa::ToSchema;

use super::new_job::{InputBody, SuggestionBody, config_document, read_inputs};
use crate::{
    http::{
        ApiState,
        extract::{self, JsonBody},
        problem::Problem,
        upload::{self, Parts},
    },
    jobs::{ArrivedFiles, NewJob},
};

/// An edit of an uploaded file.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewEdit)]
pub(in crate::http) struct EditBody {
    /// The file with the animation.
    source: InputBody,
    /// The rig in its rest pose, where the file does not hold it.
    source_rest: Option<InputBody>,
    /// The retarget spec, whose `edit` says what is to be done.
    #[schema(value_type = Option<Object>)]
    config: Option<Map<String, Value>>,
    /// A preset that the config is laid over.
    preset: Option<String>,
}

/// A pose of an uploaded character.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewPose)]
pub(in crate::http) struct PoseBody {
    /// The file with the character.
    target: InputBody,
    /// Another character, whose rest pose it takes.
    source: Option<InputBody>,
    /// The character in its rest pose, where its file does not hold it.
    target_rest: Option<InputBody>,
    /// The other character in its rest pose, where its file does not hold it.
    source_rest: Option<InputBody>,
}

/// Reads a retarget: a form, or JSON that names assets.
///
/// # Errors
/// As [`upload::read_job`], and when the JSON cannot be used.
pub(super) async fn read_retarget(request: Request<Body>, state: &ApiState) -> Result<Parts, Problem> {
    if !is_json(&request) {
        return upload::read_job(request, state).await;
    }
    let JsonBody(body) = JsonBody::<SuggestionBody>::from_request(request, state).await?;
    Ok(of_assets(body.read()?))
}

/// Reads an edit likewise.
///
/// # Errors
/// As [`upload::read_edit`], and when the JSON cannot be used.
pub(super) async fn read_edit(request: Request<Body>, state: &ApiState) -> Result<Parts, Problem> {
    if !is_json(&request) {
        return upload::read_edit(request, state).await;
    }
    let JsonBody(body) = JsonBody::<EditBody>::from_request(request, state).await?;
    let inputs = read_inputs([Some(body.source), None, body.source_rest, None, None])?;
    let config = body.config.map(config_document);
    Ok(of_assets(NewJob { inputs, config, preset: body.preset, ..NewJob::default() }))
}

/// Reads a pose likewise.
///
/// # Errors
/// As [`upload::read_pose`], and when the JSON cannot be used.
pub(super) async fn read_pose(request: Request<Body>, state: &ApiState) -> Result<Parts, Problem> {
    if !is_json(&request) {
        return upload::read_pose(request, state).await;
    }
    let JsonBody(body) = JsonBody::<PoseBody>::from_request(request, state).await?;
    let inputs = read_inputs([body.source, Some(body.target), body.source_rest, body.target_rest, None])?;
    Ok(of_assets(NewJob { inputs, ..NewJob::default() }))
}

fn is_json(request: &Request<Body>) -> bool {
    extract::is_media_type(request.headers(), "application/json")
}

fn of_assets(new: NewJob) -> Parts {
    Parts { files: ArrivedFiles::default(), new }
}
