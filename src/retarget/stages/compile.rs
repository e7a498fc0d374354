//! From the ops of a mapping to stages.

mod feet;
mod tails;

use glam::{DMat3, DVec2};

use crate::{
    model::{Skeleton, Transform},
    retarget::{
        mapping::Mapping,
        ops::{
            FloorOp, IkOp, PlantMode, SelfContactOp, StrideDirection, StrideOp,
            edits::GripPair,
            resolved::{Ground, LimbPair, StagedKind, StagedOp},
            schedule::Schedule,
        },
    },
    rig::{BodyPart, Capsule, HandPair, Limb, Side},
};

use super::{
    Plan, Stack, Stage,
    limbs::{LimbRest, LimbSlots},
    posed::PosedStage,
    posing::Posing,
    pull::{PullStage, PulledLeg},
    ride::RideStage,
    solve::{Hangs, SolveStage, SolvedLimb},
    work::Changed,
};
use crate::retarget::ops::{
    contacts::ContactStage,
    filter::FilterStage,
    floor::{tails::TailStage, toes::ToeStage},
    ik::{GoalLimb, GoalStage, PelvisShift, rotation_offset},
    plant::PlantStage,
    props::grips::{GripStage, HeldGrip},
    root_motion::RootStage,
    scale_source::ScaledSource,
    self_contact::{Fixed, Hand, Part, SelfContactStage},
    stride::{StrideLimb, StrideStage},
};

/// How often hands are led to what they touch, and arms solved.
const SELF_CONTACT_PASSES: usize = 8;
/// How often they are brought out of the body after that: what one hand does moves the arm that the other one lies on.
const SETTLING_PASSES: usize = 2;

impl Stack {
    /// Compiles a mapping. The skeletons are those that the mapping's indices are about.
    #[must_use]
    pub fn new(source: &Skeleton, target: &Skeleton, mapping: &Mapping) -> Self {
        let plan_from_target = Transform::from_rotation(mapping.plan_from_target);
        let below = |above: Transform, rest: &[Transform]| rest.iter().map(|rest| above.then_child(rest)).collect();
        let mut compiler = Compiler {
            source,
            target,
            mapping,
            source_rest: below(mapping.plan_from_source, mapping.source_rest.transforms()),
            target_rest: below(plan_from_target, mapping.target_rest.transforms()),
            plan_from_target,
            stages: Vec::new(),
            open: Vec::new(),
            pull: None,
            toes: None,
            tails: None,
            is_tilted: false,
            moves_feet: false,
        };
        for (index, op) in mapping.stages.ops.iter().enumerate() {
            compiler.add(op, &mapping.stages.ops[index + 1..]);
        }
        compiler.close();
        Self {
            plan: Plan::new(source, target, mapping),
            source: mapping.stages.source_scale.map(|scale| ScaledSource::new(scale, source)),
            stages: compiler.stages,
            limbs: mapping.stages.limbs.iter().map(|pair| pair.limb.name()).collect(),
            contact_joints: mapping.stages.limbs.iter().flat_map(contact_joints).collect(),
            metres_per_unit: mapping.stages.ground.units_per_metre.recip(),
        }
    }
}

pub(in crate::retarget) struct Compiler<'a> {
    pub(in crate::retarget) source: &'a Skeleton,
    pub(in crate::retarget) target: &'a Skeleton,
    pub(in crate::retarget) mapping: &'a Mapping,
    /// In plan space.
    pub(in crate::retarget) source_rest: Vec<Transform>,
    pub(in crate::retarget) target_rest: Vec<Transform>,
    pub(in crate::retarget) plan_from_target: Transform,
    stages: Vec<Stage>,
    /// Limbs with goals that are not solved yet, and the op that set them.
    open: Vec<(usize, IkOp)>,
    /// Whether held feet pull at the pelvis, and how dear sideways moves are; nothing where no op may move the pelvis.
    pull: Option<(bool, f64)>,
    /// What bends toes once the feet of a `floor` op are where they stay.
    toes: Option<ToeStage>,
    /// What raises tails then.
    tails: Option<TailStage>,
    /// Whether feet already tilt less for the `floor` op to come.
    is_tilted: bool,
    /// Whether an op that plants feet or puts them onto the floor changed goals that are not solved yet.
    moves_feet: bool,
}

impl Compiler<'_> {
    /// `following` are the ops after it.
    fn add(&mut self, op: &StagedOp, following: &[StagedOp]) {
        match &op.kind {
            StagedKind::Contacts(contacts) => {
                let posing = |joints: &[usize]| self.source_posing(joints.iter().copied());
                let (limbs, ground) = (&self.mapping.stages.limbs, self.ground());
                let stage = ContactStage::new(contacts, op.schedule.frames, limbs, posing, ground, self.legs().0);
                self.stages.push(Stage::Contacts(stage));
            }
            StagedKind::Ik(ik) => self.set_goals(ik, &op.schedule, &op.limbs),
            StagedKind::Plant(plant) if plant.mode == PlantMode::Never => {}
            StagedKind::Plant(plant) => {
                self.need_goals(&op.limbs);
                let leaves_height = self.tilt_for(following);
                let stage = PlantStage { leaves_height, ..self.plant_stage(plant, op) };
                self.stages.push(Stage::Plant(stage));
                self.moves_feet = true;
                if plant.pull_pelvis {
                    self.pull = Some((true, plant.sideways_cost));
                }
            }
            StagedKind::SelfContact(self_contact) => {
                // Arms are a part of the body, too: what they touch has moved once they have reached their goals.
                for pass in 0..SELF_CONTACT_PASSES + SETTLING_PASSES {
                    self.close();
                    self.need_goals(&op.limbs);
                    let stage = self.self_contact_stage(self_contact, op, pass >= SELF_CONTACT_PASSES);
                    self.stages.extend(stage.map(Stage::SelfContact));
                }
                self.close();
            }
            StagedKind::Filter(filter, joints) => {
                self.close();
                let stage = FilterStage { op: filter.clone(), schedule: op.schedule.clone(), joints: joints.clone() };
                self.stages.push(Stage::Filter(stage));
            }
            StagedKind::Posed(edits) => {
                self.close();
                let stage = PosedStage::of_edits(self, edits, &op.schedule);
                self.add_posed(stage);
            }
            StagedKind::Twist(gain, joints) => {
                self.close();
                let stage = PosedStage::of_twists(self, *gain, joints, &op.schedule);
                self.add_posed(stage);
            }
            StagedKind::Fade(joints) => {
                let stage = PosedStage::of_fade(self, joints, &op.schedule);
                self.add_posed(stage);
            }
            StagedKind::Stride(stride) => self.add_stride(stride, op),
            StagedKind::Grips(grips) => self.add_grips(grips, op),
            StagedKind::RootMotion(motion) => {
                self.close();
                let stage = RootStage::new(self, motion, &op.schedule);
                self.stages.push(Stage::Root(stage));
            }
            StagedKind::Floor(floor) => {
                self.need_goals(&op.limbs);
                self.tilt(floor, op);
                self.is_tilted = false;
                let stage = self.floor_stage(floor, op);
                self.toes = self.toe_stage(op);
                self.tails = self.tail_stage(floor, op);
                self.stages.push(Stage::Floor(stage));
                self.moves_feet = true;
                if floor.shift_pelvis && self.pull.is_none() {
                    self.pull = Some((false, 1.0));
                }
            }
        }
    }

    /// Feet are held as they are tilted: for a `floor` op behind, before anything holds them. Whether there is one.
    fn tilt_for(&mut self, following: &[StagedOp]) -> bool {
        for op in following {
            match &op.kind {
                StagedKind::Floor(floor) => {
                    self.tilt(floor, op);
                    return true;
                }
                StagedKind::Ik(_) | StagedKind::Plant(_) | StagedKind::Contacts(_) | StagedKind::Stride(_) => {}
                _ => return false,
            }
        }
        false
    }

    fn tilt(&mut self, floor: &FloorOp, op: &StagedOp) {
        if !self.is_tilted {
            self.need_goals(&op.limbs);
            let stage = self.floor_stage(floor, op);
            self.stages.push(Stage::Tilt(stage));
            self.is_tilted = true;
        }
    }

    pub(in crate::retarget) fn ground(&self) -> Ground {
        self.mapping.stages.ground
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
        &self.mapping.stages.limbs[limb]
    }

    fn limb_count(&self) -> usize {
        self.mapping.stages.limbs.len()
    }

    pub(in crate::retarget) fn rest(&self, limb: usize) -> LimbRest {
        LimbRest::new(self.limb(limb), &self.source_rest, &self.target_rest, &self.ground())
    }

    /// Mean length of the legs of source and target in plan units; of a figure without legs, a metre.
    fn legs(&self) -> (f64, f64) {
        let legs = (0..self.limb_count()).filter(|&limb| self.limb(limb).limb.is_leg());
        let lengths: Vec<(f64, f64)> =
            legs.map(|limb| (self.rest(limb).length, self.rest(limb).length_ratio)).collect();
        let mean = |values: Vec<f64>| match values.len() {
            0 => self.ground().units_per_metre,
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
    fn need_goals(&mut self, limbs: &[usize]) {
        let missing: Vec<usize> =
            limbs.iter().copied().filter(|limb| !self.open.iter().any(|(open, _)| open == limb)).collect();
        self.set_goals(&IkOp::default(), &Schedule::always(), &missing);
    }

    fn set_goals(&mut self, op: &IkOp, schedule: &Schedule, limbs: &[usize]) {
        if limbs.is_empty() {
            return;
        }
        // A pelvis that fades in and out is nowhere where its scale puts it.
        let shifted = self.mapping.pelvis.filter(|pelvis| pelvis.is_moved() && !self.fades(pelvis.target));
        let source_joints = limbs.iter().flat_map(|limb| self.limb(*limb).source.joints());
        let source = self.source_posing(source_joints.chain(shifted.map(|pelvis| pelvis.source)));
        let target_joints = limbs.iter().flat_map(|limb| self.limb(*limb).target.joints());
        let target = self.target_posing(target_joints.chain(shifted.map(|pelvis| pelvis.target)));
        let shift = shifted.map(|pelvis| {
            let turn = DMat3::from_quat(pelvis.plain.ours_from_plan);
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
        self.stages.push(Stage::Goals(stage));
        self.open.retain(|(open, _)| !limbs.contains(open));
        self.open.extend(limbs.iter().map(|&limb| (limb, op.clone())));
    }

    fn add_posed(&mut self, stage: Option<PosedStage>) {
        if let Some(stage) = stage {
            self.stages.push(Stage::Posed(stage));
            self.place_riders();
        }
    }

    /// Whether a joint is faded behind the plan.
    fn fades(&self, joint: usize) -> bool {
        let is_faded = |op: &StagedOp| matches!(&op.kind, StagedKind::Fade(joints) if joints.contains(&joint));
        self.mapping.stages.ops.iter().any(is_faded)
    }

    fn add_stride(&mut self, op: &StrideOp, staged: &StagedOp) {
        let Some(pelvis) = self.mapping.pelvis else { return };
        self.need_goals(&staged.limbs);
        let facing = match op.direction {
            StrideDirection::Chest => self.chest().unwrap_or(pelvis.target),
            StrideDirection::Pelvis | StrideDirection::Goals | StrideDirection::Travel => pelvis.target,
        };
        let feet = staged.limbs.iter().flat_map(|&limb| {
            let joints = self.limb(limb).target;
            [Some(joints.end), joints.ball].into_iter().flatten()
        });
        let target = self.target_posing(feet.chain([pelvis.target, facing]));
        let ground = self.ground();
        let axes = ground.axes();
        let place = |limb: usize| {
            let place = axes.transpose() * self.target_rest[self.limb(limb).target.end].translation;
            DVec2::new(place.x, place.z)
        };
        let middle = staged.limbs.iter().map(|&limb| place(limb)).sum::<DVec2>() / staged.limbs.len().max(1) as f64;
        let limb = |&limb: &usize| StrideLimb {
            limb,
            rest: place(limb) - middle,
            end: target.slot(self.limb(limb).target.end),
            ball: self.limb(limb).target.ball.map(|ball| target.slot(ball)),
            side: if self.limb(limb).limb.side() == Side::Left { 1.0 } else { -1.0 },
        };
        let stage = StrideStage {
            op: op.clone(),
            schedule: staged.schedule.clone(),
            limbs: staged.limbs.iter().map(limb).collect(),
            goal_limbs: self.open.iter().map(|(limb, _)| *limb).collect(),
            limb_count: self.limb_count(),
            ground,
            pelvis: target.slot(pelvis.target),
            facing: target.slot(facing),
            front: self.target_rest[facing].rotation.conjugate() * ground.front,
            target,
        };
        self.stages.push(Stage::Stride(stage));
        if op.moves_pelvis && self.pull.is_none() {
            self.pull = Some((false, 1.0));
        }
    }

    /// The joint that carries an arm.
    fn chest(&self) -> Option<usize> {
        let arm = self.mapping.stages.limbs.iter().find(|pair| !pair.limb.is_leg())?;
        let spine = self.mapping.chains.iter().find(|chain| chain.name == "spine");
        spine.and_then(|chain| chain.target.last().copied()).or_else(|| self.target.parent(arm.target.start))
    }

    fn add_grips(&mut self, grips: &[GripPair], staged: &StagedOp) {
        let followers: Vec<usize> = grips.iter().map(|grip| grip.follows).collect();
        self.need_goals(&followers);
        let hand = |limb: usize| (self.limb(limb).source.end, self.limb(limb).target.end);
        let source = self.source_posing(grips.iter().flat_map(|grip| [hand(grip.lead).0, hand(grip.follows).0]));
        let target = self.target_posing(grips.iter().map(|grip| hand(grip.lead).1));
        let held = |grip: &GripPair| {
            let (lead, lead_target) = hand(grip.lead);
            let arm = self.rest(grip.lead);
            HeldGrip {
                limb: grip.follows,
                dominant_limb: self.open.iter().any(|(limb, _)| *limb == grip.lead).then_some(grip.lead),
                source: [source.slot(lead), source.slot(hand(grip.follows).0)],
                target: target.slot(lead_target),
                target_from_source: self.source_rest[lead].rotation.conjugate()
                    * self.target_rest[lead_target].rotation,
                scale: grip.scale,
                within: grip.within * arm.length / arm.length_ratio,
            }
        };
        let grips = grips.iter().map(held).collect();
        let schedule = staged.schedule.clone();
        self.stages.push(Stage::Grips(GripStage { schedule, grips, limb_count: self.limb_count(), source, target }));
    }

    /// Nothing where there is no hand, or nothing that it could touch.
    fn self_contact_stage(&self, op: &SelfContactOp, staged: &StagedOp, settles: bool) -> Option<SelfContactStage> {
        let stages = &self.mapping.stages;
        let pairs: Vec<&HandPair> = stages.hands.iter().filter(|hand| staged.limbs.contains(&hand.limb)).collect();
        if pairs.is_empty() || stages.parts.is_empty() {
            return None;
        }
        let joints = |capsule: &Capsule| [capsule.start.joint, capsule.end.joint];
        let of_source = pairs.iter().map(|hand| &hand.source).chain(stages.parts.iter().map(|part| &part.source));
        let of_target = pairs.iter().map(|hand| &hand.target).chain(stages.parts.iter().map(|part| &part.target));
        let source = self.source_posing(of_source.flat_map(joints));
        let target = self.target_posing(of_target.flat_map(joints));
        let hand = |hand: &&HandPair| Hand {
            limb: hand.limb,
            source: Fixed::new(&hand.source, &source),
            target: Fixed::new(&hand.target, &target),
        };
        let own = |arm: Option<Limb>| stages.limbs.iter().position(|pair| Some(pair.limb) == arm);
        let part = |part: &BodyPart| Part {
            own: own(part.arm),
            source: Fixed::new(&part.source, &source),
            target: Fixed::new(&part.target, &target),
        };
        let (source_leg, target_leg) = self.legs();
        Some(SelfContactStage {
            op: op.clone(),
            schedule: staged.schedule.clone(),
            hands: pairs.iter().map(hand).collect(),
            parts: stages.parts.iter().map(part).collect(),
            source_leg,
            leg_ratio: target_leg / source_leg,
            limb_count: self.limb_count(),
            settles,
            source,
            target,
        })
    }

    /// Solves what is open.
    fn close(&mut self) {
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
            limb: *limb,
            slots: LimbSlots::new(&self.limb(*limb).target, &posing),
            rest: self.rest(*limb),
            hangs: Hangs::of(self.target, &self.limb(*limb).target),
            softness: op.softness,
            stretch: op.stretch,
            align_pole: op.align_pole,
            pole_offset: op.pole_offset.to_radians(),
            is_smooth: moves_feet && self.limb(*limb).limb.is_leg() && op.stretch <= 1.0,
        };
        let limbs = open.iter().map(limb).collect();
        self.stages.push(Stage::Solve(SolveStage { limbs, posing, limb_count: self.limb_count(), changed }));
        self.place_riders();
        let toes = self.toes.take();
        self.stages.extend(toes.map(Stage::Toes));
        let tails = self.tails.take();
        self.stages.extend(tails.map(Stage::Tails));
    }

    /// After each stage that moves joints which others ride.
    fn place_riders(&mut self) {
        let posing = |joints: &[usize]| self.target_posing(joints.iter().copied());
        let (rides, driven) = (&self.mapping.rides, self.mapping.driven());
        let stage = RideStage::new(self.target, rides, &driven, posing);
        self.stages.extend(stage.map(Stage::Ride));
    }

    fn pull_pelvis(&mut self, open: &[(usize, IkOp)]) {
        let (Some((pulls, sideways_cost)), Some(pelvis)) = (self.pull.take(), self.mapping.pelvis) else { return };
        let legs: Vec<&(usize, IkOp)> = open.iter().filter(|(limb, _)| self.limb(*limb).limb.is_leg()).collect();
        let starts = legs.iter().map(|(limb, _)| self.limb(*limb).target.start);
        let posing = self.target_posing(starts.chain([pelvis.target]));
        let leg = |(limb, op): &&(usize, IkOp)| PulledLeg {
            limb: *limb,
            start: posing.slot(self.limb(*limb).target.start),
            firm: 1.0 - op.softness,
        };
        let legs = legs.iter().map(leg).collect();
        let stage = PullStage {
            pelvis: pelvis.target,
            legs,
            posing,
            ground: self.ground(),
            sideways_cost,
            limb_count: self.limb_count(),
            pulls,
        };
        self.stages.push(Stage::Pull(stage));
        self.place_riders();
    }
}

/// The points of contact of a limb, and the joints of the target that they are.
fn contact_joints(pair: &LimbPair) -> Vec<(&'static str, usize)> {
    let joints = [Some(pair.target.end), pair.target.ball, pair.target.tip];
    pair.limb.contact_points().into_iter().zip(joints).filter_map(|(point, joint)| Some((point, joint?))).collect()
}
