//! The `props` op.

pub(in crate::retarget) mod carried;
pub(in crate::retarget) mod grips;
pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::{CarriedProp, Grip, GripHand, PropsOp};
