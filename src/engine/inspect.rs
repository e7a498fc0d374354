//! What a file holds, as users see it.

use std::fmt;

use serde::Serialize;

use crate::{
    engine::{Failure, NamedBytes},
    formats::Limits,
    model::Control,
};

/// What a file holds.
#[derive(Clone, Debug, Serialize)]
pub struct Inspection {
    /// Wire name of the format.
    pub format: &'static str,
}

impl fmt::Display for Inspection {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(formatter, "format: {}", self.format)
    }
}

/// Reads a file and says what it holds.
///
/// # Errors
/// When the file cannot be read.
pub fn inspect(file: NamedBytes<'_>, limits: &Limits, control: &Control) -> Result<Inspection, Failure> {
    let _ = (file, limits, control);
    todo!("wired when the rig module lands")
}
