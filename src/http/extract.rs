//! Getting typed values out of requests; what does not fit becomes a problem.

use axum::{
    body::Body,
    extract::{FromRequest, FromRequestParts, Path, Query, Request},
    http::{HeaderMap, Uri, header, request::Parts},
};
use serde::de::DeserializeOwned;

pub(super) use super::header_text::text;
use super::{
    ApiState,
    code::Code,
    json_size,
    plain_words::{self, Kind, Misread},
    problem::{Problem, where_listed},
    upload::BodyReader,
};
use crate::{
    engine::{nearest, no_json},
    jobs::{ApiKeyId, AssetId, BatchId, DeliveryId, JobId, JobState, JobVerdict, ResultId, WebhookId},
};

/// An id in the path. What is no id names nothing, so it is not found.
#[derive(Debug)]
pub(super) struct Id<T>(pub(super) T);

/// A kind of id.
pub(super) trait PathId: Sized {
    /// What it is the id of.
    const KIND: &'static str;
    /// What ids of the kind begin with.
    const START: &'static str;

    fn read(text: &str) -> Option<Self>;

    /// What is told of a text that is none.
    fn not_one(text: &str) -> Problem {
        let shown: String = text.chars().take(64).collect();
        let article = if Self::KIND.starts_with('a') { "an" } else { "a" };
        let detail =
            format!("'{shown}' is not the id of {article} {}; one looks like {}01j9…", Self::KIND, Self::START);
        Problem::new(Code::NotFound, detail).with_hint(where_listed(Self::KIND))
    }
}

macro_rules! path_ids {
    ($($id:ty = $kind:literal),+) => {
        $(impl PathId for $id {
            const KIND: &'static str = $kind;
            const START: &'static str = Self::PREFIX;

            fn read(text: &str) -> Option<Self> {
                Self::parse(text).ok()
            }
        })+
    };
}

path_ids!(
    ApiKeyId = "key",
    AssetId = "asset",
    BatchId = "batch",
    DeliveryId = "delivery",
    JobId = "job",
    ResultId = "result",
    WebhookId = "webhook"
);

impl<T: PathId, S: Send + Sync> FromRequestParts<S> for Id<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let Path(text) = Path::<String>::from_request_parts(parts, state).await.map_err(|_| T::not_one("…"))?;
        T::read(&text).map(Self).ok_or_else(|| T::not_one(&text))
    }
}

/// A query.
#[derive(Debug)]
pub(super) struct QueryOf<T>(pub(super) T);

impl<T: DeserializeOwned, S: Send + Sync> FromRequestParts<S> for QueryOf<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        let uri = without_empty(&parts.uri).unwrap_or_else(|| parts.uri.clone());
        let query = Query::<T>::try_from_uri(&uri);
        query.map(|Query(query)| Self(query)).map_err(|error| bad_query(&error.body_text(), &uri))
    }
}

/// The same without parameters that have no value: forms and clients send those that were left out so. Nothing where there is none.
fn without_empty(uri: &Uri) -> Option<Uri> {
    let query = uri.query()?;
    let has_value = |pair: &&str| pair.split_once('=').is_some_and(|(_, value)| !value.is_empty());
    let kept: Vec<&str> = query.split('&').filter(has_value).collect();
    if kept.len() == query.split('&').count() {
        return None;
    }
    Uri::try_from(format!("{}?{}", uri.path(), kept.join("&"))).ok()
}

/// What is wrong with a query: which parameter, what it is, and what it should be.
fn bad_query(message: &str, uri: &Uri) -> Problem {
    let text = message.split_once("query string: ").map_or(message, |(_, text)| text);
    // What a parameter is read as is told behind its name; what is wrong with the query as a whole, without one.
    let is_name = |name: &&str| name.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'_');
    let (name, text) = text.split_once(": ").filter(|(name, _)| is_name(name)).unwrap_or(("", text));
    let Misread { kind, detail, seen, known } = plain_words::misread(text, "the query");
    let given = Query::<Vec<(String, String)>>::try_from_uri(uri).map(|Query(given)| given).unwrap_or_default();
    let value =
        given.iter().find(|(given, _)| given == name).map(|(_, value)| value.chars().take(64).collect::<String>());
    let name = if name.is_empty() { &seen } else { name };
    let detail = match (kind, value) {
        (Kind::InvalidValue, Some(value)) if !detail.contains(&value) || value.is_empty() => {
            format!("'{value}' is not a valid '{name}': {detail}")
        }
        (Kind::InvalidValue, Some(_)) => format!("'{name}': {detail}"),
        _ => detail,
    };
    Problem::new(Code::MalformedRequest, detail)
        .with_hint("GET /docs/api has the parameters of every route")
        .at(format!("?{name}"), nearest(&seen, known.iter().map(String::as_str)))
}

/// The value of a name of a closed set.
pub(super) fn known<T>(
    member: &str,
    name: Option<&str>,
    read: impl Fn(&str) -> Option<T>,
    all: impl Fn() -> String,
) -> Result<Option<T>, Problem> {
    let Some(name) = name else { return Ok(None) };
    let refused = || {
        let all = all();
        let names = all.split(", ");
        let example = names.clone().next().unwrap_or_default().to_owned();
        let mut problem = unusable(member, name, &format!("one of {all}"), &example);
        for error in &mut problem.errors {
            error.did_you_mean = nearest(name, names.clone());
        }
        problem
    };
    read(name).map(Some).ok_or_else(refused)
}

/// The state of jobs that a list is asked for.
pub(super) fn known_job_state(name: Option<&str>) -> Result<Option<JobState>, Problem> {
    known("state", name, JobState::from_name, || JobState::ALL.map(JobState::name).join(", "))
}

/// The verdict that a list is asked for.
pub(super) fn known_verdict(name: Option<&str>) -> Result<Option<JobVerdict>, Problem> {
    known("verdict", name, JobVerdict::from_name, || JobVerdict::ALL.map(JobVerdict::name).join(", "))
}

/// A parameter of a query that says nothing, and a value that would.
pub(super) fn unusable(member: &str, seen: &str, expected: &str, example: &str) -> Problem {
    let shown: String = seen.chars().take(64).collect();
    Problem::new(Code::MalformedRequest, format!("'{shown}' is not a valid '{member}'; it is {expected}"))
        .with_hint(format!("for example ?{member}={example}"))
        .at(format!("?{member}"), Vec::new())
}

/// A JSON body.
#[derive(Debug)]
pub(super) struct JsonBody<T>(pub(super) T);

impl<T: DeserializeOwned> FromRequest<ApiState> for JsonBody<T> {
    type Rejection = Problem;

    async fn from_request(request: Request<Body>, state: &ApiState) -> Result<Self, Problem> {
        if !is_media_type(request.headers(), "application/json") {
            return Err(Problem::new(Code::UnsupportedMediaType, "the body must be application/json")
                .with_hint("send the header 'Content-Type: application/json'"));
        }
        let bytes = BodyReader::new(request, &state.settings).document("the body").await?;
        json_size::check(&bytes, &state.settings)?;
        read_json(&bytes).map(Self)
    }
}

/// Reads JSON; errors point to where they are.
pub(super) fn read_json<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, Problem> {
    read_from(&mut serde_json::Deserializer::from_slice(bytes))
}

/// Reads what is JSON already; errors point to where they are.
pub(super) fn read_value<T: DeserializeOwned>(value: serde_json::Value) -> Result<T, Problem> {
    read_from(value)
}

fn read_from<'de, T: DeserializeOwned>(
    deserializer: impl serde::Deserializer<'de, Error = serde_json::Error>,
) -> Result<T, Problem> {
    serde_path_to_error::deserialize(deserializer).map_err(|error: serde_path_to_error::Error<serde_json::Error>| {
        let pointer = json_pointer(error.path());
        let inner = error.into_inner();
        if !inner.is_data() {
            return Problem::new(Code::MalformedRequest, format!("the body is not JSON: {}", no_json(&inner)))
                .with_hint("send one JSON object; a file goes as multipart/form-data or application/octet-stream");
        }
        let whole = if pointer.is_empty() { "the body" } else { "it" };
        let Misread { kind, detail, seen, known } = plain_words::misread(&inner.to_string(), whole);
        let code = if kind == Kind::UnknownField { Code::UnknownField } else { Code::InvalidValue };
        // What is missing is pointed to where it should be.
        let pointer = if kind == Kind::MissingField { format!("{pointer}/{seen}") } else { pointer };
        let similar = nearest(&seen, known.iter().map(String::as_str));
        Problem::new(code, detail).with_hint(hint_of(&pointer, &similar)).at(pointer, similar)
    })
}

/// What to do about a value of a body: what its member takes, where that is known.
fn hint_of(pointer: &str, similar: &[String]) -> String {
    const FILE: &str =
        "a file is named by the asset that it was uploaded as, {\"asset\": \"ast_…\"}; POST /v1/assets gives its id";
    let member = pointer.rsplit('/').next().unwrap_or_default();
    match (member, similar) {
        (_, [_, ..]) => format!("did you mean {}?", similar.join(" or ")),
        ("source" | "target" | "source_rest" | "target_rest" | "scene" | "rest", _) => FILE.to_owned(),
        ("output", _) => "it lists names of formats, as [\"glb\", \"bvh\"]; GET /v1/formats has all of them".to_owned(),
        ("labels", _) => "labels are names with texts, as {\"shot\": \"012\"}".to_owned(),
        ("", _) => "send one JSON object, in braces; GET /docs/api has the fields of every body".to_owned(),
        _ if pointer.contains("/labels/") => "the text of a label stands in quotes, as {\"shot\": \"012\"}".to_owned(),
        _ => "GET /docs/api has the fields of every body".to_owned(),
    }
}

fn json_pointer(path: &serde_path_to_error::Path) -> String {
    use serde_path_to_error::Segment;
    path.iter().fold(String::new(), |pointer, segment| match segment {
        Segment::Seq { index } => format!("{pointer}/{index}"),
        Segment::Map { key } => format!("{pointer}/{}", key.replace('~', "~0").replace('/', "~1")),
        Segment::Enum { .. } | Segment::Unknown => pointer,
    })
}

/// Whether the content type is that media type, whatever its parameters.
pub(super) fn is_media_type(headers: &HeaderMap, expected: &str) -> bool {
    let media_type = text(headers, &header::CONTENT_TYPE).split(';').next().unwrap_or_default();
    media_type.trim().eq_ignore_ascii_case(expected)
}
