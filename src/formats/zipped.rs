//! What bounds every zip archive that is read, whatever is in it.

use std::io::Read;

use zip::{CompressionMethod, read::ZipFile, result::ZipError};

use super::{Budget, ErrorKind, FormatError, Limit};

/// Members are unpacked in pieces of this size, so that a canceled job ends soon.
pub(super) const CHUNK_BYTES: usize = 1 << 20;
/// What repeats one value packs beyond any ratio; below this size that does no harm.
const RATIO_FREE_BYTES: u64 = 8 << 20;

/// Whether the directory of an archive has more entries than `most`. The zip reader allocates for every one of them, so they are
/// counted before it starts.
pub(super) fn has_more_members_than(most: usize, bytes: &[u8]) -> bool {
    bytes.windows(4).filter(|window| *window == b"PK\x01\x02").take(most + 1).count() > most
}

/// Refuses a member that is packed in a way that we cannot unpack.
pub(super) fn check_method<R: Read>(member: &ZipFile<'_, R>, place: &str) -> Result<(), FormatError> {
    let method = member.compression();
    if matches!(method, CompressionMethod::Stored | CompressionMethod::Deflated) {
        return Ok(());
    }
    let detail = format!("the member is packed by the method {method}, which cannot be unpacked");
    Err(FormatError::unsupported("container", place, detail, "pack it again with deflate, or without compression"))
}

/// Refuses an archive that unpacks to far more than its size.
pub(super) fn check_ratio(
    unpacked_bytes: u64,
    archive_bytes: u64,
    budget: &Budget<'_>,
    place: &str,
) -> Result<(), FormatError> {
    if unpacked_bytes <= RATIO_FREE_BYTES {
        return Ok(());
    }
    budget.check(Limit::DecompressionRatio, unpacked_bytes / archive_bytes.max(1), place)
}

pub(super) fn zip_error(error: &ZipError, place: &str) -> FormatError {
    let kind = match error {
        ZipError::UnsupportedArchive(_) | ZipError::CompressionMethodNotSupported(_) | ZipError::InvalidPassword => {
            ErrorKind::UnsupportedFeature
        }
        _ => ErrorKind::Malformed,
    };
    FormatError {
        kind,
        phase: "container",
        place: place.to_owned(),
        detail: format!("the archive cannot be unpacked: {error}"),
        hint: "save it again with numpy.savez or numpy.savez_compressed".into(),
    }
}
