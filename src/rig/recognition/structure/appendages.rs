//! What animals have beside a trunk, legs and one head: wings, and several necks and heads.

use glam::DVec3;

use super::{
    Places,
    crawler::{Ways, paired_ways},
    plane::Plane,
    shape::Shape,
    trunk::Trunk,
};
use crate::rig::{Part, Role, Side};

/// A wing has at least this share of a leg's length, ...
const SHORTEST_WING: f64 = 0.5;
/// ... and so many joints.
const FEWEST_WING_JOINTS: usize = 3;
/// What points forward more than this is a pincer or a neck: a cosine.
const FORWARD_COSINE: f64 = 0.6;
/// The end of a wing is at least this share of a leg's length above the ground.
const MIN_HEIGHT: f64 = 0.2;
/// A neck beside the middle one is at least this share of it.
const SHORTEST_NECK: f64 = 0.6;
/// What that many joints hang from is a head.
const FACE_JOINTS: usize = 3;

/// An animal whose legs and trunk are known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Animal<'a> {
    pub trunk: &'a Trunk,
    pub pelvis: usize,
    pub chest: usize,
    /// All joints of its legs.
    pub legs: &'a [usize],
    pub leg_length: f64,
    pub up: DVec3,
    pub forward: DVec3,
}

/// Adds wings, necks and heads that mirror one another.
pub(super) fn add_appendages(shape: &Shape<'_>, plane: &Plane, animal: &Animal<'_>, sure: f64, places: &mut Places) {
    let ground = animal.legs.iter().map(|joint| shape.positions[*joint].dot(animal.up)).fold(f64::INFINITY, f64::min);
    let is_left_first = plane.normal.dot(animal.up.cross(animal.forward)) > 0.0;
    let (mut necks, mut wings): (Vec<Ways>, Vec<Ways>) = (Vec::new(), Vec::new());
    let mut first_joints: Vec<usize> = Vec::new();
    for pair in paired_ways(shape, plane) {
        let start = pair.ways[0][0];
        // The longest way of what hangs in one place stands for all of it: a wing's fingers are one wing.
        if animal.legs.contains(&start) || first_joints.contains(&start) {
            continue;
        }
        first_joints.push(start);
        let Some(from) = shape.parent[start] else { continue };
        if is_neck(shape, animal, &pair, from) {
            necks.push(pair);
        } else if is_wing(shape, animal, &pair, from, ground) {
            wings.push(pair);
        }
    }
    let place = |pair: &Ways| shape.positions[pair.ways[0][0]].dot(animal.forward);
    wings.sort_by(|one, other| place(other).total_cmp(&place(one)));
    necks.sort_by(|one, other| aside(shape, plane, one).total_cmp(&aside(shape, plane, other)));
    for (index, pair) in wings.into_iter().enumerate() {
        set_both(places, Part::Wing, index, is_left_first, pair.ways, sure - 0.15);
    }
    for (index, pair) in necks.into_iter().enumerate() {
        let [one, other] = pair.ways.map(|way| split_head(shape, way));
        set_both(places, Part::Neck, index, is_left_first, [one.0, other.0], sure - 0.2);
        set_both(places, Part::Head, index, is_left_first, [one.1, other.1], sure - 0.2);
    }
}

/// How far a pair's ends are from the middle.
fn aside(shape: &Shape<'_>, plane: &Plane, pair: &Ways) -> f64 {
    pair.ways[0].last().map_or(0.0, |end| plane.distance(shape.positions[*end]).abs())
}

fn set_both(places: &mut Places, part: Part, index: usize, is_left_first: bool, ways: [Vec<usize>; 2], sure: f64) {
    let sides = if is_left_first { Side::BOTH } else { [Side::Right, Side::Left] };
    let Ok(number) = u8::try_from(index + 1) else { return };
    for (side, way) in sides.into_iter().zip(ways) {
        places.set(Role::numbered(side, part, number), way, sure, None);
    }
}

/// From a pair's start to its end, on one side; of unit length.
fn direction(shape: &Shape<'_>, pair: &Ways) -> DVec3 {
    let way = &pair.ways[0];
    (shape.positions[way[way.len() - 1]] - shape.positions[way[0]]).normalize_or_zero()
}

/// A wing hangs from the trunk, is long, points aside or back, and does not reach the ground.
fn is_wing(shape: &Shape<'_>, animal: &Animal<'_>, pair: &Ways, from: usize, ground: f64) -> bool {
    let hangs_from_trunk = from == animal.pelvis || animal.trunk.spine.contains(&from);
    let way = &pair.ways[0];
    let end = shape.positions[way[way.len() - 1]].dot(animal.up) - ground;
    hangs_from_trunk
        && way.len() >= FEWEST_WING_JOINTS
        && pair.length >= SHORTEST_WING * animal.leg_length
        && end >= MIN_HEIGHT * animal.leg_length
        && direction(shape, pair).dot(animal.forward) < FORWARD_COSINE
}

/// A neck beside others hangs from the chest or a neck, points where they point, and is about as long.
fn is_neck(shape: &Shape<'_>, animal: &Animal<'_>, pair: &Ways, from: usize) -> bool {
    let trunk = animal.trunk;
    let middle: f64 = trunk.neck.iter().chain(&trunk.head).map(|joint| shape.length[*joint]).sum();
    let own = pair.length + shape.length[pair.ways[0][0]];
    let toward = (animal.forward + 0.5 * animal.up).normalize_or_zero();
    let hangs_in_place = from == animal.chest || trunk.neck.contains(&from);
    let is_long = if trunk.neck.is_empty() {
        // No neck in the middle to compare it with: then a face must be at its end, and it must be as long as a leg about.
        let has_face = pair.ways[0].iter().any(|joint| shape.children[*joint].len() >= FACE_JOINTS);
        has_face && own >= SHORTEST_NECK * animal.leg_length
    } else {
        own >= SHORTEST_NECK * middle && own * SHORTEST_NECK <= middle
    };
    hangs_in_place && is_long && pair.ways[0].len() >= 2 && direction(shape, pair).dot(toward) > FORWARD_COSINE
}

/// The joints of a neck, and its head: where the face begins, else the last joint.
fn split_head(shape: &Shape<'_>, mut way: Vec<usize>) -> (Vec<usize>, Vec<usize>) {
    let face = way.iter().position(|joint| shape.children[*joint].len() >= FACE_JOINTS);
    let mut head = way.split_off(face.unwrap_or(way.len() - 1));
    head.truncate(1);
    (way, head)
}
