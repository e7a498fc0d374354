//! How much memory a job is thought to need, and the budget that running jobs draw from.

use std::sync::Arc;

use serde_json::Value;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// What every job needs, whatever its files: its stack, the report, the allocator's slack.
const BASE_BYTES: u64 = 32 << 20;
/// Bytes of one joint at one frame: a translation, a rotation and a scale.
const SAMPLE_BYTES: u64 = 40;
/// Source as read, source as sampled, target as retargeted and edited, target as written.
const COPIES: u64 = 4;
/// Decoded bytes per byte of a file of which nothing else is known: text takes more than numbers, and packed numbers less.
const BYTES_PER_FILE_BYTE: u64 = 8;

/// The rate and the length of a clip of which nothing is known.
const USUAL_FPS: f64 = 30.0;
const USUAL_SECONDS: f64 = 10.0;
/// What one more format takes, of what the files take.
const SHARE_OF_FORMAT: f64 = 0.5;

/// What a file needs, of which nothing but its size is known.
pub(super) fn of_unknown_file(bytes: u64) -> u64 {
    bytes.saturating_mul(BYTES_PER_FILE_BYTE)
}

/// What a file needs, by what `inspect` says of it: joints times frames, and the file itself for its meshes and images.
pub(super) fn of_inspected_file(bytes: u64, inspection: &Value) -> Option<u64> {
    let nodes = inspection.pointer("/counts/nodes")?.as_u64()?;
    let frames =
        inspection.get("clips")?.as_array()?.iter().filter_map(|clip| clip.get("frames")?.as_u64()).sum::<u64>();
    let samples = nodes.saturating_mul(frames.max(1));
    Some(samples.saturating_mul(SAMPLE_BYTES * COPIES).saturating_add(bytes.saturating_mul(2)))
}

/// What a job on files of these needs needs, that makes so much more of them.
pub(super) fn of_job(files: impl Iterator<Item = u64>, growth: f64) -> u64 {
    let files = files.fold(0, u64::saturating_add);
    // Saturates.
    BASE_BYTES.saturating_add((files as f64 * growth.max(1.0)) as u64)
}

/// How many times larger than its files a job is by its config: a higher rate, a slower clip, repetitions and holds make more frames. What
/// the config does not say in numbers counts as one.
pub(super) fn growth_of_config(config: &Value) -> f64 {
    let number = |pointer: &str| config.pointer(pointer)?.as_f64().filter(|number| number.is_finite() && *number > 0.0);
    let rate = number("/edit/fps").map_or(1.0, |fps| (fps / USUAL_FPS).max(1.0));
    let slowness = number("/edit/speed").map_or(1.0, |speed| (1.0 / speed).max(1.0));
    let repeats = number("/edit/loop/times").unwrap_or(1.0).max(1.0);
    let held = ["before", "after"].map(|side| number(&format!("/edit/hold/{side}_seconds")).unwrap_or(0.0));
    let turns = if config.pointer("/edit/ping_pong").and_then(Value::as_bool) == Some(true) { 2.0 } else { 1.0 };
    (slowness * repeats * turns + held.iter().sum::<f64>() / USUAL_SECONDS) * rate
}

/// What the formats add to that: each beyond the first is written besides.
pub(super) fn growth_of_formats(formats: usize) -> f64 {
    formats.saturating_sub(1) as f64 * SHARE_OF_FORMAT
}

/// The memory that running jobs may be thought to need together, counted in mebibytes.
#[derive(Clone, Debug)]
pub(super) struct MemoryBudget {
    permits: Arc<Semaphore>,
    total: u32,
}

impl MemoryBudget {
    pub(super) fn new(bytes: u64) -> Self {
        let total = mebibytes(bytes).max(1);
        Self { permits: Arc::new(Semaphore::new(total as usize)), total }
    }

    /// Waits until there is that much, first come, first served; what is more than there can ever be is given everything.
    /// `None` is never given: the budget is not closed.
    pub(super) async fn take(self, bytes: u64) -> Option<OwnedSemaphorePermit> {
        self.permits.acquire_many_owned(mebibytes(bytes).min(self.total)).await.ok()
    }

    /// That much, where it is there now and nobody waits for any.
    pub(super) fn try_take(self, bytes: u64) -> Option<OwnedSemaphorePermit> {
        self.permits.try_acquire_many_owned(mebibytes(bytes).min(self.total)).ok()
    }
}

fn mebibytes(bytes: u64) -> u32 {
    u32::try_from(bytes >> 20).unwrap_or(u32::MAX >> 4).min(u32::MAX >> 4)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facts_count_joints_times_frames_and_guesses_the_size() {
        let facts = serde_json::json!({"counts": {"nodes": 60}, "clips": [{"frames": 300}, {"frames": 100}]});
        assert_eq!(of_inspected_file(1000, &facts), Some(60 * 400 * 40 * 4 + 2000), "known");
        assert_eq!(of_inspected_file(1000, &serde_json::json!({"format": "bvh"})), None, "not known");
        assert_eq!(of_job([of_unknown_file(1 << 20)].into_iter(), 1.0), (32 << 20) + (8 << 20), "guessed");
    }

    #[test]
    fn a_config_that_makes_more_frames_needs_more_memory() {
        let growth = |config: Value| growth_of_config(&config);
        assert_eq!(growth(serde_json::json!({})), 1.0, "nothing is made larger");
        assert!(growth(serde_json::json!({"edit": {"fps": 1000, "speed": 0.02}})) > 1000.0, "many more frames");
        assert!(growth(serde_json::json!({"edit": {"hold": {"after_seconds": 1e5}}})) > 1000.0, "a long hold");
        assert!(growth_of_formats(3) > growth_of_formats(1), "more formats");
        assert_eq!(growth(serde_json::json!({"edit": {"fps": 5, "speed": 10}})), 1.0, "less is not counted on");
    }

    #[tokio::test]
    async fn jobs_wait_for_memory_and_what_is_too_large_runs_alone() {
        let budget = MemoryBudget::new(100 << 20);
        let large = budget.clone().take(1 << 40).await;
        assert!(budget.clone().try_take(1 << 20).is_none(), "nothing is left");
        assert_eq!(budget.permits.available_permits(), 0, "it has everything");
        drop(large);
        let _half = budget.clone().take(60 << 20).await;
        assert_eq!(budget.permits.available_permits(), 40, "the rest is for others");
    }
}
