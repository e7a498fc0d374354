//! Records of what happened to jobs, in the order in which it became visible.
//!
//! The triggers of the layout write them, each in the transaction of the change that it tells of. Numbers are each principal's own, from 1
//! and without gaps, so who knows the last one that was seen can ask for what came after it, in any process.

use std::collections::{BTreeMap, BTreeSet};

use jiff::Timestamp;
use sqlx::{Row, any::AnyRow};

use super::{
    BatchPlace, JobState, Judgment, Records, count,
    database::{ours, places},
    jobs::batch_place,
    read_id, signed,
    sweep::STEP,
    time, verdict,
};
use crate::store::{BatchId, JobId, Principal, StoreError};

/// A job came into a state.
#[derive(Clone, Debug, PartialEq)]
pub struct EventRecord {
    /// Its place among the events of the job's principal.
    pub number: u64,
    /// The job.
    pub job: JobId,
    /// The state that it came into.
    pub state: JobState,
    /// When.
    pub created_at: Timestamp,
    /// The batch that the job was asked for with, and which item of it, where its record is there.
    pub batch: Option<BatchPlace>,
    /// What the caller noted at the job, where its record is there.
    pub labels: BTreeMap<String, String>,
    /// What the report says of the result, where the job has succeeded, its result was measured and its record is there.
    pub judgment: Option<Judgment>,
}

/// How far the events of a principal reach.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EventReach {
    /// The number of the newest; 0 where nothing has happened.
    pub last: u64,
    /// The number of the newest that is no longer kept; 0 where all are.
    pub removed: u64,
}

/// Events, each with what the report of its job says.
const SELECTED: &str = "SELECT number, job_id, events.state, events.created_at, batch_id, batch_item, verdict, verdict_reason, coverage \
                        FROM events LEFT JOIN jobs ON jobs.id = job_id";

fn read(row: &AnyRow) -> Result<EventRecord, StoreError> {
    let (number, state): (u64, String) = (count(row, "number")?, row.try_get("state")?);
    let state = JobState::from_name(&state).ok_or_else(|| StoreError::Unreadable {
        record: format!("event {number}"),
        reason: format!("no state is called '{state}'"),
    })?;
    Ok(EventRecord {
        number,
        job: read_id(row, "job_id", JobId::parse)?,
        state,
        created_at: time(row, "created_at")?,
        batch: batch_place(row)?,
        labels: BTreeMap::new(),
        // The record may be further by now than the event; only the end of a job that succeeded has a verdict.
        judgment: verdict::read(row)?.filter(|_| state == JobState::Succeeded),
    })
}

impl Records {
    /// How far the events of one owner reach.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn event_reach(&self, owner: &Principal) -> Result<EventReach, StoreError> {
        let query = sqlx::query("SELECT last, removed FROM event_heads WHERE principal = $1").bind(owner.as_str());
        let Some(row) = self.optional(query).await? else { return Ok(EventReach::default()) };
        Ok(EventReach { last: count(&row, "last")?, removed: count(&row, "removed")? })
    }

    /// Up to `most` events of one owner that came after that number, the oldest first.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn events_after(
        &self,
        owner: &Principal,
        number: u64,
        most: usize,
    ) -> Result<Vec<EventRecord>, StoreError> {
        let query = ours(format!("{SELECTED} WHERE events.principal = $1 AND number > $2 ORDER BY number LIMIT $3"));
        let query = sqlx::query(query).bind(owner.as_str()).bind(signed(number)).bind(signed(most as u64));
        self.with_labels(self.all(query).await?.iter().map(read).collect::<Result<_, _>>()?).await
    }

    /// The number of the first event of a batch that is kept; nothing where none is.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn first_event_of_batch(&self, batch: &BatchId) -> Result<Option<u64>, StoreError> {
        // All jobs of a batch were asked for in one transaction, the first item first.
        let query = "SELECT MIN(number) AS number FROM events WHERE job_id IN \
                     (SELECT id FROM jobs WHERE batch_id = $1 AND batch_item = (SELECT MIN(batch_item) FROM jobs WHERE batch_id = $1))";
        let Some(row) = self.optional(sqlx::query(query).bind(batch.as_str())).await? else { return Ok(None) };
        let number: Option<i64> = row.try_get("number")?;
        Ok(number.map(i64::unsigned_abs))
    }

    /// The same for one job, whoever owns it.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn job_events_after(
        &self,
        job: &JobId,
        number: u64,
        most: usize,
    ) -> Result<Vec<EventRecord>, StoreError> {
        let query = ours(format!("{SELECTED} WHERE job_id = $1 AND number > $2 ORDER BY number LIMIT $3"));
        let query = sqlx::query(query).bind(job.as_str()).bind(signed(number)).bind(signed(most as u64));
        self.with_labels(self.all(query).await?.iter().map(read).collect::<Result<_, _>>()?).await
    }

    async fn with_labels(&self, mut events: Vec<EventRecord>) -> Result<Vec<EventRecord>, StoreError> {
        let jobs: BTreeSet<&str> = events.iter().map(|event| event.job.as_str()).collect();
        if jobs.is_empty() {
            return Ok(events);
        }
        let query =
            ours(format!("SELECT job_id, name, value FROM job_labels WHERE job_id IN ({})", places(1, jobs.len())));
        let query = jobs.into_iter().fold(sqlx::query(query), |query, job| query.bind(job.to_owned()));
        let mut labels: BTreeMap<String, BTreeMap<String, String>> = BTreeMap::new();
        for row in self.all(query).await? {
            let of_job = labels.entry(row.try_get("job_id")?).or_default();
            of_job.insert(row.try_get("name")?, row.try_get("value")?);
        }
        for event in &mut events {
            event.labels = labels.get(event.job.as_str()).cloned().unwrap_or_default();
        }
        Ok(events)
    }

    /// Removes the events that are that old, of everybody, some at a time, and remembers how far that went. Gives how many there were.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn remove_events_until(&self, end: Timestamp) -> Result<u64, StoreError> {
        let mut removed = 0;
        loop {
            let step = self.remove_old_events(end).await?;
            removed += step;
            if step == 0 {
                return Ok(removed);
            }
        }
    }

    async fn remove_old_events(&self, end: Timestamp) -> Result<u64, StoreError> {
        let mut transaction = self.begin().await?;
        // In the order of principals, in which whoever writes events of several does so.
        let query = "SELECT principal, MAX(number) AS number FROM (SELECT principal, number FROM events WHERE created_at <= $1 \
                     ORDER BY created_at LIMIT $2) AS old GROUP BY principal ORDER BY principal";
        let query = sqlx::query(query).bind(end.as_millisecond()).bind(signed(STEP as u64));
        let mut removed = 0;
        for row in query.fetch_all(&mut *transaction).await? {
            let (principal, number): (String, i64) = (row.try_get("principal")?, row.try_get("number")?);
            let query = "UPDATE event_heads SET removed = $2 WHERE principal = $1 AND removed < $2";
            sqlx::query(query).bind(&principal).bind(number).execute(&mut *transaction).await?;
            // What came before is older.
            let query = "DELETE FROM events WHERE principal = $1 AND number <= $2";
            let done = sqlx::query(query).bind(&principal).bind(number).execute(&mut *transaction).await?;
            removed += done.rows_affected();
        }
        self.commit(transaction).await?;
        Ok(removed)
    }
}
