//! Longer or shorter steps. (docs/algorithm/legs.md.)

pub(in crate::retarget) mod spec;

pub use self::spec::{StrideDirection, StrideOp};

use crate::retarget::mapping::Ground;
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
use crate::rig::Side;
use glam::{DVec2, DVec3};

use super::schedule::Schedule;
use crate::model::Canceled;

use crate::retarget::stages::{
    posing::{Pose, Posing},
    temporal::smoothed,
    work::Work,
};

/// A pelvis that travels by less than this in a second, in meters, faces where it faced before.
const MIN_SPEED_METERS: f64 = 0.1;

/// Spreads the goals of some limbs.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct StrideStage {
    pub(in crate::retarget) op: StrideOp,
    pub(in crate::retarget) schedule: Schedule,
    pub(in crate::retarget) limbs: Vec<StrideLimb>,
    /// All limbs with goals: those go along with the pelvis.
    pub(in crate::retarget) goal_limbs: Vec<usize>,
    pub(in crate::retarget) limb_count: usize,
    pub(in crate::retarget) ground: Ground,
    pub(in crate::retarget) target: Posing,
    /// Slots of the pelvis and of the joint that faces, and the latter's front at rest in its own axes.
    pub(in crate::retarget) pelvis: usize,
    pub(in crate::retarget) facing: usize,
    pub(in crate::retarget) front: DVec3,
}

/// A limb whose goal is spread.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct StrideLimb {
    pub(in crate::retarget) limb: usize,
    /// Where its end is at rest, from the middle of all ends, along left and front.
    pub(in crate::retarget) rest: DVec2,
    /// 1 on the left, −1 on the right.
    pub(in crate::retarget) side: f64,
    /// Slots of its end, and of the ball of the foot, which is what stands while the heel lifts.
    pub(in crate::retarget) end: usize,
    pub(in crate::retarget) ball: Option<usize>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Stance {
    pelvis: DVec3,
    /// Along left and front, any length.
    front: DVec2,
}

impl StrideStage {
    /// From the ends to the balls of the feet; none for hands.
    fn toes(&self, work: &Work<'_>) -> Result<Vec<DVec3>, Canceled> {
        let fill = |pose: &mut Pose, frame: usize, row: &mut [DVec3]| {
            self.target.fill(pose, &work.target, frame);
            for (limb, toe) in self.limbs.iter().zip(row) {
                let place = |slot: usize| pose.model[slot].translation;
                *toe = limb.ball.map_or(DVec3::ZERO, |ball| place(ball) - place(limb.end));
            }
        };
        work.rows(self.limbs.len(), || self.target.pose(), fill)
    }

    fn stances(&self, work: &Work<'_>) -> Result<Vec<Stance>, Canceled> {
        let axes = self.ground.axes();
        let flat = |vector: DVec3| DVec2::new(vector.dot(axes.x_axis), vector.dot(axes.z_axis));
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Stance]| {
            self.target.fill(pose, &work.target, frame);
            let pelvis = pose.model[self.pelvis].translation;
            let front = match self.op.direction {
                StrideDirection::Pelvis | StrideDirection::Chest => flat(pose.model[self.facing].rotation * self.front),
                StrideDirection::Goals => {
                    let goals = &work.goals[frame * self.limb_count..(frame + 1) * self.limb_count];
                    self.turned(|limb| flat(goals[limb].position))
                }
                StrideDirection::Travel => DVec2::ZERO,
            };
            row[0] = Stance { pelvis, front };
        };
        work.rows(1, || self.target.pose(), fill)
    }

    /// The front as the goals lie turned against their rest pose: the best fit about their middle.
    fn turned(&self, place: impl Fn(usize) -> DVec2) -> DVec2 {
        let count = self.limbs.len().max(1) as f64;
        let middle = self.limbs.iter().map(|limb| place(limb.limb)).sum::<DVec2>() / count;
        let (mut sine, mut cosine) = (0.0, 0.0);
        for limb in &self.limbs {
            let now = place(limb.limb) - middle;
            sine += limb.rest.perp_dot(now);
            cosine += limb.rest.dot(now);
        }
        DVec2::from_angle(sine.atan2(cosine)).rotate(DVec2::Y)
    }

    /// Unit vectors over the floor.
    fn fronts(&self, stances: &[Stance], work: &Work<'_>) -> Vec<DVec3> {
        let axes = self.ground.axes();
        let mut fronts: Vec<DVec3> =
            stances.iter().map(|stance| DVec3::new(stance.front.x, 0.0, stance.front.y)).collect();
        if self.op.direction == StrideDirection::Travel {
            let least = MIN_SPEED_METERS * self.ground.units_per_meter;
            for (frame, front) in fronts.iter_mut().enumerate() {
                let (before, after) = (frame.saturating_sub(1), (frame + 1).min(stances.len() - 1));
                let way = axes.transpose() * (stances[after].pelvis - stances[before].pelvis);
                let seconds = work.performed[after] - work.performed[before];
                let is_on_its_way = DVec2::new(way.x, way.z).length() > least * seconds;
                *front = if is_on_its_way { DVec3::new(way.x, 0.0, way.z) } else { DVec3::ZERO };
            }
        }
        let mut before = DVec3::Z;
        for front in &mut fronts {
            before = front.try_normalize().unwrap_or(before);
            *front = before;
        }
        let smooth = smoothed(&fronts, work.performed, self.op.smoothing_seconds / 2.0);
        let level = |(smooth, own): (DVec3, &DVec3)| axes * smooth.try_normalize().unwrap_or(*own);
        smooth.into_iter().zip(&fronts).map(level).collect()
    }
}

impl Stage for StrideStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let stances = self.stances(work)?;
        let toes = self.toes(work)?;
        let fronts = self.fronts(&stances, work);
        work.pelvis_moves.resize(work.frame_count(), DVec3::ZERO);
        let mut gone = DVec3::ZERO;
        for frame in 0..work.frame_count() {
            let alpha = self.schedule.alpha_at(work.moment(frame));
            let front = fronts[frame];
            let left = self.ground.up.cross(front);
            if frame > 0 && self.op.moves_pelvis {
                let between = (front + fronts[frame - 1]).normalize_or(front);
                let step = stances[frame].pelvis - stances[frame - 1].pelvis;
                gone += between * (step.dot(between) * (self.op.forward - 1.0) * alpha);
            }
            let goals = &mut work.goals[frame * self.limb_count..(frame + 1) * self.limb_count];
            let toes = &toes[frame * self.limbs.len()..(frame + 1) * self.limbs.len()];
            for (limb, toe) in self.limbs.iter().zip(toes) {
                let off = goals[limb.limb].position + *toe - stances[frame].pelvis;
                let meters = self.op.sideways * limb.side * self.ground.units_per_meter;
                let along = front * (off.dot(front) * (self.op.forward - 1.0));
                let across = left * (off.dot(left) * (self.op.splay - 1.0) + meters);
                goals[limb.limb].position += (along + across) * alpha;
            }
            for &limb in &self.goal_limbs {
                goals[limb].position += gone;
            }
            work.pelvis_moves[frame] += gone;
        }
        Ok(())
    }
}

impl OpWork for StrideOp {
    fn compile(&self, op: &ResolvedOp, _following: &[ResolvedOp], stack: &mut StackBuilder<'_>) {
        let Some(pelvis) = stack.mapping.pelvis else { return };
        stack.need_goals(&op.limbs);
        let facing = match self.direction {
            StrideDirection::Chest => chest(stack).unwrap_or(pelvis.target),
            StrideDirection::Pelvis | StrideDirection::Goals | StrideDirection::Travel => pelvis.target,
        };
        let feet = op.limbs.iter().flat_map(|&limb| {
            let joints = stack.limb(limb).target;
            [Some(joints.end), joints.ball].into_iter().flatten()
        });
        let target = stack.target_posing(feet.chain([pelvis.target, facing]));
        let ground = stack.ground();
        let axes = ground.axes();
        let place = |limb: usize| {
            let place = axes.transpose() * stack.target_rest[stack.limb(limb).target.end].translation;
            DVec2::new(place.x, place.z)
        };
        let middle = op.limbs.iter().map(|&limb| place(limb)).sum::<DVec2>() / op.limbs.len().max(1) as f64;
        let limb = |&limb: &usize| StrideLimb {
            limb,
            rest: place(limb) - middle,
            end: target.slot(stack.limb(limb).target.end),
            ball: stack.limb(limb).target.ball.map(|ball| target.slot(ball)),
            side: if stack.limb(limb).limb.side() == Side::Left { 1.0 } else { -1.0 },
        };
        let stage = StrideStage {
            op: self.clone(),
            schedule: op.schedule.clone(),
            limbs: op.limbs.iter().map(limb).collect(),
            goal_limbs: stack.open.iter().map(|(limb, _)| *limb).collect(),
            limb_count: stack.limb_count(),
            ground,
            pelvis: target.slot(pelvis.target),
            facing: target.slot(facing),
            front: stack.target_rest[facing].rotation.conjugate() * ground.front,
            target,
        };
        stack.push(stage);
        if self.moves_pelvis && stack.pull.is_none() {
            stack.pull = Some((false, 1.0));
        }
    }

    fn changed(&self, op: &ResolvedOp, mapping: &Mapping) -> Vec<usize> {
        mapping.pelvis.map(|pelvis| pelvis.target).into_iter().chain(op.limb_joints(mapping, false)).collect()
    }

    fn prepare_feet(&self, _op: &ResolvedOp, _stack: &mut StackBuilder<'_>) -> Ahead {
        Ahead::Nothing
    }
}

/// The joint that carries an arm.
fn chest(stack: &StackBuilder<'_>) -> Option<usize> {
    let arm = stack.mapping.limbs.iter().find(|pair| !pair.limb.is_leg())?;
    let spine = stack.mapping.chains.iter().find(|chain| chain.name == "spine");
    spine.and_then(|chain| chain.target.last().copied()).or_else(|| stack.target.parent(arm.target.start))
}

impl OpSpec for StrideOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn looks_at_whole_clip(&self) -> bool {
        true
    }

    fn resolve(&self, context: &mut Context<'_>) {
        context.push_on_limbs(&self.scope, Limbs::Legs, self.clone());
    }
}
