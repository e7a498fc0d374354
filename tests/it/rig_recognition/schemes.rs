//! What the joints of each naming scheme mean: the truth that recognition is held against.

/// Role and joints of the trunk and the left side. The right side is the same with its side swapped.
pub(super) type Scheme = &'static [(&'static str, &'static str)];

pub(super) const MIXAMO: Scheme = &[
    ("pelvis", "Hips"),
    ("spine", "Spine|Spine1|Spine2"),
    ("neck", "Neck"),
    ("head", "Head"),
    ("left_clavicle", "LeftShoulder"),
    ("left_upper_arm", "LeftArm"),
    ("left_forearm", "LeftForeArm"),
    ("left_hand", "LeftHand"),
    ("left_thigh", "LeftUpLeg"),
    ("left_shin", "LeftLeg"),
    ("left_foot", "LeftFoot"),
    ("left_toe", "LeftToeBase"),
];
pub(super) const MIXAMO_FINGERS: Scheme = &[
    ("left_thumb", "LeftHandThumb1|LeftHandThumb2|LeftHandThumb3"),
    ("left_index", "LeftHandIndex1|LeftHandIndex2|LeftHandIndex3"),
    ("left_ring", "LeftHandRing1|LeftHandRing2|LeftHandRing3"),
];
pub(super) const LAFAN: Scheme = &[
    ("pelvis", "Hips"),
    ("spine", "Spine|Spine1|Spine2"),
    ("neck", "Neck"),
    ("head", "Head"),
    ("left_clavicle", "LeftShoulder"),
    ("left_upper_arm", "LeftArm"),
    ("left_thigh", "LeftUpLeg"),
    ("left_shin", "LeftLeg"),
    ("left_toe", "LeftToe"),
];
/// Two neck joints, four spine joints.
pub(super) const LONG_SPINE: Scheme = &[
    ("pelvis", "Hips"),
    ("spine", "Spine|Spine1|Spine2|Spine3"),
    ("left_upper_arm", "LeftArm"),
    ("left_shin", "LeftLeg"),
];
pub(super) const CMU: Scheme = &[
    ("pelvis", "Hips"),
    ("spine", "LowerBack|Spine|Spine1"),
    ("neck", "Neck|Neck1"),
    ("head", "Head"),
    ("left_clavicle", "LeftShoulder"),
    ("left_upper_arm", "LeftArm"),
    ("left_forearm", "LeftForeArm"),
    ("left_hand", "LeftHand"),
    ("left_thigh", "LeftUpLeg"),
    ("left_shin", "LeftLeg"),
    ("left_foot", "LeftFoot"),
    ("left_toe", "LeftToeBase"),
];
pub(super) const CMU_FOR_MAX: Scheme = &[
    ("pelvis", "Hips"),
    ("spine", "lowerback|Chest|Chest2"),
    ("neck", "lowerneck|Neck"),
    ("left_clavicle", "LeftCollar"),
    ("left_upper_arm", "LeftShoulder"),
    ("left_forearm", "LeftElbow"),
    ("left_hand", "LeftWrist"),
    ("left_thigh", "LeftHip"),
    ("left_shin", "LeftKnee"),
    ("left_foot", "LeftAnkle"),
    ("left_toe", "LeftToe"),
];
/// The limbs of Biovision's hierarchy, which Xsens uses as well.
pub(super) const BIOVISION: Scheme = &[
    ("pelvis", "Hips"),
    ("neck", "Neck"),
    ("head", "Head"),
    ("left_clavicle", "LeftCollar"),
    ("left_upper_arm", "LeftShoulder"),
    ("left_forearm", "LeftElbow"),
    ("left_hand", "LeftWrist"),
    ("left_thigh", "LeftHip"),
    ("left_shin", "LeftKnee"),
    ("left_foot", "LeftAnkle"),
];
pub(super) const XSENS_SPINE: Scheme = &[("spine", "Chest|Chest2|Chest3|Chest4"), ("left_toe", "LeftToe")];
pub(super) const XSENS_LOWER_CASE: Scheme = &[
    ("pelvis", "root"),
    ("spine", "lowerback|upperback|chest"),
    ("neck", "lowerneck|upperneck"),
    ("left_clavicle", "lclavicle"),
    ("left_upper_arm", "lshoulder"),
    ("left_forearm", "lelbow"),
    ("left_thigh", "lhip"),
    ("left_toe", "ltoe"),
];
pub(super) const UNREAL: Scheme = &[
    ("pelvis", "pelvis"),
    ("spine", "spine_01|spine_02|spine_03"),
    ("neck", "neck_01"),
    ("head", "head"),
    ("left_clavicle", "clavicle_l"),
    ("left_upper_arm", "upperarm_l"),
    ("left_forearm", "lowerarm_l"),
    ("left_hand", "hand_l"),
    ("left_thigh", "thigh_l"),
    ("left_shin", "calf_l"),
    ("left_foot", "foot_l"),
    ("left_toe", "ball_l"),
    ("left_thumb", "thumb_01_l|thumb_02_l|thumb_03_l"),
    ("left_index", "index_01_l|index_02_l|index_03_l"),
];
pub(super) const MANNEQUINY: Scheme = &[
    ("pelvis", "pelvis"),
    ("spine", "spine_01|spine_02"),
    ("left_upper_arm", "upperarm.l"),
    ("left_shin", "calf.l"),
    ("left_ring", "ring_01.l|ring_02.l|ring_03.l"),
];
pub(super) const UNITY: Scheme = &[
    ("pelvis", "hips"),
    ("neck", "neck"),
    ("head", "head"),
    ("left_clavicle", "leftShoulder"),
    ("left_upper_arm", "leftUpperArm"),
    ("left_forearm", "leftLowerArm"),
    ("left_hand", "leftHand"),
    ("left_thigh", "leftUpperLeg"),
    ("left_shin", "leftLowerLeg"),
    ("left_foot", "leftFoot"),
    ("left_toe", "leftToes"),
    ("left_thumb", "leftThumbMetacarpal|leftThumbProximal|leftThumbDistal"),
    ("left_pinky", "leftLittleProximal|leftLittleIntermediate|leftLittleDistal"),
];
pub(super) const VRM_ADDON: Scheme = &[
    ("pelvis", "hips"),
    ("spine", "spine|chest"),
    ("left_upper_arm", "upper_arm.L"),
    ("left_forearm", "lower_arm.L"),
    ("left_thigh", "upper_leg.L"),
    ("left_foot", "foot.L"),
];
pub(super) const VRM_ADDON_FINGERS: Scheme =
    &[("left_thumb", "thumb_proximal.L|thumb_intermediate.L|thumb_distal.L"), ("left_toe", "toes.L")];
pub(super) const CRYPTOVOXELS: Scheme = &[
    ("pelvis", "Hips"),
    ("spine", "Spine|Chest"),
    ("left_clavicle", "Left shoulder"),
    ("left_upper_arm", "Left arm"),
    ("left_forearm", "Left elbow"),
    ("left_hand", "Left wrist"),
    ("left_thigh", "Left leg"),
    ("left_shin", "Left knee"),
    ("left_foot", "Left ankle"),
    ("left_index", "IndexFinger1_L|IndexFinger2_L|IndexFinger3_L"),
];
pub(super) const GODETTE: Scheme = &[
    ("pelvis", "pelvis_Armature"),
    ("spine", "tummy_Armature|chest_Armature"),
    ("left_forearm", "lowerarm.l_Armature"),
    ("left_index", "Finger.l_Armature|Finger.001.l_Armature|Finger.002.l_Armature"),
];
pub(super) const CHARACTER_CREATOR: Scheme = &[
    ("root", "RL_BoneRoot"),
    ("pelvis", "CC_Base_Hip"),
    ("spine", "CC_Base_Waist|CC_Base_Spine01|CC_Base_Spine02"),
    ("neck", "CC_Base_NeckTwist01|CC_Base_NeckTwist02"),
    ("head", "CC_Base_Head"),
    ("jaw", "CC_Base_JawRoot"),
    ("left_clavicle", "CC_Base_L_Clavicle"),
    ("left_upper_arm", "CC_Base_L_Upperarm"),
    ("left_forearm", "CC_Base_L_Forearm"),
    ("left_hand", "CC_Base_L_Hand"),
    ("left_thigh", "CC_Base_L_Thigh"),
    ("left_shin", "CC_Base_L_Calf"),
    ("left_toe", "CC_Base_L_ToeBase"),
    ("left_middle", "CC_Base_L_Mid1|CC_Base_L_Mid2|CC_Base_L_Mid3"),
];
pub(super) const GENESIS_8: Scheme = &[
    ("pelvis", "hip"),
    ("spine", "abdomenLower|abdomenUpper|chestLower|chestUpper"),
    ("neck", "neckLower|neckUpper"),
    ("left_clavicle", "lCollar"),
    ("left_upper_arm", "lShldrBend|lShldrTwist"),
    ("left_forearm", "lForearmBend|lForearmTwist"),
    ("left_hand", "lHand"),
    ("left_thigh", "lThighBend|lThighTwist"),
    ("left_shin", "lShin"),
    ("left_toe", "lToe"),
    ("left_index_metacarpal", "lCarpal1"),
    ("left_index", "lIndex1|lIndex2|lIndex3"),
];
pub(super) const POSER: Scheme = &[
    ("pelvis", "hip"),
    ("spine", "abdomen|chest"),
    ("left_clavicle", "lCollar"),
    ("left_upper_arm", "lShldr"),
    ("left_forearm", "lForeArm"),
    ("left_thigh", "lThigh"),
    ("left_shin", "lShin"),
    ("left_index", "lIndex1|lIndex2"),
];
pub(super) const RIGIFY: Scheme = &[
    ("pelvis", "DEF-spine"),
    ("spine", "DEF-spine.001|DEF-spine.002|DEF-spine.003"),
    ("neck", "DEF-spine.004|DEF-spine.005"),
    ("head", "DEF-spine.006"),
    ("left_clavicle", "DEF-shoulder.L"),
    ("left_upper_arm", "DEF-upper_arm.L|DEF-upper_arm.L.001"),
    ("left_forearm", "DEF-forearm.L|DEF-forearm.L.001"),
    ("left_hand", "DEF-hand.L"),
    ("left_thigh", "DEF-thigh.L|DEF-thigh.L.001"),
    ("left_shin", "DEF-shin.L|DEF-shin.L.001"),
    ("left_foot", "DEF-foot.L"),
    ("left_toe", "DEF-toe.L"),
];
pub(super) const RIGIFY_HIPS: Scheme = &[
    ("root", "root"),
    ("pelvis", "DEF-hips"),
    ("spine", "DEF-spine.001|DEF-spine.002|DEF-spine.003"),
    ("neck", "DEF-neck"),
    ("head", "DEF-head"),
    ("left_upper_arm", "DEF-upper_arm.L"),
    ("left_thigh", "DEF-thigh.L"),
    ("left_index", "DEF-f_index.01.L|DEF-f_index.02.L|DEF-f_index.03.L"),
];
pub(super) const BIPED: Scheme = &[
    ("pelvis", "Bip01 Pelvis"),
    ("spine", "Bip01 Spine|Bip01 Spine1|Bip01 Spine2"),
    ("neck", "Bip01 Neck"),
    ("head", "Bip01 Head"),
    ("left_clavicle", "Bip01 L Clavicle"),
    ("left_upper_arm", "Bip01 L UpperArm"),
    ("left_thigh", "Bip01 L Thigh"),
    ("left_toe", "Bip01 L Toe0"),
    ("left_thumb", "Bip01 L Finger0|Bip01 L Finger01|Bip01 L Finger02"),
    ("left_pinky", "Bip01 L Finger4|Bip01 L Finger41|Bip01 L Finger42"),
];
pub(super) const VALVE: Scheme = &[
    ("pelvis", "ValveBiped.Bip01_Pelvis"),
    ("left_upper_arm", "ValveBiped.Bip01_L_UpperArm"),
    ("left_shin", "ValveBiped.Bip01_L_Calf"),
    ("left_index", "ValveBiped.Bip01_L_Finger1|ValveBiped.Bip01_L_Finger11|ValveBiped.Bip01_L_Finger12"),
];
pub(super) const SMPL: Scheme = &[
    ("pelvis", "Pelvis"),
    ("spine", "Spine1|Spine2|Spine3"),
    ("neck", "Neck"),
    ("left_clavicle", "Left_collar"),
    ("left_upper_arm", "Left_shoulder"),
    ("left_forearm", "Left_elbow"),
    ("left_hand", "Left_wrist"),
    ("left_thigh", "Left_hip"),
    ("left_shin", "Left_knee"),
    ("left_foot", "Left_ankle"),
    ("left_toe", "Left_foot"),
];
pub(super) const KEYPOINTS: Scheme = &[
    ("pelvis", "Hip"),
    ("spine", "Spine|Thorax"),
    ("neck", "Neck"),
    ("head", "Head"),
    ("left_upper_arm", "LeftShoulder"),
    ("left_forearm", "LeftElbow"),
    ("left_hand", "LeftWrist"),
    ("left_thigh", "LeftHip"),
    ("left_shin", "LeftKnee"),
    ("left_foot", "LeftAnkle"),
];
pub(super) const ROBLOX: Scheme = &[
    ("root", "root"),
    ("pelvis", "LowerTorso"),
    ("spine", "UpperTorso"),
    ("head", "Head"),
    ("left_upper_arm", "LeftUpperArm"),
    ("left_forearm", "LeftLowerArm"),
    ("left_shin", "LeftLowerLeg"),
];
pub(super) const MAKEHUMAN: Scheme = &[
    ("pelvis", "root"),
    ("spine", "spine05|spine04|spine03|spine02|spine01"),
    ("neck", "neck01|neck02|neck03"),
    ("left_clavicle", "clavicle.L"),
    ("left_upper_arm", "upperarm01.L|upperarm02.L"),
    ("left_forearm", "lowerarm01.L|lowerarm02.L"),
    ("left_hand", "wrist.L"),
    ("left_thigh", "upperleg01.L|upperleg02.L"),
    ("left_shin", "lowerleg01.L|lowerleg02.L"),
    ("left_thumb", "finger1-1.L|finger1-2.L|finger1-3.L"),
    ("left_index_metacarpal", "metacarpal1.L"),
    ("left_index", "finger2-1.L|finger2-2.L|finger2-3.L"),
];
pub(super) const QUATERNIUS: Scheme = &[
    ("neck", "Neck"),
    ("left_clavicle", "Shoulder.L"),
    ("left_upper_arm", "UpperArm.L"),
    ("left_forearm", "LowerArm.L"),
    ("left_thigh", "UpperLeg.L"),
    ("left_shin", "LowerLeg.L"),
    ("left_foot", "Foot.L"),
];
pub(super) const KAYKIT: Scheme = &[
    ("root", "root"),
    ("pelvis", "hips"),
    ("spine", "spine|chest"),
    ("head", "head"),
    ("left_upper_arm", "upperarm.l"),
    ("left_forearm", "lowerarm.l"),
    ("left_hand", "wrist.l"),
    ("left_thigh", "upperleg.l"),
    ("left_toe", "toes.l"),
];
pub(super) const GODOT_ROBOT: Scheme = &[
    ("root", "MASTER"),
    ("pelvis", "hip"),
    ("spine", "waist|chest"),
    ("head", "head"),
    ("left_upper_arm", "l-arm"),
    ("left_forearm", "l-forearm"),
    ("left_thigh", "l-thigh"),
    ("left_shin", "l-leg"),
    ("left_foot", "l-foot"),
];
pub(super) const OZZ: Scheme = &[
    ("root", "Hips"),
    ("pelvis", "Pelvis"),
    ("spine", "Spine|Spine1|Spine2|Spine3"),
    ("left_upper_arm", "LeftArm"),
    ("left_thigh", "LeftUpLeg"),
    ("left_toe", "LeftFootThumb1"),
];
pub(super) const BANDAI_NAMCO: Scheme = &[
    ("root", "joint_Root"),
    ("pelvis", "Hips"),
    ("spine", "Spine|Chest"),
    ("left_clavicle", "Shoulder_L"),
    ("left_upper_arm", "UpperArm_L"),
    ("left_thigh", "UpperLeg_L"),
    ("left_toe", "Toes_L"),
];
/// Limbs and head of HumanIK, for rigs with spines of their own.
pub(super) const HUMANIK_LIMBS: Scheme = &[
    ("pelvis", "Hips"),
    ("head", "Head"),
    ("left_clavicle", "LeftShoulder"),
    ("left_upper_arm", "LeftArm"),
    ("left_forearm", "LeftForeArm"),
    ("left_hand", "LeftHand"),
    ("left_thigh", "LeftUpLeg"),
    ("left_shin", "LeftLeg"),
    ("left_foot", "LeftFoot"),
    ("left_toe", "LeftToeBase"),
];
pub(super) const FACE: Scheme = &[("jaw", "Jaw"), ("left_eye", "LeftEye")];
pub(super) const KENNEY: Scheme = &[
    ("pelvis", "Hips"),
    ("spine", "Spine|Chest|UpperChest"),
    ("neck", "Neck"),
    ("head", "Head"),
    ("left_clavicle", "LeftShoulder"),
    ("left_upper_arm", "LeftArm"),
    ("left_hand", "LeftHand"),
    ("left_shin", "LeftLeg"),
    ("left_toe", "LeftToes"),
];
pub(super) const MAKEHUMAN_OLD: Scheme = &[
    ("pelvis", "Root"),
    ("spine", "Spine1|Spine2|Spine3"),
    ("neck", "Neck"),
    ("head", "Head"),
    ("jaw", "Jaw"),
    ("left_clavicle", "Clavicle_L"),
    ("left_upper_arm", "UpArm_L"),
    ("left_forearm", "LoArm_L"),
    ("left_hand", "Hand_L"),
    ("left_thigh", "UpLeg_L"),
    ("left_shin", "LoLeg_L"),
    ("left_foot", "Foot_L"),
    ("left_toe", "Toe_L"),
];
pub(super) const OLYMPE: Scheme = &[
    ("pelvis", "Hips"),
    ("spine", "Chest"),
    ("neck", "Neck"),
    ("head", "Head"),
    ("left_clavicle", "LeftCollar"),
    ("left_upper_arm", "LeftUpArm"),
    ("left_forearm", "LeftLowArm"),
    ("left_hand", "LeftHand"),
    ("left_thigh", "LeftUpLeg"),
    ("left_shin", "LeftLowLeg"),
    ("left_foot", "LeftFoot"),
];
pub(super) const CATBOT: Scheme = &[
    ("pelvis", "Hips"),
    ("spine", "Spine|Chest|Upper_Chest"),
    ("neck", "Neck"),
    ("head", "Head"),
    ("tail", "tail1|tail2"),
    ("left_clavicle", "Shoulder_L"),
    ("left_upper_arm", "Upper_Arm_L"),
    ("left_forearm", "Lower_Arm_L"),
    ("left_thigh", "Upper_Leg_L"),
    ("left_foot", "Foot_L"),
];
