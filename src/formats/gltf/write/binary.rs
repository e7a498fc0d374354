//! The bytes of the one buffer of an output, as pieces that are copied once, at the end.

use std::borrow::Cow;

/// Where every piece of the buffer begins: floats and the data of compressed views need four.
const ALIGNMENT: usize = 4;

/// A buffer in pieces.
#[derive(Debug, Default)]
pub(super) struct Binary<'a> {
    pieces: Vec<Cow<'a, [u8]>>,
    length: usize,
}

impl<'a> Binary<'a> {
    /// Adds a piece and says at which byte it begins.
    pub(super) fn push(&mut self, piece: Cow<'a, [u8]>) -> usize {
        let offset = self.length.next_multiple_of(ALIGNMENT);
        let padding = offset - self.length;
        if padding > 0 {
            self.pieces.push(Cow::Borrowed(&[0; ALIGNMENT][..padding]));
        }
        self.length = offset + piece.len();
        self.pieces.push(piece);
        offset
    }

    /// Number of bytes, without padding at the end.
    pub(super) const fn length(&self) -> usize {
        self.length
    }

    /// The pieces in order, padding included.
    pub(super) fn pieces(&self) -> impl Iterator<Item = &[u8]> {
        self.pieces.iter().map(Cow::as_ref)
    }
}
