//! The rig doctor: what is wrong, odd or worth knowing about a rig and its clips, each with what to do about it.
//!
//! One family of findings per file; [`FindingCode`] is the catalogue, from which the documentation is made. A finding is about
//! the file, a warning ([`crate::model::Warning`]) about what was done with it. Most findings need no mending: the service copes
//! with them, and says that it did.

mod body;
mod catalogue;
mod clips;
mod limbs;
mod names;
mod places;
mod skins;
#[cfg(test)]
mod tests;
mod transforms;

pub use catalogue::{FindingCode, Severity};
pub(crate) use skins::mesh_off_joints;

use super::Rig;
use crate::model::{Scene, Warning};

/// One thing about a file that its owner should know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// What it is.
    pub code: FindingCode,
    /// The joint or clip that it was seen at first; empty where it is about the whole file.
    pub place: String,
    /// What was seen, with numbers.
    pub detail: String,
}

/// What a doctor cannot see in a scene.
#[derive(Clone, Copy, Debug)]
pub struct FileFacts<'a> {
    /// Whether files of that format can hold skinned meshes.
    pub can_have_skins: bool,
    /// What the reader of the file warned of.
    pub warnings: &'a [Warning],
}

/// Examines a rig and the clips of its file. Ordered: errors first, then warnings, then notes; among equals in the order of the
/// catalogue, so that equal files give equal findings.
#[must_use]
pub fn examine(rig: &Rig<'_>, facts: FileFacts<'_>) -> Vec<Finding> {
    let mut found = Vec::new();
    transforms::examine(rig, facts, &mut found);
    names::examine(rig, &mut found);
    skins::examine(rig, facts, &mut found);
    body::examine(rig, &mut found);
    limbs::examine(rig, &mut found);
    clips::examine(rig.scene, &mut found);
    sorted(found)
}

/// Examines the clips of a file that has no rig.
#[must_use]
pub fn examine_clips(scene: &Scene) -> Vec<Finding> {
    let mut found = Vec::new();
    clips::examine(scene, &mut found);
    sorted(found)
}

fn sorted(mut found: Vec<Finding>) -> Vec<Finding> {
    found.sort_by_key(|finding| (finding.code.severity(), finding.code));
    found
}
