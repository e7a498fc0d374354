//! The tasks that run beside the requests, and how they end.

use std::time::Duration;

use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;

use super::{Jobs, running::StopReason};
use crate::telemetry::Metric;

/// The workers: each runs one job at a time.
#[derive(Debug)]
pub struct Workers {
    jobs: Jobs,
    tasks: JoinSet<()>,
    stop: CancellationToken,
}

impl Workers {
    /// Starts `count` of them.
    #[must_use]
    pub fn start(jobs: &Jobs, count: usize) -> Self {
        let stop = CancellationToken::new();
        let mut tasks = JoinSet::new();
        for _ in 0..count {
            let (jobs, stop) = (jobs.clone(), stop.clone());
            tasks.spawn(async move {
                while !stop.is_cancelled() {
                    // Waiting for a job can be cut off; running one cannot.
                    let ready = tokio::select! {
                        biased;
                        () = stop.cancelled() => return,
                        id = jobs.0.queue.pop() => id,
                    };
                    jobs.run_one(ready).await;
                }
            });
        }
        Metric::WorkerSlots.set([], count as f64);
        Self { jobs: jobs.clone(), tasks, stop }
    }

    /// Starts nothing new, gives running jobs `grace` to end, and hands the rest back to the queue.
    pub async fn stop(mut self, grace: Duration) {
        self.stop.cancel();
        let ended = async { while self.tasks.join_next().await.is_some() {} };
        if tokio::time::timeout(grace, ended).await.is_err() {
            self.jobs.0.running.stop_all(StopReason::Draining);
            /// A job looks every few milliseconds; one that does not is found `running` by the next start.
            const LAST_CHANCE: Duration = Duration::from_secs(5);
            let ended = async { while self.tasks.join_next().await.is_some() {} };
            let _ = tokio::time::timeout(LAST_CHANCE, ended).await;
        }
        self.tasks.abort_all();
    }
}

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
            loop {
                jobs.sweep().await;
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
        if let Ok(bytes) = self.0.store.records().stored_bytes().await {
            Metric::StoredBytes.set([], bytes as f64);
        }
    }
}
