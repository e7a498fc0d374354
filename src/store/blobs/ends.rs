//! The ends of a blob: enough of it to tell what it is, whether or not it is still in memory.

use std::borrow::Cow;

/// The first and the last bytes of a blob, enough to tell what it is.
#[derive(Debug, Default)]
pub(super) struct Ends {
    head: Vec<u8>,
    tail: Vec<u8>,
}

impl Ends {
    /// Everything but JSON says in its first bytes what it is.
    const HEAD_BYTES: usize = 1 << 20;
    /// Archives have their directory at the end.
    const TAIL_BYTES: usize = 64 << 10;

    /// Those of a blob that is there as a whole.
    pub(super) fn of(bytes: &[u8]) -> Cow<'_, [u8]> {
        if bytes.len() <= Self::HEAD_BYTES {
            return Cow::Borrowed(bytes);
        }
        let mut ends = Self::default();
        ends.pass(bytes);
        Cow::Owned(ends.both())
    }

    /// Takes note of the bytes that come next.
    pub(super) fn pass(&mut self, bytes: &[u8]) {
        let (head, rest) = bytes.split_at(bytes.len().min(Self::HEAD_BYTES - self.head.len()));
        self.head.extend_from_slice(head);
        self.tail.extend_from_slice(&rest[rest.len().saturating_sub(Self::TAIL_BYTES)..]);
        self.tail.drain(..self.tail.len().saturating_sub(Self::TAIL_BYTES));
    }

    /// Both, one behind the other.
    pub(super) fn both(&self) -> Vec<u8> {
        [self.head.as_slice(), &self.tail].concat()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_of_a_blob_are_the_same_however_it_came() {
        let bytes: Vec<u8> = (0..2_000_000_u32).map(|index| (index % 251) as u8).collect();
        let expected = [&bytes[..Ends::HEAD_BYTES], &bytes[bytes.len() - Ends::TAIL_BYTES..]].concat();
        for piece in [1000, 300_000, bytes.len()] {
            let mut ends = Ends::default();
            bytes.chunks(piece).for_each(|piece| ends.pass(piece));
            assert!(ends.both() == expected, "in pieces of {piece}");
        }
        assert!(*Ends::of(&bytes) == expected, "as a whole");
        let mut ends = Ends::default();
        ends.pass(&bytes[..Ends::HEAD_BYTES + 3]);
        assert!(ends.both() == bytes[..Ends::HEAD_BYTES + 3], "little behind the head is all there");
    }
}
