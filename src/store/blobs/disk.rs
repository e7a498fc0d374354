//! Making files survive a power cut: their bytes before they get their name, and then the name.
//!
//! Only what is kept is written out. A disk takes a millisecond or more for each time, which would be most of what a small job costs;
//! several at the same time take hardly longer than one.

use std::{
    fs::{self, File},
    io,
    path::{Path as FolderPath, PathBuf},
};

use object_store::path::Path;

use super::{COMPLETE, UNFINISHED};
use crate::store::StoreError;

/// The folder that blobs are kept in.
#[derive(Clone, Debug)]
pub(super) struct Disk {
    root: PathBuf,
}

impl Disk {
    /// Makes the folders where they are not there.
    pub(super) fn make(root: PathBuf) -> Result<Self, StoreError> {
        let made = [COMPLETE, UNFINISHED].into_iter().try_for_each(|name| fs::create_dir_all(root.join(name)));
        made.and_then(|()| write_folder_out(&root))
            .map_err(|error| StoreError::Folder { folder: root.display().to_string(), reason: error.to_string() })?;
        Ok(Self { root })
    }

    /// Waits until the bytes of a file are on the disk.
    pub(super) async fn write_out(&self, path: &Path) -> Result<(), StoreError> {
        let file = self.root.join(path.as_ref());
        self.wait_for(move || File::options().write(true).open(file)?.sync_all()).await
    }

    /// Waits until the names of all complete blobs are on the disk.
    pub(super) async fn write_names_out(&self) -> Result<(), StoreError> {
        let folder = self.root.join(COMPLETE);
        self.wait_for(move || write_folder_out(&folder)).await
    }

    async fn wait_for(&self, work: impl FnOnce() -> io::Result<()> + Send + 'static) -> Result<(), StoreError> {
        let done = tokio::task::spawn_blocking(work).await.unwrap_or_else(|fault| Err(io::Error::other(fault)));
        Ok(done.map_err(|error| object_store::Error::Generic { store: "folder", source: Box::new(error) })?)
    }
}

#[cfg(unix)]
fn write_folder_out(folder: &FolderPath) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

/// Folders cannot be opened here; the file system orders changes of names itself.
#[cfg(not(unix))]
fn write_folder_out(_: &FolderPath) -> io::Result<()> {
    Ok(())
}
