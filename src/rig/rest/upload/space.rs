//! How the space of a rest file lies against the rig's: a rotation, by the axes and the fronts of the two bodies.

use std::{collections::BTreeMap, f64::consts::FRAC_PI_2};

use glam::{DQuat, DVec3};

use crate::model::{ModelPose, SignedAxis};

use super::{
    super::super::{
        at_rest::axes_of_body,
        recognition::{BodyFrame, Recognition, Role, RoleFinding, body_frame},
        rig::Rig,
    },
    limbs::{Limb, Limbs},
    matching::Matching,
    orientation::poses_of,
    solve::{base_of, is_fan},
    wahba::{Direction, best_rotation},
};

/// Spaces closer than this are one.
const SAME_SPACE_RADIANS: f64 = 1e-6;
/// Directions of no body fit when they are off by less than this on the mean, as one minus the cosine.
const FITS: f64 = 0.05;
/// Two poses are the same but for a rotation when so large a share of their bones points alike to so many degrees.
const CONGRUENT_DEGREES: f64 = 0.5;
const CONGRUENT_SHARE: f64 = 0.98;
const FEWEST_BONES: usize = 4;
/// A body that is turned further against the axes of its file does not stand along them, in degrees: 26° about the vertical is what
/// a rig may be off without being turned, and beyond a contradiction the axes that a file declares are not its own.
const ASIDE_DEGREES: f64 = 26.0;
const CONTRADICTION_DEGREES: f64 = 60.0;
/// A body whose shoulders face further aside from its hips is turned in itself, in degrees.
const TWIST_DEGREES: f64 = 12.0;

/// The rotation from the rest file's model space into the rig's.
///
/// Where the rest file stands as the rig does in one of its own poses, but for the way that it faces or lies, it is the rotation
/// between the two. Else, where both have one pelvis with its bones, it is the rotation along the axes that lays them on one another
/// best, and what is left is how the pelvis is turned in the pose. Else, where both are bodies, each is turned as retargeting would turn it: by the axes that the file declares while the body does not
/// contradict them, so that a body that stands a few degrees off its file's front keeps them. Where both declare their axes and
/// are no bodies, by these. Else as the joints lie, along the axes.
pub(super) fn rig_from_rest(rig: &Rig<'_>, rest: &Rig<'_>, matching: &Matching) -> Space {
    if let Some(turn) = poses_of(rig).iter().find_map(|own| congruent(rig, own, &rest.rest, matching)) {
        return Space { rig_from_rest: settled(turn), is_facing_open: false };
    }
    let by_bodies = by_bodies(rig, rest, matching);
    let by_pelvis = by_pelvis(rig, rest, matching);
    // Both are to agree on what is up; where the body faces, the pelvis knows better.
    let up_in_rest = |turn: DQuat| turn.conjugate() * rig.up();
    let is_sane = |space: &Space| {
        let apart = up_in_rest(space.rig_from_rest).angle_between(up_in_rest(by_bodies));
        apart.to_degrees() < CONTRADICTION_DEGREES
    };
    by_pelvis.filter(is_sane).unwrap_or(Space { rig_from_rest: by_bodies, is_facing_open: false })
}

/// How the space of a rest file lies against the rig's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Space {
    pub(super) rig_from_rest: DQuat,
    /// Whether the body is turned so far, and in itself, that nobody knows whether it faces elsewhere or is posed so.
    pub(super) is_facing_open: bool,
}

fn by_bodies(rig: &Rig<'_>, rest: &Rig<'_>, matching: &Matching) -> DQuat {
    let body = body_by_our_roles(rig, rest, matching).or(rest.recognition.body);
    let Some((own, theirs)) = rig.recognition.body.zip(body) else { return without_bodies(rig, rest, matching) };
    let recognition = Recognition { body: Some(theirs), ..Recognition::default() };
    let (canonical_from_rest, axes) = axes_of_body(rest.scene, &recognition);
    let turn = rig.canonical_from_scene.conjugate() * canonical_from_rest;
    let is_along_axes = |canonical_from_scene: DQuat, along: DQuat| canonical_from_scene.dot(along).abs() > 1.0 - 1e-9;
    if is_along_axes(rig.canonical_from_scene, rig.axes.canonical_from_this())
        && is_along_axes(canonical_from_rest, axes.canonical_from_this())
    {
        return settled(turn);
    }
    // One of them faces no axis of its file, so that only the two fronts can be laid on one another. A body that is turned in itself
    // does not face anywhere as a whole.
    let full = heading(rig.up(), turn * theirs.forward, own.forward);
    if is_twisted(rest, matching, rig) { settled(by_right_angles(rig.up(), full, turn)) } else { settled(full * turn) }
}

/// The rotation that lays a pose of the rest file on one of the rig, where the two are the same but for that.
pub(super) fn congruent(rig: &Rig<'_>, own: &ModelPose, pose: &ModelPose, matching: &Matching) -> Option<DQuat> {
    let limbs = Limbs::find(rig, own, matching, pose, DQuat::IDENTITY);
    let direction =
        |limb: &Limb| Direction { own: limb.wanted.normalize(), wanted: limb.own.normalize(), weight: limb.weight };
    let directions: Vec<Direction> = limbs.limbs.iter().map(direction).collect();
    if !limbs.is_one_build || directions.len() < FEWEST_BONES {
        return None;
    }
    let turn = best_rotation(&directions, DQuat::IDENTITY, 1e-9);
    let off = |direction: &Direction| (turn * direction.own).angle_between(direction.wanted).to_degrees();
    let alike = directions.iter().filter(|direction| off(direction) <= CONGRUENT_DEGREES).count();
    (alike as f64 >= CONGRUENT_SHARE * directions.len() as f64).then_some(turn)
}

/// By the bones of the pelvis, in two files of one character.
fn by_pelvis(rig: &Rig<'_>, rest: &Rig<'_>, matching: &Matching) -> Option<Space> {
    let limbs = Limbs::find(rig, &rig.rest, matching, &rest.rest, DQuat::IDENTITY);
    let of_pelvis: Vec<&Limb> = limbs.of(base_of(rig)?).filter(|limb| limb.is_named).collect();
    if !limbs.is_one_build || !is_fan(&of_pelvis) {
        return None;
    }
    let direction =
        |limb: &&Limb| Direction { own: limb.wanted.normalize(), wanted: limb.own.normalize(), weight: limb.weight };
    let directions: Vec<Direction> = of_pelvis.iter().map(direction).collect();
    let pelvis = best_rotation(&directions, DQuat::IDENTITY, 1e-9);
    let declared = rig
        .scene
        .axes
        .zip(rest.scene.axes)
        .map(|(own, theirs)| (own.canonical_from_this().conjugate() * theirs.canonical_from_this()).normalize());
    let up = rig.up();
    let quarters =
        |turn: DQuat| (0..4).map(move |quarter| DQuat::from_axis_angle(up, f64::from(quarter) * FRAC_PI_2) * turn);
    let nearest = |turns: &mut dyn Iterator<Item = DQuat>| {
        turns.min_by(|one, other| one.angle_between(pelvis).total_cmp(&other.angle_between(pelvis)))
    };
    let along = declared
        .and_then(|declared| nearest(&mut quarters(declared)))
        .filter(|turn| turn.angle_between(pelvis).to_degrees() < CONTRADICTION_DEGREES)
        .unwrap_or_else(|| {
            along_axes(pelvis * declared.unwrap_or_default().conjugate()) * declared.unwrap_or_default()
        });
    let front = rig.recognition.body?.forward;
    let further = heading(up, along * pelvis.conjugate() * front, front);
    let is_far = further.angle_between(DQuat::IDENTITY).to_degrees() > ASIDE_DEGREES;
    let is_facing_open = is_far && is_twisted(rest, matching, rig);
    let rig_from_rest = settled(if is_far && !is_facing_open { further * along } else { along });
    Some(Space { rig_from_rest, is_facing_open })
}

/// Whether hips and shoulders of the rest file face in different directions.
fn is_twisted(rest: &Rig<'_>, matching: &Matching, rig: &Rig<'_>) -> bool {
    let place = |role: &str| {
        let joint = rig.role(role).first().copied()?;
        Some(matching.anchors[joint]?.place(&rest.rest))
    };
    let across = |part: &str| {
        let way = rest.canonical_from_scene * (place(&format!("left_{part}"))? - place(&format!("right_{part}"))?);
        way.with_y(0.0).try_normalize()
    };
    let lines = across("thigh").zip(across("upper_arm"));
    lines.is_some_and(|(hips, shoulders)| hips.angle_between(shoulders).to_degrees() > TWIST_DEGREES)
}

/// Of a turn about the vertical only the right angles, counted from the axes that the files declare.
fn by_right_angles(up: DVec3, further: DQuat, turn: DQuat) -> DQuat {
    let exact = further * turn;
    let candidates =
        (0..4).map(|quarter| DQuat::from_axis_angle(up, f64::from(quarter) * FRAC_PI_2) * along_axes(exact));
    let nearest = candidates.min_by(|one, other| one.angle_between(exact).total_cmp(&other.angle_between(exact)));
    nearest.unwrap_or(exact)
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
    let declared = settled(rig.canonical_from_scene.conjugate() * rest.canonical_from_scene);
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
