//! Tails stay above the floor.
//!
//! From the body outward each bone keeps the direction that forward kinematics give it, but is raised about a horizontal axis by as
//! little as brings what moves with it out of the floor. A bone that is raised does not raise the next one: a tail that hangs lower
//! than the floor lies on it.

use std::f64::consts::FRAC_PI_2;

use glam::{DQuat, DVec3};

use crate::{
    model::Canceled,
    rig::{Ground, Schedule},
};

use super::{
    posing::{Pose, Posing},
    work::{Change, Changed, Work},
};

/// Raises tails.
#[derive(Clone, Debug)]
pub(super) struct TailStage {
    pub(super) schedule: Schedule,
    pub(super) tails: Vec<LiftedTail>,
    pub(super) posing: Posing,
    pub(super) ground: Ground,
    /// The joints of all tails in their order.
    pub(super) changed: Vec<Changed>,
}

/// A tail from the body outward.
#[derive(Clone, Debug)]
pub(super) struct LiftedTail {
    /// Slots of its joints, with the points that move with each, in its axes and in plan units.
    pub(super) joints: Vec<(usize, Vec<DVec3>)>,
    /// How far it may be below the floor.
    pub(super) sunk: f64,
}

/// What comes out for one joint at one frame.
#[derive(Clone, Copy, Debug, Default)]
struct Lifted {
    change: Change,
    is_lifted: bool,
}

impl TailStage {
    pub(super) fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let width = self.changed.len();
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Lifted]| {
            self.posing.fill(pose, &work.target, frame);
            let alpha = self.schedule.alpha_at(frame, work.times[frame]);
            let mut row = row.iter_mut();
            for tail in &self.tails {
                self.lift(tail, pose, alpha, &mut row);
            }
        };
        let rows = work.rows(width, || self.posing.pose(), fill)?;
        if rows.iter().any(|lifted| lifted.is_lifted) {
            work.write_columns(&self.changed, |frame, index| &rows[frame * width + index].change);
        }
        Ok(())
    }

    fn lift<'a>(&self, tail: &LiftedTail, pose: &Pose, alpha: f64, row: &mut impl Iterator<Item = &'a mut Lifted>) {
        let floor = self.ground.target_floor - tail.sunk;
        // Where the bone before was and is, and how it was turned and is.
        let mut before: Option<[(DVec3, DQuat); 2]> = None;
        for ((slot, points), lifted) in tail.joints.iter().zip(row) {
            let model = pose.model[*slot];
            let above = self.posing.parent_of(pose, *slot).rotation;
            let (place, above) = before.map_or((model.translation, above), |[was, is]| {
                let turn = is.1 * was.1.conjugate();
                (is.0 + turn * (model.translation - was.0), turn * above)
            });
            let angle = raise(place, model.rotation, points, self.ground.up, floor);
            let turn = angle.map_or(DQuat::IDENTITY, |(axis, angle)| DQuat::from_axis_angle(axis, angle * alpha));
            let turned = turn * model.rotation;
            let rotation = (above.conjugate() * turned).normalize().as_quat();
            *lifted = Lifted { change: Change { rotation, ..Change::default() }, is_lifted: angle.is_some() };
            before = Some([(model.translation, model.rotation), (place, turned)]);
        }
    }
}

/// The axis and the angle by which a bone has to be raised until its points are at the floor, at most until it points straight up;
/// nothing where they are.
///
/// A point that is `a` above the joint and `b` outward is `a cos θ + b sin θ` above it when turned by θ.
fn raise(place: DVec3, rotation: DQuat, points: &[DVec3], up: DVec3, floor: f64) -> Option<(DVec3, f64)> {
    let middle = rotation * (points.iter().sum::<DVec3>() / points.len().max(1) as f64);
    let outward = (middle - up * middle.dot(up)).try_normalize()?;
    let wanted = floor - place.dot(up);
    let (up, outward_of_joint) = (rotation.conjugate() * up, rotation.conjugate() * outward);
    let needed = |point: &DVec3| {
        let (above, before) = (point.dot(up), point.dot(outward_of_joint));
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
        let point = DVec3::new(0.3, 0.0, 0.0);
        for degrees in [-10.0_f64, -40.0, -80.0] {
            let (place, rotation) = (DVec3::Y * 0.1, DQuat::from_rotation_z(degrees.to_radians()));
            let angle = raise(place, rotation, &[point], DVec3::Y, 0.0);
            let turn = angle.map_or(DQuat::IDENTITY, |(axis, angle)| DQuat::from_axis_angle(axis, angle));
            let height = (place + turn * rotation * point).y;
            let wanted = (0.1 + 0.3 * degrees.to_radians().sin()).max(0.0);
            assert!((height - wanted).abs() < 1e-9, "{degrees}: the end is at {height} and not at {wanted}");
        }
    }

    #[test]
    fn bones_above_the_floor_stay() {
        assert!(raise(DVec3::Y, DQuat::IDENTITY, &[DVec3::X], DVec3::Y, 0.0).is_none());
        assert!(raise(DVec3::Y, DQuat::IDENTITY, &[], DVec3::Y, 0.0).is_none(), "nothing is known of it");
    }
}
