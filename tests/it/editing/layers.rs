//! One clip over another: weights, masks, additive clips, seams.

use glam::Quat;
use retargetd::{
    editing::{Layer, branch_weights, layered, taken_out},
    engine::{self, Inputs, Limits, NamedBytes},
    model::{Clip, Control, Reporter, Scene, Track},
    retarget::{LayerMode, LayerReference, RetargetSpec},
    rig::{Rig, named_joints},
    samples,
};
use serde_json::{Value, json};

use super::{edited, real_clips, rotations};

pub(super) fn layer(scene: &Scene, mode: LayerMode, weight: f64) -> Layer {
    let weights = vec![weight; scene.skeleton.len()];
    Layer {
        mode,
        reference: LayerReference::FirstFrame,
        weights,
        morph_weight: weight,
        morph_rests: scene.morphs.iter().map(|morph| morph.rest).collect(),
        at_seconds: None,
        seam_seconds: 0.3,
    }
}

pub(super) fn lay(scene: &Scene, base: &Clip, motion: &Clip, layer: &Layer) -> Clip {
    layered(base, motion, &scene.skeleton, layer, &Control::new()).expect("a clip")
}

/// The largest angle between rotations of two clips of the same frames, over all joints, and the largest distance of translations.
fn differences(scene: &Scene, one: &Clip, other: &Clip) -> (f32, f32) {
    assert_eq!(one.frame_count(), other.frame_count(), "frames");
    let (mut angle, mut distance) = (0.0_f32, 0.0_f32);
    for (index, joint) in scene.skeleton.joints().iter().enumerate() {
        let (turn, place) = (joint.rest.rotation.as_quat(), joint.rest.translation.as_vec3());
        for frame in 0..one.frame_count() {
            let (first, second) = (&one.joints()[index], &other.joints()[index]);
            let between = first.rotation.at(frame, turn).dot(second.rotation.at(frame, turn)).abs();
            angle = angle.max(2.0 * between.min(1.0).acos());
            let way = first.translation.at(frame, place) - second.translation.at(frame, place);
            distance = distance.max(way.length());
        }
    }
    (angle, distance)
}

fn assert_same(scene: &Scene, one: &Clip, other: &Clip, what: &str) {
    let (angle, distance) = differences(scene, one, other);
    let size = scene.skeleton.joints().iter().map(|joint| joint.rest.translation.length()).fold(0.0, f64::max) as f32;
    // An f32 cosine tells angles below a thousandth of a radian apart no longer.
    assert!(angle < 2e-3 && distance <= 1e-4 * size.max(1.0), "{what}: {angle} rad, {distance}");
}

/// A clip to lay over another: the same motion from its middle on, backward.
fn other_motion(scene: &Scene, clip: &Clip) -> Clip {
    let half = clip.duration_seconds() / 2.0;
    let start = clip.times_seconds()[0];
    edited(scene, clip, json!({"range": [start + half, start + 2.0 * half], "reverse": true}))
}

#[test]
fn a_mix_of_none_is_the_base_and_of_all_the_motion() {
    let mut scenes = vec![("the walk", samples::walk_scene())];
    scenes.extend(real_clips());
    for (name, scene) in &scenes {
        let base = scene.clips.iter().find(|clip| clip.is_animated()).expect("a clip");
        let motion = other_motion(scene, base);
        let shown = base.times_seconds()[0] + motion.duration_seconds();
        let none = lay(scene, base, &motion, &layer(scene, LayerMode::Replace, 0.0));
        let at_motion = edited(scene, base, json!({"range": [base.times_seconds()[0], shown]}));
        if at_motion.frame_count() == none.frame_count() && base.uniform_fps().is_some() {
            assert_same(scene, &none, &at_motion, &format!("{name}: no weight"));
        }
        let all = lay(scene, base, &motion, &layer(scene, LayerMode::Replace, 1.0));
        assert_same(scene, &all, &motion, &format!("{name}: all of it"));
        let itself = lay(scene, base, base, &layer(scene, LayerMode::Replace, 0.4));
        assert_same(scene, &itself, base, &format!("{name}: mixed with itself"));
    }
}

#[test]
fn what_is_taken_out_and_added_again_is_the_motion() {
    for (name, scene) in real_clips().into_iter().chain([("the walk", samples::walk_scene())]) {
        let motion = scene.clips.iter().find(|clip| clip.is_animated()).expect("a clip");
        let first = edited(&scene, motion, json!({"range": {"frames": [0, 0]}}));
        let whole = layer(&scene, LayerMode::Add, 1.0);
        assert_same(&scene, &lay(&scene, &first, motion, &whole), motion, &format!("{name}: onto its first frame"));
        for reference in [LayerReference::FirstFrame, LayerReference::Mean, LayerReference::Rest] {
            let difference = taken_out(motion, &scene.skeleton, whole.morph_rests.clone(), reference).expect("a clip");
            let direct = lay(&scene, &first, motion, &Layer { reference, ..whole.clone() });
            let on_rest = Layer { reference: LayerReference::Rest, ..whole.clone() };
            let in_steps = lay(&scene, &first, &difference, &on_rest);
            assert_same(&scene, &in_steps, &direct, &format!("{name}: {reference:?}"));
        }
    }
}

#[test]
fn nothing_added_changes_nothing() {
    let scene = samples::walk_scene();
    let base = &scene.clips[0];
    let still = edited(&scene, base, json!({"range": {"frames": [5, 5]}, "hold": {"after_seconds": 1.0}, "fps": 30}));
    let added = lay(&scene, base, &still, &layer(&scene, LayerMode::Add, 1.0));
    let at_its_times = edited(&scene, base, json!({"range": [0.0, 1.0], "fps": 30}));
    assert_same(&scene, &added, &at_its_times, "a still motion has no change to add");
}

#[test]
fn a_mask_names_branches_and_feathers_them() {
    let scene = samples::walk_scene();
    let spec = RetargetSpec::default();
    let rig = Rig::new("target", &scene, None, &spec.target, &mut Reporter::new()).expect("a rig");
    let joints = named_joints(&rig, &spec.target, &["spine".into(), "left_leg".into()], "/layer/mask").expect("known");
    let weights = branch_weights(&scene.skeleton, &joints, 2, 1.0);
    let weight = |role: &str| weights[rig.role(role)[0]];
    assert_eq!((weight("pelvis"), weight("right_thigh")), (0.0, 0.0), "what is not named");
    assert!((weight("spine") - 1.0 / 3.0).abs() < 1e-12, "the first joint of a branch");
    assert!((weight("head") - 1.0).abs() < 1e-12 && (weight("left_hand") - 1.0).abs() < 1e-12, "all below");
    let error = named_joints(&rig, &spec.target, &["left_arn".into()], "/layer/mask").expect_err("no such limb");
    assert_eq!(error.fields[0].pointer, "/layer/mask/0");
    assert!(error.fields[0].did_you_mean.iter().any(|name| name == "left_arm"), "{:?}", error.fields[0]);
}

#[test]
fn seams_do_not_jump() {
    let scene = samples::walk_scene();
    let base = &scene.clips[0];
    let motion = other_motion(&scene, base);
    let motion = edited(&scene, &motion, json!({"range": [0.0, 0.8]}));
    let over = Layer { at_seconds: Some(0.5), ..layer(&scene, LayerMode::Replace, 1.0) };
    let laid = lay(&scene, base, &motion, &over);
    assert_eq!(laid.times_seconds(), base.times_seconds(), "the base's clock");
    let hard = lay(&scene, base, &motion, &Layer { seam_seconds: 0.0, ..over });
    let joint = scene.skeleton.joints().iter().position(|joint| joint.name.ends_with("LeftUpLeg")).expect("a thigh");
    // How much the step from frame to frame changes.
    let jerk = |clip: &Clip| {
        let values = rotations(clip, joint);
        let step = |pair: &[Quat]| (pair[1] * pair[0].conjugate()).to_scaled_axis();
        let steps: Vec<_> = values.windows(2).map(step).collect();
        steps.windows(2).map(|pair| (pair[1] - pair[0]).length()).fold(0.0, f32::max)
    };
    let (soft, hard, own) = (jerk(&laid), jerk(&hard), jerk(base).max(jerk(&motion)));
    assert!(hard > 5.0 * own, "without a seam it jumps: {hard}, the clips themselves {own}");
    assert!(soft < 3.0 * own, "with one it does not: {soft}, the clips themselves {own}");
    let values = rotations(&laid, joint);
    assert_eq!(values[..10], rotations(base, joint)[..10], "before the motion nothing changes");
    assert!(values.windows(2).all(|pair| pair[0].dot(pair[1]) >= 0.0), "no flip of sign");
}

fn retarget(source: &[u8], target: &[u8], config: &Value) -> Result<engine::Outcome, engine::Failure> {
    let config = config.to_string();
    let inputs = Inputs {
        source: NamedBytes { name: "source.glb", bytes: source },
        target: NamedBytes { name: "target.glb", bytes: target },
        source_rest: None,
        target_rest: None,
        config: Some(NamedBytes { name: "config.json", bytes: config.as_bytes() }),
        formats: &[],
    };
    engine::retarget(&inputs, &Limits::default(), &Control::new())
}

#[test]
fn a_retarget_onto_one_arm_keeps_the_targets_own_clip_elsewhere() {
    // The mannequin with a clip of its own: the walk, mirrored.
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    let own = retarget(&walk, &mannequin, &json!({"edit": {"mirror": true}})).expect("an animated mannequin");
    let target = &own.outputs[0].bytes;
    let layer = json!({"mask": ["left_arm"], "feather_joints": 1});
    let output = json!({"output": {"target_clips": "drop"}, "layer": layer});
    let outcome = retarget(&walk, target, &output).expect("an outcome");
    let plain = retarget(&walk, target, &json!({"output": {"target_clips": "drop"}})).expect("an outcome");
    let read = |bytes: &[u8]| crate::quality::figure::read_scene(bytes, "out.glb");
    let (laid, below, alone) = (read(&outcome.outputs[0].bytes), read(target), read(&plain.outputs[0].bytes));
    let of = |scene: &Scene, name: &str| -> Vec<Quat> {
        let joint = scene.skeleton.joints().iter().position(|joint| joint.name == name).expect("a joint");
        match &scene.clips[0].joints()[joint].rotation {
            Track::Sampled(values) => values.clone(),
            track => vec![track.at(0, Quat::IDENTITY); scene.clips[0].frame_count()],
        }
    };
    let off = |one: &[Quat], other: &[Quat]| {
        let angle = |(one, other): (&Quat, &Quat)| one.dot(*other).abs().min(1.0).acos();
        one.iter().zip(other).map(angle).fold(0.0, f32::max)
    };
    for name in ["thigh_l", "thigh_r", "upperarm_r", "spine_02"] {
        assert!(off(&of(&laid, name), &of(&below, name)) < 2e-3, "{name} is the target's own");
    }
    for name in ["lowerarm_l", "hand_l"] {
        assert!(off(&of(&laid, name), &of(&alone, name)) < 2e-3, "{name} is retargeted");
    }
    assert!(off(&of(&below, "lowerarm_l"), &of(&alone, "lowerarm_l")) > 0.1, "the two differ there");

    let refused = retarget(&walk, &mannequin, &json!({"layer": {}})).expect_err("it has no clip");
    assert_eq!(refused.errors[0].pointer, "/layer", "{refused:?}");
    let outside = json!({"layer": {"at_seconds": 1000.0}});
    assert_eq!(retarget(&walk, target, &outside).expect_err("too late").errors[0].pointer, "/layer/at_seconds");
    let nobody = json!({"layer": {"over": "jump"}});
    assert_eq!(retarget(&walk, target, &nobody).expect_err("no such clip").errors[0].pointer, "/layer/over");
}
