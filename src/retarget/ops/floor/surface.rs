//! How low a part of the body is: balls that are fixed to joints.

use glam::DVec3;

use crate::{model::Transform, retarget::stages::posing::Posing, rig::Anchor};

/// Balls that are fixed to joints, as far outside as the body reaches there.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct Surface {
    pub(super) posing: Posing,
    balls: Vec<(usize, DVec3, f64)>,
}

impl Surface {
    /// `posing` gives the pose of joints.
    pub(in crate::retarget) fn new(ends: &[(Anchor, f64)], posing: impl Fn(&[usize]) -> Posing) -> Self {
        let posing = posing(&ends.iter().map(|(anchor, _)| anchor.joint).collect::<Vec<usize>>());
        let ball = |(anchor, radius): &(Anchor, f64)| (posing.slot(anchor.joint), anchor.offset, *radius);
        Self { balls: ends.iter().map(ball).collect(), posing }
    }

    /// The height of the lowest point in a pose of all joints.
    pub(in crate::retarget) fn lowest_of(&self, model: &[Transform], up: DVec3) -> f64 {
        self.lowest(|slot| &model[self.posing.joint(slot)], up)
    }

    /// How far from a place its points are at most in a pose of all joints.
    pub(super) fn farthest_of(&self, model: &[Transform], place: DVec3) -> f64 {
        let distance = |(slot, offset, radius): &(usize, DVec3, f64)| {
            let joint = &model[self.posing.joint(*slot)];
            (joint.translation + joint.rotation * *offset).distance(place) + radius
        };
        self.balls.iter().map(distance).fold(0.0, f64::max)
    }

    /// Whether it is as thick as bodies usually are, since no mesh says how thick it is.
    pub(super) fn is_guessed(&self) -> bool {
        self.balls.iter().any(|(_, _, radius)| *radius > 0.0)
    }

    /// The height of the lowest point, of joints by slot.
    pub(super) fn lowest<'p>(&self, joint: impl Fn(usize) -> &'p Transform, up: DVec3) -> f64 {
        let height = |(slot, offset, radius): &(usize, DVec3, f64)| {
            let joint = joint(*slot);
            (joint.translation + joint.rotation * *offset).dot(up) - radius
        };
        self.balls.iter().map(height).fold(f64::INFINITY, f64::min)
    }
}
