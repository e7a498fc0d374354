//! Hands that meet: claps made by code, whose contacts are known, and hands of real clips that are folded, crossed or held together, onto
//! figures with arms and shoulders of other proportions.

use retargetd::{
    model::{Clip, Scene},
    retarget::MetricName,
    samples,
};

use super::{
    figure::{Figure, measured, moved_with, position, rig_of, value, world},
    properties::retargeted,
    self_contact::{Body, Contact, MIXAMO, UNREAL, clip_of, gaps},
};
use crate::support::corpus_file;

const FEET: &str =
    r#"{"op": "pelvis"}, {"op": "fk"}, {"op": "contacts"}, {"op": "ik"}, {"op": "plant"}, {"op": "floor"}"#;

fn stack(more: &str) -> String {
    format!(r#"{{"ops": [{{"op": "pelvis"}}, {{"op": "fk"}}{more}]}}"#)
}

/// The largest distance of a joint of two results.
fn apart(scene: &Scene, name: &str, [one, other]: [&Clip; 2]) -> f64 {
    let joint = scene.skeleton.find(name).expect("a joint of that name");
    let place = |clip: &Clip, frame: usize| position(&world(&scene.skeleton, Some((clip, frame))), joint);
    (0..one.frame_count()).map(|frame| place(one, frame).distance(place(other, frame))).fold(0.0, f64::max)
}

#[test]
fn hands_that_clap_meet_on_other_bodies() {
    let source = Body::new(samples::walk_scene(), &MIXAMO, 1.0);
    let clip = clip_of(&source, Contact::Clap);
    for target in [Body::new(samples::walk_scene(), &MIXAMO, 1.0), Body::new(samples::mannequin_scene(), &UNREAL, 1.0)]
    {
        let result = |more: &str| retargeted(&stack(more), &source.scene, &clip, &target.scene);
        let worst = |result: &Clip| {
            let touch = gaps(&source, Contact::Clap, &clip).into_iter().zip(gaps(&target, Contact::Clap, result));
            touch.filter(|(own, _)| own.abs() < 0.005).map(|(_, gap)| gap.abs()).fold(0.0, f64::max)
        };
        let gap = worst(&result(r#", {"op": "hand_contact"}"#));
        assert!(gap < 0.01, "hands that touch are {gap} of the height apart, {} without", worst(&result("")));
    }
}

#[test]
fn a_mask_leaves_one_hand_where_it_is() {
    let source = Body::new(samples::walk_scene(), &MIXAMO, 1.0);
    let target = samples::mannequin_scene();
    let clip = clip_of(&source, Contact::Clap);
    let result = |more: &str| retargeted(&stack(more), &source.scene, &clip, &target);
    let plain = result("");
    let moved = |mask: &str| {
        let result = result(&format!(r#", {{"op": "hand_contact"{mask}}}"#));
        ["hand_l", "hand_r"].map(|hand| apart(&target, hand, [&plain, &result]))
    };
    let ([left, right], [only, kept]) = (moved(""), moved(r#", "mask": ["left_hand"]"#));
    assert!(left > 0.005 && (left - right).abs() < 1e-3, "each goes half of the way: {left} and {right} m");
    assert!(kept < 1e-9 && (only - left - right).abs() < 0.2 * only, "one goes all of it: {only} and {kept} m");
    assert_eq!(moved(r#", "mask": []"#), [0.0; 2], "none moves");
}

#[test]
fn hands_that_stay_apart_are_left_alone() {
    let (source, target) = (samples::walk_scene(), samples::mannequin_scene());
    let result = |more: &str| retargeted(&stack(more), &source, &source.clips[0], &target);
    assert_eq!(result(""), result(r#", {"op": "hand_contact"}"#), "a walk");
}

/// A dance with crossed arms and a bow with the hands before the lap, onto figures with other arms.
#[test]
fn hands_of_real_clips_meet_by_default() {
    for (file, onto) in [
        ("bvh/misc/momask_template_lafan_names.bvh", "mixamo/gltf/michelle_meshopt.glb"),
        ("bvh/bandai-namco/dataset-1_bow_active_001.bvh", "mixamo/gltf/joe_meshopt_9skins.glb"),
        ("bvh/misc/momask_template_lafan_names.bvh", "mixamo/gltf/Xbot.glb"),
    ] {
        let (Some(source), Some(target)) = (corpus_file(file), corpus_file(onto)) else { return };
        let (source, target) = (Figure::read(&source), Figure::read(&target));
        let (from, to) = (rig_of("source", &source.scene), rig_of("target", &target.scene));
        let gap = |spec: &str| {
            let result = moved_with(&from, &to, &serde_json::from_str(spec).expect("a spec"));
            value(&measured(&from, &to, &result), MetricName::HandGap)
        };
        let [without, by_default] = [gap(&format!(r#"{{"ops": [{FEET}]}}"#)), gap("{}")];
        assert!(
            without > 5.0 && by_default < 3.0,
            "{file} onto {onto}: {without} % without the op, {by_default} % by default"
        );
    }
}
