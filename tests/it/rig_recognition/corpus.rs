//! Every rig of the corpus: what kind of body it is, which limbs it has, and that its left is on its left.

use std::collections::BTreeMap;

use retargetd::{
    model::{Joint, Reporter, Skeleton},
    rig::{Part, Rig, RigKind, RigSpec, Role, Side},
};

use super::{
    real_files::truth,
    stripped::{Sample, samples},
};

/// Files without a body; all others of the corpus are bipeds.
const OTHERS: &[&str] = &[
    "bvh/misc/pybvh_rotation_first_root.bvh",
    "cc0-stylised/kenney_platformer_noskin.glb",
    "cc0-stylised/quaternius_alien.fbx",
    "creatures/m2m_rig_spider.glb",
    "creatures/oculus_hand_left.fbx",
    "creatures/spider_noskin.fbx",
    "khronos/SimpleSkin.gltf",
    "khronos/SimpleSkinning.gltf",
    "khronos/rigged_simple.gltf",
    "misc-rigs/animation_with_skeleton_generic_names.fbx",
    "misc-rigs/huesitos.fbx",
];
const QUADRUPEDS: &[&str] = &["creatures/Fox.glb", "creatures/m2m_fox_clips.glb", "creatures/m2m_fox_model.glb"];

/// Bipeds that lack a part: robots without hands or with three palms, a capture that ends at the neck.
const LACKING: &[(&str, Part)] = &[
    ("cc0-stylised/godot_robot.glb", Part::Hand),
    ("cc0-stylised/robot_expressive.glb", Part::Hand),
    ("cc0-stylised/quaternius_orc_draco.glb", Part::Hand),
    ("bvh/xsens/dragposer_example_2_zup_metres.bvh", Part::Head),
];

const SEGMENTS: [Part; 6] = [Part::UpperArm, Part::Forearm, Part::Hand, Part::Thigh, Part::Shin, Part::Foot];

fn expected_kind(path: &str) -> RigKind {
    if OTHERS.contains(&path) {
        RigKind::Other
    } else if QUADRUPEDS.contains(&path) {
        RigKind::Quadruped
    } else {
        RigKind::Biped
    }
}

#[test]
fn every_rig_has_its_kind_its_limbs_and_its_sides() {
    let (mut wrong, mut count) = (Vec::new(), 0);
    for Sample { path, scene } in &samples() {
        let rig = Rig::new("source", scene, None, &RigSpec::default(), &mut Reporter::new()).expect("a rig");
        let recognition = &rig.recognition;
        let kind = expected_kind(path);
        count += 1;
        if recognition.kind != kind {
            wrong.push(format!("{path} is {}, not {}", recognition.kind.name(), kind.name()));
            continue;
        }
        let parts: &[Part] = match kind {
            RigKind::Biped => &SEGMENTS,
            RigKind::Quadruped => &[Part::FrontLeg, Part::HindLeg],
            RigKind::Other => &[],
        };
        let lacks = |part: Part| LACKING.iter().any(|entry| entry.0 == path.as_str() && entry.1 == part);
        for part in parts {
            let both = Side::BOTH.map(|side| recognition.roles.contains_key(&Role::new(side, *part)));
            let expected = !lacks(*part);
            if both != [expected; 2] {
                wrong.push(format!("{path}: {part:?} left and right: {both:?}"));
            }
        }
        for role in [Part::Pelvis, Part::Head].map(Role::center) {
            if kind != RigKind::Other && !lacks(role.part) && !recognition.roles.contains_key(&role) {
                wrong.push(format!("{path}: no {role}"));
            }
        }
        // A zero pose that is no pose has no sides.
        let Some(body) = recognition.body else { continue };
        let at = |role: Role| {
            let joint = recognition.roles.get(&role).and_then(|finding| finding.joints.first())?;
            Some(rig.rest.transforms()[*joint].translation)
        };
        for part in parts {
            let sides = at(Role::new(Side::Left, *part)).zip(at(Role::new(Side::Right, *part)));
            if sides.is_some_and(|(left, right)| (left - right).dot(body.left) <= 0.0) {
                wrong.push(format!("{path}: the left {part:?} is on the right"));
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {count} rigs:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
#[expect(clippy::print_stdout, reason = "the figures are for people, where they ask for them")]
fn sure_roles_are_right() {
    // By tenths of confidence: how many labeled roles, and how many of them right.
    let mut tenths: BTreeMap<u32, (usize, usize)> = BTreeMap::new();
    let (mut rigs, mut whole, mut wrong) = (0, 0, Vec::new());
    for Sample { path, scene } in &samples() {
        let Some(labels) = truth(path) else { continue };
        let rig = Rig::new("source", scene, None, &RigSpec::default(), &mut Reporter::new()).expect("a rig");
        let before = wrong.len();
        for (role, names) in labels {
            let finding = rig.recognition.roles.get(&role);
            let seen = finding.map_or_else(Vec::new, |finding| {
                finding.joints.iter().map(|joint| scene.skeleton.joints()[*joint].name.clone()).collect::<Vec<_>>()
            });
            let tenth = finding.map_or(0.0, |finding| finding.confidence * 10.0) as u32;
            let entry = tenths.entry(tenth).or_default();
            entry.0 += 1;
            if seen == names {
                entry.1 += 1;
            } else {
                wrong.push(format!("{path}: {role} is {seen:?}, not {names:?}"));
            }
        }
        rigs += 1;
        whole += usize::from(wrong.len() == before);
    }
    if rigs == 0 {
        return;
    }
    let (all, right) = tenths.values().fold((0, 0), |sum, entry| (sum.0 + entry.0, sum.1 + entry.1));
    let (sure, sure_right) = tenths.get(&9).copied().unwrap_or_default();
    println!(
        "{right} of {all} labeled roles right, {whole} of {rigs} rigs entirely; by tenths of confidence {tenths:?}"
    );
    assert!(right as f64 >= 0.98 * all as f64, "{right} of {all} roles:\n{}", wrong.join("\n"));
    assert!(whole as f64 >= 0.9 * f64::from(rigs), "{whole} of {rigs} rigs:\n{}", wrong.join("\n"));
    assert!(sure_right as f64 >= 0.995 * sure as f64, "{sure_right} of {sure} sure roles:\n{}", wrong.join("\n"));
    assert!(sure * 2 > all, "most of them are sure: {tenths:?}");
}

/// A hand that is closed at rest, as about the grip of a weapon: its shape says little about which finger is which.
#[test]
fn fingers_that_are_named_one_by_one_are_sure() {
    let mut scene = retargetd::samples::mannequin_scene();
    let mut joints: Vec<Joint> = scene.skeleton.joints().to_vec();
    let place = |name: &str| joints.iter().position(|joint| joint.name == name).expect("a finger");
    let [index, pinky] = ["index_metacarpal_l", "pinky_metacarpal_l"].map(place);
    let (at_index, at_pinky) = (joints[index].rest, joints[pinky].rest);
    (joints[index].rest, joints[pinky].rest) = (at_pinky, at_index);
    scene.skeleton = Skeleton::new(joints).expect("a skeleton");
    let rig = Rig::new("target", &scene, None, &RigSpec::default(), &mut Reporter::new()).expect("a rig");
    for part in [Part::Thumb, Part::Index, Part::Middle, Part::Ring, Part::Pinky] {
        let finding = &rig.recognition.roles[&Role::new(Side::Left, part)];
        assert!(finding.confidence >= 0.9, "{part:?}: {finding:?}");
    }
    let contradicted = &rig.recognition.roles[&Role::new(Side::Left, Part::Index)];
    assert!(contradicted.reasons.iter().any(|reason| reason.contains("shape would say")), "{contradicted:?}");
}
