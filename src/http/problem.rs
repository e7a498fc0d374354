//! Problems: what every unsuccessful answer looks like (RFC 9457).

use axum::{
    http::{HeaderValue, header},
    response::{IntoResponse, Response},
};
use serde::Serialize;
use utoipa::ToSchema;

use super::code::Code;
use crate::{
    engine::{Failure, FieldError, nearest},
    jobs::{FailureReason, Full, JobFailure, Refusal, StoredFieldError},
};

/// How long to wait before trying again, in seconds, where nothing better is known.
const RETRY_SECONDS: u32 = 2;

/// A problem on its way out. [`super::layers`] adds what only the request knows and writes the body.
#[derive(Clone, Debug)]
pub struct Problem {
    pub(super) code: Code,
    pub(super) detail: String,
    pub(super) hint: String,
    pub(super) errors: Vec<ProblemError>,
    pub(super) part: Box<str>,
    pub(super) place: Box<str>,
    pub(super) limit: Option<Box<LimitSeen>>,
    /// Whether the pointers of `errors` lead into a JSON body already, and not only into the config in it.
    pub(super) is_in_body: bool,
}

/// The limit that was reached.
#[derive(Clone, Copy, Debug)]
pub(super) struct LimitSeen {
    pub(super) name: &'static str,
    pub(super) maximum: u64,
    pub(super) actual: u64,
}

/// The body of every unsuccessful answer.
#[derive(Clone, Debug, Serialize, ToSchema)]
#[schema(as = Problem)]
pub struct ProblemView {
    /// A page about the code.
    #[serde(rename = "type")]
    #[schema(example = "/problems#queue_full")]
    pub kind: String,
    /// A short sentence, the same for every occurrence.
    pub title: &'static str,
    /// The HTTP status.
    pub status: u16,
    /// The stable code; branch on this.
    #[schema(example = "queue_full")]
    pub code: &'static str,
    /// What is wrong this time.
    pub detail: String,
    /// The path of the request, or of the job.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub instance: String,
    /// What can be done about it.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub hint: String,
    /// Which input is meant: `source`, `target`, `source_rest`, `target_rest`, `config`.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub part: String,
    /// Where in that input.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub place: String,
    /// Every single thing that is wrong.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub errors: Vec<ProblemError>,
    /// The limit that was reached, as in `/v1/limits`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<&'static str>,
    /// Its value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub maximum: Option<u64>,
    /// What was seen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub actual: Option<u64>,
    /// The id of the request, as in the log.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub request_id: String,
    /// Whether the same request can succeed later.
    pub retryable: bool,
}

/// One thing that is wrong with a document.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub struct ProblemError {
    /// JSON pointer to it: into the body where that is JSON, else into the `part`. `?name` is a parameter of the query.
    pub pointer: String,
    /// Stable code.
    pub code: String,
    /// What is wrong.
    pub detail: String,
    /// Names that exist and look like the one that was seen.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub did_you_mean: Vec<String>,
}

impl Problem {
    /// A problem with a code and a sentence.
    #[must_use]
    pub fn new(code: Code, detail: impl Into<String>) -> Self {
        let (part, place) = (Box::default(), Box::default());
        let (detail, hint, errors) = (detail.into(), String::new(), Vec::new());
        Self { code, detail, hint, errors, part, place, limit: None, is_in_body: false }
    }

    /// The same, with what the caller can do.
    #[must_use]
    pub fn with_hint(self, hint: impl Into<String>) -> Self {
        Self { hint: hint.into(), ..self }
    }

    /// The same, with one single error.
    #[must_use]
    pub fn at(mut self, pointer: impl Into<String>, did_you_mean: Vec<String>) -> Self {
        let (code, detail) = (self.code.name().to_owned(), self.detail.clone());
        self.errors.push(ProblemError { pointer: pointer.into(), code, detail, did_you_mean });
        self
    }

    /// The same for a body that is JSON: what is wrong with a config stands in the body below `config`.
    #[must_use]
    pub(super) fn in_body(mut self) -> Self {
        if &*self.part == "config" && !self.is_in_body {
            for error in &mut self.errors {
                error.pointer.insert_str(0, "/config");
            }
        }
        self.is_in_body = true;
        self
    }

    /// The same, about a part of a document that stands in a larger one at that pointer.
    #[must_use]
    pub(super) fn below(self, pointer: &str) -> Self {
        let mut this = self.in_body();
        if this.errors.is_empty() {
            return this.at(pointer, Vec::new());
        }
        for error in &mut this.errors {
            error.pointer.insert_str(0, pointer);
        }
        this
    }

    /// The same, about a limit.
    #[must_use]
    pub fn about_limit(self, name: &'static str, maximum: u64, actual: u64) -> Self {
        Self { limit: Some(Box::new(LimitSeen { name, maximum, actual })), ..self }
    }

    /// A fault of ours. What happened goes to the log, not to the caller.
    pub(super) fn internal(cause: &dyn std::fmt::Display) -> Self {
        tracing::error!(%cause, "a request failed because of a fault");
        Self::new(Code::Internal, "the request failed because of a fault in the service")
            .with_hint("try again; if it happens again, report it with the request_id")
    }

    /// The problem of a job that failed.
    #[must_use]
    pub fn of_job(failure: &JobFailure) -> Self {
        let errors = failure.errors.iter().cloned().map(ProblemError::from).collect();
        Self {
            errors,
            part: failure.part.as_str().into(),
            place: failure.place.as_str().into(),
            ..Self::new(FailureReason::of(failure).into(), failure.detail.clone()).with_hint(failure.hint.clone())
        }
    }

    /// The body, for that path and request.
    #[must_use]
    pub fn view(&self, instance: &str, request_id: &str) -> ProblemView {
        ProblemView {
            kind: format!("/problems#{}", self.code.name()),
            title: self.code.title(),
            status: self.code.status().as_u16(),
            code: self.code.name(),
            detail: self.detail.clone(),
            instance: instance.to_owned(),
            hint: if self.hint.is_empty() { self.code.hint().to_owned() } else { self.hint.clone() },
            part: self.part.to_string(),
            place: self.place.to_string(),
            errors: self.errors.clone(),
            limit: self.limit.as_ref().map(|limit| limit.name),
            maximum: self.limit.as_ref().map(|limit| limit.maximum),
            actual: self.limit.as_ref().map(|limit| limit.actual),
            request_id: request_id.to_owned(),
            retryable: self.code.is_retryable(),
        }
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let mut response = self.code.status().into_response();
        let loaded = matches!(self.code, Code::QueueFull | Code::TooBusy | Code::Draining | Code::Unavailable);
        if loaded || matches!(self.code, Code::InUse | Code::TooManyStreams | Code::QuotaReached) {
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(RETRY_SECONDS));
        }
        response.extensions_mut().insert(Box::new(self));
        response
    }
}

/// Where one finds what there is of a kind.
pub(super) fn where_listed(kind: &str) -> &'static str {
    match kind {
        "asset" => "GET /v1/assets lists the uploaded files; upload it again if it has expired",
        "job" => "GET /v1/jobs lists the jobs",
        "batch" => "GET /v1/batches lists the batches",
        "result" => "GET /v1/jobs/{id} has the results of a job in `results`; run the job again if they have expired",
        "rig" => "GET /v1/rigs lists the rigs",
        "preset" => "GET /v1/presets lists the presets",
        "key" => "GET /v1/keys lists the keys",
        "webhook" => "GET /v1/webhooks lists the webhooks",
        "delivery" => "GET /v1/webhooks/{id}/deliveries lists the deliveries of a webhook",
        _ => "",
    }
}

impl From<StoredFieldError> for ProblemError {
    fn from(error: StoredFieldError) -> Self {
        let StoredFieldError { pointer, code, detail, did_you_mean } = error;
        Self { pointer, code, detail, did_you_mean }
    }
}

impl From<FieldError> for ProblemError {
    fn from(error: FieldError) -> Self {
        let FieldError { pointer, code, detail, did_you_mean } = error;
        Self { pointer, code: code.into_owned(), detail, did_you_mean }
    }
}

impl From<Failure> for Problem {
    fn from(failure: Failure) -> Self {
        let Failure { code, detail, part, place, hint, errors } = failure;
        let errors = errors.into_iter().map(ProblemError::from).collect();
        Self { errors, part: part.into(), place: place.into(), ..Self::new(code.into(), detail).with_hint(hint) }
    }
}

impl From<Refusal> for Problem {
    fn from(refusal: Refusal) -> Self {
        let detail = refusal.to_string();
        match refusal {
            Refusal::NotFound { kind, .. } => Self::new(Code::NotFound, detail).with_hint(where_listed(kind)),
            Refusal::Expired { .. } => Self::new(Code::Expired, detail),
            Refusal::UnknownInput { role, .. } => {
                Self::new(Code::UnknownAsset, detail)
                    .at(format!("/{}/asset", role.name()), Vec::new())
                    .with_hint("GET /v1/assets lists those that there are; POST /v1/assets uploads a file and gives its id")
            }
            Refusal::QueueFull { limit, most, actual } => {
                Self::new(Code::QueueFull, detail).about_limit(limit, most, actual)
            }
            Refusal::QuotaReached { quota, asked } => Self::new(Code::QuotaReached, detail).about_limit(
                "principal_jobs",
                quota.most,
                quota.unfinished + asked,
            ),
            Refusal::BadItem { item, failure } => {
                Self { detail, ..Self::of_job(&failure) }.below(&format!("/items/{item}"))
            }
            Refusal::TooManyStreams { most } => {
                Self::new(Code::TooManyStreams, detail).about_limit("event_streams", most, most + 1)
            }
            Refusal::TooLarge { limit, most, actual, .. } => {
                Self::new(Code::BodyTooLarge, detail).about_limit(limit, most, actual)
            }
            Refusal::DigestMismatch { .. } => Self::new(Code::DigestMismatch, detail),
            Refusal::TooBusy => Self::new(Code::TooBusy, detail),
            Refusal::Draining => Self::new(Code::Draining, detail),
            Refusal::StorageFull(Full::Disk | Full::Reserve { .. }) => Self::new(Code::StorageFull, detail).with_hint(
                "delete assets, or wait until some expire; the operator makes room on the disk, or lowers `reserved_disk`",
            ),
            Refusal::StorageFull(Full::StoredBytes { most, actual }) => {
                Self::new(Code::StorageFull, detail).about_limit("stored_bytes", most, actual)
            }
            Refusal::WrongState { id, state, .. } if state.is_final() => Self::new(Code::NoResults, detail).with_hint(
                format!("GET /v1/jobs/{id} says in 'problem' why; POST /v1/jobs/{id}/retry asks for the same again"),
            ),
            Refusal::WrongState { id, .. } => Self::new(Code::WrongState, detail)
                .with_hint(format!("GET /v1/jobs/{id} with the header 'Prefer: wait=20' waits for its end")),
            Refusal::Quarantined { .. } => Self::new(Code::Quarantined, detail),
            Refusal::InUse(_) => Self::new(Code::InUse, detail).with_hint("wait for the job, or cancel it"),
            Refusal::BuiltIn { .. } => Self::new(Code::BuiltIn, detail).with_hint("store yours under another name"),
            Refusal::Changed { .. } => {
                Self::new(Code::PreconditionFailed, detail).with_hint("fetch it again, and send its ETag as If-Match")
            }
            Refusal::TooManyRecords { limit, most, actual } => {
                Self::new(Code::TooManyRecords, detail).about_limit(limit, most, actual)
            }
            Refusal::TooManyDocuments { limit, most, .. } => Self::new(Code::TooManyDocuments, detail)
                .about_limit(limit, most, most + 1)
                .with_hint("delete some first"),
            Refusal::TooManyKeys { .. } => Self::new(Code::TooManyKeys, detail).with_hint("revoke one first"),
            Refusal::ForbiddenUrl(_) => Self::new(Code::ForbiddenUrl, detail).at("/url", Vec::new()),
            Refusal::UrlInputOff => Self::new(Code::UrlInputOff, detail)
                .with_hint("send the file itself, with 'Content-Type: application/octet-stream'"),
            Refusal::FetchFailed { .. } => Self::new(Code::FetchFailed, detail),
            Refusal::TooManyWebhooks { most } => Self::new(Code::TooManyWebhooks, detail)
                .about_limit("webhooks", most, most + 1)
                .with_hint("delete one first"),
            Refusal::UnknownWebhook { .. } => Self::new(Code::UnknownWebhook, detail)
                .with_hint("GET /v1/webhooks lists them")
                .at("/webhook", Vec::new()),
            Refusal::WebhookDisabled { .. } => {
                Self::new(Code::WebhookDisabled, detail).with_hint("ping it first: if it answers, it is enabled again")
            }
            Refusal::KeyReused { .. } => Self::new(Code::IdempotencyKeyReused, detail),
            Refusal::UnknownPreset { name, known } => {
                let similar = nearest(&name, known.iter().map(String::as_str));
                Self::new(Code::UnknownPreset, detail).with_hint("GET /v1/presets lists them").at("/preset", similar)
            }
            Refusal::Engine(failure) => failure.into(),
            Refusal::Store(error) if error.is_passing() => {
                tracing::error!(%error, "the store does not answer");
                Self::new(Code::Unavailable, "the store does not answer")
            }
            Refusal::Store(error) => Self::internal(&error),
        }
    }
}
