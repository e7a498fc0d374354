//! The outbox: what webhooks are to be told, and how often that was tried.
//!
//! A trigger of the layout writes a delivery in the transaction of the job's end. **At least once**: who takes a delivery puts off when it
//! is due, and the end of an attempt is written only by who took it last; should that process die, the delivery is due again. **Time** is
//! the database's, as in the queue.

use std::time::Duration;

use jiff::Timestamp;
use sqlx::{Row, any::AnyRow};

use super::{
    DisabledReason, JobState, Page, Records, count,
    database::{ours, places},
    milliseconds, optional_time, read_id, signed,
    sweep::{STEP, returned},
    time,
    webhooks::JOB_EVENT,
};
use crate::store::{DeliveryId, JobId, Principal, StoreError, WebhookId};

/// What a webhook is told.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeliveryEvent {
    /// A job has come to that end.
    JobEnded(JobId, JobState),
    /// Somebody asked whether the receiver is there.
    Ping,
}

const PING: &str = "ping";

impl DeliveryEvent {
    /// The name on the wire and in the database.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::JobEnded(_, state) => format!("{JOB_EVENT}{}", state.name()),
            Self::Ping => PING.to_owned(),
        }
    }
}

named! {
    /// How far a delivery is.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum DeliveryState {
        /// It is made, or will be tried again.
        Pending = "pending",
        /// The receiver has it.
        Delivered = "delivered",
        /// It is not tried any more.
        Failed = "failed",
    }
}

/// Something that a webhook is told.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeliveryRecord {
    /// Its name, by which receivers know what they have had before.
    pub id: DeliveryId,
    /// Who is told.
    pub webhook: WebhookId,
    /// What.
    pub event: DeliveryEvent,
    /// How far it is.
    pub state: DeliveryState,
    /// How often it was begun.
    pub attempts: u64,
    /// How often it failed since it was last asked for.
    pub retries: u64,
    /// When it happened.
    pub created_at: Timestamp,
    /// When it is tried next, while it is pending.
    pub due_at: Timestamp,
    /// When it was last begun.
    pub attempted_at: Option<Timestamp>,
    /// The HTTP status of the last answer.
    pub status: Option<u16>,
    /// Why there was none: one of a few words.
    pub error: Option<String>,
    /// When it was delivered or given up.
    pub finished_at: Option<Timestamp>,
}

/// What a look into the outbox gave.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeliveryClaim {
    /// A delivery, which is the caller's until its time is over.
    Delivery(Box<DeliveryRecord>),
    /// Nothing before that time is over.
    NothingFor(Duration),
    /// Nothing.
    Nothing,
}

/// How an attempt went.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AttemptEnd {
    /// The HTTP status of the answer, where there was one.
    pub status: Option<u16>,
    /// Why there was none.
    pub error: Option<&'static str>,
    /// What becomes of the delivery.
    pub then: AfterAttempt,
}

/// What becomes of a delivery after an attempt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AfterAttempt {
    /// The receiver has it.
    Deliver,
    /// It is tried again when that time is over.
    RetryAfter(Duration),
    /// It is given up. A webhook that has failed for that long is disabled.
    GiveUp {
        /// How long that is.
        failing_period: Duration,
    },
    /// It is given up, and its webhook disabled.
    Disable,
}

fn read(row: &AnyRow) -> Result<DeliveryRecord, StoreError> {
    let id = read_id(row, "id", DeliveryId::parse)?;
    let unreadable = |reason: String| StoreError::Unreadable { record: id.to_string(), reason };
    let (event, state): (String, String) = (row.try_get("event")?, row.try_get("state")?);
    let ended = event.strip_prefix(JOB_EVENT).and_then(JobState::from_name);
    let event = match ended {
        Some(state) => DeliveryEvent::JobEnded(read_id(row, "job_id", JobId::parse)?, state),
        None if event == PING => DeliveryEvent::Ping,
        None => return Err(unreadable(format!("no event is called '{event}'"))),
    };
    let status: Option<i64> = row.try_get("status")?;
    Ok(DeliveryRecord {
        webhook: read_id(row, "webhook_id", WebhookId::parse)?,
        event,
        state: DeliveryState::from_name(&state).ok_or_else(|| unreadable(format!("no state is called '{state}'")))?,
        attempts: count(row, "attempts")?,
        retries: count(row, "retries")?,
        created_at: time(row, "created_at")?,
        due_at: time(row, "due_at")?,
        attempted_at: optional_time(row, "attempted_at")?,
        status: status.and_then(|status| u16::try_from(status).ok()),
        error: row.try_get("error")?,
        finished_at: optional_time(row, "finished_at")?,
        id,
    })
}

/// Only what belongs to a webhook of that owner.
const OWNED: &str = "webhook_id IN (SELECT id FROM webhooks WHERE principal = $1)";

impl Records {
    /// Puts a ping into the outbox; of those that have been sent, the newest `most` stay. `None` when the owner has no such webhook, or so
    /// many pings wait to be sent.
    ///
    /// # Errors
    /// When the database fails. The ping may be sent all the same.
    pub async fn add_ping(
        &self,
        owner: &Principal,
        id: &WebhookId,
        most: u64,
    ) -> Result<Option<DeliveryRecord>, StoreError> {
        let query = ours(format!(
            "DELETE FROM deliveries WHERE webhook_id = $1 AND event = '{PING}' AND state <> 'pending' AND id NOT IN \
             (SELECT id FROM deliveries WHERE webhook_id = $1 AND event = '{PING}' ORDER BY id DESC LIMIT $2) \
             AND webhook_id IN (SELECT id FROM webhooks WHERE principal = $3)"
        ));
        let query = sqlx::query(query).bind(id.as_str()).bind(signed(most)).bind(owner.as_str());
        self.execute(query).await?;
        let now = self.dialect.now();
        let query = ours(format!(
            "INSERT INTO deliveries (id, webhook_id, event, state, created_at, due_at) \
             SELECT '{}' || {}, id, '{PING}', 'pending', {now}, {now} FROM webhooks WHERE id = $2 AND principal = $1 \
             AND (SELECT COUNT(*) FROM deliveries WHERE webhook_id = $2 AND event = '{PING}' AND state = 'pending') < $3 \
             RETURNING *",
            DeliveryId::PREFIX,
            self.dialect.new_letters()
        ));
        let query = sqlx::query(query).bind(owner.as_str()).bind(id.as_str()).bind(signed(most));
        let row = self.optional_written(query).await?;
        row.as_ref().map(read).transpose()
    }

    /// A delivery to a webhook of that owner.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn delivery(&self, owner: &Principal, id: &DeliveryId) -> Result<Option<DeliveryRecord>, StoreError> {
        let query = ours(format!("SELECT * FROM deliveries WHERE {OWNED} AND id = $2"));
        let row = self.optional(sqlx::query(query).bind(owner.as_str()).bind(id.as_str())).await?;
        row.as_ref().map(read).transpose()
    }

    /// Up to `most` deliveries to a webhook of that owner, in that state where one is given, newest first, that are older than `before`.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn deliveries(
        &self,
        owner: &Principal,
        webhook: &WebhookId,
        state: Option<DeliveryState>,
        before: Option<&DeliveryId>,
        most: usize,
    ) -> Result<Page<DeliveryRecord>, StoreError> {
        let query = ours(format!(
            "SELECT * FROM deliveries WHERE {OWNED} AND webhook_id = $2 {} {} ORDER BY id DESC LIMIT $3",
            before.map_or("", |_| "AND id < $4"),
            // A name of a closed list, never what a caller sent.
            state.map_or_else(String::new, |state| format!("AND state = '{}'", state.name())),
        ));
        let query = sqlx::query(query).bind(owner.as_str()).bind(webhook.as_str()).bind(signed(most as u64 + 1));
        let query = before.into_iter().fold(query, |query, id| query.bind(id.as_str()));
        Ok(Page::cut(self.all(query).await?.iter().map(read).collect::<Result<_, _>>()?, most))
    }

    /// Takes the delivery that is due longest, but for those to webhooks that are `busy`, and puts off when it is due by `period`,
    /// counting an attempt.
    ///
    /// # Errors
    /// When the database fails. A delivery may have been taken all the same, and is due again when the period is over.
    pub async fn claim_delivery(&self, busy: &[WebhookId], period: Duration) -> Result<DeliveryClaim, StoreError> {
        let now = self.dialect.now();
        let places: Vec<String> = (1..=busy.len()).map(|place| format!("${place}")).collect();
        let idle = match places.is_empty() {
            true => String::new(),
            false => format!("AND webhook_id NOT IN ({})", places.join(", ")),
        };
        // Most of the time nothing is due: looking locks nothing.
        let query = ours(format!("SELECT MIN(due_at) - {now} AS wait FROM deliveries WHERE state = 'pending' {idle}"));
        let query = busy.iter().fold(sqlx::query(query), |query, id| query.bind(id.as_str()));
        match self.one(query).await?.try_get::<Option<i64>, _>("wait")? {
            None => return Ok(DeliveryClaim::Nothing),
            Some(wait) if wait > 0 => return Ok(DeliveryClaim::NothingFor(Duration::from_millis(wait.unsigned_abs()))),
            Some(_) => {}
        }
        let query = ours(format!(
            "UPDATE deliveries SET attempts = attempts + 1, attempted_at = {now}, due_at = {now} + {} WHERE id = \
             (SELECT id FROM deliveries WHERE state = 'pending' AND due_at <= {now} {idle} ORDER BY due_at, id LIMIT 1 {}) \
             RETURNING *",
            milliseconds(period),
            self.dialect.lock_free_rows()
        ));
        let query = busy.iter().fold(sqlx::query(query), |query, id| query.bind(id.as_str()));
        let mut transaction = self.begin_brief().await?;
        let row = query.fetch_optional(&mut *transaction).await?;
        self.commit(transaction).await?;
        Ok(match row {
            Some(row) => DeliveryClaim::Delivery(Box::new(read(&row)?)),
            // Others were faster.
            None => DeliveryClaim::NothingFor(Duration::ZERO),
        })
    }

    /// Writes how an attempt went. Gives `false`, and writes nothing, when another attempt has begun since.
    ///
    /// # Errors
    /// When the database fails. The end may have been written all the same.
    pub async fn end_attempt(&self, taken: &DeliveryRecord, end: &AttemptEnd) -> Result<bool, StoreError> {
        let now = self.dialect.now();
        let (state, delay) = match end.then {
            AfterAttempt::Deliver => (DeliveryState::Delivered, None),
            AfterAttempt::RetryAfter(delay) => (DeliveryState::Pending, Some(delay)),
            AfterAttempt::GiveUp { .. } | AfterAttempt::Disable => (DeliveryState::Failed, None),
        };
        let finished = if delay.is_some() { "NULL" } else { now };
        let query = ours(format!(
            "UPDATE deliveries SET state = $3, status = $4, error = $5, retries = retries + $6, due_at = {now} + $7, \
             finished_at = {finished} WHERE id = $1 AND attempts = $2 AND state = 'pending'"
        ));
        let mut transaction = self.begin().await?;
        let done = sqlx::query(query)
            .bind(taken.id.as_str())
            .bind(signed(taken.attempts))
            .bind(state.name())
            .bind(end.status.map(i64::from))
            .bind(end.error)
            .bind(i64::from(state != DeliveryState::Delivered))
            .bind(milliseconds(delay.unwrap_or_default()))
            .execute(&mut *transaction)
            .await?;
        if done.rows_affected() == 0 {
            return Ok(false);
        }
        let query = match (end.then, &taken.event) {
            // A receiver that answers a ping is there again.
            (AfterAttempt::Deliver, DeliveryEvent::Ping) => {
                "UPDATE webhooks SET failing_since = NULL, disabled_at = NULL, disabled_reason = NULL WHERE id = $1"
                    .to_owned()
            }
            (AfterAttempt::Deliver, _) => {
                "UPDATE webhooks SET failing_since = NULL WHERE id = $1 AND failing_since IS NOT NULL".to_owned()
            }
            _ => format!("UPDATE webhooks SET failing_since = {now} WHERE id = $1 AND failing_since IS NULL"),
        };
        sqlx::query(ours(query)).bind(taken.webhook.as_str()).execute(&mut *transaction).await?;
        let reason = match end.then {
            AfterAttempt::Disable => Some(DisabledReason::Gone),
            AfterAttempt::GiveUp { failing_period } => {
                let query = ours(format!(
                    "SELECT COUNT(*) FROM webhooks WHERE id = $1 AND disabled_at IS NULL AND failing_since <= {now} - $2"
                ));
                let query = sqlx::query_scalar(query).bind(taken.webhook.as_str()).bind(milliseconds(failing_period));
                let failing: i64 = query.fetch_one(&mut *transaction).await?;
                (failing > 0).then_some(DisabledReason::Failing)
            }
            _ => None,
        };
        if let Some(reason) = reason {
            self.disable_webhook(&mut transaction, &taken.webhook, reason).await?;
        }
        self.commit(transaction).await?;
        Ok(true)
    }

    /// Makes a delivery due at once, whatever became of it. `None` when there is none to a webhook of that owner.
    ///
    /// # Errors
    /// When the database fails. The delivery may be made all the same.
    pub async fn redeliver(&self, owner: &Principal, id: &DeliveryId) -> Result<Option<DeliveryRecord>, StoreError> {
        let query = ours(format!(
            "UPDATE deliveries SET state = 'pending', retries = 0, due_at = {}, finished_at = NULL WHERE {OWNED} AND id = $2 \
             RETURNING *",
            self.dialect.now()
        ));
        let query = sqlx::query(query).bind(owner.as_str()).bind(id.as_str());
        let row = self.optional_written(query).await?;
        row.as_ref().map(read).transpose()
    }

    /// Removes the deliveries that came to an end that long ago, of everybody, some at a time. Gives how many there were.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn remove_deliveries_until(&self, end: Timestamp) -> Result<u64, StoreError> {
        let query = "SELECT id FROM deliveries WHERE finished_at <= $1 ORDER BY finished_at LIMIT $2";
        let mut removed = 0;
        loop {
            let mut transaction = self.begin().await?;
            let query = sqlx::query_scalar::<_, String>(query).bind(end.as_millisecond()).bind(signed(STEP as u64));
            let ids = query.fetch_all(&mut *transaction).await?;
            // Not those that somebody has made due again just then.
            let places = places(1, ids.len());
            let query =
                format!("DELETE FROM deliveries WHERE id IN ({places}) AND finished_at IS NOT NULL RETURNING id");
            let done = returned(&mut transaction, query, &ids).await?.len();
            self.commit(transaction).await?;
            removed += done as u64;
            if done == 0 {
                return Ok(removed);
            }
        }
    }
}
