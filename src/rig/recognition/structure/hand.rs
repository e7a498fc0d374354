//! Which of a hand's fingers is which.

use glam::DVec3;

use super::shape::Shape;
use crate::rig::{
    Part,
    recognition::fingers::{PHALANGES, Start, spots},
};

/// A finger has at least this many joints; fewer are a palm or a marker.
const FEWEST_JOINTS: usize = 2;
/// How much it speaks for a thumb that it alone has fewer joints than all others.
const FEWER_JOINTS: f64 = 0.5;

/// The fingers of a hand, thumb first, each from the palm outward, and the bones of the palm below them. Empty where there are too
/// few or too many to tell.
pub(super) fn find_fingers(shape: &Shape<'_>, hand: usize) -> Vec<(Part, Vec<usize>)> {
    let mut fingers: Vec<Vec<usize>> = Vec::new();
    for child in &shape.children[hand] {
        let mut finger = vec![*child];
        let mut here = *child;
        while let Some(next) = shape.children[here].first().copied().filter(|_| finger.len() < PHALANGES + 2) {
            finger.push(next);
            here = next;
        }
        if finger.len() >= FEWEST_JOINTS {
            fingers.push(finger);
        }
    }
    if !(3..=5).contains(&fingers.len()) {
        return Vec::new();
    }
    let starts: Vec<Start> = fingers.iter().map(|joints| Start::of(shape.positions, joints)).collect();
    let on_spot: Vec<bool> =
        spots(&starts).into_iter().zip(&fingers).map(|(is_on, joints)| is_on && joints.len() >= PHALANGES).collect();
    // What begins on one spot with others shows from its next joint on where it lies in the hand.
    let visible = |finger: usize| &fingers[finger][usize::from(on_spot[finger])..];
    let base = |finger: usize| shape.positions[visible(finger)[0]] - shape.positions[hand];
    let along = |finger: usize| {
        let joints = visible(finger);
        (shape.positions[joints[joints.len() - 1]] - shape.positions[joints[0]]).normalize_or_zero()
    };
    // The knuckles lie in a row, and the thumb at one end of it: the one that starts nearer to the wrist and points away.
    let middle = |finger: usize| base(finger) + 0.3 * shape.reach[visible(finger)[0]] * along(finger);
    let all = 0..fingers.len();
    let pairs = all.clone().flat_map(|one| (one + 1..fingers.len()).map(move |other| (one, other)));
    let apart = |pair: &(usize, usize)| middle(pair.0).distance(middle(pair.1));
    let Some((one, other)) = pairs.max_by(|first, second| apart(first).total_cmp(&apart(second))) else {
        return Vec::new();
    };
    let mean = all.clone().fold(DVec3::ZERO, |sum, finger| sum + along(finger)).normalize_or_zero();
    let reach = all.clone().map(|finger| base(finger).length()).fold(1e-12, f64::max);
    // Where the other fingers begin in the palm, the thumb has a joint less.
    let most = fingers.iter().map(Vec::len).max().unwrap_or(0);
    let is_shorter = |finger: usize| {
        fingers.iter().filter(|other| other.len() == most).count() + 1 == fingers.len() && fingers[finger].len() < most
    };
    let thumb_like = |finger: usize| {
        let shorter = if is_shorter(finger) { FEWER_JOINTS } else { 0.0 };
        (1.0 - base(finger).length() / reach) + 2.0 * (1.0 - along(finger).dot(mean)) + shorter
    };
    let thumb = if thumb_like(one) >= thumb_like(other) { one } else { other };
    let from_thumb = |finger: usize| middle(finger).distance(middle(thumb));
    let mut others: Vec<usize> = all.filter(|finger| *finger != thumb).collect();
    others.sort_by(|first, second| from_thumb(*first).total_cmp(&from_thumb(*second)));
    let names: &[Part] = match others.len() {
        4 => &[Part::Index, Part::Middle, Part::Ring, Part::Pinky],
        3 => &[Part::Index, Part::Middle, Part::Ring],
        _ => &[Part::Index, Part::Middle],
    };
    let order = std::iter::once((Part::Thumb, thumb)).chain(names.iter().copied().zip(others));
    let whole = |(part, finger): (Part, usize)| {
        let joints = &fingers[finger];
        // A bone of the palm comes first where the way to it is shorter than itself.
        let begins_low = joints.len() > PHALANGES
            && shape.positions[joints[0]].distance(shape.positions[hand]) < shape.length[joints[1]];
        let in_palm = finger != thumb && (begins_low || on_spot[finger]);
        // Four chains, all alike, may be four fingers of which one carries the thumb: then nothing says which is which.
        let is_plain = fingers.len() == 5 || is_shorter(thumb) || on_spot[finger];
        let metacarpal = part.metacarpal().filter(|_| in_palm && is_plain).map(|part| (part, vec![joints[0]]));
        let phalanges = joints.iter().copied().skip(usize::from(in_palm)).take(PHALANGES).collect();
        metacarpal.into_iter().chain([(part, phalanges)])
    };
    order.flat_map(whole).collect()
}
