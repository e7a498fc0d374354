//! Feet stay where they stand. (retargeting.md B20.)
//!
//! A foot is held by the point of its sole that touches: below the ankle, the ball or the tip of the toes, or several at once. So a
//! foot with a higher ankle than the source's stands where it stands while it rolls, and its ankle is what moves. From one frame to the next
//! that point moves on the target as it moves on the source (scaled; not at all in mode `always`); what the goals do beside that is
//! summed up over the contact and taken away from them. The sum has a free constant, which is chosen so that the foot deviates
//! least in the middle of the contact. Between contacts the correction is faded out and in.

mod level;

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    model::Canceled,
    rig::{PlantMode, PlantOp, Schedule},
};

pub(super) use self::level::FootAxes;

use super::{
    contacts::{ContactPoint, ContactPoints, Part},
    posing::{Pose, Posing},
    temporal::{runs, smoothed},
    two_bone::smooth,
    work::Work,
};

/// Share of a contact, at both ends, that does not count for where the foot stands.
const ENDS: f64 = 0.2;
/// Seconds over which the weight goes from one point to the next.
const ROLL_SECONDS: f64 = 0.1;

/// Standard deviation of the smoothing of corrections between contacts, and the time over which that begins.
const SOFT_SECONDS: f64 = 0.02;
const SOFTEN_SECONDS: f64 = 0.07;

/// Seconds of a contact from which it is taken how fast its correction changes at its border.
const SPEED_SECONDS: f64 = 0.05;

/// Holds feet.
#[derive(Clone, Debug)]
pub(super) struct PlantStage {
    pub(super) op: PlantOp,
    pub(super) schedule: Schedule,
    pub(super) feet: Vec<PlantedFoot>,
    pub(super) posing: Posing,
    pub(super) up: DVec3,
    pub(super) limb_count: usize,
}

/// One foot or hand of the target.
#[derive(Clone, Debug)]
pub(super) struct PlantedFoot {
    pub(super) limb: usize,
    /// Target length over source length: what moves of the source's are multiplied by.
    pub(super) scale: f64,
    /// Slots of end, ball and tip, as far as the target has them.
    pub(super) slots: [Option<usize>; 3],
    /// From there to the sole, in the axes of those joints.
    pub(super) soles: [DVec3; 3],
    /// Front and left at rest in the axes of the end, of feet that may be leveled.
    pub(super) axes: Option<FootAxes>,
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
        self.level(work);
        let correct = |foot: &PlantedFoot| {
            let held = self.read(foot, work)?;
            Ok(held.map(|held| self.corrections(&held, work.times)))
        };
        let corrections: Vec<Option<Vec<Correction>>> =
            self.feet.par_iter().map(correct).collect::<Result<_, Canceled>>()?;
        work.change_goals(self.limb_count, |work, frame, goals| {
            let alpha = self.schedule.alpha_at(frame, work.times[frame]);
            for (foot, corrections) in self.feet.iter().zip(&corrections) {
                let Some(correction) = corrections.as_ref().map(|corrections| corrections[frame]) else { continue };
                let goal = &mut goals[foot.limb];
                goal.position += correction.offset * alpha;
                goal.hold = goal.hold.max(correction.hold * alpha);
            }
        })
    }

    /// Where the points of a foot are on both sides; nothing where none is known to touch.
    fn read(&self, foot: &PlantedFoot, work: &Work<'_>) -> Result<Option<Foot>, Canceled> {
        let contacts: &ContactPoints = &work.contacts;
        let points = Part::ALL.map(|part| contacts.find(foot.limb, part));
        let Some(end) = foot.slots[0].filter(|_| points.iter().flatten().next().is_some()) else { return Ok(None) };
        let fill = |pose: &mut Pose, frame: usize, row: &mut [[DVec3; 3]]| {
            self.posing.fill(pose, &work.target, frame);
            let goal = &work.goals[frame * self.limb_count + foot.limb];
            let turn = goal.rotation * pose.model[end].rotation.conjugate();
            // A target without that point is held by its end.
            let point = |part: usize| foot.slots[part].map_or((end, foot.soles[0]), |slot| (slot, foot.soles[part]));
            row[0] = [0, 1, 2].map(point).map(|(slot, sole)| {
                let joint = pose.model[slot];
                let from_end = joint.translation + joint.rotation * sole - pose.model[end].translation;
                goal.position + turn * from_end
            });
        };
        let targets = work.rows(1, || self.posing.pose(), fill)?;
        let has_point = foot.slots.map(|slot| slot.is_some());
        Ok(Some(Foot { scale: foot.scale, tracks: points.map(|point| point.map(PointTrack::of)), has_point, targets }))
    }

    fn corrections(&self, foot: &Foot, times: &[f64]) -> Vec<Correction> {
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
        soften(&mut corrections, times, &contacts);
        corrections
    }

    /// What is to be added to the goals of one contact.
    fn held(&self, foot: &Foot, times: &[f64], first: usize, last: usize) -> Vec<DVec3> {
        let weights = foot.weights(times, first, last);
        let mut offset = DVec3::ZERO;
        let mut offsets = Vec::with_capacity(last - first + 1);
        offsets.push(offset);
        for frame in first..last {
            let (before, after) = (weights[frame - first], weights[frame + 1 - first]);
            for (part, (before, after)) in before.into_iter().zip(after).enumerate() {
                offset += foot.step(part, frame, self.op.mode) * ((before + after) / 2.0);
            }
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

/// One foot of both sides over the clip. Arrays of three: end, ball and tip.
struct Foot {
    scale: f64,
    tracks: [Option<PointTrack>; 3],
    has_point: [bool; 3],
    /// Where the target's points are when the end is at its goal.
    targets: Vec<[DVec3; 3]>,
}

/// A point of the source over the clip.
struct PointTrack {
    positions: Vec<DVec3>,
    touches: Vec<bool>,
}

impl PointTrack {
    fn of(point: &ContactPoint) -> Self {
        Self { positions: point.positions.clone(), touches: point.touches.clone() }
    }
}

impl Foot {
    fn touches(&self, frame: usize) -> bool {
        self.tracks.iter().flatten().any(|track| track.touches[frame])
    }

    /// How much each point is held at every frame of a contact; the sum is 1.
    fn weights(&self, times: &[f64], first: usize, last: usize) -> Vec<[f64; 3]> {
        let raw = |frame: usize| {
            let touches = |part: usize| self.tracks[part].as_ref().is_some_and(|track| track.touches[frame]);
            let touches = [0, 1, 2].map(|part| if touches(part) { 1.0 } else { 0.0 });
            let count: f64 = touches.iter().sum();
            touches.map(|touches| touches / count.max(1.0))
        };
        let mean = |center: usize| {
            let near = |frame: &usize| (times[*frame] - times[center]).abs() <= ROLL_SECONDS / 2.0;
            let before = (first..=center).rev().take_while(near);
            let after = (center + 1..=last).take_while(near);
            let mut mean = [0.0; 3];
            let mut count = 0.0;
            for frame in before.chain(after) {
                let raw = raw(frame);
                (0..3).for_each(|part| mean[part] += raw[part]);
                count += 1.0;
            }
            mean.map(|sum| sum / count)
        };
        (first..=last).map(mean).collect()
    }

    /// What the source's point moves from a frame to the next, scaled, minus what the goal's does.
    fn step(&self, part: usize, frame: usize, mode: PlantMode) -> DVec3 {
        // A target without that point follows the source's end with its own.
        let of_source = if self.has_point[part] { &self.tracks[part] } else { &self.tracks[0] };
        let Some(track) = of_source else { return DVec3::ZERO };
        let wanted = match mode {
            PlantMode::Always => DVec3::ZERO,
            _ => (track.positions[frame + 1] - track.positions[frame]) * self.scale,
        };
        wanted - (self.targets[frame + 1][part] - self.targets[frame][part])
    }
}

/// Takes the corners off the corrections between contacts, more and more away from those.
fn soften(corrections: &mut [Correction], times: &[f64], contacts: &[(usize, usize)]) {
    let offsets: Vec<DVec3> = corrections.iter().map(|correction| correction.offset).collect();
    let soft = smoothed(&offsets, times, SOFT_SECONDS);
    let mut next = 0;
    for (frame, correction) in corrections.iter_mut().enumerate() {
        while contacts.get(next).is_some_and(|contact| contact.1 < frame) {
            next += 1;
        }
        let since = next.checked_sub(1).map(|before| times[frame] - times[contacts[before].1]);
        let until = contacts.get(next).map(|contact| times[contact.0] - times[frame]);
        let away = [since, until].into_iter().flatten().fold(f64::INFINITY, f64::min);
        correction.offset = correction.offset.lerp(soft[frame], smooth(away / SOFTEN_SECONDS));
    }
}

/// Fills the frames between two contacts (last frame of the one, first of the other): straight from one correction to the other
/// where there is no time to let go, else away and back.
fn fade(corrections: &mut [Correction], times: &[f64], before: Option<usize>, after: Option<usize>, seconds: f64) {
    let from = before.map_or(0, |last| last + 1);
    let to = after.unwrap_or(corrections.len());
    let left = before.map(|last| Leaving::at(corrections, times, last, false));
    let next = after.map(|first| Leaving::at(corrections, times, first, true));
    let gap = before.zip(after).map(|(last, first)| times[first] - times[last]);
    for frame in from..to {
        let since = before.map(|last| times[frame] - times[last]);
        let until = after.map(|first| times[first] - times[frame]);
        let share =
            |time: Option<f64>| time.map_or(0.0, |time| if seconds > 0.0 { smooth(1.0 - time / seconds) } else { 0.0 });
        let hold = share(since).max(share(until));
        let [left, next] = [&left, &next].map(|end| end.as_ref().map_or(DVec3::ZERO, |end| end.after(times[frame])));
        let offset = match (gap, since) {
            (Some(gap), Some(since)) if gap < 2.0 * seconds => left.lerp(next, smooth(since / gap)),
            _ => left * share(since) + next * share(until),
        };
        corrections[frame] = Correction { offset, hold };
    }
}

/// A correction at the border of a contact, with the speed at which it changes there, so that a foot is let go without a jolt.
struct Leaving {
    offset: DVec3,
    per_second: DVec3,
    seconds: f64,
}

impl Leaving {
    /// At the last frame of a contact, or at its first.
    fn at(corrections: &[Correction], times: &[f64], frame: usize, is_first: bool) -> Self {
        let is_near =
            |other: &usize| (times[*other] - times[frame]).abs() <= SPEED_SECONDS && corrections[*other].hold >= 1.0;
        let inside = if is_first {
            (frame..times.len()).take_while(is_near).last()
        } else {
            (0..=frame).rev().take_while(is_near).last()
        };
        let offset = corrections[frame].offset;
        let inside = inside.filter(|inside| *inside != frame);
        let slope = |inside: usize| (corrections[inside].offset - offset) / (times[inside] - times[frame]);
        Self { offset, per_second: inside.map_or(DVec3::ZERO, slope), seconds: times[frame] }
    }

    /// What it goes on to be outside of the contact.
    fn after(&self, seconds: f64) -> DVec3 {
        self.offset + self.per_second * (seconds - self.seconds)
    }
}

#[cfg(test)]
mod tests;
