//! The steps of a retarget and their parameters, one file per op.

pub(in crate::retarget) mod additive_pose;
pub(in crate::retarget) mod arm_spacing;
pub(in crate::retarget) mod changes;
pub(in crate::retarget) mod contacts;
pub(in crate::retarget) mod context;
pub(in crate::retarget) mod copy_base_pose;
pub(in crate::retarget) mod curves;
pub(in crate::retarget) mod edits;
pub(in crate::retarget) mod filter;
pub(in crate::retarget) mod fingers;
pub(in crate::retarget) mod fk;
pub(in crate::retarget) mod floor;
pub(in crate::retarget) mod ik;
pub(in crate::retarget) mod joints;
pub(in crate::retarget) mod limits;
pub(in crate::retarget) mod pelvis;
pub(in crate::retarget) mod pin;
pub(in crate::retarget) mod plant;
pub(in crate::retarget) mod props;
pub(in crate::retarget) mod reach;
pub(in crate::retarget) mod resolved;
pub(in crate::retarget) mod root_motion;
pub(in crate::retarget) mod scale_source;
pub(in crate::retarget) mod schedule;
pub(in crate::retarget) mod scope;
pub(in crate::retarget) mod self_contact;
pub(in crate::retarget) mod source_curves;
pub(in crate::retarget) mod stretch_chain;
pub(in crate::retarget) mod stride;
pub(in crate::retarget) mod twist;

pub use additive_pose::AdditivePoseOp;
pub use arm_spacing::ArmSpacingOp;
pub use contacts::{ContactFloor, ContactFloorRule, ContactsOp};
pub use copy_base_pose::CopyBasePoseOp;
pub use curves::{ContactCurve, CurveDrive, CurveRow, CurvesOp, OtherCurves, carried_curves};
pub use edits::{
    ChainShape, ChainStretch, CopyDrive, DriveFrom, FingerDrive, GripPair, JointDrive, JointLimit, LimitFrame,
    PinDrive, PosedEdit, PropDrive, ReachDrive, ReachEnd, RootMotion, SourceScale,
};
pub use filter::{FilterKind, FilterOp, filtered};
pub use fingers::FingersOp;
pub use fk::{Carry, FkOp};
pub use floor::FloorOp;
pub use ik::{IkGoal, IkOp};
pub use joints::{JointRow, JointSource, JointSpace, JointsOp};
pub use limits::{LimitRange, LimitsOp};
pub use pelvis::{HeightRule, PelvisOp, PelvisScale, PelvisScaleRule, ScaleOrigin};
pub use pin::{Pin, PinMode, PinOp, PinSide};
pub use plant::{PlantMode, PlantOp};
pub use props::{CarriedProp, Grip, GripHand, PropsOp};
pub use reach::{ReachGoal, ReachOp, ReachPlace};
pub use resolved::{Ground, LimbPair, StagedKind, StagedOp, Stages};
pub use root_motion::{RootAction, RootAxis, RootMotionOp, RootPlace, RootSource};
pub use scale_source::ScaleSourceOp;
pub use schedule::{Schedule, scheduled};
pub use scope::{Alpha, AlphaCurve, Scope};
pub use self_contact::SelfContactOp;
pub use stretch_chain::StretchChainOp;
pub use stride::{StrideDirection, StrideOp};
pub use twist::TwistOp;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One step of the retarget.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "op", rename_all = "snake_case")]
pub enum Op {
    /// Moves and turns the pelvis.
    Pelvis(PelvisOp),
    /// Turns the chains by forward kinematics.
    Fk(FkOp),
    /// Finds where feet and hands rest on something in the source.
    Contacts(ContactsOp),
    /// Sets goals for the ends of limbs and reaches them.
    Ik(IkOp),
    /// Keeps feet where they stand.
    Plant(PlantOp),
    /// Keeps soles as far above the floor as the source's are.
    Floor(FloorOp),
    /// Keeps hands that touch the body touching it.
    SelfContact(SelfContactOp),
    /// Takes noise off rotations.
    Filter(FilterOp),
    /// Drives joints one by one from a table.
    Joints(JointsOp),
    /// Lets joints follow another joint.
    Pin(PinOp),
    /// Copies joints of equal names as they are.
    CopyBasePose(CopyBasePoseOp),
    /// Adds a constant change of pose.
    AdditivePose(AdditivePoseOp),
    /// Turns arms away from the body or toward it.
    ArmSpacing(ArmSpacingOp),
    /// Makes chains longer or shorter.
    StretchChain(StretchChainOp),
    /// Shares the twist of limbs out among twist joints.
    Twist(TwistOp),
    /// Takes back what bends farther than bodies do.
    Limits(LimitsOp),
    /// Bends and spreads fingers more or less.
    Fingers(FingersOp),
    /// Gets ends of chains to goals with the help of the body.
    Reach(ReachOp),
    /// Makes steps longer or shorter.
    Stride(StrideOp),
    /// Carries custom properties over.
    Curves(CurvesOp),
    /// Keeps things in hands.
    Props(PropsOp),
    /// Scales the source's motion.
    ScaleSource(ScaleSourceOp),
    /// Puts the figure's way onto its root joint, or takes it out.
    RootMotion(RootMotionOp),
}

impl Op {
    /// How much of it is taken.
    #[must_use]
    pub fn alpha(&self) -> &Alpha {
        match self {
            Self::Pelvis(op) => &op.alpha,
            Self::Fk(op) => &op.alpha,
            other => other.scope().map_or(&Alpha::ALL, |scope| &scope.alpha),
        }
    }

    /// When and on what it works; nothing for `pelvis` and `fk`, which have fields of their own for that.
    #[must_use]
    pub const fn scope(&self) -> Option<&Scope> {
        match self {
            Self::Pelvis(_) | Self::Fk(_) => None,
            Self::Contacts(op) => Some(&op.scope),
            Self::Ik(op) => Some(&op.scope),
            Self::Plant(op) => Some(&op.scope),
            Self::Floor(op) => Some(&op.scope),
            Self::SelfContact(op) => Some(&op.scope),
            Self::Filter(op) => Some(&op.scope),
            Self::Joints(op) => Some(&op.scope),
            Self::Pin(op) => Some(&op.scope),
            Self::CopyBasePose(op) => Some(&op.scope),
            Self::AdditivePose(op) => Some(&op.scope),
            Self::ArmSpacing(op) => Some(&op.scope),
            Self::StretchChain(op) => Some(&op.scope),
            Self::Twist(op) => Some(&op.scope),
            Self::Limits(op) => Some(&op.scope),
            Self::Fingers(op) => Some(&op.scope),
            Self::Stride(op) => Some(&op.scope),
            Self::Reach(op) => Some(&op.scope),
            Self::Curves(op) => Some(&op.scope),
            Self::Props(op) => Some(&op.scope),
            Self::ScaleSource(op) => Some(&op.scope),
            Self::RootMotion(op) => Some(&op.scope),
        }
    }
}
