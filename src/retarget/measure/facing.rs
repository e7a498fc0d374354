//! Where head and chest face, against the source's.

use glam::DVec3;

use super::{
    body::last_joint,
    limbs::{angle, percentile_finding},
    metric::{Finding, Series},
    motion::{Both, Compared, Wanted},
};
use crate::rig::Rig;

const NOT_FOUND: &str = "it was not recognized on both sides";

/// A part of the body with a front.
pub(super) struct Front {
    name: &'static str,
    joint: usize,
    turn: usize,
}

impl Front {
    /// The head.
    pub(super) fn head(rigs: &Both<&Rig<'_>>, wanted: &mut Wanted) -> Option<Self> {
        Self::find("head", "head", rigs, wanted)
    }

    /// The last joint of the spine.
    pub(super) fn chest(rigs: &Both<&Rig<'_>>, wanted: &mut Wanted) -> Option<Self> {
        Self::find("chest", "spine", rigs, wanted)
    }

    fn find(name: &'static str, role: &str, rigs: &Both<&Rig<'_>>, wanted: &mut Wanted) -> Option<Self> {
        let joint = last_joint(rigs, role)?;
        Some(Self { name, joint: joint.target, turn: wanted.turn(joint) })
    }

    /// The angle between the fronts, which are the same where both stand at rest.
    pub(super) fn measure(front: Option<&Self>, compared: &Compared) -> Finding {
        let front = front.ok_or(NOT_FOUND)?;
        let off = |frame: usize| {
            let [source, target] =
                [&compared.source, &compared.target].map(|side| side.turn(frame, front.turn) * DVec3::Z);
            angle(source, target)
        };
        let series =
            Series { part: front.name.to_owned(), joint: front.joint, values: (0..compared.len()).map(off).collect() };
        percentile_finding(&[series], &compared.frames.indices, NOT_FOUND)
    }
}
