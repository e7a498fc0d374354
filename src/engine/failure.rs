//! Why the engine did not give a result, in the form that users see on every surface.

use std::borrow::Cow;

use serde::Serialize;

use crate::{
    formats::{ErrorKind, FormatError},
    model::Canceled,
    rig::{SpecError, SpecErrorKind, SpecField},
};

/// Why the engine did not give a result.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{detail}")]
#[non_exhaustive]
pub struct Failure {
    /// Stable.
    pub code: FailureCode,
    /// What is wrong, naming the value that was seen.
    pub detail: String,
    /// Which input: `source`, `target`, `source_rest`, `target_rest`, `config`. May be empty.
    pub part: &'static str,
    /// Where in that input. May be empty.
    pub place: String,
    /// What the user can do. May be empty.
    pub hint: String,
    /// Every single thing that is wrong, where there are several or where a JSON pointer can be given.
    pub errors: Vec<FieldError>,
}

/// One thing that is wrong with a document.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct FieldError {
    /// JSON pointer into the document, such as `/source/chains/left_leg/1`.
    pub pointer: String,
    /// Stable code.
    pub code: Cow<'static, str>,
    /// What is wrong.
    pub detail: String,
    /// Names that exist and look like the one that was seen.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub did_you_mean: Vec<String>,
}

named! {
    /// The reasons, each with one code on the wire.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    #[non_exhaustive]
    pub enum FailureCode {
        /// The bytes are of no format that we read.
        UnsupportedFormat = "unsupported_format",
        /// The file needs a feature that we do not have.
        UnsupportedFeature = "unsupported_feature",
        /// The file breaks the rules of its format.
        AssetMalformed = "asset_malformed",
        /// The file asks for more than a limit allows.
        AssetLimitExceeded = "asset_limit_exceeded",
        /// The config is no JSON or YAML.
        MalformedConfig = "malformed_config",
        /// The config has a field that does not exist.
        UnknownField = "unknown_field",
        /// A value of the config is of the wrong type or out of range.
        InvalidValue = "invalid_value",
        /// The config names a joint that the skeleton does not have.
        UnknownJoint = "unknown_joint",
        /// The config names a clip, chain or role that does not exist.
        UnknownName = "unknown_name",
        /// A chain's end is not below its start.
        ChainNotConnected = "chain_not_connected",
        /// A file has no joints to work on.
        SkeletonNotFound = "skeleton_not_found",
        /// A picture shows no figure, or none of the kind that is asked for.
        FigureNotFound = "figure_not_found",
        /// The source has no animation.
        NoAnimation = "no_animation",
        /// Source and target have nothing in common that could be mapped.
        NothingToMap = "nothing_to_map",
        /// `strict` was asked for and there were warnings.
        StrictWarnings = "strict_warnings",
        /// `strict` was asked for and a measure fails.
        StrictMeasures = "strict_measures",
        /// The caller no longer wants it.
        Canceled = "canceled",
        /// The process that the engine worked in died. The engine itself never says so.
        EngineCrashed = "engine_crashed",
        /// A bug of ours.
        Internal = "internal",
    }
}

impl Failure {
    /// A failure with a code and a sentence.
    #[must_use]
    pub fn new(code: FailureCode, detail: impl Into<String>) -> Self {
        Self { code, detail: detail.into(), part: "", place: String::new(), hint: String::new(), errors: Vec::new() }
    }

    /// The same, with what the user can do.
    #[must_use]
    pub fn with_hint(self, hint: impl Into<String>) -> Self {
        Self { hint: hint.into(), ..self }
    }

    /// The same, about one of the inputs.
    #[must_use]
    pub fn in_part(self, part: &'static str) -> Self {
        Self { part, ..self }
    }

    /// The same, with single errors.
    #[must_use]
    pub fn with_errors(self, errors: Vec<FieldError>) -> Self {
        Self { errors, ..self }
    }
}

impl From<FormatError> for Failure {
    fn from(error: FormatError) -> Self {
        let code = match error.kind {
            ErrorKind::UnsupportedFormat => FailureCode::UnsupportedFormat,
            ErrorKind::UnsupportedFeature => FailureCode::UnsupportedFeature,
            ErrorKind::Malformed => FailureCode::AssetMalformed,
            ErrorKind::LimitExceeded { .. } => FailureCode::AssetLimitExceeded,
            ErrorKind::Canceled => FailureCode::Canceled,
        };
        let detail = error.to_string();
        Self { place: error.place, hint: error.hint, ..Self::new(code, detail) }
    }
}

impl From<Canceled> for Failure {
    fn from(canceled: Canceled) -> Self {
        Self::new(FailureCode::Canceled, canceled.to_string())
    }
}

impl From<SpecErrorKind> for FailureCode {
    fn from(kind: SpecErrorKind) -> Self {
        match kind {
            SpecErrorKind::Malformed => Self::MalformedConfig,
            SpecErrorKind::UnknownField => Self::UnknownField,
            SpecErrorKind::InvalidValue => Self::InvalidValue,
            SpecErrorKind::UnknownJoint => Self::UnknownJoint,
            SpecErrorKind::UnknownName => Self::UnknownName,
            SpecErrorKind::ChainNotConnected => Self::ChainNotConnected,
            SpecErrorKind::NoSkeleton => Self::SkeletonNotFound,
            SpecErrorKind::NothingToMap => Self::NothingToMap,
        }
    }
}

impl From<SpecError> for Failure {
    fn from(error: SpecError) -> Self {
        let field = |field: SpecField| FieldError {
            pointer: field.pointer,
            code: field.kind.code().into(),
            detail: field.detail,
            did_you_mean: field.did_you_mean,
        };
        Self::new(error.kind.into(), error.detail)
            .with_hint(error.hint)
            .with_errors(error.fields.into_iter().map(field).collect())
    }
}
