//! Hands that meet each other, the head or a shoulder: do they on the target?
//!
//! By joints alone: the gap between two of them, as a share of the body's length, while it is small on the source.

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
const NO_HANDS: &str = "no hands were recognized on both sides";
const FAR_APART: &str = "no hand of the source comes near the other, the head or a shoulder";

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
        let error = |pair: &Pair, frame: usize| {
            let of_source = gap(pair, false, frame);
            if of_source < SMALL { (gap(pair, true, frame) - of_source).abs() * 100.0 } else { f64::NAN }
        };
        let series = |pair: &Pair| Series {
            part: pair.name.clone(),
            joint: pair.joint,
            values: (0..compared.len()).map(|frame| error(pair, frame)).collect(),
        };
        self.pairs.iter().map(series).collect()
    }
}

/// How far small gaps differ.
pub(super) fn hand_gap(hands: Option<&Hands>, compared: &Compared) -> Finding {
    let series = hands.ok_or(NO_HANDS)?.series(compared);
    Reading::of_series(&series, &compared.frames.indices, 0.95).ok_or(FAR_APART)
}
