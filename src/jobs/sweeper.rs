//! Removing what has expired, from time to time.

use std::time::Duration;

use jiff::Timestamp;
use tokio::time::Instant;

use super::Jobs;
use crate::{config::Period, store::PoolUse, telemetry::Metric};

/// How often to look for what crashes left.
const LOOK_FOR_LEFTOVERS: Duration = Duration::from_secs(3600);

/// Removes what has expired, from time to time.
#[derive(Debug)]
pub struct Sweeper {
    task: tokio::task::JoinHandle<()>,
}

impl Sweeper {
    /// Starts it.
    #[must_use]
    pub fn start(jobs: &Jobs) -> Self {
        let jobs = jobs.clone();
        let task = tokio::spawn(async move {
            let mut looked = None;
            loop {
                jobs.sweep().await;
                jobs.0.engine.tidy();
                if looked.is_none_or(|at: Instant| at.elapsed() > LOOK_FOR_LEFTOVERS) {
                    looked = Some(Instant::now());
                    jobs.remove_leftovers().await;
                }
                tokio::time::sleep(jobs.0.settings.sweep_interval.0).await;
            }
        });
        Self { task }
    }

    /// Ends it.
    pub async fn stop(self) {
        self.task.abort();
        let _ = self.task.await;
    }
}

impl Jobs {
    /// Removes what has expired by now. A failure is logged and tried again the next time.
    pub async fn sweep(&self) {
        match self.0.store.sweep(self.0.clock.now()).await {
            Ok(0) => {}
            Ok(count) => tracing::info!(count, "expired records were removed"),
            Err(error) => tracing::error!(%error, "expired records could not be removed"),
        }
        let before = |period: Period| self.0.clock.now().checked_sub(period.0).unwrap_or(Timestamp::MIN);
        let (records, settings) = (self.0.store.records(), &self.0.settings);
        if let Err(error) = records.remove_deliveries_until(before(settings.delivery_retention)).await {
            tracing::error!(%error, "old deliveries to webhooks could not be removed");
        }
        if let Err(error) = records.remove_events_until(before(settings.event_retention)).await {
            tracing::error!(%error, "old events could not be removed");
        }
        if let Err(error) = self.0.store.blobs().check_room() {
            tracing::warn!(%error, "the reserve of the disk is reached: no files are taken until there is room");
        }
        if let Ok(bytes) = self.0.stored_bytes.count(self.0.store.records()).await {
            Metric::StoredBytes.set([], bytes as f64);
        }
    }

    /// Measures the queue for those who watch, when they look: what a gauge said before would be old by then. What cannot be measured keeps
    /// its last value.
    pub async fn observe_queue(&self) {
        if let Some(bytes) = self.0.store.blobs().free_bytes() {
            Metric::FreeDisk.set([], bytes as f64);
        }
        for PoolUse { pool, in_use, idle } in self.0.store.records().connections() {
            for (state, count) in [("in_use", in_use), ("idle", idle)] {
                let labels = [("pool", pool.to_owned()), ("state", state.to_owned())];
                Metric::DatabaseConnections.set(labels, count as f64);
            }
        }
        if let Err(error) = self.0.admission.observe(self.0.store.records(), self.0.clock.now()).await {
            tracing::error!(%error, "the queue could not be counted");
        }
    }

    async fn remove_leftovers(&self) {
        if let Err(error) = self.0.store.remove_leftovers(self.0.clock.now()).await {
            tracing::error!(%error, "what crashes left could not be removed");
        }
    }
}
