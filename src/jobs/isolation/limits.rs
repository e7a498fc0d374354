//! What an engine process may use, set by itself at its start.

use std::{io, sync::LazyLock};

/// What an engine process may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// Memory beyond what the program takes up by itself. It is addresses that are bounded, with two gibibytes besides for what
    /// allocators reserve.
    pub memory_bytes: u64,
    /// How long one request may take. Beyond it the parent ends the process; processor time has the same bound on every core, for a
    /// process whose parent is gone.
    pub seconds: u64,
}

/// Addresses that allocators reserve without using them.
#[cfg(unix)]
const RESERVED_BYTES: u64 = 2 << 30;

/// Bounds this process from now on. Core files would hold what users sent, so there are none.
///
/// # Errors
/// When the system refuses.
#[cfg(unix)]
pub(super) fn at_start(bounds: &Bounds) -> io::Result<()> {
    use rustix::process::{Resource, Rlimit, setrlimit};
    setrlimit(Resource::Core, Rlimit { current: Some(0), maximum: Some(0) })?;
    let most = own_address_bytes().saturating_add(RESERVED_BYTES).saturating_add(bounds.memory_bytes);
    setrlimit(Resource::As, Rlimit { current: Some(most), maximum: Some(most) })?;
    // Where the machine runs out of memory all the same, this process goes before the service does. Not every system has this.
    let _ = std::fs::write("/proc/self/oom_score_adj", "500");
    Ok(())
}

/// Bounds the processor time of what comes next.
///
/// # Errors
/// When the system refuses.
#[cfg(unix)]
pub(super) fn for_one_request(bounds: &Bounds) -> io::Result<()> {
    use rustix::{
        process::{Resource, Rlimit, setrlimit},
        time::{ClockId, clock_gettime},
    };
    /// For the parent to be the one that ends it.
    const MARGIN_SECONDS: u64 = 10;
    let used = u64::try_from(clock_gettime(ClockId::ProcessCPUTime).tv_sec).unwrap_or(0);
    /// Asked for once, since the answer is in several files.
    static CORES: LazyLock<u64> =
        LazyLock::new(|| std::thread::available_parallelism().map_or(1, std::num::NonZero::get) as u64);
    let most = used.saturating_add(bounds.seconds.saturating_add(MARGIN_SECONDS).saturating_mul(*CORES));
    setrlimit(Resource::Cpu, Rlimit { current: Some(most), maximum: None })?;
    Ok(())
}

/// Addresses that this process has, where the system tells; the first number of `statm` is in pages.
#[cfg(unix)]
fn own_address_bytes() -> u64 {
    let pages = std::fs::read_to_string("/proc/self/statm").ok();
    let pages = pages.and_then(|text| text.split(' ').next()?.parse::<u64>().ok()).unwrap_or(0);
    pages.saturating_mul(rustix::param::page_size() as u64)
}

#[cfg(not(unix))]
pub(super) fn at_start(_: &Bounds) -> io::Result<()> {
    Ok(())
}

#[cfg(not(unix))]
pub(super) fn for_one_request(_: &Bounds) -> io::Result<()> {
    Ok(())
}
