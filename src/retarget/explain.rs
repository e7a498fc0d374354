//! Why forward kinematics turns a joint as it does, at one frame.
//!
//! Reads the compiled [`Plan`], so it tells what the loop does, and counts it anew with plain quaternions.

use glam::DQuat;

use super::mapping::Mapping;
use super::plan::{
    CarriedDriver, CarryStep, Driver, ModelDriver, Parent, PelvisDriver, Plan, Sample, TwistDriver, TwistSegment,
    mean_share,
};
use crate::model::{Clip, ModelPose, Skeleton};

/// How forward kinematics finds the rotation of one target joint at one frame. Rotations are in the target scene's space.
#[derive(Clone, Debug, PartialEq)]
pub struct JointExplanation {
    /// What decides.
    pub kind: DriverKind,
    /// The source joints that are followed, with their shares.
    pub sources: Vec<(usize, f64)>,
    /// The target's rest rotation, turned to look like the source's rest pose.
    pub aligned_rest: DQuat,
    /// What the source joints have turned since the rest pose.
    pub delta: DQuat,
    /// The turn of the whole chain under the target's own parent; only for chains that their parents carry.
    pub carry: Option<DQuat>,
    /// Whether the joint is turned further: with its chain, so that the chain points as the source's does; or by its share of a
    /// limb's twist, or of an arm's lift.
    pub turns_further: bool,
    /// 1 takes all of it; other values go from the rest rotation below the parent toward it, or beyond.
    pub alpha: f64,
}

/// What decides a target joint's rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriverKind {
    /// The pelvis op.
    Pelvis,
    /// A chain, measured in the model.
    Model,
    /// A chain that the target's parent carries.
    Carried,
    /// A limb, of whose twist the joint takes a share.
    Twist,
    /// The arm below a clavicle that the source does not have.
    Shoulder,
}

/// Explains a joint; nothing for one that rides its parent. `turned` is how the target's joints are turned at that frame, in its
/// scene's space, after forward kinematics.
///
/// # Panics
/// When the frame is past the clip's end, or the plan is of other skeletons.
#[must_use]
pub fn explain_joint(
    plan: &Plan,
    mapping: &Mapping,
    (source, target): (&Skeleton, &Skeleton),
    clip: &Clip,
    (frame, joint): (usize, usize),
    turned: &ModelPose,
) -> Option<JointExplanation> {
    let output = plan.outputs.iter().find(|output| output.joint == joint)?;
    let at = Explained {
        plan,
        mapping,
        pose: clip.local_pose(source, frame).to_model(source),
        aligned_rest: mapping.plan_from_target * mapping.target_rest.transforms()[joint].rotation,
    };
    let explanation = match &plan.target_steps[output.slot].driver {
        Driver::Hold => return None,
        Driver::Pelvis(driver) => at.pelvis(driver),
        Driver::Model(driver) => at.model(driver),
        Driver::Twist(driver) => at.twist(driver),
        Driver::Shoulder(driver) => at.further(DriverKind::Shoulder, at.sources(driver.sample), DQuat::IDENTITY),
        Driver::Carried(driver) => at.carried(driver, target, turned)?,
    };
    Some(explanation.in_target(mapping.plan_from_target))
}

/// One joint at one frame, in plan space.
struct Explained<'a> {
    plan: &'a Plan,
    mapping: &'a Mapping,
    /// Of the source, in its scene's space.
    pose: ModelPose,
    aligned_rest: DQuat,
}

impl Explained<'_> {
    fn joint(&self, slot: usize) -> usize {
        self.plan.source_steps[slot].joint
    }

    fn rotation(&self, slot: usize) -> DQuat {
        self.mapping.plan_from_source.rotation * self.pose.transforms()[self.joint(slot)].rotation
    }

    fn sources(&self, sample: Sample) -> Vec<(usize, f64)> {
        shares(sample, |slot| self.joint(slot))
    }

    /// A joint that takes over a rotation of the source: the samples' with the driver's constant.
    fn follows(&self, kind: DriverKind, sources: Vec<(usize, f64)>, rotation: DQuat, alpha: f64) -> JointExplanation {
        JointExplanation {
            kind,
            sources,
            aligned_rest: self.aligned_rest,
            delta: rotation * self.aligned_rest.conjugate(),
            carry: None,
            turns_further: false,
            alpha,
        }
    }

    /// A joint whose rotation is decided by more than what it samples.
    fn further(&self, kind: DriverKind, sources: Vec<(usize, f64)>, delta: DQuat) -> JointExplanation {
        JointExplanation {
            kind,
            sources,
            aligned_rest: self.aligned_rest,
            delta,
            carry: None,
            turns_further: true,
            alpha: 1.0,
        }
    }

    fn pelvis(&self, driver: &PelvisDriver) -> JointExplanation {
        let sources = vec![(self.joint(driver.source_slot), 1.0)];
        let rotation = self.rotation(driver.source_slot) * driver.rotation;
        self.follows(DriverKind::Pelvis, sources, rotation, driver.rotation_alpha)
    }

    fn model(&self, driver: &ModelDriver) -> JointExplanation {
        let mut sources = self.sources(driver.sample);
        let mut rotation = sampled(driver.sample, |slot| self.rotation(slot)) * driver.rotation;
        for (taken, (sample, constant)) in driver.also.iter().enumerate() {
            let other = sampled(*sample, |slot| self.rotation(slot)) * *constant;
            rotation = blended(rotation, other, mean_share(taken));
            sources.extend(self.sources(*sample));
        }
        let count = driver.also.len() as f64 + 1.0;
        sources.iter_mut().for_each(|(_, weight)| *weight /= count);
        JointExplanation {
            turns_further: driver.chord.is_some(),
            ..self.follows(DriverKind::Model, sources, rotation, driver.rotation_alpha)
        }
    }

    fn twist(&self, driver: &TwistDriver) -> JointExplanation {
        let (sources, delta) = match driver.segment {
            TwistSegment::Slot(_) => (Vec::new(), DQuat::IDENTITY),
            TwistSegment::Source(sample, rotation) => {
                let turned = sampled(sample, |slot| self.rotation(slot)) * rotation;
                (self.sources(sample), turned * self.aligned_rest.conjugate())
            }
        };
        self.further(DriverKind::Twist, sources, delta)
    }

    /// Nothing for a chain that nothing carries.
    fn carried(&self, driver: &CarriedDriver, target: &Skeleton, turned: &ModelPose) -> Option<JointExplanation> {
        let (begin, first) = carry_step(self.plan, driver)?;
        let above = match begin.joints[0].0 {
            Parent::Slot(slot) => self.rotation(slot),
            Parent::Constant(above) => above.rotation,
        };
        let parent = target.parent(first).map_or(DQuat::IDENTITY, |parent| turned.transforms()[parent].rotation);
        let carry = self.mapping.plan_from_target * parent * begin.parent_from_carried.rotation * above.conjugate();
        let slot_of = |carried: usize| begin.joints[carried - begin.first_slot].1;
        let rotation = sampled(driver.sample, |carried| self.rotation(slot_of(carried))) * driver.rotation;
        let sources = shares(driver.sample, |carried| self.joint(slot_of(carried)));
        let explanation = self.follows(DriverKind::Carried, sources, rotation, driver.rotation_alpha);
        Some(JointExplanation { carry: Some(carry), ..explanation })
    }
}

/// The joints of a sample and their shares.
fn shares(sample: Sample, joint: impl Fn(usize) -> usize) -> Vec<(usize, f64)> {
    match sample {
        Sample::At(slot) => vec![(joint(slot), 1.0)],
        Sample::Between { first, second, fraction, .. } => {
            vec![(joint(first), 1.0 - fraction), (joint(second), fraction)]
        }
    }
}

impl JointExplanation {
    /// From plan space into the target scene's.
    fn in_target(self, plan_from_target: DQuat) -> Self {
        let turn = |rotation: DQuat| plan_from_target.conjugate() * rotation * plan_from_target;
        Self {
            aligned_rest: plan_from_target.conjugate() * self.aligned_rest,
            delta: turn(self.delta),
            carry: self.carry.map(turn),
            ..self
        }
    }
}

/// The rotation of a sample, as the loop blends it.
fn sampled(sample: Sample, rotation: impl Fn(usize) -> DQuat) -> DQuat {
    match sample {
        Sample::At(slot) => rotation(slot),
        Sample::Between { first, second, fraction, first_axes } => {
            blended(rotation(first), rotation(second) * first_axes.unwrap_or(DQuat::IDENTITY), fraction)
        }
    }
}

/// Normalized linear, the short way.
fn blended(first: DQuat, second: DQuat, fraction: f64) -> DQuat {
    let sign = if first.dot(second) < 0.0 { -1.0 } else { 1.0 };
    (first * (1.0 - fraction) + second * (fraction * sign)).normalize()
}

/// What fills the carried slots that a driver samples, and the first target joint of its chain.
fn carry_step<'a>(plan: &'a Plan, driver: &CarriedDriver) -> Option<(&'a CarryStep, usize)> {
    let (Sample::At(slot) | Sample::Between { first: slot, .. }) = driver.sample;
    plan.outputs.iter().find_map(|output| {
        let Driver::Carried(CarriedDriver { begin: Some(begin), .. }) = &plan.target_steps[output.slot].driver else {
            return None;
        };
        (begin.first_slot..begin.first_slot + begin.joints.len()).contains(&slot).then_some((&**begin, output.joint))
    })
}
