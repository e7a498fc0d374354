//! Files that are no rest file of the rig: each is refused, or a warning says what is wrong.

use glam::{DQuat, DVec3};
use retargetd::{
    formats::{self, Format, Limits},
    model::{Clip, Control, Joint, JointTracks, Reporter, Scene, Skeleton, Track, Transform},
    rig::{PoseChoice, SpecErrorKind},
    samples,
};

use super::{
    expected::{plain, posed, upload},
    variant::Variant,
};
use crate::support::corpus_file;

fn refused(scene: &Scene, rest: &Scene, words: &[&str]) {
    let error = upload(scene, rest, &plain(scene).rest).expect_err("refused");
    assert_eq!(error.kind, SpecErrorKind::NoSkeleton, "{error}");
    for word in words {
        assert!(error.detail.contains(word), "says '{word}': {error}");
    }
    assert!(!error.hint.is_empty(), "says what to do: {error}");
}

#[test]
fn a_file_of_one_joint_is_refused() {
    let scene = samples::mannequin_scene();
    let rest = Variant::of(&scene, &plain(&scene).rest).without(|name| name != "pelvis").scene();
    refused(&scene, &rest, &["only one joint"]);
    refused(&scene, &Scene::default(), &["no joints"]);
}

#[test]
fn a_file_of_too_little_of_the_body_is_refused_and_names_what_it_lacks() {
    let scene = samples::mannequin_scene();
    let rest = plain(&scene).rest;
    let is_leg = |name: &str| ["thigh", "calf", "foot", "ball", "pelvis"].iter().any(|part| name.starts_with(part));
    let leg = Variant::of(&scene, &rest).without(|name| !is_leg(name) || name.ends_with("_r")).scene();
    refused(&scene, &leg, &["another skeleton", "lacks", "'spine_01'"]);
}

#[test]
fn joints_that_lie_on_one_point_are_refused() {
    let scene = samples::mannequin_scene();
    let mut pose = plain(&scene).rest;
    pose.transforms_mut().iter_mut().for_each(|joint| *joint = Transform::IDENTITY);
    refused(&scene, &Variant::of(&scene, &pose).scene(), &["one point"]);
}

#[test]
fn names_of_nobody_are_refused() {
    let scene = samples::mannequin_scene();
    let chain = Variant::of(&scene, &plain(&scene).rest)
        .without(|name| !name.starts_with("spine"))
        .renamed(|name| format!("crane_{}", name.len()));
    refused(&scene, &chain.scene(), &["another skeleton"]);
}

#[test]
fn a_dog_is_no_rest_pose_of_a_human() {
    let dog = dog();
    refused(&samples::mannequin_scene(), &dog, &[]);
    let walker = Scene { clips: Vec::new(), ..samples::walk_scene() };
    refused(&walker, &dog, &[]);
    refused(&dog, &walker, &[]);
}

/// Four legs, a trunk, a neck, a head and a tail.
pub(super) fn dog() -> Scene {
    let mut rows: Vec<(String, Option<usize>, DVec3)> = Vec::new();
    let mut add = |name: String, parent: Option<usize>, place: DVec3| {
        rows.push((name, parent, place));
        rows.len() - 1
    };
    let pelvis = add("Pelvis".into(), None, DVec3::new(0.0, 0.6, -0.3));
    let mut spine = pelvis;
    for index in 0..3 {
        spine = add(format!("Spine{index}"), Some(spine), DVec3::new(0.0, 0.62, -0.2 + 0.2 * f64::from(index)));
    }
    let neck = add("Neck".into(), Some(spine), DVec3::new(0.0, 0.7, 0.35));
    add("Head".into(), Some(neck), DVec3::new(0.0, 0.85, 0.45));
    let tail = add("Tail1".into(), Some(pelvis), DVec3::new(0.0, 0.6, -0.4));
    add("Tail2".into(), Some(tail), DVec3::new(0.0, 0.55, -0.55));
    for (side, x) in [("Left", 0.1), ("Right", -0.1)] {
        for (pair, carrier, z) in [("Front", spine, 0.25), ("Hind", pelvis, -0.3)] {
            let mut parent = carrier;
            for (part, y) in [("UpperLeg", 0.55), ("LowerLeg", 0.3), ("Paw", 0.03)] {
                parent = add(format!("{side}{pair}{part}"), Some(parent), DVec3::new(x, y, z + 0.02 * (0.5 - y)));
            }
        }
    }
    let joint = |(node, (name, parent, place)): (usize, &(String, Option<usize>, DVec3))| {
        let above = parent.map_or(DVec3::ZERO, |parent| rows[parent].2);
        Joint {
            name: name.clone(),
            parent: *parent,
            rest: Transform::from_translation(*place - above),
            is_joint: true,
            node,
        }
    };
    let joints = rows.iter().enumerate().map(joint).collect();
    Scene {
        skeleton: Skeleton::new(joints).expect("a skeleton"),
        axes: Some(retargetd::model::Axes::Y_UP_Z_FRONT),
        unit_meters: Some(1.0),
        ..Scene::default()
    }
}

#[test]
fn sides_named_the_other_way_round_are_matched_by_where_they_are() {
    let scene = samples::mannequin_scene();
    let expected = posed(&scene, PoseChoice::T);
    let swapped = |name: &str| {
        name.strip_suffix("_l")
            .map(|name| format!("{name}_r"))
            .or_else(|| name.strip_suffix("_r").map(|name| format!("{name}_l")))
            .unwrap_or_else(|| name.to_owned())
    };
    for (what, rest) in [
        ("names", Variant::of(&scene, &expected).renamed(swapped).scene()),
        ("places", Variant::of(&scene, &expected).mirrored().scene()),
    ] {
        let found = upload(&scene, &rest, &expected).expect("a rig");
        assert!(found.codes.contains(&"rest_file_mirrored"), "{what}: {:?}", found.codes);
        assert!(found.limb_degrees.0 < 2.0, "{what}: {:?}", found.limb_degrees);
    }
}

#[test]
fn what_is_missing_is_named_and_rides() {
    let scene = samples::mannequin_scene();
    let expected = posed(&scene, PoseChoice::T);
    let is_right_arm = |name: &str| name.ends_with("_r") && (name.contains("arm") || name.contains("hand"));
    let rest = Variant::of(&scene, &expected).without(is_right_arm).scene();
    let found = upload(&scene, &rest, &expected).expect("a rig");
    assert!(found.codes.contains(&"rest_file_incomplete"), "{:?}", found.codes);
    assert!(!found.fit.missing.is_empty(), "{:?}", found.fit);
}

#[test]
fn a_skeleton_that_cannot_be_in_that_pose_says_so() {
    let scene = samples::mannequin_scene();
    let mut pose = posed(&scene, PoseChoice::T);
    let index = scene.skeleton.find("thigh_l").expect("a joint");
    for joint in 0..scene.skeleton.len() {
        if scene.skeleton.is_ancestor_or_self(index, joint) {
            pose.transforms_mut()[joint].translation += DVec3::new(0.0, 0.12, 0.1);
        }
    }
    let rest = Variant::of(&scene, &pose).scene();
    let found = upload(&scene, &rest, &pose).expect("a rig");
    assert!(found.codes.contains(&"rest_residual"), "{:?} {:?}", found.codes, found.fit.worst());
    let (joint, degrees) = found.fit.worst().expect("residuals");
    assert_eq!(scene.skeleton.joints()[joint].name, "pelvis", "the joint that would have to bend in two ways");
    assert!(degrees > 5.0, "{degrees}");
}

#[test]
fn a_sleeper_is_turned_upright() {
    let scene = samples::mannequin_scene();
    let expected = plain(&scene).rest;
    let lying = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    let axes = Some(retargetd::model::Axes::Y_UP_Z_FRONT);
    let rest = Variant::of(&scene, &expected).turned(lying, axes).scene();
    let found = upload(&scene, &rest, &expected).expect("a rig");
    assert!(found.limb_degrees.0 < 0.1, "{:?}", found.limb_degrees);
    assert!(found.codes.contains(&"up_contradicts_file"), "the file says that another axis is up: {:?}", found.codes);
}

#[test]
fn real_animals_are_no_rest_pose_of_a_human() {
    let Some(fox) = corpus_file("creatures/Fox.glb") else { return };
    let fox = super::corpus::scene_of(&fox);
    refused(&samples::mannequin_scene(), &fox, &[]);
    refused(&fox, &samples::mannequin_scene(), &[]);
}

#[test]
fn numbers_that_are_none_are_refused_by_the_reader() {
    let bvh = "HIERARCHY\nROOT Hips\n{\nOFFSET nan 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n\
               MOTION\nFrames: 1\nFrame Time: 0.03\n0 0 0\n";
    let read = formats::read(bvh.as_bytes(), Format::Bvh, &Limits::default(), &Control::new(), &mut Reporter::new());
    assert!(
        read.is_err()
            || read.is_ok_and(|scene| scene.skeleton.rest_pose().transforms().iter().all(Transform::is_finite))
    );
}

#[test]
fn a_capture_of_one_frame_counts_as_that_frame() {
    let scene = samples::mannequin_scene();
    let expected = posed(&scene, PoseChoice::T);
    // Joints along one axis at zero, as captures have them, and the pose in the frame.
    let local = expected.to_local(&scene.skeleton);
    let joints = scene.skeleton.joints().iter().map(|joint| {
        let rest = Transform { rotation: DQuat::IDENTITY, ..joint.rest };
        Joint { rest, ..joint.clone() }
    });
    let tracks = local
        .transforms()
        .iter()
        .map(|joint| JointTracks { rotation: Track::Constant(joint.rotation.as_quat()), ..JointTracks::default() });
    let clip = Clip::new("T".into(), vec![0.0], tracks.collect()).expect("a clip");
    let skeleton = Skeleton::new(joints.collect()).expect("a skeleton");
    let rest = Scene { skeleton, clips: vec![clip], ..Scene::default() };
    let found = upload(&scene, &rest, &expected).expect("a rig");
    assert!(found.limb_degrees.0 < 0.1, "{:?} {:?}", found.limb_degrees, found.codes);
}
