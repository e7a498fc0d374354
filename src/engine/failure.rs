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

/// The reasons, each with one code on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum FailureCode {
    /// The bytes are of no format that we read.
    UnsupportedFormat,
    /// The file needs a feature that we do not have.
    UnsupportedFeature,
    /// The file breaks the rules of its format.
    AssetMalformed,
    /// The file asks for more than a limit allows.
    AssetLimitExceeded,
    /// The config is no JSON or YAML.
    MalformedConfig,
    /// The config has a field that does not exist.
    UnknownField,
    /// A value of the config is of the wrong type or out of range.
    InvalidValue,
    /// The config names a joint that the skeleton does not have.
    UnknownJoint,
    /// The config names a clip, chain or role that does not exist.
    UnknownName,
    /// A chain's end is not below its start.
    ChainNotConnected,
    /// A file has no joints to work on.
    SkeletonNotFound,
    /// A picture shows no figure, or none of the kind that is asked for.
    FigureNotFound,
    /// The source has no animation.
    NoAnimation,
    /// Source and target have nothing in common that could be mapped.
    NothingToMap,
    /// `strict` was asked for and there were warnings.
    StrictWarnings,
    /// `strict` was asked for and a measure fails.
    StrictMeasures,
    /// The caller no longer wants it.
    Canceled,
    /// The process that the engine worked in died. The engine itself never says so.
    EngineCrashed,
    /// A bug of ours.
    Internal,
}

impl FailureCode {
    /// All of them.
    pub const ALL: [Self; 19] = [
        Self::UnsupportedFormat,
        Self::UnsupportedFeature,
        Self::AssetMalformed,
        Self::AssetLimitExceeded,
        Self::MalformedConfig,
        Self::UnknownField,
        Self::InvalidValue,
        Self::UnknownJoint,
        Self::UnknownName,
        Self::ChainNotConnected,
        Self::SkeletonNotFound,
        Self::FigureNotFound,
        Self::NoAnimation,
        Self::NothingToMap,
        Self::StrictWarnings,
        Self::StrictMeasures,
        Self::Canceled,
        Self::EngineCrashed,
        Self::Internal,
    ];

    /// The code on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::UnsupportedFormat => "unsupported_format",
            Self::UnsupportedFeature => "unsupported_feature",
            Self::AssetMalformed => "asset_malformed",
            Self::AssetLimitExceeded => "asset_limit_exceeded",
            Self::MalformedConfig => "malformed_config",
            Self::UnknownField => "unknown_field",
            Self::InvalidValue => "invalid_value",
            Self::UnknownJoint => "unknown_joint",
            Self::UnknownName => "unknown_name",
            Self::ChainNotConnected => "chain_not_connected",
            Self::SkeletonNotFound => "skeleton_not_found",
            Self::FigureNotFound => "figure_not_found",
            Self::NoAnimation => "no_animation",
            Self::NothingToMap => "nothing_to_map",
            Self::StrictWarnings => "strict_warnings",
            Self::StrictMeasures => "strict_measures",
            Self::Canceled => "canceled",
            Self::EngineCrashed => "engine_crashed",
            Self::Internal => "internal",
        }
    }

    /// The code of that wire name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|code| code.name() == name)
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
