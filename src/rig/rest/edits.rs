//! The retarget-pose editor: the edits of a spec, applied to a rest pose.

use glam::{DQuat, EulerRot};

use crate::model::LocalPose;

use super::{
    super::{
        error::{SpecError, SpecField},
        rig::Rig,
        spec::{EditAxes, PoseEdit, RotateEdit},
    },
    find::pose_of_frame,
};

/// The rig's rest pose after its edits, in order; nothing where there are none.
///
/// # Errors
/// When an edit names a joint, a clip or a frame that there is not.
pub(in crate::rig) fn edit(rig: &Rig<'_>, edits: &[PoseEdit]) -> Result<Option<LocalPose>, SpecError> {
    if edits.is_empty() {
        return Ok(None);
    }
    let mut pose = rig.rest_local.clone();
    for (index, edit) in edits.iter().enumerate() {
        let pointer = format!("/{}/pose/{index}", rig.name);
        apply(rig, edit, &pointer, &mut pose).map_err(SpecError::from_field)?;
    }
    Ok(Some(pose))
}

fn apply(rig: &Rig<'_>, edit: &PoseEdit, pointer: &str, pose: &mut LocalPose) -> Result<(), SpecField> {
    let joints = |names: &[String]| -> Result<Vec<usize>, SpecField> {
        let find = |(index, name): (usize, &String)| rig.joint(name, &format!("{pointer}/joints/{index}"));
        names.iter().enumerate().map(find).collect()
    };
    match edit {
        PoseEdit::Rotate(edit) => rotate(rig, edit, rig.joint(&edit.joint, &format!("{pointer}/joint"))?, pose),
        PoseEdit::FromClip(edit) => {
            let frame = pose_of_frame(rig.name, rig.scene, &edit.clip, edit.frame, pointer)?;
            if edit.joints.is_empty() {
                *pose = frame;
            } else {
                for joint in joints(&edit.joints)? {
                    pose.transforms_mut()[joint].rotation = frame.transforms()[joint].rotation;
                }
            }
        }
        PoseEdit::Reset(edit) => {
            if edit.joints.is_empty() {
                *pose = rig.rest_local.clone();
            } else {
                for joint in joints(&edit.joints)? {
                    pose.transforms_mut()[joint] = rig.rest_local.transforms()[joint];
                }
            }
        }
    }
    Ok(())
}

fn rotate(rig: &Rig<'_>, edit: &RotateEdit, joint: usize, pose: &mut LocalPose) {
    let [x, y, z] = edit.degrees.map(f64::to_radians);
    let turn = DQuat::from_euler(EulerRot::ZYX, z, y, x);
    let local = pose.transforms()[joint].rotation;
    let turned = match edit.axes {
        EditAxes::Local => local * turn,
        EditAxes::Model => {
            let model = pose.to_model(rig.skeleton());
            let parent =
                rig.skeleton().parent(joint).map_or(DQuat::IDENTITY, |above| model.transforms()[above].rotation);
            let in_scene = rig.canonical_from_scene.conjugate() * turn * rig.canonical_from_scene;
            parent.conjugate() * in_scene * parent * local
        }
    };
    pose.transforms_mut()[joint].rotation = turned.normalize();
}
