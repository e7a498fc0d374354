//! Arms that hang beside a trunk which is thicker than the source's.

use glam::DQuat;
use retargetd::{
    model::{Clip, Reporter, Scene},
    retarget::{Measures, MetricName, RetargetSpec, StackResult, resolve},
    samples,
};

use super::{
    figure::{Figure, degrees_between, measured, moved, moved_with, position, rig_of, rotation, value, world},
    lying::with_trunk,
};
use crate::support::corpus_file;

const WITHOUT: &str =
    r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}, {"op": "contacts"}, {"op": "ik"}, {"op": "plant"}, {"op": "floor"}]}"#;

fn without(source: &Scene, target: &Scene) -> (StackResult, Measures) {
    let (from, onto) = (rig_of("source", source), rig_of("target", target));
    let spec: RetargetSpec = serde_json::from_str(WITHOUT).expect("a spec");
    let result = moved_with(&from, &onto, &spec);
    let measures = measured(&from, &onto, &result);
    (result, measures)
}

fn by_default(source: &Scene, target: &Scene) -> (StackResult, Measures) {
    let (from, onto) = (rig_of("source", source), rig_of("target", target));
    let result = moved(&from, &onto);
    let measures = measured(&from, &onto, &result);
    (result, measures)
}

/// How an elbow is bent, radians, and how the hand is turned in the model.
fn elbow_and_hand(scene: &Scene, clip: &Clip, frame: usize, side: &str) -> (f64, DQuat) {
    let rig = rig_of("figure", scene);
    let pose = world(&scene.skeleton, Some((clip, frame)));
    let joint = |part: &str| rig.role(&format!("{side}_{part}"))[0];
    let [shoulder, elbow, wrist] = ["upper_arm", "forearm", "hand"].map(|part| position(&pose, joint(part)));
    ((elbow - shoulder).angle_between(wrist - elbow), rotation(&pose, joint("hand")))
}

#[test]
fn arms_hang_beside_a_thick_trunk_and_not_in_it() {
    let (source, target) = (samples::walk_scene(), with_trunk(2.0));
    let ((before, plain), (after, measures)) = (without(&source, &target), by_default(&source, &target));
    let [deep, clear] = [&plain, &measures].map(|measures| value(measures, MetricName::SelfPenetration));
    assert!(deep > 7.0 && clear < 5.0, "arms are {deep} cm in the trunk, and {clear} with the op");
    let [_, direction] = [&plain, &measures].map(|measures| value(measures, MetricName::LimbDirection));
    assert!(direction < 8.0, "what keeps an arm out of the body is no error: {direction} degrees");
    for frame in (0..after.clip.frame_count()).step_by(7) {
        for side in ["left", "right"] {
            let [old, new] = [&before, &after].map(|result| elbow_and_hand(&target, &result.clip, frame, side));
            assert!((old.0 - new.0).abs() < 1e-4, "frame {frame}, {side}: the elbow bends by {} and {}", old.0, new.0);
            let turned = degrees_between(old.1, new.1);
            assert!(turned < 0.05, "frame {frame}, {side}: the hand is turned by {turned} degrees");
        }
    }
}

#[test]
fn a_mask_names_an_arm_by_its_limb_or_by_its_hand() {
    let (source, target) = (samples::walk_scene(), with_trunk(2.0));
    let (from, onto) = (rig_of("source", &source), rig_of("target", &target));
    let swung = |mask: &str| {
        let stack = format!(r#"{{"ops": [{{"op": "pelvis"}}, {{"op": "fk"}}, {{"op": "arm_clearance"{mask}}}]}}"#);
        let result = moved_with(&from, &onto, &serde_json::from_str(&stack).expect("a spec"));
        ["left_upper_arm", "right_upper_arm"].map(|role| {
            let turned =
                |frame: usize| rotation(&world(&target.skeleton, Some((&result.clip, frame))), onto.role(role)[0]);
            (0..result.clip.frame_count()).map(turned).collect::<Vec<DQuat>>()
        })
    };
    let ([left, right], none) = (swung(""), swung(r#", "mask": []"#));
    assert!(left != none[0] && right != none[1], "both arms by default, none with an empty mask");
    for mask in [r#", "mask": ["left_arm"]"#, r#", "mask": ["left_hand"]"#] {
        assert_eq!(swung(mask), [left.clone(), none[1].clone()], "{mask}");
    }
}

#[test]
fn the_op_runs_where_arms_have_less_room() {
    let runs = |source: &Scene, target: &Scene| {
        let (from, onto, spec) = (rig_of("source", source), rig_of("target", target), RetargetSpec::default());
        let resolved = resolve(&spec, &from, &onto, &source.clips[0], &mut Reporter::new()).expect("it maps");
        resolved.spec.ops.expect("they are filled in").iter().any(|op| op.name() == "arm_clearance")
    };
    let walk = samples::walk_scene();
    assert!(runs(&walk, &with_trunk(2.0)), "a trunk twice as thick");
    assert!(!runs(&walk, &with_trunk(1.0)), "an ordinary one");
    assert!(!runs(&walk, &walk), "a figure onto itself");
}

/// A mouse with a belly, and a girl whose hips are as wide as her shoulders.
#[test]
fn arms_of_real_figures_are_out_of_their_bodies() {
    let Some(walk) = corpus_file("bvh/cmu/12_01_walk.bvh") else { return };
    let source = Figure::read(&walk);
    for file in ["mixamo/gltf/mousey_meshopt.glb", "vrm0/godette.vrm"] {
        let Some(target) = corpus_file(file) else { return };
        let target = Figure::read(&target);
        let [(_, plain), (_, measures)] =
            [without(&source.scene, &target.scene), by_default(&source.scene, &target.scene)];
        let [deep, clear] = [&plain, &measures].map(|measures| value(measures, MetricName::SelfPenetration));
        assert!(deep > 15.0 && clear < 7.0, "{file}: {deep} cm, and {clear} with the op");
    }
}
