//! The zip archive of arrays (`.npz`): its members, unpacked under a budget. Knows no key.

use std::io::{Cursor, Read};

use zip::ZipArchive;

use crate::formats::{
    Budget, FormatError, Limit,
    zipped::{CHUNK_BYTES, check_method, check_ratio, has_more_members_than, zip_error},
};

use super::{NumberArray, invalid, npy};

/// An archive of any layout has some twenty members; the directory of one with more is not even built.
const MAX_MEMBERS: usize = 1024;

/// Reads the members of one archive. No member is ever written anywhere.
pub(in crate::formats) struct Archive<'bytes, 'budget, 'limits> {
    zip: ZipArchive<Cursor<&'bytes [u8]>>,
    keys: Vec<String>,
    archive_bytes: u64,
    decoded_bytes: u64,
    budget: &'budget mut Budget<'limits>,
}

impl<'bytes, 'budget, 'limits> Archive<'bytes, 'budget, 'limits> {
    pub(in crate::formats) fn open(
        bytes: &'bytes [u8],
        budget: &'budget mut Budget<'limits>,
    ) -> Result<Self, FormatError> {
        if has_more_members_than(MAX_MEMBERS, bytes) {
            return Err(invalid("archive", format!("the archive has more than {MAX_MEMBERS} members")));
        }
        let zip = ZipArchive::new(Cursor::new(bytes)).map_err(|error| zip_error(&error, "archive"))?;
        let key = |name: &[u8]| {
            let name = String::from_utf8_lossy(name);
            name.strip_suffix(".npy").unwrap_or(&name).to_owned()
        };
        let keys = zip.file_names_raw().map(key).collect();
        Ok(Self { zip, keys, archive_bytes: bytes.len() as u64, decoded_bytes: 0, budget })
    }

    /// The names of the arrays, in the order of the archive.
    pub(in crate::formats) fn keys(&self) -> &[String] {
        &self.keys
    }

    /// The numbers of a member.
    pub(in crate::formats) fn numbers(&mut self, index: usize) -> Result<NumberArray, FormatError> {
        let (header, data) = self.member(index)?;
        npy::numbers(&header, &data, &self.keys[index])
    }

    /// The shape and the texts of a member.
    pub(in crate::formats) fn strings(&mut self, index: usize) -> Result<(Vec<usize>, Vec<String>), FormatError> {
        let (header, data) = self.member(index)?;
        let strings = npy::strings(&header, &data, &self.keys[index])?;
        Ok((header.shape, strings))
    }

    /// The header of a member and exactly as many bytes as it declares, all paid for before they are read.
    fn member(&mut self, index: usize) -> Result<(npy::Header, Vec<u8>), FormatError> {
        let key = self.keys[index].as_str();
        let mut member = self.zip.by_index(index).map_err(|error| zip_error(&error, key))?;
        check_method(&member, key)?;
        let zip_bytes = member.size();
        let header = npy::read_header(&mut member, key)?;
        let too_large = || invalid(key, format!("the shape {:?} is larger than any memory", header.shape));
        let data_bytes = header.data_bytes().ok_or_else(too_large)?;
        let decoded_bytes = header.decoded_bytes().ok_or_else(too_large)?;

        self.budget.take(Limit::DecodedBytes, data_bytes as u64, key)?;
        self.budget.take(Limit::DecodedBytes, decoded_bytes as u64, key)?;
        self.decoded_bytes += data_bytes as u64;
        check_ratio(self.decoded_bytes, self.archive_bytes, self.budget, key)?;
        if zip_bytes != header.header_bytes + data_bytes as u64 {
            return Err(invalid(
                key,
                format!(
                    "the shape {:?} asks for {data_bytes} bytes, but the member holds {zip_bytes} with its header",
                    header.shape
                ),
            ));
        }

        let mut data = vec![0; data_bytes];
        for chunk in data.chunks_mut(CHUNK_BYTES) {
            self.budget.check_canceled()?;
            member.read_exact(chunk).map_err(|error| invalid(key, format!("the array cannot be unpacked: {error}")))?;
        }
        // The checksum is compared when the end is reached, so the end must be asked for.
        match member.read(&mut [0]) {
            Ok(0) => Ok((header, data)),
            Ok(_) => Err(invalid(key, "there are bytes after the end of the array")),
            Err(error) => Err(invalid(key, format!("the array cannot be unpacked: {error}"))),
        }
    }
}
