//! Changes that know nothing of what the bytes mean.

use super::Random;

/// Whole numbers at which lengths, counts and offsets go wrong.
const WHOLE: [u64; 16] = [
    0,
    1,
    2,
    3,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0xffff,
    0x0001_0000,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x1_0000_0000,
    u64::MAX / 2,
    u64::MAX,
];
/// Bits of single-precision numbers at which arithmetic goes wrong.
const SINGLE: [f32; 10] =
    [0.0, -0.0, 1.0, f32::MIN_POSITIVE, 1e-40, f32::MAX, f32::MIN, f32::INFINITY, f32::NAN, 16_777_216.0];
const MAX_REPEATED_BYTES: usize = 4096;

/// The input with one change; `other` is another one, of which pieces may be taken over.
pub(crate) fn change_bytes(input: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut changed = input.to_vec();
    let Some(at) = random.index(changed.len()) else { return other.to_vec() };
    match random.below(9) {
        0 => changed[at] ^= 1 << random.below(8),
        1 => changed[at] = random.next() as u8,
        2 => changed.truncate(at),
        3 => {
            let number = WHOLE[random.below(WHOLE.len())].to_le_bytes();
            overwrite(&mut changed, at, &number[..1 << random.below(4)]);
        }
        4 => {
            let number = SINGLE[random.below(SINGLE.len())];
            // Arrays begin where their numbers are aligned.
            overwrite(&mut changed, at / 4 * 4, &number.to_le_bytes());
        }
        5 => {
            let end = at + random.below(changed.len() - at + 1);
            changed.drain(at..end);
        }
        6 => {
            let end = at + random.below(changed.len() - at + 1);
            let piece = changed[at..end].repeat(1 + random.below(8));
            let piece = &piece[..piece.len().min(MAX_REPEATED_BYTES)];
            changed.splice(at..at, piece.iter().copied());
        }
        7 => {
            // The beginning of one and the end of another.
            let from = random.below(other.len() + 1);
            changed.truncate(at);
            changed.extend(&other[from..]);
        }
        _ => {
            let from = random.below(other.len() + 1);
            let piece = &other[from..other.len().min(from + 64)];
            overwrite(&mut changed, at, piece);
        }
    }
    changed
}

fn overwrite(bytes: &mut [u8], at: usize, with: &[u8]) {
    let length = with.len().min(bytes.len() - at);
    bytes[at..at + length].copy_from_slice(&with[..length]);
}
