//! Hands that meet each other, the head or a shoulder: do they on the target?
//!
//! By joints: the gap between two of them, while it is small and steady on the source. On the way there, arms of other lengths and shoulders
//! are elsewhere by right. What touches of a figure with thick hands and a large head has its joints farther apart by right, too: a gap may be
//! as large beside the source's as the bodies are, or as thick as what touches is, or anything between.

use glam::DVec3;

use super::{
    body::{Size, first_joint},
    clearance::{least_share, turned_arm},
    metric::{Finding, Reading, Series},
    motion::{Both, Compared, Motion, Wanted},
};
use crate::rig::{Limb, Rig, body_capsules, palm};

/// Pairs whose gap is looked at.
const PAIRS: [(&str, &str); 5] = [
    ("left_hand", "right_hand"),
    ("left_hand", "head"),
    ("right_hand", "head"),
    ("left_hand", "right_upper_arm"),
    ("right_hand", "left_upper_arm"),
];
/// What stands for a hand, in order of preference: the knuckles, else the wrist.
const KNUCKLES: [&str; 2] = ["middle", "index"];
/// A gap is small below this share of the body's length.
const SMALL: f64 = 0.15;
/// It is steady where it changes by less than this share of the body's length in a second, from the frame before to the next one: at the
/// turn of a clap, too.
const STEADY: f64 = 0.4;
/// Arms of the target may point elsewhere for hands of the source whose gap is below this share of the body's length, until the target's are as
/// near to each other but for the other share.
const NEAR: f64 = 0.25;
const TOGETHER: f64 = 0.01;
const NO_HANDS: &str = "no hands were recognized on both sides";
const FAR_APART: &str = "no hand of the source stays near the other, the head or a shoulder";

/// What is looked at.
pub(super) struct Hands {
    pairs: Vec<Pair>,
    bodies: Both<f64>,
}

struct Pair {
    name: String,
    joint: usize,
    points: [usize; 2],
    /// By which factors gaps of the source may grow on the target, at the least and the most.
    grown: [f64; 2],
    /// Whether both are hands, the left one first.
    is_of_hands: bool,
}

impl Pair {
    /// From the second to the first.
    fn between(&self, motion: &Motion, frame: usize) -> DVec3 {
        motion.position(frame, self.points[0]) - motion.position(frame, self.points[1])
    }

    /// By how much a gap of the target is larger or smaller than it may be for one of the source, meters.
    fn error(&self, of_source: f64, of_target: f64) -> f64 {
        let [least, most] = self.grown.map(|grown| of_source * grown);
        (of_target - of_target.clamp(least, most)).abs()
    }

    /// How far the first is from where it may be about the second, in the direction of the source's, too; meters.
    fn astray(&self, of_source: DVec3, of_target: DVec3) -> f64 {
        let [least, most] = self.grown;
        let grown = of_target.dot(of_source) / of_source.length_squared().max(f64::MIN_POSITIVE);
        of_target.distance(of_source * grown.clamp(least, most))
    }
}

impl Hands {
    pub(super) fn find(rigs: &Both<&Rig<'_>>, sizes: &Both<Size>, wanted: &mut Wanted) -> Option<Self> {
        let bodies = Both { source: sizes.source.body?, target: sizes.target.body? };
        let point = |role: &str| {
            let side = role.strip_suffix("_hand");
            let knuckle =
                side.and_then(|side| KNUCKLES.iter().find_map(|finger| first_joint(rigs, &format!("{side}_{finger}"))));
            knuckle.or_else(|| first_joint(rigs, role))
        };
        let mut pairs = Vec::new();
        for (first, second) in PAIRS {
            if let (Some(hand), Some(other)) = (point(first), point(second)) {
                let points = [wanted.joint(hand), wanted.joint(other)];
                let by_body = bodies.target / bodies.source;
                let thick = |rig: &Rig<'_>| Some((thickness(rig, first)? + thickness(rig, second)?) * rig.unit_meters);
                let by_thickness =
                    thick(rigs.source).zip(thick(rigs.target)).map_or(by_body, |(source, target)| target / source);
                let grown = [by_body.min(by_thickness), by_body.max(by_thickness)];
                let is_of_hands = (first, second) == PAIRS[0];
                pairs.push(Pair { name: format!("{first} {second}"), joint: hand.target, points, grown, is_of_hands });
            }
        }
        (!pairs.is_empty()).then_some(Self { pairs, bodies })
    }

    /// The share of the way from where the arms of the source point to where the target's point that brings its hands to each other: none where
    /// the source's are apart, and where it does not. The slots are those of shoulder, elbow and wrist of the left arm and the right one.
    pub(super) fn together(&self, arms: [[usize; 3]; 2], compared: &Compared, frame: usize) -> f64 {
        let Some(pair) = self.pairs.iter().find(|pair| pair.is_of_hands) else { return 0.0 };
        let of_source = pair.between(&compared.source, frame);
        if of_source.length() > NEAR * self.bodies.source {
            return 0.0;
        }
        let between = pair.between(&compared.target, frame);
        let moved = |slots: [usize; 3], share: f64| {
            let [_, wrist] = turned_arm(slots, compared, frame, share);
            wrist - compared.target.position(frame, slots[2])
        };
        let error = |share: f64| {
            let [left, right] = arms.map(|slots| moved(slots, share));
            pair.astray(of_source, between + left - right)
        };
        let left = error(1.0);
        let is_together = |share: f64| error(share) <= left.max(TOGETHER * self.bodies.target);
        if left < error(0.0) { least_share(is_together) } else { 0.0 }
    }

    fn series(&self, compared: &Compared) -> Vec<Series> {
        let errors = |pair: &Pair| {
            let mut errors = vec![f64::NAN; compared.len()];
            for run in &compared.frames.runs {
                let of_source: Vec<f64> = run
                    .clone()
                    .map(|frame| pair.between(&compared.source, frame).length() / self.bodies.source)
                    .collect();
                let is_steady = is_steady(&of_source, &compared.performed_seconds[run.clone()]);
                for (index, frame) in run.clone().enumerate() {
                    if of_source[index] < SMALL && is_steady[index] {
                        let of_target = pair.between(&compared.target, frame).length();
                        let error = pair.error(of_source[index] * self.bodies.source, of_target);
                        errors[frame] = error / self.bodies.target * 100.0;
                    }
                }
            }
            errors
        };
        let series = |pair: &Pair| Series { part: pair.name.clone(), joint: pair.joint, values: errors(pair) };
        self.pairs.iter().map(series).collect()
    }
}

/// How thick a part is that touches, from its middle, in the rig's unit.
fn thickness(rig: &Rig<'_>, part: &str) -> Option<f64> {
    match part {
        "left_hand" => palm(rig, Limb::LeftArm).map(|palm| palm.radius),
        "right_hand" => palm(rig, Limb::RightArm).map(|palm| palm.radius),
        _ => body_capsules(rig).iter().find(|(name, _)| *name == part).map(|(_, capsule)| capsule.radius),
    }
}

/// In which frames gaps hardly change.
fn is_steady(gaps: &[f64], times_seconds: &[f64]) -> Vec<bool> {
    let last = gaps.len().saturating_sub(1);
    let is_steady = |frame: usize| {
        let (before, after) = (frame.saturating_sub(1), (frame + 1).min(last));
        (gaps[after] - gaps[before]).abs() <= STEADY * (times_seconds[after] - times_seconds[before])
    };
    (0..gaps.len()).map(is_steady).collect()
}

/// How far small gaps differ.
pub(super) fn hand_gap(hands: Option<&Hands>, compared: &Compared) -> Finding {
    let series = hands.ok_or(NO_HANDS)?.series(compared);
    Reading::of_series(&series, &compared.frames.indices, 0.95).ok_or(FAR_APART)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_steady_where_hands_are_held_and_where_they_clap() {
        let times: Vec<f64> = (0..6).map(|frame| f64::from(frame) / 30.0).collect();
        assert_eq!(is_steady(&[0.1; 6], &times), [true; 6], "held");
        let clap = [0.3, 0.2, 0.1, 0.0, 0.1, 0.2];
        assert_eq!(is_steady(&clap, &times), [false, false, false, true, false, false], "the turn of a clap");
        assert_eq!(is_steady(&[0.1], &[0.0]), [true], "a pose");
        assert!(is_steady(&[], &[]).is_empty());
    }
}
