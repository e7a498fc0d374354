//! Lists of jobs by what they are, and how many there are.

use std::collections::BTreeMap;

use jiff::Timestamp;
use sqlx::{Any, Row, Transaction};

use super::{
    JobKind, JobRecord, JobState, JobVerdict, Page, Records, count,
    database::{CHUNK, ours, rows_of},
    jobs::read,
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

/// How far clocks may be off, in milliseconds.
const CLOCKS_DIFFER: i64 = 24 * 3_600_000;

/// The text of a list: each condition stands in it only where it is asked for, so that the database can tell beforehand by which index it
/// finds few rows.
fn list_text(filter: &JobFilter, is_behind: bool) -> String {
    let (from, by) = match filter.label {
        // Those with the label are few; their index has them in the order of the list.
        Some(_) => {
            ("job_labels JOIN jobs ON jobs.id = job_id", "job_labels.principal = $1 AND name = $3 AND value = $4")
        }
        None => ("jobs", "principal = $1"),
    };
    let (id, mut place) = if filter.label.is_some() { ("job_id", 5) } else { ("id", 3) };
    let mut text = format!("SELECT {} FROM {from} WHERE {by}", super::jobs::columns_of("jobs"));
    if is_behind {
        text.push_str(&format!(" AND {id} < ${place}"));
        place += 1;
    }
    // Names of a closed list, never what a caller sent.
    if let Some(state) = filter.state {
        text.push_str(&format!(" AND state = '{}'", state.name()));
    }
    if let Some(kind) = filter.kind {
        text.push_str(&format!(" AND kind = '{}'", kind.name()));
    }
    if let Some(verdict) = filter.verdict {
        text.push_str(&format!(" AND verdict = '{}'", verdict.name()));
    }
    if filter.since.is_some() {
        text.push_str(&format!(" AND created_at >= ${place} AND {id} >= ${}", place + 1));
    }
    text.push_str(&format!(" ORDER BY {id} DESC LIMIT $2"));
    text
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
        let label = filter.label.as_ref().map(|(name, value)| (without_nul(name), without_nul(value)));
        let query = ours(list_text(filter, before.is_some()));
        let query = sqlx::query(query).bind(owner.as_str()).bind(signed(most as u64 + 1));
        let query = match &label {
            Some((name, value)) => query.bind(name).bind(value),
            None => query,
        };
        let query = before.map(JobId::as_str).into_iter().fold(query, |query, id| query.bind(id));
        let query = match filter.since.map(Timestamp::as_millisecond) {
            // Ids are in the order of their making, by a clock that may be somewhat off: what is older needs no look.
            Some(since) => query.bind(since).bind(JobId::earliest(since - CLOCKS_DIFFER).to_string()),
            None => query,
        };
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
    let of = |job: &'_ JobRecord| -> Vec<[String; 4]> {
        let texts = |(name, value): (&String, &String)| {
            [job.id.to_string(), job.principal.to_string(), without_nul(name), without_nul(value)]
        };
        job.request.labels.iter().map(texts).collect()
    };
    let labels: Vec<_> = jobs.iter().flat_map(of).collect();
    for labels in labels.chunks(CHUNK) {
        // Two names that differ in a NUL alone are one here.
        let query = ours(format!(
            "INSERT INTO job_labels (job_id, principal, name, value) VALUES {} ON CONFLICT (job_id, name) DO NOTHING",
            rows_of(labels.len(), 4)
        ));
        let query = labels.iter().flatten().fold(sqlx::query(query), |query, text| query.bind(text));
        query.execute(&mut **transaction).await?;
    }
    Ok(())
}
