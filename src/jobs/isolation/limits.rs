//! What an engine process may use, set by itself at its start.

use std::{io, sync::LazyLock};

/// What an engine process may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// Memory that it may use. The parent looks at what it has in use and ends it beyond that; in case nobody looks in time, its addresses
    /// are bounded besides, with two gibibytes more for what allocators reserve.
    pub memory_bytes: u64,
    /// Bytes of all files that one answer may give.
    pub output_bytes: u64,
    /// How long one request may take. Beyond it the parent ends the process; processor time has the same bound on every core, for a
    /// process whose parent is gone.
    pub seconds: u64,
}

/// Asked for once, at the start: the answer is in several files, which are out of reach later.
#[cfg(unix)]
static CORES: LazyLock<u64> =
    LazyLock::new(|| std::thread::available_parallelism().map_or(1, std::num::NonZero::get) as u64);
/// Addresses that allocators reserve without using them.
#[cfg(unix)]
const RESERVED_BYTES: u64 = 2 << 30;

/// Has the system give this process memory in small pages. A program that draws has many buffers, each of which would touch a page of two
/// megabytes more than it needs: that is half of the memory of a preview, and drawing takes as long without.
pub fn use_small_pages() {
    // Where that cannot be had, it takes more memory.
    #[cfg(target_os = "linux")]
    let _ = rustix::thread::disable_transparent_huge_pages(true);
}

/// Bounds this process from now on. Core files would hold what users sent, so there are none.
///
/// # Errors
/// When the system refuses.
#[cfg(unix)]
pub(super) fn at_start(bounds: &Bounds) -> io::Result<()> {
    use rustix::process::Resource;
    lower(Resource::Core, 0, Some(0))?;
    let most = own_address_bytes().saturating_add(RESERVED_BYTES).saturating_add(bounds.memory_bytes);
    lower(Resource::As, most, Some(most))?;
    // Where the machine runs out of memory all the same, this process goes before the service does. Not every system has this.
    let _ = std::fs::write("/proc/self/oom_score_adj", "500");
    LazyLock::force(&CORES);
    Ok(())
}

/// Bounds the processor time of what comes next.
///
/// # Errors
/// When the system refuses.
#[cfg(unix)]
pub(super) fn for_one_request(bounds: &Bounds) -> io::Result<()> {
    use rustix::{
        process::Resource,
        time::{ClockId, clock_gettime},
    };
    /// For the parent to be the one that ends it.
    const MARGIN_SECONDS: u64 = 10;
    let used = u64::try_from(clock_gettime(ClockId::ProcessCPUTime).tv_sec).unwrap_or(0);
    let most = used.saturating_add(bounds.seconds.saturating_add(MARGIN_SECONDS).saturating_mul(*CORES));
    lower(Resource::Cpu, most, None)
}

/// Sets a bound, or leaves the one that an operator has set where that is lower: nobody may raise that.
///
/// # Errors
/// When the system refuses.
#[cfg(unix)]
fn lower(resource: rustix::process::Resource, most: u64, maximum: Option<u64>) -> io::Result<()> {
    use rustix::process::{Rlimit, getrlimit, setrlimit};
    let hard = getrlimit(resource).maximum;
    let lowest = |wanted: Option<u64>| wanted.into_iter().chain(hard).min();
    setrlimit(resource, Rlimit { current: lowest(Some(most)), maximum: lowest(maximum) })?;
    Ok(())
}

/// Nobody else, an engine process neither, looks into the memory of this process or at its environment, which may have passwords in it.
#[cfg(target_os = "linux")]
pub fn keep_memory_private() {
    use rustix::process::{DumpableBehavior, set_dumpable_behavior};
    // Where the system refuses, all is as it was.
    let _ = set_dumpable_behavior(DumpableBehavior::NotDumpable);
}

/// Nobody else looks into the memory of this process; here, that is the system's business.
#[cfg(not(target_os = "linux"))]
pub fn keep_memory_private() {}

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
