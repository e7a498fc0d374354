//! Hands that meet each other, the head or a shoulder: do they on the target?
//!
//! By joints alone: the gap between two of them, as a share of the body's length, while it is small and steady on the source. On the way
//! there, arms of other lengths and shoulders are elsewhere by right.

use super::{
    body::{Size, first_joint},
    metric::{Finding, Reading, Series},
    motion::{Both, Compared, Wanted},
};
use crate::rig::Rig;

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
                pairs.push(Pair { name: format!("{first} {second}"), joint: hand.target, points });
            }
        }
        (!pairs.is_empty()).then_some(Self { pairs, bodies })
    }

    fn series(&self, compared: &Compared) -> Vec<Series> {
        let gap = |pair: &Pair, is_target: bool, frame: usize| {
            let (side, body) =
                (compared.side(is_target), if is_target { self.bodies.target } else { self.bodies.source });
            side.position(frame, pair.points[0]).distance(side.position(frame, pair.points[1])) / body
        };
        let errors = |pair: &Pair| {
            let mut errors = vec![f64::NAN; compared.len()];
            for run in &compared.frames.runs {
                let of_source: Vec<f64> = run.clone().map(|frame| gap(pair, false, frame)).collect();
                let is_steady = is_steady(&of_source, &compared.performed_seconds[run.clone()]);
                for (index, frame) in run.clone().enumerate() {
                    if of_source[index] < SMALL && is_steady[index] {
                        errors[frame] = (gap(pair, true, frame) - of_source[index]).abs() * 100.0;
                    }
                }
            }
            errors
        };
        let series = |pair: &Pair| Series { part: pair.name.clone(), joint: pair.joint, values: errors(pair) };
        self.pairs.iter().map(series).collect()
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
