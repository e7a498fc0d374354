//! Places at which a process can be made to die, to test that nothing is lost when it does.
//!
//! Only in builds with debug assertions: there, `RETARGETD_FAILPOINT=name` aborts the process when it comes to that place, and
//! `name:3` when it comes there for the third time. In release builds there is nothing of it.

macro_rules! failpoints {
    ($( $(#[doc = $help:literal])+ $variant:ident = $name:literal; )+) => {
        /// The places.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Failpoint { $( $(#[doc = $help])+ $variant, )+ }

        impl Failpoint {
            /// All of them.
            pub const ALL: &'static [Self] = &[$( Self::$variant, )+];

            /// What it is called in the variable.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $( Self::$variant => $name, )+ }
            }
        }
    };
}

failpoints! {
    /// An uploaded file is complete, but has no name yet.
    UploadComplete = "upload_complete";
    /// An uploaded file is visible, but no record names it.
    UploadKept = "upload_kept";
    /// A job is asked for, but not written down.
    BeforeJobRecord = "before_job_record";
    /// A job is written down, but not acknowledged.
    AfterJobRecord = "after_job_record";
    /// A worker has taken a job, and has not begun.
    JobClaimed = "job_claimed";
    /// The engine is at work.
    EngineRuns = "engine_runs";
    /// The results are complete, but have no names yet.
    ResultsComplete = "results_complete";
    /// The results are visible, but no record names them.
    ResultsKept = "results_kept";
    /// The end of the job is written down, and nobody has been told.
    JobEnded = "job_ended";
}

impl Failpoint {
    /// Dies here when the variable says so.
    pub fn reach(self) {
        #[cfg(debug_assertions)]
        armed::reach(self);
    }
}

/// Behaves as a decoder that has gone wild, when `RETARGETD_FAILPOINT` is `engine` and the word says how: it has `abort`, `overflow`,
/// `eat`, `hoard` or `spin` in it. Nothing of it is in release builds.
pub fn trigger_named(word: &str) {
    #[cfg(debug_assertions)]
    armed::trigger_named(word);
    #[cfg(not(debug_assertions))]
    let _ = word;
}

#[cfg(debug_assertions)]
mod armed {
    use std::sync::{
        LazyLock,
        atomic::{AtomicU64, Ordering},
    };

    use super::Failpoint;

    /// The name, and how often the place is still passed.
    static ARMED: LazyLock<Option<(String, AtomicU64)>> = LazyLock::new(|| {
        #[expect(clippy::disallowed_methods, reason = "no setting: release builds do not have it")]
        let text = std::env::var("RETARGETD_FAILPOINT").ok()?;
        let (name, count) = text.split_once(':').unwrap_or((&text, "1"));
        Some((name.to_owned(), AtomicU64::new(count.parse().unwrap_or(1))))
    });

    pub(super) fn trigger_named(word: &str) {
        if ARMED.as_ref().is_none_or(|(name, _)| name != "engine") {
            return;
        }
        if word.contains("abort") {
            std::process::abort();
        } else if word.contains("overflow") {
            std::hint::black_box(deeper(0));
        } else if word.contains("eat") {
            let mut eaten = Vec::new();
            loop {
                eaten.push(std::hint::black_box(vec![0_u8; 64 << 20]));
            }
        } else if word.contains("hoard") {
            let mut hoarded = Vec::new();
            loop {
                hoarded.push(std::hint::black_box(vec![1_u8; 8 << 20]));
                std::thread::sleep(std::time::Duration::from_millis(10));
            }
        } else if word.contains("spin") {
            loop {
                std::hint::spin_loop();
            }
        }
    }

    #[expect(unconditional_recursion, reason = "until the stack is full")]
    fn deeper(depth: u64) -> u64 {
        let frame = std::hint::black_box([depth; 64]);
        deeper(frame[0] + 1) + frame[63]
    }

    pub(super) fn reach(failpoint: Failpoint) {
        let Some((name, left)) = &*ARMED else { return };
        if name == failpoint.name() && left.fetch_sub(1, Ordering::SeqCst) == 1 {
            std::process::abort();
        }
    }
}
