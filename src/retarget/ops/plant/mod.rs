//! Feet stay where they stand. (docs/algorithm/legs.md.)
//!
//! A foot is held by the point of its sole that touches: the back of the heel, the ball or the tip of the toes, or several at once. So a
//! foot with a higher ankle than the source's stands where it stands while it rolls, and its ankle is what moves. From one frame to the next
//! that point moves on the target as it moves on the source (scaled; not at all in mode `always`); what the goals do beside that is
//! summed up over the contact and taken away from them. The sum has a free constant, which is chosen so that the foot deviates
//! least in the middle of the contact. Between contacts the correction is faded out and in.
//!
//! Of a foot that rolls the point that is most still counts most: it is the one that the foot turns about.

mod fade;
mod level;
mod running_floor;
pub(in crate::retarget) mod spec;
mod steady;

pub use self::spec::{PlantMode, PlantOp};

use super::feet::{foot_parts, size_ratio};
use crate::retarget::stages::stage::Stage;
use crate::retarget::{
    mapping::Mapping,
    ops::{
        context::{Context, Limbs},
        op_spec::OpSpec,
        resolved::{Ahead, OpWork, ResolvedOp},
        scope::Scope,
    },
    stages::builder::StackBuilder,
};
use crate::{
    model::{
        Reporter,
        rotation::{approach, smootherstep},
    },
    retarget::mapping::LimbPair,
    rig::FootPoint,
};
use glam::DVec3;
use rayon::prelude::*;

use super::schedule::Schedule;
use crate::model::Canceled;

pub(in crate::retarget) use self::{fade::either, level::FootAxes, steady::Steadied};
use self::{
    fade::fade,
    running_floor::{CARRIED_METERS, RunningFloor},
};

use crate::retarget::stages::contact_points::{ContactPoint, Part};
use crate::retarget::stages::{
    posing::{Pose, Posing},
    temporal::{runs, smoothed_in, speeds},
    work::{Goal, Work},
};

/// A point of a foot that is slower stands still, for a leg of 1 m.
const STILL_METERS_PER_SECOND: f64 = 0.05;
/// A point that is slower than so many times that creeps, and one that is twice as fast slides.
const CREEPS: f64 = 2.0;
/// A foot that had to be moved faster than this to be held has not landed yet, for a leg of 1 m.
const LANDING_METERS_PER_SECOND: f64 = 1.5;
/// From this share of that speed on, a foot that stands is held less and less, so that it is moved no faster than the second share: where the
/// source turns on the tip of its toes, a foot as long as half a leg would swing about its own tip, and the knee with it.
const DRAGS: f64 = 0.9;
const MAX_HELD: f64 = 1.4;
/// How far planted feet swing out beyond their goals between contacts, for a leg of 1 m.
const SWING_METERS: f64 = 0.03;

/// Share of a contact, at both ends, that does not count for where the foot stands.
const ENDS: f64 = 0.2;
/// Standard deviation of the smoothing with which weight goes from one point to the next.
const ROLL_SECONDS: f64 = 0.03;

/// Holds feet.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct PlantStage {
    pub(in crate::retarget) op: PlantOp,
    pub(in crate::retarget) schedule: Schedule,
    pub(in crate::retarget) feet: Vec<PlantedFoot>,
    pub(in crate::retarget) posing: Posing,
    pub(in crate::retarget) up: DVec3,
    pub(in crate::retarget) limb_count: usize,
    /// Whether a `floor` op behind decides how high feet are.
    pub(in crate::retarget) leaves_height: bool,
}

/// One foot or hand of the target.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct PlantedFoot {
    pub(in crate::retarget) limb: usize,
    /// Target length over source length: what moves of the source's are multiplied by.
    pub(in crate::retarget) scale: f64,
    /// Slots of ankle or wrist, and of the joint of the ball.
    pub(in crate::retarget) end: usize,
    pub(in crate::retarget) ball: Option<usize>,
    /// The back of the heel, the ball and the tip of the toes: the slot that each is fixed to, and from there in its axes.
    pub(in crate::retarget) points: [Option<(usize, DVec3)>; 3],
    /// Front and left at rest in the axes of the end, of feet that may be leveled.
    pub(in crate::retarget) axes: Option<FootAxes>,
    /// How much of its turns it loses while it stands.
    pub(in crate::retarget) steadied: Steadied,
    /// Below this speed a point of the source stands still, in plan units per second.
    pub(in crate::retarget) still_speed: f64,
    /// A foot that is moved faster than this where it is held is in the air, in plan units per second.
    pub(in crate::retarget) landing_speed: f64,
    /// How far a foot may swing out beyond its goals on its way from and to a contact, in plan units.
    pub(in crate::retarget) swing: f64,
    /// By how much it is moved at most to go along with a floor that runs, in plan units.
    pub(in crate::retarget) carried: f64,
}

/// The change of one limb at one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::retarget) struct Correction {
    pub(in crate::retarget) offset: DVec3,
    /// How much it is one of a contact, 0 to 1.
    pub(in crate::retarget) hold: f64,
}

impl PlantedFoot {
    /// Where heel, ball and tip stand when the end is at its goal. A target without one of them is held by its heel.
    fn places(&self, pose: &Pose, goal: &Goal) -> [DVec3; 3] {
        let end = pose.model[self.end];
        let turn = goal.rotation * end.rotation.conjugate();
        let heel = self.points[0].unwrap_or((self.end, DVec3::ZERO));
        self.points.map(|point| point.unwrap_or(heel)).map(|(slot, offset)| {
            let joint = pose.model[slot];
            goal.position + turn * (joint.translation + joint.rotation * offset - end.translation)
        })
    }
}

impl PlantStage {
    /// Where the points of feet are on both sides; nothing of a foot of which none is known to touch.
    fn read(&self, work: &Work<'_>) -> Result<Vec<Option<Foot>>, Canceled> {
        let fill = |pose: &mut Pose, frame: usize, row: &mut [[DVec3; 3]]| {
            self.posing.fill_model(pose, &work.target, frame);
            for (foot, places) in self.feet.iter().zip(row) {
                let goal = &work.goals[frame * self.limb_count + foot.limb];
                *places = foot.places(pose, goal);
            }
        };
        let width = self.feet.len();
        let rows = work.rows(width, || self.posing.pose(), fill)?;
        let read = |(index, foot): (usize, &PlantedFoot)| {
            let tracks = Part::ALL.map(|part| work.contacts.find(foot.limb, part));
            tracks.iter().flatten().next()?;
            Some(Foot {
                scale: foot.scale,
                still_speed: foot.still_speed,
                landing_speed: foot.landing_speed,
                swing: foot.swing,
                tracks: tracks.map(|point| point.map(|point| PointTrack::of(point, work.performed))),
                has_point: foot.points.map(|point| point.is_some()),
                targets: rows.iter().skip(index).step_by(width).copied().collect(),
                running_floor: None,
            })
        };
        Ok(self.feet.par_iter().enumerate().map(read).collect())
    }

    fn corrections(&self, foot: &Foot, times: &[f64], period: Option<usize>) -> Vec<Correction> {
        let mut corrections = vec![Correction::default(); times.len()];
        let touches: Vec<bool> = (0..times.len()).map(|frame| foot.touches(frame)).collect();
        let mut contacts = runs(&touches);
        let mut room = WeightsRoom::default();
        for (first, last) in &mut contacts {
            self.hold(foot, times, (*first, period), &mut room, &mut corrections[*first..=*last]);
            (*first, *last) = foot.landed(&corrections, times, (*first, *last));
        }
        let mut before: Option<usize> = None;
        for &(first, last) in &contacts {
            fade(&mut corrections, times, before, Some(first), self.op.blend_seconds, foot.swing);
            before = Some(last);
        }
        fade(&mut corrections, times, before, None, self.op.blend_seconds, foot.swing);
        corrections
    }

    /// What a point should move from a frame to the next, minus what it does.
    fn missing_step(&self, foot: &Foot, part: usize, frame: usize) -> DVec3 {
        let Some(of_source) = foot.source_step(part, frame) else { return DVec3::ZERO };
        let of_target = foot.target_step(part, frame);
        let along = |step: DVec3| step.reject_from_normalized(self.up);
        let less = match (foot.running_floor, self.op.mode) {
            (Some(floor), _) => along(of_source) * (1.0 - floor.share),
            (None, PlantMode::Always) => of_source,
            (None, _) => foot.spared(part, frame, along(of_source), along(of_target)),
        };
        of_source - less - of_target
    }

    /// Fills in what is to be added to the goals of one contact, which begins at `first`. One that lasts longer than the period of a clip that
    /// is repeated never ends.
    fn hold(
        &self,
        foot: &Foot,
        times: &[f64],
        (first, period): (usize, Option<usize>),
        room: &mut WeightsRoom,
        contact: &mut [Correction],
    ) {
        let weights = foot.weights(times, first, first + contact.len() - 1, room);
        let mut offset = DVec3::ZERO;
        for (index, correction) in contact.iter_mut().enumerate() {
            *correction = Correction { offset, hold: 1.0 };
            let Some(after) = weights.get(index + 1) else { break };
            let frame = first + index;
            let weights = ((weights[index] + *after) / 2.0).to_array();
            let step: DVec3 = weights
                .into_iter()
                .enumerate()
                .map(|(part, weight)| self.missing_step(foot, part, frame) * weight)
                .sum();
            offset += foot.held(step, times[frame + 1] - times[frame]);
        }
        if let Some(period) = period.filter(|period| *period < contact.len()) {
            foot.come_back(first, period, contact);
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
        let skipped = (contact.len() as f64 * ENDS).floor() as usize;
        let middle = &contact[skipped..contact.len() - skipped];
        let mean = middle.iter().map(|correction| correction.offset).sum::<DVec3>() / middle.len() as f64;
        for correction in contact {
            let mut offset = correction.offset - mean;
            let raised = self.up * offset.dot(self.up);
            if let Some(floor) = foot.running_floor {
                offset = floor.limited(offset - raised) + raised;
            }
            correction.offset = match self.op.mode {
                PlantMode::Grounding => raised,
                _ if self.leaves_height => offset - raised,
                _ => offset,
            };
        }
    }
}

impl Stage for PlantStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        if self.op.mode == PlantMode::Never {
            return Ok(());
        }
        self.level(work);
        self.steady(work)?;
        let mut feet = self.read(work)?;
        if work.contacts.does_floor_run {
            let share = self.floor_share(&feet, work.clock.own());
            for (foot, planted) in feet.iter_mut().zip(&self.feet) {
                let floor = RunningFloor { share, most: planted.carried };
                foot.iter_mut().for_each(|foot| foot.running_floor = Some(floor));
            }
        }
        let period = work.clock.period();
        let correct = |foot: &Option<Foot>| foot.as_ref().map(|foot| self.corrections(foot, work.performed, period));
        let corrections: Vec<Option<Vec<Correction>>> = feet.par_iter().map(correct).collect();
        work.change_goals(self.limb_count, |work, frame, goals| {
            let alpha = self.schedule.alpha_at(work.moment(frame));
            for (foot, corrections) in self.feet.iter().zip(&corrections) {
                let Some(correction) = corrections.as_ref().map(|corrections| corrections[frame]) else { continue };
                let goal = &mut goals[foot.limb];
                goal.position += correction.offset * alpha;
                goal.hold = goal.hold.max(correction.hold * alpha);
            }
        })
    }
}

/// Room for the weights of one contact after the other.
#[derive(Default)]
struct WeightsRoom {
    raw: Vec<DVec3>,
    smooth: Vec<DVec3>,
}

/// One foot of both sides over the clip. Arrays of three: end, ball and tip.
struct Foot {
    scale: f64,
    still_speed: f64,
    landing_speed: f64,
    swing: f64,
    tracks: [Option<PointTrack>; 3],
    has_point: [bool; 3],
    /// Where the target's points are when the end is at its goal.
    targets: Vec<[DVec3; 3]>,
    /// Nothing where the floor stands.
    running_floor: Option<RunningFloor>,
}

/// A point of the source over the clip.
struct PointTrack {
    positions: Vec<DVec3>,
    /// Per second.
    speeds: Vec<f64>,
    touches: Vec<bool>,
}

impl PointTrack {
    fn of(point: &ContactPoint, times: &[f64]) -> Self {
        let positions = point.positions.clone();
        Self { speeds: speeds(&positions, times), positions, touches: point.touches.clone() }
    }
}

impl Foot {
    fn touches(&self, frame: usize) -> bool {
        self.tracks.iter().flatten().any(|track| track.touches[frame])
    }

    /// How much each point is held at every frame of a contact; the sum is 1. The foot turns about the point that is most still: of
    /// a heel that lifts and a ball that stands it is the ball.
    fn weights<'r>(&self, times: &[f64], first: usize, last: usize, room: &'r mut WeightsRoom) -> &'r [DVec3] {
        let still = |frame: usize, track: &PointTrack| {
            let share = track.speeds[frame] / self.still_speed.max(f64::MIN_POSITIVE);
            if track.touches[frame] { (1.0 + share * share).recip() } else { 0.0 }
        };
        let of_frame = |frame: usize| {
            let still = self.tracks.each_ref().map(|track| track.as_ref().map_or(0.0, |track| still(frame, track)));
            let still = DVec3::from(still);
            still / still.element_sum().max(f64::MIN_POSITIVE)
        };
        room.raw.clear();
        room.raw.extend((first..=last).map(of_frame));
        let used = std::mem::take(&mut room.smooth);
        room.smooth = smoothed_in(used, &room.raw, &times[first..=last], ROLL_SECONDS);
        &room.smooth
    }

    /// Takes from the corrections of a contact that never ends what they add up to in a period: a foot that turns about its heel and back about
    /// its ball would get farther at every pass. It is taken away while the source's foot moves, where it is seen least.
    fn come_back(&self, first: usize, period: usize, contact: &mut [Correction]) {
        let pairs = contact.len() - period;
        let gone: DVec3 = (0..pairs).map(|frame| contact[frame + period].offset - contact[frame].offset).sum();
        let per_period = gone / pairs as f64;
        let step = |frame: usize| {
            let steps = self.tracks.iter().flatten().map(|track| track.positions[frame + 1] - track.positions[frame]);
            steps.map(DVec3::length).sum::<f64>()
        };
        let way: f64 = (first..first + period).map(step).sum();
        if way <= 0.0 {
            return;
        }
        let mut share = 0.0;
        for (frame, correction) in (first..).zip(contact) {
            correction.offset -= per_period * share;
            if frame + 1 < self.targets.len() {
                share += step(frame) / way;
            }
        }
    }

    /// What a foot that stands is moved by within so many seconds, where it had to be moved by a step to stay where it is held.
    fn held(&self, step: DVec3, seconds: f64) -> DVec3 {
        let whole = self.landing_speed * seconds;
        let length = step.length();
        if length > DRAGS * whole { step * (approach(length, DRAGS * whole, MAX_HELD * whole) / length) } else { step }
    }

    /// The part of a contact in which the target's foot is down too. A figure with long feet beside its legs still hops when the tips of its
    /// toes touch; another one's feet are high in the air by then, and held they would be torn down.
    fn landed(
        &self,
        corrections: &[Correction],
        times: &[f64],
        (mut first, mut last): (usize, usize),
    ) -> (usize, usize) {
        let is_in_the_air = |frame: usize| {
            let way = corrections[frame].offset.distance(corrections[frame + 1].offset);
            way > self.landing_speed * (times[frame + 1] - times[frame])
        };
        while first < last && is_in_the_air(first) {
            first += 1;
        }
        while first < last && is_in_the_air(last - 1) {
            last -= 1;
        }
        (first, last)
    }

    /// The part of a slow step of the source's along the floor that the target's point does without: by itself it goes less far that way. A foot
    /// that creeps, as the joints of a capture do below a foot that stands, is not made to creep farther on the target.
    fn spared(&self, part: usize, frame: usize, of_source: DVec3, of_target: DVec3) -> DVec3 {
        let Some(track) = self.track_of(part) else { return DVec3::ZERO };
        let speed = f64::midpoint(track.speeds[frame], track.speeds[frame + 1]);
        let creeps = 1.0 - smootherstep(speed / (CREEPS * self.still_speed).max(f64::MIN_POSITIVE) - 1.0);
        let share = of_target.dot(of_source) / of_source.length_squared().max(f64::MIN_POSITIVE);
        of_source * ((1.0 - share.clamp(0.0, 1.0)) * creeps)
    }

    /// What the source's point moves from a frame to the next, scaled. A target without that point follows the source's end with its own.
    fn source_step(&self, part: usize, frame: usize) -> Option<DVec3> {
        let track = self.track_of(part)?;
        Some((track.positions[frame + 1] - track.positions[frame]) * self.scale)
    }

    /// The source's point that a point of the target follows.
    fn track_of(&self, part: usize) -> Option<&PointTrack> {
        if self.has_point[part] { &self.tracks[part] } else { &self.tracks[0] }.as_ref()
    }

    /// What the goal's point moves.
    fn target_step(&self, part: usize, frame: usize) -> DVec3 {
        self.targets[frame + 1][part] - self.targets[frame][part]
    }
}

fn plant_stage(stack: &StackBuilder<'_>, op: &PlantOp, resolved: &ResolvedOp) -> PlantStage {
    let points = |limb: usize| -> [Option<FootPoint>; 3] {
        let pair = stack.limb(limb);
        let joint = FootPoint { joint: pair.target.end, offset: DVec3::ZERO };
        if pair.limb.is_leg() { pair.target_foot.contacts } else { [Some(joint), None, None] }
    };
    let joints = resolved.limbs.iter().flat_map(|&limb| points(limb)).flatten().map(|point| point.joint);
    let balls = resolved.limbs.iter().flat_map(|&limb| {
        let joints = stack.limb(limb).target;
        [Some(joints.end), joints.ball]
    });
    let posing = stack.target_posing(joints.chain(balls.flatten()));
    let foot = |&limb: &usize| PlantedFoot {
        limb,
        scale: stack.rest(limb).length_ratio,
        end: posing.slot(stack.limb(limb).target.end),
        ball: stack.limb(limb).target.ball.map(|ball| posing.slot(ball)),
        points: points(limb).map(|point| point.map(|point| (posing.slot(point.joint), point.offset))),
        axes: foot_axes(stack, limb),
        steadied: steadied(stack, limb),
        still_speed: STILL_METERS_PER_SECOND * stack.legs().0,
        landing_speed: LANDING_METERS_PER_SECOND * stack.legs().1,
        swing: SWING_METERS * stack.legs().1,
        carried: CARRIED_METERS * stack.legs().1,
    };
    PlantStage {
        op: op.clone(),
        schedule: resolved.schedule.clone(),
        feet: resolved.limbs.iter().map(foot).collect(),
        up: stack.ground().up,
        limb_count: stack.limb_count(),
        leaves_height: false,
        posing,
    }
}

/// How the target's foot lies at rest, where it is not the source's but for its size.
fn foot_axes(stack: &StackBuilder<'_>, limb: usize) -> Option<FootAxes> {
    let pair = stack.limb(limb);
    let (source, target) = (pair.source.sole?, pair.target.sole?);
    let is_other = size_ratio(stack, limb, &source, &target).is_none();
    let ball = target.end_to_ball.filter(|_| is_other && !pair.has_stiff_foot)?;
    let up = -target.down[0]?;
    let front = (ball - up * ball.dot(up)).try_normalize()?;
    Some(FootAxes { front, left: up.cross(front) })
}

/// What a foot loses of its turns: by how large the target's is beside its leg, for a source of 1 and by the parts that both have.
fn steadied(stack: &StackBuilder<'_>, limb: usize) -> Steadied {
    let pair = stack.limb(limb);
    if pair.has_stiff_foot {
        return Steadied::of_stiff_foot();
    }
    let sizes = pair.source.sole.zip(pair.target.sole).map(|(source, target)| {
        let both =
            foot_parts(&source).into_iter().zip(foot_parts(&target)).filter_map(|(source, target)| source.zip(target));
        both.fold((0.0_f64, 0.0_f64), |sizes, parts| (sizes.0.max(parts.0.abs()), sizes.1.max(parts.1.abs())))
    });
    let (source, target) = sizes.unwrap_or_default();
    let is_known = source > 0.0 && target > 0.0;
    Steadied::of_size(if is_known { target / source / stack.rest(limb).length_ratio } else { 1.0 })
}

impl OpWork for PlantOp {
    fn compile(&self, op: &ResolvedOp, following: &[ResolvedOp], stack: &mut StackBuilder<'_>) {
        if self.mode == PlantMode::Never {
            return;
        }
        stack.need_goals(&op.limbs);
        let leaves_height = prepares(following, stack);
        let stage = PlantStage { leaves_height, ..plant_stage(stack, self, op) };
        stack.push(stage);
        stack.moves_feet = true;
        if self.pull_pelvis {
            stack.pull = Some((true, self.sideways_cost));
        }
    }

    fn changed(&self, op: &ResolvedOp, mapping: &Mapping) -> Vec<usize> {
        if self.mode == PlantMode::Never {
            return Vec::new();
        }
        op.shifted(mapping, self.pull_pelvis).into_iter().chain(op.limb_joints(mapping, true)).collect()
    }

    fn prepare_feet(&self, _op: &ResolvedOp, _stack: &mut StackBuilder<'_>) -> Ahead {
        Ahead::Nothing
    }

    fn report(&self, _op: &ResolvedOp, before: &[ResolvedOp], _limbs: &[LimbPair], reporter: &mut Reporter) {
        if !before.iter().any(|op| op.name() == "contacts") {
            reporter.warn(
                "plant_without_contacts",
                "ops",
                "plant holds feet during contacts, and no contacts op stands before it; nothing is held",
                "put {\"op\": \"contacts\"} before {\"op\": \"plant\"}",
            );
        }
    }
}

/// Feet are held as they are tilted: for a `floor` op behind, before anything holds them. Whether there is one.
fn prepares(following: &[ResolvedOp], stack: &mut StackBuilder<'_>) -> bool {
    let found = following.iter().map(|op| op.work.prepare_feet(op, stack)).find(|ahead| *ahead != Ahead::Nothing);
    found == Some(Ahead::Prepared)
}

impl OpSpec for PlantOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        context.push_on_limbs(&self.scope, Limbs::Legs, self.clone());
    }
}

#[cfg(test)]
mod tests;
