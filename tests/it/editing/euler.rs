//! Angles that are written change no faster than those that were read, and quaternions never flip their sign.

use glam::DQuat;
use retargetd::{
    engine::{self, EditInputs, Format, Limits, NamedBytes},
    model::{Clip, Control, Scene, Track},
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

/// The largest step of an angle from frame to frame, in degrees, whole turns left out of `wraps` only.
fn largest_step(bvh: &str, wraps: bool) -> f64 {
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<String>>();
    let channels = bvh.lines().map(words).filter(|line| line.first().is_some_and(|word| word == "CHANNELS"));
    let is_angle: Vec<bool> = channels
        .flat_map(|line| line[2..].iter().map(|name| name.ends_with("rotation")).collect::<Vec<bool>>())
        .collect();
    let motion = bvh.split("Frame Time:").nth(1).expect("a motion");
    let rows: Vec<Vec<f64>> = motion
        .lines()
        .skip(1)
        .map(|line| line.split_whitespace().map(|number| number.parse().expect("a number")).collect())
        .filter(|row: &Vec<f64>| !row.is_empty())
        .collect();
    let step = |before: f64, after: f64| {
        let step = (after - before).abs();
        if wraps { (step - (step / 360.0).round() * 360.0).abs() } else { step }
    };
    let steps = rows.windows(2).flat_map(|pair| {
        let angles = pair[0].iter().zip(&pair[1]).zip(&is_angle).filter(|(_, is_angle)| **is_angle);
        angles.map(|((before, after), _)| step(*before, *after)).collect::<Vec<f64>>()
    });
    steps.fold(0.0, f64::max)
}

fn edited(path: &std::path::Path, config: &str, format: Format) -> engine::Outcome {
    let bytes = std::fs::read(path).expect("the file");
    let inputs = EditInputs {
        source: NamedBytes { name: &path.file_name().expect("a name").to_string_lossy(), bytes: &bytes },
        source_rest: None,
        config: Some(NamedBytes { name: "config.json", bytes: config.as_bytes() }),
        formats: &[format],
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
        let own = largest_step(&text, true);
        let scene = read(&path);
        let outcome = edited(&path, "{}", Format::Bvh);
        let written = String::from_utf8(outcome.outputs[0].bytes.clone()).expect("text");
        let ours = largest_step(&written, false);
        assert!(ours <= own + 1e-3, "{name}: a step of {ours} degrees where the file's own largest is {own}");
        let told = outcome.report.warnings.iter().any(|warning| warning.code == "rotation_order_chosen");
        let orders = written.matches("Zrotation Xrotation Yrotation").count();
        assert_eq!(told, orders < written.matches("CHANNELS").count(), "{name}: other orders are told");
        let back = scene_of(&outcome);
        assert!(apart(&scene, &back) < 0.01, "{name}: the same rotations");

        let fbx = scene_of(&edited(&path, "{}", Format::Fbx));
        let off = apart(&scene_in_metres(&path), &fbx);
        assert!(off < 0.02, "{name}: {off} degrees off in an FBX");
        no_flip(name, &fbx.clips[0]);
    }
}

/// As a GLB of it has it: the axes and unit of every other output.
fn scene_in_metres(path: &std::path::Path) -> Scene {
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
        "{}",
        r#"{"edit": {"reverse": true, "ping_pong": true}}"#,
        r#"{"edit": {"mirror": true, "fps": 24}}"#,
        r#"{"edit": {"loop": {"times": 3}, "mirror": {"mode": "components"}}}"#,
        r#"{"edit": {"additive": "mean", "interpolation": "cubic", "fps": 50}}"#,
    ];
    for name in ["poser-daz/pirouette_daz_friendly.bvh", "bvh/xsens/aitviewer_sample.bvh"] {
        let Some(path) = corpus_file(name) else { continue };
        for edit in edits {
            no_flip(&format!("{name}, {edit}"), &scene_of(&edited(&path, edit, Format::PosesNpz)).clips[0]);
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
