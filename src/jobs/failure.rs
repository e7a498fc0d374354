//! Why a job has no results, as it is kept.

use crate::{
    engine::{Failure, FailureCode, FieldError},
    store::{JobFailure, StoredFieldError},
};

/// Every reason why a job can have failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FailureReason {
    /// The engine said so.
    Engine(FailureCode),
    /// It ran longer than it may.
    JobTimeout,
    /// The process died under it, again and again.
    WorkerCrashed,
    /// Its results found no room.
    StorageFull,
    /// Files or records could not be reached, again and again.
    Unavailable,
    /// It is an item of a batch that names a file that is not there.
    UnknownAsset,
    /// It is an item of a batch that names a preset that is not there.
    UnknownPreset,
    /// It is an item of a batch that names a webhook that is not there.
    UnknownWebhook,
    /// It is an item of a batch on files under which processes died, again and again.
    Quarantined,
    /// Another item of its batch failed before it had started, and the batch was to stop then.
    BatchStopped,
}

impl FailureReason {
    /// Those that are not the engine's.
    pub const OWN: [Self; 9] = [
        Self::JobTimeout,
        Self::WorkerCrashed,
        Self::StorageFull,
        Self::Unavailable,
        Self::UnknownAsset,
        Self::UnknownPreset,
        Self::UnknownWebhook,
        Self::Quarantined,
        Self::BatchStopped,
    ];

    /// The code on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Engine(code) => code.name(),
            Self::JobTimeout => "job_timeout",
            Self::WorkerCrashed => "worker_crashed",
            Self::StorageFull => "storage_full",
            Self::Unavailable => "unavailable",
            Self::UnknownAsset => "unknown_asset",
            Self::UnknownPreset => "unknown_preset",
            Self::UnknownWebhook => "unknown_webhook",
            Self::Quarantined => "quarantined",
            Self::BatchStopped => "batch_stopped",
        }
    }

    /// The reason of a kept failure. A code that this version does not know is one of a bug of ours.
    #[must_use]
    pub fn of(failure: &JobFailure) -> Self {
        Self::OWN
            .into_iter()
            .find(|reason| reason.name() == failure.code)
            .unwrap_or_else(|| Self::Engine(FailureCode::from_name(&failure.code).unwrap_or(FailureCode::Internal)))
    }

    /// A failure for that reason.
    #[must_use]
    pub(super) fn because(self, detail: impl Into<String>, hint: &str) -> JobFailure {
        JobFailure {
            code: self.name().to_owned(),
            detail: detail.into(),
            part: String::new(),
            place: String::new(),
            hint: hint.to_owned(),
            errors: Vec::new(),
        }
    }
}

/// A failure of the engine, as it is kept.
pub(super) fn keep(failure: Failure) -> JobFailure {
    let Failure { code, detail, part, place, hint, errors } = failure;
    let errors = errors
        .into_iter()
        .map(|FieldError { pointer, code, detail, did_you_mean }| StoredFieldError {
            pointer,
            code: code.into_owned(),
            detail,
            did_you_mean,
        })
        .collect();
    JobFailure { code: code.name().to_owned(), detail, part: part.to_owned(), place, hint, errors }
}

/// The failure that was kept so.
pub(super) fn restore(kept: JobFailure) -> Failure {
    const PARTS: [&str; 9] =
        ["source", "target", "source_rest", "target_rest", "config", "preset", "rig", "image", "mask"];
    let JobFailure { code, detail, part, place, hint, errors } = kept;
    let code = FailureCode::from_name(&code).unwrap_or(FailureCode::Internal);
    let errors = errors
        .into_iter()
        .map(|StoredFieldError { pointer, code, detail, did_you_mean }| FieldError {
            pointer,
            code: code.into(),
            detail,
            did_you_mean,
        })
        .collect();
    let part = PARTS.into_iter().find(|known| *known == part).unwrap_or_default();
    Failure { code, detail, part, place, hint, errors }
}

/// What users are told of a bug of ours; the log has the rest.
pub(super) fn internal() -> JobFailure {
    FailureReason::Engine(FailureCode::Internal).because(
        "the job failed because of a fault in the service",
        "try again; if it happens again, report it with the id of the job",
    )
}

/// Why a job has not run whose batch was to stop at the first failure.
pub(super) fn stopped_by_another() -> JobFailure {
    FailureReason::BatchStopped.because(
        "another item of the batch failed before this one had started, and the batch was to stop then",
        "see why the other one failed, then ask for the items again that did not run",
    )
}
