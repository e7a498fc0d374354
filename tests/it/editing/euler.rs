//! Angles that are written change no faster than those that were read, and quaternions never flip their sign.

use std::collections::BTreeMap;

use glam::DQuat;
use retargetd::{
    engine::{self, EditInputs, Format, Limits, NamedBytes},
    model::{Clip, Control, JointTracks, Scene, Track},
};

use super::read;
use crate::support::corpus_file;

/// Clips that turn round, somersault or dance.
const SPINNING: [&str; 8] = [
    "poser-daz/pirouette_daz_friendly.bvh",
    "bvh/rokoko/jesse_dance.bvh",
    "bvh/cmu/jumping_jacks_max_names.bvh",
    "bvh/cmu/boxing_toes_row_mismatch.bvh",
    "bvh/misc/pybvh_mixed_orders.bvh",
    "bvh/misc/meredith_8walk_vicon.bvh",
    "bvh/xsens/aitviewer_sample.bvh",
    "bvh/fair1/dab_zup.bvh",
];

/// The largest step of an angle from one frame to the next, in degrees, by joint.
type Steps = BTreeMap<String, f64>;

/// Of the channels of a BVH; whole turns left out if `wraps`.
fn steps_of_bvh(bvh: &str, wraps: bool) -> Steps {
    let mut columns: Vec<(String, bool)> = Vec::new();
    let mut joint = String::new();
    for line in bvh.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.first().copied() {
            Some("ROOT" | "JOINT") => joint = words[1..].join(" "),
            Some("CHANNELS") => {
                columns.extend(words[2..].iter().map(|name| (joint.clone(), name.ends_with("rotation"))));
            }
            _ => {}
        }
    }
    let motion = bvh.split("Frame Time:").nth(1).expect("a motion");
    let rows: Vec<Vec<f64>> = motion
        .lines()
        .skip(1)
        .map(|line| line.split_whitespace().map(|number| number.parse().expect("a number")).collect())
        .filter(|row: &Vec<f64>| !row.is_empty())
        .collect();
    let mut steps = Steps::new();
    for pair in rows.windows(2) {
        for ((before, after), (joint, _)) in pair[0].iter().zip(&pair[1]).zip(&columns).filter(|(_, (_, angle))| *angle)
        {
            let step = (after - before).abs();
            let step = if wraps { (step - (step / 360.0).round() * 360.0).abs() } else { step };
            let largest = steps.entry(joint.clone()).or_default();
            *largest = largest.max(step);
        }
    }
    steps
}

/// Of the rotation curves of an FBX, as an independent parser reads them.
pub(crate) fn steps_of_fbx(fbx: &[u8]) -> Steps {
    let file = ufbx::load_memory(fbx, ufbx::LoadOpts::default()).expect("an FBX");
    let mut steps = Steps::new();
    for row in
        file.anim_layers.iter().flat_map(|layer| &layer.anim_props).filter(|row| *row.prop_name == *"Lcl Rotation")
    {
        let largest = steps.entry(row.element.name.to_string()).or_default();
        for curve in row.anim_value.curves.iter().flatten() {
            let keys: Vec<f64> = curve.keyframes.iter().map(|key| key.value).collect();
            *largest = keys.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(*largest, f64::max);
        }
    }
    steps
}

/// The largest turn of each joint from one frame to the next, in degrees.
fn turns_of(scene: &Scene) -> Steps {
    let turn = |tracks: &JointTracks| match &tracks.rotation {
        Track::Sampled(values) => values.windows(2).map(|pair| pair[0].angle_between(pair[1])).fold(0.0, f32::max),
        Track::Rest | Track::Constant(_) => 0.0,
    };
    let joints = scene.skeleton.joints().iter().zip(scene.clips[0].joints());
    joints.map(|(joint, tracks)| (joint.name.clone(), f64::from(turn(tracks)).to_degrees())).collect()
}

/// Steps of less, in degrees, are no jumps, however small those of the file were.
const SMALL_STEP: f64 = 11.5;
/// The usual order is kept where another one would be better by no more.
const KEPT_FOR_LESS: f64 = 1.06;

/// No angle of the clip steps by more than the largest step of the source, and none of a joint by more than it did in the source, or by
/// more than the joint turns.
fn no_jump_above(name: &str, ours: &Steps, own: &Steps, turns: &Steps) {
    let common: Vec<(&String, f64, f64)> =
        ours.iter().filter_map(|(joint, step)| Some((joint, *step, own.get(joint)?.max(*turns.get(joint)?)))).collect();
    assert!(common.len() * 10 >= ours.len() * 7, "{name}: joints are found again");
    let largest = |steps: &Steps| steps.values().copied().fold(0.0, f64::max);
    let (largest_of_ours, largest_of_own) = (largest(ours), largest(own));
    // Rounding: files have six decimals, and f32 in between.
    assert!(largest_of_ours < largest_of_own + 0.1, "{name}: {largest_of_ours}° at most, the source {largest_of_own}°");
    for (joint, ours, own) in common {
        assert!(
            ours <= own.max(SMALL_STEP) * KEPT_FOR_LESS,
            "{name}, {joint}: a step of {ours}°, the file's own largest is {own}°"
        );
    }
}

fn edited(path: &std::path::Path, config: &str, format: Format) -> engine::Outcome {
    let bytes = std::fs::read(path).expect("the file");
    edited_bytes(&path.file_name().expect("a name").to_string_lossy(), &bytes, config, &[format])
}

fn edited_bytes(name: &str, bytes: &[u8], config: &str, formats: &[Format]) -> engine::Outcome {
    let inputs = EditInputs {
        source: NamedBytes { name, bytes },
        source_rest: None,
        unread_target: false,
        config: Some(NamedBytes { name: "config.json", bytes: config.as_bytes() }),
        formats,
    };
    engine::edit(&inputs, &Limits::default(), &Control::new()).expect("an outcome")
}

/// The largest angle by which joints of the same name are turned otherwise, in degrees.
fn apart(one: &Scene, other: &Scene) -> f64 {
    let mut widest: f64 = 0.0;
    let pairs: Vec<(usize, usize)> = (0..one.skeleton.len())
        .filter_map(|joint| Some((joint, other.skeleton.find(&one.skeleton.joints()[joint].name)?)))
        .collect();
    assert!(pairs.len() * 10 >= one.skeleton.len() * 7, "most joints are there");
    for frame in 0..one.clips[0].frame_count() {
        let pose = |scene: &Scene| scene.clips[0].local_pose(&scene.skeleton, frame).to_model(&scene.skeleton);
        let (here, there) = (pose(one), pose(other));
        for (joint, same) in &pairs {
            let angle = |a: DQuat, b: DQuat| 2.0 * (a - b).length().min((a + b).length()).to_degrees();
            widest = widest.max(angle(here.transforms()[*joint].rotation, there.transforms()[*same].rotation));
        }
    }
    widest
}

#[test]
fn spinning_clips_have_no_jump_above_their_own() {
    for name in SPINNING {
        let Some(path) = corpus_file(name) else { continue };
        let text = String::from_utf8_lossy(&std::fs::read(&path).expect("the file")).into_owned();
        let own = steps_of_bvh(&text, true);
        let scene = read(&path);
        let outcome = edited(&path, "{}", Format::Bvh);
        let written = String::from_utf8(outcome.outputs[0].bytes.clone()).expect("text");
        no_jump_above(name, &steps_of_bvh(&written, false), &own, &turns_of(&scene));
        let told = outcome.report.warnings.iter().any(|warning| warning.code == "rotation_order_chosen");
        let orders = written.matches("Zrotation Xrotation Yrotation").count();
        assert_eq!(told, orders < written.matches("CHANNELS").count(), "{name}: other orders are told");
        let back = scene_of(&outcome);
        assert!(apart(&scene, &back) < 0.01, "{name}: the same rotations");

        let outcome = edited(&path, "{}", Format::Fbx);
        no_jump_above(&format!("{name} as FBX"), &steps_of_fbx(&outcome.outputs[0].bytes), &own, &turns_of(&scene));
        let fbx = scene_of(&outcome);
        let off = apart(&scene_in_meters(&path), &fbx);
        assert!(off < 0.02, "{name}: {off} degrees off in an FBX");
        no_flip(name, &fbx.clips[0]);
    }
}

/// A chain of which each joint turns through the gimbal of its own order, all three angles at once, each time exactly in one frame; and
/// three joints that turn on and on about one axis.
fn tumbling() -> String {
    let orders = ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"].map(|order| (order, [15.0, 7.5, -12.0]));
    let single = [("ZXY", [0.0, 0.0, 15.0]), ("ZXY", [0.0, 15.0, 0.0]), ("YZX", [15.0, 0.0, 0.0])];
    let joints: Vec<(&str, [f64; 3])> = orders.into_iter().chain(single).collect();
    let mut text = "HIERARCHY\nROOT root\n{\nOFFSET 0 1 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n".to_owned();
    for (index, (order, _)) in joints.iter().enumerate() {
        let channels: Vec<String> = order.chars().map(|axis| format!("{axis}rotation")).collect();
        text += &format!("JOINT joint_{index}\n{{\nOFFSET 0 1 0\nCHANNELS 3 {}\n", channels.join(" "));
    }
    text += &format!(
        "End Site\n{{\nOFFSET 0 1 0\n}}\n{}MOTION\nFrames: 200\nFrame Time: 0.04\n",
        "}\n".repeat(joints.len() + 1)
    );
    for frame in 0..200 {
        let angles = joints.iter().flat_map(|(_, rates)| rates.map(|rate| (rate * f64::from(frame)).to_string()));
        text += &format!("0 1 0 0 0 0 {}\n", angles.collect::<Vec<String>>().join(" "));
    }
    text
}

#[test]
fn whatever_turns_through_the_gimbal_goes_on_as_it_went() {
    let text = tumbling();
    let own = steps_of_bvh(&text, true);
    let mut reporter = retargetd::model::Reporter::new();
    let source =
        retargetd::formats::read(text.as_bytes(), Format::Bvh, &Limits::default(), &Control::new(), &mut reporter);
    let source = source.expect("it reads");
    for format in [Format::Bvh, Format::Fbx] {
        let outcome =
            edited_bytes("tumbling.bvh", text.as_bytes(), r#"{"source": {"axes": "+y+z", "unit": 1}}"#, &[format]);
        let bytes = &outcome.outputs[0].bytes;
        let steps = if format == Format::Bvh {
            steps_of_bvh(&String::from_utf8_lossy(bytes), false)
        } else {
            steps_of_fbx(bytes)
        };
        no_jump_above(&format!("{format:?}"), &steps, &own, &turns_of(&source));
        let off = apart(&source, &scene_of(&outcome));
        assert!(off < 0.02, "{format:?}: {off} degrees off");
    }
}

/// As a GLB of it has it: the axes and unit of every other output.
fn scene_in_meters(path: &std::path::Path) -> Scene {
    scene_of(&edited(path, "{}", Format::Glb))
}

fn scene_of(outcome: &engine::Outcome) -> Scene {
    crate::quality::figure::read_scene(&outcome.outputs[0].bytes, &outcome.outputs[0].name)
}

fn no_flip(name: &str, clip: &Clip) {
    for tracks in clip.joints() {
        if let Track::Sampled(values) = &tracks.rotation {
            assert!(values.windows(2).all(|pair| pair[0].dot(pair[1]) >= 0.0), "{name}: a quaternion flips its sign");
        }
    }
}

#[test]
fn quaternion_tracks_never_flip() {
    let edits = [
        r#"{"edit": {"reverse": true, "ping_pong": true}}"#,
        r#"{"edit": {"mirror": true, "fps": 24}, "output": {"keys": "needed"}}"#,
        r#"{"edit": {"loop": {"times": 3}, "mirror": {"mode": "components"}}}"#,
        r#"{"edit": {"additive": "mean", "interpolation": "cubic", "fps": 50}}"#,
        r#"{"edit": {"warp": [[0, 0], [1, 1.7]], "hold": {"after_seconds": 1}, "filter": {"kind": "one_euro"}}}"#,
        r#"{"edit": {"filter": {"kind": "savitzky_golay"}, "every": 3}}"#,
        r#"{"edit": {"filter": {"kind": "butterworth"}}, "layer": {"mode": "add", "weight": 0.5}}"#,
        r#"{"edit": {"filter": {"kind": "median"}}, "layer": {"weight": 0.7, "at_seconds": 0.5}}"#,
    ];
    let formats = [Format::Glb, Format::PosesNpz, Format::PosesJson, Format::Fbx, Format::Bvh];
    let spin = tumbling();
    let mut sources = vec![("tumbling.bvh".to_owned(), spin.into_bytes())];
    for name in ["poser-daz/pirouette_daz_friendly.bvh", "bvh/xsens/aitviewer_sample.bvh"] {
        let Some(path) = corpus_file(name) else { continue };
        sources.push((name.replace('/', "_"), std::fs::read(path).expect("the file")));
    }
    for (name, bytes) in &sources {
        for edit in edits {
            let outcome = edited_bytes(name, bytes, edit, &formats);
            assert_eq!(outcome.outputs.len(), formats.len(), "{name}: every format");
            for output in &outcome.outputs {
                let scene = crate::quality::figure::read_scene(&output.bytes, &output.name);
                no_flip(&format!("{name}, {edit}, {}", output.name), &scene.clips[0]);
            }
        }
    }
}

#[test]
fn one_order_can_be_asked_for() {
    let Some(path) = corpus_file("poser-daz/pirouette_daz_friendly.bvh") else { return };
    let outcome = edited(&path, r#"{"output": {"rotation_order": "yxz"}}"#, Format::Bvh);
    let text = String::from_utf8(outcome.outputs[0].bytes.clone()).expect("text");
    assert_eq!(text.matches("Yrotation Xrotation Zrotation").count(), text.matches("CHANNELS").count(), "all joints");
    assert!(apart(&read(&path), &scene_of(&outcome)) < 0.01, "the same rotations");
}
