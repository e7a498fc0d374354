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

/// What there is to know of a document without reading it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DocumentHead {
    /// What it is called.
    pub name: String,
    /// From 1.
    pub version: u64,
    /// SHA-256 of the document, in hexadecimal.
    pub sha256: String,
}

/// How much of documents one owner may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DocumentBounds {
    /// Current ones of one kind.
    pub documents: u64,
    /// Versions of all kinds, with those that are superseded or removed and that jobs may still name.
    pub versions: u64,
    /// Bytes of current ones of one kind.
    pub bytes: u64,
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
    /// There are as many versions as may be.
    TooManyVersions,
    /// All together would have more bytes than they may: so many.
    TooLarge(u64),
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
    /// Writes a document under its name. The same document again changes nothing. No more is kept than `most` says.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn put_document(
        &self,
        new: NewDocument<'_>,
        precondition: &Precondition,
        most: DocumentBounds,
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
            None => true,
        };
        if let Some(refused) = beyond(&mut transaction, &new, is_new, most).await? {
            return Ok(refused);
        }
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

    /// Name, version and digest of all current documents of a kind that one owner has, by name; the documents are not read.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn document_heads(&self, owner: &Principal, kind: DocumentKind) -> Result<Vec<DocumentHead>, StoreError> {
        let query = "SELECT name, version, sha256 FROM named_documents \
                     WHERE kind = $1 AND principal = $2 AND superseded_at IS NULL ORDER BY name";
        let rows = self.all(sqlx::query(query).bind(kind.name()).bind(owner.as_str())).await?;
        let head = |row: &AnyRow| -> Result<DocumentHead, StoreError> {
            Ok(DocumentHead {
                name: row.try_get("name")?,
                version: count(row, "version")?,
                sha256: row.try_get("sha256")?,
            })
        };
        rows.iter().map(head).collect()
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

/// What stands in the way of one more version, of a name that is new or has its last one superseded.
async fn beyond(
    transaction: &mut Transaction<'static, Any>,
    new: &NewDocument<'_>,
    is_new: bool,
    most: DocumentBounds,
) -> Result<Option<DocumentChange>, StoreError> {
    let query = "SELECT CAST(COUNT(*) AS BIGINT) AS documents, CAST(COALESCE(SUM(LENGTH(document)), 0) AS BIGINT) AS bytes \
                 FROM named_documents WHERE kind = $1 AND principal = $2 AND superseded_at IS NULL";
    let query = sqlx::query(query).bind(new.kind.name()).bind(new.owner.as_str());
    let row = query.fetch_one(&mut **transaction).await?;
    let (documents, bytes) = (count(&row, "documents")?, count(&row, "bytes")? + new.document.len() as u64);
    let query = "SELECT documents AS versions FROM record_counts WHERE principal = $1";
    let row = sqlx::query(query).bind(new.owner.as_str()).fetch_optional(&mut **transaction).await?;
    let versions = row.map_or(Ok(0), |row| count(&row, "versions"))?;
    Ok(if is_new && documents >= most.documents {
        Some(DocumentChange::TooMany)
    } else if versions >= most.versions {
        Some(DocumentChange::TooManyVersions)
    } else if bytes > most.bytes {
        Some(DocumentChange::TooLarge(bytes))
    } else {
        None
    })
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
