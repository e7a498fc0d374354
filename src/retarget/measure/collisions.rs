//! Arms that go into the trunk, the head or the thighs, by capsules about the bones.

use glam::DVec3;

use super::{
    clearance::{least_share, turned_arm},
    metric::{Finding, Reading, Series},
    motion::{Anchor, Both, Compared, Motion, Wanted},
};
use crate::rig::{Rig, body_capsules};

const ARMS: [&str; 4] = ["left_forearm", "left_hand", "right_forearm", "right_hand"];
const BODY: [&str; 6] = ["hips", "waist", "chest", "head", "left_thigh", "right_thigh"];
const NO_ARMS: &str = "no arms and trunk were recognized on both sides";
const CENTIMETERS: f64 = 100.0;

/// What is looked at.
pub(super) struct Collisions {
    arms: Vec<Capsule>,
    body: Vec<Capsule>,
    legs: Both<f64>,
}

/// A part of the body on both sides.
struct Capsule {
    name: &'static str,
    joint: usize,
    /// Slots of where its line begins and ends.
    ends: [usize; 2],
    /// Meters.
    radius: Both<f64>,
}

impl Collisions {
    /// `legs` are leg lengths in meters.
    pub(super) fn find(rigs: &Both<&Rig<'_>>, legs: Both<Option<f64>>, wanted: &mut Wanted) -> Option<Self> {
        let legs = Both { source: legs.source?, target: legs.target? };
        let capsules = rigs.map(|rig| body_capsules(rig));
        let mut find = |name: &'static str| {
            let own = |of: &[(&'static str, crate::rig::Capsule)]| {
                of.iter().find(|(other, _)| *other == name).map(|one| one.1)
            };
            let (source, target) = (own(&capsules.source)?, own(&capsules.target)?);
            let mut end = |source: crate::rig::Anchor, target: crate::rig::Anchor| {
                wanted.point(Both { source: Anchor::of(rigs.source, source), target: Anchor::of(rigs.target, target) })
            };
            let ends = [end(source.start, target.start), end(source.end, target.end)];
            let radius = Both {
                source: source.radius * rigs.source.unit_meters,
                target: target.radius * rigs.target.unit_meters,
            };
            Some(Capsule { name, joint: target.start.joint, ends, radius })
        };
        let arms: Vec<Capsule> = ARMS.into_iter().filter_map(&mut find).collect();
        let body: Vec<Capsule> = BODY.into_iter().filter_map(&mut find).collect();
        (!arms.is_empty() && !body.is_empty()).then_some(Self { arms, body, legs })
    }

    /// How much deeper arms are in the body than the source's are at the same frame, in centimeters at 1 m leg length.
    pub(super) fn measure(collisions: Option<&Self>, compared: &Compared) -> Finding {
        let collisions = collisions.ok_or(NO_ARMS)?;
        let mut series = Vec::new();
        for arm in &collisions.arms {
            let deepest = |frame: usize| {
                let beyond = |part: &Capsule| {
                    let own =
                        depth(arm, part, &compared.target, frame, |radius| radius.target) / collisions.legs.target;
                    if own <= 0.0 {
                        return 0.0;
                    }
                    let of_source =
                        depth(arm, part, &compared.source, frame, |radius| radius.source) / collisions.legs.source;
                    (own - of_source.max(0.0)).max(0.0) * CENTIMETERS
                };
                collisions.body.iter().map(beyond).fold(0.0, f64::max)
            };
            let values = (0..compared.len()).map(deepest).collect();
            series.push(Series { part: arm.name.to_owned(), joint: arm.joint, values });
        }
        Reading::of_worst_part(&series, &compared.frames.indices, 0.98).ok_or(NO_ARMS)
    }
}

/// A hand of the source that is no farther from the body than the first, in legs, touches it. Arms of the target may point elsewhere for that, where
/// its hand would be farther from where it should be than the second otherwise, until it is as near but for the third.
const TOUCHES: f64 = 0.08;
const ASTRAY: f64 = 0.03;
const AS_NEAR: f64 = 0.01;
/// How deep an arm of the target may be in the body beyond the source's before it is swung out by right, in legs.
const INTO_THE_BODY: f64 = 0.03;

impl Collisions {
    /// The share of the way from where the bones of an arm of the source point to where the target's point that keeps forearm and hand out of
    /// the body: all of it where that is not enough. `side` is what the names of its parts begin with, the slots are those of shoulder, elbow and wrist.
    pub(super) fn aside(&self, side: &str, slots: [usize; 3], compared: &Compared, frame: usize) -> f64 {
        let wrist = compared.target.position(frame, slots[2]);
        let is_clear = |share: f64| {
            let [turned_elbow, turned_wrist] = turned_arm(slots, compared, frame, share);
            self.arms.iter().filter(|arm| arm.name.starts_with(side)).all(|arm| {
                let [start, end] = arm.ends.map(|end| compared.target.position(frame, end));
                // A hand keeps how it is turned.
                let line = if start == end { [start - wrist + turned_wrist; 2] } else { [turned_elbow, turned_wrist] };
                self.body.iter().all(|part| {
                    let of_part = part.ends.map(|end| compared.target.position(frame, end));
                    let own = arm.radius.target + part.radius.target - distance(line, of_part);
                    let of_source = || depth(arm, part, &compared.source, frame, |radius| radius.source).max(0.0);
                    own <= 0.0 || own / self.legs.target - of_source() / self.legs.source <= INTO_THE_BODY
                })
            })
        };
        least_share(is_clear)
    }

    /// The share of the same way that keeps a hand which touches the body as far from it as the source's is: none where that one touches nothing,
    /// and where it does not.
    pub(super) fn touching(&self, side: &str, slots: [usize; 3], compared: &Compared, frame: usize) -> f64 {
        let is_hand = |arm: &&Capsule| arm.name.strip_prefix(side) == Some("hand");
        let Some(hand) = self.arms.iter().find(is_hand) else { return 0.0 };
        let from_wrist = compared.target.position(frame, hand.ends[0]) - compared.target.position(frame, slots[2]);
        let share_for = |part: &Capsule| {
            let own = depth(hand, part, &compared.source, frame, |radius| radius.source) / self.legs.source;
            if own < -TOUCHES {
                return 0.0;
            }
            let of_part = part.ends.map(|end| compared.target.position(frame, end));
            let error = |share: f64| {
                let [_, wrist] = turned_arm(slots, compared, frame, share);
                let apart = distance([wrist + from_wrist; 2], of_part) - hand.radius.target - part.radius.target;
                (apart / self.legs.target + own).abs()
            };
            let left = error(1.0);
            if error(0.0) < left.max(ASTRAY) { 0.0 } else { least_share(|share| error(share) <= left.max(AS_NEAR)) }
        };
        self.body.iter().map(share_for).fold(0.0, f64::max)
    }
}

/// How far two capsules are in one another, meters; negative where they are apart.
fn depth(first: &Capsule, second: &Capsule, motion: &Motion, frame: usize, radius: fn(&Both<f64>) -> f64) -> f64 {
    let [first_line, second_line] = [first, second].map(|part| part.ends.map(|end| motion.position(frame, end)));
    radius(&first.radius) + radius(&second.radius) - distance(first_line, second_line)
}

/// The distance between two line segments.
fn distance([a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> f64 {
    let (u, v, w) = (b - a, d - c, a - c);
    let (uu, uv, vv) = (u.length_squared(), u.dot(v), v.length_squared());
    let (uw, vw) = (u.dot(w), v.dot(w));
    let across = uu * vv - uv * uv;
    let share = |above: f64, below: f64| if below > 1e-18 { (above / below).clamp(0.0, 1.0) } else { 0.0 };
    let mut first = share(uv * vw - vv * uw, across);
    let second = share(uv * first + vw, vv);
    first = share(uv * second - uw, uu);
    (w + u * first - v * second).length()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_are_as_far_apart_as_they_are() {
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let cases = [
            ([-x, x], [y - z, y + z], 1.0, "they cross"),
            ([DVec3::ZERO, x], [x * 3.0, x * 4.0], 2.0, "in one line"),
            ([DVec3::ZERO, x], [y, y + x], 1.0, "side by side"),
            ([DVec3::ZERO, DVec3::ZERO], [y * 2.0, y * 2.0], 2.0, "points"),
            ([DVec3::ZERO, x], [x * 2.0 + y, x * 2.0 + y], 2.0_f64.sqrt(), "a point beyond the end"),
        ];
        for (first, second, expected, what) in cases {
            assert!((distance(first, second) - expected).abs() < 1e-9, "{what}: {}", distance(first, second));
            assert!((distance(second, first) - expected).abs() < 1e-9, "{what}, swapped");
        }
    }
}
