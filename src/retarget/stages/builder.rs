//! From ops to stages: what the stages before have left open, and what all of them look at.

use std::sync::Arc;

use glam::DMat3;

use super::{
    limbs::{LimbRest, LimbSlots},
    moved_arm::MovedArm,
    posing::Posing,
    pull::{PullStage, PulledLeg},
    ride::RideStage,
    solve::{Hangs, SolveStage, SolvedLimb},
    stage::Stage,
    work::Changed,
};
use crate::{
    model::{Skeleton, Transform},
    retarget::{
        mapping::{Ground, LimbPair, Mapping},
        ops::{
            IkOp,
            ik::goals::{GoalLimb, GoalStage, PelvisShift, rotation_offset},
            schedule::Schedule,
        },
    },
};

/// Half the width of hips, in lengths of the leg, that turn as easily as they move; and of those of ordinary figures, which do not turn.
const WIDE_HIPS: f64 = 0.44;
const ORDINARY_HIPS: f64 = 0.15;

/// A stack in the making. Ops that move goals are solved once, when the last of them in a row is done.
pub(in crate::retarget) struct StackBuilder<'a> {
    pub(in crate::retarget) source: &'a Skeleton,
    pub(in crate::retarget) target: &'a Skeleton,
    pub(in crate::retarget) mapping: &'a Mapping,
    /// In plan space.
    pub(in crate::retarget) source_rest: Vec<Transform>,
    pub(in crate::retarget) target_rest: Vec<Transform>,
    pub(in crate::retarget) plan_from_target: Transform,
    pub(in crate::retarget) stages: Vec<Arc<dyn Stage>>,
    /// Limbs with goals that are not solved yet, and the op that set them.
    pub(in crate::retarget) open: Vec<(usize, IkOp)>,
    /// Whether held feet pull at the pelvis, and how dear sideways moves are; nothing where no op may move the pelvis.
    pub(in crate::retarget) pull: Option<(bool, f64)>,
    /// What runs once the goals are solved: toes bend and tails rise when feet are where they stay.
    pub(in crate::retarget) after_solve: Vec<Arc<dyn Stage>>,
    /// Joints that are faded behind the plan.
    pub(in crate::retarget) faded: Vec<usize>,
    /// Whether feet already tilt less for the `floor` op to come.
    pub(in crate::retarget) is_tilted: bool,
    /// Whether an op that plants feet or puts them onto the floor changed goals that are not solved yet.
    pub(in crate::retarget) moves_feet: bool,
}

impl<'a> StackBuilder<'a> {
    pub(in crate::retarget) fn new(
        source: &'a Skeleton,
        target: &'a Skeleton,
        mapping: &'a Mapping,
        faded: Vec<usize>,
    ) -> Self {
        let plan_from_target = Transform::from_rotation(mapping.plan_from_target);
        let below = |above: Transform, rest: &[Transform]| rest.iter().map(|rest| above.then_child(rest)).collect();
        Self {
            source,
            target,
            mapping,
            source_rest: below(mapping.plan_from_source, mapping.source_rest.transforms()),
            target_rest: below(plan_from_target, mapping.target_rest.transforms()),
            plan_from_target,
            stages: Vec::new(),
            open: Vec::new(),
            pull: None,
            after_solve: Vec::new(),
            faded,
            is_tilted: false,
            moves_feet: false,
        }
    }

    /// Adds a stage behind those that are there.
    pub(in crate::retarget) fn push(&mut self, stage: impl Stage + 'static) {
        self.stages.push(Arc::new(stage));
    }

    /// Adds a stage that edits poses; what rides the joints that it moves follows.
    pub(in crate::retarget) fn push_posed(&mut self, stage: Option<impl Stage + 'static>) {
        if let Some(stage) = stage {
            self.push(stage);
            self.place_riders();
        }
    }

    pub(in crate::retarget) fn ground(&self) -> Ground {
        self.mapping.ground
    }

    /// Driven joints below a joint, or of the whole skeleton, that have no driven joint above them on the way.
    pub(in crate::retarget) fn topmost_driven_below(&self, top: Option<usize>) -> Vec<usize> {
        let driven = self.mapping.driven();
        let is_topmost = |&joint: &usize| {
            let mut above = self.target.parent(joint);
            while let Some(parent) = above.filter(|parent| Some(*parent) != top) {
                if driven[parent] {
                    return false;
                }
                above = self.target.parent(parent);
            }
            above == top
        };
        (0..driven.len()).filter(|&joint| driven[joint]).filter(is_topmost).collect()
    }

    pub(in crate::retarget) fn limb(&self, limb: usize) -> &LimbPair {
        &self.mapping.limbs[limb]
    }

    pub(in crate::retarget) fn limb_count(&self) -> usize {
        self.mapping.limbs.len()
    }

    pub(in crate::retarget) fn rest(&self, limb: usize) -> LimbRest {
        self.rest_of(self.limb(limb))
    }

    fn rest_of(&self, pair: &LimbPair) -> LimbRest {
        LimbRest::new(pair, &self.source_rest, &self.target_rest, &self.ground())
    }

    /// Mean length of the legs of source and target in plan units; of a figure without legs, a meter.
    pub(in crate::retarget) fn legs(&self) -> (f64, f64) {
        let legs = (0..self.limb_count()).filter(|&limb| self.limb(limb).limb.is_leg());
        let lengths: Vec<(f64, f64)> =
            legs.map(|limb| (self.rest(limb).length, self.rest(limb).length_ratio)).collect();
        let mean = |values: Vec<f64>| match values.len() {
            0 => self.ground().units_per_meter,
            count => values.iter().sum::<f64>() / count as f64,
        };
        let source = lengths.iter().map(|(target, ratio)| target / ratio).collect();
        (mean(source), mean(lengths.iter().map(|(target, _)| *target).collect()))
    }

    pub(in crate::retarget) fn source_posing(&self, joints: impl IntoIterator<Item = usize>) -> Posing {
        Posing::new(self.source, self.mapping.plan_from_source, joints)
    }

    pub(in crate::retarget) fn target_posing(&self, joints: impl IntoIterator<Item = usize>) -> Posing {
        Posing::new(self.target, self.plan_from_target, joints)
    }

    /// Limbs that no op gave a goal yet get the one that holds them where they are.
    pub(in crate::retarget) fn need_goals(&mut self, limbs: &[usize]) {
        let missing: Vec<usize> =
            limbs.iter().copied().filter(|limb| !self.open.iter().any(|(open, _)| open == limb)).collect();
        self.set_goals(&IkOp::default(), &Schedule::always(), &missing);
    }

    pub(in crate::retarget) fn set_goals(&mut self, op: &IkOp, schedule: &Schedule, limbs: &[usize]) {
        if limbs.is_empty() {
            return;
        }
        // A pelvis that fades in and out is nowhere where its scale puts it.
        let shifted = self.mapping.pelvis.filter(|pelvis| pelvis.is_moved() && !self.faded.contains(&pelvis.target));
        let source_joints = limbs.iter().flat_map(|limb| self.limb(*limb).source.joints());
        let source = self.source_posing(source_joints.chain(shifted.map(|pelvis| pelvis.source)));
        let target_joints = limbs.iter().flat_map(|limb| self.limb(*limb).target.joints());
        let target = self.target_posing(target_joints.chain(shifted.map(|pelvis| pelvis.target)));
        let shift = shifted.map(|pelvis| {
            let turn = DMat3::from_quat(pelvis.plain.canonical_from_plan);
            let matrix = turn.transpose() * DMat3::from_diagonal(pelvis.plain.scale) * turn;
            PelvisShift {
                source: source.slot(pelvis.source),
                target: target.slot(pelvis.target),
                matrix,
                offset: pelvis.plain.target_origin - matrix * pelvis.plain.source_origin,
                alpha: pelvis.translation_alpha,
                rest: self.target_rest[pelvis.target].translation,
                affects: pelvis.affects_goals,
            }
        });
        let goal_limb = |&limb: &usize| GoalLimb {
            limb,
            source: LimbSlots::new(&self.limb(limb).source, &source),
            target: LimbSlots::new(&self.limb(limb).target, &target),
            rest: self.rest(limb),
        };
        let stage = GoalStage {
            op: op.clone(),
            rotation_offset: rotation_offset(op),
            schedule: schedule.clone(),
            limbs: limbs.iter().map(goal_limb).collect(),
            source,
            target,
            ground: self.ground(),
            limb_count: self.limb_count(),
            pelvis: shift,
        };
        self.push(stage);
        self.open.retain(|(open, _)| !limbs.contains(open));
        self.open.extend(limbs.iter().map(|&limb| (limb, op.clone())));
    }

    /// Solves what is open.
    pub(in crate::retarget) fn close(&mut self) {
        let open = std::mem::take(&mut self.open);
        let moves_feet = std::mem::take(&mut self.moves_feet);
        if open.is_empty() {
            return;
        }
        self.pull_pelvis(&open);
        let posing = self.target_posing(open.iter().flat_map(|(limb, _)| self.limb(*limb).target.joints()));
        let mut changed = Vec::new();
        for (limb, op) in &open {
            let joints = self.limb(*limb).target;
            let stretches = op.stretch > 1.0;
            changed.extend(
                [(joints.start, false), (joints.middle, stretches), (joints.end, stretches)]
                    .map(|(joint, moves)| Changed { joint, rotates: true, moves }),
            );
        }
        let limb = |(limb, op): &(usize, IkOp)| SolvedLimb {
            is_smooth: moves_feet && self.limb(*limb).limb.is_leg() && op.stretch <= 1.0,
            limb: *limb,
            ..self.solved_limb(self.limb(*limb), op, &posing)
        };
        let limbs = open.iter().map(limb).collect();
        self.push(SolveStage { limbs, posing, limb_count: self.limb_count(), changed });
        self.place_riders();
        self.stages.append(&mut self.after_solve);
    }

    /// A limb that reaches for goals frame by frame; those of the mapping have a number, too.
    pub(in crate::retarget) fn solved_limb(&self, pair: &LimbPair, op: &IkOp, posing: &Posing) -> SolvedLimb {
        SolvedLimb {
            limb: 0,
            slots: LimbSlots::new(&pair.target, posing),
            rest: self.rest_of(pair),
            hangs: Hangs::of(self.target, &pair.target),
            softness: op.softness,
            stretch: op.stretch,
            align_pole: op.align_pole,
            pole_offset: op.pole_offset.to_radians(),
            is_smooth: false,
        }
    }

    /// An arm whose wrist is moved; `turns` says whether its hand turns about it.
    pub(in crate::retarget) fn moved_arm(&self, pair: &LimbPair, turns: bool, posing: &Posing) -> MovedArm {
        let count = if turns { 3 } else { 2 };
        let turned = pair.target.joints().into_iter().take(count);
        MovedArm {
            limb: self.solved_limb(pair, &IkOp::default(), posing),
            changed: turned.map(|joint| Changed { joint, rotates: true, moves: false }).collect(),
        }
    }

    /// After each stage that moves joints which others ride.
    pub(in crate::retarget) fn place_riders(&mut self) {
        if let Some(stage) = self.riders() {
            self.push(stage);
        }
    }

    /// Places what rides joints that were moved; nothing where nothing rides.
    pub(in crate::retarget) fn riders(&self) -> Option<RideStage> {
        let posing = |joints: &[usize]| self.target_posing(joints.iter().copied());
        RideStage::new(self.target, &self.mapping.rides, &self.mapping.driven(), posing)
    }

    fn pull_pelvis(&mut self, open: &[(usize, IkOp)]) {
        let (Some((pulls, sideways_cost)), Some(pelvis)) = (self.pull.take(), self.mapping.pelvis) else { return };
        let legs: Vec<&(usize, IkOp)> = open.iter().filter(|(limb, _)| self.limb(*limb).limb.is_leg()).collect();
        let starts = legs.iter().map(|(limb, _)| self.limb(*limb).target.start);
        let mut kept = self.topmost_driven_below(Some(pelvis.target));
        let turn_arm = self.turn_arm(&kept, open).filter(|_| pulls);
        if turn_arm.is_none() {
            kept.clear();
        }
        let posing = self.target_posing(starts.chain([pelvis.target]).chain(kept.iter().copied()));
        let leg = |(limb, op): &&(usize, IkOp)| PulledLeg {
            limb: *limb,
            start: posing.slot(self.limb(*limb).target.start),
            firm: 1.0 - op.softness,
        };
        let legs = legs.iter().map(leg).collect();
        let stage = PullStage {
            pelvis: pelvis.target,
            kept,
            legs,
            posing,
            ground: self.ground(),
            sideways_cost,
            turn_arm,
            limb_count: self.limb_count(),
            pulls,
        };
        self.push(stage);
        self.place_riders();
    }

    /// See [`PullStage::turn_arm`]; nothing of ordinary hips, and where a leg hangs on something else than the pelvis, as the front legs of animals do.
    fn turn_arm(&self, kept: &[usize], open: &[(usize, IkOp)]) -> Option<f64> {
        let legs = open.iter().map(|(limb, _)| self.limb(*limb)).filter(|pair| pair.limb.is_leg());
        let starts: Vec<usize> = legs.map(|pair| pair.target.start).collect();
        if !starts.iter().all(|start| kept.contains(start)) {
            return None;
        }
        let place = |joint: &usize| self.target_rest[*joint].translation;
        let apart = |one: &usize| starts.iter().map(|other| place(one).distance(place(other))).fold(0.0, f64::max);
        let leg = self.legs().1;
        let share = starts.iter().map(apart).fold(0.0, f64::max) / 2.0 / leg;
        (share > ORDINARY_HIPS).then(|| WIDE_HIPS * leg * (WIDE_HIPS / share).powi(2).max(1.0))
    }
}
