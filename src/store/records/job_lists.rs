//! Lists of jobs by what they are, and how many there are.

use std::collections::BTreeMap;

use jiff::Timestamp;
use sqlx::{Any, Row, Transaction};

use super::{
    JobKind, JobRecord, JobState, JobVerdict, Page, Records, count,
    database::{CHUNK, ours, rows_of},
    jobs::{COLUMNS, read},
    signed, without_nul,
};
use crate::store::{JobId, Principal, StoreError};

/// Which jobs a list shall have; what says nothing lets all through.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct JobFilter {
    /// In this state.
    pub state: Option<JobState>,
    /// Of this kind.
    pub kind: Option<JobKind>,
    /// With this verdict.
    pub verdict: Option<JobVerdict>,
    /// With a label of this name and text.
    pub label: Option<(String, String)>,
    /// Asked for then or later.
    pub since: Option<Timestamp>,
}

/// What one owner has.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Holdings {
    /// Jobs that are kept, by their state; states without jobs are not there.
    pub jobs: BTreeMap<JobState, u64>,
    /// Uploaded files.
    pub assets: u64,
    /// Their bytes.
    pub asset_bytes: u64,
    /// Files that jobs gave.
    pub results: u64,
    /// Their bytes.
    pub result_bytes: u64,
}

impl Records {
    /// Up to `most` jobs of one owner that pass the filter, newest first, that are older than `before`.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn jobs(
        &self,
        owner: &Principal,
        filter: &JobFilter,
        before: Option<&JobId>,
        most: usize,
    ) -> Result<Page<JobRecord>, StoreError> {
        let query = ours(format!(
            "SELECT {COLUMNS} FROM jobs WHERE principal = $4 AND ($1 IS NULL OR id < $1) \
             AND ($2 IS NULL OR state = $2) AND ($5 IS NULL OR kind = $5) AND ($6 IS NULL OR created_at >= $6) \
             AND ($7 IS NULL OR EXISTS (SELECT 1 FROM job_labels WHERE job_id = jobs.id AND name = $7 AND value = $8)) \
             AND ($9 IS NULL OR verdict = $9) \
             ORDER BY id DESC LIMIT $3"
        ));
        let (name, value) = filter.label.as_ref().map(|(name, value)| (without_nul(name), without_nul(value))).unzip();
        let query = sqlx::query(query)
            .bind(before.map(JobId::as_str))
            .bind(filter.state.map(JobState::name))
            .bind(signed(most as u64 + 1))
            .bind(owner.as_str())
            .bind(filter.kind.map(JobKind::name))
            .bind(filter.since.map(Timestamp::as_millisecond))
            .bind(name)
            .bind(value)
            .bind(filter.verdict.map(JobVerdict::name));
        Ok(Page::cut(self.listed(query).await?.iter().map(read).collect::<Result<_, _>>()?, most))
    }

    /// How many jobs of one owner have not ended.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn unfinished_jobs(&self, owner: &Principal) -> Result<u64, StoreError> {
        let query = "SELECT CAST(COUNT(*) AS BIGINT) AS jobs FROM jobs WHERE principal = $1 \
                     AND state IN ('queued', 'running', 'canceling')";
        count(&self.one(sqlx::query(query).bind(owner.as_str())).await?, "jobs")
    }

    /// What one owner has.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn holdings(&self, owner: &Principal) -> Result<Holdings, StoreError> {
        let query = "SELECT state, CAST(COUNT(*) AS BIGINT) AS jobs FROM jobs WHERE principal = $1 GROUP BY state ORDER BY state";
        let mut holdings = Holdings::default();
        for row in self.all(sqlx::query(query).bind(owner.as_str())).await? {
            if let Some(state) = JobState::from_name(row.try_get("state")?) {
                holdings.jobs.insert(state, count(&row, "jobs")?);
            }
        }
        let assets = "SELECT CAST(COUNT(*) AS BIGINT) AS files, CAST(COALESCE(SUM(bytes), 0) AS BIGINT) AS bytes \
                      FROM assets WHERE principal = $1";
        let row = self.one(sqlx::query(assets).bind(owner.as_str())).await?;
        (holdings.assets, holdings.asset_bytes) = (count(&row, "files")?, count(&row, "bytes")?);
        let results = "SELECT CAST(COUNT(*) AS BIGINT) AS files, CAST(COALESCE(SUM(bytes), 0) AS BIGINT) AS bytes \
                       FROM results JOIN jobs ON jobs.id = job_id WHERE principal = $1";
        let row = self.one(sqlx::query(results).bind(owner.as_str())).await?;
        (holdings.results, holdings.result_bytes) = (count(&row, "files")?, count(&row, "bytes")?);
        Ok(holdings)
    }
}

/// Writes what jobs are listed by; part of the transaction that adds them.
pub(super) async fn insert_labels(
    transaction: &mut Transaction<'static, Any>,
    jobs: &[JobRecord],
) -> Result<(), StoreError> {
    let labels = |job: &JobRecord| {
        let id = job.id.to_string();
        let labels = job.request.labels.iter();
        labels.map(move |(name, value)| (id.clone(), without_nul(name), without_nul(value))).collect::<Vec<_>>()
    };
    let labels: Vec<_> = jobs.iter().flat_map(labels).collect();
    for labels in labels.chunks(CHUNK) {
        // Two names that differ in a NUL alone are one here.
        let query = ours(format!(
            "INSERT INTO job_labels (job_id, name, value) VALUES {} ON CONFLICT (job_id, name) DO NOTHING",
            rows_of(labels.len(), 3)
        ));
        let query =
            labels.iter().fold(sqlx::query(query), |query, (job, name, value)| query.bind(job).bind(name).bind(value));
        query.execute(&mut **transaction).await?;
    }
    Ok(())
}
