//! The queue: who gets which job, for how long, and what becomes of jobs whose worker is gone.
//!
//! A queue library was looked for and none fits: those that have SQLite and Postgres behind one interface keep the job's payload
//! in tables of their own, so that a job's record and its place in the queue could disagree after a crash, and none has turns of
//! callers, leases that end with the worker, and cancellation that reaches a running job. What is missing is small when the queue
//! lies in the table of jobs: a claim is one `UPDATE` that takes a row nobody else has locked, and a lease is two columns.
//!
//! **Order.** The caller for whom workers have spent the least time comes next ([`super::engine_time`]); among a caller's jobs, those of no batch, then the greater priority,
//! then the older.
//! **At least once.** A lease that is not extended runs out, and the job goes back to the queue. The end of a job is written
//! only by who holds the lease, so a job that two workers have computed has one end. **Time** is the database's, which is the
//! same for all processes.

use std::{
    collections::{BTreeMap, BTreeSet},
    time::Duration,
};

use jiff::Timestamp;
use sqlx::{Any, Row, Transaction};

use super::{
    FinishedJob, Held, JobRecord, JobState, Lane, Records, count,
    database::{CHUNK, ours, places},
    engine_time::{BRIEF, Wanted, used},
    jobs::{COLUMNS, read, to_json},
    milliseconds, signed,
};
use crate::store::{JobId, LeaseId, Principal, StoreError};

/// The suspicion of a job that runs alone.
const RUNS_ALONE: i64 = 2;

/// What a look into the queue gave.
#[derive(Clone, Debug, PartialEq)]
pub enum Claim {
    /// A job, which is the caller's until its lease runs out.
    Job(Box<JobRecord>),
    /// The same, of a job that was there when a process went down: to be run alone, so that it is known whose fault the next one is.
    Suspect(Box<JobRecord>),
    /// There are jobs, but others were about to take them: look again soon.
    Contended,
    /// Nothing before that time is over. New jobs come with a notice.
    NothingFor(Duration),
    /// Nothing.
    Nothing,
}

/// Why a worker gives a job back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GiveBack {
    /// The worker goes away; the attempt does not count.
    Drained,
    /// What the worker needed did not answer; to be tried again when the time is over.
    RetryAfter(Duration),
}

/// What becomes of a job whose worker is gone.
#[derive(Clone, Debug)]
pub enum AfterCrash {
    /// Nothing: its worker is there, and was only slow to say so.
    Leave,
    /// It goes back to the queue.
    Requeue,
    /// It ends.
    End(Box<FinishedJob>),
    /// It ends, and jobs on the same files are not taken until that time.
    Quarantine(Box<FinishedJob>, Timestamp),
}

/// How much waits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QueueDepth {
    /// Jobs that were asked for one by one.
    pub jobs: u64,
    /// Bytes of their input files.
    pub bytes: u64,
    /// Jobs of batches, which wait behind and are counted by themselves.
    pub batch_jobs: u64,
}

impl Records {
    /// Takes the job whose turn it is, of those that are wanted, and gives it to `lease` for `period`, counting an attempt.
    /// `lease` must be new; when the answer is an error, [`Records::leased`] tells whether it has a job.
    ///
    /// # Errors
    /// When the database fails. The job may have been taken all the same.
    pub async fn claim_job(
        &self,
        lease: &LeaseId,
        period: Duration,
        now: Timestamp,
        wanted: impl Into<Wanted> + Send,
    ) -> Result<Claim, StoreError> {
        let wanted: Wanted = wanted.into();
        let mut transaction = self.begin_brief().await?;
        let (database_now, skip) = (self.dialect.now(), self.dialect.lock_free_rows());
        let query = ours(format!(
            "UPDATE jobs SET state = 'running', attempt = attempt + 1, started_at = $3, lease = $1, progress = NULL, \
             taken_at = {database_now}, charged = (SELECT cost FROM turns WHERE turns.principal = jobs.principal), worker = $5, suspicion = CASE WHEN suspicion > 0 THEN 1 ELSE 0 END, lease_expires_at = {database_now} + $2 WHERE id = (SELECT id FROM jobs WHERE state = 'queued' AND \
             available_at <= {database_now} AND lane <= $4 AND principal = (SELECT principal FROM turns WHERE cost <= $6 AND \
             (SELECT id FROM jobs WHERE jobs.principal = turns.principal AND state = 'queued' AND lane <= $4 AND \
             available_at <= {database_now} ORDER BY lane, priority DESC, id LIMIT 1) IS NOT NULL \
             ORDER BY served, principal LIMIT 1) ORDER BY lane, priority DESC, id \
             LIMIT 1 {skip}) RETURNING {COLUMNS}, suspicion"
        ));
        let row = sqlx::query(query)
            .bind(lease.as_str())
            .bind(milliseconds(period))
            .bind(now.as_millisecond())
            .bind(wanted.last.number())
            .bind(&*self.process)
            .bind(wanted.max_cost())
            .fetch_optional(&mut *transaction)
            .await?;
        let Some(row) = row else {
            drop(transaction);
            return if wanted.is_brief {
                Ok(Claim::NothingFor(BRIEF))
            } else {
                self.look_into_queue(wanted.last).await
            };
        };
        let (job, is_suspect) = (Box::new(read(&row)?), row.try_get::<i64, _>("suspicion")? > 0);
        self.commit(transaction).await?;
        Ok(if is_suspect { Claim::Suspect(job) } else { Claim::Job(job) })
    }

    /// Notes that a suspect is about to run, with no other job in its process. Gives `false` where it is in other hands.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn mark_alone(&self, id: &JobId, lease: &LeaseId) -> Result<bool, StoreError> {
        let query = "UPDATE jobs SET suspicion = 2 WHERE id = $1 AND lease = $2 AND state = 'running'";
        let done = self.execute(sqlx::query(query).bind(id.as_str()).bind(lease.as_str())).await?;
        Ok(done.rows_affected() > 0)
    }

    /// Says as [`Records::claim_job`] when to claim, and takes nothing: [`Claim::Contended`] where there are jobs. That costs a quarter of
    /// a claim that finds none.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn look_into_queue(&self, last: Lane) -> Result<Claim, StoreError> {
        let now = self.dialect.now();
        let query =
            ours(format!("SELECT MIN(available_at) - {now} AS wait FROM jobs WHERE state = 'queued' AND lane <= $1"));
        let wait: Option<i64> = self.one(sqlx::query(query).bind(last.number())).await?.try_get("wait")?;
        Ok(match wait {
            None => Claim::Nothing,
            Some(wait) => match u64::try_from(wait) {
                Ok(wait) if wait > 0 => Claim::NothingFor(Duration::from_millis(wait)),
                _ => Claim::Contended,
            },
        })
    }

    /// The job that `lease` has, when it has one and has not ended it.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn leased(&self, lease: &LeaseId) -> Result<Option<JobRecord>, StoreError> {
        let query = ours(format!(
            "SELECT {COLUMNS} FROM jobs WHERE lease = $1 AND state IN ('running', 'canceling') \
             AND lease_expires_at IS NOT NULL"
        ));
        self.optional(sqlx::query(query).bind(lease.as_str())).await?.as_ref().map(read).transpose()
    }

    /// Extends the leases of jobs to `period` from now and keeps how far they are. Gives the state of each: running, canceling,
    /// or `None` where the lease is lost.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn extend_leases(&self, held: &[Held], period: Duration) -> Result<Vec<Option<JobState>>, StoreError> {
        let mut transaction = self.begin_keeping().await?;
        let (mut states, mut overrun) = (Vec::with_capacity(held.len()), Vec::new());
        for job @ Held { id, lease, progress } in held {
            // Charged again when it has run for twice what it was charged, so a few times however long it runs.
            let query = ours(format!(
                "UPDATE jobs SET lease_expires_at = {now} + $3, progress = $4 WHERE id = $1 AND lease = $2 \
                 AND state IN ('running', 'canceling') \
                 RETURNING state, CAST({now} - COALESCE(taken_at, {now}) - 2 * charged AS BIGINT) AS overrun",
                now = self.dialect.now()
            ));
            let row = sqlx::query(query)
                .bind(id.as_str())
                .bind(lease.as_str())
                .bind(milliseconds(period))
                .bind(to_json(progress, id)?)
                .fetch_optional(&mut *transaction)
                .await?;
            let Some(row) = row else {
                states.push(None);
                continue;
            };
            states.push(JobState::from_name(&row.try_get::<String, _>("state")?));
            if row.try_get::<i64, _>("overrun")? > 0 {
                overrun.push(job);
            }
        }
        self.commit(transaction).await?;
        self.charge(&overrun).await?;
        Ok(states)
    }

    /// Puts a running job back into the queue. Gives `false`, and writes nothing, when it is not in these hands or was told to
    /// stop.
    ///
    /// # Errors
    /// When the database fails. The change may have been made all the same.
    pub async fn give_back(&self, id: &JobId, lease: &LeaseId, why: GiveBack) -> Result<bool, StoreError> {
        let mut transaction = self.begin().await?;
        let (attempts, retries, delay) = match why {
            GiveBack::Drained => (1, 0, Duration::ZERO),
            GiveBack::RetryAfter(delay) => (0, 1, delay),
        };
        let query = ours(format!(
            "UPDATE jobs SET state = 'queued', attempt = attempt - $3, retries = retries + $4, \
             available_at = {} + $5, lease = NULL, lease_expires_at = NULL, started_at = NULL, progress = NULL, \
             charged = {}, taken_at = NULL WHERE id = $1 AND lease = $2 AND state = 'running'",
            self.dialect.now(),
            used(self.dialect)
        ));
        let done = sqlx::query(query)
            .bind(id.as_str())
            .bind(lease.as_str())
            .bind(attempts)
            .bind(retries)
            .bind(milliseconds(delay))
            .execute(&mut *transaction)
            .await?;
        self.commit(transaction).await?;
        Ok(done.rows_affected() > 0)
    }

    /// Takes up to `most` jobs from workers that are gone: those whose lease has run out, or all that anybody has when
    /// `whose_ever`. `decide` says what becomes of each, and is told whether it was alone, so that nothing else can have brought its process
    /// down; what was told to stop must end. Gives the records of those that were taken, as they were, each with that.
    ///
    /// # Errors
    /// When the database fails. The changes may have been made all the same.
    pub async fn take_from_lost_workers(
        &self,
        most: usize,
        whose_ever: bool,
        decide: impl Fn(&JobRecord, bool) -> AfterCrash + Send,
    ) -> Result<Vec<(JobRecord, bool)>, StoreError> {
        let mut transaction = self.begin().await?;
        let query = ours(format!(
            "SELECT {COLUMNS}, worker, suspicion, (SELECT CAST(COUNT(*) AS BIGINT) FROM jobs AS others WHERE \
             others.worker = jobs.worker AND others.state IN ('running', 'canceling')) AS together \
             FROM jobs WHERE state IN ('running', 'canceling') AND ($1 = 1 OR lease_expires_at <= {}) ORDER BY lease_expires_at LIMIT $2 {}",
            self.dialect.now(),
            self.dialect.lock_free_rows()
        ));
        let rows = sqlx::query(query)
            .bind(i64::from(whose_ever))
            .bind(signed(most as u64))
            .fetch_all(&mut *transaction)
            .await?;
        let mut jobs: Vec<(JobRecord, bool)> = Vec::with_capacity(rows.len());
        let mut lost_together = BTreeSet::new();
        for row in &rows {
            let (suspicion, together) = (row.try_get::<i64, _>("suspicion")?, row.try_get::<i64, _>("together")?);
            let worker: Option<String> = row.try_get("worker")?;
            lost_together.extend(worker.filter(|_| together > 1));
            jobs.push((read(row)?, suspicion == RUNS_ALONE || (suspicion == 0 && together <= 1)));
        }
        // Two who do this at the same time write the events of principals in one order, so that neither waits for the other for ever.
        jobs.sort_by(|(one, _), (other, _)| one.principal.cmp(&other.principal));
        let mut taken = Vec::with_capacity(jobs.len());
        for (job, was_alone) in jobs {
            let after = decide(&job, was_alone);
            if !matches!(after, AfterCrash::Leave) {
                self.after_crash(&mut transaction, (&job, was_alone), after).await?;
                taken.push((job, was_alone));
            }
        }
        // Those whose leases run out a little later were there as well.
        for worker in lost_together {
            let query = "UPDATE jobs SET suspicion = 1 WHERE worker = $1 AND suspicion = 0 AND state IN ('running', 'canceling')";
            sqlx::query(query).bind(worker).execute(&mut *transaction).await?;
        }
        self.commit(transaction).await?;
        Ok(taken)
    }

    async fn after_crash(
        &self,
        transaction: &mut Transaction<'static, Any>,
        (job, was_alone): (&JobRecord, bool),
        after: AfterCrash,
    ) -> Result<(), StoreError> {
        let (end, until) = match after {
            AfterCrash::Leave => return Ok(()),
            AfterCrash::Requeue => {
                let query = format!(
                    "UPDATE jobs SET state = 'queued', crashes = crashes + $2, suspicion = 1, available_at = 0, lease = NULL, \
                     lease_expires_at = NULL, started_at = NULL, progress = NULL, charged = {}, taken_at = NULL WHERE id = $1",
                    used(self.dialect)
                );
                sqlx::query(ours(query))
                    .bind(job.id.as_str())
                    .bind(i64::from(was_alone))
                    .execute(&mut **transaction)
                    .await?;
                return Ok(());
            }
            AfterCrash::End(end) => (end, None),
            AfterCrash::Quarantine(end, until) => (end, Some(until)),
        };
        let query = "UPDATE jobs SET crashes = crashes + $2 WHERE id = $1";
        sqlx::query(query).bind(job.id.as_str()).bind(i64::from(was_alone)).execute(&mut **transaction).await?;
        self.write_end(transaction, &job.id, (job.state, job.lease.as_ref()), &end).await?;
        if let Some(until) = until {
            let query = "INSERT INTO quarantine (inputs_sha256, job_id, expires_at) VALUES ($1, $2, $3) \
                         ON CONFLICT (inputs_sha256) DO UPDATE SET expires_at = excluded.expires_at";
            sqlx::query(query)
                .bind(&job.inputs_sha256)
                .bind(job.id.as_str())
                .bind(until.as_millisecond())
                .execute(&mut **transaction)
                .await?;
        }
        Ok(())
    }

    /// Until when jobs on files are not taken, by the digest of the files; those that are taken are not there.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn quarantined(
        &self,
        inputs_sha256: &[&str],
        now: Timestamp,
    ) -> Result<BTreeMap<String, Timestamp>, StoreError> {
        let mut found = BTreeMap::new();
        for digests in inputs_sha256.chunks(CHUNK) {
            let query = ours(format!(
                "SELECT inputs_sha256, expires_at FROM quarantine WHERE expires_at > $1 AND inputs_sha256 IN ({})",
                places(2, digests.len())
            ));
            let query = sqlx::query(query).bind(now.as_millisecond());
            for row in self.all(digests.iter().fold(query, |query, digest| query.bind(*digest))).await? {
                found.insert(row.try_get("inputs_sha256")?, super::time(&row, "expires_at")?);
            }
        }
        Ok(found)
    }

    /// How much waits.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn queue_depth(&self) -> Result<QueueDepth, StoreError> {
        let query = "SELECT lane, CAST(COUNT(*) AS BIGINT) AS jobs, CAST(SUM(input_bytes) AS BIGINT) AS bytes \
                     FROM jobs WHERE state = 'queued' GROUP BY lane";
        let mut depth = QueueDepth::default();
        for row in self.all(sqlx::query(query)).await? {
            if row.try_get::<i64, _>("lane")? == Lane::Single.number() {
                (depth.jobs, depth.bytes) = (count(&row, "jobs")?, count(&row, "bytes")?);
            } else {
                depth.batch_jobs = count(&row, "jobs")?;
            }
        }
        Ok(depth)
    }

    /// Since when the job waits that has waited longest; `None` when none waits.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn oldest_queued(&self) -> Result<Option<Timestamp>, StoreError> {
        let query = "SELECT MIN(created_at) AS created_at FROM jobs WHERE state = 'queued'";
        super::optional_time(&self.one(sqlx::query(query)).await?, "created_at")
    }

    /// The place that a job that waits has in its owner's queue, from 1; counted up to `most`, and one more for those behind that. Of one
    /// job, the jobs before it are counted along an index, which is a fraction of what numbering all of them costs.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn queue_position(&self, job: &JobRecord, most: u64) -> Result<u64, StoreError> {
        let query = "SELECT CAST(COUNT(*) AS BIGINT) AS jobs_before FROM (SELECT 1 FROM jobs WHERE state = 'queued' AND \
                     principal = $1 AND (lane < $5 OR (lane = $5 AND (priority > $2 OR (priority = $2 AND id < $3)))) \
                     LIMIT $4) AS ahead";
        let query = sqlx::query(query)
            .bind(job.principal.as_str())
            .bind(i64::from(job.priority))
            .bind(job.id.as_str())
            .bind(signed(most))
            .bind(job.lane().number());
        Ok(count(&self.one(query).await?, "jobs_before")? + 1)
    }

    /// The places that jobs of one owner have in their owner's queue, from 1; counted up to `most`, and one more for those behind that.
    /// Those that do not wait are not there.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn queue_positions(
        &self,
        owner: &Principal,
        jobs: &[&JobId],
        most: u64,
    ) -> Result<BTreeMap<JobId, u64>, StoreError> {
        let mut found: BTreeMap<JobId, u64> = jobs.iter().map(|id| ((*id).clone(), most + 1)).collect();
        for jobs in jobs.chunks(CHUNK) {
            let query = ours(format!(
                "SELECT id, position FROM (SELECT id, ROW_NUMBER() OVER (ORDER BY lane, priority DESC, id) AS position FROM jobs \
                 WHERE state = 'queued' AND principal = $1 ORDER BY lane, priority DESC, id LIMIT $2) AS waiting WHERE id IN ({})",
                places(3, jobs.len())
            ));
            let query = sqlx::query(query).bind(owner.as_str()).bind(signed(most));
            for row in self.all(jobs.iter().fold(query, |query, id| query.bind(id.as_str()))).await? {
                found.insert(super::read_id(&row, "id", JobId::parse)?, count(&row, "position")?);
            }
        }
        Ok(found)
    }
}
