//! What is done behind forward kinematics, in indices: the ops of a spec resolved against two rigs.

use glam::{DMat3, DVec3};

use super::{GripPair, PosedEdit, RootMotion, SourceScale, curves::CurveDrive, schedule::Schedule};
use crate::rig::{Limb, LimbJoints};

use super::{ContactsOp, FilterOp, FloorOp, IkOp, PlantOp, SelfContactOp, StrideOp};
use crate::rig::{
    soles::FootShape,
    tails::Tail,
    volumes::{BodyPart, HandPair},
};

/// The stages and what they share.
#[derive(Clone, Debug, Default)]
pub struct Stages {
    /// How the floor lies.
    pub ground: Ground,
    /// Limbs that both rigs have.
    pub limbs: Vec<LimbPair>,
    /// The target's tails, where an op keeps them above the floor.
    pub tails: Vec<Tail>,
    /// Parts of the body that hands may touch, where an op asks for them.
    pub parts: Vec<BodyPart>,
    /// The hands that may touch them, likewise.
    pub hands: Vec<HandPair>,
    /// The ops, in order.
    pub ops: Vec<StagedOp>,
    /// What the source's motion is scaled by before anything else.
    pub source_scale: Option<SourceScale>,
    /// What is carried over beside the joints.
    pub curves: Vec<CurveDrive>,
}

/// The floor of both sides. Heights are along `up`; everything is in plan space and in the plan's unit.
#[derive(Clone, Copy, Debug)]
pub struct Ground {
    /// Up.
    pub up: DVec3,
    /// Where the figure faces at rest.
    pub front: DVec3,
    /// Plan units per metre.
    pub units_per_metre: f64,
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
            units_per_metre: 1.0,
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

/// One op behind forward kinematics.
#[derive(Clone, Debug)]
pub struct StagedOp {
    /// When it works.
    pub schedule: Schedule,
    /// Which limbs, as indices into [`Stages::limbs`].
    pub limbs: Vec<usize>,
    /// What it does.
    pub kind: StagedKind,
}

/// What an op does, with its parameters as the spec has them.
#[derive(Clone, Debug)]
pub enum StagedKind {
    /// Finds contacts.
    Contacts(ContactsOp),
    /// Sets goals.
    Ik(IkOp),
    /// Holds feet.
    Plant(PlantOp),
    /// Puts soles onto the floor.
    Floor(FloorOp),
    /// Leads hands to what they touch.
    SelfContact(SelfContactOp),
    /// Filters the rotations of these target joints.
    Filter(FilterOp, Vec<usize>),
    /// Edits poses frame by frame, in this order.
    Posed(Vec<PosedEdit>),
    /// Shares twists out, times the gain, among the twist joints of these segments.
    Twist(f64, Vec<usize>),
    /// Fades the driven joints among these toward their rest pose where the schedule's alpha is below 1.
    Fade(Vec<usize>),
    /// Spreads goals and the pelvis' way.
    Stride(StrideOp),
    /// Leads hands to what other hands hold.
    Grips(Vec<GripPair>),
    /// Moves the figure's way.
    RootMotion(RootMotion),
}
