//! From the ops of a mapping to stages.

use glam::DVec3;

use crate::{
    model::{Skeleton, Transform},
    rig::{
        BodyPart, Capsule, FloorOp, Ground, HandPair, IkOp, Limb, LimbJoints, LimbPair, Mapping, PlantMode, PlantOp,
        Schedule, SelfContactOp, Sole, StagedKind, StagedOp,
    },
};

use super::{
    Plan, Stack, Stage,
    contacts::ContactStage,
    filter::FilterStage,
    floor::{FloorFoot, FloorStage, FootSlots},
    goals::{GoalLimb, GoalStage},
    limbs::{LimbRest, LimbSlots},
    plant::{PlantStage, PlantedFoot},
    posing::Posing,
    pull::{PullStage, PulledLeg},
    ride::RideStage,
    self_contact::{Fixed, Hand, Part, SelfContactStage},
    solve::{Hangs, SolveStage, SolvedLimb},
    work::Changed,
};

/// How often hands are led to what they touch, and arms solved.
const SELF_CONTACT_PASSES: usize = 3;
/// Feet whose parts differ by less than this share of the largest are of one shape.
const ALIKE: f64 = 1e-2;

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
        };
        for op in &mapping.stages.ops {
            compiler.add(op);
        }
        compiler.close();
        Self {
            plan: Plan::new(source, target, mapping),
            stages: compiler.stages,
            limbs: mapping.stages.limbs.iter().map(|pair| pair.limb.name()).collect(),
            metres_per_unit: mapping.stages.ground.units_per_metre.recip(),
        }
    }
}

struct Compiler<'a> {
    source: &'a Skeleton,
    target: &'a Skeleton,
    mapping: &'a Mapping,
    /// In plan space.
    source_rest: Vec<Transform>,
    target_rest: Vec<Transform>,
    plan_from_target: Transform,
    stages: Vec<Stage>,
    /// Limbs with goals that are not solved yet, and the op that set them.
    open: Vec<(usize, IkOp)>,
    /// Whether held feet pull at the pelvis, and how dear sideways moves are; nothing where no op may move the pelvis.
    pull: Option<(bool, f64)>,
}

impl Compiler<'_> {
    fn add(&mut self, op: &StagedOp) {
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
                let stage = self.plant_stage(plant, op);
                self.stages.push(Stage::Plant(stage));
                if plant.pull_pelvis {
                    self.pull = Some((true, plant.sideways_cost));
                }
            }
            StagedKind::SelfContact(self_contact) => {
                // Arms are a part of the body, too: what they touch has moved once they have reached their goals.
                for _ in 0..SELF_CONTACT_PASSES {
                    self.close();
                    self.need_goals(&op.limbs);
                    let stage = self.self_contact_stage(self_contact, op);
                    self.stages.extend(stage.map(Stage::SelfContact));
                }
                self.close();
            }
            StagedKind::Filter(filter, joints) => {
                self.close();
                let stage = FilterStage { op: filter.clone(), schedule: op.schedule.clone(), joints: joints.clone() };
                self.stages.push(Stage::Filter(stage));
            }
            StagedKind::Floor(floor) => {
                self.need_goals(&op.limbs);
                let stage = self.floor_stage(floor, op);
                self.stages.push(Stage::Floor(stage));
                if floor.shift_pelvis && self.pull.is_none() {
                    self.pull = Some((false, 1.0));
                }
            }
        }
    }

    fn ground(&self) -> Ground {
        self.mapping.stages.ground
    }

    fn limb(&self, limb: usize) -> &LimbPair {
        &self.mapping.stages.limbs[limb]
    }

    fn limb_count(&self) -> usize {
        self.mapping.stages.limbs.len()
    }

    fn rest(&self, limb: usize) -> LimbRest {
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

    fn source_posing(&self, joints: impl IntoIterator<Item = usize>) -> Posing {
        Posing::new(self.source, self.mapping.plan_from_source, joints)
    }

    fn target_posing(&self, joints: impl IntoIterator<Item = usize>) -> Posing {
        Posing::new(self.target, self.plan_from_target, joints)
    }

    /// Limbs that no op gave a goal yet get the one that holds them where they are.
    fn need_goals(&mut self, limbs: &[usize]) {
        let missing: Vec<usize> =
            limbs.iter().copied().filter(|limb| !self.open.iter().any(|(open, _)| open == limb)).collect();
        let always = Schedule { alpha: vec![[0.0, 1.0]], frames: [0, usize::MAX] };
        self.set_goals(&IkOp::default(), &always, &missing);
    }

    fn set_goals(&mut self, op: &IkOp, schedule: &Schedule, limbs: &[usize]) {
        if limbs.is_empty() {
            return;
        }
        let source = self.source_posing(limbs.iter().flat_map(|limb| self.limb(*limb).source.joints()));
        let joints = |limb: &usize| self.limb(*limb).target.joints();
        let target = self.target_posing(limbs.iter().flat_map(joints));
        let goal_limb = |&limb: &usize| GoalLimb {
            limb,
            source: LimbSlots::new(&self.limb(limb).source, &source),
            target: LimbSlots::new(&self.limb(limb).target, &target),
            rest: self.rest(limb),
        };
        let stage = GoalStage {
            op: op.clone(),
            schedule: schedule.clone(),
            limbs: limbs.iter().map(goal_limb).collect(),
            source,
            target,
            ground: self.ground(),
            limb_count: self.limb_count(),
        };
        self.stages.push(Stage::Goals(stage));
        self.open.retain(|(open, _)| !limbs.contains(open));
        self.open.extend(limbs.iter().map(|&limb| (limb, op.clone())));
    }

    fn plant_stage(&self, op: &PlantOp, staged: &StagedOp) -> PlantStage {
        let points = |limb: usize| {
            let joints = self.limb(limb).target;
            [Some(joints.end), joints.ball, joints.tip]
        };
        let posing = self.target_posing(staged.limbs.iter().flat_map(|&limb| points(limb)).flatten());
        let foot = |&limb: &usize| PlantedFoot {
            limb,
            scale: self.rest(limb).length_ratio,
            slots: points(limb).map(|joint| joint.map(|joint| posing.slot(joint))),
        };
        PlantStage {
            op: op.clone(),
            schedule: staged.schedule.clone(),
            feet: staged.limbs.iter().map(foot).collect(),
            up: self.ground().up,
            limb_count: self.limb_count(),
            posing,
        }
    }

    fn floor_stage(&self, op: &FloorOp, staged: &StagedOp) -> FloorStage {
        let ends = |joints: &LimbJoints| [Some(joints.end), joints.ball].into_iter().flatten();
        let source = self.source_posing(staged.limbs.iter().flat_map(|&limb| ends(&self.limb(limb).source)));
        let target = self.target_posing(staged.limbs.iter().flat_map(|&limb| ends(&self.limb(limb).target)));
        let foot = |&limb: &usize| {
            let pair = self.limb(limb);
            let (source_sole, target_sole) = (pair.source.sole?, pair.target.sole?);
            Some(FloorFoot {
                limb,
                source: FootSlots {
                    end: source.slot(pair.source.end),
                    ball: pair.source.ball.map(|ball| source.slot(ball)),
                },
                source_sole,
                target: FootSlots {
                    end: target.slot(pair.target.end),
                    ball: pair.target.ball.map(|ball| target.slot(ball)),
                },
                target_sole,
                size_ratio: size_ratio(&source_sole, &target_sole, self.rest(limb).length_ratio),
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

    /// Nothing where there is no hand, or nothing that it could touch.
    fn self_contact_stage(&self, op: &SelfContactOp, staged: &StagedOp) -> Option<SelfContactStage> {
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
            source,
            target,
        })
    }

    /// Solves what is open.
    fn close(&mut self) {
        let open = std::mem::take(&mut self.open);
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
        };
        let limbs = open.iter().map(limb).collect();
        self.stages.push(Stage::Solve(SolveStage { limbs, posing, limb_count: self.limb_count(), changed }));
        self.place_riders();
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
            length: self.rest(*limb).length,
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

/// Size of the target's foot over the source's, where both are of one shape; that of the legs where neither has a size.
fn size_ratio(source: &Sole, target: &Sole, leg_ratio: f64) -> Option<f64> {
    let length = |bone: Option<DVec3>| bone.map(DVec3::length);
    let parts =
        |sole: &Sole| [length(sole.end_to_ball), Some(sole.heel), sole.ball, sole.tip, length(sole.ball_to_tip)];
    let (source, target) = (parts(source), parts(target));
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
