//! Pairs of limbs: two ways down from one joint that are as long as one another, bone by bone.
//!
//! Lengths do not change with the pose, so this works on a figure in mid-stride as on one in a T pose.

use super::shape::Shape;

/// A limb has at least this share of the body's span.
const SHORTEST_LIMB: f64 = 0.14;
/// The ends of a pair are at least this far apart, as a share of the body's span.
const MIN_APART: f64 = 0.04;
/// Bones of a pair differ by no more than this share of the limb.
const MAX_DIFFERENCE: f64 = 0.06;
/// How much what hangs from a bone counts at most when bones are compared, as a share of the bone.
const MAX_BY_REACH: f64 = 0.5;
/// Longer ways are no limbs.
const LONGEST_WAY: usize = 20;
/// More joints than this that limbs could hang from are no body.
const MAX_CENTERS: usize = 256;
/// More pairs than this are no body that we know.
const MAX_PAIRS: usize = 24;

/// Two limbs that mirror one another.
#[derive(Clone, Debug)]
pub(super) struct Pair {
    /// The joint that both hang from.
    pub center: usize,
    /// The joints of each, from the body outward; as many on both sides.
    pub ways: [Vec<usize>; 2],
}

impl Pair {
    /// The same with its sides exchanged.
    pub(super) fn turned(&self) -> Self {
        let [first, second] = &self.ways;
        Self { center: self.center, ways: [second.clone(), first.clone()] }
    }
}

/// All pairs of limbs that hang from the middle of the body, longest first.
pub(super) fn find_pairs(shape: &Shape<'_>) -> Vec<Pair> {
    let mut inside = vec![false; shape.parent.len()];
    let mut pairs: Vec<(f64, Pair)> = Vec::new();
    let mut centers = 0;
    for center in &shape.order {
        inside[*center] |= shape.parent[*center].is_some_and(|above| inside[above]);
        if inside[*center] {
            continue;
        }
        let limbs: Vec<usize> = shape.children[*center]
            .iter()
            .copied()
            .filter(|limb| shape.reach[*limb] + shape.length[*limb] >= SHORTEST_LIMB * shape.span)
            .collect();
        centers += usize::from(limbs.len() > 1);
        if centers > MAX_CENTERS {
            break;
        }
        let best = |limb: usize| {
            let others = limbs.iter().filter(|other| **other != limb);
            let compared = others.filter_map(|other| Some((*other, compare(shape, limb, *other)?)));
            compared.min_by(|first, second| first.1.0.total_cmp(&second.1.0))
        };
        for limb in &limbs {
            let Some((twin, (_, ways))) = best(*limb) else { continue };
            let mutual = best(twin).is_some_and(|(back, _)| back == *limb);
            if twin > *limb && mutual {
                (inside[*limb], inside[twin]) = (true, true);
                pairs.push((shape.reach[*limb] + shape.length[*limb], Pair { center: *center, ways }));
            }
        }
    }
    pairs.sort_by(|first, second| second.0.total_cmp(&first.0));
    pairs.truncate(MAX_PAIRS);
    pairs.into_iter().map(|(_, pair)| pair).collect()
}

/// How much two limbs differ, and their joints; nothing where they are no pair.
fn compare(shape: &Shape<'_>, first: usize, second: usize) -> Option<(f64, [Vec<usize>; 2])> {
    let whole = (shape.reach[first] + shape.length[first]).max(shape.reach[second] + shape.length[second]);
    let mut difference = (shape.length[first] - shape.length[second]).abs();
    let mut ways = [vec![first], vec![second]];
    let (mut here, mut there) = (first, second);
    // Bones far out (fingers, a weapon) may differ; the limb itself may not.
    let mut gone = 0.0;
    while ways[0].len() < LONGEST_WAY {
        let Some(next) = shape.children[here].first().copied() else { break };
        // Something in one hand makes all above it reach farther, so that says less than the bone itself.
        let unlike = |other: &usize| {
            let reach = (shape.reach[*other] - shape.reach[next]).abs();
            (shape.length[*other] - shape.length[next]).abs() + 0.5 * reach.min(MAX_BY_REACH * shape.length[next])
        };
        let by_likeness = |one: &&usize, other: &&usize| unlike(one).total_cmp(&unlike(other));
        let Some(twin) = shape.children[there].iter().min_by(by_likeness).copied() else { break };
        gone += shape.length[next];
        let bone = (shape.length[next] - shape.length[twin]).abs();
        if gone < 0.7 * whole {
            difference += bone;
        } else if bone > MAX_DIFFERENCE * whole {
            break;
        }
        ways[0].push(next);
        ways[1].push(twin);
        (here, there) = (next, twin);
    }
    let apart =
        ways[0].iter().zip(&ways[1]).map(|(one, other)| shape.positions[*one].distance(shape.positions[*other]));
    let apart = apart.fold(0.0, f64::max);
    let share = difference / whole;
    // A weapon in one hand makes a limb longer, but not by much.
    let reaches = (shape.reach[first] - shape.reach[second]).abs() <= 0.5 * whole && ways[0].len() > 1;
    (reaches && share <= MAX_DIFFERENCE && apart >= MIN_APART * shape.span).then_some((share, ways))
}
