//! What a stack runs, one after the other.

use std::fmt::Debug;

use super::work::Work;
use crate::model::Canceled;

/// Work on a whole clip, behind forward kinematics: indices and constants only.
pub(in crate::retarget) trait Stage: Debug + Send + Sync {
    /// Changes what the stages hand on to each other.
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled>;
}
