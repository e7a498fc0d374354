//! What users teach the service under a name: rig templates, which take part in recognition, and presets, which jobs can name.
//!
//! Built-in ones are listed beside the user's own and cannot be changed. A job keeps the versions that it was asked for with, so
//! that it gives the same whenever it runs.

use sha2::{Digest, Sha256};

use super::{Jobs, Refusal};
use crate::{
    engine::{self, Knowledge},
    store::{
        DocumentBounds, DocumentChange, DocumentHead, DocumentKind, DocumentRecord, NewDocument, Precondition,
        Principal, Store, StoreError, VersionedName, hexadecimal,
    },
};

/// What is kept under names. Cheap to clone; all clones are the same.
#[derive(Clone, Debug)]
pub struct Library(Jobs);

/// A document and what is known of it.
#[derive(Clone, Debug)]
pub struct Kept {
    /// What it is called.
    pub name: String,
    /// The document, as a JSON object.
    pub document: serde_json::Value,
    /// SHA-256 of the document, in hexadecimal.
    pub sha256: String,
    /// Its version and when that came; nothing for what comes with the program.
    pub own: Option<(u64, jiff::Timestamp)>,
}

/// What was written.
#[derive(Clone, Debug)]
pub struct Written {
    /// The document as it is now.
    pub kept: Kept,
    /// Whether there was none of that name.
    pub is_new: bool,
}

impl Library {
    /// What `jobs` keep.
    #[must_use]
    pub fn new(jobs: &Jobs) -> Self {
        Self(jobs.clone())
    }

    /// All documents of a kind that one owner may use, by name: those that come with the program first.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn list(&self, owner: &Principal, kind: DocumentKind) -> Result<Vec<Kept>, Refusal> {
        let own = self.0.0.store.records().documents(owner, kind).await?;
        let own = own.into_iter().map(read).collect::<Result<Vec<_>, _>>()?;
        Ok(built_in(kind).into_iter().chain(own).collect())
    }

    /// A document: one version of it, or the current one.
    ///
    /// # Errors
    /// When there is none.
    pub async fn get(
        &self,
        owner: &Principal,
        kind: DocumentKind,
        name: &str,
        version: Option<u64>,
    ) -> Result<Kept, Refusal> {
        if let (Some(kept), None) = (built_in_named(kind, name), version) {
            return Ok(kept);
        }
        let record = self.0.0.store.records().document(owner, kind, name, version).await?;
        record.map_or_else(|| Err(not_found(kind, name)), read)
    }

    /// Writes a document under a name. The same document again changes nothing.
    ///
    /// # Errors
    /// When the document cannot be used, the name is taken by one that comes with the program, the precondition does not hold,
    /// or there are as many as may be.
    pub async fn put(
        &self,
        owner: &Principal,
        kind: DocumentKind,
        name: &str,
        document: &serde_json::Value,
        precondition: &Precondition,
    ) -> Result<Written, Refusal> {
        if self.0.is_draining() {
            return Err(Refusal::Draining);
        }
        refuse_built_in(kind, name)?;
        let document = match kind {
            DocumentKind::Rig => engine::check_rig(name, document.clone())?,
            DocumentKind::Preset => engine::check_preset(name, document.clone())?,
        };
        let text = document.to_string();
        let sha256 = digest(&text);
        let new = NewDocument { owner, kind, name, sha256: &sha256, document: &text };
        let settings = &self.0.0.settings;
        let (documents, bytes) = (settings.max_stored_documents, settings.max_stored_document_bytes.0);
        let versions = settings.max_document_versions;
        let (most, now) = (DocumentBounds { documents, versions, bytes }, self.0.0.clock.now());
        match self.0.0.store.records().put_document(new, precondition, most, now).await? {
            DocumentChange::Created(record) => Ok(Written { kept: read(record)?, is_new: true }),
            DocumentChange::Replaced(record) | DocumentChange::Unchanged(record) => {
                Ok(Written { kept: read(record)?, is_new: false })
            }
            DocumentChange::TooMany => {
                Err(Refusal::TooManyDocuments { kind: kind.name(), limit: "stored_documents", most: documents })
            }
            DocumentChange::TooManyVersions => {
                Err(Refusal::TooManyDocuments { kind: kind.name(), limit: "document_versions", most: versions })
            }
            DocumentChange::TooLarge(actual) => Err(Refusal::TooLarge {
                what: format!("all {}s together", kind.name()),
                limit: "stored_document_bytes",
                most: bytes,
                actual,
            }),
            DocumentChange::Refused(current) => Err(changed(kind, name, current)),
            DocumentChange::Removed | DocumentChange::NotThere => Err(not_found(kind, name)),
        }
    }

    /// Removes a document. Jobs that were asked for with it keep it.
    ///
    /// # Errors
    /// When there is none, it comes with the program, or the precondition does not hold.
    pub async fn delete(
        &self,
        owner: &Principal,
        kind: DocumentKind,
        name: &str,
        precondition: &Precondition,
    ) -> Result<(), Refusal> {
        refuse_built_in(kind, name)?;
        let now = self.0.0.clock.now();
        match self.0.0.store.records().remove_document(owner, kind, name, precondition, now).await? {
            DocumentChange::Refused(current) => Err(changed(kind, name, current)),
            DocumentChange::NotThere => Err(not_found(kind, name)),
            _ => Ok(()),
        }
    }
}

/// The rig templates of one owner as they are now, with a digest over all of them.
pub(super) async fn own_rigs(store: &Store, owner: &Principal) -> Result<OwnRigs, Refusal> {
    let heads = store.records().document_heads(owner, DocumentKind::Rig).await?;
    let text = heads.iter().fold(String::new(), |text, head| text + &head.name + ":" + &head.sha256 + "\n");
    Ok(OwnRigs { sha256: digest(&text), heads })
}

/// What a job of that owner knows: these versions of the owner's templates, as they are written. Who works with them parses them.
pub(super) async fn knowledge(store: &Store, owner: &Principal, rigs: &[VersionedName]) -> Result<Knowledge, Refusal> {
    let mut documents = Vec::with_capacity(rigs.len());
    for VersionedName { name, version } in rigs {
        let record = store.records().document(owner, DocumentKind::Rig, name, Some(*version)).await?;
        let record = record.ok_or_else(|| unreadable(name, "a version that a job names is gone".to_owned()))?;
        documents.push(record.document);
    }
    Ok(Knowledge::unread(documents))
}

impl Jobs {
    /// The preset of that name, current or built in.
    pub(super) async fn preset(&self, owner: &Principal, name: &str) -> Result<Kept, Refusal> {
        let library = Library::new(self);
        match library.get(owner, DocumentKind::Preset, name, None).await {
            Err(Refusal::NotFound { .. }) => {
                let known =
                    library.list(owner, DocumentKind::Preset).await?.into_iter().map(|kept| kept.name).collect();
                Err(Refusal::UnknownPreset { name: name.to_owned(), known })
            }
            other => other,
        }
    }
}

/// The user's own rig templates at one time.
pub(super) struct OwnRigs {
    /// Changes when any of them does.
    pub(super) sha256: String,
    heads: Vec<DocumentHead>,
}

impl OwnRigs {
    /// Their names and versions.
    pub(super) fn versions(&self) -> Vec<VersionedName> {
        let version = |head: &DocumentHead| VersionedName { name: head.name.clone(), version: head.version };
        self.heads.iter().map(version).collect()
    }
}

fn read(record: DocumentRecord) -> Result<Kept, Refusal> {
    let DocumentRecord { name, version, sha256, document, created_at } = record;
    let document = serde_json::from_str(&document).map_err(|error| unreadable(&name, error.to_string()))?;
    Ok(Kept { name, document, sha256, own: Some((version, created_at)) })
}

fn built_in(kind: DocumentKind) -> Vec<Kept> {
    let documents = match kind {
        DocumentKind::Rig => engine::built_in_rigs(),
        DocumentKind::Preset => engine::built_in_presets(),
    };
    let kept = |(name, document): (String, serde_json::Value)| {
        let sha256 = digest(&document.to_string());
        Kept { name, document, sha256, own: None }
    };
    documents.into_iter().map(kept).collect()
}

fn built_in_named(kind: DocumentKind, name: &str) -> Option<Kept> {
    built_in(kind).into_iter().find(|kept| kept.name == name)
}

fn refuse_built_in(kind: DocumentKind, name: &str) -> Result<(), Refusal> {
    match built_in_named(kind, name) {
        Some(_) => Err(Refusal::BuiltIn { kind: kind.name(), name: name.to_owned() }),
        None => Ok(()),
    }
}

fn not_found(kind: DocumentKind, name: &str) -> Refusal {
    Refusal::NotFound { kind: kind.name(), id: name.to_owned() }
}

fn changed(kind: DocumentKind, name: &str, current: Option<String>) -> Refusal {
    Refusal::Changed { kind: kind.name(), name: name.to_owned(), current }
}

fn unreadable(name: &str, reason: String) -> Refusal {
    Refusal::Store(StoreError::Unreadable { record: name.to_owned(), reason })
}

/// The SHA-256 of a text, in hexadecimal.
pub(super) fn digest(text: &str) -> String {
    hexadecimal(&Sha256::digest(text.as_bytes()))
}
