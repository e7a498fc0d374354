//! How an engine process stands to others when the processor is short: long work gives way to what is shorter, so that who keeps all workers
//! busy for long does not also slow down those who need a moment.

/// The priority of a process, and of all its threads.
#[derive(Debug)]
pub(super) struct Priority {
    #[cfg_attr(not(target_os = "linux"), expect(dead_code, reason = "threads can only be named on Linux"))]
    process: u32,
    is_low: bool,
}

impl Priority {
    /// That of a process that has just been started.
    pub(super) const fn of(process: u32) -> Self {
        Self { process, is_low: false }
    }

    /// Lowers it, once.
    pub(super) fn lower(&mut self) {
        if !self.is_low {
            self.is_low = true;
            // Where this is not allowed, others wait a little longer.
            self.set(low());
        }
    }

    /// Raises it again where it was lowered; false where the system does not let us, which it does for the mighty alone.
    pub(super) fn restore(&mut self) -> bool {
        if self.is_low {
            self.is_low = !self.set(own());
        }
        !self.is_low
    }

    #[cfg(target_os = "linux")]
    fn set(&self, nice: i32) -> bool {
        // On Linux, a priority belongs to a thread; new threads have that of the one that starts them.
        let Ok(threads) = std::fs::read_dir(format!("/proc/{}/task", self.process)) else { return false };
        let thread =
            |entry: std::fs::DirEntry| rustix::process::Pid::from_raw(entry.file_name().to_str()?.parse().ok()?);
        let mut threads = threads.filter_map(Result::ok).filter_map(thread);
        threads.all(|thread| rustix::process::setpriority_process(Some(thread), nice).is_ok())
    }

    #[cfg(not(target_os = "linux"))]
    fn set(&self, _: i32) -> bool {
        false
    }
}

/// The nice value of long work: it has about a tenth of what others have that want the processor as well, and all that they leave.
fn low() -> i32 {
    const STEP: i32 = 10;
    const LOWEST: i32 = 19;
    (own() + STEP).min(LOWEST)
}

/// The nice value of this process, which its children begin with.
fn own() -> i32 {
    #[cfg(unix)]
    return rustix::process::getpriority_process(None).unwrap_or(0);
    #[cfg(not(unix))]
    0
}

/// Lowers the priority of the thread that asks, by so many steps of nice; for good. Where this is not allowed, others wait a little longer.
#[cfg(target_os = "linux")]
pub fn give_way_by(steps: i32) {
    // On Linux, of this thread alone.
    let _ = rustix::process::setpriority_process(None, own() + steps);
}

/// Does nothing: threads have no priority of their own that could be lowered.
#[cfg(not(target_os = "linux"))]
pub const fn give_way_by(_: i32) {}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::process::{Command, Stdio};

    use super::*;

    #[test]
    fn all_threads_of_a_process_give_way() {
        let mut child = Command::new("cat").stdin(Stdio::piped()).spawn().expect("a process that waits");
        let of_child = || {
            let id = rustix::process::Pid::from_raw(child.id() as i32);
            rustix::process::getpriority_process(id).expect("it lives")
        };
        let mut priority = Priority::of(child.id());
        assert!(priority.restore(), "it was not lowered");
        priority.lower();
        assert_eq!(of_child(), low(), "lowered");
        let is_restored = priority.restore();
        assert_eq!(of_child() == own(), is_restored, "raised where that is allowed, and said");
        child.kill().and_then(|()| child.wait()).expect("it ends");
    }
}
