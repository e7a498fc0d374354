//! Eyes and jaw, where a head has so few joints that they are plain.
//!
//! A face with joints for brows, lips and cheeks has many pairs that could be eyes; shape alone says nothing of them then.

use glam::DVec3;

use super::{Places, shape::Shape};
use crate::rig::{Part, Role, Side};

/// Joints of a face are at most so many bones away from the head.
const DEEPEST: usize = 2;
/// A head with more joints than this is a face that only names explain.
const MAX_JOINTS: usize = 24;
/// Twins lie this alike: a share of their distance from the head.
const ALIKE: f64 = 0.08;
/// Eyes are this much more ahead of the head joint than aside of it, at least.
const AHEAD_OVER_ASIDE: f64 = 0.9;
/// Bones from a jaw's joint to its end at most.
const LONGEST_JAW: usize = 2;
/// What leads up more than this, against forward, is the top of a head or its tip, and no jaw.
const STEEPEST_JAW: f64 = 0.05;

/// The directions of a body, of unit length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Directions {
    pub up: DVec3,
    pub forward: DVec3,
    pub left: DVec3,
}

/// A joint of a face, as it lies about the head.
struct Feature {
    joint: usize,
    /// Left, up and ahead of the head joint.
    place: DVec3,
}

/// Adds the eyes and the jaw of a head, where exactly one pair and one joint look like them.
pub(super) fn add_face(shape: &Shape<'_>, head: usize, directions: Directions, sure: f64, places: &mut Places) {
    let place = |joint: usize| {
        let offset = shape.positions[joint] - shape.positions[head];
        DVec3::new(offset.dot(directions.left), offset.dot(directions.up), offset.dot(directions.forward))
    };
    let below = below(shape, head);
    if below.len() > MAX_JOINTS {
        return;
    }
    let features: Vec<Feature> = below.into_iter().map(|joint| Feature { joint, place: place(joint) }).collect();
    if let Some([left, right]) = find_eyes(shape, head, &features) {
        for (side, joint) in [(Side::Left, left), (Side::Right, right)] {
            places.set(Role::new(side, Part::Eye), vec![joint], sure, None);
        }
    }
    if let Some(jaw) = find_jaw(shape, &features, place) {
        places.set(Role::center(Part::Jaw), vec![jaw], sure - 0.05, None);
    }
}

/// The joints a few bones below the head, nearer ones first.
fn below(shape: &Shape<'_>, head: usize) -> Vec<usize> {
    let mut found: Vec<usize> = Vec::new();
    let mut row = vec![head];
    for _ in 0..DEEPEST {
        row = row.iter().flat_map(|joint| shape.children[*joint].iter().copied()).collect();
        found.extend(&row);
    }
    found
}

/// The one pair of single joints that mirror one another ahead of the head joint, and not lower than it. A joint may mark where they
/// look.
fn find_eyes(shape: &Shape<'_>, head: usize, features: &[Feature]) -> Option<[usize; 2]> {
    let is_eye = |feature: &&Feature| {
        let DVec3 { x: aside, y: above, z: ahead } = feature.place;
        let has_mark_at_most = match shape.children[feature.joint][..] {
            [] => true,
            [only] => shape.children[only].is_empty(),
            _ => false,
        };
        // The middle of a feeler is no eye.
        let is_first =
            shape.parent[feature.joint].is_some_and(|above| above == head || shape.children[above].len() > 1);
        has_mark_at_most && is_first && ahead > AHEAD_OVER_ASIDE * aside.abs() && above > 0.0
    };
    let eyes: Vec<&Feature> = features.iter().filter(is_eye).collect();
    let is_top = |feature: &&&Feature| !eyes.iter().any(|other| shape.parent[feature.joint] == Some(other.joint));
    let candidates: Vec<&Feature> = eyes.iter().filter(is_top).copied().collect();
    let mut pairs = Vec::new();
    for left in candidates.iter().filter(|feature| feature.place.x > 0.0) {
        let mirrored = DVec3::new(-left.place.x, left.place.y, left.place.z);
        let near = ALIKE * mirrored.length();
        // What lies in the middle but for the drawing is its own twin.
        let twins = candidates.iter().filter(|other| other.place.x < 0.0 && other.place.distance(mirrored) <= near);
        pairs.extend(twins.filter(|_| left.place.x > near).map(|right| [left.joint, right.joint]));
    }
    if let [pair] = pairs[..] { Some(pair) } else { None }
}

/// The one joint in the middle that leads forward and not up.
fn find_jaw(shape: &Shape<'_>, features: &[Feature], place: impl Fn(usize) -> DVec3) -> Option<usize> {
    let is_jaw = |feature: &&Feature| {
        let mut end = feature.joint;
        for _ in 0..=LONGEST_JAW {
            end = shape.children[end].first().copied().unwrap_or(end);
        }
        let tip = place(end);
        let in_middle = |place: DVec3| place.x.abs() <= ALIKE * place.length();
        shape.children[end].is_empty()
            && in_middle(feature.place)
            && in_middle(tip)
            && tip.z > 0.0
            && tip.y < STEEPEST_JAW * tip.z
    };
    let candidates: Vec<&Feature> = features.iter().filter(is_jaw).collect();
    // A tongue or a chin hangs from the jaw itself.
    let is_top = |feature: &&&Feature| {
        let above = shape.parent[feature.joint];
        !candidates.iter().any(|other| Some(other.joint) == above)
    };
    let mut tops = candidates.iter().filter(is_top);
    match (tops.next(), tops.next()) {
        (Some(only), None) => Some(only.joint),
        _ => None,
    }
}
