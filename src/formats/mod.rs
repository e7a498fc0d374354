//! Bytes to [`Scene`] and back.
//!
//! Each format is one folder (or file) with `read` and `write`, of one shape each: bytes, a [`Budget`] and a [`Reporter`] to a
//! [`Scene`]; a [`Scene`], a [`Clip`] of its skeleton and [`WriteOptions`] to bytes. Readers take untrusted bytes: every count is
//! checked against the [`Budget`] before anything is allocated for it, nothing recurses on input, nothing panics. Knows no rig and
//! no algorithm; touches no file, no network, no clock.
//!
//! # How to add a format
//!
//! Say it is called *acme*. In this order the compiler and the tests lead the way:
//!
//! 1. **Name it.** A variant of [`Format`], its row in [`Format::info`] (wire name, endings, media type, whether it is read and
//!    written, one line for people, which axes, unit and tracks a file has), and its place in [`Format::ALL`]. `GET /v1/formats`, `Accept`, the endings of `--output`, and the
//!    table of `docs/reference/formats.md` come from that row. The compiler names every `match` that has to know it; most need one word.
//! 2. **Recognize it.** Its first bytes in [`sniff`], with a test there; the name of a file only decides between what bytes
//!    cannot tell apart.
//! 3. **Read it.** `acme/read.rs`: take from the budget before allocating, report every repair and guess with
//!    [`Reporter::warn`], and fail with a [`FormatError`] that has a place and a hint. Say axes and unit in [`Scene::axes`] and
//!    [`Scene::unit_meters`], `None` where the file does not know; mark joints as the file does; keep what the writer needs to
//!    give the rest of the file back in [`Scene::payload`]. Then a line in [`read()`].
//! 4. **Write it**, where that is of use: `acme/write.rs` and a line in [`write()`]. What a format cannot hold is a warning, never
//!    silence. Meshes that other formats are to hold go to them by `meshes.rs` (`written::meshes`). Which axes and unit it wants, its row says.
//! 5. **Explain it.** New warnings go into `docs/reference/warnings.md` (a test lists those that are not there). Then
//!    `RETARGETD_UPDATE=1 cargo nextest run -E 'test(documents) | test(openapi)'` writes the tables and the API again.
//! 6. **Prove it.** Beside the code: exact small files by hand. In `tests/it/formats_acme.rs`: files cut short at every byte, counts
//!    too large, NaN, cycles, and a round trip. In `tests/it/readers`: every real file against another reader, node by
//!    node and clip by clip. In `tests/it/judges`: what others make of what we write. In `tests/fuzz/src/shared`: a target, and seeds
//!    that hold what is special about it. In `benches/reading.rs`: how fast, beside another reader.

mod appearance;
mod body_model;
pub mod budget;
mod bundle;
mod bvh;
mod display;
mod error;
mod euler;
mod fbx;
mod folder;
mod format;
mod gltf;
mod humanoid;
mod json_size;
mod meshes;
mod named_arrays;
mod numpy;
mod pose_frames;
mod poses;
mod positions_csv;
mod sections;
mod sniff;
mod space;
mod written;
mod zipped;

pub use appearance::appearance;
pub use budget::{Budget, Limit, Limits};
pub use bundle::{Unpacked, embed_with, may_point_to_others, open, unpack};
pub use display::write_display;
pub use error::{ErrorKind, FormatError};
pub use euler::EulerOrder;
pub use folder::{pack_files, unpack_files};
pub use format::{Format, FormatInfo, Space};
pub use humanoid::Humanoid;
pub use json_size::JsonSize;
pub use named_arrays::{Elements, NamedArray, Numbers, read_numbers, write_arrays};
pub use pose_frames::{FrameArrays, FrameArraysMut, PoseFrames};
pub use sections::{ClipTimes, ReadSeek, SectionWriter, Sectioned, SectionedFile, WriteSeek, open_in_sections};
pub use sniff::{DRAWING_FILES, is_picture, sniff};

use glam::{Quat, Vec3};

use crate::model::{
    Axes, Clip, Control, MorphMesh, MorphPlace, Reporter, Scene, Stretched, joints_stretched_in, straightened_clip,
};

/// A glTF document and its buffer as a GLB.
///
/// # Errors
/// When that has more than 4 GiB.
pub fn glb_file(document: &serde_json::Value, binary: &[u8]) -> Result<Vec<u8>, FormatError> {
    gltf::contain(document.to_string().as_bytes(), binary.len(), std::iter::once(binary))
}

/// Whether a file that is written of a target holds the weights of one of its morphs.
#[must_use]
pub fn holds_morph(target: &Scene, morph: usize, format: Format, include: Include) -> bool {
    match format {
        Format::PosesNpz | Format::PosesJson | Format::Vrma => true,
        Format::Fbx => include == Include::Everything && fbx::holds_morph(target, morph),
        // Without a mesh there is nothing that could have a weight.
        format if format.holds_gltf() => {
            let place = target.morphs.get(morph).map(|morph| &morph.place);
            let is_of_gltf = !matches!(place, None | Some(MorphPlace::Weight | MorphPlace::Property));
            include == Include::Everything && (is_of_gltf || fbx::holds_morph(target, morph))
        }
        _ => false,
    }
}

/// Whether a file that is written of a target holds the pose that its meshes were bound in: with the meshes, or as a VRMA, which is written of the
/// rig's rest pose.
pub(crate) fn says_bind_pose(target: &Scene, options: &WriteOptions) -> bool {
    let info = options.format.info();
    let has_meshes = fbx::has_document(target) || (info.has_document && gltf::has_document(target));
    options.format == Format::Vrma || (info.has_skins && options.include == Include::Everything && has_meshes)
}

/// Decodes a file.
///
/// `format` comes from [`sniff`]. Every index in the result is in range and every
/// number finite; [`Scene::axes`] and [`Scene::unit_meters`] say what space it is in.
///
/// # Errors
/// When the bytes are not of that format, break its rules, or exceed the budget; or when the work is canceled.
pub fn read(
    bytes: &[u8],
    format: Format,
    limits: &Limits,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Scene, FormatError> {
    read_within(bytes, format, &mut Budget::new(limits, control), reporter)
}

/// As [`read`], within a budget that says afterwards how much of it was spent.
///
/// # Errors
/// As [`read`].
pub(crate) fn read_within(
    bytes: &[u8],
    format: Format,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Scene, FormatError> {
    budget.take(Limit::FileBytes, bytes.len() as u64, "file")?;
    match format {
        Format::Zip => {
            // Whatever comes out is no archive again.
            let (format, model) = open(bytes, "", budget.limits(), budget.control())?;
            read_within(&model, format, budget, reporter)
        }
        Format::Glb | Format::Gltf | Format::Vrm | Format::Vrma => gltf::read(bytes, format, budget, reporter),
        Format::Fbx => fbx::read(bytes, budget, reporter),
        Format::Bvh => bvh::read(bytes, budget, reporter),
        Format::PosesNpz | Format::PosesJson => poses::read(bytes, format, budget, reporter),
        Format::BodyModel => body_model::read_archive(bytes, budget, reporter),
        Format::JointPositions => body_model::read_array(bytes, budget, reporter),
        Format::PositionsCsv => {
            Err(FormatError::unsupported("read", "", "positions in CSV are written, not read", "send pose arrays"))
        }
        Format::Drawing => Err(FormatError::unsupported(
            "read",
            "",
            "this is a drawing and no figure in space",
            "send it as the target of POST /v1/drawings, or as --drawing of 'retargetd draw'",
        )),
        Format::Png
        | Format::Webp
        | Format::Gif
        | Format::Apng
        | Format::Mp4
        | Format::PngZip
        | Format::Poses2dNpz
        | Format::Poses2dJson => Err(FormatError::unsupported(
            "read",
            "",
            "a picture is not an animation",
            "send a file that GET /v1/formats lists as read",
        )),
    }
}

/// What the curves of a scene's clip say at rising times on the clip's own clock.
///
/// Nothing where the file has no curves, or where those say the same as straight lines between the clip's frames.
///
/// # Errors
/// When a curve gives a number that is not finite, the limits that the file was read under are exceeded, or the work is canceled.
pub fn evaluated(
    scene: &Scene,
    clip: usize,
    times_seconds: &[f64],
    control: &Control,
) -> Result<Option<Clip>, FormatError> {
    fbx::evaluated(scene, clip, times_seconds, control)
}

/// Gives joints that a scale stretches lengths of their own; for formats whose viewers multiply matrices.
fn straighten(scene: Scene, budget: &mut Budget<'_>, reporter: &mut Reporter) -> Result<Scene, FormatError> {
    budget.check_canceled()?;
    let malformed = |error: crate::model::ClipError| FormatError::malformed("nodes", "", error.to_string());
    let frames: usize = scene.clips.iter().map(Clip::frame_count).sum();
    let Some(plan) = Stretched::of(&scene.skeleton) else { return straighten_clips(scene, budget, reporter) };
    let sampled = (plan.joint_count() as u64).saturating_mul(frames as u64);
    budget.take_array(sampled, size_of::<(Vec3, Quat, Vec3)>() as u64, "clips")?;
    let count = plan.joint_count();
    let scene = plan.straighten(scene).map_err(malformed)?;
    reporter.warn(
        "stretched_skeleton",
        "",
        format!(
            "{count} joints lie below a scale that differs by axis; they are moved as joints that keep their lengths, and the \
             nodes that a viewer stretches are animated so that they do"
        ),
        "apply the scale of the armature before exporting",
    );
    Ok(scene)
}

/// Puts the joints of clips where viewers see them that multiply matrices, in clips that stretch them.
fn straighten_clips(mut scene: Scene, budget: &mut Budget<'_>, reporter: &mut Reporter) -> Result<Scene, FormatError> {
    let malformed = |error: crate::model::ClipError| FormatError::malformed("animation", "", error.to_string());
    let mut stretched: Vec<(&str, usize)> = Vec::new();
    for clip in &mut scene.clips {
        budget.check_canceled()?;
        let count = joints_stretched_in(&scene.skeleton, clip);
        if count == 0 {
            continue;
        }
        let samples = (count as u64).saturating_mul(clip.frame_count() as u64);
        budget.take_array(samples, size_of::<(Vec3, Quat, Vec3)>() as u64, "clips")?;
        *clip = straightened_clip(&scene.skeleton, clip).map_err(malformed)?;
        stretched.push((clip.name(), count));
    }
    let Some((first, _)) = stretched.first() else { return Ok(scene) };
    let most = stretched.iter().map(|(_, count)| *count).max().unwrap_or(0);
    let names: Vec<String> = stretched.iter().map(|(name, _)| format!("'{name}'")).collect();
    let clips = match names.len() {
        1 => "the clip scales".to_owned(),
        count => format!("{count} clips ({}) scale", names.join(", ")),
    };
    reporter.warn(
        "stretched_clip",
        *first,
        format!(
            "{clips} joints differently by axis, with {most} joints below them; those are moved as joints that keep their lengths, to \
             where a viewer shows them"
        ),
        "squash and stretch does not carry over to other rigs",
    );
    Ok(scene)
}

/// The meshes of a scene that have morph targets, in the order of [`Scene::morphs`]; none where its file was no glTF.
///
/// # Errors
/// When a mesh cannot be decoded, exceeds the limits, or the work is canceled.
pub fn morph_meshes(scene: &Scene, limits: &Limits, control: &Control) -> Result<Vec<MorphMesh>, FormatError> {
    gltf::morph_meshes(scene, &mut Budget::new(limits, control))
}

/// What to write, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct WriteOptions {
    /// The format of the file.
    pub format: Format,
    /// How much of the target goes into it.
    pub include: Include,
    /// What happens to the clips that the target has already.
    pub target_clips: TargetClips,
    /// Index of the clip of the target whose place the new one takes: it is left out.
    pub replaced_clip: Option<usize>,
    /// Merged into the document's `asset.extras.retargetd` where the format has room for it (provenance).
    pub extras: Option<serde_json::Value>,
    /// In which order a BVH or FBX has the rotations of all joints; else each joint has the usual one, or where that comes near its gimbal the
    /// one whose angles change least.
    pub rotation_order: Option<EulerOrder>,
    /// How a glTF format stores the animation.
    pub compression: Compression,
}

/// How a glTF format stores the numbers of an animation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Compression {
    /// As floats.
    #[default]
    None,
    /// Rotations in 16 bits a component, so that every joint is turned in the world as it should be within 0.01 degrees; the rest as
    /// floats. Every reader knows it.
    Quantized,
    /// `EXT_meshopt_compression`: rotations as close, translations and scales to a millionth.
    Meshopt,
}

impl WriteOptions {
    /// Everything of the target and all of its clips, nothing noted.
    #[must_use]
    pub const fn new(format: Format) -> Self {
        let (include, target_clips) = (Include::Everything, TargetClips::Keep);
        let compression = Compression::None;
        Self { format, include, target_clips, replaced_clip: None, extras: None, rotation_order: None, compression }
    }
}

/// How much of the target goes into the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Include {
    /// The target's whole document, where the format can hold it.
    #[default]
    Everything,
    /// Joints and the clip; no mesh, no material.
    SkeletonAndAnimation,
}

/// What happens to the clips that the target has already. The new clip is always the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum TargetClips {
    /// They follow the new one.
    #[default]
    Keep,
    /// They are left out.
    Drop,
}

/// Encodes `clip`, an animation of `target`'s skeleton, in the axes and unit that the target has.
///
/// # Errors
/// When the format cannot be written, or not from such a target; or when the work is canceled.
pub fn write(
    target: &Scene,
    clip: &Clip,
    options: &WriteOptions,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, FormatError> {
    encode(target, &[], clip, options, control, reporter)
}

/// As [`write`], in the axes and unit of the format; `axes` and `unit_meters` are those that the target was found to have.
///
/// Joints that are `posed` have a pose as the rest transforms of the skeleton, which `clip` holds for one frame. A glTF document keeps
/// everything else; their nodes are written as the skeleton has them.
///
/// # Errors
/// As [`write`].
pub fn write_in_space(
    target: &Scene,
    posed: &[usize],
    clip: &Clip,
    (axes, unit_meters): (Axes, f64),
    options: &WriteOptions,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, FormatError> {
    match space::converted(target, clip, (axes, unit_meters), options)? {
        Some((target, clip)) => encode(&target, posed, &clip, options, control, reporter),
        None => encode(target, posed, clip, options, control, reporter),
    }
}

fn encode(
    target: &Scene,
    posed: &[usize],
    clip: &Clip,
    options: &WriteOptions,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, FormatError> {
    match options.format {
        Format::Glb | Format::Gltf | Format::Vrm | Format::Vrma | Format::Zip => {
            gltf::write(target, posed, clip, options, control, reporter)
        }
        Format::Bvh => bvh::write(target, clip, options, control, reporter),
        Format::PosesNpz | Format::PosesJson => poses::write(target, clip, options, control, reporter),
        Format::Fbx => fbx::write(target, clip, options, control, reporter),
        Format::PositionsCsv => positions_csv::write(target, clip, control, reporter),
        // Pictures show a result, which this file knows nothing of.
        Format::Png
        | Format::Webp
        | Format::Gif
        | Format::Apng
        | Format::Mp4
        | Format::Drawing
        | Format::PngZip
        | Format::Poses2dNpz
        | Format::Poses2dJson
        | Format::BodyModel
        | Format::JointPositions => Err(FormatError::unsupported(
            "write",
            "",
            format!("{} files can be read but not written", options.format.info().name),
            "GET /v1/formats lists those that are written",
        )),
    }
}
