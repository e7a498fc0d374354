//! Hands with bones of the palm on one spot, and with fewer than five fingers: made ones, named and nameless, and those of the corpus.

use std::collections::BTreeMap;

use glam::DVec3;
use retargetd::{
    model::{Joint, Reporter, Skeleton, Transform},
    rig::{Hints, Part, Recognition, Rig, RigSpec, Role, Side, recognize},
};

use super::stripped::samples;

/// Names and places of the left half of a figure, without fingers. On the right half, x is mirrored.
pub(super) const FIGURE: &[(&str, Option<&str>, [f64; 3])] = &[
    ("hips", None, [0.0, 1.0, 0.0]),
    ("spine", Some("hips"), [0.0, 1.2, 0.0]),
    ("chest", Some("spine"), [0.0, 1.35, 0.0]),
    ("neck", Some("chest"), [0.0, 1.5, 0.0]),
    ("head", Some("neck"), [0.0, 1.6, 0.02]),
    ("clavicle", Some("chest"), [0.04, 1.45, 0.0]),
    ("upper_arm", Some("clavicle"), [0.18, 1.45, 0.0]),
    ("forearm", Some("upper_arm"), [0.46, 1.45, -0.01]),
    ("hand", Some("forearm"), [0.71, 1.45, 0.0]),
    ("thigh", Some("hips"), [0.1, 0.95, 0.0]),
    ("shin", Some("thigh"), [0.1, 0.52, 0.02]),
    ("foot", Some("shin"), [0.1, 0.1, 0.0]),
    ("toe", Some("foot"), [0.1, 0.03, 0.15]),
];

/// Where a finger's joints are: those of the palm on one spot in the wrist first, tips last.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Chain {
    /// Which of the five it is.
    finger: usize,
    from_wrist: bool,
    has_tip: bool,
}

impl Chain {
    fn places(self) -> Vec<DVec3> {
        let hand = DVec3::new(0.71, 1.45, 0.0);
        let (knuckle, heading, bones) = if self.finger == 0 {
            (DVec3::new(0.02, -0.01, 0.03), DVec3::new(0.65, -0.15, 0.75), [0.045, 0.03, 0.025])
        } else {
            let aside = 0.03 - 0.02 * (self.finger - 1) as f64;
            (DVec3::new(0.09, 0.0, aside), DVec3::X, [0.042, 0.026, 0.02])
        };
        let mut places = if self.from_wrist { vec![hand] } else { Vec::new() };
        let mut here = hand + knuckle;
        for bone in bones {
            places.push(here);
            here += heading.normalize() * bone;
        }
        if self.has_tip {
            places.push(here);
        }
        places
    }
}

/// A figure with such fingers on both hands; `name` says how a joint of the left hand is called by its finger and place in it.
fn figure(chains: &[Chain], name: impl Fn(usize, usize) -> String) -> (Skeleton, BTreeMap<(usize, usize), usize>) {
    let mut joints: Vec<(String, Option<usize>, DVec3)> = Vec::new();
    let mut by_name: BTreeMap<(String, Side), usize> = BTreeMap::new();
    let mut left = BTreeMap::new();
    let parts = FIGURE.iter().map(|(name, above, place)| (*name, *above, DVec3::from_array(*place)));
    for (part, above, place) in parts {
        let sides: &[Side] = if place.x > 0.0 { &Side::BOTH } else { &[Side::Center] };
        for side in sides {
            let above = above.map(|above| {
                let on = |side: Side| by_name.get(&(above.to_owned(), side)).copied();
                on(*side).or_else(|| on(Side::Center)).expect("parents come first")
            });
            by_name.insert((part.to_owned(), *side), joints.len());
            joints.push((sided(part, *side), above, mirrored(place, *side)));
        }
    }
    for side in Side::BOTH {
        for chain in chains {
            let mut above = by_name[&("hand".to_owned(), side)];
            for (place, position) in chain.places().into_iter().enumerate() {
                if side == Side::Left {
                    left.insert((chain.finger, place), joints.len());
                }
                joints.push((sided(&name(chain.finger, place), side), Some(above), mirrored(position, side)));
                above = joints.len() - 1;
            }
        }
    }
    let joint = |(node, (name, parent, place)): (usize, &(String, Option<usize>, DVec3))| {
        let above = parent.map_or(DVec3::ZERO, |parent| joints[parent].2);
        let rest = Transform::from_translation(*place - above);
        Joint { name: name.clone(), parent: *parent, rest, is_joint: true, node }
    };
    let skeleton = joints.iter().enumerate().map(joint).collect();
    (Skeleton::new(skeleton).expect("parents come first"), left)
}

pub(super) fn sided(name: &str, side: Side) -> String {
    match side {
        Side::Center => name.to_owned(),
        Side::Left => format!("{name}_l"),
        Side::Right => format!("{name}_r"),
    }
}

pub(super) fn mirrored(place: DVec3, side: Side) -> DVec3 {
    if side == Side::Right { DVec3::new(-place.x, place.y, place.z) } else { place }
}

/// The same without any name.
pub(super) fn nameless(skeleton: &Skeleton) -> Skeleton {
    let joint = |(index, joint): (usize, &Joint)| Joint { name: format!("joint_{index}"), ..joint.clone() };
    Skeleton::new(skeleton.joints().iter().enumerate().map(joint).collect()).expect("names do not matter")
}

pub(super) fn seen(skeleton: &Skeleton) -> Recognition {
    recognize(skeleton, &skeleton.rest_pose().to_model(skeleton), &Hints::default())
}

/// The finger joints and bones of the palm of the left hand that are expected, by role.
fn expected(chains: &[Chain], parts: &[Part], left: &BTreeMap<(usize, usize), usize>) -> BTreeMap<Role, Vec<usize>> {
    let mut expected = BTreeMap::new();
    for (chain, part) in chains.iter().zip(parts) {
        let all: Vec<usize> = (0..chain.places().len()).map(|place| left[&(chain.finger, place)]).collect();
        let first = usize::from(chain.from_wrist);
        expected.insert(Role::new(Side::Left, *part), all[first..first + 3].to_vec());
        if let Some(metacarpal) = part.metacarpal().filter(|_| chain.from_wrist) {
            expected.insert(Role::new(Side::Left, metacarpal), vec![all[0]]);
        }
    }
    expected
}

fn of_the_hand(recognition: &Recognition) -> BTreeMap<Role, Vec<usize>> {
    let is_of_hand = |part: Part| {
        Part::FINGERS.contains(&part) || Part::FINGERS.iter().any(|finger| finger.metacarpal() == Some(part))
    };
    let roles = recognition.roles.iter().filter(|(role, _)| role.side == Side::Left && is_of_hand(role.part));
    roles.map(|(role, finding)| (*role, finding.joints.clone())).collect()
}

const NAMES: [&str; 5] = ["thumb", "index", "middle", "ring", "pinky"];

#[test]
fn bones_of_the_palm_on_one_spot_are_no_phalanges() {
    for has_tip in [false, true] {
        for thumb_too in [false, true] {
            let chain = |finger: usize| Chain { finger, from_wrist: finger > 0 || thumb_too, has_tip };
            let chains: Vec<Chain> = (0..5).map(chain).collect();
            let what = format!("tips: {has_tip}, the thumb begins there, too: {thumb_too}");
            let (skeleton, left) = figure(&chains, |finger, place| format!("{}_{place:02}", NAMES[finger]));
            let named = of_the_hand(&seen(&skeleton));
            let mut truth = expected(&chains, &Part::FINGERS, &left);
            if thumb_too && has_tip {
                // With tips, the thumb's first joint is as well its metacarpal: nothing says which.
                truth.remove(&Role::new(Side::Left, Part::Thumb));
            }
            for (role, joints) in &truth {
                assert_eq!(named.get(role), Some(joints), "{what}: {role} by name");
            }
            let stripped = seen(&nameless(&skeleton));
            assert_eq!(stripped.roles[&Role::new(Side::Left, Part::Hand)].joints.len(), 1, "{what}: a hand");
            let shaped = of_the_hand(&stripped);
            for (role, joints) in truth.iter().filter(|(role, _)| role.part != Part::Thumb) {
                assert_eq!(shaped.get(role), Some(joints), "{what}: {role} by shape");
            }
        }
    }
}

#[test]
fn joints_that_say_nothing_between_the_hand_and_named_fingers_are_bones_of_the_palm() {
    let chains: Vec<Chain> = (0..5).map(|finger| Chain { finger, from_wrist: finger > 0, has_tip: false }).collect();
    let (skeleton, left) = figure(&chains, |finger, place| match (finger, place) {
        (1.., 0) => format!("b{finger}"),
        (0, place) => format!("thumb{}", place + 1),
        (finger, place) => format!("{}{place}", NAMES[finger]),
    });
    assert_eq!(of_the_hand(&seen(&skeleton)), expected(&chains, &Part::FINGERS, &left));
}

/// Which of the five fingers a hand has, what they are called by (nothing: numbers), and what they are.
type Hand = (&'static [usize], &'static [&'static str], &'static [Part]);

#[test]
fn hands_with_fewer_fingers_have_those_that_they_have() {
    use Part::{Index, Middle, Pinky, Ring, Thumb};
    let hands: [Hand; 8] = [
        (&[0, 1, 2, 3], &["thumb", "index", "middle", "ring"], &[Thumb, Index, Middle, Ring]),
        (&[0, 1, 2, 3], &["thumb", "index", "middle", "pinky"], &[Thumb, Index, Middle, Pinky]),
        (&[0, 1, 2], &["thumb", "index", "middle"], &[Thumb, Index, Middle]),
        (&[0, 1, 2], &["thumb", "index", "pinky"], &[Thumb, Index, Pinky]),
        (&[0, 1, 2, 3], &["finger0", "finger1", "finger2", "finger3"], &[Thumb, Index, Middle, Ring]),
        (&[0, 1, 2], &["finger0", "finger1", "finger2"], &[Thumb, Index, Middle]),
        (&[0, 1, 2, 3], &["thumb", "finger1", "finger2", "finger3"], &[Thumb, Index, Middle, Ring]),
        (&[0, 1, 2], &["thumb", "finger0", "finger1"], &[Thumb, Index, Middle]),
    ];
    for (fingers, names, parts) in hands {
        for from_wrist in [false, true] {
            let chains: Vec<Chain> = fingers
                .iter()
                .map(|finger| Chain { finger: *finger, from_wrist: from_wrist && *finger > 0, has_tip: false })
                .collect();
            let (skeleton, left) = figure(&chains, |finger, place| format!("{}_{place}", names[finger]));
            let truth = expected(&chains, parts, &left);
            assert_eq!(of_the_hand(&seen(&skeleton)), truth, "{names:?}, from the wrist: {from_wrist}");
            let by_order: Vec<Part> = Part::FINGERS.into_iter().take(fingers.len()).collect();
            let truth = expected(&chains, &by_order, &left);
            let seen = of_the_hand(&seen(&nameless(&skeleton)));
            assert_eq!(seen, truth, "{} fingers without names, from the wrist: {from_wrist}", fingers.len());
        }
    }
}

#[test]
fn hands_of_the_corpus_have_the_fingers_that_they_have() {
    use Part::{Index, IndexMetacarpal, Middle, MiddleMetacarpal, Pinky, Ring, Thumb};
    // Parts that the left hand has and those that it lacks.
    let files: [(&str, &[Part], &[Part]); 4] = [
        ("mixamo/gltf/mousey_meshopt.glb", &[Thumb, Index, Middle, Ring], &[Pinky, IndexMetacarpal]),
        ("unreal/mannequiny.glb", &[Thumb, Index, Middle, Ring], &[Pinky, IndexMetacarpal]),
        ("cc0-stylised/quaternius_orc_draco.glb", &[Thumb, Index, IndexMetacarpal, MiddleMetacarpal, Pinky], &[Ring]),
        ("unreal/m2m_human_zombie.glb", &[Thumb, Index], &[Middle, Ring, Pinky]),
    ];
    let samples = samples();
    for (path, present, absent) in files {
        let Some(sample) = samples.iter().find(|sample| sample.path == path) else { continue };
        let rig = Rig::new("source", &sample.scene, None, &RigSpec::default(), &mut Reporter::new()).expect("a rig");
        let has = |part: &Part| rig.recognition.roles.contains_key(&Role::new(Side::Left, *part));
        let hand = of_the_hand(&rig.recognition);
        assert!(present.iter().all(has), "{path}: {hand:?}");
        assert!(!absent.iter().any(has), "{path}: {hand:?}");
    }
}
