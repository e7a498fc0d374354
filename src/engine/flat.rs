//! Files that are flat: the joints of a drawing, and the picture that a drawing shows or a file is.

use crate::{
    drawing::{CharacterSpec, PlanarRig},
    formats::{Format, Limits, sniff},
    model::Control,
    picture::{Picture, read_picture},
};

use super::{DrawingFiles, Failure, FailureCode, NamedBytes};

/// The rest of a name behind the folder of a drawing.
fn beside(folder: &str, name: &str) -> String {
    if folder.is_empty() { name.to_owned() } else { format!("{folder}/{name}") }
}

/// A drawing's character config, where the file is a drawing.
fn character(
    file: NamedBytes<'_>,
    limits: &Limits,
    control: &Control,
) -> Result<Option<(DrawingFiles, String)>, Failure> {
    if sniff(file.bytes, file.name) != Ok(Format::Drawing) {
        return Ok(None);
    }
    let files = DrawingFiles::unpack(file.bytes, limits, control)?;
    let folder = files.folder()?;
    Ok(Some((files, folder)))
}

/// The joints of a drawing, each with the place of the joint that it hangs on.
pub(super) type DrawnJoints = Vec<(String, Option<usize>)>;

/// The joints of a drawing; nothing where the file is none.
///
/// # Errors
/// When its files are not there or are broken.
pub(super) fn joints_of(
    file: NamedBytes<'_>,
    limits: &Limits,
    control: &Control,
) -> Result<Option<DrawnJoints>, Failure> {
    let Some((files, folder)) = character(file, limits, control)? else { return Ok(None) };
    let name = beside(&folder, "char_cfg.yaml");
    let bytes = files.find(&name).ok_or_else(|| files.missing(&name))?;
    let rig = CharacterSpec::read(&String::from_utf8_lossy(bytes)).and_then(|spec| PlanarRig::new(&spec));
    let rig = rig.map_err(|error| {
        let failure = Failure::new(FailureCode::InvalidValue, error.clone().in_file(&name).to_string());
        failure.in_part("source").with_hint(error.fix)
    })?;
    Ok(Some(rig.joint_names.into_iter().zip(rig.parents).collect()))
}

/// The picture that a file is, or that a drawing shows; nothing where it is neither.
///
/// # Errors
/// When it is broken.
pub(super) fn picture_of(file: NamedBytes<'_>, limits: &Limits, control: &Control) -> Result<Option<Picture>, Failure> {
    let read = |bytes: &[u8], name: &str| {
        read_picture(bytes).map_err(|error| Failure::new(FailureCode::AssetMalformed, format!("{name}: {error}")))
    };
    if matches!(file.bytes, [0x89, b'P', b'N', b'G', ..] | [b'R', b'I', b'F', b'F', ..] | [b'G', b'I', b'F', b'8', ..])
    {
        return read(file.bytes, file.name).map(Some);
    }
    let Some((files, folder)) = character(file, limits, control)? else { return Ok(None) };
    let of = |name: &str| {
        let name = beside(&folder, name);
        let bytes = files.find(&name).ok_or_else(|| files.missing(&name))?;
        read(bytes, &name)
    };
    let (mut texture, mask) = (of("texture.png")?, of("mask.png")?);
    for (pixel, mask) in texture.pixels.iter_mut().zip(&mask.pixels) {
        if mask[0] < 128 {
            pixel[3] = 0;
        }
    }
    Ok(Some(texture))
}
