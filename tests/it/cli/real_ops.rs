//! Each op behind the default stack on a real clip and a real character, as a user would ask for it; what comes out is measured
//! here.

use std::path::Path;

use glam::{DMat4, DQuat, DVec3};
use serde_json::{Value, json};
use tempfile::TempDir;

use super::{code, error, retargetd};
use crate::{
    quality::figure::{Figure, degrees_between, position, rotation, world},
    support::corpus_file,
};

const WALK: &str = "bvh/cmu/12_01_walk.bvh";
const DANCE: &str = "mixamo/bvh/ortiz_salsa.bvh";
const CHARACTER: &str = "mixamo/gltf/Xbot.glb";
const MANNEQUIN: &str = "unreal/ue4_names_apose.glb";

/// What came out.
struct Outcome {
    figure: Figure,
    report: Value,
}

impl Outcome {
    fn poses(&self) -> impl Iterator<Item = Vec<DMat4>> {
        let clip = self.figure.clip();
        (0..clip.frame_count()).step_by(11).map(|frame| world(self.figure.skeleton(), Some((clip, frame))))
    }

    fn joint(&self, name: &str) -> usize {
        self.figure.skeleton().find(name).unwrap_or_else(|| panic!("the character has '{name}'"))
    }

    /// Where a joint is over the clip.
    fn places(&self, name: &str) -> Vec<DVec3> {
        let joint = self.joint(name);
        self.poses().map(|pose| position(&pose, joint)).collect()
    }

    fn turns(&self, name: &str) -> Vec<DQuat> {
        let joint = self.joint(name);
        self.poses().map(|pose| rotation(&pose, joint)).collect()
    }

    /// How far two joints are apart over the clip.
    fn apart(&self, first: &str, second: &str) -> Vec<f64> {
        self.places(first).iter().zip(self.places(second)).map(|(first, second)| first.distance(second)).collect()
    }
}

fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.into_iter().collect();
    values.iter().sum::<f64>() / values.len() as f64
}

/// The default stack with an op in it: behind it, or before what holds feet.
fn retargeted(source: &str, target: &str, op: Option<Value>, is_goal: bool) -> Option<Outcome> {
    let (source, target) = (corpus_file(source)?, corpus_file(target)?);
    let folder: TempDir = tempfile::tempdir().expect("a folder");
    let mut ops: Vec<Value> =
        ["pelvis", "fk", "contacts", "ik", "plant", "floor"].iter().map(|op| json!({"op": op})).collect();
    let place = if is_goal { 4 } else { ops.len() };
    ops.splice(place..place, op);
    std::fs::write(folder.path().join("config.json"), json!({"ops": ops}).to_string()).expect("the config");
    let text = |path: &Path| path.to_string_lossy().into_owned();
    let (source, target) = (text(&source), text(&target));
    let arguments = ["--source", &source, "--target", &target, "--config", "config.json"];
    let outputs = ["--output", "out.npz", "--report", "report.json"];
    let output = retargetd(&[&["retarget"], &arguments[..], &outputs].concat(), folder.path());
    assert_eq!(code(&output), Some(0), "{ops:?}: {}", error(&output));
    let report = std::fs::read(folder.path().join("report.json")).expect("the report");
    Some(Outcome {
        figure: Figure::read(&folder.path().join("out.npz")),
        report: serde_json::from_slice(&report).expect("JSON"),
    })
}

fn walk_with(op: Value) -> Option<Outcome> {
    retargeted(WALK, CHARACTER, Some(op), false)
}

#[test]
fn shorter_steps_go_less_far() {
    let stride = json!({"op": "stride", "forward": 0.8});
    let (Some(plain), Some(short)) =
        (retargeted(WALK, CHARACTER, None, false), retargeted(WALK, CHARACTER, Some(stride), true))
    else {
        return;
    };
    let way = |result: &Outcome| {
        let places = result.places("mixamorig:Hips");
        (places[places.len() - 1] - places[0]).with_y(0.0).length()
    };
    let ratio = way(&short) / way(&plain);
    assert!((ratio - 0.8).abs() < 0.02, "the pelvis goes {ratio} times as far");
}

#[test]
fn arms_are_spaced_and_stretched() {
    let (Some(plain), Some(spaced), Some(long)) = (
        retargeted(WALK, CHARACTER, None, false),
        walk_with(json!({"op": "arm_spacing", "degrees": 15})),
        walk_with(json!({"op": "stretch_chain", "scale": 1.2, "mask": ["left_arm"]})),
    ) else {
        return;
    };
    let hands = |result: &Outcome| mean(result.apart("mixamorig:LeftHand", "mixamorig:RightHand"));
    assert!(hands(&spaced) > hands(&plain) + 0.15, "hands are farther apart: {} {}", hands(&spaced), hands(&plain));
    for (side, wanted) in [("Left", 1.2), ("Right", 1.0)] {
        let bone =
            |result: &Outcome| mean(result.apart(&format!("mixamorig:{side}Arm"), &format!("mixamorig:{side}ForeArm")));
        let factor = bone(&long) / bone(&plain);
        assert!((factor - wanted).abs() < 1e-3, "{side}: the upper arm is {factor} times as long");
    }
}

#[test]
fn a_hand_gets_where_it_is_led() {
    let reach = |offset: [f64; 3]| {
        let goal = json!({"end": "right_hand", "place": "chain", "offset": offset});
        walk_with(json!({"op": "reach", "goals": [goal], "pelvis": 0}))
    };
    let (Some(plain), Some(led)) = (reach([0.0; 3]), reach([0.0, 0.2, 0.1])) else { return };
    let moved = |name: &str| {
        let moves = led.places(name).into_iter().zip(plain.places(name)).map(|(led, plain)| (led - plain).length());
        mean(moves)
    };
    assert!((moved("mixamorig:RightHand") - 0.05_f64.sqrt()).abs() < 0.03, "{}", moved("mixamorig:RightHand"));
    assert!(moved("mixamorig:LeftFoot") < 1e-3, "feet stay: {}", moved("mixamorig:LeftFoot"));
}

#[test]
fn a_head_turns_as_much_as_the_table_says() {
    let row =
        |gain: f64| json!({"op": "joints", "rows": [{"source": "head", "target": "head", "rotation_gain": gain}]});
    let (Some(whole), Some(half), Some(none)) = (walk_with(row(1.0)), walk_with(row(0.5)), walk_with(row(0.0))) else {
        return;
    };
    let still = none.turns("mixamorig:Head")[0];
    let most = |result: &Outcome| {
        result.turns("mixamorig:Head").iter().map(|turn| degrees_between(*turn, still)).fold(0.0, f64::max)
    };
    assert!(most(&none) < 0.05, "it does not turn in the world: {}", most(&none));
    assert!(most(&whole) > 5.0, "the walker's does: {}", most(&whole));
    assert!((most(&half) / most(&whole) - 0.5).abs() < 0.01, "{} of {}", most(&half), most(&whole));
}

#[test]
fn sockets_and_roots_follow() {
    let pin = json!({"op": "pin", "pins": [{"joint": "ik_hand_gun", "to": "right_hand", "mode": "global"}]});
    let (Some(pinned), Some(moved)) = (
        retargeted(WALK, MANNEQUIN, Some(pin), false),
        retargeted(WALK, MANNEQUIN, Some(json!({"op": "root_motion"})), false),
    ) else {
        return;
    };
    let off = pinned.apart("ik_hand_gun", "hand_r").into_iter().fold(0.0, f64::max);
    assert!(off < 1e-4, "the socket is in the hand but for {off} m");
    let over_floor = |name: &str| moved.places(name).into_iter().map(|place| place.with_y(0.0)).collect::<Vec<_>>();
    let (root, pelvis) = (over_floor("root"), over_floor("pelvis"));
    let behind = mean(root.iter().zip(&pelvis).map(|(root, pelvis)| root.distance(*pelvis)));
    assert!(behind < 0.1, "the root goes with the pelvis but for {behind} m");
    let way = (root[root.len() - 1] - root[0]).length();
    assert!(way > 1.0, "it walks: {way} m");
}

#[test]
fn hands_hold_one_thing() {
    let grip = json!({"op": "props", "grips": [{"within": 10, "scale": 0.5}]});
    let (Some(plain), Some(held)) =
        (retargeted(DANCE, CHARACTER, None, false), retargeted(DANCE, CHARACTER, Some(grip), false))
    else {
        return;
    };
    let hands = |result: &Outcome| mean(result.apart("mixamorig:LeftHand", "mixamorig:RightHand"));
    assert!(hands(&held) < 0.8 * hands(&plain), "{} of {}", hands(&held), hands(&plain));
    let leads = plain.places("mixamorig:RightHand").into_iter().zip(held.places("mixamorig:RightHand"));
    let off = leads.map(|(plain, held)| plain.distance(held)).fold(0.0, f64::max);
    assert!(off < 1e-4, "the hand that leads stays but for {off} m");
}

#[test]
fn fingers_curl_and_forearms_twist() {
    let curl = json!({"op": "fingers", "curl_offset": 30});
    let (Some(plain), Some(curled)) =
        (retargeted(DANCE, CHARACTER, None, false), retargeted(DANCE, CHARACTER, Some(curl), false))
    else {
        return;
    };
    let tip = |result: &Outcome| mean(result.apart("mixamorig:LeftHand", "mixamorig:LeftHandMiddle3"));
    assert!(tip(&curled) < tip(&plain) - 0.01, "{} of {}", tip(&curled), tip(&plain));
    let twist = |gain: f64| json!({"op": "twist", "gain": gain});
    let (Some(none), Some(all)) =
        (retargeted(DANCE, MANNEQUIN, Some(twist(0.0)), false), retargeted(DANCE, MANNEQUIN, Some(twist(1.0)), false))
    else {
        return;
    };
    let turned = |name: &str| {
        let pairs = none.turns(name).into_iter().zip(all.turns(name));
        pairs.map(|(none, all)| degrees_between(none, all)).fold(0.0, f64::max)
    };
    assert!(turned("lowerarm_twist_01_l") > 10.0, "twist joints take their share: {}", turned("lowerarm_twist_01_l"));
    assert!(turned("hand_l") < 0.05, "hands stay as they are: {}", turned("hand_l"));
}

#[test]
fn what_limits_take_back_is_in_the_report() {
    let range = json!({"bend": [-5, 40], "side": [-20, 20], "twist": [-90, 90]});
    let limits =
        json!({"op": "limits", "relative": false, "ranges": {"left_forearm": range}, "mask": ["left_forearm"]});
    let (Some(plain), Some(limited)) =
        (retargeted(DANCE, CHARACTER, None, false), retargeted(DANCE, CHARACTER, Some(limits), false))
    else {
        return;
    };
    let bend = |result: &Outcome| {
        let [shoulder, elbow, hand] =
            ["LeftArm", "LeftForeArm", "LeftHand"].map(|name| result.places(&format!("mixamorig:{name}")));
        let angles = (0..elbow.len())
            .map(|frame| (elbow[frame] - shoulder[frame]).angle_between(hand[frame] - elbow[frame]).to_degrees());
        angles.fold(0.0, f64::max)
    };
    assert!(bend(&plain) > 60.0 && bend(&limited) < 46.0, "{} is held to {}", bend(&plain), bend(&limited));
    assert_eq!(plain.report["limited"], Value::Null, "nothing limits there");
    let told = limited.report["limited"].as_array().expect("a list");
    assert_eq!(told.len(), 1, "one joint: {told:?}");
    assert_eq!(told[0]["joint"], "mixamorig:LeftForeArm", "{told:?}");
    assert!(told[0]["frames"].as_u64() > Some(10), "{told:?}");
    let taken = told[0]["worst_degrees"].as_f64().expect("degrees");
    assert!((taken - (bend(&plain) - bend(&limited))).abs() < 25.0, "{told:?}");
}
