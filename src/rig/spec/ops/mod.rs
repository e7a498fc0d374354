//! The steps of a retarget and their parameters, one file per op.

mod contacts;
mod filter;
mod fk;
mod floor;
mod ik;
mod pelvis;
mod plant;
mod scope;
mod self_contact;

pub use contacts::{ContactFloor, ContactFloorRule, ContactsOp};
pub use filter::{FilterKind, FilterOp};
pub use fk::{Carry, FkOp};
pub use floor::FloorOp;
pub use ik::{IkGoal, IkOp};
pub use pelvis::{HeightRule, PelvisOp, PelvisScale, PelvisScaleRule, ScaleOrigin};
pub use plant::{PlantMode, PlantOp};
pub use scope::{Alpha, Scope};
pub use self_contact::SelfContactOp;

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
            Self::SelfContact(op) => Some(&op.scope),
            Self::Filter(op) => Some(&op.scope),
        }
    }
}
