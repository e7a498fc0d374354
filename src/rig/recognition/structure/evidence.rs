//! What speaks for a body beside its limbs, and against it: branches that mirror one another are no rarity, and two pairs of them
//! in the right proportions are found in every other shrub.
//!
//! The numbers are those that part the rigs of the corpus, without their names, from random mirrored trees.

use glam::DVec3;

use super::{
    bodies::{Level, Upright, step},
    shape::Shape,
    trunk::{Ends, Trunk, find_animal_trunk, find_trunk},
    twins::Pair,
};

/// So many ways go on from a hand with fingers.
const FINGERS: usize = 3;
/// How much of what is lacking fingers make up for.
const FINGERS_SHARE: f64 = 0.4;

/// The score of an upright body with all that is seen of it.
pub(super) fn weigh_upright(shape: &Shape<'_>, body: &Upright) -> f64 {
    let up = body.trunk.normalize_or_zero();
    let limbs = first_joints(&[&body.legs.pair, &body.arms.pair]);
    let ends = Ends { pelvis: body.pelvis, chest: body.arms.pair.center, limbs: &limbs, tips: body.legs.has_tips() };
    let start = |side: usize| shape.positions[body.arms.pair.ways[side][body.arms.best.upper]];
    let (shoulders, across) = (start(0).midpoint(start(1)), (start(0) - start(1)).normalize_or_zero());
    let height = body.trunk.length();
    let trunk = find_trunk(shape, ends, shoulders, up, across, height);
    let head = trunk.head.map(|head| (shape.positions[head] - shoulders).dot(up) / height);
    let has_head = head.map_or(0.25, |head| 0.25 + 0.75 * step(head, -0.05, 0.1) * step(-head, -1.6, -1.0));
    let spine = match shape.way(body.pelvis, body.arms.pair.center).map_or(0, |way| way.len()) {
        0 => 0.35,
        1 => 0.7,
        _ => 1.0,
    };
    let leg = (body.legs.best.upper, body.legs.best.end);
    let legs_down = 0.4 + 0.6 * step(along(shape, &body.legs.pair, leg, -up), 0.6, 0.93);
    let parallel = 0.3 + 0.7 * step(parallel(shape, &body.legs.pair, leg), 0.5, 0.92);
    let extremities: Vec<usize> = [(&body.legs, body.legs.best.end), (&body.arms, body.arms.best.end)]
        .iter()
        .flat_map(|(limbs, end)| limbs.pair.ways.iter().map(|way| way[*end]))
        .collect();
    let pairs = [&body.legs.pair, &body.arms.pair];
    let explained = 1.0 - 0.6 * step(unexplained(shape, body.pelvis, &pairs, &trunk, &extremities), 0.25, 0.7);
    let score = body.score * has_head * spine * legs_down * parallel * explained;
    let fewest_ways = |ends: &[usize]| ends.iter().map(|end| shape.children[*end].len()).min().unwrap_or(0);
    let has_fingers = fewest_ways(&extremities[2..]) >= FINGERS && fewest_ways(&extremities[..2]) < FINGERS;
    if has_fingers { score + (1.0 - score) * FINGERS_SHARE } else { score }
}

/// The score of a body on four legs with all that is seen of it.
pub(super) fn weigh_level(shape: &Shape<'_>, body: &Level) -> f64 {
    let down = body.down.normalize_or_zero();
    let pairs = [&body.hind, &body.front];
    let limbs = first_joints(&pairs);
    let ends = Ends { pelvis: body.pelvis, chest: body.front.center, limbs: &limbs, tips: false };
    let ahead = body.trunk.normalize_or_zero();
    let across = down.cross(ahead).normalize_or_zero();
    let trunk = find_animal_trunk(shape, ends, (ahead - down).normalize_or_zero(), across);
    let has_head = if trunk.head.is_some() { 1.0 } else { 0.3 };
    let shared = |pair: &Pair| {
        let whole = (0, pair.ways[0].len() - 1);
        let upright = 0.3 + 0.7 * step(along(shape, pair, whole, down), 0.6, 0.9);
        upright * (0.3 + 0.7 * step(parallel(shape, pair, whole), 0.5, 0.9))
    };
    let paws: Vec<usize> = pairs.iter().flat_map(|pair| &pair.ways).filter_map(|way| way.last().copied()).collect();
    let explained = 1.0 - 0.7 * step(unexplained(shape, body.pelvis, &pairs, &trunk, &paws), 0.3, 0.7);
    body.score * has_head * shared(&body.hind) * shared(&body.front) * explained
}

fn first_joints(pairs: &[&Pair]) -> Vec<usize> {
    pairs.iter().flat_map(|pair| &pair.ways).map(|way| way[0]).collect()
}

/// From one joint of a limb to another, on both sides; unit vectors.
fn directions(shape: &Shape<'_>, pair: &Pair, (start, end): (usize, usize)) -> [DVec3; 2] {
    [0, 1].map(|side| {
        let way = &pair.ways[side];
        let place = |index: usize| shape.positions[way[index.min(way.len() - 1)]];
        (place(end) - place(start)).normalize_or_zero()
    })
}

/// The cosine between the two limbs of a pair.
fn parallel(shape: &Shape<'_>, pair: &Pair, span: (usize, usize)) -> f64 {
    let [one, other] = directions(shape, pair, span);
    one.dot(other)
}

/// The cosine of a pair against a direction, the mean of both sides.
fn along(shape: &Shape<'_>, pair: &Pair, span: (usize, usize), direction: DVec3) -> f64 {
    let [one, other] = directions(shape, pair, span);
    f64::midpoint(one.dot(direction), other.dot(direction))
}

/// The share of all bones, by length, that belong to no part of the body: neither to a limb, nor to the trunk, nor to what hangs
/// from a hand, a foot or the head.
fn unexplained(shape: &Shape<'_>, pelvis: usize, pairs: &[&Pair], trunk: &Trunk, extremities: &[usize]) -> f64 {
    let mut is_part = vec![false; shape.parent.len()];
    is_part[pelvis] = true;
    for way in pairs.iter().flat_map(|pair| &pair.ways) {
        let from_pelvis = shape.way(pelvis, way[0]).unwrap_or_default();
        for joint in way.iter().chain(&from_pelvis) {
            is_part[*joint] = true;
        }
    }
    for joint in trunk.spine.iter().chain(&trunk.neck).chain(&trunk.head) {
        is_part[*joint] = true;
    }
    let mut hangs = vec![false; shape.parent.len()];
    for joint in extremities.iter().chain(&trunk.head) {
        hangs[*joint] = true;
    }
    let (mut unexplained, mut all) = (0.0, 0.0);
    for joint in &shape.order {
        hangs[*joint] |= shape.parent[*joint].is_some_and(|above| hangs[above]);
        all += shape.length[*joint];
        // A joint beside a bone, with nothing below it, is a helper of that bone.
        let is_helper = shape.children[*joint].is_empty() && shape.parent[*joint].is_some_and(|above| is_part[above]);
        if !is_part[*joint] && !hangs[*joint] && !is_helper {
            unexplained += shape.length[*joint];
        }
    }
    if all > 0.0 { unexplained / all } else { 0.0 }
}
