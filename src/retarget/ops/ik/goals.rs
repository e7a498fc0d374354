//! Goals for the ends of limbs. (docs/algorithm/legs.md.)

use super::spec::{IkGoal, IkOp};
use crate::retarget::mapping::Ground;
use crate::retarget::stages::stage::Stage;
use glam::{DMat3, DQuat, DVec3, EulerRot};

use crate::model::rotation::smootherstep;

use crate::model::Canceled;
use crate::retarget::ops::schedule::Schedule;

use crate::retarget::stages::{
    limbs::{LimbRest, LimbSlots},
    posing::{Pose, Posing},
    two_bone::arc,
    work::{Goal, Work, filled},
};

/// Share of its length that a middle joint lies off the line from start to end when its direction is fully trusted.
const SURE_POLE: f64 = 0.1;

/// Sets the goals of some limbs.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct GoalStage {
    pub(in crate::retarget) op: IkOp,
    /// The op's `rotation_offset`, where it is one.
    pub(in crate::retarget) rotation_offset: Option<DQuat>,
    pub(in crate::retarget) schedule: Schedule,
    pub(in crate::retarget) limbs: Vec<GoalLimb>,
    pub(in crate::retarget) source: Posing,
    pub(in crate::retarget) target: Posing,
    pub(in crate::retarget) ground: Ground,
    /// Of all limbs of the mapping.
    pub(in crate::retarget) limb_count: usize,
    /// What moves the pelvis beside its scale, where something does.
    pub(in crate::retarget) pelvis: Option<PelvisShift>,
}

/// How far goals stay behind when the pelvis is moved beside its scale. (docs/algorithm/forward-kinematics.md.)
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct PelvisShift {
    /// Slots of the two pelvises.
    pub(in crate::retarget) source: usize,
    pub(in crate::retarget) target: usize,
    /// Where the scale alone puts it: `rest + alpha · (matrix · source + offset − rest)`.
    pub(in crate::retarget) matrix: DMat3,
    pub(in crate::retarget) offset: DVec3,
    pub(in crate::retarget) alpha: f64,
    pub(in crate::retarget) rest: DVec3,
    /// How much goals go along, over the floor and up.
    pub(in crate::retarget) affects: [f64; 2],
}

impl PelvisShift {
    fn of(&self, source: &Pose, target: &Pose, up: DVec3) -> DVec3 {
        let scaled = self.matrix * source.model[self.source].translation + self.offset;
        let moved = target.model[self.target].translation - self.rest.lerp(scaled, self.alpha);
        let raised = up * moved.dot(up);
        raised * (self.affects[1] - 1.0) + (moved - raised) * (self.affects[0] - 1.0)
    }
}

/// One limb of the stage.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct GoalLimb {
    /// Index of the limb.
    pub(in crate::retarget) limb: usize,
    pub(in crate::retarget) source: LimbSlots,
    pub(in crate::retarget) target: LimbSlots,
    pub(in crate::retarget) rest: LimbRest,
}

/// The turn that an op's `rotation_offset` says.
pub(in crate::retarget) fn rotation_offset(op: &IkOp) -> Option<DQuat> {
    let [x, y, z] = op.rotation_offset.map(f64::to_radians);
    (op.rotation_offset != [0.0; 3]).then(|| DQuat::from_euler(EulerRot::XYZ, x, y, z))
}

impl GoalStage {
    fn goal(&self, limb: &GoalLimb, source: &Pose, target: &Pose, alpha: f64) -> Goal {
        let (op, rest) = (&self.op, &limb.rest);
        let [source_start, source_middle, source_end] = limb.source.places(source);
        let [start, middle, end] = limb.target.places(target);
        let of_source = source_end - source_start;
        let mut position = match op.goal {
            IkGoal::Fk => end,
            IkGoal::Limb => start + of_source * rest.length_ratio,
        };
        position += self.pelvis.map_or(DVec3::ZERO, |pelvis| pelvis.of(source, target, self.ground.up));
        position = start + (position - start) * op.extension;
        let up = self.ground.up;
        position += up * ((position.dot(up) - self.ground.target_floor) * (op.scale_vertical - 1.0));
        // Columns: left, up, front.
        let axes = DMat3::from_cols(up.cross(self.ground.front), up, self.ground.front);
        let toward_source = axes.transpose() * (source_end - position);
        position += axes * (toward_source * DVec3::from(op.blend_to_source_weights) * op.blend_to_source);
        position += axes * DVec3::from(op.offset) * self.ground.units_per_meter;

        let now = target.model[limb.target.end].rotation;
        let mut rotation = now;
        if op.blend_to_source_rotation > 0.0 {
            let wanted = source.model[limb.source.end].rotation * rest.target_from_source_end;
            rotation = now.slerp(wanted, op.blend_to_source_rotation);
        }
        if let Some(offset) = self.rotation_offset {
            rotation *= offset;
        }
        position += rotation * DVec3::from(op.local_offset) * self.ground.units_per_meter;

        let position = end.lerp(position, alpha);
        let lengths = source_middle.distance(source_start) + source_end.distance(source_middle);
        Goal {
            position,
            rotation: if alpha < 1.0 { now.slerp(rotation, alpha) } else { rotation },
            pole: self.pole([source_start, source_middle, source_end], [start, middle, position], rest),
            extension: if lengths > 0.0 { of_source.length() / lengths } else { 1.0 },
            length: middle.distance(start) + end.distance(middle),
            span: position.distance(start),
            ..Goal::default()
        }
    }

    /// Which way the target's middle joint should point for the source's sake; as long as that is sure.
    fn pole(&self, source: [DVec3; 3], target: [DVec3; 3], rest: &LimbRest) -> DVec3 {
        if self.op.align_pole == 0.0 {
            return DVec3::ZERO;
        }
        source_pole(source, target, if self.op.keep_pole_offset { rest.pole_angle } else { 0.0 })
    }
}

impl Stage for GoalStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let width = self.limb_count;
        let mut goals = std::mem::take(&mut work.goals);
        if goals.is_empty() {
            goals = filled(Goal::default(), work.frame_count() * width);
        }
        let fill = |(source, target): &mut (Pose, Pose), frame: usize, row: &mut [Goal]| {
            self.source.fill_model(source, work.source, frame);
            self.target.fill_model(target, &work.target, frame);
            let alpha = self.schedule.alpha_at(work.moment(frame));
            for limb in &self.limbs {
                row[limb.limb] = self.goal(limb, source, target, alpha);
            }
        };
        work.fill(&mut goals, width, || (self.source.pose(), self.target.pose()), fill)?;
        work.goals = goals;
        Ok(())
    }
}

/// Which way the middle of a limb should point for the source's sake, from the line between start and end, where that line is
/// turned to the target's; as long as that is sure, 0 to 1. `kept` is the angle between the bends at rest.
pub(in crate::retarget) fn source_pole(source: [DVec3; 3], target: [DVec3; 3], kept: f64) -> DVec3 {
    let (Some(source_line), Some(line)) =
        ((source[2] - source[0]).try_normalize(), (target[2] - target[0]).try_normalize())
    else {
        return DVec3::ZERO;
    };
    let bent = source[1] - source[0];
    let off = bent - source_line * bent.dot(source_line);
    let sure = smootherstep(off.length() / (SURE_POLE * bent.length().max(f64::MIN_POSITIVE)));
    let pole = arc(source_line, line, source_line.any_orthonormal_vector()) * off.normalize_or_zero();
    DQuat::from_axis_angle(line, kept) * pole * sure
}
