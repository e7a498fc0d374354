//! `/v1/keys`: who may come in. For keys with the scope `admin` only.

use std::time::Duration;

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
    http::{
        ApiState,
        code::Code,
        download::ascii,
        extract::{Id, JsonBody, QueryOf},
        problem::Problem,
    },
    jobs::{ApiKeyId, ApiKeyRecord, Keys, NewKey, Principal, Scope},
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new().routes(routes!(create, list)).routes(routes!(revoke))
}

/// A key that is to be made.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewKey)]
struct NewKeyBody {
    /// Who shall have it: up to 64 lower-case letters, digits, `_`, `-` and `.`. All keys of one principal see the same files,
    /// jobs, results, rigs and presets.
    #[schema(example = "studio")]
    principal: String,
    /// What it shall allow: `read` to look, `write` to upload, run and remove, `admin` to make and revoke keys. Left out, `read` and
    /// `write`.
    #[serde(default)]
    #[schema(example = json!(["read", "write"]))]
    scopes: Vec<String>,
    /// After how many seconds it ends: a hundred years at most. Left out, when it is revoked.
    #[schema(minimum = 1, maximum = 3_153_600_000_u64)]
    lifetime_seconds: Option<u64>,
    /// What it is for, for people who read the list: one line of up to 200 letters.
    #[serde(default)]
    #[schema(max_length = 200, pattern = r"^[^\x00-\x1f\x7f-\x9f]*$", example = "render farm, north")]
    note: String,
}

/// A hundred years.
const LONGEST_LIFETIME_SECONDS: u64 = 3_153_600_000;

/// A key, without what is secret.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Key)]
struct KeyView {
    /// What it is called; no secret.
    #[schema(value_type = String)]
    id: ApiKeyId,
    /// Who has it.
    principal: String,
    /// What it allows.
    scopes: Vec<&'static str>,
    /// When it was made.
    #[schema(format = DateTime)]
    created_at: String,
    /// When it ends, where it does by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    expires_at: Option<String>,
    /// When it was last used, to within five minutes; absent where it never was.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    last_used_at: Option<String>,
    /// When it was revoked; it opens nothing since then.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    revoked_at: Option<String>,
    /// What it is for, as it was said when it was made.
    #[serde(skip_serializing_if = "String::is_empty")]
    note: String,
}

/// Which keys are listed.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct KeysQuery {
    /// `true` lists also keys that were revoked or have expired, up to fifty of each principal.
    #[serde(default)]
    all: bool,
}

/// A key that was made.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = CreatedKey)]
struct CreatedKeyView {
    #[serde(flatten)]
    key: KeyView,
    /// The key itself, to be sent as `Authorization: Bearer …`. It is told now and never again.
    #[schema(example = "rtk_01j9z3k8m0q4r6t8v0x2y4a6c8_…")]
    secret: String,
}

/// Keys. There are a few for each principal, so there is one page.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = KeyList)]
struct KeyListView {
    /// The oldest first.
    items: Vec<KeyView>,
}

impl From<ApiKeyRecord> for KeyView {
    fn from(key: ApiKeyRecord) -> Self {
        Self {
            id: key.id,
            principal: key.principal.to_string(),
            scopes: key.scopes.into_iter().map(Scope::name).collect(),
            created_at: key.created_at.to_string(),
            expires_at: key.expires_at.map(|time| time.to_string()),
            last_used_at: key.last_used_at.map(|time| time.to_string()),
            revoked_at: key.revoked_at.map(|time| time.to_string()),
            note: key.note,
        }
    }
}

impl NewKeyBody {
    fn read(self) -> Result<NewKey, Problem> {
        let invalid =
            |detail: String, pointer: String| Problem::new(Code::InvalidValue, detail).at(pointer, Vec::new());
        let principal =
            Principal::parse(&self.principal).map_err(|error| invalid(error.to_string(), "/principal".to_owned()))?;
        let scope = |(place, name): (usize, &String)| {
            Scope::from_name(name).ok_or_else(|| {
                let shown: String = name.chars().take(64).collect();
                invalid(
                    format!("'{shown}' is not a scope; the scopes are read, write and admin"),
                    format!("/scopes/{place}"),
                )
            })
        };
        let scopes: Vec<Scope> = self.scopes.iter().enumerate().map(scope).collect::<Result<_, _>>()?;
        if self.lifetime_seconds.is_some_and(|seconds| !(1..=LONGEST_LIFETIME_SECONDS).contains(&seconds)) {
            let detail = format!("a lifetime is from 1 to {LONGEST_LIFETIME_SECONDS} seconds");
            return Err(invalid(detail, "/lifetime_seconds".to_owned()));
        }
        let note = self.note.trim();
        NewKey::check_note(note).map_err(|detail| invalid(detail, "/note".to_owned()))?;
        let scopes = if scopes.is_empty() { vec![Scope::Read, Scope::Write] } else { scopes };
        let lifetime = self.lifetime_seconds.map(Duration::from_secs);
        Ok(NewKey { principal, scopes, lifetime, note: note.to_owned() })
    }
}

/// Creates a key.
///
/// A principal has at most two valid keys: the one in use and its successor. To rotate, create the second, distribute
/// it, and revoke the first.
#[utoipa::path(post, path = "/v1/keys", operation_id = "create_key", tag = "keys", request_body = NewKeyBody,
    responses((status = 201, body = CreatedKeyView, description = "created; the secret is shown only once", headers(("Location" = String)))))]
async fn create(State(state): State<ApiState>, request: Request<Body>) -> Result<Response, Problem> {
    let JsonBody(body) = JsonBody::<NewKeyBody>::from_request(request, &state).await?;
    let (text, key) = state.keys.create(body.read()?).await?;
    let location = [(header::LOCATION, ascii(format!("/v1/keys/{}", key.id)))];
    let view = CreatedKeyView { key: key.into(), secret: text.reveal().to_owned() };
    Ok((StatusCode::CREATED, location, Json(view)).into_response())
}

/// Lists the keys of all principals.
///
/// Those that open something; with `all=true` also those that were revoked or have expired.
#[utoipa::path(get, path = "/v1/keys", operation_id = "list_keys", tag = "keys", params(KeysQuery),
    responses((status = 200, body = KeyListView, description = "the keys")))]
async fn list(State(keys): State<Keys>, QueryOf(query): QueryOf<KeysQuery>) -> Result<Json<KeyListView>, Problem> {
    Ok(Json(KeyListView { items: keys.list(query.all).await?.into_iter().map(KeyView::from).collect() }))
}

/// Revokes a key.
///
/// Takes effect immediately. The data of its principal stays, and the key stays in the list of all keys.
#[utoipa::path(delete, path = "/v1/keys/{id}", operation_id = "revoke_key", tag = "keys", params(("id" = String, Path, description = "the key, by its id")),
    responses((status = 204, description = "revoked")))]
async fn revoke(State(keys): State<Keys>, Id(id): Id<ApiKeyId>) -> Result<StatusCode, Problem> {
    keys.revoke(&id).await?;
    Ok(StatusCode::NO_CONTENT)
}
