//! What one principal has and may have.

use super::{JobQuota, Jobs, Refusal};
use crate::store::{Holdings, Principal};

/// What a principal has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Usage {
    /// Jobs and files.
    pub holdings: Holdings,
    /// Event streams that are open at this process.
    pub event_streams: u64,
    /// What is left of the quota; nothing where there is none.
    pub quota: Option<JobQuota>,
}

impl Jobs {
    /// What a principal has.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn usage(&self, owner: &Principal) -> Result<Usage, Refusal> {
        let holdings = self.0.store.records().holdings(owner).await?;
        let unfinished = holdings.jobs.iter().filter(|(state, _)| !state.is_final()).map(|(_, count)| count).sum();
        let quota = self.most_jobs().map(|most| JobQuota { most, unfinished });
        Ok(Usage { holdings, event_streams: self.0.streams.count(owner), quota })
    }

    /// What is left of a principal's quota; nothing where there is none.
    pub(super) async fn quota(&self, owner: &Principal) -> Result<Option<JobQuota>, Refusal> {
        let Some(most) = self.most_jobs() else { return Ok(None) };
        let unfinished = self.0.store.records().unfinished_jobs(owner).await?;
        Ok(Some(JobQuota { most, unfinished }))
    }

    fn most_jobs(&self) -> Option<u64> {
        Some(self.0.settings.max_principal_jobs).filter(|most| *most > 0)
    }
}
