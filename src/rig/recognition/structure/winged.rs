//! Birds: two legs below a trunk that leans forward, and wings that are spread.
//!
//! Arms of a figure that stands upright are never wings here: what leans tells them apart.

use glam::DVec3;

use super::{
    bodies::{Limbs, step},
    crawler::{Ways, explained, paired_ways},
    limb::{BIRD_LEG, segments},
    plane::Plane,
    shape::Shape,
    trunk::{Ends, Trunk, find_animal_trunk},
    twins::Pair,
};

/// A trunk nearer to upright than this cosine may be that of a human with arms.
const UPRIGHT_COSINE: f64 = 0.86;
/// Wings are spread: the cosine of their way against the plane's normal.
const SPREAD_COSINE: f64 = 0.5;
/// A wing has at least this share of a leg's length.
const SHORTEST_WING: f64 = 0.8;
/// Legs and wings have at least so many joints.
const FEWEST_JOINTS: usize = 3;
/// Nothing is below the feet by more than this share of a leg.
const BELOW_FEET: f64 = 0.15;
/// Limbs shorter than this share of the longest are none.
const SHORTEST_LIMB: f64 = 0.15;
/// More limbs than this are no bird.
const MAX_LIMBS: usize = 24;

/// A body on two legs, with wings.
#[derive(Clone, Debug)]
pub(super) struct Winged {
    pub legs: Limbs,
    pub wings: Pair,
    pub pelvis: usize,
    pub trunk: Trunk,
    pub tail: Vec<usize>,
    pub up: DVec3,
    pub forward: DVec3,
    /// From 0 to 1.
    pub score: f64,
}

/// The likeliest bird.
pub(super) fn find_winged(shape: &Shape<'_>, plane: &Plane) -> Option<Winged> {
    let limbs = limbs(shape, plane);
    let pairs = || limbs.iter().flat_map(|legs| limbs.iter().map(move |wings| (legs, wings)));
    let found = pairs().filter(|(legs, wings)| legs.ways[0][0] != wings.ways[0][0]);
    let found = found.filter_map(|(legs, wings)| {
        let winged = stand(shape, plane, legs, wings)?;
        // Who stands on more than two legs is a dragon.
        let others = limbs.iter().filter(|limb| limb.ways[0][0] != legs.ways[0][0]);
        let foot = |pair: &Pair| pair.ways[0].last().map_or(0.0, |end| shape.positions[*end].dot(winged.up));
        let tall = shape.positions[legs.ways[0][0]].dot(winged.up) - foot(legs);
        let stands = |limb: &Pair| foot(limb) - foot(legs) < 0.3 * tall;
        (!others.into_iter().any(stands)).then_some(winged)
    });
    found.reduce(|best, other| if other.score > best.score { other } else { best })
}

/// One pair of ways for all that hang in one place: the longest.
fn limbs(shape: &Shape<'_>, plane: &Plane) -> Vec<Pair> {
    let mut limbs: Vec<Pair> = Vec::new();
    let pairs = paired_ways(shape, plane);
    let shortest = pairs.first().map_or(0.0, |pair| SHORTEST_LIMB * pair.length);
    for Ways { ways, length } in pairs {
        let is_new = !limbs.iter().any(|limb| limb.ways[0][0] == ways[0][0]);
        let center = shape.parent[ways[0][0]];
        if let Some(center) = center.filter(|_| is_new && ways[0].len() >= FEWEST_JOINTS && length >= shortest) {
            limbs.push(Pair { center, ways });
        }
    }
    limbs.truncate(MAX_LIMBS);
    limbs
}

/// A pair of wings with all that hangs from them: fingers and feathers.
fn below(shape: &Shape<'_>, wings: &Pair) -> Vec<usize> {
    let mut below: Vec<usize> = wings.ways.iter().map(|way| way[0]).collect();
    let mut next = 0;
    while let Some(joint) = below.get(next) {
        below.extend(shape.children[*joint].iter().copied());
        next += 1;
    }
    below
}

fn stand(shape: &Shape<'_>, plane: &Plane, legs: &Pair, wings: &Pair) -> Option<Winged> {
    let place = |joint: usize| shape.positions[joint] - plane.normal * plane.distance(shape.positions[joint]);
    let start = |pair: &Pair| place(pair.ways[0][0]);
    let length = |pair: &Pair| pair.ways[0].iter().skip(1).map(|joint| shape.length[*joint]).sum::<f64>();
    let way = |pair: &Pair| pair.ways[0].last().map_or(DVec3::ZERO, |end| shape.positions[*end]);
    let (leg_length, wing_length) = (length(legs), length(wings));
    let limb = segments(shape, legs, BIRD_LEG);
    let best = *limb.first()?;
    // Toes point ahead; the ankle's way from the hip says better where down is.
    let up = (start(legs) - place(legs.ways[0][best.end])).try_normalize()?;
    let trunk_line = start(wings) - start(legs);
    let forward = (trunk_line - trunk_line.dot(up) * up).try_normalize()?;
    let across = (way(wings) - shape.positions[wings.ways[0][0]]).normalize_or_zero().dot(plane.normal).abs();
    let ground = legs.ways[0].iter().map(|joint| shape.positions[*joint].dot(up)).fold(f64::INFINITY, f64::min);
    let lowest = shape.order.iter().map(|joint| shape.positions[*joint].dot(up)).fold(f64::INFINITY, f64::min);
    let is_low = way(wings).dot(up) - ground < 0.4 * leg_length;
    let leans = trunk_line.normalize().dot(up);
    // A root on the floor may lie a little below the feet.
    if !(-0.3..UPRIGHT_COSINE).contains(&leans)
        || across < SPREAD_COSINE
        || wing_length < SHORTEST_WING * leg_length
        || is_low
        || lowest < ground - BELOW_FEET * leg_length
    {
        return None;
    }
    let pelvis = shape.common_ancestor(legs.center, wings.center)?;
    let firsts: Vec<usize> = [legs, wings].iter().flat_map(|pair| &pair.ways).map(|way| way[0]).collect();
    let ends = Ends { pelvis, chest: wings.center, limbs: &firsts, tips: false };
    let trunk = find_animal_trunk(shape, ends, (forward + up).normalize(), plane.normal);
    let head = trunk.head?;
    let behind = |joint: &usize| (place(*joint) - start(legs)).dot(forward);
    let last = shape.order.iter().copied().filter(|joint| {
        shape.children[*joint].is_empty()
            && plane.holds(shape.positions[*joint])
            && shape.common_ancestor(pelvis, *joint) == Some(pelvis)
    });
    let last = last.min_by(|one, other| behind(one).total_cmp(&behind(other)));
    let last = last.filter(|joint| behind(joint) < -0.1 * leg_length);
    let carries = |joint: usize| {
        let below = |other: usize| shape.common_ancestor(joint, other) == Some(joint);
        firsts.iter().any(|first| below(*first)) || below(head)
    };
    let tail: Vec<usize> = last.and_then(|last| shape.way(pelvis, last)).unwrap_or_default();
    let tail: Vec<usize> = tail.into_iter().filter(|joint| !carries(*joint)).collect();
    let legs_of = [legs.ways.clone()];
    let explained =
        explained(shape, pelvis, &legs_of, &[&trunk.spine, &trunk.neck, &tail, &below(shape, wings)], trunk.head);
    let distance = trunk_line.length() / leg_length;
    let has_toes = legs.ways[0].len() > best.end + 1;
    let score = step(plane.share, 0.75, 0.95)
        * step(across, SPREAD_COSINE - 0.2, 0.85)
        * step(-leans, -UPRIGHT_COSINE - 0.05, -0.7)
        * (0.4 + 0.6 * step(wing_length / leg_length, SHORTEST_WING, 1.3))
        * best.score.sqrt()
        * (0.1 + 0.9 * step(explained, 0.55, 0.8))
        * step(distance, 0.15, 0.3)
        * step(-distance, -2.5, -1.5)
        * if tail.is_empty() { 0.15 } else { 1.0 }
        * if has_toes { 1.0 } else { 0.6 }
        * if trunk.neck.is_empty() { 0.3 } else { 1.0 };
    let legs = Limbs { pair: legs.clone(), best, second: limb.get(1).copied() };
    Some(Winged { legs, wings: wings.clone(), pelvis, trunk, tail, up, forward, score })
}
