//! Results that are there already, found by what they were computed from.

use jiff::Timestamp;
use sqlx::Row;

use super::{Judgment, Records, ResultRecord, count, read_id, verdict};
use crate::store::{JobId, Principal, StoreError};

/// What a job gave that computed the same.
#[derive(Clone, Debug, PartialEq)]
pub struct CachedResults {
    /// That job.
    pub job: JobId,
    /// Its report, as JSON.
    pub report: Option<String>,
    /// Its resolved spec, as JSON.
    pub resolved_spec: Option<String>,
    /// How many warnings its report has.
    pub warnings: u64,
    /// What its report says of its result as a whole.
    pub judgment: Option<Judgment>,
    /// Its results; at least one.
    pub results: Vec<ResultRecord>,
}

impl Records {
    /// What the newest job of that owner gave that succeeded with the same key, as long as none of it has expired.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn cached_results(
        &self,
        owner: &Principal,
        key: &str,
        now: Timestamp,
    ) -> Result<Option<CachedResults>, StoreError> {
        // SQLite would rather go through all jobs of the owner that succeeded, which an index has in the right order, than find the key and
        // sort: the state is an expression so that no index begins with it.
        let query = "SELECT id, report, resolved_spec, warnings, verdict, verdict_reason, coverage FROM jobs \
                     WHERE principal = $1 AND cache_key = $2 AND state || '' = 'succeeded' ORDER BY id DESC LIMIT 1";
        let Some(row) = self.optional(sqlx::query(query).bind(owner.as_str()).bind(key)).await? else {
            return Ok(None);
        };
        let job = read_id(&row, "id", JobId::parse)?;
        let results = self.job_results(&job).await?;
        if results.is_empty() || results.iter().any(|result| result.expires_at <= now) {
            return Ok(None);
        }
        let (report, resolved_spec) = (row.try_get("report")?, row.try_get("resolved_spec")?);
        let (warnings, judgment) = (count(&row, "warnings")?, verdict::read(&row)?);
        Ok(Some(CachedResults { job, report, resolved_spec, warnings, judgment, results }))
    }
}
