//! Made figures without names whose shape misled once: something in one hand, steep feet, knees that are a little overstretched.

use std::collections::BTreeMap;

use glam::DVec3;
use retargetd::{
    model::{Joint, Skeleton, Transform},
    rig::{Part, Recognition, RigKind, Role, Side},
};

use super::hands::{FIGURE, mirrored, nameless, seen, sided};

/// More joints on a side: a name, the joint that they hang from, and the place on the left half.
type More<'a> = (&'a str, &'a str, Side, DVec3);

/// The figure with some joints elsewhere or left out, and with more joints; and where each is in it.
fn figure(
    change: impl Fn(&str, DVec3) -> Option<DVec3>,
    more: &[More<'_>],
) -> (Skeleton, BTreeMap<(String, Side), usize>) {
    let mut joints: Vec<(Option<usize>, DVec3)> = Vec::new();
    let mut by_name: BTreeMap<(String, Side), usize> = BTreeMap::new();
    let both = |place: DVec3| if place.x > 0.0 { &Side::BOTH[..] } else { &[Side::Center] };
    let parts = FIGURE.iter().filter_map(|(name, above, place)| {
        let place = change(name, DVec3::from_array(*place))?;
        Some((*name, *above, place))
    });
    let parts = parts.flat_map(|(name, above, place)| both(place).iter().map(move |side| (name, above, *side, place)));
    let more = more.iter().map(|(name, above, side, place)| (*name, Some(*above), *side, *place));
    for (name, above, side, place) in parts.chain(more) {
        let on = |above: &str, side: Side| by_name.get(&(above.to_owned(), side)).copied();
        let above = above.map(|above| on(above, side).or_else(|| on(above, Side::Center)).expect("parents come first"));
        by_name.insert((name.to_owned(), side), joints.len());
        joints.push((above, mirrored(place, side)));
    }
    let joint = |(node, (parent, place)): (usize, &(Option<usize>, DVec3))| {
        let rest = Transform::from_translation(*place - parent.map_or(DVec3::ZERO, |parent| joints[parent].1));
        Joint { name: sided("joint", Side::Center), parent: *parent, rest, is_joint: true, node }
    };
    let skeleton = Skeleton::new(joints.iter().enumerate().map(joint).collect()).expect("parents come first");
    (nameless(&skeleton), by_name)
}

fn assert_limbs(recognition: &Recognition, places: &BTreeMap<(String, Side), usize>) {
    assert_eq!(recognition.kind, RigKind::Biped);
    let limbs = [
        ("upper_arm", Part::UpperArm),
        ("forearm", Part::Forearm),
        ("hand", Part::Hand),
        ("thigh", Part::Thigh),
        ("shin", Part::Shin),
        ("foot", Part::Foot),
    ];
    for side in Side::BOTH {
        for (name, part) in limbs {
            let role = Role::new(side, part);
            let seen = recognition.roles.get(&role).map(|finding| finding.joints[0]);
            assert_eq!(seen, places.get(&(name.to_owned(), side)).copied(), "{role}");
        }
    }
}

#[test]
fn what_one_hand_holds_does_not_make_the_arms_unlike() {
    let helper =
        |above: &'static str, x: f64| Side::BOTH.map(|side| ("twist", above, side, DVec3::new(x, 1.45, -0.005)));
    let mut more: Vec<More<'_>> = helper("upper_arm", 0.34).into_iter().chain(helper("forearm", 0.6)).collect();
    more.push(("weapon", "hand", Side::Right, DVec3::new(0.72, 1.45, 0.04)));
    more.push(("blade", "weapon", Side::Right, DVec3::new(0.72, 1.45, 0.5)));
    let (skeleton, places) = figure(|_, place| Some(place), &more);
    assert_limbs(&seen(&skeleton), &places);
}

#[test]
fn steep_feet_are_no_part_of_the_shins() {
    let steep = |name: &str, place: DVec3| {
        Some(match name {
            "shin" => DVec3::new(0.1, 0.54, -0.018),
            "foot" => DVec3::new(0.1, 0.16, -0.027),
            "toe" => DVec3::new(0.1, 0.04, 0.057),
            _ => place,
        })
    };
    let (skeleton, places) = figure(steep, &[]);
    assert_limbs(&seen(&skeleton), &places);
}

#[test]
fn overstretched_knees_leave_the_sides_a_guess() {
    let no_toes = |name: &str, place: DVec3| match name {
        "toe" => None,
        "shin" => Some(DVec3::new(0.1, 0.52, -0.03)),
        _ => Some(place),
    };
    let recognition = seen(&figure(no_toes, &[]).0);
    assert_eq!(recognition.kind, RigKind::Biped);
    assert!(recognition.sides_guessed, "knees that bend back by 7 degrees do not say where front is");
    for (role, finding) in recognition.roles.iter().filter(|(role, _)| role.side != Side::Center) {
        assert!(finding.confidence < 0.8, "{role} at {:.2}", finding.confidence);
    }
}
