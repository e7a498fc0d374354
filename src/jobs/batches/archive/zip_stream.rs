//! A zip archive that is written into memory and taken from there piece by piece, so that it can be sent while it is made.

use std::{
    io::{self, Write},
    mem,
    sync::{Arc, Mutex, PoisonError},
};

use bytes::Bytes;
use zip::{
    CompressionMethod, ZipWriter,
    write::{SimpleFileOptions, StreamWriter},
};

/// What was written and not taken yet.
#[derive(Clone, Debug, Default)]
struct Written(Arc<Mutex<Vec<u8>>>);

impl Written {
    fn take(&self) -> Bytes {
        mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner)).into()
    }
}

impl Write for Written {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The archive.
pub(super) struct ZipStream {
    zip: ZipWriter<StreamWriter<Written>>,
    written: Written,
}

impl Default for ZipStream {
    fn default() -> Self {
        let written = Written::default();
        Self { zip: ZipWriter::new_stream(written.clone()), written }
    }
}

impl ZipStream {
    /// Begins a member of that many bytes.
    ///
    /// # Errors
    /// When there is one of that name.
    pub(super) fn begin(&mut self, name: &str, bytes: u64) -> io::Result<()> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(bytes >= u64::from(u32::MAX));
        Ok(self.zip.start_file(name, options)?)
    }

    /// A member as a whole.
    ///
    /// # Errors
    /// When there is one of that name.
    pub(super) fn add(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        self.begin(name, bytes.len() as u64)?;
        self.write(bytes)
    }

    /// Adds bytes to the member that was begun last.
    ///
    /// # Errors
    /// When there are more than it was begun with room for.
    pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.zip.write_all(bytes)
    }

    /// What was written since it was last taken.
    pub(super) fn take(&self) -> Bytes {
        self.written.take()
    }

    /// Ends the archive with its directory; gives what is left of it.
    ///
    /// # Errors
    /// When the directory cannot be written.
    pub(super) fn finish(self) -> io::Result<Bytes> {
        self.zip.finish()?;
        Ok(self.written.take())
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Read};

    use super::*;

    #[test]
    fn what_is_taken_in_pieces_is_an_archive() {
        let mut stream = ZipStream::default();
        let mut all = Vec::new();
        for (name, text) in [("a/ü.txt", "one"), ("b.txt", "")] {
            stream.begin(name, text.len() as u64).expect("begins");
            for letter in text.as_bytes() {
                stream.write(&[*letter]).expect("writes");
                all.extend_from_slice(&stream.take());
            }
        }
        let rest = stream.take();
        assert!(!all.is_empty() && rest.len() < 200, "nothing gathers");
        all.extend_from_slice(&rest);
        all.extend_from_slice(&stream.finish().expect("ends"));
        let mut archive = zip::ZipArchive::new(Cursor::new(all)).expect("an archive");
        let mut text = String::new();
        archive.by_name("a/ü.txt").expect("is there").read_to_string(&mut text).expect("reads");
        assert_eq!((archive.len(), text.as_str()), (2, "one"), "whole");
    }
}
