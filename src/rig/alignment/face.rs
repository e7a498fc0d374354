//! Where a face looks: by its eyes and by the mesh of the head, since a head has no joint that it points at.
//!
//! Eyes say how a head is turned and tilted. How far it looks up or down they say only together with the mesh: where riggers put the
//! head's own joint differs by more than heads do, but seen from the middle of the head the eyes are level (within 9° for all
//! characters that this was looked at with). A mesh without eyes does not say it: hair, helmets and ears are as much of it as the
//! face is.

use glam::{DMat3, DQuat, DVec3};

use super::{
    super::rig::Rig,
    look::{Look, RollCue, place},
};

/// Fewer points are no head.
const FEW_POINTS: usize = 24;
/// A head that is wider than this share of its height wears something, or is none.
const WIDEST: f64 = 1.2;
/// Eyes are further from the middle of a head than this share of its height.
const EYES_OUT: f64 = 0.15;
/// Eyes that are seen higher or lower than this from the middle of the head are not where eyes are, or the head hangs.
const EYES_HIGH_DEGREES: f64 = 60.0;
/// Cosine between the line of the eyes and the line of the hips, at least: a head is turned by less than this at rest.
const MIN_ACROSS: f64 = 0.5;
/// Eyes in a mesh tell how a face looks to this many degrees.
const EYES_DEGREES: f64 = 15.0;
/// Eyes alone tell how a head is turned and tilted to this many degrees.
const EYES_ALONE_DEGREES: f64 = 10.0;

/// How a head is held, in canonical space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    /// Unit vector to the character's left.
    pub(super) left: DVec3,
    /// Unit vector to where it looks; square to `left`.
    pub(super) forward: DVec3,
    pub(super) cue: RollCue,
    pub(super) uncertainty_degrees: f64,
}

impl Face {
    /// A face that looks straight ahead.
    pub(super) fn ahead(look: &Look<'_>) -> Self {
        let turn = DQuat::from_rotation_y(look.heading_radians());
        Self { left: turn * DVec3::X, forward: turn * DVec3::Z, cue: RollCue::Convention, uncertainty_degrees: 0.0 }
    }

    /// The rotation that takes a face that looks along +Z, upright, to this one.
    pub(super) fn frame(&self) -> DQuat {
        DQuat::from_mat3(&DMat3::from_cols(self.left, self.forward.cross(self.left), self.forward))
    }

    /// How a rig holds its head at rest. What neither eyes nor mesh tell is taken to be straight ahead, but for a moment of a motion,
    /// of which nothing is known then.
    pub(super) fn of(rig: &Rig<'_>) -> Option<Self> {
        let head = *rig.role("head").last()?;
        let ahead = Self::ahead(&Look::Rig(rig));
        let eye = |role: &str| rig.role(role).first().map(|joint| place(rig, *joint));
        let eyes = eye("left_eye").zip(eye("right_eye"));
        let left = eyes.and_then(|(left, right)| (left - right).try_normalize());
        // Eyes whose line is none across the head were mistaken for eyes.
        let left = left.filter(|left| left.dot(ahead.left) > MIN_ACROSS);
        let eyes = eyes.filter(|_| left.is_some());
        let left = left.unwrap_or(ahead.left);
        let level = left.cross(DVec3::Y).try_normalize()?;
        let by_eyes = eyes.and_then(|(one, other)| eyes_in_mesh(&points(rig, head), (one + other) / 2.0, left, level));
        let found =
            |forward: DVec3, uncertainty_degrees: f64| Self { left, forward, cue: RollCue::Eyes, uncertainty_degrees };
        match (by_eyes, eyes) {
            (Some(forward), _) => Some(found(forward, EYES_DEGREES)),
            _ if rig.rest_source.is_in_motion() => None,
            (None, Some(_)) => Some(found(level, EYES_ALONE_DEGREES)),
            (None, None) => Some(ahead),
        }
    }
}

/// The mesh that a head and all below it move, at rest and in canonical space.
fn points(rig: &Rig<'_>, head: usize) -> Vec<DVec3> {
    let below = (head..rig.skeleton().len()).filter(|joint| rig.skeleton().is_ancestor_or_self(head, *joint));
    let points = below.flat_map(|joint| {
        let transform = &rig.rest.transforms()[joint];
        let points = rig.scene.skin_points.of(joint);
        points.iter().map(|point| rig.canonical_from_scene * transform.transform_point(point.position.as_dvec3()))
    });
    points.collect()
}

/// The direction, square to `left`, in which the eyes are seen from the middle of the head. Nothing where there is no mesh of the
/// shape of a head, or the eyes are not at its front.
fn eyes_in_mesh(points: &[DVec3], eyes: DVec3, left: DVec3, level: DVec3) -> Option<DVec3> {
    if points.len() < FEW_POINTS {
        return None;
    }
    let axes = DMat3::from_cols(left, level.cross(left), level);
    let seen = points.iter().map(|point| axes.transpose() * *point);
    let (low, high) =
        seen.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), point| (low.min(point), high.max(point)));
    let (size, way) = (high - low, eyes - axes * ((low + high) / 2.0));
    let way = way - left * way.dot(left);
    let is_face = size.x <= WIDEST * size.y
        && way.length() >= EYES_OUT * size.y
        && way.angle_between(level).to_degrees() < EYES_HIGH_DEGREES;
    is_face.then(|| way.normalize())
}
