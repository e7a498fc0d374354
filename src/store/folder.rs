//! The data folder: where things lie in it, and that only one process writes to it.

use std::{
    fs::{self, File, TryLockError},
    path::{Path, PathBuf},
};

use super::StoreError;

/// A data folder that this process alone writes to, for as long as the value lives.
#[derive(Debug)]
pub struct DataFolder {
    root: PathBuf,
    _lock: File,
}

impl DataFolder {
    /// Takes the folder, makes it where it is not there, and clears what unfinished uploads left.
    ///
    /// # Errors
    /// [`StoreError::Locked`] when another process has it; [`StoreError::Folder`] when it cannot be written to.
    pub fn take(root: &Path) -> Result<Self, StoreError> {
        let failed = |error: std::io::Error| StoreError::Folder {
            folder: root.display().to_string(),
            reason: error.to_string(),
        };
        fs::create_dir_all(root).map_err(failed)?;
        keep_from_others(root);
        let lock = File::create(root.join("lock")).map_err(failed)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(StoreError::Locked(root.display().to_string())),
            Err(TryLockError::Error(error)) => return Err(failed(error)),
        }
        let folder = Self { root: root.to_owned(), _lock: lock };
        if folder.uploads().exists() {
            fs::remove_dir_all(folder.uploads()).map_err(failed)?;
        }
        fs::create_dir_all(folder.uploads()).map_err(failed)?;
        fs::create_dir_all(folder.blobs()).map_err(failed)?;
        Ok(folder)
    }

    /// The folder itself.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The database file.
    #[must_use]
    pub fn database(&self) -> PathBuf {
        Self::database_in(&self.root)
    }

    /// The database file of a data folder that may be somebody else's.
    #[must_use]
    pub fn database_in(root: &Path) -> PathBuf {
        root.join("state.db")
    }

    /// Where complete blobs lie.
    #[must_use]
    pub fn blobs(&self) -> PathBuf {
        self.root.join("blobs")
    }

    /// Where blobs lie while they are written.
    #[must_use]
    pub fn uploads(&self) -> PathBuf {
        self.root.join("tmp")
    }
}

/// Shuts other users of the machine out: files of callers and secrets of webhooks lie there. A folder that is another user's, such as a
/// volume that somebody has prepared, stays as it is.
#[cfg(unix)]
fn keep_from_others(root: &Path) {
    use std::os::unix::fs::PermissionsExt as _;
    if let Err(error) = fs::set_permissions(root, fs::Permissions::from_mode(0o700)) {
        tracing::warn!(folder = %root.display(), %error, "other users of this machine may be able to read the data folder");
    }
}

#[cfg(not(unix))]
fn keep_from_others(_: &Path) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn nobody_else_looks_into_a_data_folder() {
        use std::os::unix::fs::PermissionsExt as _;
        let root = tempfile::tempdir().expect("a temporary folder");
        fs::set_permissions(root.path(), fs::Permissions::from_mode(0o755)).expect("it is ours");
        let _folder = DataFolder::take(root.path()).expect("nobody has it");
        let mode = fs::metadata(root.path()).expect("it is there").permissions().mode();
        assert_eq!(mode & 0o777, 0o700, "others are shut out");
    }

    #[test]
    fn a_folder_has_one_writer_and_unfinished_uploads_are_cleared() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let first = DataFolder::take(root.path()).expect("nobody has it");
        fs::write(first.uploads().join("half"), b"half").expect("a file");
        let second = DataFolder::take(root.path());
        assert!(matches!(second, Err(StoreError::Locked(_))), "taken: {second:?}");
        drop(first);
        let again = DataFolder::take(root.path()).expect("free again");
        assert!(!again.uploads().join("half").exists(), "cleared at start");
    }
}
