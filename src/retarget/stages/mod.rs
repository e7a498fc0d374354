//! What the ops behind forward kinematics have in common: the state that they hand on, poses, limbs that reach for goals.

mod ahead;
pub(in crate::retarget) mod builder;
pub(in crate::retarget) mod clock;
pub(in crate::retarget) mod contact_points;
pub(in crate::retarget) mod gaps;
pub(in crate::retarget) mod limbs;
pub(in crate::retarget) mod moved_arm;
pub(in crate::retarget) mod posed;
pub(in crate::retarget) mod posing;
pub(in crate::retarget) mod pull;
pub(in crate::retarget) mod result;
pub(in crate::retarget) mod ride;
pub(in crate::retarget) mod solve;
pub(in crate::retarget) mod stage;
pub(in crate::retarget) mod temporal;
pub(in crate::retarget) mod two_bone;
pub(in crate::retarget) mod work;

pub use result::{ContactTrack, LimbReach, StackResult};
pub use work::LimitedJoint;
