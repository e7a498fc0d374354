//! What the frame loop executes: steps in an order in which every value is there before it is needed.

use glam::{DMat3, DQuat, DVec3};

use super::mapping::{ChordCorrection, CrotchRule};
use crate::model::Transform;

/// A compiled retarget: constants and indices only.
///
/// Everything is in plan space: the roots of both skeletons hang below constants that take them there.
#[derive(Clone, Debug)]
pub struct Plan {
    pub(super) source_steps: Vec<SourceStep>,
    pub(super) target_steps: Vec<TargetStep>,
    pub(super) carried_slots: usize,
    pub(super) chord_slots: usize,
    pub(super) outputs: Vec<Output>,
    pub(super) target_joint_count: usize,
    /// Whether quaternions are brought back to unit length. Chains that are carried along take them as they are, with the
    /// conjugate as inverse: that is how ikrigretarget counts, whose numbers they reproduce.
    pub(super) normalizes: bool,
}

impl Plan {
    /// How many target joints get a track.
    #[must_use]
    pub fn driven_joint_count(&self) -> usize {
        self.outputs.len()
    }
}

/// What is known of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Needs {
    /// Its rotation only.
    Rotation,
    /// Rotation, position and scale.
    Transform,
}

/// Accumulates one source joint.
#[derive(Clone, Debug)]
pub(super) struct SourceStep {
    /// Joint of the source skeleton.
    pub(super) joint: usize,
    /// Slot of the parent, or the constant transform that it hangs below.
    pub(super) parent: Parent,
    /// The rest transform, for channels that are not animated.
    pub(super) rest: Transform,
    pub(super) needs: Needs,
}

/// Where a parent's transform comes from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Parent {
    /// An earlier slot of the same side.
    Slot(usize),
    /// A constant.
    Constant(Transform),
}

/// Computes one target joint. Slots of the target side are numbered as the steps are.
#[derive(Clone, Debug)]
pub(super) struct TargetStep {
    pub(super) parent: Parent,
    /// The local transform where nothing drives it, and the local rest that alphas start from.
    pub(super) hold: Transform,
    pub(super) needs: Needs,
    pub(super) driver: Driver,
    /// What places the joint, where it is not its parent.
    pub(super) ride: Option<RideStep>,
}

/// A joint that an earlier step of the target places; without a driver of its own it turns with it, too.
#[derive(Clone, Copy, Debug)]
pub(super) struct RideStep {
    pub(super) on: usize,
    pub(super) translation: DVec3,
    pub(super) rotation: DQuat,
}

/// What decides a target joint's transform.
#[derive(Clone, Debug)]
pub(super) enum Driver {
    /// Nothing: it rides its parent.
    Hold,
    /// The pelvis op.
    Pelvis(PelvisDriver),
    /// A source joint or two, in model space: `G_T = blend(S_a, S_b) · constant`.
    Model(ModelDriver),
    /// A share of a limb's twist, on top of the limb's own rotation.
    Twist(TwistDriver),
    /// A clavicle that follows its arm.
    Shoulder(ShoulderDriver),
    /// A chain that is carried along under the target's parent.
    Carried(CarriedDriver),
}

#[derive(Clone, Debug)]
pub(super) struct PelvisDriver {
    pub(super) source_slot: usize,
    /// `S0⁻¹ · T0`.
    pub(super) rotation: DQuat,
    pub(super) rotation_alpha: f64,
    /// `target = matrix · source + offset`.
    pub(super) matrix: DMat3,
    pub(super) offset: DVec3,
    pub(super) translation_alpha: f64,
    /// Position in the rest pose.
    pub(super) rest_position: DVec3,
    /// Scale in model space, which stays at rest.
    pub(super) rest_scale: DVec3,
    /// What moves and turns it further, where something does.
    pub(super) further: Option<Box<PelvisFurther>>,
}

/// Offsets of the pelvis and its crotch's height.
#[derive(Clone, Debug)]
pub(super) struct PelvisFurther {
    /// Turns it in plan space, after the source's change.
    pub(super) turn: DQuat,
    /// Moves it along its own axes.
    pub(super) local_offset: DVec3,
    pub(super) crotch: Option<CrotchRule>,
}

#[derive(Clone, Debug)]
pub(super) struct ModelDriver {
    pub(super) sample: Sample,
    /// `S0(u)⁻¹ · T0`.
    pub(super) rotation: DQuat,
    /// Further ones, each with its own `S0(u)⁻¹ · T0`: the joint turns as the mean of all.
    pub(super) also: Vec<(Sample, DQuat)>,
    pub(super) rotation_alpha: f64,
    pub(super) translation: Translation,
    /// The slot of the chain's chord, where this joint is turned by it.
    pub(super) chord: Option<usize>,
    /// Present on the chain's first target joint: finds the turn of the chain's chord.
    pub(super) begin: Option<Box<ChordStep>>,
}

/// `G_T = G_segment · turn(axis, share · twist) · segment_from_joint`.
#[derive(Clone, Debug)]
pub(super) struct TwistDriver {
    pub(super) segment: TwistSegment,
    pub(super) against: TwistEnd,
    /// Along the limb, in the segment's own axes.
    pub(super) axis: DVec3,
    pub(super) segment_from_joint: DQuat,
    pub(super) share: f64,
}

/// `G_T = G_parent · turn(axis, share · elevation beyond the free one) · hold`.
#[derive(Clone, Debug)]
pub(super) struct ShoulderDriver {
    /// What the source gives the upper arm.
    pub(super) sample: Sample,
    pub(super) rotation: DQuat,
    /// Along the upper arm, in its own axes.
    pub(super) arm: DVec3,
    /// Up, and what the clavicle is lifted about, in the axes of its parent.
    pub(super) up: DVec3,
    pub(super) axis: DVec3,
    pub(super) free_radians: f64,
    pub(super) share: f64,
}

/// Where the rotation of a twisted limb comes from.
#[derive(Clone, Copy, Debug)]
pub(super) enum TwistSegment {
    /// An earlier target joint.
    Slot(usize),
    /// The source, as for a joint that is driven by it: the joint itself is the segment.
    Source(Sample, DQuat),
}

/// What a limb's twist is measured against.
#[derive(Clone, Copy, Debug)]
pub(super) enum TwistEnd {
    /// The earlier target joint that carries the limb, and `carrier_from_segment` at rest.
    Carrier(usize, DQuat),
    /// What the limb leads to, as the source drives it, and `end_from_segment` at rest.
    End(Sample, DQuat, DQuat),
}

/// Finds the rotation that makes a chain point as the source's does.
#[derive(Clone, Debug)]
pub(super) struct ChordStep {
    /// Where the rotation of the turned bones goes; that of the kept bones goes into the next slot.
    pub(super) slot: usize,
    pub(super) correction: ChordCorrection,
    /// From the source's chord to the target's at rest, in the axes of the source joint at `source_start`.
    pub(super) target_from_source: DQuat,
    /// Source slots of the chain's first joint and of the joint that it leads to.
    pub(super) source_start: usize,
    pub(super) source_end: usize,
    /// Bones that are turned, and those of a chest, which gives way at most: the place that each follows, and the bone in that place's space.
    pub(super) turned: Vec<(Sample, DVec3)>,
    pub(super) kept: Vec<(Sample, DVec3)>,
}

/// How a joint's translation is found.
#[derive(Clone, Copy, Debug)]
pub(super) enum Translation {
    /// The hold translation.
    Hold,
    /// The source joint's offset from its own parent, times a factor.
    Scaled { parent_slot: Option<usize>, factor: f64, alpha: f64 },
    /// The source joint's position.
    Absolute { alpha: f64 },
}

#[derive(Clone, Debug)]
pub(super) struct CarriedDriver {
    /// Present on the chain's first target joint: fills the chain's carried slots.
    pub(super) begin: Option<Box<CarryStep>>,
    pub(super) sample: Sample,
    /// `S0(u)⁻¹ · T0`.
    pub(super) rotation: DQuat,
    pub(super) rotation_alpha: f64,
    /// `T0.scale − S0(u).scale`.
    pub(super) scale_offset: DVec3,
}

/// Lays the source chain's current local transforms end to end below the target's parent.
///
/// The locals are taken from the accumulated source pose, not from its tracks: where quaternions are unit ones but for
/// rounding, the two differ by what ikrigretarget's numbers show.
#[derive(Clone, Debug)]
pub(super) struct CarryStep {
    /// `T0[parent]⁻¹ ∘ S0[parent]`, below the target's parent.
    pub(super) parent_from_carried: Transform,
    /// First carried slot; one per source joint from there.
    pub(super) first_slot: usize,
    /// Source slots of the chain's joints, each with its parent.
    pub(super) joints: Vec<(Parent, usize)>,
}

/// One source slot, or a place between two.
#[derive(Clone, Copy, Debug)]
pub(super) enum Sample {
    At(usize),
    Between {
        first: usize,
        second: usize,
        fraction: f64,
        /// `S0(second)⁻¹ · S0(first)`: lays the second joint's own axes onto the first's, so that it does not matter how a rig's
        /// axes lie. Nothing for carried chains, which count as ikrigretarget does.
        first_axes: Option<DQuat>,
    },
}

/// How much of the next of several rotations is blended in when so many have been `taken` beside the first, so that all count alike.
pub(super) fn mean_share(taken: usize) -> f64 {
    1.0 / (taken as f64 + 2.0)
}

/// A target joint that gets tracks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Output {
    pub(super) joint: usize,
    pub(super) slot: usize,
    pub(super) translation: bool,
    pub(super) scale: bool,
}
