//! Why a spec does not fit.

/// Characters of a detail that are told; nobody reads as many.
const LONGEST_DETAIL: usize = 2000;

/// Why a spec could not be read, or does not fit the two rigs: every single thing that is wrong.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{detail}")]
pub struct SpecError {
    /// The kind of the first thing that is wrong.
    pub kind: SpecErrorKind,
    /// One sentence about it.
    pub detail: String,
    /// What the user can do. May be empty.
    pub hint: String,
    /// All of them, where there are several or a place can be given.
    pub fields: Vec<SpecField>,
}

/// One thing that is wrong with a spec.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SpecField {
    /// JSON pointer into the spec.
    pub pointer: String,
    /// The kind.
    pub kind: SpecErrorKind,
    /// What is wrong, naming the value that was seen.
    pub detail: String,
    /// Names that exist and look like the one that was seen.
    pub did_you_mean: Vec<String>,
}

/// The kinds of things that can be wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpecErrorKind {
    /// No JSON, no YAML, or not an object.
    Malformed,
    /// A field that does not exist.
    UnknownField,
    /// A value of the wrong type or out of range.
    InvalidValue,
    /// A joint that the skeleton does not have.
    UnknownJoint,
    /// A clip, chain or role that does not exist.
    UnknownName,
    /// A chain's end is not below its start.
    ChainNotConnected,
    /// A file without joints.
    NoSkeleton,
    /// Nothing that the two rigs have in common.
    NothingToMap,
}

impl SpecErrorKind {
    /// The code on the wire.
    #[must_use]
    pub const fn code(self) -> &'static str {
        match self {
            Self::Malformed => "malformed_config",
            Self::UnknownField => "unknown_field",
            Self::InvalidValue => "invalid_value",
            Self::UnknownJoint => "unknown_joint",
            Self::UnknownName => "unknown_name",
            Self::ChainNotConnected => "chain_not_connected",
            Self::NoSkeleton => "skeleton_not_found",
            Self::NothingToMap => "nothing_to_map",
        }
    }

    /// Where users find what would be right, when nothing looks like what they wrote.
    const fn where_to_look(self) -> &'static str {
        match self {
            Self::UnknownJoint | Self::ChainNotConnected => {
                "'retargetd inspect FILE --json' and GET /v1/assets/{id}/skeleton list the joints of a file"
            }
            Self::UnknownName => "'retargetd inspect FILE' lists the clips and the roles of a file",
            _ => {
                "GET /docs/reference/config explains every field of a config; GET /v1/schemas/retarget-spec is its JSON Schema"
            }
        }
    }
}

impl SpecError {
    /// One thing that is wrong, without a place.
    #[must_use]
    pub fn new(kind: SpecErrorKind, detail: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { kind, detail: shortened(detail.into()), hint: hint.into(), fields: Vec::new() }
    }

    /// One thing that is wrong.
    #[must_use]
    pub fn from_field(field: SpecField) -> Self {
        let (kind, detail) = (field.kind, field.detail.clone());
        Self::from_fields(vec![field]).unwrap_or_else(|| Self::new(kind, detail, String::new()))
    }

    /// All that is wrong; `None` when nothing is.
    #[must_use]
    pub fn from_fields(fields: Vec<SpecField>) -> Option<Self> {
        let first = fields.first()?;
        let more = if fields.len() > 1 { format!(" (and {} more)", fields.len() - 1) } else { String::new() };
        let place = if first.pointer.is_empty() { String::new() } else { format!("{}: ", first.pointer) };
        let hint = match first.did_you_mean.as_slice() {
            [] => first.kind.where_to_look().to_owned(),
            names => format!("did you mean {}?", names.join(" or ")),
        };
        Some(Self { kind: first.kind, detail: format!("{place}{}{more}", first.detail), hint, fields })
    }
}

impl SpecField {
    /// One thing that is wrong at a place.
    #[must_use]
    pub fn new(kind: SpecErrorKind, pointer: impl Into<String>, detail: impl Into<String>) -> Self {
        Self { pointer: pointer.into(), kind, detail: shortened(detail.into()), did_you_mean: Vec::new() }
    }

    /// The same, with names that exist and look alike.
    #[must_use]
    pub fn with_nearest<'a>(mut self, name: &str, known: impl IntoIterator<Item = &'a str>) -> Self {
        self.did_you_mean = super::nearest::nearest(name, known);
        self
    }
}

/// A detail quotes what it is about, which may be as long as the document.
fn shortened(mut detail: String) -> String {
    if let Some((end, _)) = detail.char_indices().nth(LONGEST_DETAIL) {
        detail.truncate(end);
        detail.push('…');
    }
    detail
}
