//! `joints`: the table of the Cinema 4D script.

use glam::{DQuat, DVec3, EulerRot, Quat, Vec3};
use retargetd::model::{Axes, Clip, Joint, JointTracks, Scene, Skeleton, Track, Transform};

use super::stage::{Stage, degrees};

/// An arm of two bones along +X, and a clip in which the second is turned.
fn arm(turn: DQuat, hand: Vec3) -> Scene {
    let joint = |name: &str, parent: Option<usize>| Joint {
        name: name.to_owned(),
        parent,
        rest: Transform::from_translation(DVec3::X * f64::from(u8::from(parent.is_some()))),
        is_joint: true,
        node: 0,
    };
    let joints = vec![joint("upper", None), joint("fore", Some(0)), joint("tip", Some(1))];
    let mut tracks = vec![JointTracks::default(); 3];
    tracks[1].rotation = Track::Constant(turn.as_quat());
    tracks[2].translation = Track::Constant(hand);
    Scene {
        skeleton: Skeleton::new(joints).expect("a skeleton"),
        clips: vec![Clip::new("turn".to_owned(), vec![0.0], tracks).expect("a clip")],
        axes: Some(Axes::Y_UP_Z_FRONT),
        unit_meters: Some(1.0),
        ..Scene::default()
    }
}

fn stage(turn: DQuat, hand: Vec3) -> Stage {
    Stage { source: arm(turn, hand), target: arm(DQuat::IDENTITY, Vec3::X) }
}

/// Joints of equal names have chains that hold them at rest, so that only the table moves them.
fn table(row: &str) -> String {
    format!(r#"{{"ops": [{{"op": "fk", "rotation": "none"}}, {{"op": "joints", "rows": [{row}]}}]}}"#)
}

#[test]
fn the_printed_example_of_the_script_comes_out() {
    // A forearm that is turned by −45° about X, under an axis offset of 45° about Z, has H −35.2643896828, P −30.0,
    // B −9.73561031725: the angles about Y, X and Z of a rotation that is applied heading first.
    let stage = stage(DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_4), Vec3::X);
    let row = table(r#"{"source": "fore", "target": "fore", "space": "local", "axis_offset": [0, 0, 45]}"#);
    let csv = "Source;Target;Space;Axis Offset Z\r\nfore;fore;local;45,0\r\n";
    for config in [row.as_str(), csv] {
        let played = stage.play(config);
        let rotation = played.clip.joints()[1].rotation.at(0, Quat::IDENTITY).as_dquat();
        let (bank, pitch, heading) = rotation.to_euler(EulerRot::ZXY);
        for (angle, wanted) in [(heading, -35.264_389_682_8), (pitch, -30.0), (bank, -9.735_610_317_25)] {
            assert!((angle.to_degrees() - wanted).abs() < 1e-4, "{} where {wanted} is printed", angle.to_degrees());
        }
    }
}

#[test]
fn axes_are_exchanged_and_angles_multiplied() {
    let stage = stage(DQuat::from_rotation_y(0.4), Vec3::X);
    for (row, wanted) in [
        (r#""axis_order": "xzy""#, DQuat::from_rotation_z(0.4)),
        (r#""axis_order": "y-xz""#, DQuat::from_rotation_x(0.4)),
        (r#""axis_order": "x-yz", "rotation_gain": 2"#, DQuat::from_rotation_y(-0.8)),
        (r#""rotation_gain": 0.5, "rotation_offset": [0, 0, 90]"#, DQuat::from_rotation_y(0.2) * quarter_about_z()),
        (r#""rotation": false, "position": true"#, DQuat::IDENTITY),
    ] {
        for space in ["local", "model"] {
            let played =
                stage.play(&table(&format!(r#"{{"source": "fore", "target": "fore", "space": "{space}", {row}}}"#)));
            let rotation = played.clip.joints()[1].rotation.at(0, Quat::IDENTITY).as_dquat();
            assert!(degrees(rotation, wanted) < 1e-4, "{space} {row}: {rotation} where {wanted} is wanted");
        }
    }
}

fn quarter_about_z() -> DQuat {
    DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2)
}

#[test]
fn positions_follow_with_gain_and_offset() {
    let stage = stage(DQuat::IDENTITY, Vec3::new(1.5, 0.25, 0.0));
    let row = r#"{"source": "tip", "target": "tip", "rotation": false, "position": true, "position_gain": 2,
                  "position_offset": [0, 0, 0.125], "axis_order": "yxz""#;
    for space in ["local", "model"] {
        let played = stage.play(&table(&format!(r#"{row}, "space": "{space}"}}"#)));
        let place = played.clip.joints()[2].translation.at(0, Vec3::ZERO);
        let wanted = Vec3::new(1.0 + 2.0 * 0.25, 2.0 * 0.5, 0.125);
        assert!(place.distance(wanted) < 1e-6, "{space}: {place} where {wanted} is wanted");
    }
}

#[test]
fn two_points_give_a_direction() {
    // The tip of the source lies up and to the left of its shoulder; whatever the elbow does, the target's forearm points there.
    let stage = stage(DQuat::from_rotation_z(2.0), Vec3::new(0.3, 0.4, 0.0));
    let row = r#"{"source": ["upper", "tip"], "target": "fore"}"#;
    let played = stage.play(&table(row));
    let (source, target) = (stage.source_pose(0), stage.target_pose(&played, 0));
    let way = |pose: &retargetd::model::ModelPose, from: usize, to: usize| {
        (pose.transforms()[to].translation - pose.transforms()[from].translation).normalize()
    };
    let (wanted, found) = (way(&source, 0, 2), way(&target, 1, 2));
    assert!(found.distance(wanted) < 1e-6, "{found} where {wanted} is wanted");
}

#[test]
fn a_table_in_the_model_is_what_chains_do() {
    let stage = Stage::walk();
    let chains = stage.play(r#"{"ops": [{"op": "pelvis"}, {"op": "fk", "twist": false}]}"#);
    let roles = ["spine", "left_upper_arm", "left_forearm", "left_hand", "right_thigh", "right_shin", "head"];
    let rows = |roles: &[&str]| -> String {
        let row = |role: &&str| format!(r#"{{"source": "{role}", "target": "{role}"}}"#);
        roles.iter().map(row).collect::<Vec<_>>().join(", ")
    };
    let config = format!(
        r#"{{"ops": [{{"op": "pelvis"}}, {{"op": "fk", "mask": ["left_clavicle"], "twist": false}},
                      {{"op": "joints", "rows": [{}, {{"source": "pelvis", "target": "pelvis", "position": true}}]}}]}}"#,
        rows(&roles[1..])
    );
    let played = stage.play(&config);
    for frame in [0, 37, 120] {
        for joint in ["upperarm_l", "lowerarm_l", "hand_l", "thigh_r", "calf_r", "head", "pelvis"] {
            let (first, second) = (stage.turned(&chains, frame, joint), stage.turned(&played, frame, joint));
            assert!(degrees(first, second) < 1e-3, "{joint} at frame {frame}: {} degrees", degrees(first, second));
        }
        let (first, second) = (stage.place(&chains, frame, "pelvis"), stage.place(&played, frame, "pelvis"));
        assert!(first.distance(second) < 1e-3, "the pelvis at frame {frame}: {first} and {second}");
    }
}

#[test]
fn alpha_and_frames_say_how_much_and_when() {
    let stage = Stage::onto_itself();
    let ops = |scope: &str| {
        format!(
            r#"{{"ops": [{{"op": "pelvis"}}, {{"op": "fk"}}, {{"op": "joints", {scope} "rows": [
                {{"source": "head", "target": "head", "rotation_gain": 0, "rotation_offset": [0, 40, 0]}}]}}]}}"#
        )
    };
    let plain = stage.play(&ops(r#""enabled": false,"#));
    let whole = stage.play(&ops(""));
    let half = stage.play(&ops(r#""alpha": [[0, 0], [2, 1]],"#));
    let some = stage.play(&ops(r#""frames": [10, 20],"#));
    let turned = |played, frame| stage.turned(played, frame, "mixamorig:Head");
    let far = degrees(turned(&plain, 30), turned(&whole, 30));
    assert!((far - 40.0).abs() < 15.0, "the head is turned by about 40 degrees: {far}");
    assert!(
        (degrees(turned(&plain, 30), turned(&half, 30)) - far / 2.0).abs() < 0.01,
        "half of it after one of two seconds"
    );
    assert!(degrees(turned(&whole, 100), turned(&half, 100)) < 1e-3, "all of it in the end");
    for (frame, wanted) in [(9, &plain), (10, &whole), (20, &whole), (21, &plain)] {
        assert!(degrees(turned(wanted, frame), turned(&some, frame)) < 1e-3, "frame {frame}");
    }
}

#[test]
fn what_a_table_names_must_exist() {
    let stage = Stage::walk();
    for (row, pointer, hint) in [
        (r#"{"source": "left_forarm", "target": "head"}"#, "/ops/0/rows/0/source", ""),
        (r#"{"source": "head", "target": "hed"}"#, "/ops/0/rows/0/target", "head"),
        (r#"{"source": "head", "target": "head", "axis_order": "xyy"}"#, "/ops/0/rows/0/axis_order", ""),
        (r#"{"source": ["head", "neck"], "target": "head"}"#, "/ops/0/rows/0/points_to", ""),
        (r#"{"source": "head", "target": "head", "gain": 2}"#, "/ops/0/rows/0/gain", ""),
    ] {
        let error = stage.try_play(&format!(r#"{{"ops": [{{"op": "joints", "rows": [{row}]}}]}}"#));
        let fields = error.err().unwrap_or_else(|| panic!("{row} is refused")).fields;
        assert_eq!(fields[0].pointer, pointer, "{row}: {fields:?}");
        assert!(hint.is_empty() || fields[0].did_you_mean.iter().any(|name| name == hint), "{row}: {fields:?}");
    }
}
