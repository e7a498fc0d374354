//! Messages between a process and its parent: a JSON header, and bytes that belong to it.
//!
//! Both numbers of a header's line are little-endian: 4 bytes for the length of the header, 4 for how many blobs follow, then the header,
//! then each blob with 8 bytes for its length. No more is allocated because a number says so than one step: memory grows with what arrives.

use std::io::{self, Read, Write};

use serde::{Serialize, de::DeserializeOwned};

const MOST_HEADER_BYTES: u32 = 64 << 20;
const MOST_BLOBS: u32 = 64;
/// Bytes that are waited for at once.
const STEP_BYTES: usize = 1 << 20;

/// Writes one message.
pub(super) fn write(output: &mut impl Write, header: &impl Serialize, blobs: &[&[u8]]) -> io::Result<()> {
    let header = serde_json::to_vec(header)?;
    let (length, count) = (u32::try_from(header.len()), u32::try_from(blobs.len()));
    let (Ok(length), Ok(count)) = (length, count) else { return Err(io::Error::other("a message is too large")) };
    let mut head = Vec::with_capacity(8 + header.len());
    head.extend(length.to_le_bytes());
    head.extend(count.to_le_bytes());
    head.extend(header);
    output.write_all(&head)?;
    for blob in blobs {
        output.write_all(&(blob.len() as u64).to_le_bytes())?;
        output.write_all(blob)?;
    }
    output.flush()
}

/// Reads one message; `None` where the other side has ended.
pub(super) fn read<T: DeserializeOwned>(input: &mut impl Read) -> io::Result<Option<(T, Vec<Vec<u8>>)>> {
    let mut length = [0; 4];
    // The end is one only between messages.
    if input.read(&mut length[..1])? == 0 {
        return Ok(None);
    }
    input.read_exact(&mut length[1..])?;
    let mut count = [0; 4];
    input.read_exact(&mut count)?;
    let (length, count) = (u32::from_le_bytes(length), u32::from_le_bytes(count));
    if length > MOST_HEADER_BYTES || count > MOST_BLOBS {
        return Err(io::Error::new(io::ErrorKind::InvalidData, "a message is larger than any may be"));
    }
    let header = serde_json::from_slice(&read_bytes(input, u64::from(length))?)?;
    let mut blobs = Vec::new();
    for _ in 0..count {
        let mut length = [0; 8];
        input.read_exact(&mut length)?;
        blobs.push(read_bytes(input, u64::from_le_bytes(length))?);
    }
    Ok(Some((header, blobs)))
}

fn read_bytes(input: &mut impl Read, length: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    loop {
        let (arrived, left) = (bytes.len(), length - bytes.len() as u64);
        if left == 0 {
            return Ok(bytes);
        }
        bytes.resize(arrived + usize::try_from(left).unwrap_or(STEP_BYTES).min(STEP_BYTES), 0);
        input.read_exact(&mut bytes[arrived..])?;
    }
}
