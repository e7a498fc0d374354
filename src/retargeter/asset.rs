//! A file that a program hands over.

use crate::engine::NamedBytes;

/// A file in memory, and the one that has its rest pose where it does not hold it itself.
#[derive(Clone, Copy, Debug)]
pub struct Asset<'a> {
    pub(super) file: NamedBytes<'a>,
    pub(super) rest: Option<NamedBytes<'a>>,
}

impl<'a> Asset<'a> {
    /// A file by its name, of which only the ending matters, and its content.
    #[must_use]
    pub const fn new(name: &'a str, bytes: &'a [u8]) -> Self {
        Self { file: NamedBytes { name, bytes }, rest: None }
    }

    /// The same with a file that has the rig in its rest pose.
    #[must_use]
    pub const fn with_rest(self, name: &'a str, bytes: &'a [u8]) -> Self {
        Self { rest: Some(NamedBytes { name, bytes }), ..self }
    }
}
