//! Messages between a process and its parent: a JSON header, and bytes that belong to it.
//!
//! All numbers are little-endian: 4 bytes for the length of the header, 4 for how many blobs there are, 8 for the length of each, then the
//! header, then the blobs. A message is written at once, so that who reads it wakes up once. No more is allocated because a number says so
//! than one step: memory grows with what arrives.

use std::io::{self, IoSlice, Read, Write};

use serde::{Serialize, de::DeserializeOwned};
use sha2::{Digest, Sha256};

use crate::store::hexadecimal;

const MAX_HEADER_BYTES: u32 = 64 << 20;
const MAX_BLOBS: u32 = 64;
/// Bytes that are waited for at once.
const STEP_BYTES: usize = 1 << 20;
/// And where they are digested meanwhile.
const DIGESTED_BYTES: usize = 128 << 10;

/// Writes one message.
pub(super) fn write(output: &mut impl Write, header: &impl Serialize, blobs: &[&[u8]]) -> io::Result<()> {
    let header = serde_json::to_vec(header)?;
    let (length, count) = (u32::try_from(header.len()), u32::try_from(blobs.len()));
    let (Ok(length), Ok(count)) = (length, count) else { return Err(io::Error::other("a message is too large")) };
    let mut head = Vec::with_capacity(8 + 8 * blobs.len() + header.len());
    head.extend(length.to_le_bytes());
    head.extend(count.to_le_bytes());
    blobs.iter().for_each(|blob| head.extend((blob.len() as u64).to_le_bytes()));
    head.extend(header);
    let mut pieces: Vec<IoSlice<'_>> = [head.as_slice()].iter().chain(blobs).map(|piece| IoSlice::new(piece)).collect();
    write_pieces(output, &mut pieces)?;
    output.flush()
}

fn write_pieces(output: &mut impl Write, mut pieces: &mut [IoSlice<'_>]) -> io::Result<()> {
    // Takes away empty ones.
    IoSlice::advance_slices(&mut pieces, 0);
    while !pieces.is_empty() {
        match output.write_vectored(pieces) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(count) => IoSlice::advance_slices(&mut pieces, count),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

/// Bytes and their SHA-256.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Digested {
    pub(super) bytes: Vec<u8>,
    pub(super) sha256: String,
}

/// Reads one message; `None` where the other side has ended.
pub(super) fn read<T: DeserializeOwned>(input: &mut impl Read) -> io::Result<Option<(T, Vec<Vec<u8>>)>> {
    read_message(input, u64::MAX, |input, length| read_bytes(input, length, STEP_BYTES, |_| ()))
}

/// The same, with digests, which are found while the other side still writes, and of no more than `most_bytes` of blobs in all.
pub(super) fn read_digested<T: DeserializeOwned>(
    input: &mut impl Read,
    most_bytes: u64,
) -> io::Result<Option<(T, Vec<Digested>)>> {
    read_message(input, most_bytes, |input, length| {
        let mut hasher = Sha256::new();
        let bytes = read_bytes(input, length, DIGESTED_BYTES, |bytes| hasher.update(bytes))?;
        Ok(Digested { bytes, sha256: hexadecimal(&hasher.finalize()) })
    })
}

fn read_message<T: DeserializeOwned, R: Read, B>(
    input: &mut R,
    most_bytes: u64,
    read_blob: impl Fn(&mut R, u64) -> io::Result<B>,
) -> io::Result<Option<(T, Vec<B>)>> {
    let mut length = [0; 4];
    // The end is one only between messages.
    if input.read(&mut length[..1])? == 0 {
        return Ok(None);
    }
    input.read_exact(&mut length[1..])?;
    let mut count = [0; 4];
    input.read_exact(&mut count)?;
    let (length, count) = (u32::from_le_bytes(length), u32::from_le_bytes(count));
    if length > MAX_HEADER_BYTES || count > MAX_BLOBS {
        return Err(io::Error::new(io::ErrorKind::InvalidData, "a message is larger than any may be"));
    }
    let mut lengths = Vec::new();
    for _ in 0..count {
        let mut length = [0; 8];
        input.read_exact(&mut length)?;
        lengths.push(u64::from_le_bytes(length));
    }
    if lengths.iter().fold(0, |sum: u64, length| sum.saturating_add(*length)) > most_bytes {
        return Err(io::Error::new(io::ErrorKind::InvalidData, "a message has more bytes than it may"));
    }
    let header = serde_json::from_slice(&read_bytes(input, u64::from(length), STEP_BYTES, |_| ())?)?;
    let blobs = lengths.into_iter().map(|length| read_blob(input, length)).collect::<io::Result<_>>()?;
    Ok(Some((header, blobs)))
}

/// Reads that many bytes, `step` of them at once, each of which `pass` sees.
fn read_bytes(input: &mut impl Read, length: u64, step: usize, mut pass: impl FnMut(&[u8])) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    loop {
        let (arrived, left) = (bytes.len(), length - bytes.len() as u64);
        if left == 0 {
            return Ok(bytes);
        }
        let step = usize::try_from(left).unwrap_or(step).min(step);
        if bytes.capacity() < arrived + step {
            bytes.reserve(usize::try_from(left).unwrap_or(STEP_BYTES).min(STEP_BYTES));
        }
        if input.take(step as u64).read_to_end(&mut bytes)? < step {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        pass(&bytes[arrived..]);
    }
}
