//! Where a limb has its three joints: hip, knee and ankle, or shoulder, elbow and wrist.

use glam::DVec3;

use super::{shape::Shape, twins::Pair};

/// Longer ways are cut off: fingers of many joints.
const MAX_JOINTS: usize = 14;

/// What limbs of a kind look like.
#[derive(Clone, Copy, Debug)]
pub(super) struct Proportions {
    /// Length of the upper segment over that of the lower one.
    upper_over_lower: f64,
    /// What may lie before the limb (clavicle, hip helper), as a share of both segments.
    before: f64,
    /// What may lie behind it (hand, foot).
    after: f64,
    /// Whether the end bends off (a foot).
    bends: bool,
    /// How far from the middle of a segment a joint may split it.
    splits: f64,
    /// How likely a limb is that nothing lies before: few arms come without a clavicle.
    bare: f64,
    /// Whether it rests stretched, so that what bends much is its end.
    rests_straight: bool,
}

pub(super) const ARM: Proportions = Proportions {
    upper_over_lower: 1.04,
    before: 0.5,
    after: 0.75,
    bends: false,
    splits: 0.23,
    bare: 0.7,
    rests_straight: false,
};
pub(super) const LEG: Proportions = Proportions {
    upper_over_lower: 1.0,
    before: 0.2,
    after: 0.5,
    bends: true,
    splits: 0.3,
    bare: 1.0,
    rests_straight: true,
};
/// Birds stand with their knees bent.
pub(super) const BIRD_LEG: Proportions = Proportions { rests_straight: false, ..LEG };

/// Spread of the ratio of the segments, as a logarithm.
const RATIO_SPREAD: f64 = 0.45;
/// The same of an arm that surely begins at its second joint: cartoons have short upper arms.
const SURE_RATIO_SPREAD: f64 = 0.75;
/// How much longer than its chord a segment may be.
const BEND_SPREAD: f64 = 0.1;

/// A joint that splits a shin where it bends by this angle is hardly one but the ankle: 26°.
const KINK: f64 = 0.45;
/// Knees rest bent by no more than this angle...
const RESTING_KNEE: f64 = 0.35;
/// ... and so much beyond it is more likely an ankle.
const KNEE_SPREAD: f64 = 0.5;

/// A first joint of an arm that is nearer to the middle than this share of how far the next one is, is a collar bone's...
const NEAR_MIDDLE: f64 = 0.42;
/// ... and a joint that splits an upper arm only so likely.
const COLLAR_AS_ARM: f64 = 0.02;

/// The places of three joints in a limb, and how much they look like it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct Segments {
    /// Hip or shoulder.
    pub upper: usize,
    /// Knee or elbow.
    pub lower: usize,
    /// Ankle or wrist.
    pub end: usize,
    /// From 0 to 1.
    pub score: f64,
}

/// The ways of seeing a pair as such limbs, best first; two at most.
pub(super) fn segments(shape: &Shape<'_>, pair: &Pair, proportions: Proportions) -> Vec<Segments> {
    let mut found = all_segments(shape, pair, proportions);
    found.truncate(2);
    found
}

/// All ways of seeing a pair as such limbs, best first.
pub(super) fn all_segments(shape: &Shape<'_>, pair: &Pair, proportions: Proportions) -> Vec<Segments> {
    let sides: [Way<'_>; 2] = [0, 1].map(|side| Way::new(shape, &pair.ways[side]));
    let count = sides[0].joints.len().min(sides[1].joints.len());
    let aside = |place: usize| sides[0].points[place].distance(sides[1].points[place]);
    let starts_inside = !proportions.bends && count > 1 && aside(0) < NEAR_MIDDLE * aside(1);
    let mut found: Vec<Segments> = Vec::new();
    for upper in 0..count {
        for lower in upper + 1..count {
            for end in lower + 1..count {
                let spread = if starts_inside && upper == 1 { SURE_RATIO_SPREAD } else { RATIO_SPREAD };
                let score =
                    sides.iter().map(|side| side.score([upper, lower, end], proportions, spread)).product::<f64>();
                let collar = if starts_inside && upper == 0 && lower > 1 { COLLAR_AS_ARM } else { 1.0 };
                found.push(Segments { upper, lower, end, score: score.sqrt() * collar });
            }
        }
    }
    // Joints in one place: the later one turns the limb, the earlier one is a helper.
    found.sort_by(|first, second| second.score.total_cmp(&first.score).then(second.upper.cmp(&first.upper)));
    found
}

struct Way<'a> {
    joints: &'a [usize],
    points: Vec<DVec3>,
    /// Length of the way to each joint.
    gone: Vec<f64>,
    /// The first joint that several ways go on from, and how many.
    fan: Option<usize>,
}

impl<'a> Way<'a> {
    fn new(shape: &Shape<'_>, way: &'a [usize]) -> Self {
        let joints = &way[..way.len().min(MAX_JOINTS)];
        let points: Vec<DVec3> = joints.iter().map(|joint| shape.positions[*joint]).collect();
        let mut gone = vec![0.0; points.len()];
        for index in 1..points.len() {
            gone[index] = gone[index - 1] + points[index].distance(points[index - 1]);
        }
        let is_fan = |joint: &usize| {
            let (far, near) = (0.2 * shape.reach[*joint], 1e-3 * shape.span);
            let ways = shape.children[*joint].iter().filter(|child| {
                shape.reach[**child] + shape.length[**child] > far.max(near) && shape.reach[**child] > near
            });
            ways.count() > 2
        };
        let fan = joints.iter().skip(2).position(is_fan).map(|place| place + 2);
        Self { joints, points, gone, fan }
    }

    fn score(&self, [upper, lower, end]: [usize; 3], proportions: Proportions, ratio_spread: f64) -> f64 {
        let chord = |from: usize, to: usize| self.points[from].distance(self.points[to]);
        let way = |from: usize, to: usize| self.gone[to] - self.gone[from];
        let (first, second) = (chord(upper, lower), chord(lower, end));
        let whole = way(0, self.points.len() - 1);
        if first <= 1e-3 * whole || second <= 1e-3 * whole {
            return 0.0;
        }
        let bell = |value: f64, spread: f64| (-(value / spread).powi(2)).exp();
        let ratio = bell((first / second / proportions.upper_over_lower).ln(), ratio_spread);
        let straight =
            bell(way(upper, lower) / first - 1.0, BEND_SPREAD) * bell(way(lower, end) / second - 1.0, BEND_SPREAD);
        let limb = first + second;
        let before = bell((way(0, upper) / limb - proportions.before).max(0.0), 0.15);
        let bare = if way(0, upper) < 0.03 * limb { proportions.bare } else { 1.0 };
        let after = bell((way(end, self.points.len() - 1) / limb - proportions.after).max(0.0), 0.3);
        let coverage = (limb / whole / 0.55).min(1.0);
        let hand = match self.fan {
            _ if proportions.bends => self.bend(lower, end),
            Some(fan) if fan == end => 1.0,
            Some(fan) if fan == end + 1 && way(end, fan) < 0.35 * second => 0.8,
            Some(_) => 0.25,
            None if end + 1 < self.points.len() => 0.95,
            None => 0.75,
        };
        // A segment is split near its middle, if at all; a joint near its end is more likely the end itself.
        let inner = (upper + 1..lower).map(|joint| way(upper, joint) / way(upper, lower));
        let inner = inner.chain((lower + 1..end).map(|joint| way(lower, joint) / way(lower, end)));
        let extra =
            inner.map(|share| if (share - 0.5).abs() <= proportions.splits { 0.97 } else { 0.6 }).product::<f64>();
        let in_shin = if proportions.rests_straight { lower + 1..end } else { end..end };
        let kinks = in_shin.map(|joint| bell(self.turn_at(joint), KINK)).product::<f64>();
        let knee = if proportions.rests_straight {
            let [thigh, shin] = [(upper, lower), (lower, end)].map(|(from, to)| self.points[to] - self.points[from]);
            bell((thigh.angle_between(shin) - RESTING_KNEE).max(0.0), KNEE_SPREAD)
        } else {
            1.0
        };
        ratio * straight * before * bare * after * coverage * hand * extra * kinks * knee
    }

    /// The angle between the bones before and behind a joint; none where one of them has no length.
    fn turn_at(&self, joint: usize) -> f64 {
        let (before, behind) =
            (self.points[joint] - self.points[joint - 1], self.points[joint + 1] - self.points[joint]);
        match (before.try_normalize(), behind.try_normalize()) {
            (Some(before), Some(behind)) => before.dot(behind).clamp(-1.0, 1.0).acos(),
            _ => 0.0,
        }
    }

    /// A foot bends off from the shin; what goes straight on is none.
    fn bend(&self, lower: usize, end: usize) -> f64 {
        let Some(beyond) = self.points.get(end + 1) else { return 0.85 };
        let (shin, foot) = (self.points[end] - self.points[lower], *beyond - self.points[end]);
        let cosine = shin.normalize_or_zero().dot(foot.normalize_or_zero());
        if foot.length() < 0.02 * shin.length() { 0.8 } else { 1.0 - 0.7 * ((cosine - 0.5) / 0.5).clamp(0.0, 1.0) }
    }
}
