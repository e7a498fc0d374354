//! Files in and out: inputs under their limit, outputs all or nothing.

use std::{
    fs::{self, File},
    io::{self, IsTerminal, Read, Write},
    path::{Component, Path, PathBuf},
    sync::atomic::{AtomicBool, Ordering},
};

use crate::{
    engine::NamedBytes,
    formats::{self, FormatError, Limits},
    model::Control,
};

use super::{
    exit::{BAD_USAGE, Exit, FAILED, INPUT_REFUSED, print_bytes},
    limits::hint_for_command_line,
    manner::speaks_json,
};

/// A file of the command line, read whole.
pub(super) struct InputFile {
    pub(super) path: PathBuf,
    name: String,
    bytes: Vec<u8>,
}

/// What stands for standard input and standard output.
const STANDARD: &str = "-";

/// Whether a path stands for standard input or standard output.
pub(super) fn is_standard(path: &Path) -> bool {
    path.as_os_str() == STANDARD
}

/// Standard input can be read once.
fn standard_input(part: &str, limits: &Limits) -> Result<Vec<u8>, Exit> {
    static IS_READ: AtomicBool = AtomicBool::new(false);
    if IS_READ.swap(true, Ordering::Relaxed) {
        let message = format!("{part} -: standard input is another input already");
        return Err(Exit::new(BAD_USAGE, message, "one input can come from there; name files for the others"));
    }
    let mut bytes = Vec::new();
    let failed = |error| Exit::new(INPUT_REFUSED, format!("{part} -: standard input cannot be read: {error}"), "");
    io::stdin().lock().take(limits.file_bytes.saturating_add(1)).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > limits.file_bytes {
        let message = format!("{part} -: more than {} bytes came from standard input", limits.file_bytes);
        return Err(Exit::new(INPUT_REFUSED, message, "send only the skeleton and its animation, or split the file"));
    }
    Ok(bytes)
}

impl InputFile {
    /// Reads a file; one that is larger than the limit is refused before it is read.
    pub(super) fn read(part: &str, path: &Path, limits: &Limits) -> Result<Self, Exit> {
        if is_standard(path) {
            return Ok(Self { path: path.to_owned(), name: String::new(), bytes: standard_input(part, limits)? });
        }
        let shown = path.display();
        let refused = |error: io::Error| {
            let (what, hint) = match error.kind() {
                io::ErrorKind::NotFound => {
                    ("there is no such file".to_owned(), "check the path; relative paths begin in the current folder")
                }
                io::ErrorKind::PermissionDenied => {
                    ("you may not read the file".to_owned(), "ask its owner, or copy it")
                }
                _ => (format!("the file cannot be read: {error}"), "check the disk or the network that it is on"),
            };
            Exit::new(INPUT_REFUSED, format!("{part} {shown}: {what}"), hint)
        };
        let too_large = |bytes: u64| {
            let most = limits.file_bytes;
            let message = format!("{part} {shown}: the file has {bytes} bytes where at most {most} are read");
            Exit::new(INPUT_REFUSED, message, "send only the skeleton and its animation, or split the file")
        };
        let file = File::open(path).map_err(refused)?;
        let metadata = file.metadata().map_err(refused)?;
        if metadata.is_dir() {
            return Err(Exit::new(
                INPUT_REFUSED,
                format!("{part} {shown}: this is a folder, not a file"),
                "name a file",
            ));
        }
        if metadata.len() > limits.file_bytes {
            return Err(too_large(metadata.len()));
        }
        // A pipe says nothing about its length, so the limit holds while reading as well.
        let mut bytes = Vec::new();
        file.take(limits.file_bytes.saturating_add(1)).read_to_end(&mut bytes).map_err(refused)?;
        if bytes.len() as u64 > limits.file_bytes {
            return Err(too_large(bytes.len() as u64));
        }
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        if formats::may_point_to_others(&bytes, &name) {
            bytes = with_neighbors(bytes, path, limits).map_err(|error| {
                let hint = hint_for_command_line(&error.detail, &error.hint);
                Exit::new(INPUT_REFUSED, format!("{part} {shown}: {}: {}", error.place, error.detail), hint)
            })?;
        }
        Ok(Self { path: path.to_owned(), name, bytes })
    }

    /// A file whose content comes from elsewhere, such as one that was made of those in a folder.
    pub(super) fn made(path: &Path, bytes: Vec<u8>) -> Self {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        Self { path: path.to_owned(), name, bytes }
    }

    pub(super) fn as_named(&self) -> NamedBytes<'_> {
        NamedBytes { name: &self.name, bytes: &self.bytes }
    }
}

/// A glTF with the buffers and images that lie beside it or below its folder; a file that is not there, or lies elsewhere, is
/// not opened.
fn with_neighbors(document: Vec<u8>, path: &Path, limits: &Limits) -> Result<Vec<u8>, FormatError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    formats::embed_with(&document, limits, &Control::new(), |name| {
        let below = Path::new(name);
        if !below.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) {
            return Ok(None);
        }
        let Ok(file) = File::open(folder.join(below)) else { return Ok(None) };
        let mut content = Vec::new();
        let read = file.take(limits.file_bytes.saturating_add(1)).read_to_end(&mut content);
        read.map_err(|error| FormatError::malformed("file", name, format!("it cannot be read: {error}")))?;
        if content.len() as u64 > limits.file_bytes {
            let detail = format!("the file is larger than the {} bytes that are read", limits.file_bytes);
            return Err(FormatError::malformed("file", name, detail));
        }
        Ok(Some(content))
    })
}

/// Finds out before the work whether a result has a place to go.
pub(super) fn check_place(path: &Path) -> Result<(), Exit> {
    if is_standard(path) {
        return match io::stdout().is_terminal() || speaks_json() {
            true => {
                let message = "output -: standard output is a terminal, or is to have the JSON object";
                Err(Exit::new(BAD_USAGE, message, "send it to a file or a pipe, without --json"))
            }
            false => Ok(()),
        };
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        let message = format!("output {}: there is no folder {}", path.display(), folder.display());
        return Err(Exit::new(BAD_USAGE, message, "make the folder first"));
    }
    if path.is_dir() {
        let message = format!("output {}: this is a folder, not a file", path.display());
        return Err(Exit::new(BAD_USAGE, message, "name a file in it"));
    }
    Ok(())
}

/// Files that are complete but not yet in their places; dropped before that, they leave nothing behind.
#[derive(Default)]
pub(super) struct StagedFiles {
    staged: Vec<(PathBuf, PathBuf)>,
    /// What goes to standard output, when everything else is in its place.
    standard: Vec<u8>,
}

impl StagedFiles {
    /// Writes one file, whole or not at all.
    pub(super) fn write_one(path: &Path, bytes: &[u8]) -> Result<(), Exit> {
        let mut staged = Self::default();
        staged.add(path, bytes)?;
        staged.commit()
    }

    /// Writes beside the place, so that the final rename stays within one file system.
    pub(super) fn add(&mut self, path: &Path, bytes: &[u8]) -> Result<(), Exit> {
        if is_standard(path) {
            self.standard.extend_from_slice(bytes);
            return Ok(());
        }
        let mut file = self.create(path)?;
        file.write_all(bytes).and_then(|()| file.sync_all()).map_err(|error| unwritable(path, &error))
    }

    /// A file beside the place, to be written until all are put in their places.
    pub(super) fn create(&mut self, path: &Path) -> Result<File, Exit> {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let temporary = path.with_file_name(format!(".{name}.{}.{}.part", std::process::id(), self.staged.len()));
        let file = File::create_new(&temporary).map_err(|error| unwritable(path, &error))?;
        self.staged.push((temporary, path.to_owned()));
        Ok(file)
    }

    /// Puts every file in its place.
    pub(super) fn commit(mut self) -> Result<(), Exit> {
        while let Some((temporary, path)) = self.staged.first() {
            fs::rename(temporary, path).map_err(|error| {
                Exit::new(FAILED, format!("output {}: the file cannot be put in place: {error}", path.display()), "")
            })?;
            self.staged.remove(0);
        }
        if self.standard.is_empty() { Ok(()) } else { print_bytes(&self.standard) }
    }
}

pub(super) fn unwritable(path: &Path, error: &io::Error) -> Exit {
    Exit::new(FAILED, format!("output {}: the file cannot be written: {error}", path.display()), "")
}

impl Drop for StagedFiles {
    fn drop(&mut self) {
        for (temporary, _) in &self.staged {
            // Nothing is left to be told about it; the name says what it is.
            let _ = fs::remove_file(temporary);
        }
    }
}
