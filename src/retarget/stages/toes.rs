//! Toes bend where they would go through the floor.

use glam::{DQuat, DVec3};

use crate::{
    model::Canceled,
    rig::{Ground, Schedule, Sole},
};

use super::{
    posing::{Pose, Posing},
    work::{Change, Changed, Work},
};

/// How far toes bend up at most, in radians.
const MOST_BEND: f64 = 1.2;
/// Width over which toes begin to give way, for a leg of 1 m: keeps them from snapping.
const SOFT_METRES: f64 = 0.01;

/// Bends toes. Runs when the feet are where they stay.
#[derive(Clone, Debug)]
pub(super) struct ToeStage {
    pub(super) schedule: Schedule,
    pub(super) feet: Vec<ToedFoot>,
    pub(super) target: Posing,
    pub(super) ground: Ground,
    /// Plan units of a metre at a leg of 1 m.
    pub(super) leg: f64,
}

/// The toes of one foot.
#[derive(Clone, Copy, Debug)]
pub(super) struct ToedFoot {
    /// The joint of the ball, and its slot.
    pub(super) ball: usize,
    pub(super) slot: usize,
    /// How far ball and tip are above the floor at rest.
    pub(super) ball_height: f64,
    pub(super) tip_height: f64,
    /// From the one to the other, in the ball's axes.
    pub(super) ball_to_tip: DVec3,
    /// The axis about which toes bend up, likewise; unit length.
    pub(super) raise: DVec3,
}

impl ToedFoot {
    /// Of a sole; nothing where toes have no length or stand upright at rest.
    pub(super) fn new(ball: usize, slot: usize, sole: &Sole) -> Option<Self> {
        let (ball_height, tip_height, ball_to_tip) = (sole.ball?, sole.tip?, sole.ball_to_tip?);
        let raise = ball_to_tip.cross(-sole.down[1]?).try_normalize()?;
        Some(Self { ball, slot, ball_height, tip_height, ball_to_tip, raise })
    }
}

impl ToeStage {
    pub(super) fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Change]| {
            self.target.fill(pose, &work.target, frame);
            let alpha = self.schedule.alpha_at(frame, work.times[frame]);
            for (foot, change) in self.feet.iter().zip(row) {
                let ball = pose.model[foot.slot];
                let turn = self.bend(foot, ball.translation, ball.rotation);
                let turned = DQuat::IDENTITY.slerp(turn, alpha) * ball.rotation;
                let above = self.target.parent_of(pose, foot.slot).rotation;
                change.rotation = (above.conjugate() * turned).normalize().as_quat();
            }
        };
        let rows = work.rows(self.feet.len(), || self.target.pose(), fill)?;
        let change = |foot: &ToedFoot| Changed { joint: foot.ball, rotates: true, moves: false };
        work.write(&self.feet.iter().map(change).collect::<Vec<_>>(), &rows);
        Ok(())
    }

    /// The turn that brings the tip up to the floor, or as far down as the ball is.
    fn bend(&self, foot: &ToedFoot, ball: DVec3, rotation: DQuat) -> DQuat {
        let up = self.ground.up;
        let (toes, axis) = (rotation * foot.ball_to_tip, rotation * foot.raise);
        let stands = (ball.dot(up) - foot.ball_height - self.ground.target_floor).min(0.0);
        let height = (ball + toes).dot(up) - foot.tip_height - self.ground.target_floor;
        let missing = soft_above(stands - height, SOFT_METRES * self.leg);
        // Turned by θ about the axis the tip is `low · cos θ + ahead · sin θ` high, beside what lies along the axis.
        let beside = toes.dot(axis) * axis.dot(up);
        let (low, ahead) = (toes.dot(up) - beside, axis.cross(toes).dot(up));
        let reach = low.hypot(ahead);
        if missing <= 0.0 || reach <= 0.0 {
            return DQuat::IDENTITY;
        }
        let bend = ((low + missing) / reach).clamp(-1.0, 1.0).asin() - low.atan2(ahead);
        DQuat::from_axis_angle(axis, bend.clamp(0.0, MOST_BEND))
    }
}

/// Nothing below `-width`, the value above `width`, with a continuous slope between.
fn soft_above(value: f64, width: f64) -> f64 {
    if value >= width || width <= 0.0 { value.max(0.0) } else { (value + width).max(0.0).powi(2) / (4.0 * width) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Skeleton, Transform};

    fn stage() -> ToeStage {
        let target = Posing::new(&Skeleton::default(), Transform::IDENTITY, []);
        ToeStage { schedule: Schedule::always(), feet: Vec::new(), target, ground: Ground::default(), leg: 1.0 }
    }

    fn foot() -> ToedFoot {
        let ball_to_tip = DVec3::new(0.0, -0.01, 0.08);
        ToedFoot { ball: 0, slot: 0, ball_height: 0.03, tip_height: 0.02, ball_to_tip, raise: DVec3::NEG_X }
    }

    fn tip_height(ball: DVec3, rotation: DQuat) -> f64 {
        let turned = stage().bend(&foot(), ball, rotation) * rotation;
        (ball + turned * foot().ball_to_tip).y - foot().tip_height
    }

    #[test]
    fn toes_that_point_into_the_floor_lie_on_it() {
        let stands = DVec3::Y * 0.03;
        for degrees in [10.0_f64, 26.0, 50.0] {
            let height = tip_height(stands, DQuat::from_rotation_x(degrees.to_radians()));
            assert!(height.abs() < 1e-9, "{degrees}°: the tip is {height} above the floor");
        }
        let rotation = DQuat::from_rotation_x(0.4);
        let sunk = tip_height(stands - DVec3::Y * 0.1, rotation);
        assert!((sunk + 0.1).abs() < 1e-9, "where the whole foot is below the floor they are no higher: {sunk}");
    }

    #[test]
    fn toes_in_the_air_stay_as_they_are() {
        let lifted = stage().bend(&foot(), DVec3::Y * 0.3, DQuat::from_rotation_x(1.0));
        assert_eq!(lifted, DQuat::IDENTITY, "far above the floor");
        let upright = stage().bend(&foot(), DVec3::ZERO, DQuat::from_rotation_x(-1.445));
        assert!(upright.is_finite(), "straight up");
        let flat = ToedFoot { ball_to_tip: DVec3::X * 0.1, ..foot() };
        assert_eq!(stage().bend(&flat, DVec3::ZERO, DQuat::IDENTITY), DQuat::IDENTITY, "along their own axis");
    }

    #[test]
    fn toes_never_snap() {
        let bend =
            |height: f64| stage().bend(&foot(), DVec3::Y * height, DQuat::from_rotation_x(0.5)).to_axis_angle().1;
        let steps: Vec<f64> = (0..200).map(|step| bend(0.12 - f64::from(step) * 0.001)).collect();
        let largest = steps.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        assert!(largest < 0.03, "a millimetre turns them by {largest} at most");
        // Toes that curl under the foot pass the vertical while the foot turns about itself.
        let curled = |step: u32| {
            let turn =
                DQuat::from_rotation_y(f64::from(step) * 0.05) * DQuat::from_rotation_x(1.3 + f64::from(step) * 0.02);
            stage().bend(&foot(), DVec3::Y * 0.07, turn) * turn
        };
        for step in 0..20 {
            let degrees = curled(step).angle_between(curled(step + 1)).to_degrees();
            assert!(degrees < 6.0, "{degrees}° at step {step}");
        }
    }
}
