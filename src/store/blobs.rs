//! Blobs: bytes named by their SHA-256.
//!
//! Bytes are written beside the blobs and moved to their name when they are complete and synced, so that a name never
//! stands for part of a file. The same code works on any [`ObjectStore`].

use std::{fmt::Write as _, path::Path as FolderPath, sync::Arc};

use bytes::{Bytes, BytesMut};
use futures::stream::BoxStream;
use object_store::{
    GetOptions, GetRange, MultipartUpload, ObjectStore, ObjectStoreExt, PutPayload, local::LocalFileSystem, path::Path,
};
use sha2::{Digest, Sha256};

use super::StoreError;

/// Bytes as they come.
pub type ByteStream = BoxStream<'static, Result<Bytes, object_store::Error>>;

/// Written to the store at once; small enough that many slow uploads do not fill the memory.
const PART_BYTES: usize = 1 << 20;

/// A blob's name and size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Blob {
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
    /// How many bytes.
    pub bytes: u64,
}

/// The blob store.
#[derive(Clone, Debug)]
pub struct Blobs {
    store: Arc<dyn ObjectStore>,
}

impl Blobs {
    /// Blobs in a folder: complete ones under `blobs`, unfinished ones under `tmp`.
    ///
    /// # Errors
    /// When the folder cannot be used.
    pub fn local(root: &FolderPath) -> Result<Self, StoreError> {
        let store = LocalFileSystem::new_with_prefix(root)?.with_fsync(true);
        Ok(Self { store: Arc::new(store) })
    }

    fn path(sha256: &str) -> Path {
        Path::from_iter(["blobs", sha256])
    }

    /// Begins a blob.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn begin(&self) -> Result<BlobWriter, StoreError> {
        let path = Path::from_iter(["tmp".to_owned(), uuid::Uuid::now_v7().to_string()]);
        let upload = self.store.put_multipart(&path).await?;
        let (buffer, hasher) = (BytesMut::new(), Sha256::new());
        Ok(BlobWriter { store: Arc::clone(&self.store), upload, path, buffer, hasher, bytes: 0 })
    }

    /// Writes a whole blob. It is visible only after [`UnnamedBlob::keep`].
    ///
    /// # Errors
    /// When the store fails.
    pub async fn write(&self, bytes: Bytes) -> Result<UnnamedBlob, StoreError> {
        let mut writer = self.begin().await?;
        // In pieces, so that hashing a large file does not hold a thread of the runtime for long.
        for piece in bytes.chunks(PART_BYTES) {
            writer.write(piece).await?;
        }
        writer.finish().await
    }

    /// All bytes of a blob.
    ///
    /// # Errors
    /// When it is not there or the store fails.
    pub async fn read(&self, sha256: &str) -> Result<Bytes, StoreError> {
        Ok(self.store.get(&Self::path(sha256)).await?.bytes().await?)
    }

    /// The bytes of a blob, or those of a range of it, as they are read.
    ///
    /// # Errors
    /// When it is not there or the store fails.
    pub async fn stream(&self, sha256: &str, range: Option<std::ops::Range<u64>>) -> Result<ByteStream, StoreError> {
        let options = GetOptions { range: range.map(GetRange::Bounded), ..GetOptions::default() };
        Ok(self.store.get_opts(&Self::path(sha256), options).await?.into_stream())
    }

    /// Whether a complete blob has that name.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn has(&self, sha256: &str) -> Result<bool, StoreError> {
        match self.store.head(&Self::path(sha256)).await {
            Ok(_) => Ok(true),
            Err(object_store::Error::NotFound { .. }) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    /// Removes a blob; it may be gone already.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn remove(&self, sha256: &str) -> Result<(), StoreError> {
        match self.store.delete(&Self::path(sha256)).await {
            Ok(()) | Err(object_store::Error::NotFound { .. }) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }
}

/// A blob that is being written. Dropping it leaves nothing.
#[derive(Debug)]
pub struct BlobWriter {
    store: Arc<dyn ObjectStore>,
    upload: Box<dyn MultipartUpload>,
    path: Path,
    buffer: BytesMut,
    hasher: Sha256,
    bytes: u64,
}

impl BlobWriter {
    /// Adds bytes.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn write(&mut self, chunk: &[u8]) -> Result<(), StoreError> {
        self.hasher.update(chunk);
        self.bytes += chunk.len() as u64;
        self.buffer.extend_from_slice(chunk);
        if self.buffer.len() >= PART_BYTES { self.flush().await } else { Ok(()) }
    }

    /// How many bytes there are so far.
    #[must_use]
    pub const fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Ends the blob and makes it durable, not yet visible.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn finish(mut self) -> Result<UnnamedBlob, StoreError> {
        self.flush().await?;
        self.upload.complete().await?;
        let sha256 = hexadecimal(&self.hasher.finalize());
        Ok(UnnamedBlob { store: self.store, path: Some(self.path), blob: Blob { sha256, bytes: self.bytes } })
    }

    async fn flush(&mut self) -> Result<(), StoreError> {
        if !self.buffer.is_empty() {
            let part = self.buffer.split().freeze();
            self.upload.put_part(PutPayload::from_bytes(part)).await?;
        }
        Ok(())
    }
}

/// Complete bytes that have no name yet. Dropping it removes them.
#[derive(Debug)]
pub struct UnnamedBlob {
    store: Arc<dyn ObjectStore>,
    path: Option<Path>,
    blob: Blob,
}

impl UnnamedBlob {
    /// What its name will be.
    #[must_use]
    pub const fn blob(&self) -> &Blob {
        &self.blob
    }

    /// Makes the blob visible under its digest. To be called while `Store::hold_blobs` is held, until a record names the blob.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn keep(mut self) -> Result<Blob, StoreError> {
        if let Some(path) = self.path.take() {
            self.store.rename(&path, &Blobs::path(&self.blob.sha256)).await?;
        }
        Ok(self.blob.clone())
    }
}

impl Drop for UnnamedBlob {
    fn drop(&mut self) {
        let (Some(path), Ok(runtime)) = (self.path.take(), tokio::runtime::Handle::try_current()) else { return };
        let store = Arc::clone(&self.store);
        // What this misses is cleared at the next start.
        runtime.spawn(async move { store.delete(&path).await });
    }
}

/// Bytes as lower-case hexadecimal digits.
fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::with_capacity(bytes.len() * 2), |mut text, byte| {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}
