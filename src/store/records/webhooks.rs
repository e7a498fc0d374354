//! Records of webhooks: who is to be told where of the ends of jobs.

use jiff::Timestamp;
use sqlx::{Any, Row, Transaction, any::AnyRow};

use super::{JobState, Records, database::Lock, optional_time, principal, read_id, time, without_nul};
use crate::{
    config::Secret,
    store::{Principal, StoreError, WebhookId},
};

/// Where the ends of a principal's jobs are told.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WebhookRecord {
    /// Its name.
    pub id: WebhookId,
    /// Whose jobs it hears of.
    pub principal: Principal,
    /// Where it is.
    pub url: String,
    /// The ends that it hears of, of every job; jobs that name it tell it every end.
    pub events: Vec<JobState>,
    /// The owner's own words about it.
    pub description: String,
    /// What signs, as the receiver was told. Kept as it is, since signing needs it.
    pub secret: Secret,
    /// What signs along until that time.
    pub old_secret: Option<(Secret, Timestamp)>,
    /// When it was made.
    pub created_at: Timestamp,
    /// Since when no delivery has succeeded; nothing while they do.
    pub failing_since: Option<Timestamp>,
    /// Since when it is told nothing, and why.
    pub disabled: Option<(Timestamp, DisabledReason)>,
}

named! {
    /// Why a webhook is told nothing.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum DisabledReason {
        /// Its receiver answered that it is gone for good (410).
        Gone = "gone",
        /// It has failed for too long.
        Failing = "failing",
    }
}

/// The event that tells of an end.
pub(super) const JOB_EVENT: &str = "job.";

fn read(row: &AnyRow) -> Result<WebhookRecord, StoreError> {
    let events: String = row.try_get("events")?;
    let states = events.split(' ').filter_map(|event| JobState::from_name(event.strip_prefix(JOB_EVENT)?));
    let (old_secret, reason): (Option<String>, Option<String>) =
        (row.try_get("old_secret")?, row.try_get("disabled_reason")?);
    let reason = reason.as_deref().and_then(DisabledReason::from_name);
    Ok(WebhookRecord {
        id: read_id(row, "id", WebhookId::parse)?,
        principal: principal(row)?,
        url: row.try_get("url")?,
        events: states.collect(),
        description: row.try_get("description")?,
        secret: Secret(row.try_get("secret")?),
        old_secret: old_secret.map(Secret).zip(optional_time(row, "old_secret_until")?),
        created_at: time(row, "created_at")?,
        failing_since: optional_time(row, "failing_since")?,
        disabled: optional_time(row, "disabled_at")?.zip(reason),
    })
}

impl Records {
    /// Writes a webhook. Gives `false`, and writes nothing, when its principal has `most` already.
    ///
    /// # Errors
    /// When the database fails. The webhook may have been written all the same.
    pub async fn add_webhook(&self, webhook: &WebhookRecord, most: u64) -> Result<bool, StoreError> {
        /// Webhooks are made one after the other: each looks at what is there before it is written.
        const LOCK: &str = "webhooks";
        let mut transaction = self.begin().await?;
        self.lock(&mut transaction, LOCK, Lock::Alone).await?;
        let kept: i64 = sqlx::query_scalar("SELECT COUNT(*) FROM webhooks WHERE principal = $1")
            .bind(webhook.principal.as_str())
            .fetch_one(&mut *transaction)
            .await?;
        if u64::try_from(kept).unwrap_or(0) >= most {
            return Ok(false);
        }
        let events: Vec<String> = webhook.events.iter().map(|state| format!("{JOB_EVENT}{}", state.name())).collect();
        let query = "INSERT INTO webhooks (id, principal, url, events, description, secret, created_at) \
                     VALUES ($1, $2, $3, $4, $5, $6, $7)";
        sqlx::query(query)
            .bind(webhook.id.as_str())
            .bind(webhook.principal.as_str())
            .bind(&webhook.url)
            .bind(events.join(" "))
            .bind(without_nul(&webhook.description))
            .bind(&webhook.secret.0)
            .bind(webhook.created_at.as_millisecond())
            .execute(&mut *transaction)
            .await?;
        self.commit(transaction).await?;
        Ok(true)
    }

    /// All webhooks of one owner, the oldest first.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn webhooks(&self, owner: &Principal) -> Result<Vec<WebhookRecord>, StoreError> {
        let query = sqlx::query("SELECT * FROM webhooks WHERE principal = $1 ORDER BY id").bind(owner.as_str());
        self.all(query).await?.iter().map(read).collect()
    }

    /// A webhook, whoever owns it.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn webhook(&self, id: &WebhookId) -> Result<Option<WebhookRecord>, StoreError> {
        let query = sqlx::query("SELECT * FROM webhooks WHERE id = $1").bind(id.as_str());
        self.optional(query).await?.as_ref().map(read).transpose()
    }

    /// Gives a webhook another secret; the one before signs along until that time. Gives the webhook, or `None` when its owner has none
    /// of that id.
    ///
    /// # Errors
    /// When the database fails. The secret may have been changed all the same.
    pub async fn rotate_webhook_secret(
        &self,
        owner: &Principal,
        id: &WebhookId,
        secret: &Secret,
        old_until: Timestamp,
    ) -> Result<Option<WebhookRecord>, StoreError> {
        let query = "UPDATE webhooks SET old_secret = secret, old_secret_until = $4, secret = $3 \
                     WHERE id = $1 AND principal = $2 RETURNING *";
        let query = sqlx::query(query).bind(id.as_str()).bind(owner.as_str()).bind(&secret.0);
        let row = self.optional_written(query.bind(old_until.as_millisecond())).await?;
        row.as_ref().map(read).transpose()
    }

    /// Removes a webhook, with its deliveries. Gives whether its owner had it.
    ///
    /// # Errors
    /// When the database fails. The webhook may be gone all the same.
    pub async fn remove_webhook(&self, owner: &Principal, id: &WebhookId) -> Result<bool, StoreError> {
        let query = sqlx::query("DELETE FROM webhooks WHERE id = $1 AND principal = $2");
        Ok(self.execute(query.bind(id.as_str()).bind(owner.as_str())).await?.rows_affected() > 0)
    }

    /// Tells a webhook nothing from now on: what it has not heard yet has failed. Part of the transaction that says why.
    pub(super) async fn disable_webhook(
        &self,
        transaction: &mut Transaction<'static, Any>,
        id: &WebhookId,
        reason: DisabledReason,
    ) -> Result<(), StoreError> {
        let now = self.dialect.now();
        let query = format!("UPDATE webhooks SET disabled_at = {now}, disabled_reason = $2 WHERE id = $1");
        let query = sqlx::query(super::database::ours(query)).bind(id.as_str()).bind(reason.name());
        query.execute(&mut **transaction).await?;
        let query = format!(
            "UPDATE deliveries SET state = 'failed', error = 'disabled', finished_at = {now} \
             WHERE webhook_id = $1 AND state = 'pending' AND event <> 'ping'"
        );
        let query = sqlx::query(super::database::ours(query)).bind(id.as_str());
        query.execute(&mut **transaction).await?;
        Ok(())
    }
}
