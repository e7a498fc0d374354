//! NumPy's own containers: one array (`.npy`) and an archive of arrays (`.npz`). Knows no layout.

mod archive;
mod array;
pub(in crate::formats) mod npy;

pub(in crate::formats) use archive::Archive;
pub(in crate::formats) use array::{NumberArray, Values};

use super::FormatError;

/// An array that breaks the rules of its container or of the layout.
pub(in crate::formats) fn invalid(place: impl Into<String>, detail: impl Into<String>) -> FormatError {
    FormatError::malformed("arrays", place, detail)
        .with_hint("compare the file with the pose arrays layout in the documentation")
}
