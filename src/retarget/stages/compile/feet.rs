//! The stages of feet: how they are held, how they stand on the floor, how their toes bend.

use glam::DVec3;

use crate::{
    retarget::ops::{FloorOp, PlantOp, resolved::StagedOp},
    rig::{FootPoint, LimbJoints, Sole},
};

use super::{super::posing::Posing, Compiler};
use crate::retarget::ops::{
    floor::{
        FloorFoot, FloorStage, FootSlots,
        toes::{ToeStage, ToedFoot},
    },
    plant::{FootAxes, PlantStage, PlantedFoot},
};

/// A point of a foot that is slower stands still, for a leg of 1 m.
const STILL_METRES_PER_SECOND: f64 = 0.05;
/// How far planted feet swing out beyond their goals between contacts, for a leg of 1 m.
const SWING_METRES: f64 = 0.03;
/// Feet whose parts differ by less than this share of the largest are of one shape: where the floor of a rest pose is, nobody knows
/// better.
const ALIKE: f64 = 2e-2;

impl Compiler<'_> {
    pub(in crate::retarget) fn plant_stage(&self, op: &PlantOp, staged: &StagedOp) -> PlantStage {
        let points = |limb: usize| -> [Option<FootPoint>; 3] {
            let pair = self.limb(limb);
            let joint = FootPoint { joint: pair.target.end, offset: DVec3::ZERO };
            if pair.limb.is_leg() { pair.target_foot.contacts } else { [Some(joint), None, None] }
        };
        let joints = staged.limbs.iter().flat_map(|&limb| points(limb)).flatten().map(|point| point.joint);
        let balls = staged.limbs.iter().flat_map(|&limb| {
            let joints = self.limb(limb).target;
            [Some(joints.end), joints.ball]
        });
        let posing = self.target_posing(joints.chain(balls.flatten()));
        let foot = |&limb: &usize| PlantedFoot {
            limb,
            scale: self.rest(limb).length_ratio,
            end: posing.slot(self.limb(limb).target.end),
            ball: self.limb(limb).target.ball.map(|ball| posing.slot(ball)),
            points: points(limb).map(|point| point.map(|point| (posing.slot(point.joint), point.offset))),
            axes: self.foot_axes(limb),
            size_beside_leg: self.size_beside_leg(limb),
            still_speed: STILL_METRES_PER_SECOND * self.legs().0,
            swing: SWING_METRES * self.legs().1,
        };
        PlantStage {
            op: op.clone(),
            schedule: staged.schedule.clone(),
            feet: staged.limbs.iter().map(foot).collect(),
            up: self.ground().up,
            limb_count: self.limb_count(),
            leaves_height: false,
            posing,
        }
    }

    /// How the target's foot lies at rest, where it is not the source's but for its size.
    fn foot_axes(&self, limb: usize) -> Option<FootAxes> {
        let pair = self.limb(limb);
        let (source, target) = (pair.source.sole?, pair.target.sole?);
        let is_other = self.size_ratio(limb, &source, &target).is_none();
        let ball = target.end_to_ball.filter(|_| is_other && !pair.has_stiff_foot)?;
        let up = -target.down[0]?;
        let front = (ball - up * ball.dot(up)).try_normalize()?;
        Some(FootAxes { front, left: up.cross(front) })
    }

    /// How large the target's foot is beside its leg, for a source of 1; by the parts that both have.
    fn size_beside_leg(&self, limb: usize) -> f64 {
        let pair = self.limb(limb);
        let sizes = pair.source.sole.zip(pair.target.sole).filter(|_| !pair.has_stiff_foot).map(|(source, target)| {
            let both = foot_parts(&source)
                .into_iter()
                .zip(foot_parts(&target))
                .filter_map(|(source, target)| source.zip(target));
            both.fold((0.0_f64, 0.0_f64), |sizes, parts| (sizes.0.max(parts.0.abs()), sizes.1.max(parts.1.abs())))
        });
        let (source, target) = sizes.unwrap_or_default();
        if source > 0.0 && target > 0.0 { target / source / self.rest(limb).length_ratio } else { 1.0 }
    }

    /// See [`size_ratio`].
    fn size_ratio(&self, limb: usize, source: &Sole, target: &Sole) -> Option<f64> {
        size_ratio(source, target, self.rest(limb).length_ratio)
    }

    /// The axis about which the target's toes bend up where the floor is, in the axes of their joint: feet that are the source's
    /// have its toes. Nothing where toes have no length or stand upright at rest.
    fn toes_of(&self, limb: usize) -> Option<DVec3> {
        let pair = self.limb(limb);
        let (source, target) = (pair.source.sole?, pair.target.sole?);
        pair.target.ball?;
        if self.size_ratio(limb, &source, &target).is_some() {
            return None;
        }
        let toes = pair.target_foot.points.iter().filter(|point| point.gives_way).map(|point| point.from_ball);
        let toes: DVec3 = toes.sum();
        toes.cross(-target.down[1]?).try_normalize()
    }

    pub(in crate::retarget) fn toe_stage(&self, staged: &StagedOp) -> Option<ToeStage> {
        let toes = |&limb: &usize| self.toes_of(limb).map(|raise| (limb, raise));
        let toes: Vec<(usize, DVec3)> = staged.limbs.iter().filter_map(toes).collect();
        let ends = toes.iter().flat_map(|(limb, _)| self.foot_joints(*limb, true));
        let target = self.target_posing(ends);
        let foot = |&(limb, raise): &(usize, DVec3)| {
            let joints = self.limb(limb).target;
            let slots = foot_slots(&joints, &target);
            let shape = self.limb(limb).target_foot.clone();
            Some(ToedFoot { ball: joints.ball?, slots, shape, raise })
        };
        let feet: Vec<ToedFoot> = toes.iter().filter_map(foot).collect();
        let (schedule, ground, (_, leg)) = (staged.schedule.clone(), self.ground(), self.legs());
        (!feet.is_empty()).then_some(ToeStage { schedule, feet, target, ground, leg })
    }

    /// Shin, ankle and joint of the ball of one side.
    fn foot_joints(&self, limb: usize, of_target: bool) -> impl Iterator<Item = usize> + use<> {
        let pair = self.limb(limb);
        let joints = if of_target { pair.target } else { pair.source };
        [Some(joints.shin), Some(joints.end), joints.ball].into_iter().flatten()
    }

    pub(in crate::retarget) fn floor_stage(&self, op: &FloorOp, staged: &StagedOp) -> FloorStage {
        let source = self.source_posing(staged.limbs.iter().flat_map(|&limb| self.foot_joints(limb, false)));
        let target = self.target_posing(staged.limbs.iter().flat_map(|&limb| self.foot_joints(limb, true)));
        let up = |limb: usize| {
            let rest = self.target_rest[self.limb(limb).target.end].rotation;
            rest.conjugate() * self.ground().up
        };
        let foot = |&limb: &usize| {
            let pair = self.limb(limb);
            let (source_sole, target_sole) = (pair.source.sole?, pair.target.sole?);
            let ratio = self.size_ratio(limb, &source_sole, &target_sole);
            let leg_ratio = self.rest(limb).length_ratio;
            Some(FloorFoot {
                limb,
                source: foot_slots(&pair.source, &source),
                source_shape: pair.source_foot.clone(),
                target: foot_slots(&pair.target, &target),
                target_shape: pair.target_foot.clone(),
                toes_give_way: self.toes_of(limb).is_some(),
                is_same: ratio.is_some_and(|ratio| (ratio - leg_ratio).abs() <= ALIKE * leg_ratio),
                stands: target_sole.down[0].map(|down| -down),
                toes_up: target_sole.down[1].map(|down| -down),
                flat: pair.has_stiff_foot.then(|| up(limb)),
            })
        };
        let (source_leg, target_leg) = self.legs();
        FloorStage {
            op: op.clone(),
            schedule: staged.schedule.clone(),
            feet: staged.limbs.iter().filter_map(foot).collect(),
            ground: self.ground(),
            source_leg,
            target_leg,
            limb_count: self.limb_count(),
            goal_limbs: self.open.iter().map(|(limb, _)| *limb).collect(),
            source,
            target,
        }
    }
}

fn foot_slots(joints: &LimbJoints, posing: &Posing) -> FootSlots {
    let ball = joints.ball.map(|ball| posing.slot(ball));
    FootSlots { end: posing.slot(joints.end), ball, shin: posing.slot(joints.shin) }
}

/// Lengths and heights of a foot.
fn foot_parts(sole: &Sole) -> [Option<f64>; 5] {
    let length = |bone: Option<DVec3>| bone.map(DVec3::length);
    [length(sole.end_to_ball), Some(sole.heel), sole.ball, sole.tip, length(sole.ball_to_tip)]
}

/// Size of the target's foot over the source's, where both are of one shape; that of the legs where neither has a size.
fn size_ratio(source: &Sole, target: &Sole, leg_ratio: f64) -> Option<f64> {
    let (source, target) = (foot_parts(source), foot_parts(target));
    let largest = |parts: &[Option<f64>]| parts.iter().flatten().fold(0.0, |most: f64, part| most.max(part.abs()));
    let (source_size, target_size) = (largest(&source), largest(&target));
    let ratio = if source_size > 0.0 { target_size / source_size } else { leg_ratio };
    let is_same = |(source, target): (Option<f64>, Option<f64>)| match (source, target) {
        (Some(source), Some(target)) => (source * ratio - target).abs() <= ALIKE * target_size,
        (source, target) => source.is_none() == target.is_none(),
    };
    let have_size = source_size > 0.0 || target_size <= 0.0;
    (have_size && source.into_iter().zip(target).all(is_same)).then_some(ratio)
}
