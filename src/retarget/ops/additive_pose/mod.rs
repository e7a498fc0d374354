//! The `additive_pose` op.

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::AdditivePoseOp;
