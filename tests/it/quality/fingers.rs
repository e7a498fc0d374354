//! Hands of other numbers of fingers: a finger that stands for several moves as their mean.

use glam::DQuat;
use retargetd::{
    model::{Clip, JointTracks, Scene, Track},
    retarget::RetargetSpec,
    samples,
};

use super::{
    figure::{Figure, degrees_between, rotation, world},
    made_rigs::{MadeRig, retargeted},
};
use crate::support::corpus_file;

/// How far the source's fingers are curled at the knuckle, in degrees.
const CURLED: [(&str, f64); 4] = [("Index", 10.0), ("Middle", 40.0), ("Ring", 60.0), ("Pinky", 80.0)];

/// The walker at rest, but for its left fingers, each curled downward by its own angle.
fn curled(scene: &Scene) -> Clip {
    let model = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let tracks = scene.skeleton.joints().iter().map(|joint| {
        let curl = CURLED.iter().find(|(finger, _)| joint.name == format!("mixamorig:LeftHand{finger}1"));
        let parent = joint.parent.map_or(DQuat::IDENTITY, |parent| model.transforms()[parent].rotation);
        let turned = |degrees: f64| {
            let turn = DQuat::from_rotation_z(-degrees.to_radians());
            (parent.conjugate() * turn * parent * joint.rest.rotation).normalize().as_quat()
        };
        let rotation = curl.map_or(Track::Rest, |(_, degrees)| Track::Constant(turned(*degrees)));
        JointTracks { rotation, ..JointTracks::default() }
    });
    Clip::new("curled".into(), vec![0.0], tracks.collect()).expect("a clip")
}

/// A hand without some of its fingers.
fn without(fingers: &[&str]) -> Scene {
    let is_gone = |name: &str| fingers.iter().any(|finger| name.starts_with(finger));
    MadeRig::of(&samples::mannequin_scene()).without(is_gone).scene(|_| false)
}

/// By how many degrees a joint is turned from the aligned rest pose.
fn turned(target: &Scene, spec: &RetargetSpec, joint: &str) -> f64 {
    let source = samples::walk_scene();
    let (result, resolved, _) = retargeted(spec, &source, &curled(&source), target).expect("a retarget");
    let joint = target.skeleton.find(joint).expect("the joint");
    let found = rotation(&world(&target.skeleton, Some((&result, 0))), joint);
    degrees_between(found, resolved.mapping.target_rest.transforms()[joint].rotation)
}

#[test]
fn a_finger_that_stands_for_several_moves_as_their_mean() {
    let auto = RetargetSpec::default();
    let whole = samples::mannequin_scene();
    let three = without(&["ring", "pinky"]);
    let mitten = without(&["index", "ring", "pinky"]);
    for (target, joint, wanted) in [
        (&whole, "middle_01_l", 40.0),
        (&three, "index_01_l", 10.0),
        (&three, "middle_01_l", 60.0),
        (&mitten, "middle_01_l", 47.5),
    ] {
        let found = turned(target, &auto, joint);
        assert!((found - wanted).abs() < 1.0, "{joint}: {found:.2}°, not {wanted}°");
    }
}

#[test]
fn the_resolved_spec_says_which_fingers_count() {
    let target = without(&["ring", "pinky"]);
    let source = samples::walk_scene();
    let clip = curled(&source);
    let (result, resolved, _) = retargeted(&RetargetSpec::default(), &source, &clip, &target).expect("a retarget");
    let map = resolved.spec.map.clone().expect("a map");
    let entry = map.iter().find(|entry| entry.target == "left_middle").expect("the finger");
    assert_eq!(entry.also, ["left_pinky", "left_ring"], "what the target lacks");
    let (again, ..) = retargeted(&resolved.spec, &source, &clip, &target).expect("a retarget");
    assert_eq!(result.joints(), again.joints(), "the same again");
    let mut alone = resolved.spec;
    for entry in alone.map.iter_mut().flatten() {
        entry.also.clear();
    }
    let found = turned(&target, &alone, "middle_01_l");
    assert!((found - 40.0).abs() < 1.0, "the middle finger by itself: {found:.2}°");
}

#[test]
fn further_chains_that_there_are_not_are_named() {
    let source = samples::walk_scene();
    let target = samples::mannequin_scene();
    for (map, pointer) in [
        (serde_json::json!([{"source": "left_index", "target": "left_index", "also": ["left_indx"]}]), "/map/0/also/0"),
        (serde_json::json!([{"source": "left_arm", "target": "left_arm", "also": ["right_hand"]}]), "/map/0/also"),
    ] {
        let spec = serde_json::from_value(serde_json::json!({ "map": map })).expect("a spec");
        let error = retargeted(&spec, &source, &source.clips[0], &target).expect_err("no such chain");
        assert_eq!(error.fields[0].pointer, pointer, "where");
    }
}

/// Mousey has a thumb and three fingers.
#[test]
fn a_cartoon_hand_closes_as_a_whole() {
    let Some(path) = corpus_file("mixamo/gltf/mousey_meshopt.glb") else { return };
    let figure = Figure::read(&path);
    let source = samples::walk_scene();
    let (_, resolved, _) =
        retargeted(&RetargetSpec::default(), &source, &curled(&source), &figure.scene).expect("a retarget");
    let is_finger = |name: &str| CURLED.iter().any(|(finger, _)| name == format!("left_{}", finger.to_lowercase()));
    let fingers: Vec<_> = resolved.mapping.chains.iter().filter(|chain| is_finger(&chain.name)).collect();
    assert_eq!(fingers.len(), 3, "beside the thumb");
    let drives: usize = fingers.iter().map(|chain| 1 + chain.also.len()).sum();
    assert_eq!(drives, 4, "every finger of the source moves one of the target's");
}
