//! From named bytes to scenes.

use std::borrow::Cow;

use crate::{
    formats::{self, Format, Limits},
    model::{Control, Reporter, Scene},
};

use super::{Failure, NamedBytes, mixups};

/// A file that has been read.
pub(super) struct Loaded {
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
) -> Result<Loaded, Failure> {
    let mut own = Reporter::new();
    let refused = |error| mixups::explain_model(Failure::from(error).in_part(part), file);
    let mut format = formats::sniff(file.bytes, file.name).map_err(refused)?;
    let mut bytes = Cow::Borrowed(file.bytes);
    if format == Format::Zip {
        let model = formats::unpack(file.bytes, limits, control).map_err(refused)?;
        format = formats::sniff(&model.bytes, &model.name).map_err(refused)?;
        bytes = Cow::Owned(model.bytes);
    }
    let scene = formats::read(&bytes, format, limits, control, &mut own).map_err(refused)?;
    reporter.absorb(part, own);
    Ok(Loaded { scene, format })
}
