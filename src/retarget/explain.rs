//! Why forward kinematics turns a joint as it does, at one frame.
//!
//! Reads the compiled [`Plan`], so it tells what the loop does, and counts it anew with plain quaternions.

use glam::DQuat;

use super::mapping::Mapping;
use super::plan::{CarriedDriver, CarryStep, Driver, Parent, Plan, Sample, TwistSegment, mean_share};
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
    let step = &plan.target_steps[output.slot];
    let pose = clip.local_pose(source, frame).to_model(source);
    let plan_from_source = mapping.plan_from_source.rotation;
    let source_rotation = |slot: usize| plan_from_source * pose.transforms()[plan.source_steps[slot].joint].rotation;
    let aligned_rest = mapping.plan_from_target * mapping.target_rest.transforms()[joint].rotation;
    let sources_of = |sample: Sample, joint_of: &dyn Fn(usize) -> usize| match sample {
        Sample::At(slot) => vec![(joint_of(slot), 1.0)],
        Sample::Between { first, second, fraction, .. } => {
            vec![(joint_of(first), 1.0 - fraction), (joint_of(second), fraction)]
        }
    };
    let of_plan = |slot: usize| plan.source_steps[slot].joint;
    let explanation = match &step.driver {
        Driver::Hold => return None,
        Driver::Pelvis(driver) => JointExplanation {
            kind: DriverKind::Pelvis,
            sources: vec![(of_plan(driver.source_slot), 1.0)],
            aligned_rest,
            delta: source_rotation(driver.source_slot) * driver.rotation * aligned_rest.conjugate(),
            carry: None,
            turns_further: false,
            alpha: driver.rotation_alpha,
        },
        Driver::Model(driver) => {
            let mut sources = sources_of(driver.sample, &of_plan);
            let mut rotation = sampled(driver.sample, source_rotation) * driver.rotation;
            for (taken, (sample, constant)) in driver.also.iter().enumerate() {
                let other = sampled(*sample, source_rotation) * *constant;
                rotation = blended(rotation, other, mean_share(taken));
                sources.extend(sources_of(*sample, &of_plan));
            }
            let count = driver.also.len() as f64 + 1.0;
            sources.iter_mut().for_each(|(_, weight)| *weight /= count);
            JointExplanation {
                kind: DriverKind::Model,
                sources,
                aligned_rest,
                delta: rotation * aligned_rest.conjugate(),
                carry: None,
                turns_further: driver.chord.is_some(),
                alpha: driver.rotation_alpha,
            }
        }
        Driver::Twist(driver) => {
            let (sources, delta) = match driver.segment {
                TwistSegment::Slot(_) => (Vec::new(), DQuat::IDENTITY),
                TwistSegment::Source(sample, rotation) => {
                    let turned = sampled(sample, source_rotation) * rotation;
                    (sources_of(sample, &of_plan), turned * aligned_rest.conjugate())
                }
            };
            JointExplanation {
                kind: DriverKind::Twist,
                sources,
                aligned_rest,
                delta,
                carry: None,
                turns_further: true,
                alpha: 1.0,
            }
        }
        Driver::Shoulder(driver) => JointExplanation {
            kind: DriverKind::Shoulder,
            sources: sources_of(driver.sample, &of_plan),
            aligned_rest,
            delta: DQuat::IDENTITY,
            carry: None,
            turns_further: true,
            alpha: 1.0,
        },
        Driver::Carried(driver) => {
            let (begin, first) = carry_step(plan, driver)?;
            let above = match begin.joints[0].0 {
                Parent::Slot(slot) => source_rotation(slot),
                Parent::Constant(above) => above.rotation,
            };
            let parent = target.parent(first).map_or(DQuat::IDENTITY, |parent| turned.transforms()[parent].rotation);
            let carry = mapping.plan_from_target * parent * begin.parent_from_carried.rotation * above.conjugate();
            let slot_of = |carried: usize| begin.joints[carried - begin.first_slot].1;
            let sampled = sampled(driver.sample, |carried| source_rotation(slot_of(carried)));
            JointExplanation {
                kind: DriverKind::Carried,
                sources: sources_of(driver.sample, &|carried| of_plan(slot_of(carried))),
                aligned_rest,
                delta: sampled * driver.rotation * aligned_rest.conjugate(),
                carry: Some(carry),
                turns_further: false,
                alpha: driver.rotation_alpha,
            }
        }
    };
    Some(explanation.in_target(mapping.plan_from_target))
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
