//! Uploaded files: taking them, keeping them, looking into them.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use bytes::Bytes;
use futures::future::try_join_all;
use tokio::sync::Semaphore;

use super::{
    Engine, EngineRequest, Files, Full, Jobs, Question, Refusal,
    inspections::{Found, InspectionKey},
    library::{self, OwnRigs},
    looks::Look,
    memory,
};
use crate::{
    config::Failpoint,
    engine::{Control, Failure, Format, Knowledge, Limits, NamedBytes, sniff},
    outbound::Outbound,
    store::{AssetId, AssetRecord, BlobWriter, HeldBlobs, Page, Principal, UnnamedBlob},
    telemetry::Metric,
};

/// Files that one process fetches at the same time; others wait, as part of the time that they have.
const MAX_FETCHES: usize = 16;

/// The uploaded files. Cheap to clone; all clones are the same.
#[derive(Clone, Debug)]
pub struct Assets {
    pub(super) jobs: Jobs,
    /// Who fetches files by URL, and how many at the same time.
    pub(super) outbound: Outbound,
    pub(super) fetches: Arc<Semaphore>,
}

/// A file that is arriving. Dropping it leaves nothing.
#[derive(Debug)]
pub struct Upload {
    writer: BlobWriter,
    file_name: String,
    most_bytes: u64,
}

/// A file that has arrived and is not kept yet. Dropping it leaves nothing.
#[derive(Debug)]
pub struct ReceivedFile {
    pub(super) blob: UnnamedBlob,
    format: Format,
    file_name: String,
}

impl Assets {
    /// The files that `jobs` work on.
    #[must_use]
    pub fn new(jobs: &Jobs, outbound: Outbound) -> Self {
        Self { jobs: jobs.clone(), outbound, fetches: Arc::new(Semaphore::new(MAX_FETCHES)) }
    }

    /// Begins to take a file. `announced_bytes` is what the sender said it will be, so that too much is refused early.
    ///
    /// # Errors
    /// When the file would be too large, there is no room, or the service is going down.
    pub async fn begin(&self, file_name: &str, announced_bytes: Option<u64>) -> Result<Upload, Refusal> {
        self.jobs.begin_upload(file_name, announced_bytes).await
    }

    /// Keeps a file that has arrived. The same bytes of the same format are kept once for each owner. Gives the record and whether it is new.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn keep(&self, owner: &Principal, file: ReceivedFile) -> Result<(AssetRecord, bool), Refusal> {
        // One record for each file.
        Ok(self.keep_all(owner, vec![file]).await?.swap_remove(0))
    }

    /// Keeps files that have arrived, all of them or none: as [`Self::keep`], but the disk is waited for once.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn keep_all(
        &self,
        owner: &Principal,
        files: Vec<ReceivedFile>,
    ) -> Result<Vec<(AssetRecord, bool)>, Refusal> {
        self.jobs.keep_files(owner, files).await
    }

    /// Keeps a file that was made here, as if it had been uploaded.
    ///
    /// # Errors
    /// As [`Self::begin`] and [`Self::keep`].
    pub async fn keep_bytes(&self, owner: &Principal, file_name: &str, bytes: &[u8]) -> Result<AssetRecord, Refusal> {
        self.jobs.keep_bytes(owner, file_name, bytes).await
    }

    /// A file's record.
    ///
    /// # Errors
    /// When its owner has none, or its time is over.
    pub async fn get(&self, owner: &Principal, id: &AssetId) -> Result<AssetRecord, Refusal> {
        let asset = self.jobs.0.store.records().asset(owner, id).await?;
        let asset = asset.ok_or_else(|| Refusal::NotFound { kind: "asset", id: id.to_string() })?;
        if asset.expires_at <= self.jobs.0.clock.now() {
            return Err(Refusal::Expired { kind: "asset", id: id.to_string() });
        }
        Ok(asset)
    }

    /// Up to `most` records of one owner, newest first, that are older than `before`.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn list(
        &self,
        owner: &Principal,
        before: Option<&AssetId>,
        most: usize,
    ) -> Result<Page<AssetRecord>, Refusal> {
        Ok(self.jobs.0.store.records().assets(owner, before, most).await?)
    }

    /// Removes a file.
    ///
    /// # Errors
    /// When there is none, or an unfinished job needs it.
    pub async fn delete(&self, owner: &Principal, id: &AssetId) -> Result<(), Refusal> {
        let store = &self.jobs.0.store;
        let removed = store.records().remove_asset(owner, id).await?;
        let removed = removed.ok_or_else(|| Refusal::NotFound { kind: "asset", id: id.to_string() })?;
        Ok(store.remove_unnamed(&[removed.sha256]).await?)
    }

    /// What a file holds, as a JSON object. Remembered for as long as neither the program nor the users' templates change.
    ///
    /// # Errors
    /// When there is no such file, or it cannot be read.
    pub async fn inspect(&self, owner: &Principal, id: &AssetId) -> Result<Arc<str>, Refusal> {
        let asset = self.get(owner, id).await?;
        let rigs = library::own_rigs(&self.jobs.0.store, owner).await?;
        let (key, inspections) = (InspectionKey::of(&asset, &rigs.sha256), &self.jobs.0.inspections);
        if let Some(document) = inspections.find(&key) {
            return Ok(document);
        }
        // Who asks for the same at the same time waits for the one look, and hears what it says.
        let shared = inspections.shared(&key);
        let waited = tokio::time::timeout(self.jobs.0.settings.job_timeout.0, shared.lock()).await;
        let mut refused = waited.map_err(|_| Refusal::TooBusy)?;
        if let Some(document) = inspections.find(&key) {
            return Ok(document);
        }
        if let Some(failure) = &*refused {
            return Err(failure.clone().into());
        }
        let looked = self.inspect_now(&asset, &rigs).await;
        if let Err(Refusal::Engine(failure)) = &looked {
            *refused = Some(failure.clone());
        }
        let inspection = looked?;
        let document: Arc<str> = inspection.to_string().into();
        let memory_bytes = memory::of_inspected_file(asset.bytes, &inspection);
        inspections.add(key, Found { document: Arc::clone(&document), memory_bytes });
        Ok(document)
    }

    async fn inspect_now(&self, asset: &AssetRecord, rigs: &OwnRigs) -> Result<serde_json::Value, Refusal> {
        let name = asset.file_name.clone();
        let memory_bytes = memory::of_job([memory::of_unknown_file(asset.bytes)].into_iter(), 1.0);
        let look = Look { owner: &asset.principal, thread: "inspect", what: "looking into the file", memory_bytes };
        let load = async {
            let knowledge = library::knowledge(&self.jobs.0.store, &asset.principal, &rigs.versions()).await?;
            Ok((self.jobs.0.store.blobs().read(&asset.sha256).await?, knowledge))
        };
        let work =
            move |(bytes, knowledge): &(Bytes, Knowledge), engine: &dyn Engine, limits: &Limits, control: &Control| {
                let files = Files { source: Some(NamedBytes { name: &name, bytes }), ..Files::default() };
                let asked = EngineRequest { question: Question::Inspect, files, formats: &[], knowledge, limits };
                engine.ask(&asked, control)?.document()
            };
        self.jobs.look(look, load, work).await
    }
}

impl Jobs {
    /// Begins to take a file. `announced_bytes` is what the sender said it will be, so that too much is refused early.
    ///
    /// # Errors
    /// When the file would be too large, there is no room, or the service is going down.
    pub(super) async fn begin_upload(&self, file_name: &str, announced_bytes: Option<u64>) -> Result<Upload, Refusal> {
        let inner = &self.0;
        if self.is_draining() {
            return Err(Refusal::Draining);
        }
        let most_bytes = inner.settings.max_file_bytes.0;
        let announced = announced_bytes.unwrap_or(0);
        if announced > most_bytes {
            return Err(too_large(file_name, most_bytes, announced));
        }
        let most_stored = inner.settings.max_stored_bytes.0;
        if let Some(actual) = inner.stored_bytes.too_many_with(inner.store.records(), announced, most_stored).await? {
            Metric::AdmissionRejected.count([("reason", "storage_full".to_owned())], 1);
            return Err(Refusal::StorageFull(Full::StoredBytes { most: most_stored, actual }));
        }
        let writer = inner.store.blobs().begin()?;
        Ok(Upload { writer, file_name: file_name.to_owned(), most_bytes })
    }

    /// Keeps files that have arrived, all of them or none: the disk is waited for once.
    ///
    /// # Errors
    /// When the store fails.
    pub(super) async fn keep_files(
        &self,
        owner: &Principal,
        files: Vec<ReceivedFile>,
    ) -> Result<Vec<(AssetRecord, bool)>, Refusal> {
        let inner = &self.0;
        let assets = self.asset_records_of(owner, &files);
        let _held = self.write_out(files).await?;
        let kept = inner.store.records().add_assets(&assets).await?;
        inner.stored_bytes.add_new(&kept);
        Ok(kept)
    }

    /// Makes the bytes of files durable. They stay as long as what comes back is held, and then where a record names them.
    pub(super) async fn write_out(&self, files: Vec<ReceivedFile>) -> Result<HeldBlobs, Refusal> {
        Failpoint::UploadComplete.reach();
        let digests: Vec<String> = files.iter().map(|file| file.blob.blob().sha256.clone()).collect();
        let digests: Vec<&str> = digests.iter().map(String::as_str).collect();
        let held = self.0.store.hold_blobs(&digests).await?;
        try_join_all(files.into_iter().map(|file| file.blob.keep())).await?;
        Failpoint::UploadKept.reach();
        Ok(held)
    }

    /// The records that files get which have arrived, where their owner has no other record of the same bytes.
    pub(super) fn asset_records_of(&self, owner: &Principal, files: &[ReceivedFile]) -> Vec<AssetRecord> {
        let inner = &self.0;
        let (created_at, expires_at) = (inner.clock.now(), inner.clock.after(inner.settings.asset_retention.0));
        let record = |file: &ReceivedFile| AssetRecord {
            id: AssetId::new(),
            principal: owner.clone(),
            sha256: file.blob.blob().sha256.clone(),
            bytes: file.blob.blob().bytes,
            format: file.format.info().name.to_owned(),
            file_name: file.file_name.clone(),
            created_at,
            expires_at,
        };
        files.iter().map(record).collect()
    }

    /// Keeps for the caller what those of the ids name that are of built-in assets. They are found under these ids; the records have ids of
    /// their own.
    pub(super) async fn keep_built_in(
        &self,
        owner: &Principal,
        ids: &BTreeSet<&AssetId>,
    ) -> Result<BTreeMap<AssetId, AssetRecord>, Refusal> {
        let mut kept = BTreeMap::new();
        for asset in self.0.built_in_assets {
            let named = asset.id();
            if let Some(id) = ids.iter().find(|id| id.as_str() == named) {
                kept.insert((*id).clone(), self.keep_bytes(owner, asset.file_name, &(asset.bytes)()).await?);
            }
        }
        Ok(kept)
    }

    /// Keeps a file that was made here, as if it had been uploaded.
    async fn keep_bytes(&self, owner: &Principal, file_name: &str, bytes: &[u8]) -> Result<AssetRecord, Refusal> {
        let mut upload = self.begin_upload(file_name, Some(bytes.len() as u64)).await?;
        upload.write(bytes).await?;
        // One record for each file.
        Ok(self.keep_files(owner, vec![upload.finish(None).await?]).await?.swap_remove(0).0)
    }
}

impl Upload {
    /// Adds bytes.
    ///
    /// # Errors
    /// When there are more than a file may have, or the store fails.
    pub async fn write(&mut self, chunk: &[u8]) -> Result<(), Refusal> {
        let total = self.writer.bytes() + chunk.len() as u64;
        if total > self.most_bytes {
            return Err(too_large(&self.file_name, self.most_bytes, total));
        }
        Ok(self.writer.write(chunk).await?)
    }

    /// Ends the file: `announced` is the SHA-256 that the sender gave, in hexadecimal. Finds the format from the bytes.
    ///
    /// # Errors
    /// When the bytes are not those announced, or of no format that is read.
    pub async fn finish(self, announced: Option<&str>) -> Result<ReceivedFile, Refusal> {
        let Self { writer, file_name, .. } = self;
        let blob = writer.finish().await?;
        let actual = blob.blob().sha256.clone();
        if let Some(announced) = announced.filter(|announced| *announced != actual) {
            return Err(Refusal::DigestMismatch { announced: announced.to_owned(), actual });
        }
        let format = sniff(&blob.ends(), &file_name).map_err(Failure::from)?;
        Metric::AssetBytesReceived.count([], blob.blob().bytes);
        Ok(ReceivedFile { blob, format, file_name })
    }
}

fn too_large(file_name: &str, most: u64, actual: u64) -> Refusal {
    let what = if file_name.is_empty() { "the file".to_owned() } else { format!("the file '{file_name}'") };
    Refusal::TooLarge { what, limit: "file_bytes", most, actual }
}
