//! Where blobs are kept.

use std::{path::PathBuf, sync::Arc, time::Duration};

use object_store::{
    ClientConfigKey, RetryConfig,
    aws::{AmazonS3Builder, AmazonS3ConfigKey},
    local::LocalFileSystem,
    path::Path,
};
use tokio::sync::Semaphore;

use super::{Blobs, disk::Disk, room::Room};
use crate::store::StoreError;

/// The method of requests that signed URLs are for.
pub(super) const GET: http::Method = http::Method::GET;

/// Where blobs are kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BlobPlace {
    /// A folder. Several processes may share one, on one machine or on a network drive.
    Folder(PathBuf),
    /// A bucket of an S3-compatible store.
    S3 {
        /// The bucket.
        bucket: String,
        /// What stands before every name in it. May be empty.
        prefix: String,
    },
}

const KNOWN: &str = "s3://BUCKET/PREFIX, file:///FOLDER, or nothing for the data folder";

impl BlobPlace {
    /// Reads `s3://BUCKET/PREFIX` or `file:///FOLDER`.
    ///
    /// # Errors
    /// [`StoreError::UnknownScheme`] for everything else.
    pub fn parse(url: &str) -> Result<Self, StoreError> {
        if let Some(folder) = url.strip_prefix("file://").filter(|folder| folder.starts_with('/')) {
            return Ok(Self::Folder(PathBuf::from(folder)));
        }
        let (bucket, prefix) =
            url.strip_prefix("s3://").map_or(("", ""), |rest| rest.split_once('/').unwrap_or((rest, "")));
        if bucket.is_empty() {
            return Err(StoreError::UnknownScheme { what: "blob store", known: KNOWN });
        }
        Ok(Self::S3 { bucket: bucket.to_owned(), prefix: prefix.to_owned() })
    }
}

impl Blobs {
    /// The blobs of a place. For S3, the endpoint, the region and the credentials come from where every S3 client looks for them:
    /// the `AWS_…` variables, a web identity, or the machine's role.
    ///
    /// # Errors
    /// When the place cannot be used.
    pub fn at(place: &BlobPlace) -> Result<Self, StoreError> {
        match place {
            BlobPlace::Folder(root) => {
                let disk = Disk::make(root.clone())?;
                let store = LocalFileSystem::new_with_prefix(root)?;
                Ok(Self {
                    store: Arc::new(store),
                    signer: None,
                    disk: Some(disk),
                    prefix: Path::default(),
                    part_bytes: 1 << 20,
                    more_parts: Arc::new(Semaphore::new(64)),
                    room: Some(Room::on(root.clone())),
                })
            }
            BlobPlace::S3 { bucket, prefix } => {
                let retry =
                    RetryConfig { max_retries: 4, retry_timeout: Duration::from_secs(15), ..RetryConfig::default() };
                let store = AmazonS3Builder::from_env()
                    .with_bucket_name(bucket)
                    .with_retry(retry)
                    .with_config(AmazonS3ConfigKey::Client(ClientConfigKey::ConnectTimeout), "5s")
                    .build()?;
                let store = Arc::new(store);
                Ok(Self {
                    signer: Some(Arc::clone(&store) as _),
                    store,
                    disk: None,
                    prefix: Path::parse(prefix).map_err(object_store::Error::from)?,
                    // The least that S3 takes as a part which is not the last.
                    part_bytes: 5 << 20,
                    more_parts: Arc::new(Semaphore::new(12)),
                    room: None,
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_and_everything_else_is_refused() {
        let s3 = |bucket: &str, prefix: &str| BlobPlace::S3 { bucket: bucket.to_owned(), prefix: prefix.to_owned() };
        for (url, place) in [
            ("s3://clips", s3("clips", "")),
            ("s3://clips/a/b", s3("clips", "a/b")),
            ("file:///srv/blobs", BlobPlace::Folder(PathBuf::from("/srv/blobs"))),
        ] {
            assert_eq!(BlobPlace::parse(url).expect("a place"), place, "{url}");
        }
        for url in ["", "s3://", "s3:///a", "file://relative", "gs://clips", "/srv/blobs"] {
            assert!(BlobPlace::parse(url).is_err(), "{url:?} is no place");
        }
    }
}
