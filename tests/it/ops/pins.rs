//! `pin`: sockets, props and cameras that follow a joint.

use glam::DVec3;
use retargetd::model::{Joint, Skeleton, Transform};

use super::stage::{KINEMATICS, Stage, degrees};

/// The walk and the mannequin, whose rig has a socket below its root that nothing drives.
fn with_socket() -> Stage {
    let mut stage = Stage::walk();
    let mut joints = stage.target.skeleton.joints().to_vec();
    let root = stage.target_joint("root");
    joints.push(Joint {
        name: "ik_hand_gun".to_owned(),
        parent: Some(root),
        rest: Transform::from_translation(DVec3::new(0.1, 0.9, 0.2)),
        is_joint: true,
        node: joints.len(),
    });
    stage.target.skeleton = Skeleton::new(joints).expect("a skeleton");
    stage
}

fn config(pin: &str) -> String {
    format!(
        r#"{{"ops": [{{"op": "pelvis"}}, {{"op": "fk"}}, {{"op": "pin", "pins": [{{"joint": "ik_hand_gun", {pin}}}]}}]}}"#
    )
}

#[test]
fn a_pin_lies_on_the_joint_that_it_follows() {
    let stage = with_socket();
    let played = stage.play(&config(r#""to": "right_hand", "mode": "global""#));
    for frame in [0, 50, 120] {
        let (socket, hand) = (stage.place(&played, frame, "ik_hand_gun"), stage.place(&played, frame, "hand_r"));
        assert!(socket.distance(hand) < 1e-5, "frame {frame}: {socket} and {hand}");
        let turned = degrees(stage.turned(&played, frame, "ik_hand_gun"), stage.turned(&played, frame, "hand_r"));
        assert!(turned < 1e-3, "frame {frame}: {turned} degrees");
    }
}

#[test]
fn a_pin_keeps_its_offset_as_if_it_hung_there() {
    let stage = with_socket();
    let played = stage.play(&config(r#""to": "pelvis""#));
    let rest = stage.target.skeleton.rest_pose().to_model(&stage.target.skeleton);
    let (pelvis, socket) = (stage.target_joint("pelvis"), stage.target_joint("ik_hand_gun"));
    let at_rest = rest.transforms()[pelvis].relative(&rest.transforms()[socket]);
    for frame in [0, 50, 120] {
        let pose = stage.target_pose(&played, frame);
        let now = pose.transforms()[pelvis].relative(&pose.transforms()[socket]);
        assert!(now.translation.distance(at_rest.translation) < 1e-5, "frame {frame}: {now:?}");
        assert!(degrees(now.rotation, at_rest.rotation) < 1e-3, "frame {frame}: {now:?}");
    }
}

#[test]
fn a_pin_to_the_source_goes_as_far_as_the_pelvis_scale_says() {
    let stage = with_socket();
    let played = stage.play(&config(r#""to": "head", "side": "source", "rotation": false"#));
    let head = stage.source_joint("mixamorig:Head");
    let source = |frame: usize| stage.source_pose(frame).transforms()[head].translation;
    let target = |frame: usize| stage.place(&played, frame, "ik_hand_gun");
    let (way, wanted) = (target(120) - target(0), (source(120) - source(0)) * played.mapping.global_scale);
    assert!(way.distance(wanted) < 1e-4, "{way} where {wanted} is wanted");
    assert!(way.z > 3.0, "it walks with the figure: {way}");
}

#[test]
fn children_are_carried_along_or_stay() {
    let stage = Stage::walk();
    let config = |carries: bool| {
        format!(
            r#"{{"ops": [{{"op": "pelvis"}}, {{"op": "fk"}}, {{"op": "pin", "pins": [
                {{"joint": "lowerarm_l", "to": "head", "mode": "global", "rotation": false, "carries_children": {carries}}}]}}]}}"#
        )
    };
    let plain = stage.play(KINEMATICS);
    let (carried, left) = (stage.play(&config(true)), stage.play(&config(false)));
    let hand = |played| stage.place(played, 60, "hand_l");
    assert!(hand(&left).distance(hand(&plain)) < 1e-5, "the hand stays where it was");
    let arm = |played| stage.place(played, 60, "lowerarm_l");
    assert!(arm(&left).distance(stage.place(&left, 60, "head")) < 1e-5, "the forearm is where the head is");
    let length = hand(&plain).distance(arm(&plain));
    assert!((hand(&carried).distance(arm(&carried)) - length).abs() < 1e-5, "the hand is carried along");
}

#[test]
fn nothing_follows_what_hangs_below_it() {
    let error = Stage::walk().try_play(r#"{"ops": [{"op": "pin", "pins": [{"joint": "pelvis", "to": "hand_l"}]}]}"#);
    let field = error.err().expect("refused").fields.remove(0);
    assert_eq!(field.pointer, "/ops/0/pins/0/to", "{field:?}");
}

/// The walk and the mannequin with what Unreal's mannequins have below their root for IK and weapons.
fn with_helpers() -> Stage {
    let mut stage = Stage::walk();
    let mut joints = stage.target.skeleton.joints().to_vec();
    let mut add = |name: &str, parent: usize| {
        let rest = Transform::from_translation(DVec3::new(0.1, 0.2, 0.3));
        joints.push(Joint { name: name.to_owned(), parent: Some(parent), rest, is_joint: true, node: joints.len() });
        joints.len() - 1
    };
    let root = stage.target.skeleton.find("root").expect("a root");
    let feet = add("ik_foot_root", root);
    add("ik_foot_l", feet);
    add("ik_foot_r", feet);
    let hands = add("ik_hand_root", root);
    let gun = add("ik_hand_gun", hands);
    add("ik_hand_l", gun);
    add("ik_hand_r", gun);
    stage.target.skeleton = Skeleton::new(joints).expect("a skeleton");
    stage
}

const FOLLOWS: [(&str, &str); 5] = [
    ("ik_foot_l", "foot_l"),
    ("ik_foot_r", "foot_r"),
    ("ik_hand_gun", "hand_r"),
    ("ik_hand_l", "hand_l"),
    ("ik_hand_r", "hand_r"),
];

#[test]
fn helper_joints_follow_hands_and_feet_unless_the_spec_says_otherwise() {
    let stage = with_helpers();
    let followed = stage.play("{}");
    let kept = stage.play(r#"{"target": {"helper_joints": "keep"}}"#);
    for (helper, end) in FOLLOWS {
        for frame in [0, 50, 120] {
            let off = stage.place(&followed, frame, helper).distance(stage.place(&followed, frame, end));
            assert!(off < 1e-5, "{helper} is {off} m off at frame {frame}");
            let turned = degrees(stage.turned(&followed, frame, helper), stage.turned(&followed, frame, end));
            assert!(turned < 1e-3, "{helper} is turned by {turned} degrees at frame {frame}");
        }
        assert_eq!(
            stage.place(&kept, 0, helper),
            stage.place(&kept, 120, helper),
            "{helper} stays where the spec says that it does"
        );
    }
    let plain = stage.play(KINEMATICS);
    assert_eq!(
        stage.place(&plain, 0, "ik_foot_l"),
        stage.place(&plain, 120, "ik_foot_l"),
        "plain kinematics pin nothing"
    );
}
