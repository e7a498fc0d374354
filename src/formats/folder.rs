//! A folder of files as one archive, and back.

use std::io::{Cursor, Write};

use zip::{CompressionMethod, ZipWriter, result::ZipError, write::SimpleFileOptions};

use crate::model::Control;

use super::{Budget, FormatError, Limits, bundle::Archive, zipped::zip_error};

/// A file with its path.
type Member = (String, Vec<u8>);

/// The files of an archive whose endings are wanted, by their paths with slashes; hidden ones are left out.
///
/// # Errors
/// When the archive is broken or larger than the limits allow.
pub fn unpack_files(
    bytes: &[u8],
    endings: &[&str],
    limits: &Limits,
    control: &Control,
) -> Result<Vec<Member>, FormatError> {
    let mut budget = Budget::new(limits, control);
    let mut archive = Archive::open(bytes, &mut budget)?;
    let is_wanted = |name: &&String| {
        let is_hidden = name.split('/').any(|part| part.starts_with('.') || part == "__MACOSX");
        let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
        !is_hidden && ending.is_some_and(|ending| endings.contains(&ending.as_str()))
    };
    let names: Vec<String> = archive.names.iter().filter(is_wanted).cloned().collect();
    let mut members = Vec::with_capacity(names.len());
    for name in names {
        let content = archive.read(&name)?;
        members.push((name, content));
    }
    members.sort();
    Ok(members)
}

/// Files as an archive that is the same for the same files; not compressed, since pictures are already.
///
/// # Errors
/// When the archive cannot be made.
pub fn pack_files<'a>(files: impl IntoIterator<Item = (&'a str, &'a [u8])>) -> Result<Vec<u8>, FormatError> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in files {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(zip::DateTime::default());
        zip.start_file(name, options).map_err(|error| zip_error(&error, name))?;
        zip.write_all(content).map_err(|error| zip_error(&ZipError::Io(error), name))?;
    }
    Ok(zip.finish().map_err(|error| zip_error(&error, "archive"))?.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_come_back_and_others_are_left_out() {
        let files =
            [("a/char_cfg.yaml", &b"x: 1"[..]), ("a/.hidden.yaml", b""), ("a/notes.txt", b"no"), ("mask.PNG", b"p")];
        let packed = pack_files(files).expect("packed");
        let back = unpack_files(&packed, &["yaml", "png"], &Limits::default(), &Control::new()).expect("unpacked");
        let names: Vec<&str> = back.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["a/char_cfg.yaml", "mask.PNG"]);
        assert_eq!(back[0].1, b"x: 1");
    }
}
