//! Records of documents that users keep under a name, with versions.

use jiff::Timestamp;
use sqlx::{Any, Row, Transaction, any::AnyRow};

use super::{Records, count, database::Lock, signed, time};
use crate::store::{Principal, StoreError};

/// What is kept under names. The name on the wire is the one in the database.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DocumentKind {
    /// A rig template.
    Rig,
    /// A preset: a config, or part of one.
    Preset,
}

impl DocumentKind {
    /// The name on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rig => "rig",
            Self::Preset => "preset",
        }
    }
}

/// One version of a document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DocumentRecord {
    /// What it is called.
    pub name: String,
    /// From 1; never used twice while a job may name it.
    pub version: u64,
    /// SHA-256 of the document, in hexadecimal.
    pub sha256: String,
    /// The document, as JSON.
    pub document: String,
    /// When this version came.
    pub created_at: Timestamp,
}

/// What must hold for a document to be changed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Precondition {
    /// Nothing.
    #[default]
    Always,
    /// It is there.
    Exists,
    /// It is not there.
    Absent,
    /// It is there with one of these digests.
    Is(Vec<String>),
}

impl Precondition {
    fn holds(&self, current: Option<&DocumentRecord>) -> bool {
        match (self, current) {
            (Self::Always, _) | (Self::Exists, Some(_)) | (Self::Absent, None) => true,
            (Self::Is(digests), Some(current)) => digests.contains(&current.sha256),
            (Self::Exists | Self::Is(_), None) | (Self::Absent, Some(_)) => false,
        }
    }
}

/// How a change of a document went.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DocumentChange {
    /// It was not there before.
    Created(DocumentRecord),
    /// It has a new version.
    Replaced(DocumentRecord),
    /// It says this already.
    Unchanged(DocumentRecord),
    /// It is gone.
    Removed,
    /// There was nothing to remove.
    NotThere,
    /// The precondition does not hold; this is the digest of what is there.
    Refused(Option<String>),
    /// There are as many as may be.
    TooMany,
}

/// Changes of documents come one after the other: each looks at what is there before it writes.
const LOCK: &str = "named_documents";

fn read(row: &AnyRow) -> Result<DocumentRecord, StoreError> {
    Ok(DocumentRecord {
        name: row.try_get("name")?,
        version: count(row, "version")?,
        sha256: row.try_get("sha256")?,
        document: row.try_get("document")?,
        created_at: time(row, "created_at")?,
    })
}

/// A document as it is to be written.
#[derive(Clone, Copy, Debug)]
pub struct NewDocument<'a> {
    /// Who owns it.
    pub owner: &'a Principal,
    /// What it is.
    pub kind: DocumentKind,
    /// What it is called.
    pub name: &'a str,
    /// SHA-256 of the document, in hexadecimal.
    pub sha256: &'a str,
    /// The document, as JSON.
    pub document: &'a str,
}

impl Records {
    /// Writes a document under its name. The same document again changes nothing. At most `most` of a kind are kept.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn put_document(
        &self,
        new: NewDocument<'_>,
        precondition: &Precondition,
        most: u64,
        now: Timestamp,
    ) -> Result<DocumentChange, StoreError> {
        let NewDocument { owner, kind, name, sha256, document } = new;
        let mut transaction = self.begin().await?;
        self.lock(&mut transaction, LOCK, Lock::Alone).await?;
        let current = current(&mut transaction, owner, kind, name).await?;
        if !precondition.holds(current.as_ref()) {
            return Ok(DocumentChange::Refused(current.map(|current| current.sha256)));
        }
        let is_new = match current {
            Some(current) if current.sha256 == sha256 => return Ok(DocumentChange::Unchanged(current)),
            Some(_) => {
                supersede(&mut transaction, owner, kind, name, now).await?;
                false
            }
            None => {
                let query =
                    "SELECT COUNT(*) FROM named_documents WHERE kind = $1 AND principal = $2 AND superseded_at IS NULL";
                let query = sqlx::query_scalar(query).bind(kind.name()).bind(owner.as_str());
                let kept: i64 = query.fetch_one(&mut *transaction).await?;
                if u64::try_from(kept).unwrap_or(0) >= most {
                    return Ok(DocumentChange::TooMany);
                }
                true
            }
        };
        let query = "INSERT INTO named_documents (kind, name, version, sha256, document, created_at, principal) \
                     SELECT $1, $2, COALESCE(MAX(version), 0) + 1, $3, $4, $5, $6 FROM named_documents \
                     WHERE kind = $1 AND name = $2 AND principal = $6 RETURNING *";
        let row = sqlx::query(query)
            .bind(kind.name())
            .bind(name)
            .bind(sha256)
            .bind(document)
            .bind(now.as_millisecond())
            .bind(owner.as_str())
            .fetch_one(&mut *transaction)
            .await?;
        self.commit(transaction).await?;
        let record = read(&row)?;
        Ok(if is_new { DocumentChange::Created(record) } else { DocumentChange::Replaced(record) })
    }

    /// Removes a document from under its name. Versions that jobs name stay until those jobs are gone.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn remove_document(
        &self,
        owner: &Principal,
        kind: DocumentKind,
        name: &str,
        precondition: &Precondition,
        now: Timestamp,
    ) -> Result<DocumentChange, StoreError> {
        let mut transaction = self.begin().await?;
        self.lock(&mut transaction, LOCK, Lock::Alone).await?;
        let Some(current) = current(&mut transaction, owner, kind, name).await? else {
            return Ok(DocumentChange::NotThere);
        };
        if !precondition.holds(Some(&current)) {
            return Ok(DocumentChange::Refused(Some(current.sha256)));
        }
        supersede(&mut transaction, owner, kind, name, now).await?;
        self.commit(transaction).await?;
        Ok(DocumentChange::Removed)
    }

    /// A document: one version of it, or the current one.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn document(
        &self,
        owner: &Principal,
        kind: DocumentKind,
        name: &str,
        version: Option<u64>,
    ) -> Result<Option<DocumentRecord>, StoreError> {
        let query = "SELECT * FROM named_documents WHERE kind = $1 AND name = $2 AND principal = $4 \
                     AND (version = $3 OR ($3 IS NULL AND superseded_at IS NULL))";
        let query = sqlx::query(query).bind(kind.name()).bind(name).bind(version.map(signed)).bind(owner.as_str());
        self.optional(query).await?.as_ref().map(read).transpose()
    }

    /// All current documents of a kind that one owner has, by name.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn documents(&self, owner: &Principal, kind: DocumentKind) -> Result<Vec<DocumentRecord>, StoreError> {
        let query =
            "SELECT * FROM named_documents WHERE kind = $1 AND principal = $2 AND superseded_at IS NULL ORDER BY name";
        self.all(sqlx::query(query).bind(kind.name()).bind(owner.as_str())).await?.iter().map(read).collect()
    }
}

async fn current(
    transaction: &mut Transaction<'static, Any>,
    owner: &Principal,
    kind: DocumentKind,
    name: &str,
) -> Result<Option<DocumentRecord>, StoreError> {
    let query =
        "SELECT * FROM named_documents WHERE kind = $1 AND name = $2 AND principal = $3 AND superseded_at IS NULL";
    let query = sqlx::query(query).bind(kind.name()).bind(name).bind(owner.as_str());
    let row = query.fetch_optional(&mut **transaction).await?;
    row.as_ref().map(read).transpose()
}

async fn supersede(
    transaction: &mut Transaction<'static, Any>,
    owner: &Principal,
    kind: DocumentKind,
    name: &str,
    now: Timestamp,
) -> Result<(), StoreError> {
    let query = "UPDATE named_documents SET superseded_at = $3 \
                 WHERE kind = $1 AND name = $2 AND principal = $4 AND superseded_at IS NULL";
    let query = sqlx::query(query).bind(kind.name()).bind(name).bind(now.as_millisecond()).bind(owner.as_str());
    query.execute(&mut **transaction).await?;
    Ok(())
}
