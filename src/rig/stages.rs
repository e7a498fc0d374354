//! What is done behind forward kinematics, in indices: the ops of a spec resolved against two rigs.

mod changes;
mod curves;
mod limb;
mod posed;

pub use curves::CurveDrive;
pub use limb::Limb;
pub use posed::{
    ChainShape, ChainStretch, CopyDrive, DriveFrom, FingerDrive, GripPair, JointDrive, JointLimit, LimitFrame,
    PinDrive, PosedEdit, PropDrive, ReachDrive, ReachEnd, RootMotion, SourceScale,
};

use glam::{DMat3, DVec3};

use super::{
    soles::FootShape,
    spec::{ContactsOp, FilterOp, FloorOp, IkOp, PlantOp, SelfContactOp, StrideOp},
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

/// The joints of a limb.
#[derive(Clone, Copy, Debug)]
pub struct LimbJoints {
    /// Hip or shoulder.
    pub start: usize,
    /// Knee or elbow.
    pub middle: usize,
    /// The joint of the bone that the end hangs from: the middle, or in legs of more bones one beyond it.
    pub shin: usize,
    /// Ankle or wrist; of an animal's leg the joint of the paw.
    pub end: usize,
    /// The ball of the foot.
    pub ball: Option<usize>,
    /// The end of the toes: the joint farthest from the ball below it.
    pub tip: Option<usize>,
    /// What lies below a foot.
    pub sole: Option<Sole>,
}

impl LimbJoints {
    /// Start, middle and end.
    #[must_use]
    pub const fn joints(&self) -> [usize; 3] {
        [self.start, self.middle, self.end]
    }
}

/// The sole of a foot, from the rest pose, in plan units: how far the floor is below each joint of it. In motion each joint
/// keeps at least that distance from the floor, however it is turned, as if there were a ball around it.
#[derive(Clone, Copy, Debug)]
pub struct Sole {
    /// Below the ankle.
    pub heel: f64,
    /// Below the joint of the ball.
    pub ball: Option<f64>,
    /// Below the end of the toes.
    pub tip: Option<f64>,
    /// Straight down at rest, in the axes of ankle, ball and end of the toes; unit length. Nothing of a foot that does not stand at rest.
    pub down: [Option<DVec3>; 3],
    /// From the ankle to the joint of the ball, in the ankle's axes.
    pub end_to_ball: Option<DVec3>,
    /// From the joint of the ball to the end of the toes, in the ball's axes.
    pub ball_to_tip: Option<DVec3>,
}

impl Sole {
    /// The points of the sole below ankle, ball and end of the toes at rest, in the axes of those joints.
    #[must_use]
    pub fn points(&self) -> [Option<DVec3>; 3] {
        let [heel, ball, tip] = self.down;
        let below = |down: Option<DVec3>, height: Option<f64>| down.zip(height).map(|(down, height)| down * height);
        [below(heel, Some(self.heel)), below(ball, self.ball), below(tip, self.tip)]
    }
}

/// When an op works.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    /// Keys of seconds and alpha, at least one.
    pub alpha: Vec<[f64; 2]>,
    /// First and last frame.
    pub frames: [usize; 2],
}

impl Schedule {
    /// All of it, at all frames.
    #[must_use]
    pub fn always() -> Self {
        Self { alpha: vec![[0.0, 1.0]], frames: [0, usize::MAX] }
    }
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
