//! Blobs: bytes named by their SHA-256, in a local folder or in an S3-compatible store.
//!
//! A name never stands for part of a file. Large blobs are written in parts beside the others and moved to their name when they are
//! complete; small ones are put there at once by stores that make a whole object visible in one step.

mod disk;
mod ends;
mod place;
mod room;
mod writer;

pub use place::BlobPlace;
pub use writer::{Blob, BlobWriter, UnnamedBlob};

use std::{path::Path as FolderPath, sync::Arc, time::Duration};

use bytes::Bytes;
use futures::{
    StreamExt as _,
    future::ready,
    stream::{BoxStream, TryStreamExt as _},
};
use jiff::Timestamp;
use object_store::{
    GetOptions, GetRange, ObjectMeta, ObjectStore, ObjectStoreExt,
    path::Path,
    signer::{SignedUrlOptions, Signer},
};
use tokio::sync::Semaphore;

use super::StoreError;
use disk::Disk;
use room::Room;

/// The folder of complete ones.
const COMPLETE: &str = "blobs";
/// The folder of those that are being written.
const UNFINISHED: &str = "tmp";

/// Bytes as they come.
pub type ByteStream = BoxStream<'static, Result<Bytes, object_store::Error>>;

/// The blob store. Cheap to clone; all clones are the same.
#[derive(Clone, Debug)]
pub struct Blobs {
    store: Arc<dyn ObjectStore>,
    signer: Option<Arc<dyn Signer>>,
    /// What makes them durable where they are files.
    disk: Option<Disk>,
    /// What stands before every name. May be empty.
    prefix: Path,
    /// Bytes that are written to the store at once; small enough that many slow uploads do not fill the memory.
    part_bytes: usize,
    /// Parts that blobs may have in memory beyond their first one, all together.
    more_parts: Arc<Semaphore>,
    /// What bounds them where they lie on a disk.
    room: Option<Room>,
}

impl Blobs {
    /// Blobs in a folder: complete ones under `blobs`, unfinished ones under `tmp`.
    ///
    /// # Errors
    /// When the folder cannot be used.
    pub fn local(root: &FolderPath) -> Result<Self, StoreError> {
        Self::at(&BlobPlace::Folder(root.to_owned()))
    }

    /// The same blobs, which leave that many bytes of their disk free. Without meaning where they lie on none.
    #[must_use]
    pub fn leaving_free(self, reserved_bytes: u64) -> Self {
        Self { room: self.room.map(|room| room.leaving_free(reserved_bytes)), ..self }
    }

    /// What is free on the disk of a folder, where the disk says so.
    #[must_use]
    pub fn free_bytes(&self) -> Option<u64> {
        self.room.as_ref()?.free_bytes()
    }

    /// Whether there is room for more.
    ///
    /// # Errors
    /// [`StoreError::NoRoom`] when what is left of the disk is reserved.
    pub fn check_room(&self) -> Result<(), StoreError> {
        self.room.as_ref().map_or(Ok(()), Room::check)
    }

    fn path(&self, sha256: &str) -> Path {
        self.prefix.clone().join(COMPLETE).join(sha256)
    }

    /// All bytes of a blob.
    ///
    /// # Errors
    /// When it is not there or the store fails.
    pub async fn read(&self, sha256: &str) -> Result<Bytes, StoreError> {
        Ok(self.store.get(&self.path(sha256)).await?.bytes().await?)
    }

    /// The bytes of a blob, or those of a range of it, as they are read.
    ///
    /// # Errors
    /// When it is not there or the store fails.
    pub async fn stream(&self, sha256: &str, range: Option<std::ops::Range<u64>>) -> Result<ByteStream, StoreError> {
        let options = GetOptions { range: range.map(GetRange::Bounded), ..GetOptions::default() };
        Ok(self.store.get_opts(&self.path(sha256), options).await?.into_stream())
    }

    /// A URL from which anybody who has it can get the blob for `period`, with that `Content-Disposition`; `None` where the store has none to
    /// give.
    ///
    /// # Errors
    /// When the store's credentials cannot be had.
    pub async fn signed_url(
        &self,
        sha256: &str,
        content_disposition: &str,
        period: Duration,
    ) -> Result<Option<String>, StoreError> {
        let Some(signer) = &self.signer else { return Ok(None) };
        let options = SignedUrlOptions::new().with_query([("response-content-disposition", content_disposition)]);
        let url = signer.signed_url_opts(place::GET, &self.path(sha256), period, &options).await?;
        Ok(Some(url.to_string()))
    }

    /// Whether a complete blob has that name.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn has(&self, sha256: &str) -> Result<bool, StoreError> {
        match self.store.head(&self.path(sha256)).await {
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
        self.remove_object(&self.path(sha256)).await
    }

    async fn remove_object(&self, path: &Path) -> Result<(), StoreError> {
        match self.store.delete(path).await {
            Ok(()) | Err(object_store::Error::NotFound { .. }) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// The names of all blobs that were written before that time.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn written_before(&self, time: Timestamp) -> Result<Vec<String>, StoreError> {
        let found = self.older(COMPLETE, time).await?;
        Ok(found.iter().filter_map(|object| object.location.filename().map(str::to_owned)).collect())
    }

    /// Removes what was being written before that time and has not been finished.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn remove_unfinished_before(&self, time: Timestamp) -> Result<(), StoreError> {
        for object in self.older(UNFINISHED, time).await? {
            self.remove_object(&object.location).await?;
        }
        Ok(())
    }

    async fn older(&self, folder: &str, time: Timestamp) -> Result<Vec<ObjectMeta>, StoreError> {
        let is_older = |object: &ObjectMeta| object.last_modified.timestamp_millis() < time.as_millisecond();
        let listed = self.store.list(Some(&self.prefix.clone().join(folder)));
        Ok(listed.try_filter(|object| ready(is_older(object))).boxed().try_collect().await?)
    }
}
