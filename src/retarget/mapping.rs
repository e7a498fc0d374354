//! What drives what, in indices: the result of resolving a spec against two rigs, and the input of the plan.

use glam::{DMat3, DQuat, DVec3};

use crate::rig::{Limb, LimbJoints, soles::FootShape};

use crate::model::{LocalPose, ModelPose, Transform, rotation::smoothstep};
use crate::rig::anatomy::Ride;

use super::{
    ops::Carry,
    spec::{RotationMode, TranslationMode},
};

/// Everything that the plan needs to know about two rigs. All indices are in range of the two skeletons.
#[derive(Clone, Debug)]
pub struct Mapping {
    /// The pose that source motion is measured from, in the source scene's space and unit.
    pub source_rest: ModelPose,
    /// The pose that it is put onto, in the target scene's space and unit, aligned with the source's.
    pub target_rest: ModelPose,
    /// The local pose of target joints that nothing drives.
    pub target_hold: LocalPose,
    /// How source space lies in plan space: a rotation, and target units per source unit as the scale.
    ///
    /// Plan space is the space that the plan counts in: the target scene's for chains that are measured in the model; +Z up, +Y
    /// front for chains that their parents carry, because ikrigretarget's last digits depend on it. Its unit is the target's.
    pub plan_from_source: Transform,
    /// How target space lies in plan space.
    pub plan_from_target: DQuat,
    /// The pelvis, when it is driven.
    pub pelvis: Option<PelvisPair>,
    /// The chains, in the order in which they are evaluated. A target joint that is in several belongs to the last.
    pub chains: Vec<ChainPair>,
    /// Target joints that are placed by another joint than their parent; no joint twice, and in no circle.
    pub rides: Vec<Ride>,
    /// Target joints that share the twist of a limb. Where a chain drives such a joint too, this decides.
    pub twists: Vec<TwistPair>,
    /// Clavicles that follow their arms.
    pub shoulders: Vec<ShoulderPair>,
    /// Target pelvis height over source pelvis height, both in target units; what `globally_scaled` multiplies by.
    pub global_scale: f64,
    /// How the floor lies; known where an op works behind forward kinematics.
    pub ground: Ground,
    /// Limbs that both rigs have, likewise.
    pub limbs: Vec<LimbPair>,
}

/// The floor of both sides. Heights are along `up`; everything is in plan space and in the plan's unit.
#[derive(Clone, Copy, Debug)]
pub struct Ground {
    /// Up.
    pub up: DVec3,
    /// Where the figure faces at rest.
    pub front: DVec3,
    /// Plan units per meter.
    pub units_per_meter: f64,
    /// What a displacement of the source becomes on the target: the pelvis scale along up and along the floor.
    pub travel: DMat3,
    /// Height of the floor under the source's rest pose.
    pub source_rest_floor: f64,
    /// Height of the floor in the source's clip.
    pub source_floor: f64,
    /// Height of the floor under the target's rest pose.
    pub target_rest_floor: f64,
    /// Height of the floor under the result.
    pub target_floor: f64,
}

impl Ground {
    /// The figure's left, up and front, as columns.
    #[must_use]
    pub fn axes(&self) -> DMat3 {
        DMat3::from_cols(self.up.cross(self.front), self.up, self.front)
    }
}

impl Default for Ground {
    fn default() -> Self {
        Self {
            up: DVec3::Y,
            front: DVec3::Z,
            units_per_meter: 1.0,
            travel: DMat3::IDENTITY,
            source_rest_floor: 0.0,
            source_floor: 0.0,
            target_rest_floor: 0.0,
            target_floor: 0.0,
        }
    }
}

/// A limb that both rigs have. It reaches for goals as one of two bones does: what lies between its start and its middle, and between
/// its middle and its end, keeps the shape that forward kinematics give it.
#[derive(Clone, Debug)]
pub struct LimbPair {
    /// Which.
    pub limb: Limb,
    /// Joints of the source.
    pub source: LimbJoints,
    /// Joints of the target.
    pub target: LimbJoints,
    /// Whether nothing says how the source's foot is turned: it has no toes, and never turns against the shin in this clip.
    pub has_stiff_foot: bool,
    /// The foot of the source; of hands nothing is known.
    pub source_foot: FootShape,
    /// The foot of the target.
    pub target_foot: FootShape,
}

impl LimbPair {
    /// A limb of whose feet nothing is known.
    pub(in crate::retarget) fn of(limb: Limb, source: LimbJoints, target: LimbJoints) -> Self {
        let (source_foot, target_foot) = (FootShape::default(), FootShape::default());
        Self { limb, source, target, has_stiff_foot: false, source_foot, target_foot }
    }

    /// Joints of the target that turn when it reaches for a goal; the ball of the foot too where asked for.
    pub(in crate::retarget) fn turned(&self, with_ball: bool) -> impl Iterator<Item = usize> + use<> {
        let LimbJoints { start, middle, end, ball, .. } = self.target;
        [Some(start), Some(middle), Some(end), ball.filter(|_| with_ball)].into_iter().flatten()
    }
}

/// The pelvis of both rigs, and where the target's goes.
#[derive(Clone, Copy, Debug)]
pub struct PelvisPair {
    /// Joint of the source.
    pub source: usize,
    /// Joint of the target.
    pub target: usize,
    /// 1 takes the source's rotation change, 0 keeps the rest rotation.
    pub rotation_alpha: f64,
    /// 1 takes the scaled source position, 0 keeps the rest position.
    pub translation_alpha: f64,
    /// Source position to target position.
    pub position: PelvisPosition,
    /// The same from the scale alone, without the op's offsets.
    pub plain: PelvisPosition,
    /// Turns it further in plan space, after the source's change.
    pub turn: DQuat,
    /// Turns it further about its own axes.
    pub local_turn: DQuat,
    /// Moves it along its own axes, in plan units.
    pub local_offset: DVec3,
    /// Makes the height of the crotch follow the source's.
    pub crotch: Option<CrotchRule>,
    /// How much goals of limbs go along with what moves the pelvis beside the scale: over the floor, and up.
    pub affects_goals: [f64; 2],
}

impl PelvisPair {
    /// Whether the pelvis goes elsewhere than where the scale alone puts it.
    #[must_use]
    pub fn is_moved(&self) -> bool {
        let (position, plain) = (&self.position, &self.plain);
        position.scale != plain.scale
            || position.target_origin != plain.target_origin
            || self.local_offset != DVec3::ZERO
            || self.crotch.is_some()
    }
}

/// Raises the pelvis by `weight · (ratio · (z_S − source_below) + target_below − scale · z_S)`, with `z_S` for the source pelvis'
/// height above its floor; all in plan space and units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrotchRule {
    /// Up.
    pub up: DVec3,
    /// Height of the floor under the source's clip.
    pub source_floor: f64,
    /// From the crotch to the pelvis joint.
    pub source_below: f64,
    /// The same of the target.
    pub target_below: f64,
    /// Height of the target's crotch at rest over that of the source's.
    pub ratio: f64,
    /// What the scale alone makes of a height.
    pub scale: f64,
    /// How much of it is taken.
    pub weight: f64,
    /// Height of the source's crotch at which nothing of it is taken any more.
    pub faded_at: Option<f64>,
}

/// `target = target_origin + turn⁻¹ · (scale ∘ (turn · (source − source_origin)))`, with `turn` = `canonical_from_plan`, all in plan
/// space.
#[derive(Clone, Copy, Debug)]
pub struct PelvisPosition {
    /// The rotation into +Y up, +Z front.
    pub canonical_from_plan: DQuat,
    /// Factors along right, up and front.
    pub scale: DVec3,
    /// The point of the source that is scaled about.
    pub source_origin: DVec3,
    /// Where that point goes.
    pub target_origin: DVec3,
    /// How far `source_origin` is below what the source's feet touch, where only their lowest joint says where that is: as far as
    /// the target's soles are below its own, in proportion.
    pub source_sole: f64,
}

/// A source chain that drives a target chain.
#[derive(Clone, Debug)]
pub struct ChainPair {
    /// For messages and reports: the target chain's name or role.
    pub name: String,
    /// Source joints from the body outward; at least one; each below the one before.
    pub source: Vec<usize>,
    /// Further source chains: the target chain follows the mean of all, as a finger does that stands for several. Not where chains
    /// are carried along by their parents.
    pub also: Vec<FurtherChain>,
    /// Target joints from the body outward; at least one; each below the one before.
    pub target: Vec<usize>,
    /// How it is driven.
    pub drive: Drive,
    /// Which places of the two chains are equal, where their joints do not correspond one by one.
    pub spacing: Spacing,
    /// Where the chain as a whole points, for chains whose joints do not correspond one by one (spines, necks).
    pub chord: Option<Chord>,
}

/// A source chain beside the one that a target chain follows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FurtherChain {
    /// Source joints from the body outward; at least one; each below the one before.
    pub source: Vec<usize>,
    /// Which places of it and of the target chain are equal.
    pub spacing: Spacing,
}

impl ChainPair {
    /// The pairs of which the target follows the mean: each further source chain in the place of the first, in order.
    #[must_use]
    pub fn further(&self) -> Vec<Self> {
        let pair = |chain: &FurtherChain| Self {
            source: chain.source.clone(),
            spacing: chain.spacing,
            also: Vec::new(),
            ..self.clone()
        };
        self.also.iter().map(pair).collect()
    }
}

/// Which places of two chains are equal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spacing {
    /// Those at equal shares of the chains' lengths.
    #[default]
    Length,
    /// The source's first joint carries the chain and is no part of it; the bend between it and the chain's end is spread
    /// evenly over the target's joints.
    Led,
    /// The same, but spread as fingers curl: the joint at the knuckle by 1, the next by 1.1, the last by 0.7.
    Curled,
}

impl Spacing {
    /// How many joints of the source lead into the chain.
    #[must_use]
    pub const fn lead(self) -> usize {
        match self {
            Self::Length => 0,
            Self::Led | Self::Curled => 1,
        }
    }
}

/// The straight line from a chain's first joint to the joint that it leads to.
///
/// Spines of three and of five joints bend in other places, so equal rotations at equal places leave their ends pointing
/// elsewhere. The chord is what an onlooker sees; from the rest pose on, it turns as the source's does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chord {
    /// The source joint that the chain leads to.
    pub source_end: usize,
    /// The target joint that the chain leads to; below the chain's last joint.
    pub target_end: usize,
    /// How the joints share the turn that makes the chord point there.
    pub correction: ChordCorrection,
}

/// How the joints of a chain share the turn that makes its chord point as the source's does.
///
/// A turn of a few joints bends the chain where those begin and where they end. The source's chain has no such bends, so a
/// correction of a spine or neck is limited: what is left over is a chord that points a little elsewhere, which shows far less
/// than a kink.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ChordCorrection {
    /// All joints turn together, as far as it takes: a bone that stands for several of the source.
    Whole,
    /// All joints turn together, at most this far, in radians.
    Limited(f64),
    /// The last joint, a chest that carries the arms, keeps the source's rotation, and the joints before it turn. Beyond `free`
    /// the chest begins to turn with them, so that they need not turn by more than `max`; both in radians. Where the chest turns
    /// all the way with them, the whole is limited to `max` too.
    BelowChest {
        /// Up to here the chest keeps the source's rotation exactly.
        free: f64,
        /// The largest turn.
        max: f64,
    },
}

impl ChordCorrection {
    /// Whether the chain's last joint is turned by another rotation than the joints before it.
    #[must_use]
    pub const fn has_chest(self) -> bool {
        matches!(self, Self::BelowChest { .. })
    }
}

impl CrotchRule {
    /// How much higher the pelvis goes when the source's is there.
    #[must_use]
    pub fn raise(&self, source: DVec3) -> f64 {
        let height = source.dot(self.up) - self.source_floor;
        let crotch = height - self.source_below;
        let fade = self.faded_at.map_or(1.0, |faded_at| smoothstep(1.0 - (crotch / faded_at).clamp(0.0, 1.0)));
        self.weight * fade * (self.ratio * crotch + self.target_below - self.scale * height)
    }
}

/// How a chain is driven, every question answered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// In which frame rotation changes are measured.
    pub carry: Carry,
    /// How rotations are found.
    pub rotation: RotationMode,
    /// How translations are found.
    pub translation: TranslationMode,
    /// 1 takes the source's rotation.
    pub rotation_alpha: f64,
    /// 1 takes the translation mode's translation.
    pub translation_alpha: f64,
}

impl Drive {
    /// How much of the source's rotation is followed; what shapes a chain afterwards applies its alpha itself.
    #[must_use]
    pub const fn followed_rotation_alpha(&self) -> f64 {
        if self.rotation.is_shape() { 1.0 } else { self.rotation_alpha }
    }
}

impl Default for Drive {
    fn default() -> Self {
        Self {
            carry: Carry::Model,
            rotation: RotationMode::Auto,
            translation: TranslationMode::None,
            rotation_alpha: 1.0,
            translation_alpha: 1.0,
        }
    }
}

impl Mapping {
    /// The rotation of source space into target space.
    #[must_use]
    pub fn target_from_source(&self) -> DQuat {
        self.plan_from_target.conjugate() * self.plan_from_source.rotation
    }

    /// Which target joints the mapping drives.
    #[must_use]
    pub fn driven(&self) -> Vec<bool> {
        let mut driven = vec![false; self.target_rest.transforms().len()];
        for &joint in self.chains.iter().flat_map(|chain| &chain.target) {
            driven[joint] = true;
        }
        for joint in self.twists.iter().map(|twist| twist.joint).chain(self.shoulders.iter().map(|pair| pair.joint)) {
            driven[joint] = true;
        }
        if let Some(pelvis) = &self.pelvis {
            driven[pelvis.target] = true;
        }
        driven
    }
}

/// A target joint that turns about a limb with part of its twist. All rotations are of the target's own rest pose: there the
/// skin was bound, and there nothing is twisted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwistPair {
    /// The joint that is turned.
    pub joint: usize,
    /// The joint that it is turned against: its segment's, above it; itself where it is the segment.
    pub segment: usize,
    /// Along the limb, in the segment's own axes; a unit vector.
    pub axis: DVec3,
    /// `segment_from_joint` of the rest pose; the identity where the joint is the segment.
    pub segment_from_joint: DQuat,
    /// Where the twist is seen.
    pub against: TwistAgainst,
    /// How much of the twist the joint is turned by; from −1 to 1.
    pub share: f64,
}

/// What a limb's twist is measured against.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TwistAgainst {
    /// The joint that carries the limb, such as a clavicle: above the segment, or ridden by it.
    Carrier {
        /// The joint.
        joint: usize,
        /// `carrier_from_segment` of the rest pose.
        carrier_from_segment: DQuat,
    },
    /// The joint that the segment leads to, such as a hand; it has a driver of its own.
    End {
        /// The joint.
        joint: usize,
        /// `segment_from_end` of the rest pose.
        segment_from_end: DQuat,
    },
}

/// A clavicle that follows its arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShoulderPair {
    /// The clavicle; its parent carries it.
    pub joint: usize,
    /// The upper arm; it has a driver of its own.
    pub upper_arm: usize,
    /// From the shoulder to the elbow, in the upper arm's own axes; a unit vector.
    pub arm: DVec3,
    /// Up, in the axes of the clavicle's parent; a unit vector.
    pub up: DVec3,
    /// What the clavicle is lifted about, in the axes of its parent; a unit vector.
    pub axis: DVec3,
    /// Elevation of the arm from hanging that lifts nothing yet: that of the rest pose, and at least 30°.
    pub free_radians: f64,
    /// Lift of the clavicle per elevation of the arm beyond that; 0 to 1.
    pub share: f64,
}
