//! Real characters: the same body in two formats, and each of them as other programs would export it.

use std::{f64::consts::FRAC_PI_2, path::Path};

use glam::{DQuat, DVec3};
use retargetd::{
    formats::{self, Limits},
    model::{Axes, Control, Reporter, Scene, Transform},
    rig::{PoseChoice, Rig, RigSpec},
};

use super::{
    expected::{plain, posed, rig_of, upload},
    variant::Variant,
};
use crate::support::corpus_file;

/// Characters of many conventions, tuned on.
const TUNED: [&str; 9] = [
    "mixamo/gltf/Xbot.glb",
    "unreal/ue4_names_apose.glb",
    "readyplayerme/rpm_avatar_a.glb",
    "vrm0/makehuman_body_vrm0.vrm",
    "cc0-stylised/kaykit_knight.glb",
    "mixamo/gltf/mousey_meshopt.glb",
    "cc0-stylised/quaternius_adventurer.gltf",
    "poser-daz/daz_g8_names_apose.glb",
    "cc0-stylised/robot_expressive.glb",
];

pub(super) fn scene_of(path: &Path) -> Scene {
    let bytes = std::fs::read(path).expect("readable");
    let (control, limits) = (Control::new(), Limits::default());
    let name = path.to_string_lossy();
    let (format, bytes) = formats::open(&bytes, &name, &limits, &control).expect("a format");
    let bytes =
        if format == formats::Format::Gltf { crate::support::with_buffers(&bytes, path) } else { bytes.into_owned() };
    formats::read(&bytes, format, &limits, &control, &mut Reporter::new()).expect("a scene")
}

/// Characters that nothing was tuned on.
const HELD: [&str; 14] = [
    "mixamo/gltf/michelle_meshopt.glb",
    "mixamo/gltf/Soldier.glb",
    "mixamo/gltf/joe_meshopt_9skins.glb",
    "rigify-blender/gdquest_sophia.glb",
    "character-creator/cc_base_idle.glb",
    "vrm1/makehuman_body_vrm1.vrm",
    "vrm0/catbot.vrm",
    "vrm0/godette.vrm",
    "vrm0/cryptovoxels.vrm",
    "unreal/mannequiny.glb",
    "cc0-stylised/godot_robot.glb",
    "unreal/m2m_human_male.glb",
    "biped/rocketbox_male_adult_01.fbx",
    "cc0-stylised/kenney_medium_maya.fbx",
];

type Make = fn(Variant) -> Variant;

const EXPORTS: [(&str, Make); 7] = [
    ("as it is", |body| body),
    ("axes of the model, Z up, not said, in cm", |body| {
        body.without_axes().turned(DQuat::from_rotation_x(FRAC_PI_2), None).scaled(100.0, None)
    }),
    ("random axes", |body| body.with_random_axes(5)),
    ("facing back, in another order", |body| {
        body.turned(DQuat::from_rotation_y(std::f64::consts::PI), Some(Axes::Y_UP_Z_FRONT)).shuffled(3)
    }),
    ("a namespace, below a turned node of 0.01", |body| {
        body.renamed(|name| format!("Hero:{name}")).below_armature(DQuat::from_rotation_x(-FRAC_PI_2), 0.01)
    }),
    ("elsewhere, twice as large, random axes and order", |body| {
        body.moved(DVec3::new(1.0, 0.0, 2.0)).scaled(2.0, Some(1.0)).with_random_axes(8).shuffled(2)
    }),
    ("with bones rolled", |body| body.with_rolls(DVec3::Y, 90.0)),
];

/// Uploads every export of every character in its own pose and in a T pose; tells what went wrong and how many there were.
fn matrix(files: &[&str]) -> (usize, Vec<String>) {
    let mut problems = Vec::new();
    let mut count = 0;
    for file in files {
        let Some(path) = corpus_file(file) else { continue };
        let scene = Scene { clips: Vec::new(), ..scene_of(&path) };
        let own = plain(&scene).rest;
        for (pose, expected, most) in [("own", own, 1.0), ("T", posed(&scene, PoseChoice::T), 2.0)] {
            for (name, make) in EXPORTS {
                let rest = make(Variant::of(&scene, &expected)).scene();
                count += 1;
                match upload(&scene, &rest, &expected) {
                    Ok(found) if found.limb_degrees.0 <= most => {}
                    Ok(found) => problems.push(format!(
                        "{file} in its {pose} pose, {name}: {:?}, said {:?}",
                        found.limb_degrees, found.codes
                    )),
                    Err(error) => problems.push(format!("{file} in its {pose} pose, {name}: {error}")),
                }
            }
        }
    }
    (count, problems)
}

#[test]
fn real_characters_take_the_pose_of_every_export() {
    let (count, problems) = matrix(&TUNED);
    assert!(problems.is_empty(), "{} of {count}:\n{}", problems.len(), problems.join("\n"));
}

#[test]
fn characters_that_nothing_was_tuned_on_do_too() {
    let (count, problems) = matrix(&HELD);
    assert!(problems.is_empty(), "{} of {count}:\n{}", problems.len(), problems.join("\n"));
}

/// Files whose rest pose is found in every way that there is.
const OF_ALL_KINDS: [&str; 10] = [
    "cc0-stylised/quaternius_adventurer.gltf",
    "cc0-stylised/robot_expressive.glb",
    "mixamo/gltf/Xbot.glb",
    "mixamo/fbx/walking_noskin.fbx",
    "bvh/rokoko/jesse_dance.bvh",
    "bvh/geno/Geno_bind.bvh",
    "bvh/bandai-namco/dataset-1_walk_normal_001.bvh",
    "bvh/cmu/12_01_walk.bvh",
    "bvh/fair1/zombie_zup.bvh",
    "decentraland/walk.glb",
];

#[test]
fn a_file_that_is_its_own_rest_file_changes_nothing() {
    let mut problems = Vec::new();
    for file in OF_ALL_KINDS {
        let Some(path) = corpus_file(file) else { continue };
        let scene = scene_of(&path);
        let own = plain(&scene);
        let (rig, _) = rig_of(&scene, Some(&scene), &RigSpec::default()).expect("a rig");
        let is_same = |(one, other): (&Transform, &Transform)| {
            one.rotation.angle_between(other.rotation) < 1e-6 && one.translation.distance(other.translation) < 1e-6
        };
        if !rig.rest_local.transforms().iter().zip(own.rest_local.transforms()).all(is_same) {
            problems.push(format!("{file}: {} but without {}", rig.rest_reason, own.rest_reason));
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// One character in two poses: the limbs point as in the rest file.
#[test]
fn an_a_pose_takes_the_t_pose_of_another_file() {
    let apose =
        ["unreal/ue4_names_apose.glb", "poser-daz/daz_g8_names_apose.glb", "unreal/ue4_names_apose_zup_xfwd.fbx"];
    let tpose =
        ["unreal/makehuman_game_engine_tpose.glb", "vrm0/makehuman_body_vrm0.vrm", "vrm1/makehuman_body_vrm1.vrm"];
    let mut problems = Vec::new();
    for (file, rest) in apose.iter().flat_map(|apose| tpose.map(|tpose| [(*apose, tpose), (tpose, *apose)])).flatten() {
        let Some((path, rest_path)) = corpus_file(file).zip(corpus_file(rest)) else { continue };
        let (scene, rest_scene) = (scene_of(&path), scene_of(&rest_path));
        let (rig, codes) = rig_of(&scene, Some(&rest_scene), &RigSpec::default()).expect("a rig");
        let wanted = plain(&rest_scene);
        for side in ["left_", "right_"] {
            for (from, to) in [("upper_arm", "forearm"), ("forearm", "hand"), ("thigh", "shin"), ("shin", "foot")] {
                let bone = |rig: &Rig<'_>| {
                    let place = |part: &str| rig.rest.transforms()[rig.role(&format!("{side}{part}"))[0]].translation;
                    rig.canonical_from_scene * (place(to) - place(from))
                };
                let degrees = bone(&rig).angle_between(bone(&wanted)).to_degrees();
                if degrees > 2.0 {
                    problems.push(format!("{rest} for {file}: {side}{from} is off by {degrees:.2} degrees, {codes:?}"));
                }
            }
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// One character in two formats.
const TWINS: [(&str, &str); 4] = [
    ("unreal/ue4_names_apose.glb", "unreal/ue4_names_apose_zup_xfwd.fbx"),
    ("poser-daz/daz_g8_names_apose.glb", "poser-daz/daz_g8_names_apose.fbx"),
    ("mixamo/cc0/makehuman_mixamo_names_rest.glb", "mixamo/cc0/makehuman_mixamo_names_rest_leafbones.fbx"),
    ("vrm0/makehuman_body_vrm0.vrm", "vrm1/makehuman_body_vrm1.vrm"),
];

#[test]
fn a_character_in_two_formats_is_one() {
    let mut problems = Vec::new();
    for (one, other) in TWINS {
        for (file, rest) in [(one, other), (other, one)] {
            let Some((path, rest_path)) = corpus_file(file).zip(corpus_file(rest)) else { continue };
            let (scene, rest_scene) = (scene_of(&path), scene_of(&rest_path));
            let own = plain(&scene).rest;
            match upload(&scene, &rest_scene, &own) {
                Ok(found) if found.limb_degrees.0 <= 1.0 => {}
                Ok(found) => {
                    problems.push(format!("{rest} for {file}: {:?}, said {:?}", found.limb_degrees, found.codes));
                }
                Err(error) => problems.push(format!("{rest} for {file}: {error}")),
            }
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}
