//! Real files against the truth about them.

use std::collections::BTreeMap;

use retargetd::{
    engine::{Inspection, NamedBytes, OneOrMore, RigView, inspect},
    formats::Limits,
    model::Control,
    rig::Role,
};

use super::schemes::{self as s, Scheme};
use crate::support::corpus_file;

/// A body, what it is recognized as (empty: none), how its rest pose holds the arms, a prefix of its joints' names, and the
/// schemes that they follow.
type Row = (&'static str, &'static str, &'static str, &'static str, &'static [Scheme]);

const BODIES: &[Row] = &[
    ("mixamo/gltf/Xbot.glb", "mixamo", "T", "mixamorig:", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("mixamo/gltf/Soldier.glb", "mixamo", "T", "mixamorig:", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("mixamo/gltf/joe_meshopt_9skins.glb", "mixamo", "T", "mixamorig7:", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("mixamo/gltf/michelle_meshopt.glb", "mixamo", "T", "mixamorig:", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("mixamo/gltf/mousey_meshopt.glb", "mixamo", "T", "mixamorig:", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("mixamo/gltf/skeleton_underscore_names.glb", "mixamo", "T", "mixamorig_", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("mixamo/cc0/makehuman_mixamo_names_rest.glb", "mixamo", "T", "mixamorig:", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    (
        "mixamo/cc0/makehuman_mixamo_names_rest_leafbones.fbx",
        "mixamo",
        "T",
        "mixamorig:",
        &[s::MIXAMO, s::MIXAMO_FINGERS],
    ),
    ("mixamo/fbx/ybot_prerotation_skin.fbx", "mixamo", "T", "mixamorig:", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("mixamo/fbx/samba_dancing_skin.fbx", "mixamo", "T", "mixamorig:", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("mixamo/fbx/turn_left_45_noskin.fbx", "mixamo", "T", "mixamorig:", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("mixamo/fbx/walking_noskin.fbx", "mixamo", "T", "mixamorig:", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("mixamo/fbx/zombie_walk_noprefix_noskin.fbx", "mixamo", "T", "", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("mixamo/bvh/freebvh_mixamorig.bvh", "mixamo", "T", "mixamorig:", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("mixamo/bvh/ortiz_salsa.bvh", "mixamo", "T", "mixamorig:", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("mixamo/bvh/mousey_salsa.bvh", "mixamo", "T", "mixamorig:", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("readyplayerme/rpm_avatar_a.glb", "ready_player_me", "A", "", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("readyplayerme/rpm_avatar.fbx", "ready_player_me", "A", "", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("readyplayerme/rpm_talking_noskin.fbx", "ready_player_me", "T", "", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("decentraland/walk.glb", "decentraland", "arms_down", "Avatar_", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("humanik-unity/maya_character.fbx", "humanik", "T", "Character1_", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("humanik-unity/maya_human_ik_unit_metre.fbx", "humanik", "T", "Character1_", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("bvh/misc/momask_template_lafan_names.bvh", "lafan", "T", "", &[s::LAFAN]),
    ("bvh/misc/hunyuan_like_20fps.bvh", "lafan", "T", "", &[s::LAFAN]),
    ("bvh/fair1/dab_zup.bvh", "humanik", "T", "", &[s::LONG_SPINE]),
    ("bvh/misc/pybvh_mixed_orders.bvh", "humanik", "T", "", &[s::LONG_SPINE]),
    ("bvh/geno/Geno_bind.bvh", "humanik", "other", "", &[s::LONG_SPINE, s::MIXAMO_FINGERS]),
    ("bvh/rokoko/jesse_dance.bvh", "perception_neuron", "other", "", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("bvh/cmu/01_01_motionbuilder.bvh", "cmu", "T", "", &[s::CMU]),
    ("bvh/cmu/12_01_walk.bvh", "cmu", "T", "", &[s::CMU]),
    ("bvh/cmu/xia_angry_inches.bvh", "cmu", "T", "", &[s::CMU]),
    ("bvh/cmu/jumping_jacks_max_names.bvh", "cmu_3ds_max", "arms_down", "", &[s::CMU_FOR_MAX]),
    ("bvh/cmu/boxing_toes_row_mismatch.bvh", "biovision", "T", "", &[s::BIOVISION]),
    ("cmu-rig/makehuman_cmu_names_rest.glb", "cmu", "A", "", &[s::CMU]),
    ("bvh/misc/mocapbank.bvh", "biovision", "arms_down", "", &[s::BIOVISION]),
    ("bvh/misc/liveanimation_sample01.bvh", "biovision", "T", "", &[s::BIOVISION]),
    ("bvh/xsens/aitviewer_sample.bvh", "xsens", "T", "", &[s::BIOVISION, s::XSENS_SPINE]),
    ("bvh/xsens/pybvh_test2_chest4.bvh", "xsens", "arms_down", "", &[s::BIOVISION, s::XSENS_SPINE]),
    ("bvh/xsens/dragposer_example_2_zup_metres.bvh", "", "T", "", &[s::XSENS_LOWER_CASE]),
    ("bvh/100style/100style_character.fbx", "xsens", "T", "BVH:", &[s::BIOVISION, s::XSENS_SPINE]),
    ("bvh/misc/makehuman_tpose_173joints.bvh", "makehuman", "A", "", &[s::MAKEHUMAN]),
    // Its offsets lay one leg to the left and one to the right; as a rest pose that says nothing.
    ("bvh/bandai-namco/dataset-1_walk_normal_001.bvh", "", "other", "", &[s::BANDAI_NAMCO]),
    ("unreal/ue4_names_apose.glb", "unreal_4", "A", "", &[s::UNREAL]),
    ("unreal/ue4_names_apose_zup_xfwd.fbx", "unreal_4", "A", "", &[s::UNREAL]),
    ("unreal/m2m_human_male.glb", "unreal_4", "T", "", &[s::UNREAL]),
    ("unreal/m2m_human_zombie.glb", "unreal_4", "T", "", &[s::UNREAL]),
    ("unreal/makehuman_game_engine_tpose.glb", "unreal_4", "T", "", &[s::UNREAL]),
    ("unreal/mannequiny.glb", "unreal_4", "T", "", &[s::MANNEQUINY]),
    ("odd-transforms/armature_rotated_offset_001.glb", "unreal_4", "A", "", &[s::UNREAL]),
    ("odd-transforms/armature_nonuniform_scale.glb", "unreal_4", "A", "", &[s::UNREAL]),
    ("humanik-unity/viverse_mannequin_meshopt.glb", "vrm", "T", "", &[s::UNITY]),
    ("humanik-unity/viverse_walk.glb", "vrm", "T", "", &[s::UNITY]),
    ("vrma/test_small.vrma", "vrm", "T", "", &[s::UNITY]),
    ("vrm0/armature_transform.vrm", "vrm", "T", "", &[s::VRM_ADDON]),
    ("vrm0/basic_armature.vrm", "vrm", "T", "", &[s::VRM_ADDON, s::VRM_ADDON_FINGERS]),
    ("vrm0/cryptovoxels.vrm", "vrm", "T", "", &[s::CRYPTOVOXELS]),
    ("vrm0/godette.vrm", "vrm", "T", "", &[s::GODETTE]),
    ("vrm0/makehuman_body_vrm0.vrm", "vrm", "T", "", &[s::UNREAL]),
    ("vrm1/makehuman_body_vrm1.vrm", "vrm", "T", "", &[s::UNREAL]),
    ("vrm1/basic_armature_vrm1.vrm", "vrm", "T", "", &[s::VRM_ADDON, s::VRM_ADDON_FINGERS]),
    ("vrm1/debug_robot.vrm", "vrm", "T", "", &[s::VRM_ADDON, s::VRM_ADDON_FINGERS]),
    ("character-creator/cc_base_idle.glb", "character_creator", "T", "", &[s::CHARACTER_CREATOR]),
    ("poser-daz/daz_g8_names_apose.glb", "daz_genesis_8", "A", "", &[s::GENESIS_8]),
    ("poser-daz/daz_g8_names_apose.fbx", "daz_genesis_8", "A", "", &[s::GENESIS_8]),
    ("poser-daz/pirouette_daz_friendly.bvh", "poser", "T", "", &[s::POSER]),
    ("misc-rigs/m2m_cmu_91_48.fbx", "poser", "T", "", &[s::POSER]),
    ("rigify-blender/gdquest_sophia.glb", "rigify", "T", "", &[s::RIGIFY]),
    ("rigify-blender/rigify_def_only.glb", "rigify", "A", "", &[s::RIGIFY]),
    ("rigify-blender/rigify_full_controls_leafbones.fbx", "rigify", "T", "", &[s::RIGIFY]),
    ("rigify-blender/m2m_def_skeleton.glb", "rigify", "T", "", &[s::RIGIFY_HIPS]),
    ("biped/rocketbox_male_adult_01.fbx", "biped_3ds_max", "A", "", &[s::BIPED]),
    ("biped/source_valvebiped_names_apose.fbx", "valve_biped", "A", "", &[s::VALVE]),
    ("smpl/text2motion_smpl_skeleton.fbx", "smpl", "T", "", &[s::SMPL]),
    ("misc-rigs/17_keypoints_walk.fbx", "human36m", "T", "", &[s::KEYPOINTS]),
    ("misc-rigs/ozz_pab_walk.fbx", "humanik", "arms_down", "", &[s::OZZ]),
    ("roblox-r15/g9_roblox_facs.fbx", "roblox_r15", "A", "", &[s::ROBLOX]),
    ("cc0-stylised/quaternius_adventurer.gltf", "", "T", "", &[s::QUATERNIUS]),
    ("cc0-stylised/quaternius_orc_draco.glb", "", "T", "", &[s::QUATERNIUS]),
    ("cc0-stylised/kaykit_knight.glb", "", "T", "", &[s::KAYKIT]),
    ("cc0-stylised/godot_robot.glb", "", "A", "", &[s::GODOT_ROBOT]),
    ("cc0-stylised/kenney_medium_maya.fbx", "humanik", "T", "", &[s::KENNEY]),
    ("bvh/bandai-namco/dataset-1_bow_active_001.bvh", "", "other", "", &[s::BANDAI_NAMCO]),
    ("bvh/fair1/wave_hello_zup.bvh", "humanik", "T", "", &[s::LONG_SPINE, s::HUMANIK_LIMBS]),
    ("bvh/misc/makehuman_zombie_walk.bvh", "", "T", "", &[s::MAKEHUMAN_OLD]),
    ("bvh/misc/meredith_8walk_vicon.bvh", "humanik", "T", "", &[s::HUMANIK_LIMBS]),
    ("bvh/misc/mia_78joints_allpos.bvh", "humanik", "T", "", &[s::HUMANIK_LIMBS, s::FACE]),
    ("bvh/misc/olympe_root_two_frames.bvh", "", "arms_down", "", &[s::OLYMPE]),
    ("mixamo/bvh/beta_walking_mixed_orders.bvh", "mixamo", "T", "Beta:", &[s::HUMANIK_LIMBS, s::MIXAMO_FINGERS]),
    ("mixamo/bvh/kate_sign_49posjoints.bvh", "mixamo", "T", "mixamorig:", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("mixamo/fbx/retarget_original_rig.fbx", "mixamo", "T", "mixamorig:", &[s::MIXAMO, s::MIXAMO_FINGERS]),
    ("odd-transforms/armature_nonuniform_scale.fbx", "unreal_4", "A", "", &[s::UNREAL]),
    ("rigify-blender/m2m_def_clips.glb", "rigify", "T", "", &[s::RIGIFY_HIPS]),
    ("unreal/m2m_clips_sample.glb", "unreal_4", "T", "", &[s::UNREAL]),
    ("unreal/m2m_rig_human.glb", "unreal_4", "T", "", &[s::UNREAL]),
    ("vrm0/catbot.vrm", "vrm", "T", "", &[s::CATBOT]),
];

/// Files without a body, or with one of which names say nothing.
const NO_BODIES: &[&str] = &[
    "creatures/m2m_rig_spider.glb",
    "creatures/oculus_hand_left.fbx",
    "creatures/spider_noskin.fbx",
    "cc0-stylised/quaternius_alien.fbx",
    "cc0-stylised/kenney_platformer_noskin.glb",
    "khronos/SimpleSkin.gltf",
    "khronos/SimpleSkinning.gltf",
    "khronos/rigged_simple.gltf",
    "misc-rigs/huesitos.fbx",
    "misc-rigs/animation_with_skeleton_generic_names.fbx",
    "bvh/misc/pybvh_rotation_first_root.bvh",
];

/// The labeled joints of a file: roles of the trunk and the left side, with the names of their joints.
pub(super) fn truth(path: &str) -> Option<Vec<(Role, Vec<String>)>> {
    let (.., prefix, schemes) = BODIES.iter().find(|row| row.0 == path)?;
    let label = |(role, names): &(&str, &str)| {
        let names = names.split('|').map(|name| format!("{prefix}{name}")).collect();
        (role.parse().expect("a role"), names)
    };
    Some(schemes.iter().copied().flatten().map(label).collect())
}

fn inspected(path: &str) -> Option<Inspection> {
    let file = corpus_file(path)?;
    let bytes = std::fs::read(&file).expect("a file of the corpus can be read");
    let name = file.file_name().and_then(|name| name.to_str()).expect("corpus names are text");
    let file = NamedBytes { name, bytes: &bytes };
    Some(inspect(file, &Limits::default(), &Control::new()).unwrap_or_else(|failure| panic!("{path}: {failure}")))
}

fn joints_of(rig: &RigView, role: &str) -> String {
    match rig.roles.get(role) {
        None => "(absent)".to_owned(),
        Some(OneOrMore::One(name)) => name.clone(),
        Some(OneOrMore::More(names)) => names.join("|"),
    }
}

#[test]
fn bodies_of_the_corpus_are_recognized() {
    let (mut checked, mut wrong) = (0, Vec::new());
    for (path, recognised_as, rest_pose, prefix, schemes) in BODIES {
        let Some(inspection) = inspected(path) else { continue };
        let Some(rig) = inspection.rigs.first() else {
            wrong.push(format!("{path}: no rig"));
            continue;
        };
        let mut expect = |what: &str, expected: &str, actual: &str| {
            checked += 1;
            if expected != actual {
                wrong.push(format!("{path}: {what} should be {expected:?}, is {actual:?}"));
            }
        };
        expect("kind", "biped", rig.kind);
        expect("recognised_as", recognised_as, rig.recognised_as.as_deref().unwrap_or(""));
        expect("rest_pose", rest_pose, rig.rest_pose);
        for (role, names) in schemes.iter().copied().flatten() {
            let expected: Vec<String> = names.split('|').map(|name| format!("{prefix}{name}")).collect();
            expect(role, &expected.join("|"), &joints_of(rig, role));
        }
        expect("joints with two roles", "[]", &format!("{:?}", with_two_roles(rig)));
        for (role, _) in rig.roles.0.iter().filter(|(role, _)| role.starts_with("left_")) {
            let twin = role.replace("left_", "right_");
            let sizes = (joints_of(rig, role).matches('|').count(), joints_of(rig, &twin).matches('|').count());
            expect(&twin, &sizes.0.to_string(), &sizes.1.to_string());
        }
    }
    assert!(wrong.is_empty(), "{} of {checked} facts are wrong:\n{}", wrong.len(), wrong.join("\n"));
}

fn with_two_roles(rig: &RigView) -> Vec<String> {
    let mut uses: BTreeMap<&String, usize> = BTreeMap::new();
    for (_, joints) in &rig.roles.0 {
        let names = match joints {
            OneOrMore::One(name) => std::slice::from_ref(name),
            OneOrMore::More(names) => names,
        };
        for name in names {
            *uses.entry(name).or_default() += 1;
        }
    }
    uses.into_iter().filter(|(_, count)| *count > 1).map(|(name, _)| name.clone()).collect()
}

#[test]
fn what_is_no_body_gets_no_limb() {
    const LIMBS: [&str; 9] =
        ["upper_arm", "forearm", "thigh", "shin", "foot", "toe", "clavicle", "front_leg", "hind_leg"];
    for path in NO_BODIES {
        let Some(inspection) = inspected(path) else { continue };
        for rig in &inspection.rigs {
            assert_eq!(rig.kind, "other", "{path}");
            let limb = rig.roles.0.iter().find(|(role, _)| LIMBS.iter().any(|limb| role.ends_with(limb)));
            assert!(limb.is_none(), "{path}: {limb:?}");
        }
    }
}

#[test]
fn animals_stand_on_four_legs() {
    let expected: [(&str, [(&str, &str); 4]); 2] = [
        (
            "creatures/Fox.glb",
            [
                ("left_front_leg", "b_LeftUpperArm_09|b_LeftForeArm_010|b_LeftHand_011"),
                ("right_hind_leg", "b_RightLeg01_019|b_RightLeg02_020|b_RightFoot01_021|b_RightFoot02_022"),
                ("tail", "b_Tail01_012|b_Tail02_013|b_Tail03_014"),
                ("pelvis", "b_Hip_01"),
            ],
        ),
        (
            "creatures/m2m_fox_model.glb",
            [
                (
                    "left_front_leg",
                    "Front_Leg_Shoulder_L|Front_Leg_Upper_L|Front_Leg_Lower_L|Front_Leg_Ankle_L|Front_Leg_Foot_L",
                ),
                ("tail", "Tail_Base|Tail_Mid|Tail_Mid.001"),
                ("head", "Head"),
                ("pelvis", "Hips"),
            ],
        ),
    ];
    for (path, roles) in expected {
        let Some(inspection) = inspected(path) else { continue };
        let rig = inspection.rigs.first().expect("a fox is a rig");
        assert_eq!(rig.kind, "quadruped", "{path}");
        assert_eq!((rig.up, rig.forward), (Some("+y"), Some("+z")), "{path}");
        assert!(!rig.roles.0.iter().any(|(role, _)| role.contains("arm")), "{path}: no arms");
        for (role, names) in roles {
            assert_eq!(joints_of(rig, role), names, "{path}: {role}");
        }
    }
}

#[test]
fn bodies_face_where_their_format_says() {
    for (path, up, forward) in [
        ("vrm0/makehuman_body_vrm0.vrm", "+y", "-z"),
        ("vrm1/makehuman_body_vrm1.vrm", "+y", "+z"),
        ("mixamo/gltf/Soldier.glb", "+y", "-z"),
        ("mixamo/gltf/Xbot.glb", "+y", "+z"),
        ("bvh/fair1/dab_zup.bvh", "+z", "-y"),
        ("unreal/ue4_names_apose_zup_xfwd.fbx", "+y", "+z"),
    ] {
        let Some(inspection) = inspected(path) else { continue };
        let rig = inspection.rigs.first().expect("a body is a rig");
        assert_eq!((rig.up, rig.forward), (Some(up), Some(forward)), "{path}");
    }
}
