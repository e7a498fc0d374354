//! Rigs that have a name: which joints they are made of, and what those joints mean.
//!
//! Templates are data. The built-in ones are in `builtin.json`; users add their own in the same shape. A rig is recognized
//! by a template when enough of the joints that it expects are there; then the template says what their names mean, before
//! the lexicon does.

mod builtin;
mod check;
mod find;
mod learn;

use std::{collections::BTreeMap, sync::OnceLock};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::RigKind;

pub use builtin::builtin_templates;
pub use check::parse_template;
pub(super) use find::{TemplateMatch, find};

/// The share of expected joints that must be there, where a template does not say.
const ENOUGH: f64 = 0.75;

/// A rig that has a name: which joints it is made of, and what they mean.
///
/// Names are compared without upper case, separators (spaces, dots, dashes, underscores) and namespaces. In a name, `*` stands
/// for any text, `|` separates spellings of which one is there, and `{side}` stands for the words in `sides`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RigTemplate {
    /// What the rig is called: lower-case letters, digits, `_` and `-`.
    #[schemars(regex(pattern = r"^[a-z0-9][a-z0-9_-]{0,63}$"))]
    pub name: String,
    /// The same for people to read.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub title: String,
    /// What kind of body it is.
    pub kind: RigKind,
    /// One of these goes before every joint's name; a number may follow it (`mixamorig7:Hips`). The empty text is a prefix,
    /// too. Default: names have no prefix.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub prefixes: Vec<String>,
    /// What `{side}` stands for: spellings of left, then spellings of right.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sides: Option<[Vec<String>; 2]>,
    /// Joint names by role, from the body outward. A role of both sides (`forearm`) goes without its side where its names
    /// hold `{side}`; else it is said for each side (`left_forearm`). Joints that a rig lacks are passed over.
    pub roles: BTreeMap<String, Vec<String>>,
    /// The joints that a rig must have for the most part. Default: the first joint of every role.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub expected: Vec<String>,
    /// Joints that tell the rig from others of like names: all of them must be there. Not asked for where a prefix from
    /// `prefixes` is there, which tells enough.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub required: Vec<String>,
    /// Joints that tell other rigs from this one: none of them may be there. Not asked for where a prefix is there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub excluded: Vec<String>,
    /// The share of `expected` that must be there.
    #[serde(default = "enough", skip_serializing_if = "is_enough")]
    #[schemars(range(min = 0.25, max = 1.0))]
    pub at_least: f64,
}

const fn enough() -> f64 {
    ENOUGH
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for it; the default itself is meant")]
fn is_enough(share: &f64) -> bool {
    *share == ENOUGH
}

/// The JSON Schema of [`RigTemplate`], from its doc comments. It is made once.
#[must_use]
pub fn template_schema() -> &'static serde_json::Value {
    static SCHEMA: OnceLock<serde_json::Value> = OnceLock::new();
    SCHEMA.get_or_init(|| schemars::schema_for!(RigTemplate).to_value())
}

#[cfg(test)]
mod tests;
