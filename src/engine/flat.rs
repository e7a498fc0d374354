//! Files that are flat: what a drawing holds, and the picture that a drawing shows or a file is.

use serde::Serialize;

use crate::{
    drawing::{CharacterSpec, JointSpec, PlanarRig, joints_outside, mask_parts},
    formats::{Format, Limits, is_picture, sniff},
    model::Control,
    picture::{Picture, read_picture},
};

use super::{DrawingFiles, Failure, FailureCode, NamedBytes, WarningView};

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
    let files = DrawingFiles::read(file, limits, control)?;
    let folder = files.folder()?;
    Ok(Some((files, folder)))
}

/// What a drawing holds, beside its joints.
#[derive(Clone, Debug, Serialize)]
pub struct DrawingFacts {
    /// Width and height of the texture and the mask in pixels.
    pub size: [usize; 2],
    /// Pixels of the figure.
    pub mask_pixels: usize,
    /// Parts of the mask that do not touch one another.
    pub mask_parts: usize,
    /// Joints that nothing hangs on: hands, feet, the head and the like.
    pub ends: Vec<String>,
    /// Joints outside the mask; they are moved into it.
    pub joints_outside: Vec<String>,
    /// The kind of body that was found, where the file is a picture alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub annotated: Option<&'static str>,
    /// Where its joints are, each after its parent.
    pub joints: Vec<JointSpec>,
}

/// A drawing that was looked at.
pub(super) struct LookedAt {
    pub(super) rig: PlanarRig,
    pub(super) facts: DrawingFacts,
    /// How sure the joints are.
    pub(super) confidence: f64,
    pub(super) warnings: Vec<WarningView>,
}

/// What a drawing holds; nothing where the file is none.
///
/// # Errors
/// When its files are not there or are broken.
pub(super) fn look_at(file: NamedBytes<'_>, limits: &Limits, control: &Control) -> Result<Option<LookedAt>, Failure> {
    let Some((files, folder)) = character(file, limits, control)? else { return Ok(None) };
    let find = |name: &str| {
        let name = beside(&folder, name);
        files.find(&name).ok_or_else(|| files.missing(&name))
    };
    let name = beside(&folder, "char_cfg.yaml");
    let refused = |error: crate::drawing::DrawingError| {
        let failure = Failure::new(FailureCode::InvalidValue, error.clone().in_file(&name).to_string());
        failure.in_part("source").with_hint(error.fix)
    };
    let spec = CharacterSpec::read(&String::from_utf8_lossy(find("char_cfg.yaml")?)).map_err(refused)?;
    let rig = PlanarRig::new(&spec).map_err(refused)?;
    let mask = picture(find("mask.png")?, &beside(&folder, "mask.png"))?;
    let texture = picture(find("texture.png")?, &beside(&folder, "texture.png"))?;
    let annotation = files.annotation();
    let mut warnings = annotation.map_or_else(Vec::new, |annotation| annotation.warnings.clone());
    for (name, picture) in [("texture.png", &texture), ("mask.png", &mask)] {
        if [picture.width, picture.height] != [spec.width as usize, spec.height as usize] {
            warnings.push(WarningView {
                code: "drawing_size",
                place: beside(&folder, name),
                detail: format!(
                    "{} by {} pixels, where the config says {} by {}",
                    picture.width, picture.height, spec.width, spec.height
                ),
                hint: "give all three the same size; as it is, it cannot be drawn".to_owned(),
            });
        }
    }
    let outside = joints_outside(&mask, &spec);
    if !outside.is_empty() {
        warnings.push(WarningView {
            code: "drawing_joint_outside",
            place: beside(&folder, "mask.png"),
            detail: format!("{} outside the mask", outside.join(", ")),
            hint: "they are moved into it where the drawing moves; paint the mask over them, or move them".to_owned(),
        });
    }
    let (mask_pixels, mask_parts) = mask_parts(&mask);
    let is_parent = |joint: usize| rig.parents.contains(&Some(joint));
    let facts = DrawingFacts {
        size: [texture.width, texture.height],
        mask_pixels,
        mask_parts,
        ends: (0..rig.parents.len())
            .filter(|joint| !is_parent(*joint))
            .map(|joint| rig.joint_names[joint].clone())
            .collect(),
        joints_outside: outside,
        annotated: annotation.map(|annotation| annotation.rig),
        joints: joints_of(&spec, &rig),
    };
    let confidence = annotation.map_or(1.0, |annotation| annotation.confidence);
    Ok(Some(LookedAt { rig, facts, confidence, warnings }))
}

/// The joints of a character config in the order of the rig.
fn joints_of(spec: &CharacterSpec, rig: &PlanarRig) -> Vec<JointSpec> {
    let of_name = |name: &String| spec.skeleton.iter().find(|joint| joint.name == *name);
    rig.joint_names.iter().filter_map(of_name).cloned().collect()
}

fn picture(bytes: &[u8], name: &str) -> Result<Picture, Failure> {
    read_picture(bytes).map_err(|error| Failure::new(FailureCode::AssetMalformed, format!("{name}: {error}")))
}

/// The picture that a file is, or that a drawing shows; nothing where it is neither.
///
/// # Errors
/// When it is broken.
pub(super) fn picture_of(file: NamedBytes<'_>, limits: &Limits, control: &Control) -> Result<Option<Picture>, Failure> {
    if is_picture(file.bytes) || file.bytes.starts_with(b"GIF8") {
        return picture(file.bytes, file.name).map(Some);
    }
    let Some((files, folder)) = character(file, limits, control)? else { return Ok(None) };
    let of = |name: &str| {
        let name = beside(&folder, name);
        let bytes = files.find(&name).ok_or_else(|| files.missing(&name))?;
        picture(bytes, &name)
    };
    let (mut texture, mask) = (of("texture.png")?, of("mask.png")?);
    for (pixel, mask) in texture.pixels.iter_mut().zip(&mask.pixels) {
        if mask[0] < 128 {
            pixel[3] = 0;
        }
    }
    Ok(Some(texture))
}
