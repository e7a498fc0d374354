//! Tails stay above the floor.
//!
//! From the body outward each bone keeps the direction that forward kinematics give it, but is raised about a horizontal axis by as
//! little as brings what moves with it out of the floor. A bone that is raised does not raise the next one: a tail that hangs lower
//! than the floor lies on it.
//!
//! The skin around a joint moves with both bones. Where the outer bone is raised, what lies behind its joint comes down with it, by
//! its share; the inner bone is then raised by as much more, which leaves less to the outer one. A few such rounds leave little.

use crate::retarget::mapping::Ground;
use crate::retarget::stages::stage::Stage;
use std::f64::consts::FRAC_PI_2;

use glam::{DQuat, DVec3};

use crate::{model::Canceled, retarget::ops::schedule::Schedule, rig::TailPoint};

use crate::retarget::stages::{
    posing::{Pose, Posing},
    work::{Change, Changed, Work},
};

/// How often an inner bone is raised for what an outer one leaves in the floor.
const ROUNDS: usize = 4;
/// A point that moves with a joint by more than this is where that joint puts it.
const WHOLLY: f64 = 0.9;

/// Raises tails.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct TailStage {
    pub(in crate::retarget) schedule: Schedule,
    pub(in crate::retarget) tails: Vec<LiftedTail>,
    pub(in crate::retarget) posing: Posing,
    pub(in crate::retarget) ground: Ground,
    /// The joints of all tails in their order.
    pub(in crate::retarget) changed: Vec<Changed>,
}

/// A tail from the body outward.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct LiftedTail {
    /// Slots of its joints, with the points that move with each.
    pub(in crate::retarget) joints: Vec<(usize, Vec<TailPoint>)>,
    /// How far it may be below the floor.
    pub(in crate::retarget) sunk: f64,
}

/// What comes out for one joint at one frame.
#[derive(Clone, Copy, Debug, Default)]
struct Lifted {
    change: Change,
    is_lifted: bool,
}

impl TailStage {
    /// Raises a tail of a frame; `row` is what comes out for its joints, and `higher` is scratch for at least as many.
    fn lift(&self, tail: &LiftedTail, pose: &Pose, alpha: f64, row: &mut [Lifted], higher: &mut [f64]) {
        higher.fill(0.0);
        for _ in 0..ROUNDS {
            // Where the bone before was and is, and how it was turned and is.
            let mut before: Option<[(DVec3, DQuat); 2]> = None;
            let mut is_over = true;
            for (index, (slot, points)) in tail.joints.iter().enumerate() {
                let model = pose.model[*slot];
                let above = self.posing.parent_of(pose, *slot).rotation;
                let (place, above) = before.map_or((model.translation, above), |[was, is]| {
                    let turn = is.1 * was.1.conjugate();
                    (is.0 + turn * (model.translation - was.0), turn * above)
                });
                let floor = self.ground.target_floor - tail.sunk;
                let angle = raise(place, model.rotation, points, self.ground.up, floor + higher[index]);
                let turn = angle.map_or(DQuat::IDENTITY, |(axis, angle)| DQuat::from_axis_angle(axis, angle * alpha));
                let turned = turn * model.rotation;
                let rotation = (above.conjugate() * turned).normalize().as_quat();
                row[index] = Lifted { change: Change { rotation, ..Change::default() }, is_lifted: angle.is_some() };
                before = Some([(model.translation, model.rotation), (place, turned)]);
                let depth =
                    |point: &TailPoint| (floor - (place + turned * point.offset).dot(self.ground.up)) * point.weight;
                let depth = points.iter().filter(|point| point.weight < WHOLLY).map(depth).fold(0.0, f64::max);
                if let Some(inner) = index.checked_sub(1).filter(|_| angle.is_some() && depth > 0.0) {
                    higher[inner] += depth;
                    is_over = false;
                }
            }
            if is_over {
                return;
            }
        }
    }
}

impl Stage for TailStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let width = self.changed.len();
        let init = || (self.posing.pose(), vec![0.0; width]);
        let fill = |(pose, higher): &mut (Pose, Vec<f64>), frame: usize, row: &mut [Lifted]| {
            self.posing.fill(pose, &work.target, frame);
            let alpha = self.schedule.alpha_at(work.moment(frame));
            let mut first = 0;
            for tail in &self.tails {
                let end = first + tail.joints.len();
                self.lift(tail, pose, alpha, &mut row[first..end], higher);
                first = end;
            }
        };
        let rows = work.rows(width, init, fill)?;
        if rows.iter().any(|lifted| lifted.is_lifted) {
            work.write_columns(&self.changed, |frame, index| &rows[frame * width + index].change);
        }
        Ok(())
    }
}

/// The axis and the angle by which a bone has to be raised until its points are at the floor, at most until it points straight up;
/// nothing where they are.
///
/// A point that is `a` above the joint and `b` outward is `a cos θ + b sin θ` above it when turned by θ.
fn raise(place: DVec3, rotation: DQuat, points: &[TailPoint], up: DVec3, floor: f64) -> Option<(DVec3, f64)> {
    let middle = rotation * (points.iter().map(|point| point.offset).sum::<DVec3>() / points.len().max(1) as f64);
    let outward = (middle - up * middle.dot(up)).try_normalize()?;
    let wanted = floor - place.dot(up);
    let (up, outward_of_joint) = (rotation.conjugate() * up, rotation.conjugate() * outward);
    let needed = |point: &TailPoint| {
        let (above, before) = (point.offset.dot(up), point.offset.dot(outward_of_joint));
        let reach = above.hypot(before);
        if before <= 0.0 || above >= wanted || reach <= 0.0 {
            return 0.0;
        }
        before.atan2(above) - (wanted / reach).clamp(-1.0, 1.0).acos()
    };
    let angle = points.iter().map(needed).fold(0.0, f64::max).min(FRAC_PI_2);
    (angle > 0.0).then(|| (outward.cross(rotation * up), angle))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bone_in_the_floor_is_raised_until_it_lies_on_it() {
        let point = TailPoint { offset: DVec3::new(0.3, 0.0, 0.0), weight: 1.0 };
        for degrees in [-10.0_f64, -40.0, -80.0] {
            let (place, rotation) = (DVec3::Y * 0.1, DQuat::from_rotation_z(degrees.to_radians()));
            let angle = raise(place, rotation, &[point], DVec3::Y, 0.0);
            let turn = angle.map_or(DQuat::IDENTITY, |(axis, angle)| DQuat::from_axis_angle(axis, angle));
            let height = (place + turn * rotation * point.offset).y;
            let wanted = (0.1 + 0.3 * degrees.to_radians().sin()).max(0.0);
            assert!((height - wanted).abs() < 1e-9, "{degrees}: the end is at {height} and not at {wanted}");
        }
    }

    #[test]
    fn bones_above_the_floor_stay() {
        let point = TailPoint { offset: DVec3::X, weight: 1.0 };
        assert!(raise(DVec3::Y, DQuat::IDENTITY, &[point], DVec3::Y, 0.0).is_none());
        assert!(raise(DVec3::Y, DQuat::IDENTITY, &[], DVec3::Y, 0.0).is_none(), "nothing is known of it");
    }
}
