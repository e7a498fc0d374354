//! Bodies on six and more legs: spiders, insects, crabs, dragons of fancy.
//!
//! Pairs of limbs whose ends lie in one plane that everything else is above stand on the ground. Which way is front is a question
//! of what else the body has: a face and feelers ahead, a tail or an abdomen behind.

use glam::{DVec2, DVec3};

use super::{
    bodies::step,
    plane::Plane,
    shape::Shape,
    trunk::{Ends, Trunk, find_animal_trunk},
};

/// Fewer pairs of legs are no crawler.
const FEWEST_PAIRS: usize = 3;
/// More pairs than this are not counted as legs.
const MAX_PAIRS: usize = 64;
/// Feet are within this share of the longest limb of the ground.
const ON_GROUND: f64 = 0.04;
/// A leg has at least this share of the length of the longest.
const SHORTEST_LEG: f64 = 0.35;
/// A leg has at least so many joints.
const FEWEST_JOINTS: usize = 3;
/// A leg rises from its foot at least this share of its length.
const MIN_RISE: f64 = 0.12;
/// Two ends that share more of their way than this share of it belong to one limb: toes of a foot, fingers of a wing.
const ONE_LIMB_SHARE: f64 = 0.35;
/// Feet of two pairs are at least this far from one another, as a share of the body's span, to show how the ground lies.
const MIN_BASE: f64 = 0.02;
/// Evidence that is weaker does not say which end is the front.
const MIN_FACING: f64 = 0.4;

/// A body on six and more legs.
#[derive(Clone, Debug)]
pub(super) struct Crawler {
    /// From the front; the left one of each pair first, from the body outward.
    pub legs: Vec<[Vec<usize>; 2]>,
    /// Everything hangs from it.
    pub pelvis: usize,
    /// The front legs hang from it.
    pub chest: usize,
    pub trunk: Trunk,
    /// Behind the last leg.
    pub tail: Vec<usize>,
    pub up: DVec3,
    pub forward: DVec3,
    /// Whether something shows which end is the front.
    pub facing_known: bool,
    /// From 0 to 1.
    pub score: f64,
}

/// A pair of ways from the plane to two ends that mirror one another.
#[derive(Clone, Debug)]
pub(super) struct Ways {
    pub ways: [Vec<usize>; 2],
    pub length: f64,
}

/// The likeliest crawler.
pub(super) fn find_crawler(shape: &Shape<'_>, plane: &Plane) -> Option<Crawler> {
    let pairs = paired_ways(shape, plane);
    if pairs.len() < FEWEST_PAIRS {
        return None;
    }
    let (up, legs) = find_ground(shape, plane, &pairs)?;
    let legs = without_shared(shape, legs);
    let axis = up.cross(plane.normal).try_normalize()?;
    let (forward, facing_known) = find_forward(shape, plane, &legs, axis, up);
    describe(shape, plane, legs, (up, forward, facing_known))
}

/// All pairs of ways out of the plane that mirror one another, the longest first.
pub(super) fn paired_ways(shape: &Shape<'_>, plane: &Plane) -> Vec<Ways> {
    let mut found = Vec::new();
    for end in shape.order.iter().filter(|joint| shape.children[**joint].is_empty()) {
        let Some(twin) = plane.twin[*end].filter(|_| plane.distance(shape.positions[*end]) > 0.0) else { continue };
        let (one, other) = (way_out(shape, plane, *end), way_out(shape, plane, twin));
        if twin != *end && one.len() == other.len() && !one.is_empty() {
            let length = length_of(shape, &one);
            found.push(Ways { ways: [one, other], length });
        }
    }
    found.sort_by(|one, other| other.length.total_cmp(&one.length));
    found.truncate(2 * MAX_PAIRS);
    found
}

/// The joints out of the plane on the way to an end.
fn way_out(shape: &Shape<'_>, plane: &Plane, end: usize) -> Vec<usize> {
    let mut way = vec![end];
    while let Some(above) = way.last().and_then(|joint| shape.parent[*joint]) {
        if plane.holds(shape.positions[above]) {
            break;
        }
        way.push(above);
    }
    way.reverse();
    way
}

/// The length of a way along its bones, from its first joint.
fn length_of(shape: &Shape<'_>, way: &[usize]) -> f64 {
    way.iter().skip(1).map(|joint| shape.length[*joint]).sum()
}

/// Up, and the pairs that stand: the line in the plane that most pairs end on and nothing is below.
fn find_ground(shape: &Shape<'_>, plane: &Plane, pairs: &[Ways]) -> Option<(DVec3, Vec<Ways>)> {
    let across = plane.normal.any_orthonormal_vector();
    let axes = [across, plane.normal.cross(across)];
    let flat = |joint: usize| DVec2::new(shape.positions[joint].dot(axes[0]), shape.positions[joint].dot(axes[1]));
    let end = |pair: &Ways| pair.ways[0].last().map_or(DVec2::ZERO, |joint| flat(*joint));
    let all: Vec<DVec2> = shape.order.iter().map(|joint| flat(*joint)).collect();
    let ends: Vec<DVec2> = pairs.iter().map(end).collect();
    let near = ON_GROUND * pairs.first()?.length;
    let mut best: Option<(usize, f64, DVec2, Vec<usize>)> = None;
    for (index, one) in ends.iter().enumerate() {
        for other in ends.iter().skip(index + 1) {
            let line = *other - *one;
            if line.length() < MIN_BASE * shape.span {
                continue;
            }
            for up in [line.perp().normalize(), -line.perp().normalize()] {
                let height = |point: &DVec2| (*point - *one).dot(up);
                if all.iter().any(|point| height(point) < -near) {
                    continue;
                }
                let on_ground = |index: &usize| height(&ends[*index]).abs() <= near;
                let standing: Vec<usize> = (0..pairs.len()).filter(on_ground).collect();
                let legs = legs_of(shape, pairs, &standing, |joint| height(&flat(joint)));
                let off: f64 = legs.iter().map(|leg| height(&ends[*leg]).abs()).sum();
                let is_better = best.as_ref().is_none_or(|best| (legs.len(), -off) > (best.0, -best.1));
                if legs.len() >= FEWEST_PAIRS && is_better {
                    best = Some((legs.len(), off, up, legs));
                }
            }
        }
    }
    let (_, _, up, legs) = best?;
    let up = (axes[0] * up.x + axes[1] * up.y).try_normalize()?;
    Some((up, legs.into_iter().map(|leg| pairs[leg].clone()).collect()))
}

/// Of the pairs that end on the ground those that are legs: long enough, with a rise, and one for all toes of a foot.
fn legs_of(shape: &Shape<'_>, pairs: &[Ways], standing: &[usize], height: impl Fn(usize) -> f64) -> Vec<usize> {
    let mut legs: Vec<usize> = Vec::new();
    for candidate in standing {
        let pair = &pairs[*candidate];
        let longest = legs.first().map_or(pair.length, |leg| pairs[*leg].length);
        let top = pair.ways[0].iter().map(|joint| height(*joint)).fold(0.0, f64::max);
        let is_toe =
            legs.iter().any(|leg| shared(shape, &pairs[*leg].ways[0], &pair.ways[0]) > ONE_LIMB_SHARE * pair.length);
        let is_long = pair.length >= SHORTEST_LEG * longest && pair.ways[0].len() >= FEWEST_JOINTS;
        if is_long && !is_toe && top >= MIN_RISE * pair.length && legs.len() < MAX_PAIRS {
            legs.push(*candidate);
        }
    }
    legs
}

/// How much of the way of two limbs is the same, by length.
fn shared(shape: &Shape<'_>, one: &[usize], other: &[usize]) -> f64 {
    let common = one.iter().zip(other).take_while(|(one, other)| one == other).count();
    length_of(shape, &one[..common])
}

/// The legs without the joints that several of them start with: those steer all of them, and are none of one.
fn without_shared(shape: &Shape<'_>, legs: Vec<Ways>) -> Vec<Ways> {
    let starts_with_others = |own: usize, side: usize, place: usize| {
        let joint = legs[own].ways[side][place];
        let in_place = |other: usize| shape.positions[other].distance(shape.positions[joint]) <= 1e-3 * shape.span;
        let others = legs.iter().enumerate().filter(|(index, _)| *index != own);
        let has_it = |leg: &Ways| leg.ways[side].get(place).is_some_and(|other| *other == joint || in_place(*other));
        others.filter(|(_, leg)| has_it(leg)).count() > 0
    };
    let trimmed = legs.iter().enumerate().map(|(index, leg)| {
        let most = leg.ways[0].len().saturating_sub(FEWEST_JOINTS);
        let shared = (0..most).take_while(|place| starts_with_others(index, 0, *place)).count();
        let ways = [0, 1].map(|side| leg.ways[side][shared..].to_vec());
        Ways { length: length_of(shape, &ways[0]), ways }
    });
    trimmed.collect()
}

/// Which end of the body is the front, and whether anything shows it.
fn find_forward(shape: &Shape<'_>, plane: &Plane, legs: &[Ways], axis: DVec3, up: DVec3) -> (DVec3, bool) {
    let along = |joint: usize| shape.positions[joint].dot(axis);
    let starts = || legs.iter().map(|leg| along(leg.ways[0][0]));
    let (low, high) =
        starts().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), start| (low.min(start), high.max(start)));
    let middle = f64::midpoint(low, high);
    let leg_length = legs.first().map_or(0.0, |leg| leg.length);
    let is_leg = {
        let mut is_leg = vec![false; shape.parent.len()];
        legs.iter().flat_map(|leg| leg.ways.iter().flatten()).for_each(|joint| is_leg[*joint] = true);
        is_leg
    };
    // What is behind a body is longer than what is ahead: a tail or an abdomen against a head.
    let central = shape.order.iter().filter(|joint| plane.holds(shape.positions[**joint]));
    let (ahead, behind) = central.fold((0.0_f64, 0.0_f64), |(ahead, behind), joint| {
        (ahead.max(along(*joint) - high), behind.max(low - along(*joint)))
    });
    let mut evidence = if ahead + behind > 0.05 * leg_length { 0.8 * (behind - ahead) / (behind + ahead) } else { 0.0 };
    // Eyes, feelers and jaws are small, come in pairs, and are at the front.
    for pair in paired_ways(shape, plane) {
        let (start, end) = (pair.ways[0][0], pair.ways[0][pair.ways[0].len() - 1]);
        let is_small = pair.length + shape.length[start] < leg_length * 0.6;
        let place = f64::midpoint(along(start), along(end));
        if !is_leg[start] && is_small && !(low..=high).contains(&place) {
            evidence += 0.7 * (place - middle).signum();
        }
    }
    // What carries the whole body is at its rear, where it is not in the middle.
    if let Some(top) = shape.order.iter().find(|joint| shape.children[**joint].len() > 1) {
        evidence += 0.5 * step(middle - along(*top), 0.02 * leg_length, 0.1 * leg_length);
        evidence -= 0.5 * step(along(*top) - middle, 0.02 * leg_length, 0.1 * leg_length);
    }
    if evidence.abs() >= MIN_FACING {
        return (axis * evidence.signum(), true);
    }
    // Without anything that says so: as if the body faced the front of our space.
    let front = if up.y.abs() > 0.5 { DVec3::Z } else { DVec3::NEG_Y };
    (if axis.dot(front) < 0.0 { -axis } else { axis }, false)
}

fn describe(
    shape: &Shape<'_>,
    plane: &Plane,
    mut legs: Vec<Ways>,
    (up, forward, facing_known): (DVec3, DVec3, bool),
) -> Option<Crawler> {
    let left = up.cross(forward);
    let along = |way: &[usize]| {
        way.iter().map(|joint| shape.positions[*joint].dot(forward)).sum::<f64>() / way.len().max(1) as f64
    };
    legs.sort_by(|one, other| along(&other.ways[0]).total_cmp(&along(&one.ways[0])));
    let longest = legs.iter().map(|leg| leg.length).fold(0.0, f64::max);
    let shortest = legs.iter().map(|leg| leg.length).fold(f64::INFINITY, f64::min);
    let is_left = plane.normal.dot(left) > 0.0;
    let legs: Vec<[Vec<usize>; 2]> = legs
        .into_iter()
        .map(|Ways { ways: [one, other], .. }| if is_left { [one, other] } else { [other, one] })
        .collect();
    let firsts: Vec<usize> = legs.iter().flatten().map(|way| way[0]).collect();
    let carrier = firsts.iter().try_fold(firsts[0], |above, joint| shape.common_ancestor(above, *joint))?;
    // The body goes from the rearmost joint in the plane to the foremost one.
    let central: Vec<usize> =
        shape.order.iter().copied().filter(|joint| plane.holds(shape.positions[*joint])).collect();
    let place = |joint: usize| shape.positions[joint].dot(forward);
    let starts = || firsts.iter().map(|joint| place(*joint));
    let (rear, front) = (starts().fold(f64::INFINITY, f64::min), starts().fold(f64::NEG_INFINITY, f64::max));
    let is_end = |joint: &&usize| shape.children[**joint].is_empty();
    let last = central.iter().filter(is_end).min_by(|one, other| place(**one).total_cmp(&place(**other)));
    let last = last.copied().filter(|joint| place(*joint) < rear);
    let foremost = central.iter().max_by(|one, other| place(**one).total_cmp(&place(**other)));
    let foremost = foremost.copied().filter(|joint| place(*joint) > front);
    let pelvis =
        [last, foremost].into_iter().flatten().try_fold(carrier, |above, joint| shape.common_ancestor(above, joint))?;
    let [left_first, right_first] = [0, 1].map(|side| legs[0][side][0]);
    let chest = shape.common_ancestor(left_first, right_first)?;
    // What leads to a leg is no neck.
    let to_leg = |first: &usize| shape.way(chest, *first).unwrap_or_default();
    let limbs: Vec<usize> = firsts.iter().flat_map(to_leg).chain(firsts.iter().copied()).collect();
    let trunk = find_animal_trunk(
        shape,
        Ends { pelvis, chest, limbs: &limbs, tips: false },
        (forward + 0.3 * up).normalize(),
        left,
    );
    // A tail begins behind the last joint that carries a leg or the head.
    let carries = |joint: usize| {
        let below = |other: usize| shape.common_ancestor(joint, other) == Some(joint);
        firsts.iter().any(|first| below(*first)) || trunk.head.is_some_and(below)
    };
    let tail = last.and_then(|last| shape.way(pelvis, last)).unwrap_or_default();
    let tail: Vec<usize> = tail.into_iter().filter(|joint| !carries(*joint)).collect();
    let explained = explained(shape, pelvis, &legs, &[&trunk.spine, &trunk.neck, &tail], trunk.head);
    // Legs of one body are alike, stand on their ends, and with the trunk they are most of it.
    let counts = || legs.iter().map(|[way, _]| way.len());
    let uneven = counts().max().unwrap_or(0) - counts().min().unwrap_or(0);
    let on_foot = legs.iter().filter(|[way, _]| stands_on_end(shape, way, up)).count() as f64 / legs.len() as f64;
    let score = step(plane.share, 0.75, 0.95)
        * [1.0, 0.6, 0.3].get(uneven).copied().unwrap_or(0.1)
        * (0.3 + 0.7 * step(shortest / longest, 0.4, 0.65))
        * on_foot.powi(3)
        * (0.1 + 0.9 * step(explained, 0.45, 0.75))
        * if trunk.head.is_some() { 1.0 } else { 0.3 }
        * if facing_known { 1.0 } else { 0.6 };
    Some(Crawler { legs, pelvis, chest, trunk, tail, up, forward, facing_known, score })
}

/// Whether a leg ends where it is lowest, and leads down there: what happens to touch the ground elsewhere is no leg.
fn stands_on_end(shape: &Shape<'_>, way: &[usize], up: DVec3) -> bool {
    let height = |joint: &usize| shape.positions[*joint].dot(up);
    let [.., before, last] = way else { return false };
    let is_lowest = way.iter().all(|joint| height(joint) >= height(last) - 1e-3 * shape.span);
    // A foot or a claw may lie flat on the ground; the bone above it leads down.
    let above = way.len().checked_sub(3).and_then(|index| way.get(index)).unwrap_or(before);
    is_lowest && height(above) > height(last) + 0.2 * (shape.length[*last] + shape.length[*before])
}

/// The share of all bones, by length, that are part of the body's legs, its trunk, or what hangs from its head.
pub(super) fn explained(
    shape: &Shape<'_>,
    pelvis: usize,
    legs: &[[Vec<usize>; 2]],
    trunk: &[&Vec<usize>],
    head: Option<usize>,
) -> f64 {
    let mut is_part = vec![false; shape.parent.len()];
    for way in legs.iter().flatten() {
        let to_body = shape.way(pelvis, way[0]).unwrap_or_default();
        way.iter().chain(&to_body).for_each(|joint| is_part[*joint] = true);
    }
    trunk.iter().copied().flatten().for_each(|joint| is_part[*joint] = true);
    let ends: Vec<usize> = legs.iter().flatten().filter_map(|way| way.last().copied()).chain(head).collect();
    let mut hangs = vec![false; shape.parent.len()];
    let (mut explained, mut all) = (0.0, 0.0);
    for joint in &shape.order {
        hangs[*joint] = ends.contains(joint) || shape.parent[*joint].is_some_and(|above| hangs[above]);
        let length = shape.length[*joint];
        // What carries the pelvis (a root on the floor) is no part of the question.
        if shape.common_ancestor(pelvis, *joint) == Some(pelvis) && *joint != pelvis {
            all += length;
            explained += if is_part[*joint] || hangs[*joint] { length } else { 0.0 };
        }
    }
    if all > 0.0 { explained / all } else { 0.0 }
}
