//! How the space of a rest file lies against the rig's: a rotation, by the axes and the fronts of the two bodies.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};

use crate::model::SignedAxis;

use super::{
    super::super::{
        recognition::{BodyFrame, Recognition, Role, RoleFinding, body_frame},
        understand::{Rig, axes_of_body},
    },
    matching::Matching,
    wahba::{Direction, best_rotation},
};

/// Spaces closer than this are one.
const SAME_SPACE_RADIANS: f64 = 1e-6;
/// Directions of no body fit when they are off by less than this on the mean, as one minus the cosine.
const FITS: f64 = 0.05;

/// The rotation from the rest file's model space into the rig's.
///
/// Where both are bodies, each is turned as retargeting would turn it: by the axes that the file declares while the body does not
/// contradict them, so that a body that stands a few degrees off its file's front keeps them. Where both declare their axes and
/// are no bodies, by these. Else as the joints lie, along the axes.
pub(super) fn rig_from_rest(rig: &Rig<'_>, rest: &Rig<'_>, matching: &Matching) -> DQuat {
    let body = body_by_our_roles(rig, rest, matching).or(rest.recognition.body);
    let Some((own, theirs)) = rig.recognition.body.zip(body) else { return without_bodies(rig, rest, matching) };
    let recognition = Recognition { body: Some(theirs), ..Recognition::default() };
    let (work_from_rest, axes) = axes_of_body(rest.scene, &recognition);
    let turn = rig.work_from_scene.conjugate() * work_from_rest;
    let is_along_axes = |work_from_scene: DQuat, along: DQuat| work_from_scene.dot(along).abs() > 1.0 - 1e-9;
    if is_along_axes(rig.work_from_scene, rig.axes.ours_from_this())
        && is_along_axes(work_from_rest, axes.ours_from_this())
    {
        return settled(turn);
    }
    // One of them faces no axis of its file, so that only the two fronts can be laid on one another.
    settled(heading(rig.up(), turn * theirs.forward, own.forward) * turn)
}

fn settled(turn: DQuat) -> DQuat {
    if turn.angle_between(DQuat::IDENTITY) < SAME_SPACE_RADIANS { DQuat::IDENTITY } else { turn.normalize() }
}

/// The turn about the vertical from one front to another.
fn heading(up: DVec3, from: DVec3, to: DVec3) -> DQuat {
    let level = |direction: DVec3| (direction - up * direction.dot(up)).try_normalize();
    let Some((from, to)) = level(from).zip(level(to)) else { return DQuat::IDENTITY };
    DQuat::from_axis_angle(up, up.dot(from.cross(to)).atan2(from.dot(to)))
}

/// The rest file's body by the roles of the rig, which are the surer ones where names match.
fn body_by_our_roles(rig: &Rig<'_>, rest: &Rig<'_>, matching: &Matching) -> Option<BodyFrame> {
    let twins = |finding: &RoleFinding| -> Option<RoleFinding> {
        let joints: Option<Vec<usize>> =
            finding.joints.iter().map(|joint| matching.anchors[*joint].and_then(|anchor| anchor.joint())).collect();
        Some(RoleFinding { joints: joints?, ..RoleFinding::default() })
    };
    let roles: BTreeMap<Role, RoleFinding> =
        rig.recognition.roles.iter().filter_map(|(role, finding)| Some((*role, twins(finding)?))).collect();
    body_frame(&roles, &rest.rest)
}

fn without_bodies(rig: &Rig<'_>, rest: &Rig<'_>, matching: &Matching) -> DQuat {
    let declared = settled(rig.work_from_scene.conjugate() * rest.work_from_scene);
    if rig.scene.axes.is_some() && rest.scene.axes.is_some() {
        return declared;
    }
    let directions = bones(rig, rest, matching);
    let error = |turn: DQuat| -> f64 {
        let off = |direction: &Direction| 1.0 - (turn * direction.own).dot(direction.wanted);
        directions.iter().map(off).sum::<f64>() / directions.len().max(1) as f64
    };
    if error(declared) < FITS {
        return declared;
    }
    let exact = best_rotation(&directions, declared, 1e-6);
    let snapped = along_axes(exact);
    settled(if error(snapped) < FITS.max(2.0 * error(exact)) { snapped } else { exact })
}

/// The bones that both have, `own` in the rest file's space.
fn bones(rig: &Rig<'_>, rest: &Rig<'_>, matching: &Matching) -> Vec<Direction> {
    let joints = rig.skeleton().joints().iter().enumerate();
    let bone = |(joint, parent): (usize, usize)| {
        let (from, to) = matching.anchors[parent].zip(matching.anchors[joint])?;
        let place = |joint: usize| rig.rest.transforms()[joint].translation;
        let own = (to.place(&rest.rest) - from.place(&rest.rest)).try_normalize()?;
        Some(Direction { own, wanted: (place(joint) - place(parent)).try_normalize()?, weight: 1.0 })
    };
    joints.filter_map(|(index, joint)| bone((index, joint.parent?))).collect()
}

/// The rotation along axes that is nearest to another.
fn along_axes(turn: DQuat) -> DQuat {
    let x = SignedAxis::nearest(turn * DVec3::X).direction();
    let wanted = turn * DVec3::Y;
    let y = SignedAxis::nearest(wanted - x * wanted.dot(x)).direction();
    DQuat::from_mat3(&glam::DMat3::from_cols(x, y, x.cross(y)))
}
