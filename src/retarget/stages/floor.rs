//! Soles as far above the floor as the source's. (docs/algorithm/legs.md.)

use glam::{DQuat, DVec3};
use rayon::prelude::*;

use crate::{
    model::Canceled,
    rig::{FloorOp, Ground, Schedule, Sole},
};

use super::{
    contacts::Part,
    plant::either,
    posing::{Pose, Posing},
    temporal::{median, runs, smoothed, smoothed_above},
    two_bone::{arc, smooth},
    work::Work,
};

/// Width within which points of a sole share in being the lowest, for a leg of 1 m: keeps the lowest point from jumping.
const SHARED_METRES: f64 = 0.002;
/// Standard deviation of the smoothing of what the pelvis follows.
const SHIFT_SECONDS: f64 = 0.16;
/// Standard deviation of the smoothing of what a foot is moved beyond the pelvis: a sole of three points rolls in jolts, one of
/// flesh does not.
const LIFT_SECONDS: f64 = 0.04;
/// Rounds in which that smoothing is made up for where a sole is in the floor.
const LIFT_ROUNDS: usize = 2;
/// Seconds around a contact over which the floor begins and ceases to count.
const HOLD_SECONDS: f64 = 0.2;

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
    /// The target's foot over the source's, where they differ in nothing but size. Such a foot stands as the source's stands, even
    /// where that hovers by the measure of its rest pose.
    pub(super) size_ratio: Option<f64>,
    /// Up in the axes of the target's end at rest, of feet that are set flat while they stand.
    pub(super) flat: Option<DVec3>,
    /// Whether toes bend where they would go through the floor, so that heel and ball stand.
    pub(super) toes_give_way: bool,
}

impl FloorFoot {
    /// The part of a sole that keeps the foot out of the floor.
    fn stands_on(&self, sole: Sole) -> Sole {
        if self.toes_give_way { Sole { tip: None, ..sole } } else { sole }
    }
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

/// How far a foot is moved.
#[derive(Clone, Copy)]
struct Lift {
    /// Beyond the shift of the pelvis.
    beyond: f64,
    /// What it has to be moved by to stay out of the floor.
    least: f64,
}

impl FloorStage {
    pub(super) fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let width = self.feet.len();
        let alphas: Vec<f64> =
            work.times.iter().enumerate().map(|(frame, time)| self.schedule.alpha_at(frame, *time)).collect();
        let holds: Vec<Vec<f64>> = self.feet.par_iter().map(|foot| holds(foot.limb, work)).collect();
        self.flatten(&holds, &alphas, work)?;
        let fill = |(source, target): &mut (Pose, Pose), frame: usize, row: &mut [Clearance]| {
            self.source.fill(source, work.source, frame);
            self.target.fill(target, &work.target, frame);
            let goals = &work.goals[frame * self.limb_count..(frame + 1) * self.limb_count];
            for (foot, clearance) in self.feet.iter().zip(row) {
                let end = source.model[foot.source.end];
                let toes = foot.source.ball.map(|ball| (source.model[ball].translation, source.model[ball].rotation));
                let of_source = self.lowest(&foot.stands_on(foot.source_sole), end.translation, toes, self.source_leg);
                let (goal, now) = (goals[foot.limb], &target.model[foot.target.end]);
                let turn = goal.rotation * now.rotation.conjugate();
                let toes = foot.target.ball.map(|ball| {
                    let ball = target.model[ball];
                    (goal.position + turn * (ball.translation - now.translation), turn * ball.rotation)
                });
                let of_target = self.lowest(&foot.stands_on(foot.target_sole), goal.position, toes, self.target_leg);
                *clearance = Clearance {
                    source: of_source - self.ground.source_floor,
                    target: of_target - self.ground.target_floor,
                };
            }
        };
        let rows = work.rows(width, || (self.source.pose(), self.target.pose()), fill)?;
        let level = self.level(&rows, work);
        let scale = self.ground.up.dot(self.ground.travel * self.ground.up);
        // Where the target's sole should be, as a height above its floor.
        let wanted = |foot: usize, clearance: &Clearance| {
            let height = match self.feet[foot].size_ratio {
                Some(ratio) => scale * (clearance.source - level) + ratio * level,
                // Hovering is taken off, but what touches without that is not pressed into the floor.
                None if self.op.adaptive => scale * (clearance.source - level).max(clearance.source.min(0.0)),
                None => scale * clearance.source,
            };
            // No deeper in the floor than the source's for its legs, however large the pelvis scale.
            height.max(clearance.source.min(0.0) * self.target_leg / self.source_leg)
        };
        let lift = |foot: usize, frame: usize, clearance: &Clearance| {
            let wanted = wanted(foot, clearance);
            let metres = (clearance.source - level) / self.source_leg;
            let far = (metres - self.op.falloff_height) / self.op.falloff_distance.max(f64::MIN_POSITIVE);
            let weight = holds[foot][frame].max(self.op.swing * (1.0 - smooth(far)));
            // As deep as the source's at the most, and no deeper than it is.
            let deepest = wanted.max(clearance.target).min(0.0);
            (wanted - clearance.target, weight, deepest - clearance.target)
        };
        let wants = |foot: usize, clearance: &Clearance| wanted(foot, clearance) - clearance.target;
        let shifts = if self.op.shift_pelvis { self.shifts(&rows, work, wants) } else { vec![0.0; work.frame_count()] };
        let lifted = |limb: &usize| {
            let foot = self.feet.iter().position(|foot| foot.limb == *limb);
            let lift = |frame: usize| {
                let shift = shifts[frame] * alphas[frame];
                let foot = foot.map(|foot| lift(foot, frame, &rows[frame * width + foot]));
                let (wants, weight, lowest) = foot.unwrap_or((0.0, 0.0, f64::NEG_INFINITY));
                // A foot in the air goes with the pelvis, so that its leg keeps its shape, as long as it stays out of the floor.
                let free = shift.max(lowest * alphas[frame]);
                let moved = free + (wants * alphas[frame] - free) * weight;
                Lift { beyond: moved - shift, least: lowest * alphas[frame] - shift }
            };
            smoothed_lifts((0..alphas.len()).map(lift).collect(), work.times)
        };
        let lifts: Vec<Vec<Lift>> = self.goal_limbs.par_iter().map(lifted).collect();
        work.change_goals(self.limb_count, |_, frame, goals| {
            for (&limb, lifts) in self.goal_limbs.iter().zip(&lifts) {
                let lift = lifts[frame];
                goals[limb].position += self.ground.up * (shifts[frame] * alphas[frame] + lift.beyond);
                goals[limb].headroom = (lift.beyond - lift.least).max(0.0);
            }
        })?;
        work.pelvis_moves.resize(work.frame_count(), DVec3::ZERO);
        for (moved, (shift, alpha)) in work.pelvis_moves.iter_mut().zip(shifts.iter().zip(&alphas)) {
            *moved += self.ground.up * (shift * alpha);
        }
        Ok(())
    }

    /// Sets feet flat, the shortest way, as much as they are held.
    fn flatten(&self, holds: &[Vec<f64>], alphas: &[f64], work: &mut Work<'_>) -> Result<(), Canceled> {
        if self.feet.iter().all(|foot| foot.flat.is_none()) {
            return Ok(());
        }
        work.change_goals(self.limb_count, |_, frame, goals| {
            for (foot, holds) in self.feet.iter().zip(holds) {
                let Some(flat) = foot.flat else { continue };
                let goal = &mut goals[foot.limb];
                let now = goal.rotation * flat;
                let turn = arc(now, self.ground.up, now.any_orthonormal_vector());
                goal.rotation = DQuat::IDENTITY.slerp(turn, holds[frame] * alphas[frame]) * goal.rotation;
            }
        })
    }

    /// Height of the sole, by the joint that is lowest above it; where several are about as low, a little below them.
    fn lowest(&self, sole: &Sole, end: DVec3, toes: Option<(DVec3, DQuat)>, leg: f64) -> f64 {
        let height = |point: DVec3, above: f64| point.dot(self.ground.up) - above;
        let ball = toes.zip(sole.ball).map(|((ball, _), above)| height(ball, above));
        let tip = toes.zip(sole.ball_to_tip.zip(sole.tip));
        let tip = tip.map(|((ball, turn), (bone, above))| height(ball + turn * bone, above));
        let points = [Some(height(end, sole.heel)), ball, tip];
        let lowest = points.iter().flatten().copied().fold(f64::INFINITY, f64::min);
        let width = (SHARED_METRES * leg).max(f64::MIN_POSITIVE);
        let sum: f64 = points.iter().flatten().map(|height| (-(height - lowest) / width).exp()).sum();
        lowest - width * sum.ln()
    }

    /// The height of the source's soles in its contacts with the whole foot: 0 where the capture stands on its floor.
    fn level(&self, rows: &[Clearance], work: &Work<'_>) -> f64 {
        let width = self.feet.len();
        let mut heights = Vec::new();
        for (index, foot) in self.feet.iter().enumerate() {
            let (end, ball) = (work.contacts.find(foot.limb, Part::End), work.contacts.find(foot.limb, Part::Ball));
            let flat =
                |frame: usize| end.is_some_and(|end| end.touches[frame]) && ball.is_none_or(|ball| ball.touches[frame]);
            let of_foot = rows.iter().skip(index).step_by(width).enumerate();
            heights.extend(of_foot.filter(|(frame, _)| flat(*frame)).map(|(_, clearance)| clearance.source));
        }
        median(heights).unwrap_or(0.0)
    }

    /// How far the pelvis goes up or down with the feet that carry it: the mean of what they need. Smooth over time, and straight
    /// from one contact to the next.
    fn shifts(&self, rows: &[Clearance], work: &Work<'_>, wants: impl Fn(usize, &Clearance) -> f64) -> Vec<f64> {
        let width = self.feet.len().max(1);
        let mut known: Vec<(usize, f64)> = Vec::new();
        for (frame, row) in rows.chunks_exact(width).enumerate() {
            let carrying =
                row.iter().enumerate().filter(|(foot, _)| work.contacts.touches(self.feet[*foot].limb, frame));
            let lifts = carrying.map(|(foot, clearance)| wants(foot, clearance));
            let (sum, count) = lifts.fold((0.0, 0.0), |(sum, count), lift| (sum + lift, count + 1.0));
            if count > 0.0 {
                known.push((frame, sum / count));
            }
        }
        let (Some(first), Some(last)) = (known.first(), known.last()) else { return vec![0.0; work.frame_count()] };
        let mut shifts = Vec::with_capacity(work.frame_count());
        let mut next = 0;
        for frame in 0..work.frame_count() {
            while next < known.len() && known[next].0 < frame {
                next += 1;
            }
            let after = known.get(next).unwrap_or(last);
            let before = next.checked_sub(1).map_or(first, |before| &known[before]);
            let span = work.times[after.0] - work.times[before.0];
            let share =
                if span > 0.0 { ((work.times[frame] - work.times[before.0]) / span).clamp(0.0, 1.0) } else { 1.0 };
            shifts.push(before.1 + (after.1 - before.1) * share);
        }
        smoothed(&shifts, work.times, SHIFT_SECONDS)
    }
}

/// Smooth over time, and nowhere less than the least.
fn smoothed_lifts(mut lifts: Vec<Lift>, times: &[f64]) -> Vec<Lift> {
    let beyond: Vec<f64> = lifts.iter().map(|lift| lift.beyond).collect();
    let mut beyond = smoothed(&beyond, times, LIFT_SECONDS);
    let missing = |beyond: &[f64]| -> Vec<f64> {
        lifts.iter().zip(beyond).map(|(lift, beyond)| (lift.least - beyond).max(0.0)).collect()
    };
    let add = |beyond: &mut [f64], more: Vec<f64>| {
        beyond.iter_mut().zip(more).for_each(|(beyond, more)| *beyond += more);
    };
    // Smoothing takes the tips off, so what is still missing is added again, as smoothly.
    for _ in 0..LIFT_ROUNDS {
        let more = smoothed(&missing(&beyond), times, LIFT_SECONDS);
        add(&mut beyond, more);
    }
    // The little that is left then goes, too.
    let more = smoothed_above(&missing(&beyond), times, LIFT_SECONDS);
    add(&mut beyond, more);
    lifts.iter_mut().zip(beyond).for_each(|(lift, beyond)| lift.beyond = beyond);
    lifts
}

/// How much the floor counts for a foot, frame by frame: fully in contacts, and less and less around them.
fn holds(limb: usize, work: &Work<'_>) -> Vec<f64> {
    let touches: Vec<bool> = (0..work.frame_count()).map(|frame| work.contacts.touches(limb, frame)).collect();
    let mut holds: Vec<f64> = touches.iter().map(|touches| if *touches { 1.0 } else { 0.0 }).collect();
    for (first, last) in runs(&touches) {
        let near = |seconds: f64| smooth(1.0 - seconds / HOLD_SECONDS);
        for frame in (0..first).rev().take_while(|&frame| work.times[first] - work.times[frame] < HOLD_SECONDS) {
            holds[frame] = either(holds[frame], near(work.times[first] - work.times[frame]));
        }
        for frame in (last + 1..holds.len()).take_while(|&frame| work.times[frame] - work.times[last] < HOLD_SECONDS) {
            holds[frame] = either(holds[frame], near(work.times[frame] - work.times[last]));
        }
    }
    holds
}
