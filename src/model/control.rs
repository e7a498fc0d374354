//! How long work reports progress and hears that it is no longer wanted.

use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};

/// The work was canceled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the work was canceled")]
pub struct Canceled;

named! {
    /// What a job is doing.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    #[repr(u8)]
    #[non_exhaustive]
    pub enum Phase {
        /// Not begun.
        Waiting = "waiting",
        /// Decoding the input files.
        Read = "read",
        /// Recognizing rigs, aligning rest poses, compiling the plan.
        Plan = "plan",
        /// Looking for better parameters; counted in frames of as many retargets as are allowed.
        Tune = "tune",
        /// The loop over frames.
        Retarget = "retarget",
        /// Encoding the outputs.
        Write = "write",
    }
}

/// A reading of how far the work is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Progress {
    /// What it is doing.
    pub phase: Phase,
    /// Units done in this phase (frames while retargeting).
    pub done: u64,
    /// Units of this phase; zero where unknown.
    pub total: u64,
}

/// Shared between the one who does the work and the one who watches it.
#[derive(Debug, Default)]
pub struct Control {
    clock: Option<fn() -> f64>,
    canceled: AtomicBool,
    phase: AtomicU8,
    done: AtomicU64,
    total: AtomicU64,
}

impl Control {
    /// A control that nobody has canceled.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A control with a clock that counts seconds from any moment on. The pure half has none of its own: without this one, all
    /// its timings are zero.
    #[must_use]
    pub fn with_clock(seconds: fn() -> f64) -> Self {
        Self { clock: Some(seconds), ..Self::default() }
    }

    /// What the clock says; zero without one.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.clock.map_or(0.0, |seconds| seconds())
    }

    /// Asks the work to stop; it does so at its next check.
    pub fn cancel(&self) {
        self.canceled.store(true, Ordering::Relaxed);
    }

    /// To be called at least every few milliseconds of work.
    ///
    /// # Errors
    /// When the work has been canceled.
    pub fn check(&self) -> Result<(), Canceled> {
        if self.canceled.load(Ordering::Relaxed) { Err(Canceled) } else { Ok(()) }
    }

    /// Begins a phase of `total` units.
    pub fn enter(&self, phase: Phase, total: u64) {
        self.done.store(0, Ordering::Relaxed);
        self.total.store(total, Ordering::Relaxed);
        self.phase.store(phase as u8, Ordering::Relaxed);
    }

    /// Counts units as done.
    pub fn advance(&self, units: u64) {
        self.done.fetch_add(units, Ordering::Relaxed);
    }

    /// Says again what whoever does the work elsewhere said of it. A phase that has no such name here is left out.
    pub fn repeat(&self, phase: &str, done: u64, total: u64) {
        if let Some(phase) = Phase::from_name(phase) {
            self.enter(phase, total);
            self.advance(done);
        }
    }

    /// How far the work is.
    #[must_use]
    pub fn progress(&self) -> Progress {
        let phase = Phase::ALL[usize::from(self.phase.load(Ordering::Relaxed)).min(Phase::ALL.len() - 1)];
        let total = self.total.load(Ordering::Relaxed);
        // Frames that are worked on beside those that were asked for, as around a clip that is repeated, are counted too.
        let done = self.done.load(Ordering::Relaxed);
        Progress { phase, done: if total > 0 { done.min(total) } else { done }, total }
    }
}
