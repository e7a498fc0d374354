//! Files that are flat: what a drawing holds, and what drawings and pictures look like, small.

use crate::{
    drawing::{CharacterSpec, PlanarRig},
    formats::{Format, Limits, sniff},
    model::{Control, Phase},
    picture::{Background, Picture, PictureFormat, Reel, read_picture},
};

use super::{
    DrawingFiles, Failure, FailureCode, Inspection, InspectionCounts, JointView, NamedBytes, Preview, PreviewOptions,
    RigView, labels::ByRole,
};

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

/// What a drawing holds; nothing where the file is none.
///
/// # Errors
/// When its files are not there or are broken.
pub(super) fn inspected(
    file: NamedBytes<'_>,
    limits: &Limits,
    control: &Control,
) -> Result<Option<Inspection>, Failure> {
    let Some((files, folder)) = character(file, limits, control)? else { return Ok(None) };
    let name = beside(&folder, "char_cfg.yaml");
    let bytes = files.find(&name).ok_or_else(|| files.missing(&name))?;
    let broken = |detail: String, hint: String| {
        Failure::new(FailureCode::InvalidValue, detail).in_part("source").with_hint(hint)
    };
    let spec = CharacterSpec::read(&String::from_utf8_lossy(bytes))
        .and_then(|spec| PlanarRig::new(&spec).map(|rig| (spec, rig)))
        .map_err(|error| broken(error.clone().in_file(&name).to_string(), error.fix))?;
    let (_, rig) = spec;
    let joints: Vec<JointView> = rig
        .joint_names
        .iter()
        .enumerate()
        .map(|(node, name)| JointView { name: name.clone(), node, parent: rig.parents[node] })
        .collect();
    let rig = RigView {
        name: "drawing".to_owned(),
        recognised_as: None,
        confidence: 1.0,
        kind: "drawing",
        rest_pose: "other",
        measured_pose: "other",
        rest_source: "nodes",
        rest_reason: "a drawing rests as it is drawn".to_owned(),
        forward: None,
        up: None,
        height_metres: 0.0,
        joints,
        roles: ByRole(Vec::new()),
        role_details: ByRole(Vec::new()),
        twist_helpers: Vec::new(),
        twists: Vec::new(),
        props: Vec::new(),
        template: None,
    };
    let nodes = rig.joints.len();
    Ok(Some(Inspection {
        format: Format::Drawing.info().name,
        counts: InspectionCounts { nodes, joints: nodes, skins: 0, clips: 0 },
        rigs: vec![rig],
        clips: Vec::new(),
        findings: Vec::new(),
        warnings: Vec::new(),
    }))
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

/// A picture in the size and the format that is asked for, in the middle of its background.
///
/// # Errors
/// When it cannot be encoded.
pub(super) fn shown(picture: &Picture, options: &PreviewOptions, control: &Control) -> Result<Preview, Failure> {
    control.enter(Phase::Write, 1);
    let [width, height] = options.view.size;
    let background = match options.view.background {
        Background::Light => [236, 236, 236, 255],
        Background::Dark => [32, 33, 36, 255],
        Background::Transparent => [0; 4],
    };
    let mut shown = Picture::filled(width, height, background);
    let scale = (width as f64 / picture.width as f64).min(height as f64 / picture.height as f64);
    let size = [picture.width, picture.height].map(|side| ((side as f64 * scale) as usize).max(1));
    let (left, top) = (width.saturating_sub(size[0]) / 2, height.saturating_sub(size[1]) / 2);
    for row in 0..size[1].min(height) {
        for column in 0..size[0].min(width) {
            let color = mean(picture, [column, row], size);
            let pixel = &mut shown.pixels[(top + row) * width + left + column];
            let share = u32::from(color[3]);
            if pixel[3] == 0 {
                *pixel = color;
                continue;
            }
            for (part, new) in pixel[..3].iter_mut().zip(color) {
                *part = ((u32::from(new) * share + u32::from(*part) * (255 - share) + 127) / 255) as u8;
            }
        }
    }
    let format = PictureFormat::of_ending(&options.ending, false).ok_or_else(|| {
        Failure::new(FailureCode::UnsupportedFormat, format!("'{}' is no picture that can be written", options.ending))
    })?;
    super::preview::check_built(format)?;
    let failed = |error: crate::picture::PictureError| Failure::new(FailureCode::Internal, error.to_string());
    let bytes = if format.moves() {
        let is_transparent = background[3] == 0;
        let mut reel = Reel::new(format, [width, height], 1.0, 1, is_transparent, |_| shown.clone()).map_err(failed)?;
        reel.add(std::slice::from_ref(&shown)).map_err(failed)?;
        reel.finish().map_err(failed)?
    } else {
        shown.to_still(format).map_err(failed)?
    };
    Ok(Preview { bytes, format, size: [width, height], frames: 1, sights: Vec::new(), warnings: Vec::new() })
}

/// The mean color of what a pixel of another size covers, by opacity.
fn mean(picture: &Picture, [column, row]: [usize; 2], size: [usize; 2]) -> [u8; 4] {
    let range = |at: usize, of: usize, all: usize| {
        let begin = at * all / of;
        begin..((at + 1) * all / of).clamp(begin + 1, all.max(begin + 1))
    };
    let (mut sums, mut count) = ([0_u64; 4], 0);
    for row in range(row, size[1], picture.height) {
        for column in range(column, size[0], picture.width) {
            let color = picture.pixels[row * picture.width + column];
            let opacity = u64::from(color[3]);
            (0..3).for_each(|part| sums[part] += u64::from(color[part]) * opacity);
            sums[3] += opacity;
            count += 1;
        }
    }
    let part = |sum: u64| (sum / sums[3].max(1)) as u8;
    [part(sums[0]), part(sums[1]), part(sums[2]), (sums[3] / count.max(1)) as u8]
}
