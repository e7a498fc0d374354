//! What a task is done with, whichever it is.

use crate::{
    formats::Limits,
    model::{Control, Reporter},
    retarget::RetargetSpec,
};

use super::Knowledge;

/// What every task is done with.
pub(super) struct TaskContext<'a> {
    pub(super) spec: RetargetSpec,
    pub(super) knowledge: &'a Knowledge,
    pub(super) limits: &'a Limits,
    pub(super) control: &'a Control,
    /// When it began, by the control's clock.
    pub(super) begin: f64,
    pub(super) reporter: Reporter,
}
