//! Handing the file of a job to the caller who waits for it while the disk still takes it down.
//!
//! The job itself is on the disk by then, and the same job gives the same bytes, so what a power cut takes is made again. Whoever asks
//! this process about the job meanwhile is answered when its end is written.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use bytes::Bytes;
use tokio::sync::{oneshot, watch};

use crate::{
    engine::Timings,
    store::{JobId, JobRecord, ResultRecord},
};

/// The first file of a job that succeeded.
#[derive(Debug)]
pub struct HandedFile {
    /// The job as it will stand in the store.
    pub record: JobRecord,
    /// The file's record, likewise.
    pub result: ResultRecord,
    /// All its bytes.
    pub bytes: Bytes,
    /// How long each phase took.
    pub timings: Timings,
}

/// How long the end of a job whose file is handed over is waited for: it takes milliseconds, where the store answers.
const MAX_UNSETTLED: Duration = Duration::from_secs(2);

/// Jobs whose file somebody waits for, and jobs whose end is not written yet although somebody has it.
#[derive(Debug, Default)]
pub(in crate::jobs) struct Handovers(Mutex<BTreeMap<JobId, Handover>>);

#[derive(Debug)]
enum Handover {
    Wanted(oneshot::Sender<HandedFile>),
    /// Closes when the end is written.
    Given(watch::Receiver<()>),
}

/// Somebody who waits for a job's file.
#[derive(Debug)]
pub(super) struct Wanting {
    pub(super) file: oneshot::Receiver<HandedFile>,
    handovers: Arc<Handovers>,
    id: JobId,
}

impl Drop for Wanting {
    fn drop(&mut self) {
        self.file.close();
        let mut entries = self.handovers.lock();
        // Another one may want it by now, or it was given.
        if matches!(entries.get(&self.id), Some(Handover::Wanted(give)) if give.is_closed()) {
            entries.remove(&self.id);
        }
    }
}

/// A file that was given: to be dropped when the end of its job is written.
#[derive(Debug)]
pub(in crate::jobs) struct Given {
    _unsettled: watch::Sender<()>,
    handovers: Arc<Handovers>,
    id: JobId,
}

impl Drop for Given {
    fn drop(&mut self) {
        self.handovers.lock().remove(&self.id);
    }
}

impl Handovers {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<JobId, Handover>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Hears of the job's file from now on. The last who asks is given it; `None` where it is given already.
    pub(super) fn want(self: &Arc<Self>, id: &JobId) -> Option<Wanting> {
        let (give, file) = oneshot::channel();
        let mut entries = self.lock();
        if matches!(entries.get(id), Some(Handover::Given(_))) {
            return None;
        }
        entries.insert(id.clone(), Handover::Wanted(give));
        drop(entries);
        Some(Wanting { file, handovers: Arc::clone(self), id: id.clone() })
    }

    /// Gives a job's file to who waits for it; `None` where nobody does.
    pub(super) fn give(self: &Arc<Self>, file: HandedFile) -> Option<Given> {
        let id = file.record.id.clone();
        let mut entries = self.lock();
        let Some(Handover::Wanted(give)) = entries.remove(&id) else { return None };
        give.send(file).ok()?;
        let (unsettled, settled) = watch::channel(());
        entries.insert(id.clone(), Handover::Given(settled));
        drop(entries);
        Some(Given { _unsettled: unsettled, handovers: Arc::clone(self), id })
    }

    /// Waits until the end of a job is written whose file was given.
    pub(in crate::jobs) async fn settled(&self, id: &JobId) {
        let mut given = match self.lock().get(id) {
            Some(Handover::Given(settled)) => settled.clone(),
            _ => return,
        };
        // It closes without ever saying anything.
        let _ = tokio::time::timeout(MAX_UNSETTLED, given.changed()).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waiting() -> (Arc<Handovers>, JobId) {
        (Arc::default(), JobId::new())
    }

    #[test]
    fn who_goes_away_leaves_nothing() {
        let (handovers, id) = waiting();
        drop(handovers.want(&id));
        assert!(handovers.lock().is_empty(), "nobody waits");
    }

    #[test]
    fn the_last_who_asks_stays_when_the_first_goes() {
        let (handovers, id) = waiting();
        let (first, last) = (handovers.want(&id), handovers.want(&id));
        drop(first);
        assert!(matches!(handovers.lock().get(&id), Some(Handover::Wanted(_))), "one still waits");
        drop(last);
        assert!(handovers.lock().is_empty(), "nobody waits");
    }

    #[tokio::test]
    async fn what_was_given_is_settled_when_the_end_is_written() {
        let (handovers, id) = waiting();
        let (unsettled, settled) = watch::channel(());
        handovers.lock().insert(id.clone(), Handover::Given(settled));
        let given = Given { _unsettled: unsettled, handovers: Arc::clone(&handovers), id: id.clone() };
        assert!(handovers.want(&id).is_none(), "there is nothing to wait for but the end");
        let looking = tokio::spawn({
            let (handovers, id) = (Arc::clone(&handovers), id.clone());
            async move { handovers.settled(&id).await }
        });
        tokio::task::yield_now().await;
        assert!(!looking.is_finished(), "the end is not written");
        drop(given);
        looking.await.expect("it ends");
        assert!(handovers.lock().is_empty(), "and nothing is left");
    }
}
