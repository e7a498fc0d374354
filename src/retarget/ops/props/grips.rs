//! Hands that hold the same thing. (docs/algorithm/joints.md.)

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

impl GripStage {
    pub(in crate::retarget) fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let mut goals = std::mem::take(&mut work.goals);
        let fill = |(source, target): &mut (Pose, Pose), frame: usize, row: &mut [DVec3]| {
            self.source.fill(source, work.source, frame);
            self.target.fill(target, &work.target, frame);
            let alpha = self.schedule.alpha_at(frame, work.times[frame]);
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
