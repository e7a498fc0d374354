//! BVH: a hierarchy of offsets and Euler channels, and rows of numbers.
//!
//! The format says nothing about axes, units or a rest rotation: what is read comes out raw, with
//! [`Scene::axes`](crate::model::Scene::axes) and the unit open, and what is written has its rest rotations folded away.
//! Knows no rig convention.

mod angles;
mod bones;
mod hierarchy;
mod motion;
mod scanner;
mod sections;
mod text;
mod tracks;
mod write;

pub(super) use sections::open_in_sections;
pub(super) use write::{BvhSectionWriter, write};

use crate::{
    formats::{Budget, FormatError},
    model::{Clip, Payload, Reporter, Scene, Skeleton},
};

/// Decodes a BVH file. Every End Site becomes a node `<parent>_end` that is no joint.
///
/// # Errors
/// When the file breaks the rules of the format, holds a number that is none, or exceeds the budget; or when the work is
/// canceled. The place is a line of the file.
pub(super) fn read(bytes: &[u8], budget: &mut Budget<'_>, reporter: &mut Reporter) -> Result<Scene, FormatError> {
    let mut scanner = scanner::Scanner::new(bytes);
    let hierarchy = hierarchy::read(&mut scanner, budget, reporter)?;
    let motion = motion::read(&mut scanner, &hierarchy, budget, reporter)?;
    let skeleton = Skeleton::new(hierarchy.joints)
        .map_err(|error| FormatError::malformed("hierarchy", "HIERARCHY", error.to_string()))?;
    let clip = |motion: motion::Motion| {
        Clip::new(String::new(), motion.times_seconds, motion.tracks)
            .map_err(|error| FormatError::malformed("motion", "MOTION", error.to_string()))
    };
    let clips = motion.map(clip).transpose()?.into_iter().collect();
    Ok(Scene { skeleton, clips, axes: None, unit_meters: None, payload: Payload::default(), ..Scene::default() })
}
