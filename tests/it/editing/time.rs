//! Edits of time.

use glam::{DVec3, Quat, Vec3};
use retargetd::{
    editing::edit_time,
    model::{Clip, Control, Joint, JointTracks, Scene, Skeleton, Track, Transform},
    samples,
};
use serde_json::{Value, json};

use super::{edited, real_clips, rotations, spec, translations};

/// One joint that turns about X and goes along Z, at uneven key times from 1 s.
fn simple(times: &[f64], degrees: &[f32]) -> Scene {
    let turn = |degrees: &f32| Quat::from_rotation_x(degrees.to_radians());
    let tracks = JointTracks {
        translation: Track::Sampled(degrees.iter().map(|degrees| Vec3::new(0.0, 1.0, *degrees)).collect()),
        rotation: Track::Sampled(degrees.iter().map(turn).collect()),
        scale: Track::Rest,
    };
    let joint = Joint { name: "joint".into(), parent: None, rest: Transform::IDENTITY, is_joint: true, node: 0 };
    Scene {
        skeleton: Skeleton::new(vec![joint]).expect("a skeleton"),
        clips: vec![Clip::new("clip".into(), times.to_vec(), vec![tracks]).expect("a clip")],
        ..Scene::default()
    }
}

fn shown(clip: &Clip) -> Vec<(f64, f32)> {
    let places = translations(clip, 0);
    clip.times_seconds()
        .iter()
        .zip(places)
        .map(|(time, place)| ((time * 1e6).round() / 1e6, (place.z * 1e3).round() / 1e3))
        .collect()
}

#[test]
fn the_order_of_edits_is_documented_and_kept() {
    let scene = simple(&[1.0, 1.5, 2.0, 3.0], &[0.0, 10.0, 20.0, 60.0]);
    let clip = &scene.clips[0];
    let table: [(Value, &[(f64, f32)]); 9] = [
        (json!({"range": [1.5, 2.5]}), &[(0.0, 10.0), (0.5, 20.0), (1.0, 40.0)]),
        (json!({"range": {"frames": [1, 2]}}), &[(0.0, 10.0), (0.5, 20.0)]),
        (json!({"range": {"fraction": [0.0, 0.25]}}), &[(0.0, 0.0), (0.5, 10.0)]),
        (json!({"speed": 2.0}), &[(0.0, 0.0), (0.25, 10.0), (0.5, 20.0), (1.0, 60.0)]),
        (json!({"reverse": true, "start_seconds": 5.0}), &[(5.0, 60.0), (6.0, 20.0), (6.5, 10.0), (7.0, 0.0)]),
        (json!({"range": [1.0, 2.0], "reverse": true, "every": 2}), &[(0.0, 20.0), (1.0, 0.0)]),
        (json!({"range": [1.0, 2.0], "fps": 1.0}), &[(0.0, 0.0), (1.0, 20.0)]),
        (
            json!({"range": [1.0, 2.0], "warp": [[0.0, 0.0], [0.5, 2.0], [1.0, 3.0]]}),
            &[(0.0, 0.0), (2.0, 10.0), (3.0, 20.0)],
        ),
        (
            json!({"range": [1.0, 1.5], "ping_pong": true, "hold": {"after_seconds": 1.0}}),
            &[(0.0, 0.0), (0.5, 10.0), (1.0, 0.0), (2.0, 0.0)],
        ),
    ];
    for (edit, expected) in table {
        assert_eq!(shown(&edited(&scene, clip, edit.clone())), expected, "{edit}");
    }
}

#[test]
fn nothing_asked_for_changes_nothing() {
    let scene = simple(&[1.0, 1.5, 2.0, 3.0], &[0.0, 10.0, 20.0, 60.0]);
    assert_eq!(edited(&scene, &scene.clips[0], json!({})), scene.clips[0], "times stay where they were");
}

#[test]
fn reverse_twice_is_the_clip() {
    for (name, scene) in real_clips() {
        let clip = edited(&scene, &scene.clips[0], json!({"start_seconds": 0.0}));
        let back = edited(&scene, &edited(&scene, &clip, json!({"reverse": true})), json!({"reverse": true}));
        for (time, expected) in back.times_seconds().iter().zip(clip.times_seconds()) {
            assert!((time - expected).abs() < 1e-9, "{name}: times come back");
        }
        for joint in 0..clip.joints().len() {
            let (ours, expected) = (&back.joints()[joint], &clip.joints()[joint]);
            assert_eq!(ours.translation, expected.translation, "{name}: translations of joint {joint}");
            assert_eq!(ours.scale, expected.scale, "{name}: scales of joint {joint}");
            if let (Track::Sampled(ours), Track::Sampled(expected)) = (&ours.rotation, &expected.rotation) {
                // The whole track may be on the other hemisphere.
                assert!(
                    ours.iter().zip(expected).all(|(a, b)| a == b || *a == -*b),
                    "{name}: rotations of joint {joint}"
                );
            }
        }
    }
}

#[test]
fn up_and_down_again_meets_every_key() {
    for (name, scene) in real_clips() {
        let Some(fps) = scene.clips[0].uniform_fps() else { continue };
        let clip = edited(&scene, &scene.clips[0], json!({"fps": fps}));
        for interpolation in ["linear", "cubic"] {
            let up = edited(&scene, &clip, json!({"fps": fps * 2.0, "interpolation": interpolation}));
            assert_eq!(up.frame_count(), clip.frame_count() * 2 - 1, "{name}: one frame between any two");
            let down = edited(&scene, &up, json!({"every": 2}));
            assert_eq!(down.frame_count(), clip.frame_count(), "{name}: as many as before");
            for (joint, tracks) in clip.joints().iter().enumerate() {
                if let (Track::Sampled(ours), Track::Sampled(expected)) =
                    (&down.joints()[joint].rotation, &tracks.rotation)
                {
                    let worst = ours.iter().zip(expected).map(|(a, b)| a.dot(*b).abs()).fold(1.0, f32::min);
                    assert!(
                        worst > 1.0 - 1e-6,
                        "{name}, {interpolation}: rotations of joint {joint} at the keys: {worst}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_range_of_a_range_is_the_range() {
    let scene = samples::walk_scene();
    let once = edited(&scene, &scene.clips[0], json!({"range": [1.0, 2.0]}));
    let twice =
        edited(&scene, &edited(&scene, &scene.clips[0], json!({"range": [0.5, 3.0]})), json!({"range": [0.5, 1.5]}));
    assert_eq!(once.frame_count(), 31, "a second at 30 frames");
    for (ours, expected) in twice.times_seconds().iter().zip(once.times_seconds()) {
        assert!((ours - expected).abs() < 1e-9, "times: {ours} for {expected}");
    }
    assert_eq!(once.joints(), twice.joints(), "the same values");
}

#[test]
fn rotations_between_keys_turn_evenly_or_smoothly() {
    let scene = simple(&[0.0, 1.0, 2.0], &[0.0, 90.0, 90.0]);
    let degrees = |clip: &Clip, frame: usize| rotations(clip, 0)[frame].to_axis_angle().1.to_degrees();
    let linear = edited(&scene, &scene.clips[0], json!({"fps": 10.0}));
    for frame in 0..=10 {
        assert!((degrees(&linear, frame) - 9.0 * frame as f32).abs() < 1e-3, "frame {frame} of a straight turn");
    }
    let cubic = edited(&scene, &scene.clips[0], json!({"fps": 10.0, "interpolation": "cubic"}));
    let steps: Vec<f32> = (1..=20).map(|frame| degrees(&cubic, frame) - degrees(&cubic, frame - 1)).collect();
    assert!((degrees(&cubic, 10) - 90.0).abs() < 1e-3 && (degrees(&cubic, 20) - 90.0).abs() < 1e-3, "through the keys");
    let largest_change = steps.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max);
    assert!(
        largest_change < 4.0,
        "no corner: speeds differ by {largest_change}° from frame to frame, 9° on straight lines"
    );
}

#[test]
fn going_to_a_low_rate_averages() {
    // A tremor of a frame each way, about a steady way: what lies between the kept frames must not beat.
    let times: Vec<f64> = (0..=240).map(|frame| f64::from(frame) / 120.0).collect();
    let values: Vec<f32> =
        (0..=240).map(|frame| frame as f32 * 0.1 + if frame % 2 == 0 { 1.0 } else { -1.0 }).collect();
    let scene = simple(&times, &values);
    let low = edited(&scene, &scene.clips[0], json!({"fps": 10.0}));
    assert_eq!(low.frame_count(), 21, "two seconds");
    for (frame, place) in translations(&low, 0).iter().enumerate().take(20).skip(1) {
        let steady = frame as f32 * 1.2;
        assert!((place.z - steady).abs() < 0.2, "frame {frame}: {} for {steady}", place.z);
    }
}

#[test]
fn a_loop_has_no_seam_and_walks_on() {
    let scene = samples::walk_scene();
    let clip = edited(&scene, &scene.clips[0], json!({"range": [0.0, 1.3]}));
    let frames = clip.frame_count();
    let restart = edited(&scene, &clip, json!({"loop": {"blend_seconds": 0.3, "root": "restart"}}));
    assert_eq!(restart.frame_count(), frames, "once");
    for (joint, tracks) in restart.joints().iter().enumerate() {
        if let Track::Sampled(values) = &tracks.rotation {
            assert!(values[0].dot(values[frames - 1]).abs() > 1.0 - 1e-6, "joint {joint} ends as it began");
        }
        if let Track::Sampled(values) = &tracks.translation {
            assert!(values[0].distance(values[frames - 1]) < 1e-5, "joint {joint} ends where it began");
        }
    }
    let untouched = rotations(&restart, 0)[..frames / 2].to_vec();
    assert_eq!(untouched, rotations(&clip, 0)[..frames / 2], "what lies before the blend stays to the bit");

    let travel = edited(&scene, &clip, json!({"loop": {"times": 3, "blend_seconds": 0.3}}));
    assert_eq!(travel.frame_count(), (frames - 1) * 3 + 1, "three times, each seam once");
    let pelvis = scene.clips[0].joints().iter().position(|tracks| tracks.translation.is_animated()).expect("a pelvis");
    let (places, turns) = (translations(&travel, pelvis), rotations(&travel, pelvis));
    // Each pass goes on where and in the direction that the one before ended.
    let turn = heading(turns[frames - 1] * turns[0].conjugate());
    let way = places[frames - 1] - turn * places[0];
    assert!(way.z > 1.0, "it walks: {way}");
    let mut expected = places[0];
    for pass in 1..=3 {
        expected = turn * expected + Vec3::new(way.x, 0.0, way.z);
        let place = places[(frames - 1) * pass];
        assert!(place.distance(expected) < 1e-4, "pass {pass} ends at {place}, expected {expected}");
    }
}

/// The part of a rotation about the vertical.
fn heading(rotation: Quat) -> Quat {
    Quat::from_xyzw(0.0, rotation.y, 0.0, rotation.w).normalize()
}

#[test]
fn what_cannot_be_done_names_the_field() {
    let scene = simple(&[1.0, 1.5, 2.0, 3.0], &[0.0, 10.0, 20.0, 60.0]);
    let table = [
        (json!({"range": [4.0, 5.0]}), "/edit/range"),
        (json!({"range": [2.0, 1.0]}), "/edit/range"),
        (json!({"range": {"frames": [0, 4]}}), "/edit/range/frames/1"),
        (json!({"range": {"fraction": [0.0, 1.5]}}), "/edit/range/fraction/1"),
        (json!({"warp": [[0.0, 0.0], [1.0, -1.0]]}), "/edit/warp"),
        (json!({"warp": []}), "/edit/warp"),
        (json!({"speed": 0.0}), "/edit/speed"),
        (json!({"fps": 0.0}), "/edit/fps"),
        (json!({"every": 0}), "/edit/every"),
        (json!({"speed": 0.001, "loop": {"times": 1000}, "hold": {"after_seconds": 1e5}, "fps": 1000.0}), "/edit/fps"),
        (json!({"range": [1.0, 1.0], "loop": {}}), "/edit/loop"),
        (json!({"loop": {"times": 0}}), "/edit/loop/times"),
    ];
    for (edit, pointer) in table {
        let error = edit_time(&scene.clips[0], &scene.skeleton, DVec3::Y, &spec(edit.clone()), &Control::new())
            .expect_err(&format!("{edit} is refused"));
        let retargetd::editing::TimeEditError::Edit(error) = error else { panic!("{edit}: {error}") };
        assert_eq!(error.pointer, pointer, "{edit}: {error}");
        assert!(!error.hint.is_empty(), "{edit}: a hint");
    }
}

#[test]
fn frames_between_those_that_are_kept_show_nothing_of_the_dropped_ones() {
    let scene = simple(&[0.0, 1.0, 2.0, 3.0, 4.0], &[0.0, 30.0, 10.0, 50.0, 20.0]);
    let result = edited(&scene, &scene.clips[0], json!({"every": 2, "fps": 1.0}));
    assert_eq!(
        shown(&result),
        [(0.0, 0.0), (1.0, 5.0), (2.0, 10.0), (3.0, 15.0), (4.0, 20.0)],
        "between the frames that are kept"
    );
}
