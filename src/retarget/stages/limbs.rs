//! What stages know of a limb beforehand.

use crate::retarget::mapping::{Ground, LimbPair};
use glam::{DQuat, DVec3};

use crate::model::rotation::signed_angle;

use crate::{
    model::Transform,
    rig::{Limb, LimbJoints},
};

use super::{
    posing::{Pose, Posing},
    two_bone::arc,
};

/// A limb that is bent by less than this at rest does not say about which axis it bends; sine.
const MIN_REST_BEND: f64 = 0.17;

/// Slots of a limb in a posing.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct LimbSlots {
    pub(in crate::retarget) start: usize,
    pub(in crate::retarget) middle: usize,
    pub(in crate::retarget) end: usize,
}

impl LimbSlots {
    pub(in crate::retarget) fn new(joints: &LimbJoints, posing: &Posing) -> Self {
        let slot = |joint| posing.slot(joint);
        Self { start: slot(joints.start), middle: slot(joints.middle), end: slot(joints.end) }
    }

    pub(in crate::retarget) fn places(&self, pose: &Pose) -> [DVec3; 3] {
        [self.start, self.middle, self.end].map(|slot| pose.model[slot].translation)
    }
}

/// What the rest poses say of a limb.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct LimbRest {
    /// Target length over source length.
    pub(in crate::retarget) length_ratio: f64,
    /// Length of the target's limb.
    pub(in crate::retarget) length: f64,
    /// The axis about which the lower bone bends, in the axes of the target's start joint.
    pub(in crate::retarget) hinge: DVec3,
    /// `S0⁻¹ · T0` of the end joints.
    pub(in crate::retarget) target_from_source_end: DQuat,
    /// From the source's pole to the target's at rest, about the line from start to end; 0 where one is straight.
    pub(in crate::retarget) pole_angle: f64,
}

impl LimbRest {
    /// From the rest poses that motion is measured from and put onto, in plan space.
    pub(in crate::retarget) fn new(
        pair: &LimbPair,
        source: &[Transform],
        target: &[Transform],
        ground: &Ground,
    ) -> Self {
        let places = |joints: &LimbJoints, rest: &[Transform]| {
            [joints.start, joints.middle, joints.end].map(|joint| rest[joint].translation)
        };
        let (source_places, target_places) = (places(&pair.source, source), places(&pair.target, target));
        let length = |[start, middle, end]: [DVec3; 3]| start.distance(middle) + middle.distance(end);
        let hinge = hinge(pair.limb, target_places, ground);
        Self {
            length_ratio: length(target_places) / length(source_places),
            length: length(target_places),
            hinge: target[pair.target.start].rotation.conjugate() * hinge,
            target_from_source_end: source[pair.source.end].rotation.conjugate() * target[pair.target.end].rotation,
            pole_angle: pole_angle(source_places, target_places),
        }
    }
}

/// Bent limbs say themselves how they bend; straight knees bend backward, straight elbows forward.
fn hinge(limb: Limb, [start, middle, end]: [DVec3; 3], ground: &Ground) -> DVec3 {
    let (upper, lower) = ((middle - start).normalize_or_zero(), (end - middle).normalize_or_zero());
    let normal = upper.cross(lower);
    if normal.length() > MIN_REST_BEND {
        return normal.normalize();
    }
    let toward = if limb.is_leg() { -ground.front } else { ground.front };
    let hinge = upper.cross(toward);
    hinge.try_normalize().unwrap_or_else(|| upper.cross(ground.up).normalize_or(DVec3::X))
}

fn pole_angle(source: [DVec3; 3], target: [DVec3; 3]) -> f64 {
    let pole = |[start, middle, end]: [DVec3; 3]| {
        let line = (end - start).try_normalize()?;
        let bent = middle - start;
        let off = bent - line * bent.dot(line);
        (off.length() > MIN_REST_BEND / 2.0 * bent.length()).then_some((line, off))
    };
    let (Some((source_line, source_pole)), Some((line, target_pole))) = (pole(source), pole(target)) else {
        return 0.0;
    };
    signed_angle(arc(source_line, line, source_pole) * source_pole, target_pole, line)
}
