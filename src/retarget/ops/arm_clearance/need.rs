//! Whether arms of a target need room that the source's do not.

use glam::DVec3;

use super::BODY;
use crate::{
    retarget::stages::gaps::{Line, nearest},
    rig::{Anchor, Capsule, Limb, body_capsules, rig::Rig},
};

/// The arms of a body.
const ARMS: [Limb; 2] = [Limb::LeftArm, Limb::RightArm];
/// Arms that would be deeper in the body than the source's by more than this, in legs, where they hang or lie across it, need room.
const DEPTH_LEGS: f64 = 0.08;

/// Whether arms that hang down, or lie across the body, would be deeper in the target than in the source. Never for a target without a mesh,
/// whose body is guessed.
pub(in crate::retarget) fn need_room(source: &Rig<'_>, target: &Rig<'_>) -> bool {
    if target.scene.skin_points.is_empty() {
        return false;
    }
    let Some((of_source, of_target)) = depths(source).zip(depths(target)) else { return false };
    of_source.iter().zip(of_target).any(|(source, target)| target - source.max(0.0) > DEPTH_LEGS)
}

/// How deep arms are in the body in some poses of theirs, in legs; nothing where there are no arms, legs or body.
fn depths(side: &Rig<'_>) -> Option<Vec<f64>> {
    let place = |role: &str| side.role(role).first().map(|&joint| side.rest.transforms()[joint].translation);
    let [hip, knee, ankle] = ["left_thigh", "left_shin", "left_foot"].map(place);
    let leg = hip?.distance(knee?) + knee?.distance(ankle?);
    let capsules = body_capsules(side);
    let find = |name: &str| capsules.iter().find(|(other, _)| *other == name).map(|(_, capsule)| capsule);
    let body: Vec<Line> = BODY.iter().filter_map(|name| Some(line_at_rest(side, find(name)?))).collect();
    let [left, right] = ["left_upper_arm", "right_upper_arm"].map(place);
    let outward = (left? - right?).reject_from(side.up()).try_normalize()?;
    let front = outward.cross(side.up());
    if body.is_empty() || leg <= 0.0 {
        return None;
    }
    let mut depths = Vec::new();
    for (arm, outward) in ARMS.into_iter().zip([outward, -outward]) {
        let lines = Hanging::of(side, arm, find)?;
        for line in [lines.down(side.up()), lines.across(side.up(), front, outward)] {
            let deepest = body.iter().map(|part| -nearest(part, &line).distance).fold(f64::NEG_INFINITY, f64::max);
            depths.push(deepest / leg);
        }
    }
    Some(depths)
}

/// A capsule where it is at rest.
fn line_at_rest(side: &Rig<'_>, capsule: &Capsule) -> Line {
    let place = |anchor: Anchor| {
        let rest = side.rest.transforms()[anchor.joint];
        rest.translation + rest.rotation * anchor.offset
    };
    Line { start: place(capsule.start), end: place(capsule.end), radius: capsule.radius }
}

/// An arm that hangs from its shoulder.
struct Hanging {
    shoulder: DVec3,
    upper: f64,
    lower: f64,
    radius: f64,
}

impl Hanging {
    fn of<'c>(side: &Rig<'_>, arm: Limb, find: impl Fn(&str) -> Option<&'c Capsule>) -> Option<Self> {
        let prefix = arm.side_of_arm()?;
        let place = |part: &str| {
            let joint = *side.role(&format!("{prefix}{part}")).first()?;
            Some(side.rest.transforms()[joint].translation)
        };
        let (shoulder, elbow, wrist) = (place("upper_arm")?, place("forearm")?, place("hand")?);
        let radius = find(&format!("{prefix}forearm"))?.radius;
        Some(Self { shoulder, upper: shoulder.distance(elbow), lower: elbow.distance(wrist), radius })
    }

    /// The forearm, where the arm hangs straight down.
    fn down(&self, up: DVec3) -> Line {
        let elbow = self.shoulder - up * self.upper;
        Line { start: elbow, end: elbow - up * self.lower, radius: self.radius }
    }

    /// The forearm, where it lies across the body.
    fn across(&self, up: DVec3, front: DVec3, outward: DVec3) -> Line {
        let elbow = self.shoulder - up * self.upper;
        let along = (front - outward).normalize_or_zero();
        Line { start: elbow, end: elbow + along * self.lower, radius: self.radius }
    }
}
