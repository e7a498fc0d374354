//! The `fk` op.

pub(in crate::retarget) mod edits;
pub(in crate::retarget) mod poles;
pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod shapes;
pub(in crate::retarget) mod shoulders;
pub(in crate::retarget) mod spec;
pub(in crate::retarget) mod twists;

pub use self::spec::{Carry, FkOp};
