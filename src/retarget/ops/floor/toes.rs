//! Toes bend where they would go through the floor.
//!
//! Every support point of the toes that is below the floor, or below the rest of the foot where that is in it, says by how much they
//! have to bend up; the largest counts.

use crate::retarget::mapping::Ground;
use crate::retarget::stages::stage::Stage;
use glam::{DQuat, DVec3};

use crate::{model::Canceled, retarget::ops::schedule::Schedule, rig::SupportPoint};

use super::{FootSlots, PlacedFoot, Sole, smooth_above, soft_above};
use crate::retarget::stages::{
    posing::{Pose, Posing},
    work::{Change, Changed, Work},
};

/// How far toes bend up at most, in radians.
const MAX_BEND: f64 = 1.2;
/// Width over which toes begin to give way, for a leg of 1 m: keeps them from snapping.
const SOFT_METERS: f64 = 0.01;

/// Standard deviation of the smoothing of how far toes are bent.
const EASE_SECONDS: f64 = 0.05;

/// Bends toes. Runs when the feet are where they stay.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct ToeStage {
    pub(in crate::retarget) schedule: Schedule,
    pub(in crate::retarget) feet: Vec<ToedFoot>,
    pub(in crate::retarget) target: Posing,
    pub(in crate::retarget) ground: Ground,
    /// Plan units of a meter at a leg of 1 m.
    pub(in crate::retarget) leg: f64,
}

/// The toes of one foot.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct ToedFoot {
    /// The joint of the ball.
    pub(in crate::retarget) ball: usize,
    pub(in crate::retarget) slots: FootSlots,
    pub(in crate::retarget) sole: Sole,
    /// The points that bending the toes lifts.
    pub(in crate::retarget) yielding: Vec<SupportPoint>,
    /// The axis about which toes bend up, in the ball's axes; unit length.
    pub(in crate::retarget) raise: DVec3,
}

/// A foot whose toes may bend, where it is at a frame.
struct Toes {
    foot: PlacedFoot,
    ball: (DVec3, DQuat),
    /// The axis about which they bend up.
    axis: DVec3,
}

impl ToeStage {
    /// By how much toes bend up to the floor, or to where the rest of the foot is below it; radians.
    fn bend(&self, foot: &ToedFoot, toes: &Toes) -> f64 {
        let (up, axis) = (self.ground.up, toes.axis);
        let floor = self.ground.target_floor;
        let stands = (toes.foot.lowest(&foot.sole, up).firm - floor).min(0.0);
        let (ball, turned) = toes.ball;
        let (of_toes, of_ahead) = (turned.conjugate() * up, turned.conjugate() * up.cross(axis));
        // What lies along the axis is not lifted.
        let of_low = of_toes - turned.conjugate() * axis * axis.dot(up);
        let base = ball.dot(up) - floor;
        let (ankle, of_end) = (toes.foot.end.0.dot(up) - floor, toes.foot.end.1.conjugate() * up);
        let needed = |point: &SupportPoint| {
            // Turned by θ about the axis the point is `low · cos θ + ahead · sin θ` above the ball, beside what lies along the axis.
            let low = of_low.dot(point.from_ball);
            // What of the point does not move with the toes stays where it is.
            let stays = (ankle + of_end.dot(point.from_end) - stands) * (1.0 - point.toes) / point.toes;
            let missing = soft_above(
                stands - stays - (base + of_toes.dot(point.from_ball) - point.radius),
                SOFT_METERS * self.leg,
            );
            if missing <= 0.0 {
                return 0.0;
            }
            let ahead = of_ahead.dot(point.from_ball);
            let reach = low.hypot(ahead);
            if reach <= 0.0 {
                return 0.0;
            }
            ((low + missing) / reach).clamp(-1.0, 1.0).asin() - low.atan2(ahead)
        };
        foot.yielding.iter().map(needed).fold(0.0, f64::max).min(MAX_BEND)
    }
}

impl Stage for ToeStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let width = self.feet.len();
        let toes = |foot: &ToedFoot, pose: &Pose| {
            let placed = PlacedFoot::posed(foot.slots, pose);
            let (slot, ball) = foot.slots.ball.zip(placed.ball)?;
            Some((slot, Toes { foot: placed, ball, axis: ball.1 * foot.raise }))
        };
        let measure = |pose: &mut Pose, frame: usize, row: &mut [f64]| {
            self.target.fill_model(pose, &work.target, frame);
            let alpha = self.schedule.alpha_at(work.moment(frame));
            for (foot, bend) in self.feet.iter().zip(row) {
                *bend = toes(foot, pose).map_or(0.0, |(_, toes)| self.bend(foot, &toes) * alpha);
            }
        };
        let needed = work.rows(width, || self.target.pose(), measure)?;
        let of_foot = |foot: usize| needed.iter().skip(foot).step_by(width).copied().collect::<Vec<f64>>();
        let bends: Vec<Vec<f64>> = (0..width).map(|foot| eased(of_foot(foot), work.performed)).collect();
        if bends.iter().flatten().all(|bend| *bend == 0.0) {
            return Ok(());
        }
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Change]| {
            if bends.iter().all(|bends| bends[frame] == 0.0) {
                for (foot, change) in self.feet.iter().zip(row) {
                    if let Some(slot) = foot.slots.ball {
                        change.rotation = self.target.local_rotation(slot, &work.target, frame);
                    }
                }
                return;
            }
            self.target.fill_model(pose, &work.target, frame);
            for ((foot, bends), change) in self.feet.iter().zip(&bends).zip(row) {
                let Some((slot, toes)) = toes(foot, pose) else { continue };
                let turned = DQuat::from_axis_angle(toes.axis, bends[frame]) * toes.ball.1;
                let above = self.target.parent_of(pose, slot).rotation;
                change.rotation = (above.conjugate() * turned).normalize().as_quat();
            }
        };
        let rows = work.rows(width, || self.target.pose(), fill)?;
        let change = |foot: &ToedFoot| Changed { joint: foot.ball, rotates: true, moves: false };
        work.write(&self.feet.iter().map(change).collect::<Vec<_>>(), &rows);
        Ok(())
    }
}

/// Bends that are nowhere less, and without a jolt where toes come to the floor and leave it: a foot of a few points, or one that is
/// fast, has them bent in one frame and straight in the next.
fn eased(bends: Vec<f64>, times: &[f64]) -> Vec<f64> {
    if bends.iter().all(|bend| *bend == 0.0) {
        return bends;
    }
    let mut eased = smooth_above(&bends, &bends, times, EASE_SECONDS);
    eased.iter_mut().for_each(|bend| *bend = bend.min(MAX_BEND));
    eased
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        model::{Skeleton, Transform},
        rig::FootShape,
    };

    fn stage() -> ToeStage {
        let target = Posing::new(&Skeleton::default(), Transform::IDENTITY, []);
        ToeStage { schedule: Schedule::always(), feet: Vec::new(), target, ground: Ground::default(), leg: 1.0 }
    }

    fn shape(tip: DVec3, depth: f64) -> FootShape {
        let point = |from_ball: DVec3, toes: f64, radius: f64| SupportPoint {
            from_end: DVec3::new(0.0, -0.05, 0.12) + from_ball,
            from_ball,
            from_shin: DVec3::ZERO,
            toes,
            shin: 0.0,
            radius,
            gives_way: toes > 0.0,
        };
        FootShape { points: vec![point(DVec3::ZERO, 0.0, 0.03), point(tip, 1.0, depth)], ..FootShape::default() }
    }

    fn bend(shape: &FootShape, ball: DVec3, rotation: DQuat) -> DQuat {
        let end = (ball - DVec3::new(0.0, -0.05, 0.12), DQuat::IDENTITY);
        let foot = PlacedFoot { end, ball: Some((ball, rotation)), shin: DQuat::IDENTITY };
        let axis = rotation * DVec3::NEG_X;
        let yielding = shape.points.iter().filter(|point| point.gives_way).copied().collect();
        let slots = FootSlots { end: 0, ball: Some(1), shin: 2 };
        let toed = ToedFoot { ball: 0, slots, sole: Sole::new(shape, true), yielding, raise: DVec3::NEG_X };
        DQuat::from_axis_angle(axis, stage().bend(&toed, &Toes { foot, ball: (ball, rotation), axis }))
    }

    const TIP: DVec3 = DVec3::new(0.0, -0.01, 0.08);

    fn tip_height(ball: DVec3, rotation: DQuat) -> f64 {
        let turned = bend(&shape(TIP, 0.02), ball, rotation) * rotation;
        (ball + turned * TIP).y - 0.02
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
        let lifted = bend(&shape(TIP, 0.02), DVec3::Y * 0.3, DQuat::from_rotation_x(1.0));
        assert_eq!(lifted, DQuat::IDENTITY, "far above the floor");
        let upright = bend(&shape(TIP, 0.02), DVec3::ZERO, DQuat::from_rotation_x(-1.445));
        assert!(upright.is_finite(), "straight up");
        let beside = bend(&shape(DVec3::X * 0.1, 0.02), DVec3::ZERO, DQuat::IDENTITY);
        assert_eq!(beside, DQuat::IDENTITY, "along their own axis");
    }

    #[test]
    fn toes_leave_the_floor_without_a_jolt() {
        let times: Vec<f64> = (0..60).map(|frame| f64::from(frame) / 60.0).collect();
        let bends: Vec<f64> = (0..60).map(|frame| if (20..30).contains(&frame) { 0.6 } else { 0.0 }).collect();
        let eased = eased(bends.clone(), &times);
        let largest = eased.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        assert!(largest < 0.25, "{largest} in one frame, where {} was needed", 0.6);
        assert!(eased.iter().zip(&bends).all(|(eased, bend)| eased >= &(bend - 1e-9)), "nowhere less");
    }

    #[test]
    fn toes_never_snap() {
        let angle =
            |height: f64| bend(&shape(TIP, 0.02), DVec3::Y * height, DQuat::from_rotation_x(0.5)).to_axis_angle().1;
        let steps: Vec<f64> = (0..200).map(|step| angle(0.12 - f64::from(step) * 0.001)).collect();
        let largest = steps.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        assert!(largest < 0.03, "a millimeter turns them by {largest} at most");
        // Toes that curl under the foot pass the vertical while the foot turns about itself.
        let curled = |step: u32| {
            let turn =
                DQuat::from_rotation_y(f64::from(step) * 0.05) * DQuat::from_rotation_x(1.3 + f64::from(step) * 0.02);
            bend(&shape(TIP, 0.02), DVec3::Y * 0.07, turn) * turn
        };
        for step in 0..20 {
            let degrees = curled(step).angle_between(curled(step + 1)).to_degrees();
            assert!(degrees < 6.0, "{degrees}° at step {step}");
        }
    }
}
