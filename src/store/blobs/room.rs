//! How much of the disk files leave to the records.
//!
//! A full disk stops a database also where something is to be removed, since that is written down first. So files stop before the
//! disk is full: what is left is enough to end the jobs that there are, and to remove what is not needed.

use std::path::PathBuf;

use crate::store::StoreError;

/// A folder, and how much of its disk is left to others.
#[derive(Clone, Debug)]
pub(super) struct Room {
    folder: PathBuf,
    reserved_bytes: u64,
}

impl Room {
    /// All of the disk.
    pub(super) const fn on(folder: PathBuf) -> Self {
        Self { folder, reserved_bytes: 0 }
    }

    pub(super) fn leaving_free(self, reserved_bytes: u64) -> Self {
        Self { reserved_bytes, ..self }
    }

    /// What is free, where the disk says so.
    pub(super) fn free_bytes(&self) -> Option<u64> {
        free_bytes(&self.folder)
    }

    /// Whether more may be written. A disk that does not say how full it is is written to until it fails.
    ///
    /// # Errors
    /// [`StoreError::NoRoom`].
    pub(super) fn check(&self) -> Result<(), StoreError> {
        let Some(free_bytes) = free_bytes(&self.folder) else { return Ok(()) };
        if free_bytes < self.reserved_bytes {
            let (folder, reserved_bytes) = (self.folder.display().to_string(), self.reserved_bytes);
            return Err(StoreError::NoRoom { folder, free_bytes, reserved_bytes });
        }
        Ok(())
    }
}

#[cfg(unix)]
fn free_bytes(folder: &std::path::Path) -> Option<u64> {
    let disk = rustix::fs::statvfs(folder).ok()?;
    Some(disk.f_bavail.saturating_mul(disk.f_frsize))
}

#[cfg(not(unix))]
fn free_bytes(_: &std::path::Path) -> Option<u64> {
    None
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn what_is_reserved_is_left_alone() {
        let folder = std::env::temp_dir();
        assert!(Room::on(folder.clone()).check().is_ok(), "nothing is reserved");
        let refused = Room::on(folder.clone()).leaving_free(u64::MAX).check().expect_err("no disk is that large");
        assert!(refused.is_storage_full(), "it is said as what it is: {refused}");
        assert!(Room::on(folder.join("absent")).leaving_free(u64::MAX).check().is_ok(), "what does not say is tried");
    }
}
