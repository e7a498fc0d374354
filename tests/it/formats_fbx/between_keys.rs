//! Curves between their keys, at whatever rate is asked for.

use std::process::Command;

use serde_json::{Value, json};

use super::made::{Between, Channel, Curve, Document, Of, line, vector};

/// A spine that turns by 80 degrees within a second, slowly at both ends.
fn easing() -> Document {
    let above = [vector("Lcl Translation", [0.0, 10.0, 0.0])];
    let ease = Curve { between: Between::Ease, ..line(&[(0.0, 0.0), (1.0, 80.0)]) };
    Document::chain(&[("Hips", &[]), ("Spine", &above)]).moved(&[Channel::new(
        Of::Node(1),
        "Lcl Rotation",
        &[("Y", ease)],
    )])
}

/// The angles of the spine in degrees, and their times, after an edit by the real binary.
fn angles(config: &Value) -> Vec<(f64, f64)> {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("in.fbx"), easing().text()).expect("the file");
    std::fs::write(folder.path().join("config.json"), config.to_string()).expect("the config");
    let output = Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args(["edit", "--input", "in.fbx", "--config", "config.json", "--output", "out.json"])
        .current_dir(folder.path())
        .output()
        .expect("the binary runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let poses: Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("out.json")).expect("poses")).expect("JSON");
    let number = |value: &Value| value.as_f64().expect("a number");
    let turn = |frame: &Value| 2.0 * number(&frame[1][1]).atan2(number(&frame[1][3])).to_degrees();
    let frames = poses["rotations"].as_array().expect("frames");
    poses["times"].as_array().expect("times").iter().map(number).zip(frames.iter().map(turn)).collect()
}

fn eased(seconds: f64) -> f64 {
    80.0 * seconds * seconds * (3.0 - 2.0 * seconds)
}

#[test]
fn frames_between_keys_lie_on_the_curves_of_the_file() {
    let found = angles(&json!({"edit": {"fps": 120}}));
    assert_eq!(found.len(), 121, "a second at 120 frames per second, of a file of 30");
    for (seconds, angle) in found {
        assert!((angle - eased(seconds)).abs() < 1e-3, "{angle} at {seconds} s, not {}", eased(seconds));
    }
}

#[test]
fn so_do_frames_of_a_range_that_is_played_slowly() {
    let found = angles(&json!({"edit": {"range": [0.117, 0.817], "speed": 0.5, "fps": 50}}));
    assert_eq!(found.len(), 71, "1.4 seconds at 50 frames per second");
    for (seconds, angle) in found {
        let expected = eased(0.117 + seconds * 0.5);
        assert!((angle - expected).abs() < 1e-3, "{angle} at {seconds} s, not {expected}");
    }
}

#[test]
fn frames_that_were_dropped_are_not_shown_between_those_that_were_kept() {
    let found = angles(&json!({"edit": {"every": 1000, "fps": 10}}));
    for (seconds, angle) in found {
        assert!(
            (angle - 80.0 * seconds).abs() < 1e-3,
            "{angle} at {seconds} s: only the first and the last frame were kept"
        );
    }
}
