//! Cycles that are found, and the filter as an edit.

use retargetd::{
    editing::find_cycles,
    engine::{self, EditInputs, Format, Limits, NamedBytes},
    model::{Clip, Control, Scene, Track},
    samples,
};
use serde_json::{Value, json};

use super::{edited, read, real_clips, rotations};
use crate::support::corpus_file;

/// One cycle of the sample: both feet once.
const WALK_CYCLE_SECONDS: f64 = 1.0;

fn outcome(config: &str) -> Result<engine::Outcome, engine::Failure> {
    let walk = samples::walk_clip();
    let inputs = EditInputs {
        source: NamedBytes { name: "walk.glb", bytes: &walk },
        source_rest: None,
        unread_target: false,
        config: Some(NamedBytes { name: "config.json", bytes: config.as_bytes() }),
        formats: &[Format::PosesJson],
    };
    engine::edit(&inputs, &Limits::default(), &Control::new())
}

fn found(scene: &Scene, clip: &Clip, cycles: u32) -> Option<(f64, f64)> {
    let cycle = find_cycles(clip, &scene.skeleton, cycles, &Control::new()).expect("not canceled")?;
    Some((cycle.seconds[1] - cycle.seconds[0], cycle.seam_degrees))
}

#[test]
fn a_walk_comes_back_after_both_feet() {
    let scene = samples::walk_scene();
    let clip = &scene.clips[0];
    for cycles in [1, 2, 3] {
        let (seconds, seam) = found(&scene, clip, cycles).expect("cycles");
        let wanted = WALK_CYCLE_SECONDS * f64::from(cycles);
        assert!((seconds - wanted).abs() < 0.04, "{cycles} cycles take {seconds} s");
        assert!(seam < 0.5, "{cycles} cycles: the ends differ by {seam} degrees");
    }
    assert_eq!(found(&scene, clip, 5), None, "there are not so many");
    let one_way = edited(&scene, clip, json!({"range": [0.0, 0.4]}));
    assert_eq!(found(&scene, &one_way, 1), None, "part of a step does not come back");
    let looped = edited(&scene, clip, json!({"range": {"cycles": 1}, "loop": {"times": 4, "blend_seconds": 0.1}}));
    assert!((looped.duration_seconds() - 4.0 * WALK_CYCLE_SECONDS).abs() < 0.1, "{} s", looped.duration_seconds());
}

#[test]
fn real_walks_have_cycles() {
    for (name, seconds) in [("bvh/cmu/12_01_walk.bvh", 0.9..1.5), ("mixamo/fbx/walking_noskin.fbx", 0.8..1.4)] {
        let Some(path) = corpus_file(name) else { continue };
        let scene = read(&path);
        let clip = scene.clips.iter().find(|clip| clip.is_animated()).expect("a clip");
        let clip = edited(&scene, clip, json!({"loop": {"times": 3, "blend_seconds": 0.0}}));
        let clip = if name.starts_with("mixamo") { &clip } else { &scene.clips[0] };
        let (cycle, seam) = found(&scene, clip, 1).unwrap_or_else(|| panic!("{name}: no cycle"));
        assert!(seconds.contains(&cycle), "{name}: a cycle of {cycle} s");
        assert!(seam < 6.0, "{name}: the ends differ by {seam} degrees");
    }
}

#[test]
fn what_was_found_is_told_and_what_was_not_is_refused() {
    let told = outcome(r#"{"edit": {"range": {"cycles": 2}}}"#).expect("an outcome");
    let warning = told.report.warnings.iter().find(|warning| warning.code == "cycles_found").expect("a warning");
    assert!(warning.detail.contains("2 cycles"), "{}", warning.detail);
    let refused = outcome(r#"{"edit": {"range": {"cycles": 50}}}"#).expect_err("there are not so many");
    assert_eq!(refused.errors[0].pointer, "/edit/range/cycles", "{refused:?}");
}

#[test]
fn a_filter_takes_off_what_is_fast_where_it_is_asked_to() {
    let poses = |config: &str| {
        let outcome = outcome(config).expect("an outcome");
        crate::quality::figure::read_scene(&outcome.outputs[0].bytes, "out.json")
    };
    let plain = poses("{}");
    let smooth = poses(r#"{"edit": {"filter": {"kind": "bell", "seconds": 0.2, "mask": ["left_leg"]}}}"#);
    let path = |scene: &Scene, name: &str| -> f32 {
        let joint = scene.skeleton.joints().iter().position(|joint| joint.name.ends_with(name)).expect("a joint");
        rotations(&scene.clips[0], joint).windows(2).map(|pair| pair[0].angle_between(pair[1])).sum()
    };
    assert!(path(&smooth, "LeftUpLeg") < 0.75 * path(&plain, "LeftUpLeg"), "the left leg swings less");
    assert_eq!(path(&smooth, "RightUpLeg"), path(&plain, "RightUpLeg"), "the right one as before");
    let error = outcome(r#"{"edit": {"filter": {"mask": ["left_wing"]}}}"#).expect_err("no wing");
    assert_eq!(error.errors[0].pointer, "/edit/filter/mask/0", "{error:?}");
    let off = poses(r#"{"edit": {"filter": {"enabled": false, "seconds": 0.5}}}"#);
    assert_eq!(path(&off, "LeftUpLeg"), path(&plain, "LeftUpLeg"), "switched off");
}

#[test]
fn edits_of_time_keep_their_cycles() {
    // Twice as fast, a cycle takes half as long; backward it takes as long.
    for (name, scene) in real_clips().into_iter().filter(|(name, _)| name.contains("12_01_walk")) {
        let clip = &scene.clips[0];
        let (own, _) = found(&scene, clip, 1).expect("a cycle");
        for (edit, wanted) in [(json!({"speed": 2.0}), own / 2.0), (json!({"reverse": true}), own)] {
            let (cycle, _) = found(&scene, &edited(&scene, clip, edit.clone()), 1).expect("a cycle");
            assert!((cycle - wanted).abs() < 0.1 * wanted, "{name}, {edit}: {cycle} s, {wanted} s expected");
        }
    }
}

#[test]
fn a_margin_is_looked_at_by_filters_and_cut_off() {
    let scene = |config: Value| {
        let outcome = outcome(&config.to_string()).expect("an outcome");
        crate::quality::figure::read_scene(&outcome.outputs[0].bytes, "out.json")
    };
    let filter = json!({"kind": "bell", "seconds": 0.1});
    let all = scene(json!({"edit": {"filter": filter}}));
    let apart = |range: Value| {
        let part = scene(json!({"edit": range}));
        let (part, all) = (&part.clips[0], &all.clips[0]);
        assert_eq!((part.frame_count(), part.times_seconds()[0]), (31, 0.0), "a second at 30 frames");
        let joints = part.joints().iter().zip(all.joints());
        let worst = joints.filter_map(|(part, all)| match (&part.rotation, &all.rotation) {
            (Track::Sampled(part), Track::Sampled(all)) => {
                let angles = part.iter().zip(&all[30..]).map(|(one, other)| one.angle_between(*other));
                Some(angles.fold(0.0, f32::max))
            }
            _ => None,
        });
        worst.fold(0.0, f32::max)
    };
    let with = apart(json!({"range": [1.0, 2.0], "margin_seconds": 0.5, "filter": filter}));
    let without = apart(json!({"range": [1.0, 2.0], "filter": filter}));
    assert!(with < 1e-3 && without > 10.0 * with, "{with} radians from the filtered clip, {without} without a margin");
    let on_a_grid = json!({"range": [1.0, 2.0], "margin_seconds": 0.53, "fps": 30, "filter": filter});
    assert!(apart(on_a_grid) < 1e-3, "frames stay on their grid");

    for (edit, name) in [
        (json!({"margin_seconds": 1.0, "filter": filter}), "range"),
        (json!({"margin_seconds": 1.0, "range": [1.0, 2.0]}), "filter"),
        (json!({"margin_seconds": 1.0, "range": [1.0, 2.0], "filter": filter, "every": 2}), "every"),
    ] {
        let failure = outcome(&json!({"edit": edit}).to_string()).expect_err("no margin");
        assert_eq!(failure.errors[0].pointer, "/edit/margin_seconds", "{failure:?}");
        assert!(failure.errors[0].detail.contains(name), "{failure:?}");
    }
}
