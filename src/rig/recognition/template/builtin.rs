//! The templates that come with the program.

use std::sync::LazyLock;

use super::RigTemplate;

/// Parsed once. The file is part of the program, and a test reads it; were it broken, no rig would have a name.
static TEMPLATES: LazyLock<Vec<RigTemplate>> =
    LazyLock::new(|| serde_json::from_str(include_str!("builtin.json")).unwrap_or_default());

/// The templates that come with the program. Those that say more stand before those that say less: the first that fits names
/// the rig.
#[must_use]
pub fn builtin_templates() -> &'static [RigTemplate] {
    &TEMPLATES
}
