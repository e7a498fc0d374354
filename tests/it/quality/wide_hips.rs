//! Hips that are wide for their legs turn less under legs that stand.

use glam::DVec3;
use retargetd::{
    model::{Clip, Scene},
    retarget::{MetricName, RetargetSpec, StackResult},
    samples,
};

use super::{
    figure::{measured, moved, moved_with, read_scene, rig_of, world},
    made_rigs::MadeRig,
};

fn walk() -> Scene {
    samples::walk_scene()
}

/// The mannequin with its legs so much farther apart, in meters.
fn mannequin(wider: f64) -> Scene {
    let scene = read_scene(&samples::mannequin(), "mannequin.glb");
    let mut made = MadeRig::of(&scene);
    for (side, sign) in [("l", 1.0), ("r", -1.0)] {
        let out = made.place(&format!("thigh_{side}")).x.signum();
        assert_eq!(out, sign, "which side is which");
        for joint in ["thigh", "calf", "foot", "ball"].map(|name| format!("{name}_{side}")) {
            let place = made.place(&joint);
            made = made.moved(&joint, place + DVec3::X * out * wider);
        }
    }
    made.scene(|_| false)
}

/// How a joint is turned in the result beyond how it is turned in another, at most; degrees.
fn turned(target: &Scene, joint: &str, results: [&Clip; 2]) -> f64 {
    let index = target.skeleton.joints().iter().position(|one| one.name == joint).expect("a joint");
    let rotation = |clip: &Clip, frame: usize| {
        world(&target.skeleton, Some((clip, frame)))[index].to_scale_rotation_translation().1
    };
    let between = |frame: usize| rotation(results[0], frame).angle_between(rotation(results[1], frame)).to_degrees();
    (0..results[0].frame_count()).map(between).fold(0.0, f64::max)
}

fn without_a_pull(source: &Scene, target: &Scene) -> StackResult {
    let ops = serde_json::json!({"ops": [
        {"op": "pelvis"}, {"op": "fk"}, {"op": "contacts"}, {"op": "ik"}, {"op": "plant", "pull_pelvis": false},
    ]});
    let spec: RetargetSpec = serde_json::from_value(ops).expect("a spec");
    moved_with(&rig_of("source", source), &rig_of("target", target), &spec)
}

#[test]
fn wide_hips_turn_less_and_stay_where_they_are() {
    let (source, target) = (walk(), mannequin(0.3));
    let result = moved(&rig_of("source", &source), &rig_of("target", &target));
    let measures = measured(&rig_of("source", &source), &rig_of("target", &target), &result);
    let sway = measures.metrics[&MetricName::PelvisSway].value.expect("it walks");
    assert!(sway < 0.3, "the pelvis is taken aside by {sway} cm");
    let rotations = without_a_pull(&source, &target);
    let turn = |joint: &str| turned(&target, joint, [&result.clip, &rotations.clip]);
    assert!((0.3..15.0).contains(&turn("pelvis")), "the pelvis turns by {} degrees", turn("pelvis"));
    for joint in ["spine_01", "head", "hand_l"] {
        assert!(turn(joint) < 0.01, "{joint} keeps how it is turned: {} degrees", turn(joint));
    }
}

#[test]
fn hips_of_ordinary_figures_turn_as_the_source_does() {
    let (source, target) = (walk(), mannequin(0.0));
    let result = moved(&rig_of("source", &source), &rig_of("target", &target));
    let turn = turned(&target, "pelvis", [&result.clip, &without_a_pull(&source, &target).clip]);
    assert!(turn < 0.3, "the pelvis turns by {turn} degrees");
}
