//! Faults on the way to the database, for tests: what relies on the records must be right whatever a call answers.

use std::fmt::Debug;

use futures::future::BoxFuture;

use crate::store::StoreError;

/// When a fault may happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// Before anything was done: the call fails, and nothing has changed.
    Before,
    /// After everything was done: the caller sees an error although the changes were made.
    After,
}

/// Decides what goes wrong. An answer that takes its time is a delay.
pub trait Faults: Debug + Send + Sync {
    /// `Err` is what the caller sees.
    fn at(&self, moment: Moment) -> BoxFuture<'_, Result<(), StoreError>>;
}
