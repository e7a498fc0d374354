//! The ops that move goals and hands: `stride`, `props`, `fingers`, `scale_source`.

use glam::{DQuat, DVec3};
use retargetd::model::{Clip, Joint, JointTracks, Skeleton, Transform};

use super::stage::{KINEMATICS, Played, Stage, degrees};

fn stack(ops: &str) -> String {
    format!(r#"{{"ops": [{{"op": "pelvis"}}, {{"op": "fk"}}, {ops}]}}"#)
}

#[test]
fn longer_steps_take_the_pelvis_along_and_do_not_slide() {
    let stage = Stage::onto_itself();
    let plain = stage.play(&stack(r#"{"op": "ik", "softness": 0}"#));
    let travel = |played: &Played, joint: &str| stage.place(played, 120, joint).z - stage.place(played, 0, joint).z;
    let step = |played: &Played, frame: usize| {
        let place = |frame: usize| stage.place(played, frame, "mixamorig:LeftToeBase");
        (place(frame) - place(frame - 1)).with_y(0.0).length()
    };
    let standing: Vec<usize> = (1..120).filter(|&frame| step(&plain, frame) < 5e-4).collect();
    assert!(standing.len() > 30, "the foot stands on {} frames", standing.len());
    // Steps that are much longer are out of the legs' reach, so only shorter ones show that feet stand.
    for (forward, direction) in [(0.8, "pelvis"), (0.8, "chest"), (0.8, "travel"), (1.2, "pelvis")] {
        let played = stage.play(&stack(&format!(
            r#"{{"op": "ik", "softness": 0}}, {{"op": "stride", "forward": {forward}, "direction": "{direction}"}}"#
        )));
        let ratio = travel(&played, "mixamorig:Hips") / travel(&plain, "mixamorig:Hips");
        assert!((ratio - forward).abs() < 0.01, "{direction}: the pelvis goes {ratio} times as far");
        let slide = standing.iter().map(|&frame| step(&played, frame)).fold(0.0, f64::max);
        assert!(forward > 1.0 || slide < 2e-3, "{direction}: a standing foot moves by {slide} in a frame");
    }
    let left_behind = stage.play(&stack(r#"{"op": "ik"}, {"op": "stride", "forward": 1.2, "moves_pelvis": false}"#));
    assert!((travel(&left_behind, "mixamorig:Hips") - travel(&plain, "mixamorig:Hips")).abs() < 1e-4, "not asked to");
}

#[test]
fn feet_are_set_farther_apart() {
    let stage = Stage::onto_itself();
    let plain = stage.play(&stack(r#"{"op": "ik", "softness": 0}"#));
    let wide = stage.play(&stack(r#"{"op": "ik", "softness": 0}, {"op": "stride", "sideways": 0.05}"#));
    let splayed = stage.play(&stack(r#"{"op": "ik", "softness": 0}, {"op": "stride", "splay": 1.5}"#));
    for frame in [0, 50] {
        let apart = |played: &Played| {
            (stage.place(played, frame, "mixamorig:LeftFoot") - stage.place(played, frame, "mixamorig:RightFoot")).x
        };
        let widened = apart(&wide) - apart(&plain);
        assert!((widened - 0.1).abs() < 0.01, "five centimeters on each side: {widened}");
        let ratio = apart(&splayed) / apart(&plain);
        assert!((1.2..1.8).contains(&ratio), "half as far again: {ratio}");
    }
}

/// The walk with a thing in the right hand, and the mannequin with a joint for it below its root.
fn with_thing() -> Stage {
    let mut stage = Stage::walk();
    let add = |skeleton: &Skeleton, parent: usize, rest: Transform| {
        let mut joints = skeleton.joints().to_vec();
        joints.push(Joint { name: "thing".to_owned(), parent: Some(parent), rest, is_joint: true, node: joints.len() });
        Skeleton::new(joints).expect("a skeleton")
    };
    let hand = stage.source_joint("mixamorig:RightHand");
    let held = Transform {
        translation: DVec3::new(0.02, 0.1, 0.05),
        rotation: DQuat::from_rotation_y(0.7),
        ..Transform::IDENTITY
    };
    stage.source.skeleton = add(&stage.source.skeleton, hand, held);
    let clip = &stage.source.clips[0];
    let mut tracks = clip.joints().to_vec();
    tracks.push(JointTracks::default());
    stage.source.clips = vec![Clip::new("walk".to_owned(), clip.times_seconds().to_vec(), tracks).expect("a clip")];
    let root = stage.target_joint("root");
    stage.target.skeleton = add(&stage.target.skeleton, root, Transform::IDENTITY);
    stage
}

#[test]
fn a_thing_stays_in_the_hand() {
    let stage = with_thing();
    let played = stage.play(&stack(r#"{"op": "props", "props": [{"source": "thing", "target": "thing"}]}"#));
    let same_size = stage.play(&stack(
        r#"{"op": "props", "props": [{"source": "thing", "target": "thing", "holder": "right_hand", "scale": 1}]}"#,
    ));
    let in_hand = |played: &Played, frame: usize| {
        let pose = stage.target_pose(played, frame);
        let [hand, thing] = ["hand_r", "thing"].map(|name| pose.transforms()[stage.target_joint(name)]);
        hand.relative(&thing)
    };
    let source_distance = DVec3::new(0.02, 0.1, 0.05).length();
    let first = in_hand(&played, 0);
    for frame in [40, 120] {
        let now = in_hand(&played, frame);
        assert!(now.translation.distance(first.translation) < 1e-5, "it stays in the hand: {now:?}");
        assert!(degrees(now.rotation, first.rotation) < 1e-3, "it does not turn in the hand: {now:?}");
        let distance = in_hand(&same_size, frame).translation.length();
        assert!((distance - source_distance).abs() < 1e-5, "as far as in the source: {distance}");
    }
    let ratio = first.translation.length() / source_distance;
    assert!((0.6..1.1).contains(&ratio), "as much nearer as the hand is smaller: {ratio}");
    let error = stage.try_play(&stack(
        r#"{"op": "props", "props": [{"source": "thing", "target": "pelvis", "holder": "right_hand"}]}"#,
    ));
    assert_eq!(
        error.err().expect("refused").fields[0].pointer,
        "/ops/2/props/0/holder",
        "the hand hangs below the pelvis"
    );
}

#[test]
fn a_second_hand_holds_what_the_first_holds() {
    let stage = Stage::walk();
    let played = stage.play(&stack(r#"{"op": "props", "grips": [{"within": 10, "scale": 0.5}]}"#));
    let plain = stage.play(KINEMATICS);
    for frame in [0, 60] {
        let source = stage.source_pose(frame);
        let apart = |name: &str| source.transforms()[stage.source_joint(name)].translation;
        let wanted = apart("mixamorig:LeftHand").distance(apart("mixamorig:RightHand")) * 0.5;
        let hands =
            |played: &Played| stage.place(played, frame, "hand_l").distance(stage.place(played, frame, "hand_r"));
        assert!((hands(&played) - wanted).abs() < 0.02, "frame {frame}: {} where {wanted} is wanted", hands(&played));
        let lead = stage.place(&played, frame, "hand_r").distance(stage.place(&plain, frame, "hand_r"));
        assert!(lead < 1e-5, "the hand that leads stays: {lead}");
    }
    let far = stage.play(&stack(r#"{"op": "props", "grips": [{"within": 0.01}]}"#));
    let off = stage.place(&far, 60, "hand_l").distance(stage.place(&plain, 60, "hand_l"));
    assert!(off < 1e-4, "hands that are far apart hold nothing together: {off}");
}

#[test]
fn fingers_bend_toward_the_palm() {
    let stage = Stage::walk();
    let plain = stage.play(KINEMATICS);
    let bent = stage.play(&stack(r#"{"op": "fingers", "curl_offset": 30, "mask": ["left_hand", "right_index"]}"#));
    for (finger, hand) in [("middle", "l"), ("index", "r")] {
        let name = |joint: u32| format!("{finger}_0{joint}_{hand}");
        let reach = |played: &Played| {
            stage.place(played, 10, &name(3)).distance(stage.place(played, 10, &format!("hand_{hand}")))
        };
        assert!(reach(&bent) < reach(&plain) - 0.005, "{finger} of {hand}: {} and {}", reach(&bent), reach(&plain));
        let turned = degrees(stage.turned(&plain, 10, &name(1)), stage.turned(&bent, 10, &name(1)));
        assert!((turned - 30.0).abs() < 0.5, "{finger} of {hand} turns by {turned}");
    }
    let untouched = degrees(stage.turned(&plain, 10, "middle_01_r"), stage.turned(&bent, 10, "middle_01_r"));
    assert!(untouched < 1e-3, "masked: {untouched}");
    // In the mannequin's A pose palms face the thighs: bent fingers go toward the body.
    let toward = |played: &Played| stage.place(played, 10, "middle_03_l").x - stage.place(played, 10, "hand_l").x;
    assert!(toward(&bent) < toward(&plain), "toward the palm and not away from it");
}

#[test]
fn a_scaled_source_goes_farther() {
    let stage = Stage::walk();
    let plain = stage.play(KINEMATICS);
    let double = stage.play(&stack(r#"{"op": "scale_source", "factor": 2}"#));
    let about_itself = stage.play(&stack(r#"{"op": "scale_source", "factor": 2, "pivot": "pelvis"}"#));
    for frame in [0, 100] {
        let place = |played: &Played| stage.place(played, frame, "pelvis");
        let floor = played_floor(&plain);
        let wanted = DVec3::new(place(&plain).x * 2.0, floor + (place(&plain).y - floor) * 2.0, place(&plain).z * 2.0);
        assert!(place(&double).distance(wanted) < 2e-3, "frame {frame}: {} where {wanted} is wanted", place(&double));
        let there = place(&about_itself);
        assert!((there.z - place(&plain).z).abs() < 1e-3, "it stays where it is on the floor: {there}");
        let off = degrees(stage.turned(&double, frame, "hand_l"), stage.turned(&plain, frame, "hand_l"));
        assert!(off < 1e-3, "rotations stay: {off}");
    }
    let error = stage.try_play(&stack(r#"{"op": "scale_source", "factor": 2, "alpha": 0.5}"#)).err();
    assert!(error.is_some(), "it has no alpha");
}

fn played_floor(played: &Played) -> f64 {
    let pelvis = played.mapping.pelvis.expect("a pelvis").plain;
    pelvis.target_origin.y
}

/// The spine leads and the tip of a chain of nine bones reaches.
#[test]
fn ends_of_long_chains_get_where_the_sources_are() {
    let stage = Stage::walk();
    let config = |goal: &str, more: &str| stack(&format!(r#"{{"op": "reach", "goals": [{goal}]{more}}}"#));
    let world = |played: &Played, frame: usize, name: &str| {
        let pelvis = played.mapping.pelvis.expect("a pelvis").plain;
        let place = stage.source_pose(frame).transforms()[stage.source_joint(name)].translation;
        pelvis.target_origin + pelvis.scale * (place - pelvis.source_origin)
    };
    let played = stage.play(&config(r#"{"end": "left_hand", "depth": 3}, {"end": "right_hand", "depth": 8}"#, ""));
    let plain = stage.play(KINEMATICS);
    for frame in [0, 40, 90] {
        for (role, joint) in [("mixamorig:LeftHand", "hand_l"), ("mixamorig:RightHand", "hand_r")] {
            let off = stage.place(&played, frame, joint).distance(world(&played, frame, role));
            assert!(off < 1e-3, "{joint} at frame {frame} is {off} off");
            let turned = degrees(stage.turned(&played, frame, joint), stage.turned(&plain, frame, joint));
            assert!(turned < 1e-3, "it keeps how it is turned: {turned}");
        }
    }
    let level =
        stage.play(&config(r#"{"end": "left_hand", "depth": 3, "axes": [0, 1, 0], "offset": [0, 0.05, 0]}"#, ""));
    let (hand, wanted) = (stage.place(&level, 40, "hand_l"), world(&level, 40, "mixamorig:LeftHand") + DVec3::Y * 0.05);
    assert!((hand.y - wanted.y).abs() < 1e-3, "up and down: {hand} where {wanted} is wanted");
    assert!((hand - wanted).with_y(0.0).length() > 0.01, "to the sides it is where the arm takes it");
    let half = stage.play(&config(r#"{"end": "left_hand", "depth": 3, "weight": 0.5}"#, ""));
    let middle = stage.place(&plain, 40, "hand_l").midpoint(world(&plain, 40, "mixamorig:LeftHand"));
    assert!(stage.place(&half, 40, "hand_l").distance(middle) < 1e-3, "half of the way");
}

#[test]
fn a_body_goes_along_where_arms_are_too_short() {
    let stage = Stage::walk();
    let far = r#"{"end": "left_hand", "depth": 2, "offset": [0.9, 0, 0]}"#;
    let config = |goal: &str, more: &str| stack(&format!(r#"{{"op": "reach", "goals": [{goal}]{more}}}"#));
    let plain = stage.play(KINEMATICS);
    let moved = |played: &Played, joint: &str| stage.place(played, 40, joint) - stage.place(&plain, 40, joint);
    let arm = stage.play(&config(far, ""));
    assert!(moved(&arm, "pelvis").length() < 1e-6 && moved(&arm, "spine_05").length() < 1e-6, "the arm alone");
    let deep = stage.play(&config(&far.replace("\"depth\": 2", "\"depth\": 9"), ""));
    assert!(moved(&deep, "hand_l").x > moved(&arm, "hand_l").x + 0.05, "the back bends to the side");
    let whole = stage.play(&config(far, r#", "pelvis": 1, "iterations": 60"#));
    assert!(moved(&whole, "pelvis").x > 0.1, "the pelvis goes along: {}", moved(&whole, "pelvis"));
    let stiff = stage.play(&config(&far.replace("\"depth\": 2", "\"depth\": 9"), r#", "stiffness": {"spine": 1}"#));
    assert!(degrees(stage.turned(&stiff, 40, "spine_05"), stage.turned(&plain, 40, "spine_05")) < 1e-3, "a stiff back");
    let near = stage.play(&config(&far.replace("\"depth\": 2", "\"depth\": 9").replace("0.9", "0.15"), ""));
    for frame in 0..120 {
        let step = stage.place(&near, frame + 1, "hand_l") - stage.place(&near, frame, "hand_l");
        assert!(step.is_finite() && step.length() < 0.12, "no jump at frame {frame}: {step}");
    }
}
