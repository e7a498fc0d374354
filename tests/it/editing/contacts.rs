//! What a clip says beside its tracks goes along with every edit: contacts and the weights of morphs.

use retargetd::{
    editing::{Mirror, layered},
    model::{Clip, Control, JointContacts, MorphTrack, Reporter, Scene, Track},
    retarget::{LayerMode, MirrorPlane, RetargetSpec},
    rig::Rig,
    samples,
};
use serde_json::json;

use super::{
    edited,
    layers::{lay, layer},
};

/// The walk, whose left foot stands in every frame whose hundreds are even, and whose right one in the others.
fn walk() -> (Scene, usize, usize) {
    let scene = samples::walk_scene();
    let joint = |name: &str| {
        scene.skeleton.joints().iter().position(|joint| joint.name.ends_with(name)).expect("a foot of the sample")
    };
    let (left, right) = (joint("LeftFoot"), joint("RightFoot"));
    let clip = scene.clips[0].clone();
    let stands = |frame: usize| (frame / 10).is_multiple_of(2);
    let track = |joint, stands: &dyn Fn(usize) -> bool| JointContacts {
        joint,
        touches: (0..clip.frame_count()).map(stands).collect(),
    };
    let contacts = vec![track(left, &stands), track(right, &|frame| !stands(frame))];
    let clip = clip.clone().with_contacts(contacts).expect("as long as the clip");
    (Scene { clips: vec![clip], ..scene }, left, right)
}

fn of(clip: &Clip, joint: usize) -> &[bool] {
    let track = clip.contacts().iter().find(|track| track.joint == joint);
    &track.expect("contacts of the joint").touches
}

#[test]
fn contacts_go_along_with_time() {
    let (scene, left, _) = walk();
    let clip = &scene.clips[0];
    let own = of(clip, left);
    let backward = edited(&scene, clip, json!({"reverse": true}));
    let reversed: Vec<bool> = own.iter().rev().copied().collect();
    assert_eq!(of(&backward, left), reversed, "backward");
    let range = edited(&scene, clip, json!({"range": {"frames": [7, 33]}}));
    assert_eq!(of(&range, left), &own[7..=33], "a range");
    let twice = edited(&scene, &range, json!({"loop": {"times": 2}}));
    assert_eq!(of(&twice, left)[..27], own[7..=33], "the first pass");
    assert_eq!(of(&twice, left)[27..], own[8..=33], "the second pass, without the frame that both share");
    let fps = clip.uniform_fps().expect("an even clip");
    let up = edited(&scene, clip, json!({"fps": fps * 2.0}));
    let every_other: Vec<bool> = of(&up, left).iter().step_by(2).copied().collect();
    assert_eq!(every_other, own, "at twice the rate, every other frame is a key");
    let down = edited(&scene, clip, json!({"fps": fps / 5.0}));
    assert_eq!(of(&down, left)[1..6], [true, false, false, true, true], "what holds for most of a frame");
    let held = edited(&scene, clip, json!({"hold": {"before_seconds": 1.0}}));
    assert_eq!(of(&held, left)[..2], [own[0], own[0]], "who stands still stands");
}

#[test]
fn contacts_change_sides() {
    let (scene, left, right) = walk();
    let clip = &scene.clips[0];
    let rig = Rig::new("source", &scene, None, &RetargetSpec::default().source, &mut Reporter::new()).expect("a rig");
    let image = Mirror::new(&rig, &[]).apply(clip, MirrorPlane::Rest).expect("a clip");
    assert_eq!((of(&image, left), of(&image, right)), (of(clip, right), of(clip, left)), "the other foot stands");
}

#[test]
fn contacts_are_those_of_the_motion_where_it_takes_over() {
    let (scene, left, right) = walk();
    let base = &scene.clips[0];
    let still = edited(&scene, base, json!({"range": {"frames": [0, 40]}}));
    let never = vec![JointContacts { joint: left, touches: vec![false; 41] }];
    let motion = still.with_contacts(never).expect("as long as the clip");
    let mut over = layer(&scene, LayerMode::Replace, 1.0);
    over.at_seconds = Some(1.0);
    over.weights[right] = 0.2;
    let laid = lay(&scene, base, &motion, &over);
    let inside = |frame: usize| (30..=70).contains(&frame);
    for frame in 0..base.frame_count() {
        assert_eq!(of(&laid, left)[frame], !inside(frame) && of(base, left)[frame], "left, frame {frame}");
        assert_eq!(of(&laid, right)[frame], of(base, right)[frame], "right counts for too little, frame {frame}");
    }
}

#[test]
fn weights_of_morphs_are_mixed_and_added() {
    let (mut scene, ..) = walk();
    scene.morphs =
        vec![retargetd::model::Morph { name: "smile".into(), rest: 0.1, place: retargetd::model::MorphPlace::Weight }];
    let with = |weights: Track<f32>| {
        scene.clips[0].clone().with_morphs(vec![MorphTrack { morph: 0, weights }]).expect("as long as the clip")
    };
    let frames = scene.clips[0].frame_count();
    let (base, motion) =
        (with(Track::Constant(0.2)), with(Track::Sampled((0..frames).map(|f| f as f32 * 1e-3).collect())));
    let weight = |clip: &Clip, frame: usize| clip.morphs()[0].weights.at(frame, f32::NAN);
    let mixed = lay(&scene, &base, &motion, &layer(&scene, LayerMode::Replace, 0.25));
    assert!((weight(&mixed, 40) - (0.75 * 0.2 + 0.25 * 0.04)).abs() < 1e-6, "{}", weight(&mixed, 40));
    let added = lay(&scene, &base, &motion, &layer(&scene, LayerMode::Add, 0.5));
    assert!((weight(&added, 40) - (0.2 + 0.5 * 0.04)).abs() < 1e-6, "{}", weight(&added, 40));
    let bare = scene.clips[0].clone();
    let onto_rest = layered(&bare, &motion, &scene.skeleton, &layer(&scene, LayerMode::Replace, 0.5), &Control::new());
    let onto_rest = onto_rest.expect("a clip");
    assert!((weight(&onto_rest, 40) - (0.5 * 0.1 + 0.5 * 0.04)).abs() < 1e-6, "mixed with the weight at rest");
}

#[test]
fn shapes_and_curves_change_sides() {
    let mut scene = samples::walk_scene();
    let names = ["eyeBlinkLeft", "eyeBlinkRight", "jawOpen", "lock_foot_l", "lock_foot_r"];
    let place = retargetd::model::MorphPlace::Weight;
    scene.morphs = names
        .iter()
        .map(|name| retargetd::model::Morph { name: (*name).into(), rest: 0.0, place: place.clone() })
        .collect();
    let tracks = [0, 2, 3].map(|morph| MorphTrack { morph, weights: Track::Constant(0.25 * (morph + 1) as f32) });
    let clip = scene.clips[0].clone().with_morphs(tracks.to_vec()).expect("a clip");
    let spec = RetargetSpec::default();
    let rig = Rig::new("source", &scene, None, &spec.source, &mut Reporter::new()).expect("a rig");
    let image = Mirror::new(&rig, &[]).apply(&clip, MirrorPlane::Rest).expect("a clip");
    let mut weights: Vec<(&str, f32)> = image
        .morphs()
        .iter()
        .map(|track| (names[track.morph], track.weights.at(0, f32::NAN)))
        .filter(|(_, weight)| *weight != 0.0)
        .collect();
    weights.sort_by_key(|(name, _)| *name);
    assert_eq!(weights, [("eyeBlinkRight", 0.25), ("jawOpen", 0.75), ("lock_foot_r", 1.0)]);
}
