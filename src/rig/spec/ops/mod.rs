//! The steps of a retarget and their parameters, one file per op.

mod additive_pose;
mod arm_spacing;
mod contacts;
mod copy_base_pose;
mod filter;
mod fk;
mod floor;
mod ik;
mod joints;
mod limits;
mod pelvis;
mod pin;
mod plant;
mod root_motion;
mod scope;
mod stretch_chain;
mod twist;

pub use additive_pose::AdditivePoseOp;
pub use arm_spacing::ArmSpacingOp;
pub use contacts::{ContactFloor, ContactFloorRule, ContactsOp};
pub use copy_base_pose::CopyBasePoseOp;
pub use filter::{FilterKind, FilterOp};
pub use fk::{Carry, FkOp};
pub use floor::FloorOp;
pub use ik::{IkGoal, IkOp};
pub use joints::{JointRow, JointSource, JointSpace, JointsOp};
pub use limits::{LimitRange, LimitsOp};
pub use pelvis::{HeightRule, PelvisOp, PelvisScale, PelvisScaleRule, ScaleOrigin};
pub use pin::{Pin, PinMode, PinOp, PinSide};
pub use plant::{PlantMode, PlantOp};
pub use root_motion::{RootAction, RootAxis, RootMotionOp, RootPlace, RootSource};
pub use scope::{Alpha, Scope};
pub use stretch_chain::StretchChainOp;
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
    /// Puts the figure's way onto its root joint, or takes it out.
    RootMotion(RootMotionOp),
}

impl Op {
    /// When and on what it works; nothing for `pelvis` and `fk`, which have fields of their own for that.
    #[must_use]
    pub const fn scope(&self) -> Option<&Scope> {
        match self {
            Self::Pelvis(_) | Self::Fk(_) => None,
            Self::Contacts(op) => Some(&op.scope),
            Self::Ik(op) => Some(&op.scope),
            Self::Plant(op) => Some(&op.scope),
            Self::Floor(op) => Some(&op.scope),
            Self::Filter(op) => Some(&op.scope),
            Self::Joints(op) => Some(&op.scope),
            Self::Pin(op) => Some(&op.scope),
            Self::CopyBasePose(op) => Some(&op.scope),
            Self::AdditivePose(op) => Some(&op.scope),
            Self::ArmSpacing(op) => Some(&op.scope),
            Self::StretchChain(op) => Some(&op.scope),
            Self::Twist(op) => Some(&op.scope),
            Self::Limits(op) => Some(&op.scope),
            Self::RootMotion(op) => Some(&op.scope),
        }
    }
}
