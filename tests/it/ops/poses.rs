//! The ops that change poses by constants: `copy_base_pose`, `additive_pose`, `arm_spacing`, `stretch_chain`, `twist`.

use glam::{DQuat, Quat};

use super::stage::{KINEMATICS, Stage, degrees};

fn behind_kinematics(op: &str) -> String {
    format!(r#"{{"ops": [{{"op": "pelvis"}}, {{"op": "fk"}}, {op}]}}"#)
}

#[test]
fn joints_of_equal_names_are_copied() {
    let stage = Stage::onto_itself();
    let played = stage.play(r#"{"ops": [{"op": "pelvis"}, {"op": "copy_base_pose", "below": "left_forearm"}]}"#);
    for (name, is_copied) in
        [("LeftForeArm", true), ("LeftHandIndex2", true), ("LeftArm", false), ("RightForeArm", false)]
    {
        let joint = stage.target_joint(&format!("mixamorig:{name}"));
        let own = stage.source.clips[0].joints()[joint].rotation.at(40, Quat::IDENTITY);
        let found = played.clip.joints()[joint].rotation.at(40, Quat::IDENTITY);
        assert_eq!(found.dot(own).abs() > 1.0 - 1e-6, is_copied, "{name}: {found} and {own}");
    }
    let warned = stage.play(r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}, {"op": "copy_base_pose", "below": "head"}]}"#);
    assert!(warned.warnings.contains(&"nothing_to_copy"), "all is driven: {:?}", warned.warnings);
}

#[test]
fn a_pose_is_added_to_every_frame() {
    let stage = Stage::walk();
    let plain = stage.play(KINEMATICS);
    let played = stage.play(&behind_kinematics(
        r#"{"op": "additive_pose", "degrees": {"head": [0, 0, 20], "left_hand": [10, 0, 0]}}"#,
    ));
    for frame in [0, 60] {
        let (before, after) = (stage.turned(&plain, frame, "head"), stage.turned(&played, frame, "head"));
        let wanted = before * DQuat::from_rotation_z(20_f64.to_radians());
        assert!(degrees(after, wanted) < 1e-3, "frame {frame}: {}", degrees(after, wanted));
    }
    let mut stage = Stage::onto_itself();
    stage.target.clips = stage.source.clips.clone();
    let plain = stage.play(KINEMATICS);
    let played =
        stage.play(&behind_kinematics(r#"{"op": "additive_pose", "clip": 0, "frame": 15, "mask": ["right_shin"]}"#));
    let shin = stage.target_joint("mixamorig:RightLeg");
    let local =
        |clip: &retargetd::model::Clip, frame: usize| clip.joints()[shin].rotation.at(frame, Quat::IDENTITY).as_dquat();
    let change = stage.target.skeleton.joints()[shin].rest.rotation.conjugate() * local(&stage.target.clips[0], 15);
    let wanted = local(&plain.clip, 70) * change;
    assert!(degrees(local(&played.clip, 70), wanted) < 1e-3, "the change from rest to frame 15 is added at frame 70");
}

#[test]
fn arms_are_spread_about_the_front() {
    let stage = Stage::walk();
    let plain = stage.play(KINEMATICS);
    let played = stage.play(&behind_kinematics(r#"{"op": "arm_spacing", "degrees": 12}"#));
    for (hand, arm) in [("hand_l", "upperarm_l"), ("hand_r", "upperarm_r")] {
        let turned = degrees(stage.turned(&plain, 30, arm), stage.turned(&played, 30, arm));
        assert!((turned - 12.0).abs() < 1e-3, "{arm}: {turned}");
        let away = |played| stage.place(played, 30, hand).x.abs();
        assert!(away(&played) > away(&plain) + 0.05, "{hand} goes away from the body");
    }
    let only_left = stage.play(&behind_kinematics(r#"{"op": "arm_spacing", "degrees": 12, "mask": ["left_arm"]}"#));
    assert!(stage.place(&only_left, 30, "hand_r").distance(stage.place(&plain, 30, "hand_r")) < 1e-6, "masked");
}

#[test]
fn chains_get_longer() {
    let stage = Stage::walk();
    let plain = stage.play(KINEMATICS);
    let length = |played, from, to| stage.place(played, 20, from).distance(stage.place(played, 20, to));
    let played = stage.play(&behind_kinematics(r#"{"op": "stretch_chain", "scale": 1.5, "mask": ["left_arm"]}"#));
    let forearm = |played| length(played, "lowerarm_l", "hand_l");
    assert!((forearm(&played) / forearm(&plain) - 1.5).abs() < 1e-5, "half as long again");
    assert!(
        (length(&played, "hand_l", "middle_01_l") / length(&plain, "hand_l", "middle_01_l") - 1.0).abs() < 1e-5,
        "hands are not"
    );
    let played = stage.play(&behind_kinematics(r#"{"op": "stretch_chain", "match_source": 1, "mask": ["right_leg"]}"#));
    let pose = stage.source_pose(20);
    let at = |name: &str| pose.transforms()[stage.source_joint(name)].translation;
    let source = at("mixamorig:RightUpLeg").distance(at("mixamorig:RightLeg"))
        + at("mixamorig:RightLeg").distance(at("mixamorig:RightFoot"));
    let found = length(&played, "thigh_r", "calf_r") + length(&played, "calf_r", "foot_r");
    let wanted = source * played.mapping.global_scale;
    assert!((found - wanted).abs() < 1e-4, "{found} where {wanted} is wanted");
    let error =
        stage.try_play(&behind_kinematics(r#"{"op": "stretch_chain", "mask": ["head"]}"#)).err().expect("refused");
    assert_eq!(error.fields[0].pointer, "/ops/2/mask/0", "one joint is no chain: {:?}", error.fields);
}

#[test]
fn twist_joints_follow_a_hand_that_was_turned_later() {
    let stage = Stage::walk();
    let turn = r#"{"op": "additive_pose", "degrees": {"left_hand": [60, 0, 0]}}"#;
    let unshared = stage.play(&behind_kinematics(turn));
    let shared = stage.play(&behind_kinematics(&format!(r#"{turn}, {{"op": "twist"}}"#)));
    let plain = stage.play(KINEMATICS);
    // The mannequin's bones lie along X, so the hand was twisted against the forearm by about 60 degrees.
    let twisted = |played: &super::stage::Played, joint: &str| {
        degrees(stage.turned(&plain, 40, joint), stage.turned(played, 40, joint))
    };
    assert!(twisted(&unshared, "lowerarm_twist_01_l") < 1e-3, "nobody told the forearm");
    let (near, far) = (twisted(&shared, "lowerarm_twist_02_l"), twisted(&shared, "lowerarm_twist_01_l"));
    assert!(
        (near - 20.0).abs() < 3.0 && (far - 40.0).abs() < 3.0,
        "a third and two thirds of 60 degrees: {near}, {far}"
    );
    let again = stage.play(&behind_kinematics(r#"{"op": "twist"}"#));
    for joint in ["lowerarm_twist_01_l", "upperarm_twist_01_r", "thigh_twist_01_l", "calf_twist_01_r"] {
        assert!(twisted(&again, joint) < 0.05, "{joint}: what fk shared out already stays: {}", twisted(&again, joint));
    }
}
