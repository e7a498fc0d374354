//! Making files survive a power cut: their bytes before they get their name, and then the name.
//!
//! Only what is kept is written out. A disk takes a millisecond or more for each time, which would be most of what a small job costs;
//! several at the same time take hardly longer than one. Each file costs one visit to a thread that may wait.

use std::{
    fs::{self, File},
    io::{self, Write as _},
    path::{Path as FolderPath, PathBuf},
};

use bytes::Bytes;
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

    /// Moves a complete file to its name; both are on the disk then.
    pub(super) async fn give_name(&self, path: &Path, name: &Path) -> Result<(), StoreError> {
        let (root, file, name) = (self.root.clone(), self.root.join(path.as_ref()), self.root.join(name.as_ref()));
        wait_for(move || {
            File::options().write(true).open(&file)?.sync_all()?;
            fs::rename(file, name)?;
            write_folder_out(&root.join(COMPLETE))
        })
        .await
    }

    /// Puts bytes under their name; both are on the disk then. A file that has the name has the same bytes.
    pub(super) async fn put(&self, bytes: Bytes, name: &Path) -> Result<(), StoreError> {
        let (root, name) = (self.root.clone(), self.root.join(name.as_ref()));
        wait_for(move || {
            // Whoever put it there may not have written it out yet. Where they have, this costs nothing.
            match File::options().write(true).open(&name) {
                Ok(there) => there.sync_all()?,
                Err(_) => write_whole(&root.join(UNFINISHED).join(uuid::Uuid::now_v7().to_string()), &name, &bytes)?,
            }
            write_folder_out(&root.join(COMPLETE))
        })
        .await
    }
}

/// Writes a file out under another name before it gets its own, so that no crash leaves a part of it there.
fn write_whole(unfinished: &FolderPath, name: &FolderPath, bytes: &[u8]) -> io::Result<()> {
    let written = File::create_new(unfinished).and_then(|mut file| {
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(unfinished, name)
    });
    if written.is_err() {
        // What cannot be removed now is removed when it is old.
        let _ = fs::remove_file(unfinished);
    }
    written
}

async fn wait_for(work: impl FnOnce() -> io::Result<()> + Send + 'static) -> Result<(), StoreError> {
    let done = tokio::task::spawn_blocking(work).await.unwrap_or_else(|fault| Err(io::Error::other(fault)));
    Ok(done.map_err(|error| object_store::Error::Generic { store: "folder", source: Box::new(error) })?)
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
