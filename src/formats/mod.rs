//! Bytes to [`Scene`] and back.
//!
//! Each format is one folder with `read` and `write`. Readers take untrusted bytes: every count is checked against a
//! [`Budget`] before anything is allocated for it, nothing recurses on input, nothing panics. Knows no rig and no algorithm;
//! touches no file, no network, no clock.
//!
//! # How to add a format
//!
//! 1. Add a variant to [`Format`] and its row in [`Format::info`]; the compiler then names every `match` to extend.
//! 2. Make a folder with `read.rs` (bytes to [`Scene`], saying its axes and unit) and, where it is written, `write.rs`.
//! 3. Teach [`sniff`] its first bytes.
//! 4. Add a hostile file of each kind (cut short, counts too large, NaN, cycles) to the format's tests, and real files to
//!    `tests/it/corpus.rs`.

mod body_model;
pub mod budget;
mod bundle;
mod bvh;
mod error;
mod euler;
mod fbx;
mod format;
mod gltf;
mod numpy;
mod poses;
mod sniff;
mod written;
mod zipped;

pub use budget::{Budget, Limit, Limits};
pub use bundle::{Unpacked, embed_with, may_point_to_others, unpack};
pub use error::{ErrorKind, FormatError};
pub use euler::EulerOrder;
pub use format::{Format, FormatInfo};
pub use sniff::sniff;

use glam::{Quat, Vec3};

use crate::model::{Clip, Control, MorphMesh, Reporter, Scene, Stretched};

/// Decodes a file.
///
/// `format` comes from [`sniff`]. Every index in the result is in range and every
/// number finite; [`Scene::axes`] and [`Scene::unit_metres`] say what space it is in.
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
    let mut budget = Budget::new(limits, control);
    budget.take(Limit::FileBytes, bytes.len() as u64, "file")?;
    match format {
        Format::Zip => {
            let Unpacked { name, bytes } = unpack(bytes, limits, control)?;
            // What comes out is a model by its name; an archive in an archive is not opened.
            match sniff(&bytes, &name)? {
                Format::Zip => Err(FormatError::unsupported("archive", name, "an archive in an archive", "unpack it")),
                format => read(&bytes, format, limits, control, reporter),
            }
        }
        Format::Glb | Format::Gltf | Format::Vrm | Format::Vrma => gltf::read(bytes, format, &mut budget, reporter),
        Format::Fbx => fbx::read(bytes, &mut budget, reporter),
        Format::Bvh => bvh::read(bytes, &mut budget, reporter),
        Format::PosesNpz | Format::PosesJson => poses::read(bytes, format, &mut budget, reporter),
        Format::BodyModel => body_model::read_archive(bytes, &mut budget, reporter),
        Format::JointPositions => body_model::read_array(bytes, &mut budget, reporter),
    }
}

/// Gives joints that a scale stretches lengths of their own; for formats whose viewers multiply matrices.
fn straighten(scene: Scene, budget: &mut Budget<'_>, reporter: &mut Reporter) -> Result<Scene, FormatError> {
    budget.check_canceled()?;
    let malformed = |error: crate::model::ClipError| FormatError::malformed("nodes", "", error.to_string());
    let frames: usize = scene.clips.iter().map(Clip::frame_count).sum();
    let Some(plan) = Stretched::of(&scene.skeleton) else { return Ok(scene) };
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
    /// Merged into the document's `asset.extras.retargetd` where the format has room for it (provenance).
    pub extras: Option<serde_json::Value>,
    /// In which order a BVH or FBX has the rotations of all joints; else each joint has the usual one, or where that comes near its gimbal the
    /// one whose angles change least.
    pub rotation_order: Option<EulerOrder>,
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

/// Encodes `clip`, an animation of `target`'s skeleton.
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
    match options.format {
        Format::Glb | Format::Gltf | Format::Vrm => gltf::write(target, clip, options, control, reporter),
        Format::Bvh => bvh::write(target, clip, options, control, reporter),
        Format::PosesNpz | Format::PosesJson => poses::write(target, clip, options, control, reporter),
        Format::Fbx => fbx::write(target, clip, options, control, reporter),
        Format::Vrma | Format::BodyModel | Format::JointPositions | Format::Zip => Err(FormatError::unsupported(
            "write",
            "",
            format!("{} files can be read but not written", options.format.info().name),
            "ask for glb, gltf, fbx, bvh, npz or poses json",
        )),
    }
}

/// Encodes a character in a pose: `target`, whose skeleton has the pose as its rest transforms, and `clip`, which holds it for one
/// frame.
///
/// A glTF document keeps everything else; the nodes of the `posed` joints are written as the skeleton has them. Formats without
/// a document are written as [`write`] does.
///
/// # Errors
/// As [`write`].
pub fn write_posed(
    target: &Scene,
    posed: &[usize],
    clip: &Clip,
    options: &WriteOptions,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, FormatError> {
    match options.format {
        Format::Glb | Format::Gltf | Format::Vrm => gltf::write_posed(target, posed, clip, options, control, reporter),
        _ => write(target, clip, options, control, reporter),
    }
}
