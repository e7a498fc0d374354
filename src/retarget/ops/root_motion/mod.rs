//! The figure's way over the floor, put onto its root joint or taken out. (docs/algorithm/clips.md.)

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::{RootAction, RootAxis, RootMotionOp, RootPlace, RootSource};

use crate::retarget::mapping::Ground;
use crate::retarget::stages::stage::Stage;
use crate::retarget::{
    mapping::Mapping,
    ops::{
        context::Context,
        op_spec::OpSpec,
        resolved::{OpWork, ResolvedOp},
        scope::Scope,
    },
    stages::builder::StackBuilder,
};
use glam::{DQuat, DVec3};

use super::schedule::Schedule;
use crate::model::{Canceled, Transform};

use crate::retarget::stages::{
    posing::{Pose, Posing},
    temporal::smoothed,
    work::{Change, Changed, Work},
};

/// Moves the figure's way.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct RootStage {
    schedule: Schedule,
    motion: RootMotion,
    ground: Ground,
    /// Whose way it is; only one of the two sides is used.
    source: Posing,
    target: Posing,
    /// The root, where there is one, then the joints that stay where they are or go back.
    changed: Vec<Changed>,
    slots: Vec<usize>,
    /// Where the joint whose way it is and the root are at rest, in plan space.
    way_rest: Transform,
    root_rest: Transform,
    /// How the rest pose's left, up and front become positions that count: 1 along the axes of the way.
    along: glam::DMat3,
    /// How much higher the result's floor is than that of the rest pose.
    raised: DVec3,
}

/// A place on the way: how far, and the heading in radians.
#[derive(Clone, Copy, Debug, Default)]
struct Way {
    position: DVec3,
    heading: f64,
}

impl RootStage {
    pub(in crate::retarget) fn new(stack: &StackBuilder<'_>, motion: &RootMotion, schedule: &Schedule) -> Self {
        let ground = stack.ground();
        let kept = stack.topmost_driven_below(motion.root);
        let root = motion.root.map(|joint| Changed { joint, rotates: true, moves: true });
        let kept = kept.into_iter().filter(|joint| Some(*joint) != motion.root);
        let changed: Vec<Changed> =
            root.into_iter().chain(kept.map(|joint| Changed { joint, rotates: true, moves: true })).collect();
        let target = stack.target_posing(changed.iter().map(|changed| changed.joint).chain([motion.pelvis]));
        let axes = ground.axes();
        let hold = stack.mapping.target_hold.to_model(stack.target);
        let rest = |joint: usize| stack.plan_from_target.then_child(&hold.transforms()[joint]);
        Self {
            schedule: schedule.clone(),
            motion: *motion,
            ground,
            source: stack.source_posing(motion.source),
            slots: changed.iter().map(|changed| target.slot(changed.joint)).collect(),
            target,
            changed,
            way_rest: motion.source.map_or_else(|| rest(motion.pelvis), |joint| stack.source_rest[joint]),
            root_rest: motion.root.map_or(Transform::IDENTITY, rest),
            along: axes * glam::DMat3::from_diagonal(motion.axes) * axes.transpose(),
            raised: ground.up * (ground.target_floor - ground.target_rest_floor),
        }
    }

    /// Where the root belongs.
    fn root(&self, way: Way, first: Way) -> Transform {
        let turn = |radians: f64| DQuat::from_axis_angle(self.ground.up, radians);
        let rest = self.root_rest;
        // Axes that are no part of the way stay as they are at rest.
        let off = |position: DVec3| self.along * (position - rest.translation);
        let (heading, moved) = match self.motion.place {
            RootPlace::BelowPelvis => {
                let up = self.ground.up;
                let height = up * (self.way_rest_on_target() - rest.translation).dot(up);
                (way.heading, off(way.position - self.along * height))
            }
            RootPlace::RestOffset => {
                let offset = rest.translation - self.way_rest_on_target();
                (way.heading, off(way.position + turn(way.heading) * offset))
            }
            RootPlace::FirstFrame => (way.heading - first.heading, self.along * (way.position - first.position)),
        };
        Transform {
            rotation: turn(heading) * rest.rotation,
            translation: rest.translation + moved + self.raised,
            ..rest
        }
    }

    /// Where the joint whose way it is stands at rest, as a place of the target.
    fn way_rest_on_target(&self) -> DVec3 {
        match self.motion.source {
            None => self.way_rest.translation,
            Some(_) => self.on_target(self.way_rest.translation, self.ground.source_rest_floor),
        }
    }

    /// A place of the source as one of the target.
    fn on_target(&self, place: DVec3, floor: f64) -> DVec3 {
        let Ground { up, travel, target_rest_floor, .. } = self.ground;
        travel * (place - up * floor) + up * target_rest_floor
    }

    /// What takes a figure on its way back to where the way begins.
    fn back(&self, way: Way, first: Way, alpha: f64) -> Transform {
        let rotation = DQuat::from_axis_angle(self.ground.up, (first.heading - way.heading) * alpha);
        let begin = way.position + self.along * (first.position - way.position) * alpha;
        Transform { rotation, translation: begin - rotation * way.position, ..Transform::IDENTITY }
    }

    fn ways(&self, work: &Work<'_>) -> Result<Vec<Way>, Canceled> {
        let fill = |(source, target): &mut (Pose, Pose), frame: usize, row: &mut [Way]| {
            let (now, position) = match self.motion.source {
                None => {
                    self.target.fill(target, &work.target, frame);
                    let now = target.model[self.target.slot(self.motion.pelvis)];
                    (now, now.translation - self.raised)
                }
                Some(joint) => {
                    self.source.fill(source, work.source, frame);
                    let now = source.model[self.source.slot(joint)];
                    (now, self.on_target(now.translation, self.ground.source_floor))
                }
            };
            let heading = if self.motion.turn { self.heading(now.rotation) } else { 0.0 };
            row[0] = Way { position, heading };
        };
        let mut ways = work.rows(1, || (self.source.pose(), self.target.pose()), fill)?;
        unwrap(&mut ways);
        let seconds = self.motion.smoothing_seconds / 2.0;
        if seconds > 0.0 {
            smooth(&mut ways, work.performed, seconds);
        }
        Ok(ways)
    }

    /// How far the joint is turned about up from its rest pose.
    fn heading(&self, rotation: DQuat) -> f64 {
        let change = rotation * self.way_rest.rotation.conjugate();
        let front = change * self.ground.front;
        let left = self.ground.up.cross(self.ground.front);
        front.dot(left).atan2(front.dot(self.ground.front))
    }
}

impl Stage for RootStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let ways = self.ways(work)?;
        let first = ways.get(work.clock.own().start).copied().unwrap_or_default();
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Change]| {
            self.target.fill(pose, &work.target, frame);
            let alpha = self.schedule.alpha_at(work.moment(frame));
            let (root, kept) = match self.motion.root {
                Some(_) => row.split_first_mut().map_or((None, &mut [][..]), |(root, kept)| (Some(root), kept)),
                None => (None, row),
            };
            // What the parents of kept joints are moved by, and what they are moved by themselves, in plan space.
            let mut carried = Transform::IDENTITY;
            let mut moved = Transform::IDENTITY;
            if let Some(change) = root {
                let slot = self.slots[0];
                let (now, above) = (pose.model[slot], self.target.parent_of(pose, slot));
                let wanted = self.root(ways[frame], first);
                let placed = Transform {
                    rotation: now.rotation.slerp(wanted.rotation, alpha),
                    translation: now.translation.lerp(wanted.translation, alpha),
                    ..now
                };
                let local = above.relative(&placed);
                *change =
                    Change { rotation: local.rotation.normalize().as_quat(), translation: local.translation.as_vec3() };
                let turn = (placed.rotation * now.rotation.conjugate()).normalize();
                carried =
                    Transform { rotation: turn, translation: placed.translation - turn * now.translation, ..carried };
            } else {
                moved = self.back(ways[frame], first, alpha);
            }
            for (change, &slot) in kept.iter_mut().zip(&self.slots[usize::from(self.motion.root.is_some())..]) {
                let above = carried.then_child(&self.target.parent_of(pose, slot));
                let local = above.relative(&moved.then_child(&pose.model[slot]));
                *change =
                    Change { rotation: local.rotation.normalize().as_quat(), translation: local.translation.as_vec3() };
            }
        };
        let rows = work.rows(self.changed.len(), || self.target.pose(), fill)?;
        work.write(&self.changed, &rows);
        Ok(())
    }
}

/// Smooths what a way deviates from the even one between its ends: else it would lag behind at both.
fn smooth(ways: &mut [Way], times: &[f64], deviation_seconds: f64) {
    let (Some(first), Some(last)) = (ways.first().copied(), ways.last().copied()) else { return };
    let duration = (times[times.len() - 1] - times[0]).max(f64::MIN_POSITIVE);
    let even = |frame: usize| {
        let share = (times[frame] - times[0]) / duration;
        (first.position.lerp(last.position, share), first.heading + (last.heading - first.heading) * share)
    };
    let off = |(frame, way): (usize, &Way)| (way.position - even(frame).0, DVec3::X * (way.heading - even(frame).1));
    let (positions, headings): (Vec<DVec3>, Vec<DVec3>) = ways.iter().enumerate().map(off).unzip();
    let positions = smoothed(&positions, times, deviation_seconds);
    let headings = smoothed(&headings, times, deviation_seconds);
    for (frame, way) in ways.iter_mut().enumerate() {
        let (position, heading) = even(frame);
        *way = Way { position: position + positions[frame], heading: heading + headings[frame].x };
    }
}

/// Headings that go on instead of jumping by a whole turn.
fn unwrap(ways: &mut [Way]) {
    let mut before = 0.0;
    for way in ways {
        let turns = ((way.heading - before) / std::f64::consts::TAU).round();
        way.heading -= turns * std::f64::consts::TAU;
        before = way.heading;
    }
}

/// How the figure's way is moved.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct RootMotion {
    /// The root joint of the target; nothing where the way is taken out.
    pub(in crate::retarget) root: Option<usize>,
    /// The joint whose way it is: the pelvis of the target.
    pub(in crate::retarget) pelvis: usize,
    /// The source joint whose way it is instead.
    pub(in crate::retarget) source: Option<usize>,
    /// 1 for axes along which it is: left, up, front.
    pub(in crate::retarget) axes: DVec3,
    /// Whether the heading is part of it.
    pub(in crate::retarget) turn: bool,
    /// Where the root stands.
    pub(in crate::retarget) place: RootPlace,
    /// Standard deviation of the smoothing.
    pub(in crate::retarget) smoothing_seconds: f64,
}

impl OpWork for RootMotion {
    /// The way is counted from the first frame of the clip.
    fn spans_cuts(&self) -> bool {
        true
    }

    fn compile(&self, op: &ResolvedOp, _following: &[ResolvedOp], stack: &mut StackBuilder<'_>) {
        stack.close();
        let stage = RootStage::new(stack, self, &op.schedule);
        stack.push(stage);
    }

    fn changed(&self, _op: &ResolvedOp, _mapping: &Mapping) -> Vec<usize> {
        self.root.into_iter().chain([self.pelvis]).collect()
    }
}

impl OpSpec for RootMotionOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn looks_at_whole_clip(&self) -> bool {
        true
    }

    fn resolve(&self, context: &mut Context<'_>) {
        if let Some(motion) = resolve::resolve(self, context) {
            context.push(&self.scope, motion);
        }
    }
}
