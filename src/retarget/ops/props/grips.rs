//! Hands that hold the same thing. (docs/algorithm/joints.md.)

use crate::retarget::stages::stage::Stage;
use crate::retarget::{
    mapping::Mapping,
    ops::resolved::{OpWork, ResolvedOp},
    stages::builder::StackBuilder,
};
use glam::{DQuat, DVec3};

use crate::model::rotation::smootherstep;

use crate::{model::Canceled, retarget::ops::schedule::Schedule};

use crate::retarget::stages::{
    posing::{Pose, Posing},
    work::{Goal, Work},
};

/// Leads hands to where they hold what another hand holds.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct GripStage {
    pub(in crate::retarget) schedule: Schedule,
    pub(in crate::retarget) grips: Vec<HeldGrip>,
    pub(in crate::retarget) source: Posing,
    pub(in crate::retarget) target: Posing,
    pub(in crate::retarget) limb_count: usize,
}

/// One pair of hands.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct HeldGrip {
    /// The limb that follows.
    pub(in crate::retarget) limb: usize,
    /// The limb that leads, where it has a goal of its own.
    pub(in crate::retarget) dominant_limb: Option<usize>,
    /// Slots of the two hands: the one that leads and the one that follows.
    pub(in crate::retarget) source: [usize; 2],
    pub(in crate::retarget) target: usize,
    /// `S0⁻¹ · T0` of the hand that leads.
    pub(in crate::retarget) target_from_source: DQuat,
    pub(in crate::retarget) scale: f64,
    /// Up to this distance of the source's hands the other follows fully, in plan units.
    pub(in crate::retarget) within: f64,
}

impl Stage for GripStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let mut goals = std::mem::take(&mut work.goals);
        let fill = |(source, target): &mut (Pose, Pose), frame: usize, row: &mut [DVec3]| {
            self.source.fill(source, work.source, frame);
            self.target.fill(target, &work.target, frame);
            let alpha = self.schedule.alpha_at(work.moment(frame));
            let goals = &goals[frame * self.limb_count..(frame + 1) * self.limb_count];
            for (grip, place) in self.grips.iter().zip(row) {
                *place = grip.goal(source, target, goals, alpha);
            }
        };
        let rows = work.rows(self.grips.len(), || (self.source.pose(), self.target.pose()), fill)?;
        for (goals, row) in goals.chunks_exact_mut(self.limb_count).zip(rows.chunks_exact(self.grips.len())) {
            for (grip, place) in self.grips.iter().zip(row) {
                goals[grip.limb].position = *place;
            }
        }
        work.goals = goals;
        Ok(())
    }
}

impl HeldGrip {
    fn goal(&self, source: &Pose, target: &Pose, goals: &[Goal], alpha: f64) -> DVec3 {
        let [lead, other] = self.source.map(|slot| source.model[slot]);
        let between = lead.rotation.conjugate() * (other.translation - lead.translation);
        let (rotation, position) = match self.dominant_limb {
            Some(limb) => (goals[limb].rotation, goals[limb].position),
            None => (target.model[self.target].rotation, target.model[self.target].translation),
        };
        let held = position + rotation * (self.target_from_source.conjugate() * between) * self.scale;
        let far = between.length() / self.within.max(f64::MIN_POSITIVE) - 1.0;
        goals[self.limb].position.lerp(held, alpha * (1.0 - smootherstep(far)))
    }
}

/// Two hands that hold the same thing, as indices into the limbs.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct GripPair {
    /// The one that leads.
    pub(in crate::retarget) lead: usize,
    /// The one that follows.
    pub(in crate::retarget) follows: usize,
    /// Factor on the distance between them, in plan units.
    pub(in crate::retarget) scale: f64,
    /// Meters between the source's hands up to which the other follows fully, at an arm of 1 m.
    pub(in crate::retarget) within: f64,
}

/// The pairs of hands of an op.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct Grips(pub(in crate::retarget) Vec<GripPair>);

impl OpWork for Grips {
    fn compile(&self, op: &ResolvedOp, _following: &[ResolvedOp], stack: &mut StackBuilder<'_>) {
        let followers: Vec<usize> = self.0.iter().map(|grip| grip.follows).collect();
        stack.need_goals(&followers);
        let hand = |limb: usize| (stack.limb(limb).source.end, stack.limb(limb).target.end);
        let source = stack.source_posing(self.0.iter().flat_map(|grip| [hand(grip.lead).0, hand(grip.follows).0]));
        let target = stack.target_posing(self.0.iter().map(|grip| hand(grip.lead).1));
        let held = |grip: &GripPair| {
            let (lead, lead_target) = hand(grip.lead);
            let arm = stack.rest(grip.lead);
            HeldGrip {
                limb: grip.follows,
                dominant_limb: stack.open.iter().any(|(limb, _)| *limb == grip.lead).then_some(grip.lead),
                source: [source.slot(lead), source.slot(hand(grip.follows).0)],
                target: target.slot(lead_target),
                target_from_source: stack.source_rest[lead].rotation.conjugate()
                    * stack.target_rest[lead_target].rotation,
                scale: grip.scale,
                within: grip.within * arm.length / arm.length_ratio,
            }
        };
        let grips = self.0.iter().map(held).collect();
        let schedule = op.schedule.clone();
        stack.push(GripStage { schedule, grips, limb_count: stack.limb_count(), source, target });
    }

    fn changed(&self, _op: &ResolvedOp, mapping: &Mapping) -> Vec<usize> {
        let followers = self.0.iter().filter_map(|pair| mapping.limbs.get(pair.follows));
        followers.flat_map(|limb| limb.turned(false)).collect()
    }
}
