//! Naming conventions that the corpus does not hold: one figure, named as each of them has it.

use std::collections::BTreeMap;

use glam::DVec3;
use retargetd::{
    model::{Joint, Skeleton, Transform},
    rig::{Hints, Part, Recognition, RigKind, Role, Side, recognize},
};

/// Part, parent, and place relative to it on the left.
type Bone = (Part, Option<usize>, [f64; 3]);

const FIGURE: [Bone; 13] = [
    (Part::Pelvis, None, [0.0, 1.0, 0.0]),
    (Part::Spine, Some(0), [0.0, 0.15, 0.0]),
    (Part::Spine, Some(1), [0.0, 0.2, 0.0]),
    (Part::Neck, Some(2), [0.0, 0.18, 0.0]),
    (Part::Head, Some(3), [0.0, 0.1, 0.0]),
    (Part::Clavicle, Some(2), [0.04, 0.12, 0.0]),
    (Part::UpperArm, Some(5), [0.12, 0.0, 0.0]),
    (Part::Forearm, Some(6), [0.28, 0.0, 0.0]),
    (Part::Hand, Some(7), [0.25, 0.0, 0.0]),
    (Part::Thigh, Some(0), [0.1, -0.05, 0.0]),
    (Part::Shin, Some(9), [0.0, -0.43, 0.0]),
    (Part::Foot, Some(10), [0.0, -0.42, 0.0]),
    (Part::Toe, Some(11), [0.0, -0.06, 0.14]),
];

/// What it is recognized as (empty: nothing), the words for left and right, and the names in the figure's order.
type Convention = (&'static str, &'static str, [&'static str; 2], &'static str);

/// Names that say everything.
const CLEAR: &[Convention] = &[
    (
        "Azure Kinect",
        "",
        ["LEFT", "RIGHT"],
        "PELVIS SPINE_NAVAL SPINE_CHEST NECK HEAD CLAVICLE_@ SHOULDER_@ ELBOW_@ WRIST_@ HIP_@ KNEE_@ ANKLE_@ FOOT_@",
    ),
    (
        "Kinect 2",
        "",
        ["Left", "Right"],
        "SpineBase SpineMid SpineShoulder Neck Head Clav@ Shoulder@ Elbow@ Wrist@ Hip@ Knee@ Ankle@ Foot@",
    ),
    (
        "ARKit",
        "",
        ["left", "right"],
        "hips_joint spine_1_joint spine_7_joint neck_1_joint head_joint @_shoulder_1_joint @_arm_joint @_forearm_joint @_hand_joint @_upLeg_joint @_leg_joint @_foot_joint @_toes_joint",
    ),
    (
        "Second Life",
        "second_life",
        ["Left", "Right"],
        "mPelvis mTorso mChest mNeck mHead mCollar@ mShoulder@ mElbow@ mWrist@ mHip@ mKnee@ mAnkle@ mToe@",
    ),
    (
        "Rokoko",
        "rokoko",
        ["Left", "Right"],
        "Hips Spine1 Spine4 Neck Head @Shoulder @Arm @ForeArm @Hand @Thigh @Shin @Foot @Toe",
    ),
    (
        "Xsens MVN",
        "",
        ["Left", "Right"],
        "Pelvis L5 T8 Neck Head @Shoulder @UpperArm @ForeArm @Hand @UpperLeg @LowerLeg @Foot @Toe",
    ),
    (
        "OptiTrack",
        "optitrack",
        ["L", "R"],
        "Skeleton_001:Hip Skeleton_001:Ab Skeleton_001:Chest Skeleton_001:Neck Skeleton_001:Head Skeleton_001:@Shoulder Skeleton_001:@UArm Skeleton_001:@FArm Skeleton_001:@Hand Skeleton_001:@Thigh Skeleton_001:@Shin Skeleton_001:@Foot Skeleton_001:@Toe",
    ),
    (
        "Cascadeur",
        "cascadeur",
        ["l", "r"],
        "pelvis stomach chest neck head clavicle_@ arm_@ forearm_@ hand_@ thigh_@ calf_@ foot_@ toe_@",
    ),
    (
        "Auto-Rig Pro",
        "auto_rig_pro",
        ["l", "r"],
        "root.x spine_01.x spine_02.x neck.x head.x shoulder.@ arm_stretch.@ forearm_stretch.@ hand.@ thigh_stretch.@ leg_stretch.@ foot.@ toes_01.@",
    ),
    ("MikuMikuDance", "mmd", ["左", "右"], "下半身 上半身 上半身2 首 頭 @肩 @腕 @ひじ @手首 @足 @ひざ @足首 @つま先"),
    (
        "VRoid",
        "vroid",
        ["L", "R"],
        "J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_UpperChest J_Bip_C_Neck J_Bip_C_Head J_Bip_@_Shoulder J_Bip_@_UpperArm J_Bip_@_LowerArm J_Bip_@_Hand J_Bip_@_UpperLeg J_Bip_@_LowerLeg J_Bip_@_Foot J_Bip_@_ToeBase",
    ),
    (
        "numbered by an exporter",
        "mixamo",
        ["Left", "Right"],
        "mixamorig:Hips_01 mixamorig:Spine_02 mixamorig:Spine2_03 mixamorig:Neck_04 mixamorig:Head_05 mixamorig:@Shoulder_06 mixamorig:@Arm_07 mixamorig:@ForeArm_08 mixamorig:@Hand_09 mixamorig:@UpLeg_010 mixamorig:@Leg_011 mixamorig:@Foot_012 mixamorig:@ToeBase_013",
    ),
    (
        "3ds Max Biped",
        "biped_3ds_max",
        ["L", "R"],
        "Bip001_Pelvis Bip001_Spine Bip001_Spine1 Bip001_Neck Bip001_Head Bip001_@_Clavicle Bip001_@_UpperArm Bip001_@_Forearm Bip001_@_Hand Bip001_@_Thigh Bip001_@_Calf Bip001_@_Foot Bip001_@_Toe0",
    ),
    (
        "SMPL-X",
        "smpl",
        ["left", "right"],
        "pelvis spine1 spine3 neck head @_collar @_shoulder @_elbow @_wrist @_hip @_knee @_ankle @_foot",
    ),
    (
        "bones",
        "",
        ["l", "r"],
        "hipBone spineBone chestBone neckBone headBone @ShoulderBone @UpArmBone @ElbowBone @HandBone @LegUpBone @KneeBone @FootBone @ToeBone",
    ),
    (
        "German",
        "",
        ["L", "R"],
        "Becken Wirbelsaeule Brust Hals Kopf Schluesselbein_@ Oberarm_@ Unterarm_@ Hand_@ Oberschenkel_@ Unterschenkel_@ Fuss_@ Zeh_@",
    ),
];

/// Names that leave something open, which the shape decides.
const OPEN: &[Convention] = &[
    (
        "Advanced Skeleton",
        "",
        ["L", "R"],
        "Root_M Spine1_M Chest_M Neck_M Head_M Scapula_@ Shoulder_@ Elbow_@ Wrist_@ Hip_@ Knee_@ Ankle_@ Toes_@",
    ),
    (
        "Rigify meta-rig",
        "",
        ["L", "R"],
        "spine spine.001 spine.003 spine.004 spine.006 shoulder.@ upper_arm.@ forearm.@ hand.@ thigh.@ shin.@ foot.@ toe.@",
    ),
    (
        "CAT",
        "",
        ["L", "R"],
        "CATRigPelvis CATRigSpine1 CATRigRibcage CATRigNeck CATRigHead CATRig@ArmCollarbone CATRig@Arm1 CATRig@Arm2 CATRig@ArmPalm CATRig@Leg1 CATRig@Leg2 CATRig@LegAnkle CATRig@LegDigit11",
    ),
    (
        "limbs by number",
        "",
        ["L", "R"],
        "pelvis spine1 spine2 neck head @_arm_01 @_arm_02 @_arm_03 @_arm_04 @_thigh @_shin @_foot @_toe",
    ),
    (
        "short words",
        "",
        ["lf", "rt"],
        "hip_JNT spine_JNT chest_JNT neck_JNT head_JNT @_clav_JNT @_shldr_JNT @_elb_JNT @_wrist_JNT @_hip_JNT @_knee_JNT @_ankle_JNT @_ball_JNT",
    ),
];

/// The figure with those names, and the joint of each bone and side.
fn figure(words: [&str; 2], names: &str) -> (Skeleton, BTreeMap<(usize, Side), usize>) {
    let names: Vec<&str> = names.split(' ').collect();
    let (mut joints, mut joint_of) = (Vec::new(), BTreeMap::new());
    for (bone, (part, parent, place)) in FIGURE.into_iter().enumerate() {
        let sides: &[Side] = if part.is_central() { &[Side::Center] } else { &Side::BOTH };
        for side in sides {
            let mirror = if *side == Side::Right { -1.0 } else { 1.0 };
            let above =
                |parent: usize| joint_of.get(&(parent, *side)).or_else(|| joint_of.get(&(parent, Side::Center)));
            let parent = parent.and_then(above).copied();
            joint_of.insert((bone, *side), joints.len());
            joints.push(Joint {
                name: names[bone].replace('@', words[usize::from(*side == Side::Right)]).replace("Bip001_", "Bip001 "),
                parent,
                rest: Transform::from_translation(DVec3::new(place[0] * mirror, place[1], place[2])),
                is_joint: true,
                node: joints.len(),
            });
        }
    }
    (Skeleton::new(joints).expect("parents come first"), joint_of)
}

fn recognized(convention: &Convention) -> (Recognition, Vec<String>) {
    let (what, _, words, names) = *convention;
    let (skeleton, joint_of) = figure(words, names);
    let recognition = recognize(&skeleton, &skeleton.rest_pose().to_model(&skeleton), &Hints::default());
    assert_eq!(recognition.kind, RigKind::Biped, "{what}");
    let mut wrong = Vec::new();
    for ((bone, side), joint) in joint_of {
        let role = Role::new(side, FIGURE[bone].0);
        if !recognition.roles.get(&role).is_some_and(|finding| finding.joints.contains(&joint)) {
            wrong.push(format!("{what}: '{}' should be {role}", skeleton.joints()[joint].name));
        }
    }
    (recognition, wrong)
}

#[test]
fn clear_names_are_understood_and_sure() {
    for convention in CLEAR {
        let (recognition, wrong) = recognized(convention);
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
        assert_eq!(recognition.recognised_as.as_deref().unwrap_or_default(), convention.1, "{}", convention.0);
        for (role, finding) in &recognition.roles {
            assert!(finding.confidence > 0.9, "{}: {role} {finding:?}", convention.0);
        }
    }
}

#[test]
fn what_names_leave_open_the_shape_decides() {
    for convention in OPEN {
        let (recognition, wrong) = recognized(convention);
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
        let by_shape = recognition.roles.values().filter(|finding| finding.confidence < 0.9).count();
        assert!(by_shape > 0, "{}: one witness is not as sure as two", convention.0);
    }
}
