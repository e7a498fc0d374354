//! Ops that edit a pose frame by frame, in indices.

use glam::{DMat3, DQuat, DVec3};

use super::{JointSpace, PinMode, PinSide, RootAction, RootPlace};
use crate::retarget::spec::{RotationMode, TranslationMode};

/// One edit of the target's pose. Rotations and positions are in plan space where nothing else is said.
#[derive(Clone, Debug)]
pub enum PosedEdit {
    /// A row of a joint table.
    Joint(Box<JointDrive>),
    /// A joint that follows another.
    Pin(PinDrive),
    /// A joint that takes a source joint's transform below the parent.
    Copy(CopyDrive),
    /// A joint that is turned by a constant about its own axes.
    Add {
        /// The joint.
        joint: usize,
        /// `L · turn`.
        turn: DQuat,
    },
    /// An upper arm that is turned away from the body.
    ArmSpacing {
        /// The upper arm.
        joint: usize,
        /// The joint that it hangs from on the body.
        chest: usize,
        /// About the chest's front.
        radians: f64,
    },
    /// A chain whose bones get longer or shorter.
    Stretch(ChainStretch),
    /// A joint that bends no farther than it may.
    Limit(Box<JointLimit>),
    /// A joint of a finger that is bent and spread more or less.
    Finger(FingerDrive),
    /// A joint that a hand carries as the source's does.
    Prop(PropDrive),
    /// A chain that takes the shape, the local rotations or the lengths of the source's.
    Shape(Box<ChainShape>),
    /// Ends that get to goals.
    Reach(Box<ReachDrive>),
    /// A limb whose bend is turned to where the source's points.
    Pole {
        /// Index into the limbs.
        limb: usize,
        /// How much.
        align: f64,
        /// Radians by which it is turned further.
        offset: f64,
        /// Whether the angle between the rest poses' bends is kept.
        keeps_offset: bool,
    },
}

/// What a row of a joint table does.
#[derive(Clone, Debug)]
pub struct JointDrive {
    /// What is followed.
    pub from: DriveFrom,
    /// The target joint.
    pub joint: usize,
    /// In which space changes are measured.
    pub space: JointSpace,
    /// Factor on the displacement; nothing where the position does not follow.
    pub position_gain: Option<f64>,
    /// Factor on the angle; nothing where the rotation does not follow.
    pub rotation_gain: Option<f64>,
    /// Metres.
    pub position_offset: DVec3,
    /// About the joint's own axes.
    pub rotation_offset: DQuat,
    /// From the source's components of a vector to the target's: each row and each column has one ±1.
    pub axis_order: DMat3,
    /// Turns a change before it is applied.
    pub axis_offset: DQuat,
}

/// What a row follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriveFrom {
    /// A source joint.
    Joint(usize),
    /// The line between two.
    Pair {
        /// Where the line begins and ends, joints of the source.
        points: [usize; 2],
        /// The target joint that the bone leads to.
        end: usize,
    },
}

/// What a pin does.
#[derive(Clone, Copy, Debug)]
pub struct PinDrive {
    /// The joint that follows.
    pub joint: usize,
    /// The joint that it follows, of that side.
    pub to: usize,
    /// Whose it is.
    pub side: PinSide,
    /// How.
    pub mode: PinMode,
    /// Whether the position follows.
    pub position: bool,
    /// Whether the rotation follows.
    pub rotation: bool,
    /// Metres along the joint's own axes.
    pub offset: DVec3,
    /// About its own axes.
    pub rotation_offset: DQuat,
    /// Whether joints below it are carried along.
    pub carries_children: bool,
}

/// What is copied from a source joint.
#[derive(Clone, Copy, Debug)]
pub struct CopyDrive {
    /// Joint of the source.
    pub source: usize,
    /// Joint of the target.
    pub joint: usize,
    /// Whether the position is.
    pub position: bool,
    /// Whether the rotation is.
    pub rotation: bool,
}

/// How a chain is stretched.
#[derive(Clone, Debug)]
pub struct ChainStretch {
    /// Joints of the source, from the body outward, for its length; may be empty.
    pub source: Vec<usize>,
    /// Joints of the target; the bones between them are stretched.
    pub target: Vec<usize>,
    /// Share of becoming as long as the source's.
    pub match_source: f64,
    /// Factor.
    pub scale: f64,
}

/// How far a joint may bend, against what carries it.
#[derive(Clone, Copy, Debug)]
pub struct JointLimit {
    /// Joint of the target.
    pub joint: usize,
    /// Joint of the source that has the same role, where what it does beyond the limit is allowed.
    pub source: Option<usize>,
    /// Where the T poses lie.
    pub zero: LimitFrame,
    /// The same of the source.
    pub source_zero: LimitFrame,
    /// Along the bone, the axis about which it bends, and the one across, at the T pose in plan space.
    pub axes: [DVec3; 3],
    /// Radians against and in the direction of bending.
    pub bend: [f64; 2],
    /// Radians across.
    pub side: [f64; 2],
    /// Radians about the bone.
    pub twist: [f64; 2],
    /// The share of a limit up to which nothing is changed.
    pub begin: f64,
}

/// The T pose of a joint: `D = parent · L · local⁻¹ · parent⁻¹` is the identity there.
#[derive(Clone, Copy, Debug, Default)]
pub struct LimitFrame {
    /// The rotation of its parent, in plan space.
    pub parent: DQuat,
    /// Its own below the parent.
    pub local: DQuat,
}

/// How the figure's way is moved.
#[derive(Clone, Copy, Debug)]
pub struct RootMotion {
    /// What is done.
    pub action: RootAction,
    /// The root joint of the target; nothing where the way is taken out.
    pub root: Option<usize>,
    /// The joint whose way it is: the pelvis of the target.
    pub pelvis: usize,
    /// The source joint whose way it is instead.
    pub source: Option<usize>,
    /// 1 for axes along which it is: left, up, front.
    pub axes: DVec3,
    /// Whether the heading is part of it.
    pub turn: bool,
    /// Where the root stands.
    pub place: RootPlace,
    /// Standard deviation of the smoothing.
    pub smoothing_seconds: f64,
}

/// How a joint of a finger is bent.
#[derive(Clone, Copy, Debug)]
pub struct FingerDrive {
    /// The joint.
    pub joint: usize,
    /// Along its bone, and what it bends about toward the palm, in its own axes; nothing where it is bent as a whole.
    pub axes: Option<[DVec3; 2]>,
    /// Factor on the bending.
    pub curl: f64,
    /// Factor on the spreading.
    pub spread: f64,
    /// Radians of further bending.
    pub curl_offset: f64,
}

/// What carries a prop.
#[derive(Clone, Copy, Debug)]
pub struct PropDrive {
    /// The prop of the target.
    pub joint: usize,
    /// The prop of the source.
    pub source: usize,
    /// What carries it.
    pub holder: usize,
    /// What carries the source's.
    pub source_holder: usize,
    /// Factor on the distance, in plan units.
    pub scale: f64,
}

/// Two hands that hold the same thing, as indices into the limbs.
#[derive(Clone, Copy, Debug)]
pub struct GripPair {
    /// The one that leads.
    pub lead: usize,
    /// The one that follows.
    pub follows: usize,
    /// Factor on the distance between them, in plan units.
    pub scale: f64,
    /// Metres between the source's hands up to which the other follows fully, at an arm of 1 m.
    pub within: f64,
}

/// How a chain takes the shape of the source's.
#[derive(Clone, Debug)]
pub struct ChainShape {
    /// Joints of the source, from the body outward.
    pub source: Vec<usize>,
    /// Joints of the target.
    pub target: Vec<usize>,
    /// The joints that both chains lead to, where they lead to any.
    pub ends: Option<(usize, usize)>,
    /// A mode that shapes, else `none`.
    pub rotation: RotationMode,
    /// A mode that shapes, else `none`.
    pub translation: TranslationMode,
    /// 0 keeps the rest rotations.
    pub rotation_alpha: f64,
    /// 0 keeps the rest lengths.
    pub translation_alpha: f64,
}

/// What the source's motion is scaled by.
#[derive(Clone, Copy, Debug)]
pub struct SourceScale {
    /// The factor.
    pub factor: f64,
    /// The source joint that stays where it is at each frame; else the origin does.
    pub pivot: Option<usize>,
    /// Up, in the source scene's space.
    pub up: DVec3,
    /// Height of the floor that the pivot is taken down to, in the scene's unit; nothing where it stays at its height.
    pub floor: Option<f64>,
}

/// Ends of chains that get to goals.
#[derive(Clone, Debug)]
pub struct ReachDrive {
    /// The ends.
    pub ends: Vec<ReachEnd>,
    /// Joints that may turn, parents first.
    pub joints: Vec<usize>,
    /// How stiff each of them is, 0 to 1.
    pub stiffness: Vec<f64>,
    /// The pelvis, where it may go along, and how freely.
    pub pelvis: Option<(usize, f64)>,
    /// Rounds at most.
    pub iterations: u32,
    /// As a share of the chains' lengths.
    pub damping: f64,
}

/// One end and what its goal comes from.
#[derive(Clone, Debug)]
pub struct ReachEnd {
    /// Joint of the target.
    pub end: usize,
    /// Joint of the source.
    pub source: usize,
    /// The first joint that may turn.
    pub start: usize,
    /// The source's joint that the goal is seen from; nothing where it is a place in the world.
    pub source_start: Option<usize>,
    /// Joints that may turn for it, parents first.
    pub turning: Vec<usize>,
    /// Share of the way there, along left, up and front.
    pub weight: DVec3,
    /// Metres along left, up and front.
    pub offset: DVec3,
}
