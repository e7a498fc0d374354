//! Which way a body stands and looks, from where its joints are.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{Part, Role, RoleFinding, Side};
use crate::model::{ModelPose, SignedAxis};

/// A body's own directions, as unit vectors in the scene's model space, at right angles to one another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyFrame {
    /// From the hips to the shoulders; for a quadruped from the paws to the back.
    pub up: DVec3,
    /// Where the character faces.
    pub forward: DVec3,
    /// The character's own left; `up × forward`.
    pub left: DVec3,
}

/// Shorter than this share of the body, a difference of two positions has no direction.
const SHORTEST_SHARE: f64 = 1e-3;

/// How far the line from hips to shoulders may be from the axis that is up: 20°.
const UPRIGHT_RADIANS: f64 = 0.35;

/// Legs that point less clearly down than this do not carry the body: the cosine against up.
const LEGS_DOWN_COSINE: f64 = -0.3;

/// The directions of a body in a pose.
///
/// Left goes from the right limbs to the left ones, so the frame is right for a character whose sides are named right.
/// Nothing where the roles do not span a body that stands: no pair of limbs, all in one place or line, legs beside or above
/// the hips.
#[must_use]
pub fn body_frame(roles: &BTreeMap<Role, RoleFinding>, pose: &ModelPose) -> Option<BodyFrame> {
    let points = Points { roles, pose };
    if let Some(frame) = crawler_frame(&points).or_else(|| bird_frame(&points)) {
        return Some(frame);
    }
    let (up, across) = spans(&points)?;
    let reach = up.length().max(across.length());
    let left_of = |up: DVec3| across - across.dot(up) * up;
    let up = upright(up.try_normalize()?);
    let left = left_of(up);
    if left.length() <= reach * SHORTEST_SHARE {
        return None;
    }
    let left = left.try_normalize()?;
    if !points.legs_are_below(up) {
        return None;
    }
    Some(BodyFrame { up, forward: left.cross(up), left })
}

/// How far a body leans, forward, backward or to a side, in radians: 0 where the line from its hips to its shoulders is vertical and
/// the line from its right limbs to its left ones is level.
///
/// `vertical` is a unit vector of the model space. Nothing where the roles span no trunk.
#[must_use]
pub(in crate::rig) fn lean(roles: &BTreeMap<Role, RoleFinding>, pose: &ModelPose, vertical: DVec3) -> Option<f64> {
    let (up, across) = spans(&Points { roles, pose })?;
    let tilt = across.try_normalize()?.dot(vertical).clamp(-1.0, 1.0).asin().abs();
    Some(up.try_normalize()?.angle_between(vertical).max(tilt))
}

/// From low to high and from right to left on a trunk, of whatever length; not yet at right angles.
fn spans(points: &Points<'_>) -> Option<(DVec3, DVec3)> {
    let quadruped = points.pair(Part::FrontLeg).zip(points.pair(Part::HindLeg));
    match quadruped {
        Some(((front_left, front_right), (hind_left, hind_right))) => {
            let mut ground = DVec3::ZERO;
            for side in Side::BOTH {
                ground +=
                    points.last(Role::new(side, Part::FrontLeg))? + points.last(Role::new(side, Part::HindLeg))?;
            }
            let high = front_left + front_right + hind_left + hind_right;
            Some((high - ground, (front_left - front_right) + (hind_left - hind_right)))
        }
        None => {
            let pairs = [Part::Thigh, Part::UpperArm, Part::Clavicle, Part::Foot].map(|part| points.pair(part));
            let across = pairs.iter().flatten().fold(DVec3::ZERO, |sum, (left, right)| sum + (*left - *right));
            let middle = |pair: Option<(DVec3, DVec3)>| pair.map(|(left, right)| left.midpoint(right));
            let low = middle(pairs[0]).or_else(|| points.center(Part::Pelvis))?;
            let high = middle(pairs[1]).or_else(|| points.center(Part::Head)).or_else(|| points.center(Part::Neck))?;
            Some((high - low, across))
        }
    }
}

/// The directions of a body on six and more legs: the feet lie on the ground, the first pair of legs ahead of the last.
fn crawler_frame(points: &Points<'_>) -> Option<BodyFrame> {
    let legs: Vec<Role> =
        points.roles.keys().copied().filter(|role| role.part == Part::Leg && role.side == Side::Left).collect();
    let middle = |role: Role| Some(points.last(role)?.midpoint(points.last(role.mirrored())?));
    let (front, rear) = (middle(*legs.first()?)?, middle(*legs.last()?)?);
    let across = |role: &Role| Some(points.last(*role)? - points.last(role.mirrored())?);
    let across = legs.iter().filter_map(across).fold(DVec3::ZERO, |sum, step| sum + step);
    let ahead = front - rear;
    let up = upright(ahead.cross(across).try_normalize()?);
    let left = (across - across.dot(up) * up).try_normalize()?;
    Some(BodyFrame { up, forward: left.cross(up), left })
}

/// The directions of a body on two legs with wings and no arms, whose trunk leans forward: its legs say where up is.
fn bird_frame(points: &Points<'_>) -> Option<BodyFrame> {
    let (left_wing, right_wing) = points.pair(Part::Wing).filter(|_| points.pair(Part::UpperArm).is_none())?;
    let ((left_hip, right_hip), (left_foot, right_foot)) = points.pair(Part::Thigh).zip(points.pair(Part::Foot))?;
    let up = upright(((left_hip + right_hip) - (left_foot + right_foot)).try_normalize()?);
    let across = (left_wing - right_wing) + (left_hip - right_hip);
    let left = (across - across.dot(up) * up).try_normalize()?;
    Some(BodyFrame { up, forward: left.cross(up), left })
}

/// A body that nearly stands along an axis of its file stands along it: joints do not lie in one plane, and poses lean.
pub(super) fn upright(up: DVec3) -> DVec3 {
    let axis = SignedAxis::nearest(up).direction();
    if axis.angle_between(up) <= UPRIGHT_RADIANS { axis } else { up }
}

/// Whether the feet point against where the sides say that front is: then left and right are named the wrong way round.
///
/// Only where both feet have toes that point the same way and clearly forward or backward; nothing is said otherwise.
pub(super) fn sides_contradict_feet(roles: &BTreeMap<Role, RoleFinding>, pose: &ModelPose, frame: &BodyFrame) -> bool {
    let points = Points { roles, pose };
    let against = |side: Side| {
        let foot = points.at(Role::new(side, Part::Foot));
        let toe = points.at(Role::new(side, Part::Toe));
        let thigh = points.at(Role::new(side, Part::Thigh));
        let knee = points.at(Role::new(side, Part::Shin));
        foot.zip(toe).zip(thigh.zip(knee)).is_some_and(|((foot, toe), (thigh, knee))| {
            let (leg, step) = (thigh - foot, toe - foot);
            // A leg that does not stand straight is no measure: some files rest in mid-jump, and some zero poses lay all
            // bones along one axis.
            let stands = leg.normalize_or_zero().dot(frame.up) > 0.9;
            let straight = thigh.distance(knee) + knee.distance(foot) < 1.1 * leg.length();
            let along = step.dot(frame.forward);
            stands && straight && along < -0.7 * step.length() && step.length() > 0.02 * leg.length()
        })
    };
    against(Side::Left) && against(Side::Right)
}

/// Positions of roles in a pose.
pub(super) struct Points<'a> {
    pub roles: &'a BTreeMap<Role, RoleFinding>,
    pub pose: &'a ModelPose,
}

impl Points<'_> {
    /// Whether the legs point down, as far as there are legs: some zero poses lay all bones along one axis, and say nothing
    /// about how the body stands.
    fn legs_are_below(&self, up: DVec3) -> bool {
        let leg = |side: &Side| {
            let thigh = self.at(Role::new(*side, Part::Thigh))?;
            let end = self.at(Role::new(*side, Part::Foot)).or_else(|| self.at(Role::new(*side, Part::Shin)))?;
            Some((end - thigh).normalize_or_zero().dot(up))
        };
        let cosines: Vec<f64> = Side::BOTH.iter().filter_map(leg).collect();
        cosines.is_empty() || cosines.iter().sum::<f64>() < LEGS_DOWN_COSINE * cosines.len() as f64
    }

    /// Where the first joint of a role is.
    pub(super) fn at(&self, role: Role) -> Option<DVec3> {
        self.of(*self.roles.get(&role)?.joints.first()?)
    }

    /// Where the last joint of a role is.
    pub(super) fn last(&self, role: Role) -> Option<DVec3> {
        self.of(*self.roles.get(&role)?.joints.last()?)
    }

    pub(super) fn center(&self, part: Part) -> Option<DVec3> {
        self.at(Role::center(part))
    }

    /// Where the first joints of both sides are, left first.
    pub(super) fn pair(&self, part: Part) -> Option<(DVec3, DVec3)> {
        self.at(Role::new(Side::Left, part)).zip(self.at(Role::new(Side::Right, part)))
    }

    fn of(&self, joint: usize) -> Option<DVec3> {
        self.pose.transforms().get(joint).map(|transform| transform.translation)
    }
}
