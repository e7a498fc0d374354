//! When points of the source rest on something. (docs/algorithm/contacts.md.)
//!
//! The points of a foot are those of its sole: it begins to stand with the back of its heel, and leaves the floor with the tip of its
//! toes. A point touches while it is low and slow, over a floor that runs where the figure walks on the spot (`treadmill`). Both tests
//! have hysteresis; heels strike the floor faster than toes leave it, so that a contact is followed back to a higher speed than forward.
//! The thresholds are chosen so that contacts begin and end where feet are farthest before and behind the pelvis in walks (Zeni,
//! Richards and Higginson, Two simple methods for determining gait events during treadmill and overground walking using kinematic
//! data, 2008).

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::{ContactFloor, ContactFloorRule, ContactsOp};

use crate::retarget::mapping::{Ground, LimbPair};
use crate::retarget::raised_ground::{FootHeights, over_floors, own_floors, raised_ground};
use crate::retarget::stages::stage::Stage;
use crate::retarget::treadmill::{FootWay, floor_velocity};
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
    retarget::ops::source_curves::contact_spans,
    rig::error::{SpecErrorKind, SpecField},
};
use resolve::take_contacts;
use std::{collections::BTreeMap, ops::Range};

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    model::Canceled,
    rig::{FootPoint, Limb},
};

use crate::retarget::stages::{
    clock::Moment,
    contact_points::{ContactPoint, ContactPoints, Part},
    posing::Posing,
    temporal::{forward_speeds, median, runs, smoothed, speeds},
    work::Work,
};

/// Width of a bin of the histogram of heights, for a leg of 1 m.
const BIN_METERS: f64 = 0.005;
/// Resting levels are looked for within this height above the lowest slow one.
const LEVEL_REACH_METERS: f64 = 0.1;
/// Two feet whose levels differ by more than this do not both rest on the floor; the lower one does.
const LEVEL_AGREEMENT_METERS: f64 = 0.05;
/// A heel whose level is more than this above the lowest one of its foot is raised for the whole clip, as in a dance on the toes.
const RAISED_HEEL_METERS: f64 = 0.08;
/// Downhill a heel that stands is higher than its toes by so much more: as ground falls below a foot of a quarter of a leg that slopes by 9°.
const DOWNHILL_METERS: f64 = 0.04;
/// Points of a foot that stands above the floor are so far above or below its lowest one at most: on slopes feet are tilted.
const SLOPING_METERS: f64 = 0.08;
/// A figure whose feet never come nearer to the floor than this, at a leg of 1 m, is in the air, however slow they are.
const AIRBORNE_METERS: f64 = 0.1;

/// Finds contacts.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct ContactStage {
    op: ContactsOp,
    points: Vec<Point>,
    /// The two feet of a figure that has two, for ground above the floor.
    walkers: Option<[Walker; 2]>,
    posing: Posing,
    ground: Ground,
    /// Plan units of a meter at a leg of 1 m: thresholds are multiplied by this.
    scale: f64,
    frames: [usize; 2],
}

/// A foot on which a figure walks.
#[derive(Clone, Copy, Debug)]
struct Walker {
    limb: usize,
    /// Index of the point by which it stands: its ball, else its heel.
    point: usize,
    /// Slot of its hip.
    hip: usize,
}

#[derive(Clone, Copy, Debug)]
struct Point {
    name: &'static str,
    limb: usize,
    part: Part,
    slot: usize,
    /// To the sole, in the joint's axes.
    sole: DVec3,
}

impl ContactStage {
    /// `leg` is the length of the source's leg in plan units. Hands count only where the mask names them.
    pub(in crate::retarget) fn new(
        op: &ContactsOp,
        frames: [usize; 2],
        limbs: &[LimbPair],
        posing: impl Fn(&[usize]) -> Posing,
        ground: Ground,
        leg: f64,
    ) -> Self {
        let mut points = Vec::new();
        for (limb, pair) in limbs.iter().enumerate() {
            let hand = [Some(FootPoint { joint: pair.source.end, offset: DVec3::ZERO }), None, None];
            let places = if pair.limb.is_leg() { pair.source_foot.contacts } else { hand };
            for ((name, part), place) in pair.limb.contact_points().into_iter().zip(Part::ALL).zip(places) {
                if let Some(FootPoint { joint, offset: sole }) = place.filter(|_| is_wanted(op, pair.limb, name)) {
                    points.push((Point { name, limb, part, slot: 0, sole }, joint));
                }
            }
        }
        let feet = [Limb::LeftLeg, Limb::RightLeg].map(|leg| limbs.iter().position(|pair| pair.limb == leg));
        let hips = feet.into_iter().flatten().map(|limb| limbs[limb].source.start);
        let joints: Vec<usize> = points.iter().map(|(_, joint)| *joint).chain(hips).collect();
        let posing = posing(&joints);
        let points: Vec<Point> =
            points.into_iter().map(|(point, joint)| Point { slot: posing.slot(joint), ..point }).collect();
        let walker = |limb: Option<usize>| {
            let limb = limb?;
            let part = |part: Part| points.iter().position(|point| point.limb == limb && point.part == part);
            let point = part(Part::Ball).or_else(|| part(Part::End))?;
            Some(Walker { limb, point, hip: posing.slot(limbs[limb].source.start) })
        };
        let walkers = walker(feet[0]).zip(walker(feet[1])).map(|(left, right)| [left, right]);
        Self { op: op.clone(), points, walkers, posing, ground, scale: leg, frames }
    }

    /// The velocity of the floor; zero where it stands. The clip alone decides, as it does for the measures.
    fn floor_velocity(&self, tracks: &[Tracked], work: &Work<'_>) -> DVec3 {
        let of_balls = self.points.iter().zip(tracks).filter(|(point, _)| point.part == Part::Ball);
        let own = work.clock.own();
        let feet: Vec<FootWay<'_>> = of_balls.map(|(_, track)| track.way(own.clone())).collect();
        floor_velocity(&feet, &work.performed[own], self.ground.up, self.scale, self.op.speed_on * self.scale)
            .unwrap_or_default()
    }

    /// The height at which a point rests most often, among those at which it is slow.
    fn level(&self, track: &Tracked) -> f64 {
        let slow = self.op.speed_off * self.scale;
        let mut heights: Vec<f64> = track
            .heights
            .iter()
            .zip(&track.speeds)
            .filter(|(_, speed)| **speed < slow)
            .map(|(height, _)| *height)
            .collect();
        if heights.is_empty() {
            heights.clone_from(&track.heights);
        }
        heights.sort_by(f64::total_cmp);
        let lowest = heights[heights.len() / 50];
        let bin = BIN_METERS * self.scale;
        if bin <= 0.0 {
            return lowest;
        }
        let mut counts = BTreeMap::new();
        for height in heights.iter().filter(|height| **height - lowest < LEVEL_REACH_METERS * self.scale) {
            #[expect(clippy::cast_possible_truncation, reason = "at most twenty bins above the lowest, few below")]
            let index = ((height - lowest) / bin).round() as i64;
            *counts.entry(index).or_insert(0_usize) += 1;
        }
        // A window of three bins, so that a level on a border is not split; the lowest of equals.
        let count = |index: i64| counts.get(&index).copied().unwrap_or(0);
        let best = counts
            .keys()
            .max_by_key(|&&index| (count(index - 1) + 2 * count(index) + count(index + 1), std::cmp::Reverse(index)));
        best.map_or(lowest, |&index| lowest + index as f64 * bin)
    }

    /// A foot that is only ever slow in the air takes the level of the other one.
    fn agreed(&self, point: &Point, level: f64, levels: &[f64]) -> f64 {
        let twins = self.points.iter().zip(levels).filter(|(other, _)| other.part == point.part);
        let lowest = twins.map(|(_, level)| *level).fold(level, f64::min);
        if level - lowest > LEVEL_AGREEMENT_METERS * self.scale { lowest } else { level }
    }

    /// Whether the feet are in the air all along, as in the loop of a fall.
    fn is_airborne(&self, tracks: &[Tracked]) -> bool {
        let lowest = tracks.iter().flat_map(|track| &track.heights).copied().fold(f64::INFINITY, f64::min);
        self.op.floor == ContactFloor::Rule(ContactFloorRule::Adaptive)
            && lowest - self.ground.source_floor > AIRBORNE_METERS * self.scale
    }

    /// The floors below the two feet of a figure, by the levels at which points rest.
    fn floors(&self, levels: &[f64]) -> [f64; 2] {
        let level = |limb: usize| {
            let of_foot = |index: &usize| {
                let point = &self.points[*index];
                point.limb == limb && !self.is_sunk(point, levels[*index], levels)
            };
            (0..levels.len()).filter(of_foot).map(|index| levels[index]).fold(f64::INFINITY, f64::min)
        };
        self.walkers
            .as_ref()
            .map_or([0.0; 2], |walkers| own_floors(walkers.each_ref().map(|walker| level(walker.limb)), self.scale))
    }

    /// The ground above the floor that the feet of a figure stand on: limb by limb, how high it is, frame by frame; not a number where the foot is on
    /// the floor or in the air. `hip` says where the hip of each of the two feet is.
    fn raised<I: Iterator<Item = DVec3>>(
        &self,
        tracks: &[Tracked],
        floors: [f64; 2],
        hip: impl Fn(usize) -> I,
        work: &Work<'_>,
    ) -> Vec<(usize, Vec<f64>)> {
        let is_adaptive = self.op.detect && self.op.floor == ContactFloor::Rule(ContactFloorRule::Adaptive);
        let Some(walkers) = self.walkers.as_ref().filter(|_| is_adaptive) else { return Vec::new() };
        // A foot that stands on its heel alone is on the floor.
        let above_floor = [0, 1].map(|foot| {
            let (walker, floor) = (&walkers[foot], floors[foot]);
            let of_foot = self.points.iter().zip(tracks).filter(|(point, _)| point.limb == walker.limb);
            let mut above = vec![f64::INFINITY; work.frame_count()];
            for (_, track) in of_foot {
                let heights = above.iter_mut().zip(&track.heights);
                heights.for_each(|(above, height)| *above = above.min(height - floor));
            }
            above
        });
        let hips = [0, 1].map(|foot| {
            let heights = &tracks[walkers[foot].point].heights;
            hip(foot).zip(heights).map(|(hip, foot)| hip.dot(self.ground.up) - foot).collect::<Vec<f64>>()
        });
        let feet = [0, 1].map(|foot| FootHeights {
            above_floor: &above_floor[foot],
            speeds: &tracks[walkers[foot].point].speeds,
            hip: &hips[foot],
        });
        let grounds = raised_ground(&feet, work.performed, self.scale).into_iter();
        let heights = grounds.flat_map(|grounds| over_floors(grounds, floors));
        walkers.iter().zip(heights).map(|(walker, heights)| (walker.limb, heights)).collect()
    }

    /// Whether it is a tip that rests where no floor is: below where a foot stands on heel and ball.
    fn is_sunk(&self, point: &Point, level: f64, levels: &[f64]) -> bool {
        let most = LEVEL_AGREEMENT_METERS * self.scale;
        let heels = self.points.iter().zip(levels).filter(|(heel, _)| heel.part == Part::End);
        let stands = |(heel, heel_level): (&Point, &f64)| {
            let mut of_foot = self.points.iter().zip(levels).filter(|(other, _)| other.limb == heel.limb);
            let ball = of_foot.find(|(other, _)| other.part == Part::Ball).map(|(_, level)| *level)?;
            ((ball - heel_level).abs() <= most).then_some(ball.min(*heel_level))
        };
        let floor = heels.filter_map(stands).reduce(f64::min);
        point.part == Part::Tip && floor.is_some_and(|floor| floor - level > most)
    }

    /// Whether it is the heel of a foot that stands on its toes alone.
    fn is_raised(&self, index: usize, levels: &[f64]) -> bool {
        let point = &self.points[index];
        let of_foot = self.points.iter().zip(levels).filter(|(other, _)| other.limb == point.limb);
        let lowest = of_foot.map(|(_, level)| *level).fold(levels[index], f64::min);
        point.part == Part::End && levels[index] - lowest > RAISED_HEEL_METERS * self.scale
    }

    /// The same in clips of slopes and stairs, where a heel may rest higher than other points of its foot do elsewhere: whether it is above its
    /// foot while it rests.
    fn is_above_its_foot(&self, index: usize, tracks: &[Tracked]) -> bool {
        let of_foot = |(other, _): &(&Point, &Tracked)| other.limb == self.points[index].limb;
        let lowest = |frame: usize| {
            let heights = self.points.iter().zip(tracks).filter(of_foot).map(|(_, track)| track.heights[frame]);
            heights.fold(f64::INFINITY, f64::min)
        };
        let (heel, slow) = (&tracks[index], self.op.speed_on * self.scale);
        let resting = (0..heel.heights.len()).filter(|frame| heel.speeds[*frame] < slow);
        let mut above: Vec<f64> = resting.map(|frame| heel.heights[frame] - lowest(frame)).collect();
        median(&mut above).is_none_or(|above| above > (RAISED_HEEL_METERS + DOWNHILL_METERS) * self.scale)
    }

    /// `level` is the height at which the point rests; nothing where it never does.
    fn touches(
        &self,
        point: &Point,
        track: &Tracked,
        level: Option<f64>,
        raised: &[f64],
        work: &Work<'_>,
    ) -> Vec<bool> {
        let (op, frames) = (&self.op, work.frame_count());
        let within = |ranges: Option<&Vec<[f64; 2]>>, time: f64| {
            ranges.is_some_and(|ranges| ranges.iter().any(|[from, to]| (*from..=*to).contains(&time)))
        };
        let mut touches = match (op.set.get(point.name), op.detect) {
            (Some(set), _) => (0..frames).map(|frame| within(Some(set), work.moment(frame).seconds)).collect(),
            (None, false) => vec![false; frames],
            (None, true) => {
                level.map_or_else(|| vec![false; frames], |level| self.detect(track, level, raised, work.performed))
            }
        };
        for (frame, touches) in touches.iter_mut().enumerate() {
            let Moment { frame, seconds } = work.moment(frame);
            *touches |= within(op.add.get(point.name), seconds);
            *touches &= !within(op.remove.get(point.name), seconds);
            *touches &= (self.frames[0]..=self.frames[1]).contains(&frame);
        }
        touches
    }

    /// `raised` is how high the ground is under the foot where it stands above the floor, frame by frame; empty where it never does.
    fn detect(&self, track: &Tracked, level: f64, raised: &[f64], times: &[f64]) -> Vec<bool> {
        let op = &self.op;
        let level = match op.floor {
            ContactFloor::Rule(ContactFloorRule::Adaptive) => Some(level),
            ContactFloor::Rule(ContactFloorRule::Any) => None,
            ContactFloor::Height(meters) => Some(meters * self.ground.units_per_meter),
        };
        let is_raised = |frame: usize| {
            let is_near = |ground: &f64| (track.heights[frame] - ground).abs() < SLOPING_METERS * self.scale;
            raised.get(frame).is_some_and(is_near)
        };
        // Above the floor a point is as low as where it rests, at the frame `rest`.
        let is_low = |frame: usize, rest: usize, height: f64| {
            let most = height * self.scale;
            let is_low = |level: f64| track.heights[frame] - level < most;
            let is_near = || (track.heights[frame] - track.heights[rest]).abs() < most;
            level.is_none_or(|level| is_low(level) || (is_raised(frame) && is_near()))
        };
        let mut rest: Option<usize> = None;
        let mut touches: Vec<bool> = (0..times.len())
            .map(|frame| {
                let since = rest.unwrap_or(frame);
                let (height, speed) = rest.map_or((op.height_on, op.speed_on), |_| (op.height_off, op.speed_off));
                let touches = is_low(frame, since, height) && track.speeds[frame] < speed * self.scale;
                rest = touches.then_some(since);
                touches
            })
            .collect();
        // The same backward: a contact begins where the point landed, not where it was slowest. A point has landed at the frame
        // from which on it rests; the way to that frame, which a central difference sees too, is not looked at.
        let has_landed = |frame: usize, rest: usize| {
            let speed = track.speeds[frame].min(track.forward_speeds[frame]);
            is_low(frame, rest, op.height_off) && speed < op.speed_land.max(op.speed_off) * self.scale
        };
        let mut rest: Option<usize> = None;
        for frame in (0..times.len()).rev() {
            rest = if touches[frame] { Some(frame) } else { rest.filter(|rest| has_landed(frame, *rest)) };
            touches[frame] = rest.is_some();
        }
        let missing: Vec<bool> = touches.iter().map(|touches| !touches).collect();
        for (first, last) in runs(&missing) {
            let is_between = first > 0 && last + 1 < times.len();
            if is_between && times[last + 1] - times[first - 1] < op.gap_seconds {
                touches[first..=last].fill(true);
            }
        }
        for (first, last) in runs(&touches) {
            if times[last] - times[first] < op.least_seconds && last - first + 1 < times.len() {
                touches[first..=last].fill(false);
            }
        }
        touches
    }
}

impl Stage for ContactStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let (points, walkers) = (self.points.len(), self.walkers.as_ref().map_or(&[][..], |walkers| walkers));
        let width = points + walkers.len();
        let fill = |pose: &mut crate::retarget::stages::posing::Pose, frame: usize, row: &mut [DVec3]| {
            self.posing.fill_model(pose, work.source, frame);
            let (places, hips) = row.split_at_mut(points);
            for (point, place) in self.points.iter().zip(places) {
                let joint = pose.model[point.slot];
                *place = joint.translation + joint.rotation * point.sole;
            }
            walkers.iter().zip(hips).for_each(|(walker, hip)| *hip = pose.model[walker.hip].translation);
        };
        let rows = work.rows(width, || self.posing.pose(), fill)?;
        let column = |index: usize| rows.iter().skip(index).step_by(width.max(1)).copied();
        let tracks: Vec<Tracked> = (0..points)
            .into_par_iter()
            .map(|index| {
                Tracked::new(column(index).collect(), work.performed, &self.ground, self.op.smoothing_seconds / 2.0)
            })
            .collect();
        let floor_velocity = self.floor_velocity(&tracks, work);
        let over = |track: Tracked| track.over(floor_velocity, work.performed);
        let tracks: Vec<Tracked> =
            if floor_velocity == DVec3::ZERO { tracks } else { tracks.into_iter().map(over).collect() };
        let levels: Vec<f64> = tracks.par_iter().map(|track| self.level(track)).collect();
        let is_airborne = self.is_airborne(&tracks);
        let is_sunk = |index: usize| self.is_sunk(&self.points[index], levels[index], &levels);
        let floors = self.floors(&levels);
        let raised = if is_airborne || floor_velocity != DVec3::ZERO {
            Vec::new()
        } else {
            self.raised(&tracks, floors, |foot| column(points + foot), work)
        };
        let level_of = |index: usize| {
            let is_raised =
                self.is_raised(index, &levels) && (raised.is_empty() || self.is_above_its_foot(index, &tracks));
            (!is_airborne && !is_raised && !is_sunk(index))
                .then(|| self.agreed(&self.points[index], levels[index], &levels))
        };
        let resting: Vec<Option<f64>> = (0..points).map(level_of).collect();
        let point = |((point, track), level): ((&Point, Tracked), &Option<f64>)| {
            let ground = raised.iter().find(|(limb, _)| *limb == point.limb).map_or(&[][..], |(_, heights)| heights);
            let touches = self.touches(point, &track, *level, ground, work);
            let Point { name, limb, part, .. } = *point;
            ContactPoint { name, limb, part, positions: track.soles, touches }
        };
        let points: Vec<ContactPoint> = self.points.par_iter().zip(tracks).zip(&resting).map(point).collect();
        let is_touching = points.iter().any(|point| point.touches.contains(&true));
        work.contacts = ContactPoints {
            points,
            is_touching,
            does_floor_run: floor_velocity != DVec3::ZERO,
            level_below_raised_ground: (!raised.is_empty())
                .then_some(floors[0].min(floors[1]) - self.ground.source_floor),
        };
        Ok(())
    }
}

/// The source has points that can be looked at when the mask does not name any: feet.
fn is_wanted(op: &ContactsOp, limb: Limb, name: &str) -> bool {
    match &op.scope.mask {
        None => limb.is_leg() || op.set.contains_key(name) || op.add.contains_key(name),
        Some(mask) => mask.iter().any(|masked| masked == name || masked == limb.name()),
    }
}

/// One point over the clip.
struct Tracked {
    soles: Vec<DVec3>,
    /// The same, smoothed.
    smooth: Vec<DVec3>,
    heights: Vec<f64>,
    /// By central differences.
    speeds: Vec<f64>,
    /// To the next frame.
    forward_speeds: Vec<f64>,
}

impl Tracked {
    fn new(soles: Vec<DVec3>, times: &[f64], ground: &Ground, deviation_seconds: f64) -> Self {
        let smooth = smoothed(&soles, times, deviation_seconds);
        let heights = smooth.iter().map(|place| place.dot(ground.up)).collect();
        let (speeds, forward_speeds) = (speeds(&smooth, times), forward_speeds(&smooth, times));
        Self { soles, smooth, heights, speeds, forward_speeds }
    }

    fn way(&self, frames: Range<usize>) -> FootWay<'_> {
        FootWay { places: &self.smooth[frames.clone()], speeds: &self.speeds[frames] }
    }

    /// The same with speeds over a floor that runs.
    fn over(self, velocity: DVec3, times: &[f64]) -> Self {
        let places: Vec<DVec3> = self.smooth.iter().zip(times).map(|(place, time)| *place - velocity * *time).collect();
        Self { speeds: speeds(&places, times), forward_speeds: forward_speeds(&places, times), ..self }
    }
}

impl OpWork for ContactsOp {
    fn compile(&self, op: &ResolvedOp, _following: &[ResolvedOp], stack: &mut StackBuilder<'_>) {
        let posing = |joints: &[usize]| stack.source_posing(joints.iter().copied());
        let (limbs, ground) = (&stack.mapping.limbs, stack.ground());
        let stage = ContactStage::new(self, op.schedule.frames, limbs, posing, ground, stack.legs().0);
        stack.push(stage);
    }

    fn changed(&self, _op: &ResolvedOp, _mapping: &Mapping) -> Vec<usize> {
        Vec::new()
    }

    fn prepare_feet(&self, _op: &ResolvedOp, _stack: &mut StackBuilder<'_>) -> Ahead {
        Ahead::Nothing
    }
}

impl OpSpec for ContactsOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn changes_poses(&self) -> bool {
        false
    }

    fn looks_at_whole_clip(&self) -> bool {
        let by_time = [&self.set, &self.add, &self.remove];
        !self.curves.is_empty() || by_time.iter().any(|points| !points.is_empty())
    }

    fn check_names(&self, context: &mut Context<'_>) {
        let known: Vec<&str> = Limb::all().flat_map(Limb::contact_points).filter(|point| !point.is_empty()).collect();
        let times = [("set", &self.set), ("add", &self.add), ("remove", &self.remove)];
        let named = times.into_iter().flat_map(|(field, points)| points.keys().map(move |point| (field, point)));
        for (field, point) in named.chain(self.curves.keys().map(|point| ("curves", point))) {
            if !known.contains(&point.as_str()) {
                let detail = format!("there is no point of contact '{point}'");
                let pointer = format!("/ops/{}/{field}/{point}", context.index);
                let field = SpecField::new(SpecErrorKind::UnknownName, pointer, detail);
                context.fields.push(field.with_nearest(point, known.iter().copied()));
            }
        }
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let pointer = format!("/ops/{}/curves", context.index);
        let mut resolved = self.clone();
        resolved.set.extend(contact_spans(&self.curves, &pointer, context.source.scene, context.clip, context.fields));
        take_contacts(&mut resolved, context.limbs, context.source.skeleton(), context.clip);
        context.push_on_limbs(&self.scope, Limbs::All, resolved);
    }
}
