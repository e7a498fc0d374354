//! The `pelvis` op.

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod sizes;
pub(in crate::retarget) mod spec;

pub use self::spec::{HeightRule, PelvisOp, PelvisScale, PelvisScaleRule, ScaleOrigin};
