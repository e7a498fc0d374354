//! Several characters in one file: which is taken, that it is said, and that the config chooses.

use glam::DVec3;
use retargetd::{
    model::{Joint, Reporter, Scene, Skeleton, Warning},
    rig::{Rig, RigSpec},
    samples,
};

/// The mannequin, and `count` more of them two metres apart, each below a node of its own; names as exporters repeat them.
fn crowd(count: usize) -> Scene {
    let mannequin = samples::mannequin_scene();
    let alone = mannequin.skeleton.joints();
    let mut joints: Vec<Joint> = Vec::new();
    for place in 0..=count {
        let base = joints.len();
        joints.extend(alone.iter().cloned().map(|mut joint| {
            if joint.parent.is_none() {
                joint.rest.translation += DVec3::X * 2.0 * place as f64;
            }
            if place > 0 {
                joint.name = format!("{}.{place:03}", joint.name);
            }
            joint.parent = joint.parent.map(|parent| parent + base);
            joint.node += base;
            joint
        }));
    }
    Scene {
        skeleton: Skeleton::new(joints).expect("parents come first"),
        clips: Vec::new(),
        skins: Vec::new(),
        ..mannequin
    }
}

fn seen<'a>(scene: &'a Scene, character: Option<&str>) -> (Rig<'a>, Vec<Warning>) {
    let spec = RigSpec { character: character.map(str::to_owned), ..RigSpec::default() };
    let mut reporter = Reporter::new();
    let rig = Rig::new("target", scene, None, &spec, &mut reporter).expect("a rig");
    let warnings = reporter.into_warnings().into_iter().filter(|warning| warning.code == "several_characters");
    (rig, warnings.collect())
}

#[test]
fn of_several_characters_one_is_taken_and_the_others_are_told() {
    for count in [1, 3] {
        let scene = crowd(count);
        let (rig, warnings) = seen(&scene, None);
        let pelvis = rig.role("pelvis")[0];
        let name = &scene.skeleton.joints()[pelvis].name;
        let [warning] = warnings.as_slice() else { panic!("one warning: {warnings:?}") };
        assert!(warning.detail.contains(&format!("{} characters", count + 1)), "{warning}");
        assert!(warning.detail.contains(&format!("'{name}' is taken")), "{warning}");
        assert!(warning.hint.contains("target.character"), "{warning}");
    }
}

#[test]
fn the_config_chooses_a_character_by_any_joint_above_it() {
    let scene = crowd(2);
    let alone = samples::mannequin_scene();
    let (plain, _) = seen(&alone, None);
    let count = alone.skeleton.len();
    let top = &alone.skeleton.joints()[0].name;
    for (place, name) in [(0, top.clone()), (1, format!("{top}.001")), (2, format!("{top}.002"))] {
        let (rig, warnings) = seen(&scene, Some(&name));
        assert!(warnings.is_empty(), "{name} was asked for: {warnings:?}");
        assert_eq!(rig.recognition.kind, plain.recognition.kind, "{name}");
        for (role, finding) in &plain.recognition.roles {
            let expected: Vec<usize> = finding.joints.iter().map(|joint| joint + place * count).collect();
            assert_eq!(rig.recognition.roles[role].joints, expected, "{name}: {role}");
        }
    }
}

#[test]
fn one_character_is_not_several() {
    let (_, warnings) = seen(&crowd(0), None);
    assert!(warnings.is_empty(), "{warnings:?}");
}

#[test]
fn a_character_that_is_not_there_is_refused() {
    let scene = crowd(1);
    let spec = RigSpec { character: Some("nobody".to_owned()), ..RigSpec::default() };
    let error = Rig::new("target", &scene, None, &spec, &mut Reporter::new()).expect_err("no such joint");
    assert!(error.to_string().contains("nobody"), "{error}");
}
