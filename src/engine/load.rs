//! From named bytes to scenes.

use crate::{
    formats::{self, Format, Limits},
    model::{Control, Reporter, Scene},
};

use super::{Failure, NamedBytes, swapped_inputs};

/// A file that has been read.
pub(super) struct LoadedFile {
    pub(super) scene: Scene,
    pub(super) format: Format,
}

/// Reads one input; its warnings carry the part's name. Out of an archive comes the model that it holds.
pub(super) fn load(
    file: NamedBytes<'_>,
    part: &'static str,
    limits: &Limits,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<LoadedFile, Failure> {
    let mut own = Reporter::new();
    let refused = |error| swapped_inputs::explain_model(Failure::from(error).in_part(part), file);
    let (format, bytes) = formats::open(file.bytes, file.name, limits, control).map_err(refused)?;
    let scene = formats::read(&bytes, format, limits, control, &mut own).map_err(refused)?;
    reporter.absorb(part, own);
    Ok(LoadedFile { scene, format })
}
