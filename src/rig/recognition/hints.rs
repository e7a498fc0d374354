//! What is known of a skeleton beside its names and its rest pose.

use super::recognizer::Recognizer;
use crate::model::Scene;

/// What is known of a skeleton beside its names and its rest pose.
#[derive(Clone, Copy, Debug, Default)]
pub struct Hints<'a> {
    /// Roles that the file itself declares, by the names of `convention` (a VRM humanoid map); they win over names.
    pub declared: &'a [(String, usize)],
    /// The convention that `declared` follows, such as `vrm`.
    pub convention: Option<&'a str>,
    /// What the user taught, and what was recognized before.
    pub recognizer: Recognizer<'a>,
    /// Joints that a viewer does not show, rising; a body of others goes before.
    pub hidden: &'a [usize],
    /// For each joint, whether it belongs to another character, which is not looked at. Empty: no joint does.
    pub excluded: &'a [bool],
}

impl<'a> Hints<'a> {
    /// What a file says itself.
    #[must_use]
    pub fn of(scene: &'a Scene) -> Self {
        Self {
            declared: &scene.declared_roles,
            convention: scene.declared_convention,
            recognizer: Recognizer::default(),
            hidden: &scene.hidden_joints,
            excluded: &[],
        }
    }
}
