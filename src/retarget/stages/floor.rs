//! Soles as far above the floor as the source's. (retargeting.md B8.)

use glam::{DQuat, DVec3};

use crate::{
    model::Canceled,
    rig::{FloorOp, Ground, Schedule, Sole},
};

use super::{
    posing::{Pose, Posing},
    temporal::median,
    two_bone::smooth,
    work::Work,
};

/// Width within which points of a sole share in being the lowest, for a leg of 1 m: keeps the lowest point from jumping.
const SHARED_METRES: f64 = 0.002;

/// Puts soles onto the floor.
#[derive(Clone, Debug)]
pub(super) struct FloorStage {
    pub(super) op: FloorOp,
    pub(super) schedule: Schedule,
    pub(super) feet: Vec<FloorFoot>,
    pub(super) source: Posing,
    pub(super) target: Posing,
    pub(super) ground: Ground,
    /// Plan units of a metre at a leg of 1 m, on either side.
    pub(super) source_leg: f64,
    pub(super) target_leg: f64,
    pub(super) limb_count: usize,
    /// Limbs that have goals at this stage.
    pub(super) goal_limbs: Vec<usize>,
}

/// One foot of both sides.
#[derive(Clone, Debug)]
pub(super) struct FloorFoot {
    pub(super) limb: usize,
    pub(super) source: FootSlots,
    pub(super) source_sole: Sole,
    pub(super) target: FootSlots,
    pub(super) target_sole: Sole,
    /// Whether the target's sole is the source's but for its size.
    pub(super) is_alike: bool,
}

/// Slots of a foot in a posing.
#[derive(Clone, Copy, Debug)]
pub(super) struct FootSlots {
    pub(super) end: usize,
    pub(super) ball: Option<usize>,
}

/// What is known of a foot at a frame.
#[derive(Clone, Copy, Debug, Default)]
struct Clearance {
    /// Of the source's sole above its floor, in units of the source.
    source: f64,
    /// Of the target's at its goal.
    target: f64,
}

impl FloorStage {
    pub(super) fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let width = self.feet.len();
        let fill = |(source, target): &mut (Pose, Pose), frame: usize, row: &mut [Clearance]| {
            self.source.fill(source, work.source, frame);
            self.target.fill(target, &work.target, frame);
            let goals = &work.goals[frame * self.limb_count..(frame + 1) * self.limb_count];
            for (foot, clearance) in self.feet.iter().zip(row) {
                let end = source.model[foot.source.end];
                let toes = foot.source.ball.map(|ball| (source.model[ball].translation, source.model[ball].rotation));
                let of_source = self.lowest(&foot.source_sole, end.translation, end.rotation, toes, self.source_leg);
                let (goal, now) = (goals[foot.limb], &target.model[foot.target.end]);
                let turn = goal.rotation * now.rotation.conjugate();
                let toes = foot.target.ball.map(|ball| {
                    let ball = target.model[ball];
                    (goal.position + turn * (ball.translation - now.translation), turn * ball.rotation)
                });
                let of_target = self.lowest(&foot.target_sole, goal.position, goal.rotation, toes, self.target_leg);
                *clearance = Clearance {
                    source: of_source - self.ground.source_floor,
                    target: of_target - self.ground.target_floor,
                };
            }
        };
        let rows = work.rows(width, || (self.source.pose(), self.target.pose()), fill)?;
        let above: Vec<f64> = (0..width).map(|foot| self.calibration(foot, &rows, work)).collect();
        let scale = self.ground.up.dot(self.ground.travel * self.ground.up);
        // Both what a foot is moved and how much the floor counts for it.
        let correction = |foot: usize, clearance: &Clearance| {
            let height = clearance.source - above[foot];
            let metres = height / self.source_leg;
            let far = (metres - self.op.falloff_height) / self.op.falloff_distance.max(f64::MIN_POSITIVE);
            (scale * height - clearance.target, 1.0 - smooth(far))
        };
        let shift = if self.op.shift_pelvis { self.shift(&rows, work, correction) } else { 0.0 };
        for (frame, row) in rows.chunks_exact(width.max(1)).enumerate() {
            let alpha = self.schedule.alpha_at(frame, work.times[frame]);
            let goals = &mut work.goals[frame * self.limb_count..(frame + 1) * self.limb_count];
            for &limb in &self.goal_limbs {
                let foot = self.feet.iter().position(|foot| foot.limb == limb);
                let (lift, weight) = foot.map_or((0.0, 0.0), |foot| correction(foot, &row[foot]));
                goals[limb].position += self.ground.up * (shift + (lift - shift) * weight * alpha);
            }
        }
        work.pelvis_shift += self.ground.up * shift;
        Ok(())
    }

    /// Height of the lowest point of a sole; where several are about as low, a little below them.
    fn lowest(&self, sole: &Sole, end: DVec3, turn: DQuat, toes: Option<(DVec3, DQuat)>, leg: f64) -> f64 {
        let height = |point: DVec3| point.dot(self.ground.up);
        let points = [
            Some(height(end + turn * sole.heel)),
            sole.ball.map(|[_, ball]| height(end + turn * ball)),
            sole.tip.zip(toes).map(|(tip, (ball, turn))| height(ball + turn * tip)),
        ];
        let lowest = points.iter().flatten().copied().fold(f64::INFINITY, f64::min);
        let width = (SHARED_METRES * leg).max(f64::MIN_POSITIVE);
        let sum: f64 = points.iter().flatten().map(|height| (-(height - lowest) / width).exp()).sum();
        lowest - width * sum.ln()
    }

    /// How far the source's sole hovers in its contacts with the whole foot, where that says something about the capture and not
    /// about how this figure stands.
    fn calibration(&self, foot: usize, rows: &[Clearance], work: &Work<'_>) -> f64 {
        let of_foot = &self.feet[foot];
        if !self.op.adaptive || of_foot.is_alike {
            return 0.0;
        }
        let (end, ball) = (work.contacts.find(of_foot.limb, false), work.contacts.find(of_foot.limb, true));
        let flat = |frame: usize| {
            end.is_some_and(|end| end.touches[frame]) && ball.is_none_or(|ball| ball.touches[frame])
        };
        let clearances = rows.iter().skip(foot).step_by(self.feet.len()).enumerate();
        median(clearances.filter(|(frame, _)| flat(*frame)).map(|(_, clearance)| clearance.source).collect())
            .unwrap_or(0.0)
    }

    /// The correction that most contacts need.
    fn shift(
        &self,
        rows: &[Clearance],
        work: &Work<'_>,
        correction: impl Fn(usize, &Clearance) -> (f64, f64),
    ) -> f64 {
        let mut lifts = Vec::new();
        for (frame, row) in rows.chunks_exact(self.feet.len().max(1)).enumerate() {
            for (foot, clearance) in row.iter().enumerate() {
                let touches = |is_ball| {
                    work.contacts.find(self.feet[foot].limb, is_ball).is_some_and(|point| point.touches[frame])
                };
                if touches(false) || touches(true) {
                    lifts.push(correction(foot, clearance).0);
                }
            }
        }
        median(lifts).unwrap_or(0.0)
    }
}
