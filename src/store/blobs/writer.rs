//! Writing a blob: its bytes first, its name when it is complete.

use std::{borrow::Cow, sync::Arc};

use bytes::{Bytes, BytesMut};
use object_store::{MultipartUpload, ObjectStore, ObjectStoreExt, PutMode, PutPayload, path::Path};
use sha2::{Digest, Sha256};
use tokio::sync::OwnedSemaphorePermit;

use super::{Blobs, UNFINISHED, ends::Ends};
use crate::store::{StoreError, hexadecimal};

/// A blob's name and size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Blob {
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
    /// How many bytes.
    pub bytes: u64,
}

impl Blobs {
    /// Begins a blob.
    ///
    /// # Errors
    /// When there is no room.
    pub fn begin(&self) -> Result<BlobWriter, StoreError> {
        self.begin_with(Digesting::default())
    }

    fn begin_with(&self, digest: Digesting) -> Result<BlobWriter, StoreError> {
        self.check_room()?;
        let (buffer, ends) = (BytesMut::new(), Ends::default());
        Ok(BlobWriter { blobs: self.clone(), upload: None, buffer, ends, more_parts: None, digest, bytes: 0 })
    }

    /// Moves what was uploaded to its name, for good.
    async fn give_name(&self, path: &Path, name: &Path) -> Result<(), StoreError> {
        match &self.disk {
            Some(disk) => disk.give_name(path, name).await,
            None => Ok(self.store.rename(path, name).await?),
        }
    }

    /// Puts what was small enough for memory under its name, for good. What has that name already has the same bytes.
    async fn put(&self, bytes: Bytes, name: &Path) -> Result<(), StoreError> {
        if let Some(disk) = &self.disk {
            return disk.put(bytes, name).await;
        }
        match self.store.put_opts(name, PutPayload::from_bytes(bytes), PutMode::Create.into()).await {
            Ok(_) | Err(object_store::Error::AlreadyExists { .. }) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// Writes a whole blob. It is visible only after [`UnnamedBlob::keep`]. `known_sha256` is its digest in hexadecimal, where somebody has
    /// found it already.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn write(&self, bytes: Bytes, known_sha256: Option<String>) -> Result<UnnamedBlob, StoreError> {
        /// So that hashing a large file does not hold a thread of the runtime for long.
        const PIECE_BYTES: usize = 1 << 20;
        let mut digest = known_sha256.map_or_else(Digesting::default, Digesting::Known);
        if bytes.len() > MAX_WHOLE_BYTES {
            let mut writer = self.begin_with(digest)?;
            for piece in bytes.chunks(PIECE_BYTES) {
                writer.write(piece).await?;
            }
            return writer.finish().await;
        }
        self.check_room()?;
        for piece in bytes.chunks(PIECE_BYTES) {
            digest.pass(piece);
            tokio::task::yield_now().await;
        }
        let blob = Blob { sha256: digest.take(), bytes: bytes.len() as u64 };
        Ok(UnnamedBlob { blobs: self.clone(), content: Some(Content::InMemory(bytes, None)), blob })
    }
}

/// Parts on their way to a place beside the blobs.
#[derive(Debug)]
struct Upload {
    parts: Box<dyn MultipartUpload>,
    path: Path,
}

impl Upload {
    async fn begin(blobs: &Blobs) -> Result<Self, StoreError> {
        let path = blobs.prefix.clone().join(UNFINISHED).join(uuid::Uuid::now_v7().to_string());
        Ok(Self { parts: blobs.store.put_multipart(&path).await?, path })
    }
}

/// A blob that is being written. Dropping it leaves nothing.
#[derive(Debug)]
pub struct BlobWriter {
    blobs: Blobs,
    /// `None` as long as everything is in the buffer.
    upload: Option<Upload>,
    buffer: BytesMut,
    /// Of what has left the buffer.
    ends: Ends,
    /// What it was given of the memory for parts beyond the first.
    more_parts: Option<OwnedSemaphorePermit>,
    digest: Digesting,
    bytes: u64,
}

/// Where the digest of a blob comes from.
#[derive(Debug)]
enum Digesting {
    /// It is found here, while the bytes pass.
    Here(Sha256),
    /// Whoever made the bytes has found it.
    Known(String),
}

impl Default for Digesting {
    fn default() -> Self {
        Self::Here(Sha256::new())
    }
}

impl Digesting {
    fn pass(&mut self, bytes: &[u8]) {
        if let Self::Here(hasher) = self {
            hasher.update(bytes);
        }
    }

    /// It, in hexadecimal, when all bytes have passed.
    fn take(&mut self) -> String {
        match self {
            Self::Here(hasher) => hexadecimal(&std::mem::take(hasher).finalize()),
            Self::Known(sha256) => std::mem::take(sha256),
        }
    }
}

/// Blobs up to this size are kept in memory until they are whole, where there is room: that costs one visit to the store instead of one for each
/// part, and whoever needs the bytes at once need not read them again.
const MAX_WHOLE_BYTES: usize = 16 << 20;

impl BlobWriter {
    /// Adds bytes.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn write(&mut self, mut chunk: &[u8]) -> Result<(), StoreError> {
        self.digest.pass(chunk);
        self.bytes += chunk.len() as u64;
        while self.buffer.len() + chunk.len() > self.room() {
            if self.upload.is_none() && self.grow() {
                continue;
            }
            let (head, rest) = chunk.split_at(self.room() - self.buffer.len());
            self.buffer.extend_from_slice(head);
            chunk = rest;
            self.flush().await?;
        }
        self.buffer.extend_from_slice(chunk);
        Ok(())
    }

    /// Bytes that the buffer may have.
    fn room(&self) -> usize {
        let parts = 1 + self.more_parts.as_ref().map_or(0, OwnedSemaphorePermit::num_permits);
        parts * self.blobs.part_bytes
    }

    /// Makes room for another part. Gives whether there was memory for it.
    fn grow(&mut self) -> bool {
        if self.room() + self.blobs.part_bytes > MAX_WHOLE_BYTES {
            return false;
        }
        let Ok(part) = Arc::clone(&self.blobs.more_parts).try_acquire_owned() else { return false };
        match &mut self.more_parts {
            Some(parts) => parts.merge(part),
            None => self.more_parts = Some(part),
        }
        true
    }

    /// How many bytes there are so far.
    #[must_use]
    pub const fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Ends the blob. It is not visible yet.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn finish(mut self) -> Result<UnnamedBlob, StoreError> {
        if self.upload.is_some() {
            self.flush().await?;
        }
        let sha256 = self.digest.take();
        let blob = Blob { sha256, bytes: self.bytes };
        let content = match &mut self.upload {
            Some(upload) => {
                upload.parts.complete().await?;
                Content::Stored(upload.path.clone(), std::mem::take(&mut self.ends))
            }
            None => Content::InMemory(self.buffer.split().freeze(), self.more_parts.take()),
        };
        // Complete, so there is nothing to give up any more.
        self.upload = None;
        Ok(UnnamedBlob { blobs: self.blobs.clone(), content: Some(content), blob })
    }

    /// Hands on what is in the buffer, in parts of one size, which some stores insist on; only the last may be smaller.
    async fn flush(&mut self) -> Result<(), StoreError> {
        let upload = match &mut self.upload {
            Some(upload) => upload,
            none => none.insert(Upload::begin(&self.blobs).await?),
        };
        while !self.buffer.is_empty() {
            self.blobs.check_room()?;
            let part = self.buffer.split_to(self.buffer.len().min(self.blobs.part_bytes)).freeze();
            self.ends.pass(&part);
            upload.parts.put_part(PutPayload::from_bytes(part)).await?;
        }
        self.more_parts = None;
        Ok(())
    }
}

impl Drop for BlobWriter {
    fn drop(&mut self) {
        let (Some(mut upload), Ok(runtime)) = (self.upload.take(), tokio::runtime::Handle::try_current()) else {
            return;
        };
        // What this misses is removed when it is old.
        runtime.spawn(async move { upload.parts.abort().await });
    }
}

/// Where the bytes of an unnamed blob are.
#[derive(Debug)]
enum Content {
    /// With what it was given of the memory.
    InMemory(Bytes, #[expect(dead_code, reason = "held, never looked at")] Option<OwnedSemaphorePermit>),
    Stored(Path, Ends),
}

/// Complete bytes that have no name yet. Dropping it removes them.
#[derive(Debug)]
pub struct UnnamedBlob {
    blobs: Blobs,
    content: Option<Content>,
    blob: Blob,
}

impl UnnamedBlob {
    /// What its name will be.
    #[must_use]
    pub const fn blob(&self) -> &Blob {
        &self.blob
    }

    /// Its bytes, where they are few enough to be in memory.
    #[must_use]
    pub fn in_memory(&self) -> Option<Bytes> {
        match &self.content {
            Some(Content::InMemory(bytes, _)) => Some(bytes.clone()),
            _ => None,
        }
    }

    /// Its first mebibyte and, where there is more, its last bytes: enough to tell what it is.
    #[must_use]
    pub fn ends(&self) -> Cow<'_, [u8]> {
        match &self.content {
            Some(Content::InMemory(bytes, _)) => Ends::of(bytes),
            Some(Content::Stored(_, ends)) => Cow::Owned(ends.both()),
            None => Cow::Borrowed(&[]),
        }
    }

    /// Makes the blob durable and visible under its digest. To be called while `Store::hold_blobs` is held, until a record names
    /// the blob.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn keep(mut self) -> Result<Blob, StoreError> {
        let (blobs, name) = (&self.blobs, self.blobs.path(&self.blob.sha256));
        match &self.content {
            Some(Content::Stored(path, _)) => blobs.give_name(path, &name).await?,
            Some(Content::InMemory(bytes, _)) => blobs.put(bytes.clone(), &name).await?,
            None => {}
        }
        // It has its name, so there is nothing to remove any more.
        self.content = None;
        Ok(self.blob.clone())
    }
}

impl Drop for UnnamedBlob {
    fn drop(&mut self) {
        let (Some(Content::Stored(path, _)), Ok(runtime)) =
            (self.content.take(), tokio::runtime::Handle::try_current())
        else {
            return;
        };
        let store = self.blobs.store.clone();
        // What this misses is removed when it is old.
        runtime.spawn(async move { store.delete(&path).await });
    }
}
