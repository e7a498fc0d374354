//! The rig doctor on real files whose illnesses are known.

use std::collections::BTreeSet;

use retargetd::engine::{Control, Inspection, Limits, NamedBytes, inspect};

use crate::support::corpus_file;

fn examined(path: &str) -> Option<Inspection> {
    let file = corpus_file(path)?;
    let bytes = std::fs::read(&file).expect("readable");
    let name = file.file_name().expect("a name").to_string_lossy().into_owned();
    let found = inspect(NamedBytes { name: &name, bytes: &bytes }, &Limits::default(), &Control::new());
    Some(found.unwrap_or_else(|failure| panic!("{path}: {failure}")))
}

/// Files, and what must be found in each.
const KNOWN: [(&str, &[&str]); 24] = [
    ("cc0-stylised/quaternius_adventurer.gltf", &["bind_pose_differs", "limb_disconnected"]),
    (
        "cc0-stylised/robot_expressive.glb",
        &["bind_pose_differs", "scale_above_skeleton", "limb_disconnected", "several_skins"],
    ),
    ("cc0-stylised/kenney_medium_maya.fbx", &["bind_pose_differs"]),
    ("cc0-stylised/quaternius_orc_draco.glb", &["bind_pose_differs"]),
    ("cc0-stylised/godot_robot.glb", &["scale_above_skeleton"]),
    ("mixamo/fbx/walking_noskin.fbx", &["no_skin"]),
    ("mixamo/gltf/Soldier.glb", &["scale_above_skeleton", "several_skins"]),
    ("mixamo/gltf/joe_meshopt_9skins.glb", &["several_skins"]),
    ("mixamo/gltf/skeleton_underscore_names.glb", &["size_implausible"]),
    ("odd-transforms/armature_nonuniform_scale.glb", &["non_uniform_scale", "shear"]),
    ("odd-transforms/armature_nonuniform_scale.fbx", &["non_uniform_scale", "shear"]),
    ("odd-transforms/armature_rotated_offset_001.glb", &["size_implausible"]),
    ("misc-rigs/ozz_pab_walk.fbx", &["negative_scale"]),
    ("misc-rigs/m2m_cmu_91_48.fbx", &["size_implausible", "scale_above_skeleton"]),
    ("smpl/text2motion_smpl_skeleton.fbx", &["size_implausible"]),
    ("roblox-r15/g9_roblox_facs.fbx", &["size_implausible"]),
    ("rigify-blender/rigify_def_only.glb", &["limb_disconnected"]),
    ("rigify-blender/rigify_full_controls_leafbones.fbx", &["non_uniform_scale", "limb_disconnected"]),
    ("khronos/CesiumMan.glb", &["joint_names_missing"]),
    ("bvh/cmu/12_01_walk.bvh", &["unit_unknown", "feet_off_floor"]),
    ("creatures/m2m_rig_spider.glb", &["no_animation"]),
    ("creatures/oculus_hand_left.fbx", &["no_body"]),
    ("hostile/gltf/node_scale_zero.gltf", &["zero_scale"]),
    ("hostile/bvh/names_duplicate.bvh", &["joint_names_repeated"]),
];

#[test]
fn known_illnesses_are_found() {
    for (path, wanted) in KNOWN {
        let Some(inspection) = examined(path) else { return };
        let codes: BTreeSet<&str> = inspection.findings.iter().map(|finding| finding.code).collect();
        for code in wanted {
            assert!(codes.contains(code), "{path}: no {code} among {codes:?}");
        }
        assert!(inspection.findings.iter().all(|finding| !finding.fix.is_empty()), "{path}: each has its fix");
        assert!(inspection.findings.is_sorted_by_key(|finding| finding.severity != "error"), "{path}: the worst first");
    }
}

/// Rigs that thousands of people use as they are.
const WELL: [&str; 4] = [
    "mixamo/gltf/Xbot.glb",
    "mixamo/gltf/Soldier.glb",
    "mixamo/gltf/michelle_meshopt.glb",
    "readyplayerme/rpm_avatar.fbx",
];

#[test]
fn rigs_that_are_well_get_notes_only() {
    for path in WELL {
        let Some(inspection) = examined(path) else { continue };
        for finding in inspection.findings.iter().filter(|finding| finding.code != "no_body") {
            assert_eq!(finding.severity, "note", "{path}: {finding:?}");
        }
    }
}

#[test]
fn a_spider_is_shown_with_its_legs() {
    let Some(inspection) = examined("creatures/m2m_rig_spider.glb") else { return };
    let rig = &inspection.rigs[0];
    assert_eq!((rig.kind, rig.forward, rig.up), ("other", Some("+z"), Some("+y")), "what the wire has");
    assert_eq!(rig.recognised_as.as_deref(), Some("mesh2motion_spider"), "a rig with a name");
    let codes: BTreeSet<&str> = inspection.findings.iter().map(|finding| finding.code).collect();
    assert!(!codes.contains("no_body"), "it is a body: {codes:?}");
    let doubts: Vec<&str> = inspection.warnings.iter().map(|warning| warning.code).collect();
    assert!(doubts.is_empty(), "names and shape agree: {doubts:?}");
    let text = inspection.to_string();
    let rows = ["creature on 8 legs", "left_leg_1", "leg_a_1_l, leg_a_2_l, leg_a_3_l", "right_leg_4"];
    for row in rows {
        assert!(text.contains(row), "'{row}' in:\n{text}");
    }
    let template = rig.template.as_ref().expect("a template to keep");
    assert_eq!(template.roles["left_leg_4"][0], "leg_d_1_l", "{template:?}");
}

#[test]
fn one_body_with_layers_of_controls_is_one_body() {
    let Some(inspection) = examined("rigify-blender/rigify_full_controls_leafbones.fbx") else { return };
    assert!(inspection.findings.iter().all(|finding| finding.code != "several_bodies"), "{:?}", inspection.findings);
}
