//! Rigs made by code, whose poses are known exactly.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DQuat, DVec3};
use retargetd::{
    model::{Axes, ModelPose, Scene, SignedAxis, Transform},
    rig::{OrientationFrom, PoseChoice, Rig},
    samples,
};

use super::{
    expected::{DOUBTS, Uploaded, limb_degrees, plain, posed, upload},
    variant::{Variant, hashed},
};

/// One way in which a file may differ from the rig.
struct Difference {
    name: &'static str,
    make: fn(Variant) -> Variant,
    /// Whether it hides how bones are rolled in another pose, as other axes do where no common pose is known.
    hides_rolls: bool,
}

fn z_up() -> Axes {
    Axes::new(SignedAxis::PositiveZ, SignedAxis::NegativeY).expect("axes")
}

const fn difference(name: &'static str, make: fn(Variant) -> Variant) -> Difference {
    Difference { name, make, hides_rolls: false }
}

const fn hiding(name: &'static str, make: fn(Variant) -> Variant) -> Difference {
    Difference { name, make, hides_rolls: true }
}

/// All ways, alone and in company.
const DIFFERENCES: [Difference; 24] = [
    difference("as it is", |body| body),
    difference("in centimeters", |body| body.scaled(100.0, Some(0.01))),
    difference("in inches, unit not said", |body| body.scaled(39.37, None)),
    difference("twice as tall", |body| body.scaled(2.0, Some(1.0))),
    difference("Z up, as declared", |body| body.turned(DQuat::from_rotation_x(FRAC_PI_2), Some(z_up()))),
    difference("Z up, axes not said", |body| body.turned(DQuat::from_rotation_x(FRAC_PI_2), None)),
    difference("Z up and X front, axes not said", |body| {
        body.turned(DQuat::from_rotation_z(FRAC_PI_2) * DQuat::from_rotation_x(FRAC_PI_2), None)
    }),
    difference("facing back", |body| body.turned(DQuat::from_rotation_y(PI), Some(Axes::Y_UP_Z_FRONT))),
    difference("facing aside", |body| body.turned(DQuat::from_rotation_y(-FRAC_PI_2), Some(Axes::Y_UP_Z_FRONT))),
    difference("facing 40° off", |body| {
        body.turned(DQuat::from_rotation_y(40.0_f64.to_radians()), Some(Axes::Y_UP_Z_FRONT))
    }),
    difference("below a turned node", |body| body.below_armature(DQuat::from_rotation_x(-FRAC_PI_2), 1.0)),
    difference("below a node of scale 0.01", |body| body.below_armature(DQuat::IDENTITY, 0.01)),
    difference("elsewhere", |body| body.moved(DVec3::new(3.0, 0.0, -7.0))),
    difference("in another order", |body| body.shuffled(7)),
    difference("with a namespace", |body| body.renamed(|name| format!("Hero:{name}"))),
    difference("with other punctuation", |body| body.renamed(|name| name.replace(['_', ':'], " ").to_uppercase())),
    difference("without twist joints and finger tips", |body| {
        body.without(|name| name.contains("twist") || name.ends_with("_03_l") || name.ends_with("3_End"))
    }),
    difference("with more joints", |body| {
        body.with_more_joints(&[
            "lowerarm_l",
            "lowerarm_r",
            "calf_l",
            "spine_03",
            "mixamorig:LeftForeArm",
            "mixamorig:RightLeg",
        ])
    }),
    hiding("with the axes of the model", Variant::without_axes),
    hiding("with random axes", |body| body.with_random_axes(11)),
    hiding("with bones rolled by 90°", |body| body.with_rolls(DVec3::X, 90.0).with_rolls(DVec3::Y, 90.0)),
    hiding("with random axes, Z up, in centimeters and another order", |body| {
        body.with_random_axes(3).turned(DQuat::from_rotation_x(FRAC_PI_2), None).scaled(100.0, None).shuffled(5)
    }),
    hiding("with the axes of the model, a namespace and more joints", |body| {
        body.without_axes().with_more_joints(&["calf_l", "mixamorig:LeftLeg"]).renamed(|name| format!("a|{name}"))
    }),
    hiding("with random axes, facing back, with other names in another order", |body| {
        body.with_random_axes(9)
            .turned(DQuat::from_rotation_y(PI), Some(Axes::Y_UP_Z_FRONT))
            .renamed(|name| format!("Bip_{}", name.replace(':', "-")))
            .shuffled(1)
    }),
];

fn bodies() -> [(&'static str, Scene); 2] {
    [("mannequin", samples::mannequin_scene()), ("walker", Scene { clips: Vec::new(), ..samples::walk_scene() })]
}

fn check(found: &Uploaded, most_degrees: f64, hides_rolls: bool) -> Vec<String> {
    let mut problems = Vec::new();
    let (limb, orientation) = (&found.limb_degrees, &found.orientation_degrees);
    if limb.0 > most_degrees {
        problems.push(format!("{} is off by {:.2}°", limb.1, limb.0));
    }
    if !hides_rolls && orientation.0 > most_degrees {
        problems.push(format!("{} is turned by {:.2}°", orientation.1, orientation.0));
    }
    if found.pelvis_off > 0.01 {
        problems.push(format!("the pelvis is off by {:.1} % of the leg", found.pelvis_off * 100.0));
    }
    let odd =
        found.codes.iter().filter(|code| DOUBTS.contains(code) && !(hides_rolls && **code == "rest_roll_guessed"));
    problems.extend(odd.map(|code| format!("a needless warning: {code}")));
    if hides_rolls && orientation.0 > 5.0 && !found.codes.contains(&"rest_roll_guessed") {
        problems.push(format!("{} is rolled by {:.2}° and nothing is said", orientation.1, orientation.0));
    }
    problems
}

#[test]
fn the_same_pose_gives_what_no_upload_gives() {
    let mut problems = Vec::new();
    let mut count = 0;
    for (body, scene) in bodies() {
        let own = plain(&scene);
        for difference in &DIFFERENCES {
            let rest = (difference.make)(Variant::of(&scene, &own.rest)).scene();
            count += 1;
            match upload(&scene, &rest, &own.rest) {
                Ok(found) => {
                    let found_problems = check(&found, 0.05, false);
                    problems
                        .extend(found_problems.iter().map(|problem| format!("{body}, {}: {problem}", difference.name)));
                }
                Err(error) => problems.push(format!("{body}, {}: refused: {error}", difference.name)),
            }
        }
    }
    assert!(problems.is_empty(), "{} in {count} uploads:\n{}", problems.len(), problems.join("\n"));
}

#[test]
fn another_pose_is_taken_over() {
    let mut problems = Vec::new();
    let mut count = 0;
    for (body, scene) in bodies() {
        for to in [PoseChoice::T, PoseChoice::A] {
            let expected = posed(&scene, to);
            for difference in &DIFFERENCES {
                let rest = (difference.make)(Variant::of(&scene, &expected)).scene();
                count += 1;
                match upload(&scene, &rest, &expected) {
                    Ok(found) => problems.extend(check(&found, 0.1, difference.hides_rolls).iter().map(|problem| {
                        format!("{body} in {to:?}, {}: {problem} ({:?})", difference.name, found.fit.orientation_from)
                    })),
                    Err(error) => problems.push(format!("{body} in {to:?}, {}: refused: {error}", difference.name)),
                }
            }
        }
    }
    assert!(problems.is_empty(), "{} in {count} uploads:\n{}", problems.len(), problems.join("\n"));
}

/// A pose in which everything below the pelvis is turned at random.
fn random_pose(scene: &Scene, seed: u64) -> ModelPose {
    let own = plain(scene);
    let pelvis = own.role("pelvis")[0];
    let mut local = own.rest_local;
    for (joint, transform) in local.transforms_mut().iter_mut().enumerate() {
        if joint != pelvis && scene.skeleton.is_ancestor_or_self(pelvis, joint) {
            let angle = |number: u64| (hashed(seed * 5000 + joint as u64 * 3 + number) - 0.5) * 0.7;
            transform.rotation *= DQuat::from_euler(glam::EulerRot::XYZ, angle(0), angle(1), angle(2));
        }
    }
    local.to_model(&scene.skeleton)
}

#[test]
fn any_pose_is_taken_over() {
    let mut problems = Vec::new();
    let mut count = 0;
    let bodies = bodies().into_iter().chain([("dog", super::hostile::dog())]);
    for (body, scene) in bodies {
        for (seed, difference) in DIFFERENCES.iter().enumerate() {
            let expected = random_pose(&scene, seed as u64);
            let rest = (difference.make)(Variant::of(&scene, &expected)).scene();
            count += 1;
            match upload(&scene, &rest, &expected) {
                Ok(found) if found.limb_degrees.0 < 2.0 || found.codes.contains(&"rest_facing_guessed") => {}
                Ok(found) => {
                    problems.push(format!("{body}, {}: {:?} {:?}", difference.name, found.limb_degrees, found.codes));
                }
                Err(error) => problems.push(format!("{body}, {}: refused: {error}", difference.name)),
            }
        }
    }
    assert!(problems.is_empty(), "{} in {count} uploads:\n{}", problems.len(), problems.join("\n"));
}

#[test]
fn joints_without_names_are_matched_by_their_place() {
    let mut problems = Vec::new();
    for (body, scene) in bodies() {
        let own = plain(&scene).rest;
        for (pose, expected) in [("its own pose", own), ("a T pose", posed(&scene, PoseChoice::T))] {
            let body_of = || Variant::of(&scene, &expected);
            let nameless = |body: Variant| body.renamed(|_| String::new());
            for (what, variant) in [
                ("no names", nameless(body_of())),
                ("numbers", body_of().renamed(|name| format!("bone{}", name.bytes().map(usize::from).sum::<usize>()))),
                ("no names, other axes and order", nameless(body_of().with_random_axes(2).shuffled(4))),
            ] {
                match upload(&scene, &variant.scene(), &expected) {
                    Ok(found) if found.codes.iter().any(|code| DOUBTS.contains(code)) && found.limb_degrees.0 < 2.0 => {
                    }
                    Ok(found) => {
                        problems.push(format!("{body} in {pose}, {what}: {:?} {:?}", found.limb_degrees, found.codes));
                    }
                    Err(error) => problems.push(format!("{body} in {pose}, {what}: refused: {error}")),
                }
            }
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn a_pose_that_both_files_hold_tells_the_rolls() {
    for (body, scene) in bodies() {
        let expected = posed(&scene, PoseChoice::T);
        let own = plain(&scene);
        let bound = Variant::of(&scene, &own.rest).with_random_axes(21).scene();
        let mut rest = Variant::of(&scene, &expected).with_random_axes(21).scene();
        rest.bind_pose = model_of(&bound).transforms().iter().copied().map(Some).collect();
        let found = upload(&scene, &rest, &expected).expect("a rig");
        assert_eq!(
            found.fit.orientation_from,
            OrientationFrom::CommonPose,
            "{body}: the pose that the skins were bound in"
        );
        // A bind pose is told from the nodes to 0.02 radians.
        assert!(found.orientation_degrees.0 < 1.2, "{body}: {:?}", found.orientation_degrees);
        assert!(found.limb_degrees.0 < 0.1, "{body}: {:?}", found.limb_degrees);
        assert!(!found.codes.contains(&"rest_roll_guessed"), "{body}: {:?}", found.codes);
    }
}

/// A file saved in mid-jump: the nodes lean and crouch, and only the bind matrices hold the pose that the rig was made in. The skin
/// knows nothing above the pelvis, and its space is that of the model or that of an armature.
#[test]
fn a_body_whose_nodes_lean_rests_as_its_skins_were_bound() {
    for (body, scene) in bodies() {
        for armature in [None, Some(DQuat::from_rotation_x(-FRAC_PI_2))] {
            let made = |pose: &ModelPose| {
                let variant = Variant::of(&scene, pose);
                armature.map_or(variant.clone(), |turn| variant.below_armature(turn, 1.0)).scene()
            };
            let upright = made(&plain(&scene).rest);
            let own = plain(&upright);
            let mut file = made(&leaning(&plain(&scene)));
            let bind_from_model = Transform::from_rotation(armature.unwrap_or_default().conjugate());
            let pelvis = own.role("pelvis")[0];
            let bound = |(joint, rest): (usize, &Transform)| {
                let is_skinned = upright.skeleton.is_ancestor_or_self(pelvis, joint);
                is_skinned.then(|| bind_from_model.then_child(rest))
            };
            file.bind_pose = own.rest.transforms().iter().enumerate().map(bound).collect();
            let off = limb_degrees(&plain(&file), &own.rest);
            assert!(off.0 < 0.5, "{body}, armature {armature:?}: {off:?}");
        }
    }
}

/// A rig's rest pose with the pelvis and two limbs turned, and all that hangs from them.
fn leaning(rig: &Rig<'_>) -> ModelPose {
    let lean = DQuat::from_rotation_x(0.7) * DQuat::from_rotation_z(0.3);
    let bend = DQuat::from_rotation_x(-1.1);
    let mut pose = rig.rest.clone();
    for (role, turn) in [("left_thigh", bend), ("right_shin", bend), ("pelvis", lean)] {
        let root = rig.role(role)[0];
        let center = pose.transforms()[root].translation;
        for (joint, moved) in pose.transforms_mut().iter_mut().enumerate() {
            if rig.skeleton().is_ancestor_or_self(root, joint) {
                moved.rotation = turn * moved.rotation;
                moved.translation = center + turn * (moved.translation - center);
            }
        }
    }
    pose
}

fn model_of(scene: &Scene) -> ModelPose {
    scene.skeleton.rest_pose().to_model(&scene.skeleton)
}

#[test]
fn the_rig_itself_is_no_upload() {
    for (body, scene) in bodies() {
        let own = plain(&scene);
        let (rig, codes) = super::expected::rig_of(&scene, Some(&scene), &Default::default()).expect("a rig");
        assert_eq!(rig.rest_local, own.rest_local, "{body}: to the last bit");
        assert!(!codes.iter().any(|code| DOUBTS.contains(code)), "{body}: {codes:?}");
    }
}

#[test]
fn other_proportions_keep_the_lengths_of_the_rig() {
    for (body, scene) in bodies() {
        for (to, seed) in [(PoseChoice::T, 1), (PoseChoice::A, 2), (PoseChoice::T, 3)] {
            let expected = posed(&scene, to);
            for (axes, random) in [("same axes", false), ("random axes", true)] {
                let variant = Variant::of(&scene, &expected).with_other_lengths(seed, 0.3);
                let rest = if random { variant.with_random_axes(seed) } else { variant }.scene();
                let found = upload(&scene, &rest, &expected).expect("a rig");
                assert!(!found.fit.is_one_build, "{body}: {:?}", found.fit);
                assert!(found.limb_degrees.0 < 2.0, "{body} in {to:?}, {axes}: {:?}", found.limb_degrees);
            }
        }
    }
}

#[test]
fn another_body_lends_its_pose_by_role() {
    let [(_, mannequin), (_, walker)] = bodies();
    for (body, scene, other) in [("mannequin", &mannequin, &walker), ("walker", &walker, &mannequin)] {
        for to in [PoseChoice::T, PoseChoice::A] {
            let rest = Variant::of(other, &posed(other, to)).with_random_axes(4).scene();
            let found = upload(scene, &rest, &posed(scene, to)).expect("a rig");
            assert!(found.codes.contains(&"rest_file_matched_by_role"), "{body}: {:?}", found.codes);
            let limb = &found.limb_degrees;
            // Hands and fingers of two bodies differ in more than their pose.
            let is_finger =
                ["thumb", "index", "middle", "ring", "pinky", "hand"].iter().any(|part| limb.1.ends_with(part));
            assert!(limb.0 < if is_finger { 12.0 } else { 3.0 }, "{body} in {to:?}: {limb:?}");
        }
    }
}
