//! Every problem that the service can answer with, in one closed table.
//!
//! A code never changes its meaning or its status. To add one, add a row and render `openapi/problems.md` again with
//! `retargetd openapi --problems`; a test compares the two.

use axum::http::StatusCode;

use crate::{engine::FailureCode, jobs::FailureReason};

macro_rules! codes {
    ($( $variant:ident = $name:literal, $status:ident, $retryable:literal, $title:literal, $help:literal; )+) => {
        /// The codes.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Code { $( #[doc = $help] $variant, )+ }

        impl Code {
            /// All of them.
            pub const ALL: &'static [Self] = &[$( Self::$variant, )+];

            /// The code on the wire.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $( Self::$variant => $name, )+ }
            }

            /// The one of a name; a name that is none is a bug of ours.
            fn from_name(name: &str) -> Self {
                Self::ALL.iter().copied().find(|code| code.name() == name).unwrap_or(Self::Internal)
            }

            /// The HTTP status that it comes with.
            #[must_use]
            pub const fn status(self) -> StatusCode {
                match self { $( Self::$variant => StatusCode::$status, )+ }
            }

            /// Whether the same request can succeed later.
            #[must_use]
            pub const fn is_retryable(self) -> bool {
                match self { $( Self::$variant => $retryable, )+ }
            }

            /// A short sentence, the same for every occurrence.
            #[must_use]
            pub const fn title(self) -> &'static str {
                match self { $( Self::$variant => $title, )+ }
            }

            /// What can be done, where nothing better is known of the one occurrence.
            #[must_use]
            pub const fn hint(self) -> &'static str {
                self.help()
            }

            /// What it means and what to do.
            #[must_use]
            pub const fn help(self) -> &'static str {
                match self { $( Self::$variant => $help, )+ }
            }
        }
    };
}

codes! {
    MalformedRequest = "malformed_request", BAD_REQUEST, false, "The request cannot be read",
        "The body, the query or a header breaks the rules of its format. The detail says where.";
    UnknownField = "unknown_field", UNPROCESSABLE_ENTITY, false, "A field does not exist",
        "A document has a field that does not exist. `errors` has a pointer to each and the nearest known names.";
    InvalidValue = "invalid_value", UNPROCESSABLE_ENTITY, false, "A value cannot be used",
        "A value is of the wrong type or out of its range. `errors` has a pointer to each.";
    UnknownPart = "unknown_part", UNPROCESSABLE_ENTITY, false, "A multipart part does not exist",
        "The parts are `source`, `target`, `source_rest`, `target_rest`, `config` and `preset`, each at most once.";
    RepeatedPart = "repeated_part", UNPROCESSABLE_ENTITY, false, "A multipart part was sent twice",
        "Each part is sent once at most. The detail names the one that came again.";
    MissingPart = "missing_part", UNPROCESSABLE_ENTITY, false, "A part is missing",
        "`source` and `target` must both be sent.";
    DigestMismatch = "digest_mismatch", BAD_REQUEST, true, "The digest does not match the bytes",
        "The digest in `Content-Digest` or `Repr-Digest` differs from that of the received bytes. Nothing was stored; send the request again.";
    Unauthenticated = "unauthenticated", UNAUTHORIZED, false, "Authentication is required",
        "Send the header `Authorization: Bearer rtk_…` with a valid key, or with a token if the service accepts tokens. The operator creates keys with `retargetd keys create`.";
    TokenExpired = "token_expired", UNAUTHORIZED, false, "The token has expired",
        "Get a fresh token from the identity provider and send the request again with it.";
    TokenRefused = "token_refused", UNAUTHORIZED, false, "The token was refused",
        "The detail says why: its signature, its issuer, its audience, or a missing claim. The operator's settings `token_…` define what is required.";
    Forbidden = "forbidden", FORBIDDEN, false, "The key or token does not allow this",
        "The detail names the scope that is needed: `read` to read, `write` to upload, run and delete, `admin` to manage keys.";
    ForeignPage = "foreign_page", FORBIDDEN, false, "The request comes from a foreign page",
        "Without authentication, `Host` must be an address, `localhost` or a name in the setting `allowed_hosts`, and `Origin` the service itself or one of `cors_origins`: otherwise any web page could use the service through a browser.";
    TooManyKeys = "too_many_keys", CONFLICT, false, "The principal already has two keys",
        "Two keys allow rotation: one in use and its successor. Revoke one, then create another.";
    NotFound = "not_found", NOT_FOUND, false, "There is nothing here",
        "Neither a route nor a resource is known by that name. Check it; lists such as `GET /v1/jobs` have what is there. What has expired long ago is not found either.";
    Expired = "expired", GONE, false, "It has expired",
        "It was available until its `expires_at`. Upload the file or run the job again.";
    MethodNotAllowed = "method_not_allowed", METHOD_NOT_ALLOWED, false, "The method is not allowed here",
        "The `Allow` header lists the methods of this route.";
    NotAcceptable = "not_acceptable", NOT_ACCEPTABLE, false, "No format matches the Accept header",
        "`GET /v1/formats` lists the media types that can be written.";
    UploadTooSlow = "upload_too_slow", REQUEST_TIMEOUT, true, "The upload took too long",
        "The upload paused or took longer than a limit allows. Nothing was stored; send it again.";
    InUse = "in_use", CONFLICT, true, "It is in use",
        "An unfinished job needs the file. Wait for the job or cancel it, then try again.";
    WrongState = "wrong_state", CONFLICT, true, "The state does not allow it",
        "The job has not ended yet. The detail names its state. `Prefer: wait=20` on `GET /v1/jobs/{id}` waits for its end.";
    NoResults = "no_results", CONFLICT, false, "The job has ended without results",
        "It failed or was canceled, so there is no report and no config of it. `GET /v1/jobs/{id}` says why in `problem`; `POST /v1/jobs/{id}/retry` asks for the same again.";
    BodyTooLarge = "body_too_large", PAYLOAD_TOO_LARGE, false, "The body is too large",
        "`limit` names the limit, `maximum` is its value, `actual` the size found. `GET /v1/limits` lists all limits.";
    RangeNotSatisfiable = "range_not_satisfiable", RANGE_NOT_SATISFIABLE, false, "The range lies outside the file",
        "`Content-Range` says how many bytes there are. Ask for some of those, or leave `Range` out.";
    UnsupportedMediaType = "unsupported_media_type", UNSUPPORTED_MEDIA_TYPE, false, "The body is of the wrong type",
        "The detail lists the content types that the route accepts.";
    UnsupportedFormat = "unsupported_format", UNSUPPORTED_MEDIA_TYPE, false, "The file format is not known",
        "The content decides, not the name. `GET /v1/formats` lists the readable formats.";
    UnsupportedFeature = "unsupported_feature", UNPROCESSABLE_ENTITY, false, "The file needs a feature that is not supported",
        "The detail names the feature. Export the file without it.";
    AssetMalformed = "asset_malformed", UNPROCESSABLE_ENTITY, false, "The file breaks the rules of its format",
        "`place` says where in the file. Check that the export was complete.";
    AssetLimitExceeded = "asset_limit_exceeded", UNPROCESSABLE_ENTITY, false, "The file exceeds a limit",
        "The detail names the limit. `GET /v1/limits` lists all limits.";
    MalformedConfig = "malformed_config", UNPROCESSABLE_ENTITY, false, "The config cannot be read",
        "The retarget config is neither JSON nor YAML nor a supported config of another tool.";
    UnknownJoint = "unknown_joint", UNPROCESSABLE_ENTITY, false, "A joint does not exist",
        "The config names a joint that the skeleton does not have. `errors` has the nearest names.";
    UnknownName = "unknown_name", UNPROCESSABLE_ENTITY, false, "A name does not exist",
        "The config names a clip, a chain or a role that does not exist. `errors` has the nearest names.";
    ChainNotConnected = "chain_not_connected", UNPROCESSABLE_ENTITY, false, "A chain is not connected",
        "The end of a chain must lie below its start. Name two joints of one branch, the upper one first.";
    SkeletonNotFound = "skeleton_not_found", UNPROCESSABLE_ENTITY, false, "The file has no skeleton",
        "There are no joints to work on. Export the file with its skeleton.";
    FigureNotFound = "figure_not_found", UNPROCESSABLE_ENTITY, false, "The picture shows no figure of the kind",
        "Nothing that is drawn is large enough and in one piece, or it is another kind of body than the `rig` that was asked for. The detail says what was seen; another `rig` or a `mask` may do.";
    NoAnimation = "no_animation", UNPROCESSABLE_ENTITY, false, "The source has no animation",
        "Send a source file that has a clip.";
    NothingToMap = "nothing_to_map", UNPROCESSABLE_ENTITY, false, "Source and target have nothing in common",
        "Name the chains of both rigs in the config.";
    StrictWarnings = "strict_warnings", UNPROCESSABLE_ENTITY, false, "There were warnings, and strict was asked for",
        "`errors` lists the warnings. Mend what they tell of, or leave `strict` out.";
    StrictMeasures = "strict_measures", UNPROCESSABLE_ENTITY, false, "A measure fails, and strict was asked for",
        "`errors` lists the measures that fail. The report of the same job without `strict` shows where.";
    UnknownAsset = "unknown_asset", UNPROCESSABLE_ENTITY, false, "An asset does not exist",
        "The job names an asset that is not there, or no longer. Upload the file again; the same bytes get the same id while they are kept.";
    UnknownPreset = "unknown_preset", UNPROCESSABLE_ENTITY, false, "A preset does not exist",
        "The request names a preset that does not exist. `GET /v1/presets` lists them; `errors` has similar names.";
    BuiltIn = "built_in", CONFLICT, false, "It is built in",
        "Built-in rigs and presets cannot be changed or deleted. Store yours under another name.";
    PreconditionFailed = "precondition_failed", PRECONDITION_FAILED, false, "A precondition failed",
        "`If-Match` or `If-None-Match` does not hold: the resource has been changed. Fetch it again and repeat the change.";
    TooManyDocuments = "too_many_documents", CONFLICT, false, "The maximum number is reached",
        "`limit` names the limit: `stored_documents`, or `document_versions`, which counts versions that stored jobs may refer to. Delete unused rigs or presets, or ask the operator to raise it.";
    ForbiddenUrl = "forbidden_url", UNPROCESSABLE_ENTITY, false, "The URL is not allowed",
        "URLs must be `https` without user and password and resolve to public addresses; the operator can allow other networks with `--outbound-allow`.";
    UrlInputOff = "url_input_off", FORBIDDEN, false, "Fetching files by URL is off",
        "A JSON body of `POST /v1/assets` names a URL, which the operator has not enabled (`--url-input on`). Send the file itself.";
    FetchFailed = "fetch_failed", BAD_GATEWAY, true, "The file cannot be fetched",
        "The server did not answer with a file within `url_input_timeout`, or redirected more than three times. The detail says what happened.";
    TooManyWebhooks = "too_many_webhooks", CONFLICT, false, "The maximum number of webhooks is reached",
        "The limit is `webhooks`, per principal. Delete an unused one.";
    UnknownWebhook = "unknown_webhook", UNPROCESSABLE_ENTITY, false, "A webhook does not exist",
        "The job names a webhook that does not exist. `GET /v1/webhooks` lists them.";
    WebhookDisabled = "webhook_disabled", CONFLICT, false, "The webhook is disabled",
        "Its receiver answered 410 or has failed for too long. `POST /v1/webhooks/{id}/ping` enables it again if the receiver answers.";
    IdempotencyKeyReused = "idempotency_key_reused", UNPROCESSABLE_ENTITY, false, "The Idempotency-Key was used for another request",
        "A key identifies one request, whatever its outcome. Use a new key for another request. The detail names the earlier job.";
    Quarantined = "quarantined", UNPROCESSABLE_ENTITY, true, "These files have crashed workers",
        "Jobs on the same files have repeatedly crashed the process that ran them. The detail says until when they are refused.";
    QueueFull = "queue_full", TOO_MANY_REQUESTS, true, "The queue is full",
        "Wait for the time given in `Retry-After`, then send the request again.";
    TooManyRecords = "too_many_records", TOO_MANY_REQUESTS, true, "There is no room for more records",
        "`limit` names the limit. Finished jobs are removed first, oldest first; the remaining ones are unfinished. Wait until jobs finish, or cancel some.";
    QuotaReached = "quota_reached", TOO_MANY_REQUESTS, true, "The maximum number of unfinished jobs is reached",
        "The limit is `principal_jobs`, per principal. Wait for jobs to finish, or cancel some; `GET /v1/usage` counts them.";
    TooManyStreams = "too_many_streams", TOO_MANY_REQUESTS, true, "Too many event streams are open",
        "The limit is `event_streams`. One stream of `GET /v1/events` has the events of all jobs; close unused streams.";
    TooBusy = "too_busy", SERVICE_UNAVAILABLE, true, "Too many concurrent requests",
        "Wait for the time given in `Retry-After`, then send the request again.";
    Draining = "draining", SERVICE_UNAVAILABLE, true, "The service is shutting down",
        "Send the request again; another instance or the restarted service will accept it.";
    Unavailable = "unavailable", SERVICE_UNAVAILABLE, true, "The service is not ready",
        "A dependency of the service does not answer. The log has the reason for the operator.";
    StorageFull = "storage_full", INSUFFICIENT_STORAGE, true, "There is no room for more files",
        "Delete assets or wait until some expire; the operator can raise `stored_bytes`.";
    JobTimeout = "job_timeout", GATEWAY_TIMEOUT, false, "The job took too long",
        "The limit is `job_timeout`. Send fewer frames, or ask the operator to raise it.";
    WorkerCrashed = "worker_crashed", INTERNAL_SERVER_ERROR, false, "The worker crashed during the job",
        "It happened several times with this job, so there are no further attempts. Report it with the job id.";
    Canceled = "canceled", CONFLICT, false, "The job was canceled",
        "The job was canceled on request. `POST /v1/jobs/{id}/retry` runs it again.";
    BatchStopped = "batch_stopped", CONFLICT, false, "Another item of the batch failed",
        "The batch has `on_error` `stop`, and this item had not started. `POST /v1/batches/{id}/retry-failed` runs it again.";
    EngineCrashed = "engine_crashed", INTERNAL_SERVER_ERROR, false, "The files crashed the engine",
        "The process that worked on these files died; nothing else was affected. The detail says how. If possible, report it with the files.";
    Internal = "internal", INTERNAL_SERVER_ERROR, true, "An error in the service",
        "Report it with the `request_id` and, if there is one, the job id.";
}

/// A failure has one name on every surface.
impl From<FailureCode> for Code {
    fn from(failure: FailureCode) -> Self {
        Self::from_name(failure.name())
    }
}

impl From<FailureReason> for Code {
    fn from(reason: FailureReason) -> Self {
        Self::from_name(reason.name())
    }
}

/// The table as a page for people.
#[must_use]
pub fn problems_page() -> String {
    let mut page = String::from(
        "# Problems\n\nEvery unsuccessful answer is an RFC 9457 problem (`application/problem+json`) with one of these \
         codes. A code\nnever changes its meaning. Made from `src/http/code.rs`; a test keeps it in step.\n\n\
         | code | status | try again | title | what it means and what to do |\n|---|---|---|---|---|\n",
    );
    for code in Code::ALL {
        let again = if code.is_retryable() { "yes" } else { "no" };
        let (name, status, title, help) = (code.name(), code.status().as_u16(), code.title(), code.help());
        page.push_str(&format!("| `{name}` | {status} | {again} | {title} | {help} |\n"));
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_of_failures_keep_their_names() {
        for failure in FailureCode::ALL {
            assert_eq!(Code::from(failure).name(), failure.name(), "one name on every surface");
        }
        for reason in FailureReason::OWN {
            assert_eq!(Code::from(reason).name(), reason.name(), "likewise");
        }
    }

    #[test]
    fn names_are_unique_and_every_status_is_an_error() {
        let mut names: Vec<_> = Code::ALL.iter().map(|code| code.name()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), Code::ALL.len(), "unique");
        assert!(Code::ALL.iter().all(|code| code.status().as_u16() >= 400), "errors");
    }
}
