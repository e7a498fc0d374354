//! A bind pose, put onto the floor: it has the pelvis where the nodes have it, and those may be a frame of a run.

use crate::model::LocalPose;

use super::{
    super::{floor::Stance, rig::Rig},
    RestSource,
};

/// Moves a rig that rests in its bind pose onto the floor of its file.
pub(in crate::rig) fn put_onto_floor(rig: &mut Rig<'_>) {
    if let Some(pose) = Some(&*rig).filter(|rig| rig.rest_source == RestSource::Bind).and_then(grounded) {
        rig.take_rest(pose);
        rig.rest_reason.push_str("; it is put onto the floor");
    }
}

/// The rig's rest pose with its pelvis moved along the vertical until the soles are on the floor of the file. Nothing where they are
/// there already, or so far away that the file has its floor elsewhere.
fn grounded(rig: &Rig<'_>) -> Option<LocalPose> {
    let pelvis = *rig.role("pelvis").first()?;
    let stance = Stance::of(rig, pelvis);
    if !stance.stands || stance.floor == 0.0 {
        return None;
    }
    let mut pose = rig.rest_local.clone();
    let shift = rig.up() * -stance.floor;
    let local = match rig.skeleton().parent(pelvis) {
        Some(parent) => {
            let above = &rig.rest.transforms()[parent];
            above.rotation.conjugate() * shift / above.scale
        }
        None => shift,
    };
    pose.transforms_mut()[pelvis].translation += local;
    Some(pose)
}
