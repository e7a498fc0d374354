//! Curves of the source's clip: alphas that follow them, contacts that they say.

use glam::DVec3;
use retargetd::model::{Morph, MorphPlace, MorphTrack, Track};

use super::stage::{KINEMATICS, Stage, degrees};

/// The walk with a curve beside its joints.
fn with_curve(name: &str, value: impl Fn(usize) -> f32) -> Stage {
    let mut stage = Stage::walk();
    stage.source.morphs = vec![Morph { name: name.to_owned(), rest: 0.0, place: MorphPlace::Expression(Vec::new()) }];
    let clip = stage.source.clips.remove(0);
    let weights = Track::Sampled((0..clip.frame_count()).map(value).collect());
    stage.source.clips = vec![clip.with_morphs(vec![MorphTrack { morph: 0, weights }]).expect("a curve")];
    stage
}

#[test]
fn an_op_is_as_strong_as_its_curve_says() {
    let stage = with_curve("look", |frame| if frame < 40 { 0.0 } else { 100.0 });
    let turn = r#"{"op": "additive_pose", "degrees": {"head": [0, 0, 20]}, "alpha": {"curve": "look", "gain": 0.005}}"#;
    let (plain, played) =
        (stage.play(KINEMATICS), stage.play(&format!(r#"{{"ops": [{{"op": "pelvis"}}, {{"op": "fk"}}, {turn}]}}"#)));
    let turned = |frame: usize| degrees(stage.turned(&plain, frame, "head"), stage.turned(&played, frame, "head"));
    assert!(turned(20) < 1e-3, "not where the curve is 0: {}", turned(20));
    assert!((turned(60) - 10.0).abs() < 0.01, "half of it where the curve is 100, times 0.005: {}", turned(60));
    let error = stage.try_play(&KINEMATICS.replace(r#""fk""#, r#""fk", "alpha": {"curve": "lok"}"#)).err();
    let field = error.expect("refused").fields.remove(0);
    assert_eq!((field.pointer.as_str(), &field.did_you_mean[..]), ("/ops/1/alpha/curve", &["look".to_owned()][..]));
}

#[test]
fn feet_are_planted_where_baked_speeds_are_low() {
    let walk = Stage::walk();
    let toe = walk.source_joint("mixamorig:LeftToeBase");
    let places: Vec<DVec3> = (0..121).map(|frame| walk.source_pose(frame).transforms()[toe].translation).collect();
    let times = walk.source.clips[0].times_seconds().to_vec();
    // Centimeters per second, as engines bake them.
    let speed = |frame: usize| {
        let (before, after) = (frame.saturating_sub(1), (frame + 1).min(120));
        (places[after].distance(places[before]) / (times[after] - times[before]) * 100.0) as f32
    };
    let stage = with_curve("toe_speed_l", speed);
    let played = stage.play(
        r#"{"ops": [{"op": "pelvis"}, {"op": "fk"},
            {"op": "contacts", "detect": false, "curves": {"left_toe": {"curve": "toe_speed_l", "below": 30}}},
            {"op": "ik"}, {"op": "plant", "mode": "always"}]}"#,
    );
    let ball = stage.target_joint("ball_l");
    let touches = &played.clip.contacts().iter().find(|track| track.joint == ball).expect("contacts").touches;
    let wanted: Vec<bool> = (0..121).map(|frame| speed(frame) < 30.0).collect();
    assert_eq!(*touches, wanted, "the curve alone says when it touches");
    assert!((20..100).contains(&wanted.iter().filter(|touches| **touches).count()), "it steps");
    let slide =
        |frame: &usize| stage.place(&played, frame + 1, "ball_l").distance(stage.place(&played, *frame, "ball_l"));
    // Where the foot has come to rest; the weight goes over from point to point at the ends of a contact.
    let held = (3..117).filter(|frame| wanted[frame - 3..frame + 4].iter().all(|touches| *touches));
    let worst = held.map(|frame| slide(&frame)).fold(0.0, f64::max);
    assert!(worst < 2e-3, "it stands where it is planted: {worst}");
}

#[test]
fn points_and_bounds_are_checked() {
    let stage = with_curve("speed", |_| 0.0);
    for (curves, pointer) in [
        (r#"{"left_toes": {"curve": "speed", "below": 1}}"#, "/ops/0/curves/left_toes"),
        (r#"{"left_toe": {"curve": "speed"}}"#, "/ops/0/curves/left_toe"),
        (r#"{"left_toe": {"curve": "sped", "below": 1}}"#, "/ops/0/curves/left_toe/curve"),
    ] {
        let error = stage.try_play(&format!(
            r#"{{"ops": [{{"op": "contacts", "curves": {curves}}}, {{"op": "pelvis"}}, {{"op": "fk"}}]}}"#
        ));
        assert_eq!(error.err().expect("refused").fields[0].pointer, pointer, "{curves}");
    }
}
