//! Soles on the floor, neither in it nor above it.
//!
//! What counts is the lowest support point of a foot at its real tilt (see `rig::soles`). While the source's foot stands it is where the
//! source's is above the level of its floor, contact by contact (`level`); at all other times it is only kept out of the floor. Where a
//! sole would go through it, toes bend first (`toes`), then the foot tilts less (`tilt`), then it is lifted, which bends the
//! knee, and the pelvis goes along with the feet that carry it (`lift`), so that straight legs stay straight.

mod compile;
mod foot;
mod hands;
mod knee;
mod level;
mod lift;
mod sole;
pub(in crate::retarget) mod spec;
mod surface;
pub(in crate::retarget) mod tails;
mod tilt;
pub(in crate::retarget) mod toes;
mod trunk;

pub use self::spec::FloorOp;

use crate::retarget::mapping::Ground;
use crate::retarget::stages::stage::Stage;
use glam::DVec3;

use crate::model::rotation::smootherstep;
use rayon::prelude::*;

use super::schedule::Schedule;
use crate::model::Canceled;

pub(in crate::retarget) use self::foot::{FootSlots, PlacedFoot};
pub(in crate::retarget) use self::hands::{FloorHand, HandStage};
use self::knee::bend_per_move;
use self::level::Levels;
pub(in crate::retarget) use self::lift::smooth_above;
use self::lift::{Lift, smoothed_lifts};
pub(in crate::retarget) use self::sole::Sole;
pub(in crate::retarget) use self::surface::Surface;
pub(in crate::retarget) use self::trunk::Trunks;
use super::plant::either;
use crate::retarget::stages::{
    contact_points::{ContactPoints, Part},
    posing::{Pose, Posing},
    temporal::runs,
    work::Work,
};

/// Seconds around a contact over which the floor begins and ceases to count.
const HOLD_SECONDS: f64 = 0.12;
/// While a foot stands, so much above the level of its contact counts as standing on it, for a leg of 1 m: it is what soles that are
/// guessed or measured differ by as a foot rolls. And over how much that ceases.
const STANDS_METERS: f64 = 0.012;
const STANDS_FADE_METERS: f64 = 0.006;
/// In clips in which nothing touches, as walks on the spot, feet that are no higher carry, for a leg of 1 m.
const CARRIES_METERS: f64 = 0.015;
/// In those clips, feet that are tilted by less stand on their whole soles; in others contacts of heel and ball say so.
const LEVEL_RADIANS: f64 = 0.2;
/// From there on the floor ceases to count for them, over so many meters.
const LOW_METERS: f64 = 0.01;
const LOW_FADE_METERS: f64 = 0.03;
/// A leg of a body that rests is bent below the first share of its length, with its foot set up before it, and straight above the second.
const BENT_REACH: f64 = 0.5;
const STRAIGHT_REACH: f64 = 0.75;
/// Below this one it is folded as far as it goes.
const FOLDED_REACH: f64 = 0.2;

/// Puts soles onto the floor.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct FloorStage {
    pub(in crate::retarget) op: FloorOp,
    pub(in crate::retarget) schedule: Schedule,
    pub(in crate::retarget) feet: Vec<FloorFoot>,
    pub(in crate::retarget) source: Posing,
    pub(in crate::retarget) target: Posing,
    pub(in crate::retarget) ground: Ground,
    /// Plan units of a meter at a leg of 1 m, on either side.
    pub(in crate::retarget) source_leg: f64,
    pub(in crate::retarget) target_leg: f64,
    pub(in crate::retarget) limb_count: usize,
    /// What sits or lies on the floor; nothing where the op leaves the pelvis alone.
    pub(in crate::retarget) trunks: Option<Trunks>,
    /// Limbs that have goals at this stage.
    pub(in crate::retarget) goal_limbs: Vec<usize>,
}

/// One foot of both sides.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct FloorFoot {
    pub(in crate::retarget) limb: usize,
    pub(in crate::retarget) source: FootSlots,
    pub(in crate::retarget) source_sole: Sole,
    pub(in crate::retarget) target: FootSlots,
    pub(in crate::retarget) target_sole: Sole,
    /// Slots of hip, knee and ankle of the target.
    pub(in crate::retarget) leg: [usize; 3],
    /// Whether leg and foot of the target are the source's but for their size. Such a foot stands as the source's stands, even where
    /// that hovers by the measure of its rest pose.
    pub(in crate::retarget) is_same: bool,
    /// Up at rest in the axes of the target's ankle, where it stands at rest.
    pub(in crate::retarget) stands: Option<DVec3>,
    /// How far the sole is below the ankle then.
    pub(in crate::retarget) depth: Option<f64>,
    /// Up at rest in the axes of the joint of the ball.
    pub(in crate::retarget) toes_up: Option<DVec3>,
    /// Up at rest in the axes of the ankle, of feet that are set flat while they stand.
    pub(in crate::retarget) flat: Option<DVec3>,
    /// Whether toes bend where they would go through the floor, so that heel and ball stand.
    pub(in crate::retarget) toes_give_way: bool,
}

/// What is known of a foot at a frame: how high soles are above the floor.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::retarget) struct Clearance {
    /// The source's, in units of the source.
    source: f64,
    /// The target's at its goal, but for toes that bend where they would go through the floor.
    target: f64,
    /// The target's at its goal, toes and all.
    with_toes: f64,
    /// The target's if it stood flat there.
    flat: f64,
    /// Whether it is nearly flat there.
    is_level: bool,
    /// Where the target's hip is.
    hip: DVec3,
    /// Radians by which the target's knee bends for each plan unit that its foot is moved up.
    bend: f64,
}

impl Clearance {
    /// How far the target's foot is to be moved up, or down where it is less than 0, to be at a height: a foot that stands on its toes is
    /// not moved down, and one whose toes bend is not moved up.
    fn missing(&self, height: f64) -> f64 {
        (height - self.target).max((height - self.with_toes).min(0.0))
    }
}

/// Where the sole of a foot of the target should be.
#[derive(Clone, Copy, Debug)]
struct Wanted {
    /// Above its floor, while it is held.
    height: f64,
    /// At any time; more than 0 only for feet that are the source's, where the source's stand above their floor.
    deepest: f64,
}

impl Wanted {
    fn shifted(self, by: f64) -> Self {
        Self { height: self.height + by, deepest: self.deepest + by }
    }
}

impl FloorStage {
    /// Whether a foot carries the figure at a frame where the source's is so high above its level.
    fn carries(&self, foot: usize, frame: usize, above: f64, contacts: Option<&ContactPoints>) -> bool {
        match contacts {
            Some(contacts) => contacts.touches(self.feet[foot].limb, frame),
            None => above < CARRIES_METERS * self.source_leg,
        }
    }

    /// Whether the source's heel is up, of a foot whose heel is known.
    fn is_on_toes(&self, foot: usize, frame: usize, work: &Work<'_>) -> bool {
        work.contacts.find(self.feet[foot].limb, Part::End).is_some_and(|heel| !heel.touches[frame])
    }

    /// How high soles are above the floors, frame by frame.
    fn clearances(&self, work: &Work<'_>) -> Result<Vec<Clearance>, Canceled> {
        let up = self.ground.up;
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Clearance]| {
            self.target.fill_model(pose, &work.target, frame);
            for (foot, clearance) in self.feet.iter().zip(row) {
                let goal = &work.goals[frame * self.limb_count + foot.limb];
                let placed = PlacedFoot::posed(foot.target, pose).moved_to(goal.position, goal.rotation);
                let lowest = placed.lowest(&foot.target_sole, up);
                // What keeps the foot out of the floor.
                let carrying = if foot.toes_give_way { lowest.firm } else { lowest.all };
                let flat = foot.depth.map(|depth| goal.position.dot(up) - depth);
                let is_level = foot.stands.is_some_and(|flat| (goal.rotation * flat).angle_between(up) < LEVEL_RADIANS);
                *clearance = Clearance {
                    source: work.source_soles[foot.limb][frame] - self.ground.source_floor,
                    target: carrying - self.ground.target_floor,
                    with_toes: lowest.all - self.ground.target_floor,
                    flat: flat.unwrap_or(carrying) - self.ground.target_floor,
                    is_level,
                    hip: pose.model[foot.leg[0]].translation,
                    bend: bend_per_move(foot.leg.map(|slot| pose.model[slot].translation), goal.position),
                };
            }
        };
        work.rows(self.feet.len(), || self.target.pose(), fill)
    }

    /// Sees to it that the heights of the source's soles are known. They are the same for all stages.
    fn find_source_soles(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        work.source_soles.resize(self.limb_count, Vec::new());
        if self.feet.iter().all(|foot| work.source_soles[foot.limb].len() == work.frame_count()) {
            return Ok(());
        }
        let fill = |pose: &mut Pose, frame: usize, row: &mut [f64]| {
            self.source.fill_model(pose, work.source, frame);
            for (foot, sole) in self.feet.iter().zip(row) {
                *sole = PlacedFoot::posed(foot.source, pose).lowest(&foot.source_sole, self.ground.up).all;
            }
        };
        let width = self.feet.len();
        let rows = work.rows(width, || self.source.pose(), fill)?;
        for (index, foot) in self.feet.iter().enumerate() {
            work.source_soles[foot.limb] = rows.iter().skip(index).step_by(width).copied().collect();
        }
        Ok(())
    }

    /// Where a sole should be when the source's is so high above its floor, and the level of its contact is that.
    fn wanted(
        &self,
        (foot, frame): (usize, usize),
        clearance: &Clearance,
        levels: &Levels,
        hold: f64,
        resting: f64,
    ) -> Wanted {
        let (source, level) = (clearance.source, levels.off(foot, frame));
        let scale = self.ground.up.dot(self.ground.travel * self.ground.up);
        if self.feet[foot].is_same {
            // No deeper below where the source's stands than the source's for its legs, however large the pelvis scale.
            let deepest = source.min(level.max(0.0)) * self.target_leg / self.source_leg;
            return Wanted { height: (scale * source).max(deepest), deepest };
        }
        let above = source - levels.standing(foot, frame);
        let [width, begin] = [STANDS_FADE_METERS, STANDS_METERS].map(|meters| meters * self.source_leg);
        let standing = soft_above(above - begin, width);
        // Whose trunk rests on the floor does not step down onto a lower one.
        let step = (source + self.most_level()).min(0.0) * (1.0 - resting);
        let deepest = step * self.target_leg / self.source_leg;
        let height = scale * (levels.ground(foot, frame) + above.max(0.0) + (standing - above.max(0.0)) * hold);
        // A source's foot may go down a step or, as often, dangle through a floor that nobody looked at: what is between that and the floor
        // stays where it is.
        if levels.ground(foot, frame) < 0.0 {
            return Wanted { height, deepest: deepest.min(height) };
        }
        Wanted { height: if deepest < 0.0 { clearance.target.clamp(deepest, 0.0) } else { height }, deepest }
    }

    /// How much the floor counts for every foot, frame by frame: while it touches, or while it is low where nothing touches at all.
    fn holds(
        &self,
        rows: &[Clearance],
        levels: &Levels,
        standing: Option<&ContactPoints>,
        work: &Work<'_>,
    ) -> Vec<Vec<f64>> {
        let low = |index: usize, frame: usize| {
            let above = rows[frame * self.feet.len() + index].source - levels.standing(index, frame);
            1.0 - smootherstep((above / self.source_leg - LOW_METERS) / LOW_FADE_METERS)
        };
        let of_foot = |(index, foot): (usize, &FloorFoot)| match standing {
            Some(_) => holds(foot.limb, work),
            None => (0..work.frame_count()).map(|frame| low(index, frame)).collect(),
        };
        self.feet.par_iter().enumerate().map(of_foot).collect()
    }
}

impl FloorStage {
    /// Moves goals up and down: all with the pelvis, and feet by what they need beyond it.
    fn move_goals(
        &self,
        rows: &[Clearance],
        shifts: &[f64],
        lifts: &[Vec<Lift>],
        work: &mut Work<'_>,
    ) -> Result<(), Canceled> {
        let up = self.ground.up;
        work.change_goals(self.limb_count, |work, frame, goals| {
            let resting = work.resting(frame).decides.share;
            for (&limb, lifts) in self.goal_limbs.iter().zip(lifts) {
                let (lift, goal) = (lifts[frame], &mut goals[limb]);
                let foot = self.feet.iter().position(|foot| foot.limb == limb);
                if let Some(foot) = foot.filter(|_| resting > 0.0) {
                    let foot_from_hip = goal.position - rows[frame * self.feet.len() + foot].hip;
                    goal.position += self.stretched(foot_from_hip, up * lift.beyond) * resting;
                }
                goal.position += up * (shifts[frame] + lift.beyond);
                goal.headroom = (lift.beyond - lift.least).max(0.0);
            }
        })
    }

    /// How far a foot of a body that rests goes along the floor as it is moved up beyond its hip: a leg that lies straight does not bend for
    /// that, and one that is folded below its trunk does not fold any farther. A foot that is set up stays where it stands.
    fn stretched(&self, foot_from_hip: DVec3, moved: DVec3) -> DVec3 {
        let up = self.ground.up;
        let now = foot_from_hip + moved;
        let (before, after) = (foot_from_hip.length(), now.length());
        let kept = after + (before - after) * straightness(before / self.target_leg);
        let wanted = kept.max(before.min(FOLDED_REACH * self.target_leg));
        let (height, level) = (now.dot(up), now.reject_from_normalized(up));
        let along = (wanted * wanted - height * height).max(0.0).sqrt();
        level.try_normalize().map_or(DVec3::ZERO, |heading| heading * (along - level.length()))
    }
}

/// How much a leg counts as straight that reaches over so much of its length.
fn straightness(reach: f64) -> f64 {
    smootherstep((reach - BENT_REACH) / (STRAIGHT_REACH - BENT_REACH))
}

impl Stage for FloorStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let width = self.feet.len();
        let alphas: Vec<f64> =
            (0..work.frame_count()).map(|frame| self.schedule.alpha_at(work.moment(frame))).collect();
        self.find_source_soles(work)?;
        self.find_resting(work)?;
        let rows = self.clearances(work)?;
        let standing = self.standing(&rows, work);
        let levels = self.levels(&rows, standing, work);
        let holds = self.holds(&rows, &levels, standing, work);
        let wanted = |foot: usize, frame: usize, clearance: &Clearance| {
            self.wanted((foot, frame), clearance, &levels, holds[foot][frame], work.resting(frame).decides.share)
        };
        let is_touching = standing.is_some();
        let wants = |foot: usize, frame: usize, clearance: &Clearance| {
            let missing = clearance.limited(clearance.missing(wanted(foot, frame, clearance).height), is_touching);
            // A foot that is shorter than the source's leaves the floor earlier as it rolls over its tip: its leg goes down after it, and
            // not the whole body.
            let counts = missing >= 0.0 || !(is_touching && self.is_on_toes(foot, frame, work));
            (counts && self.carries(foot, frame, clearance.source - levels.standing(foot, frame), standing))
                .then_some(missing)
        };
        let shifts = if self.op.shift_pelvis { self.shifts(&rows, work, wants) } else { vec![0.0; work.frame_count()] };
        let lifted = |limb: &usize| {
            let foot = self.feet.iter().position(|foot| foot.limb == *limb);
            let lift = |frame: usize| {
                let (shift, alpha) = (shifts[frame] * alphas[frame], alphas[frame]);
                let Some(foot) = foot else { return Lift { beyond: 0.0, least: f64::NEG_INFINITY } };
                let clearance = &rows[frame * width + foot];
                let wanted = wanted(foot, frame, clearance);
                let meters = (clearance.source - levels.standing(foot, frame)) / self.source_leg;
                let far = (meters - self.op.falloff_height) / self.op.falloff_distance.max(f64::MIN_POSITIVE);
                let weight = holds[foot][frame].max(self.op.swing * (1.0 - smootherstep(far)));
                let least = (wanted.deepest - clearance.target) * alpha;
                // A foot in the air goes with the pelvis, so that its leg keeps its shape, as long as it stays out of the floor.
                let free = shift.max(least);
                // The knee stretches for what the foot is moved beyond the pelvis.
                let missing = shift + clearance.limited(clearance.missing(wanted.height) - shift, is_touching);
                let moved = free + (missing * alpha - free) * weight;
                Lift { beyond: moved - shift, least: least - shift }
            };
            let stands_still = foot.map_or(Vec::new(), |foot| self.stands_still(foot, work));
            smoothed_lifts((0..alphas.len()).map(lift).collect(), &stands_still, work.performed)
        };
        let lifts: Vec<Vec<Lift>> = self.goal_limbs.par_iter().map(lifted).collect();
        let shifts: Vec<f64> = shifts.iter().zip(&alphas).map(|(shift, alpha)| shift * alpha).collect();
        self.move_goals(&rows, &shifts, &lifts, work)?;
        work.pelvis_moves.resize(work.frame_count(), DVec3::ZERO);
        for (moved, shift) in work.pelvis_moves.iter_mut().zip(&shifts) {
            *moved += self.ground.up * *shift;
        }
        Ok(())
    }
}

/// Nothing below `-width`, the value above `width`, with a continuous slope between.
pub(in crate::retarget) fn soft_above(value: f64, width: f64) -> f64 {
    if value >= width || width <= 0.0 { value.max(0.0) } else { (value + width).max(0.0).powi(2) / (4.0 * width) }
}

/// How much the floor counts for a foot, frame by frame: fully in contacts, and less and less around them.
fn holds(limb: usize, work: &Work<'_>) -> Vec<f64> {
    let touches: Vec<bool> = (0..work.frame_count()).map(|frame| work.contacts.touches(limb, frame)).collect();
    let mut holds: Vec<f64> = touches.iter().map(|touches| if *touches { 1.0 } else { 0.0 }).collect();
    for (first, last) in runs(&touches) {
        let near = |seconds: f64| smootherstep(1.0 - seconds / HOLD_SECONDS);
        for frame in (0..first).rev().take_while(|&frame| work.performed[first] - work.performed[frame] < HOLD_SECONDS)
        {
            holds[frame] = either(holds[frame], near(work.performed[first] - work.performed[frame]));
        }
        for frame in
            (last + 1..holds.len()).take_while(|&frame| work.performed[frame] - work.performed[last] < HOLD_SECONDS)
        {
            holds[frame] = either(holds[frame], near(work.performed[frame] - work.performed[last]));
        }
    }
    holds
}

/// Tilts feet before anything holds them.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct TiltStage(pub(in crate::retarget) FloorStage);

impl Stage for TiltStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        self.0.flatten(work)?;
        self.0.tilt(work)
    }
}
