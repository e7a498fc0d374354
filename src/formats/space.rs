//! Bringing a scene and a clip into the axes and unit that an output format wants.

use std::sync::Arc;

use glam::{DQuat, Quat, Vec3};

use super::{FormatError, Space, TargetClips, WriteOptions};
use crate::model::{
    Axes, Clip, ClipError, Joint, JointKeys, JointTracks, Payload, Scene, Skeleton, SparseKeys, Transform,
};

/// The scene and the clip in the axes and unit that the format wants; nothing where they are in those. `axes` and `unit_meters` are
/// those that the target was found to have.
///
/// # Errors
/// When the clip is too large for its tracks there.
pub(super) fn converted(
    target: &Scene,
    clip: &Clip,
    (axes, unit_meters): (Axes, f64),
    options: &WriteOptions,
) -> Result<Option<(Scene, Clip)>, FormatError> {
    let is_ours = target.axes == Some(Axes::Y_UP_Z_FRONT) && target.unit_meters == Some(1.0);
    let wants_ours = match options.format.info().space {
        Space::Canonical => true,
        Space::OfTarget => false,
        Space::SaidByTarget => target.axes.is_none(),
    };
    let conversion = Conversion::into_ours(axes, unit_meters);
    if is_ours || !wants_ours || conversion.is_identity() {
        return Ok(None);
    }
    let not_a_clip = |error: ClipError| FormatError::malformed("convert", "", error.to_string());
    let mut scene = convert_scene(target, &conversion);
    if options.target_clips == TargetClips::Keep {
        let clips = target.clips.iter().map(|clip| convert_clip(clip.clone(), target, &conversion));
        scene.clips = clips.collect::<Result<_, _>>().map_err(not_a_clip)?;
    }
    let keys = clip.sparse_keys().map(|keys| Arc::new(convert_keys(keys, target, &conversion)));
    let clip = convert_clip(clip.clone(), target, &conversion).map_err(not_a_clip)?;
    let clip = match keys {
        Some(keys) => clip.with_sparse_keys(keys),
        None => clip,
    };
    Ok(Some((scene, clip)))
}

/// A rotation of the scene, and a factor on its lengths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conversion {
    rotation: DQuat,
    pub(super) scale: f64,
}

impl Conversion {
    /// From the axes and unit that a side was found to have to +Y up, +Z front and meters.
    pub(super) fn into_ours(axes: Axes, unit_meters: f64) -> Self {
        Self { rotation: axes.canonical_from_this(), scale: unit_meters }
    }

    pub(super) fn is_identity(&self) -> bool {
        self.rotation.dot(DQuat::IDENTITY).abs() > 1.0 - 1e-12 && (self.scale - 1.0).abs() < 1e-12
    }

    /// The way back.
    pub(super) fn inverse(&self) -> Self {
        Self { rotation: self.rotation.conjugate(), scale: self.scale.recip() }
    }

    /// A translation of a track there.
    pub(super) fn place(&self, value: Vec3, is_root: bool) -> Vec3 {
        let scaled = value.as_dvec3() * self.scale;
        (if is_root { self.rotation * scaled } else { scaled }).as_vec3()
    }

    /// A rotation of a track there, as long as it is here.
    pub(super) fn turn(&self, value: Quat, is_root: bool) -> Quat {
        if is_root { (self.rotation * value.as_dquat()).as_quat() } else { value }
    }

    fn root(&self, transform: &Transform) -> Transform {
        Transform {
            translation: self.rotation * transform.translation * self.scale,
            rotation: self.rotation * transform.rotation,
            scale: transform.scale,
        }
    }

    fn below(&self, transform: &Transform) -> Transform {
        Transform { translation: transform.translation * self.scale, ..*transform }
    }
}

/// The same scene in +Y up, +Z front and meters, without its clips and payload: what skeleton-only files are written from.
pub(super) fn convert_scene(scene: &Scene, conversion: &Conversion) -> Scene {
    let convert = |joint: &Joint| {
        let rest = if joint.parent.is_some() { conversion.below(&joint.rest) } else { conversion.root(&joint.rest) };
        Joint { rest, ..joint.clone() }
    };
    let joints = scene.skeleton.joints().iter().map(convert).collect();
    Scene {
        skeleton: Skeleton::new(joints).expect("the order of a valid skeleton stays valid, and finite stays finite"),
        clips: Vec::new(),
        hidden_joints: scene.hidden_joints.clone(),
        skins: scene.skins.clone(),
        bind_pose: Vec::new(),
        skin_points: scene.skin_points.scaled(conversion.scale as f32),
        skin_vertices: Arc::new(scene.skin_vertices.map(|one| one.position * conversion.scale as f32)),
        morphs: scene.morphs.clone(),
        declared_roles: scene.declared_roles.clone(),
        declared_convention: scene.declared_convention,
        axes: Some(Axes::Y_UP_Z_FRONT),
        unit_meters: Some(1.0),
        look_at: scene.look_at,
        gaze_joint: scene.gaze_joint,
        stretched: None,
        payload: Payload::default(),
    }
}

/// The same clip likewise.
pub(super) fn convert_clip(clip: Clip, scene: &Scene, conversion: &Conversion) -> Result<Clip, ClipError> {
    let joints = clip.joints().iter().zip(scene.skeleton.joints()).map(|(tracks, joint)| {
        let is_root = joint.parent.is_none();
        JointTracks {
            translation: tracks.translation.map(|value| conversion.place(value, is_root)),
            rotation: tracks.rotation.map(|value| conversion.turn(value, is_root)),
            scale: tracks.scale.clone(),
        }
    });
    let joints = joints.collect();
    clip.with_joints(joints)
}

/// The keys of a clip likewise.
fn convert_keys(keys: &SparseKeys, scene: &Scene, conversion: &Conversion) -> SparseKeys {
    let joints = keys.joints.iter().zip(scene.skeleton.joints()).map(|(keys, joint)| {
        let is_root = joint.parent.is_none();
        JointKeys {
            translation: keys.translation.map(|value| conversion.place(value, is_root)),
            rotation: keys.rotation.map(|value| conversion.turn(value, is_root)),
            scale: keys.scale.clone(),
        }
    });
    SparseKeys { joints: joints.collect() }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn z_up_inches_become_y_up_meters() {
        let joint = |parent| Joint {
            name: String::new(),
            parent,
            rest: Transform::from_translation(DVec3::new(0.0, 0.0, 10.0)),
            is_joint: true,
            node: 0,
        };
        let skeleton = Skeleton::new(vec![joint(None), joint(Some(0))]).expect("valid");
        let scene = Scene { skeleton, ..Scene::default() };
        let conversion = Conversion::into_ours("+z-y".parse().expect("axes"), 0.0254);
        let ours = convert_scene(&scene, &conversion);
        let model = ours.skeleton.rest_pose().to_model(&ours.skeleton);
        let wanted = DVec3::new(0.0, 20.0 * 0.0254, 0.0);
        assert!((model.transforms()[1].translation - wanted).length() < 1e-12, "{:?}", model.transforms()[1]);
    }
}
