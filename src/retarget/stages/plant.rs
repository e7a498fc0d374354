//! Feet stay where they stand. (retargeting.md B20.)
//!
//! A foot is held by the point that touches: the ankle above the heel, the ball, or both at once. From one frame to the next
//! that point moves on the target as it moves on the source (scaled; not at all in mode `always`); what the goals do beside that is
//! summed up over the contact and taken away from them. The sum has a free constant, which is chosen so that the foot deviates
//! least in the middle of the contact. Between contacts the correction is faded out and in.

use glam::{DMat3, DVec3};

use crate::{
    model::Canceled,
    rig::{PlantMode, PlantOp, Schedule},
};

use super::{
    contacts::ContactPoint,
    temporal::runs,
    two_bone::smooth,
    work::{Goal, Work},
};

/// Share of a contact, at both ends, that does not count for where the foot stands.
const ENDS: f64 = 0.2;
/// Seconds over which the weight goes from heel to ball.
const ROLL_SECONDS: f64 = 0.1;

/// Holds feet.
#[derive(Clone, Debug)]
pub(super) struct PlantStage {
    pub(super) op: PlantOp,
    pub(super) schedule: Schedule,
    /// Limb, and the ball of its target in the axes of the end joint, where there is one.
    pub(super) limbs: Vec<(usize, Option<DVec3>)>,
    pub(super) travel: DMat3,
    pub(super) up: DVec3,
    pub(super) limb_count: usize,
}

/// The change of one limb at one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Correction {
    pub(super) offset: DVec3,
    /// How much it is one of a contact, 0 to 1.
    pub(super) hold: f64,
}

impl PlantStage {
    pub(super) fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        if self.op.mode == PlantMode::Never {
            return Ok(());
        }
        for &(limb, ball) in &self.limbs {
            work.control.check()?;
            let Some(end) = work.contacts.find(limb, false) else { continue };
            let goals: Vec<Goal> = work.goals.iter().skip(limb).step_by(self.limb_count).copied().collect();
            let foot = Foot { end, ball: work.contacts.find(limb, true), target_ball: ball, goals: &goals };
            let corrections = self.corrections(&foot, work.times);
            for (frame, correction) in corrections.iter().enumerate() {
                let alpha = self.schedule.alpha_at(frame, work.times[frame]);
                let goal = &mut work.goals[frame * self.limb_count + limb];
                goal.position += correction.offset * alpha;
                goal.hold = goal.hold.max(correction.hold * alpha);
            }
        }
        Ok(())
    }

    fn corrections(&self, foot: &Foot<'_>, times: &[f64]) -> Vec<Correction> {
        let mut corrections = vec![Correction::default(); times.len()];
        let touches: Vec<bool> = (0..times.len()).map(|frame| foot.touches(frame)).collect();
        let contacts = runs(&touches);
        for &(first, last) in &contacts {
            let offsets = self.held(foot, times, first, last);
            for (correction, offset) in corrections[first..=last].iter_mut().zip(offsets) {
                *correction = Correction { offset, hold: 1.0 };
            }
        }
        let mut before: Option<usize> = None;
        for &(first, last) in &contacts {
            fade(&mut corrections, times, before, Some(first), self.op.blend_seconds);
            before = Some(last);
        }
        fade(&mut corrections, times, before, None, self.op.blend_seconds);
        corrections
    }

    /// What is to be added to the goals of one contact.
    fn held(&self, foot: &Foot<'_>, times: &[f64], first: usize, last: usize) -> Vec<DVec3> {
        let weights = foot.ball_weights(times, first, last);
        let mut offset = DVec3::ZERO;
        let mut offsets = vec![offset];
        for frame in first..last {
            let ball = (weights[frame - first] + weights[frame + 1 - first]) / 2.0;
            offset += foot.step(false, frame, self) * (1.0 - ball) + foot.step(true, frame, self) * ball;
            offsets.push(offset);
        }
        let skipped = (offsets.len() as f64 * ENDS).floor();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
        let middle = &offsets[skipped as usize..offsets.len() - skipped as usize];
        let mean = middle.iter().sum::<DVec3>() / middle.len() as f64;
        let keep = |offset: DVec3| {
            let offset = offset - mean;
            if self.op.mode == PlantMode::Grounding { self.up * offset.dot(self.up) } else { offset }
        };
        offsets.into_iter().map(keep).collect()
    }
}

/// One foot of both sides over the clip.
struct Foot<'a> {
    end: &'a ContactPoint,
    ball: Option<&'a ContactPoint>,
    target_ball: Option<DVec3>,
    goals: &'a [Goal],
}

impl Foot<'_> {
    fn touches(&self, frame: usize) -> bool {
        self.end.touches[frame] || self.ball.is_some_and(|ball| ball.touches[frame])
    }

    /// How much the ball is held, and not the ankle, at every frame of a contact.
    fn ball_weights(&self, times: &[f64], first: usize, last: usize) -> Vec<f64> {
        let Some(ball) = self.ball.filter(|_| self.target_ball.is_some()) else { return vec![0.0; last - first + 1] };
        let raw = |frame: usize| match (self.end.touches[frame], ball.touches[frame]) {
            (true, true) => 0.5,
            (false, true) => 1.0,
            (_, false) => 0.0,
        };
        let mean = |center: usize| {
            let near = |frame: &usize| (times[*frame] - times[center]).abs() <= ROLL_SECONDS / 2.0;
            let before = (first..=center).rev().take_while(near);
            let after = (center + 1..=last).take_while(near);
            let (sum, count) = before.chain(after).fold((0.0, 0.0), |(sum, count), frame| (sum + raw(frame), count + 1.0));
            sum / count
        };
        (first..=last).map(mean).collect()
    }

    /// What the source's point moves from a frame to the next, scaled, minus what the goal's does.
    fn step(&self, of_ball: bool, frame: usize, stage: &PlantStage) -> DVec3 {
        let source = match self.ball {
            Some(ball) if of_ball => &ball.positions,
            _ => &self.end.positions,
        };
        let local = self.target_ball.filter(|_| of_ball).unwrap_or(DVec3::ZERO);
        let place = |frame: usize| self.goals[frame].position + self.goals[frame].rotation * local;
        let wanted = match stage.op.mode {
            PlantMode::Always => DVec3::ZERO,
            _ => stage.travel * (source[frame + 1] - source[frame]),
        };
        wanted - (place(frame + 1) - place(frame))
    }
}

/// Fills the frames between two contacts (last frame of the one, first of the other): straight from one correction to the other
/// where there is no time to let go, else away and back.
fn fade(corrections: &mut [Correction], times: &[f64], before: Option<usize>, after: Option<usize>, seconds: f64) {
    let from = before.map_or(0, |last| last + 1);
    let to = after.unwrap_or(corrections.len());
    let left = before.map_or(Correction::default(), |last| corrections[last]);
    let next = after.map_or(Correction::default(), |first| corrections[first]);
    let gap = before.zip(after).map(|(last, first)| times[first] - times[last]);
    for frame in from..to {
        let since = before.map(|last| times[frame] - times[last]);
        let until = after.map(|first| times[first] - times[frame]);
        let share = |time: Option<f64>| time.map_or(0.0, |time| if seconds > 0.0 { smooth(1.0 - time / seconds) } else { 0.0 });
        let hold = share(since).max(share(until));
        let offset = match (gap, since) {
            (Some(gap), Some(since)) if gap < 2.0 * seconds => left.offset.lerp(next.offset, smooth(since / gap)),
            _ => left.offset * share(since) + next.offset * share(until),
        };
        corrections[frame] = Correction { offset, hold };
    }
}

#[cfg(test)]
mod tests;
