//! Longer or shorter steps. (docs/algorithm/legs.md.)

pub(in crate::retarget) mod spec;

pub use self::spec::{StrideDirection, StrideOp};

use glam::{DVec2, DVec3};

use super::{resolved::Ground, schedule::Schedule};
use crate::model::Canceled;

use crate::retarget::stages::{
    posing::{Pose, Posing},
    temporal::smoothed,
    work::Work,
};

/// A pelvis that travels by less than this in a second, in metres, faces where it faced before.
const LEAST_SPEED_METRES: f64 = 0.1;

/// Spreads the goals of some limbs.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct StrideStage {
    pub(in crate::retarget) op: StrideOp,
    pub(in crate::retarget) schedule: Schedule,
    pub(in crate::retarget) limbs: Vec<StrideLimb>,
    /// All limbs with goals: those go along with the pelvis.
    pub(in crate::retarget) goal_limbs: Vec<usize>,
    pub(in crate::retarget) limb_count: usize,
    pub(in crate::retarget) ground: Ground,
    pub(in crate::retarget) target: Posing,
    /// Slots of the pelvis and of the joint that faces, and the latter's front at rest in its own axes.
    pub(in crate::retarget) pelvis: usize,
    pub(in crate::retarget) facing: usize,
    pub(in crate::retarget) front: DVec3,
}

/// A limb whose goal is spread.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct StrideLimb {
    pub(in crate::retarget) limb: usize,
    /// Where its end is at rest, from the middle of all ends, along left and front.
    pub(in crate::retarget) rest: DVec2,
    /// 1 on the left, −1 on the right.
    pub(in crate::retarget) side: f64,
    /// Slots of its end, and of the ball of the foot, which is what stands while the heel lifts.
    pub(in crate::retarget) end: usize,
    pub(in crate::retarget) ball: Option<usize>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Stance {
    pelvis: DVec3,
    /// Along left and front, any length.
    front: DVec2,
}

impl StrideStage {
    pub(in crate::retarget) fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let stances = self.stances(work)?;
        let toes = self.toes(work)?;
        let fronts = self.fronts(&stances, work);
        work.pelvis_moves.resize(work.frame_count(), DVec3::ZERO);
        let mut gone = DVec3::ZERO;
        for frame in 0..work.frame_count() {
            let alpha = self.schedule.alpha_at(frame, work.times[frame]);
            let front = fronts[frame];
            let left = self.ground.up.cross(front);
            if frame > 0 && self.op.moves_pelvis {
                let between = (front + fronts[frame - 1]).normalize_or(front);
                let step = stances[frame].pelvis - stances[frame - 1].pelvis;
                gone += between * (step.dot(between) * (self.op.forward - 1.0) * alpha);
            }
            let goals = &mut work.goals[frame * self.limb_count..(frame + 1) * self.limb_count];
            let toes = &toes[frame * self.limbs.len()..(frame + 1) * self.limbs.len()];
            for (limb, toe) in self.limbs.iter().zip(toes) {
                let off = goals[limb.limb].position + *toe - stances[frame].pelvis;
                let metres = self.op.sideways * limb.side * self.ground.units_per_metre;
                let along = front * (off.dot(front) * (self.op.forward - 1.0));
                let across = left * (off.dot(left) * (self.op.splay - 1.0) + metres);
                goals[limb.limb].position += (along + across) * alpha;
            }
            for &limb in &self.goal_limbs {
                goals[limb].position += gone;
            }
            work.pelvis_moves[frame] += gone;
        }
        Ok(())
    }

    /// From the ends to the balls of the feet; none for hands.
    fn toes(&self, work: &Work<'_>) -> Result<Vec<DVec3>, Canceled> {
        let fill = |pose: &mut Pose, frame: usize, row: &mut [DVec3]| {
            self.target.fill(pose, &work.target, frame);
            for (limb, toe) in self.limbs.iter().zip(row) {
                let place = |slot: usize| pose.model[slot].translation;
                *toe = limb.ball.map_or(DVec3::ZERO, |ball| place(ball) - place(limb.end));
            }
        };
        work.rows(self.limbs.len(), || self.target.pose(), fill)
    }

    fn stances(&self, work: &Work<'_>) -> Result<Vec<Stance>, Canceled> {
        let axes = self.ground.axes();
        let flat = |vector: DVec3| DVec2::new(vector.dot(axes.x_axis), vector.dot(axes.z_axis));
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Stance]| {
            self.target.fill(pose, &work.target, frame);
            let pelvis = pose.model[self.pelvis].translation;
            let front = match self.op.direction {
                StrideDirection::Pelvis | StrideDirection::Chest => flat(pose.model[self.facing].rotation * self.front),
                StrideDirection::Goals => {
                    let goals = &work.goals[frame * self.limb_count..(frame + 1) * self.limb_count];
                    self.turned(|limb| flat(goals[limb].position))
                }
                StrideDirection::Travel => DVec2::ZERO,
            };
            row[0] = Stance { pelvis, front };
        };
        work.rows(1, || self.target.pose(), fill)
    }

    /// The front as the goals lie turned against their rest pose: the best fit about their middle.
    fn turned(&self, place: impl Fn(usize) -> DVec2) -> DVec2 {
        let count = self.limbs.len().max(1) as f64;
        let middle = self.limbs.iter().map(|limb| place(limb.limb)).sum::<DVec2>() / count;
        let (mut sine, mut cosine) = (0.0, 0.0);
        for limb in &self.limbs {
            let now = place(limb.limb) - middle;
            sine += limb.rest.perp_dot(now);
            cosine += limb.rest.dot(now);
        }
        DVec2::from_angle(sine.atan2(cosine)).rotate(DVec2::Y)
    }

    /// Unit vectors over the floor.
    fn fronts(&self, stances: &[Stance], work: &Work<'_>) -> Vec<DVec3> {
        let axes = self.ground.axes();
        let mut fronts: Vec<DVec3> =
            stances.iter().map(|stance| DVec3::new(stance.front.x, 0.0, stance.front.y)).collect();
        if self.op.direction == StrideDirection::Travel {
            let least = LEAST_SPEED_METRES * self.ground.units_per_metre;
            for (frame, front) in fronts.iter_mut().enumerate() {
                let (before, after) = (frame.saturating_sub(1), (frame + 1).min(stances.len() - 1));
                let way = axes.transpose() * (stances[after].pelvis - stances[before].pelvis);
                let seconds = work.times[after] - work.times[before];
                let is_on_its_way = DVec2::new(way.x, way.z).length() > least * seconds;
                *front = if is_on_its_way { DVec3::new(way.x, 0.0, way.z) } else { DVec3::ZERO };
            }
        }
        let mut before = DVec3::Z;
        for front in &mut fronts {
            before = front.try_normalize().unwrap_or(before);
            *front = before;
        }
        let smooth = smoothed(&fronts, work.times, self.op.smoothing_seconds / 2.0);
        let level = |(smooth, own): (DVec3, &DVec3)| axes * smooth.try_normalize().unwrap_or(*own);
        smooth.into_iter().zip(&fronts).map(level).collect()
    }
}
