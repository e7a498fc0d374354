//! Clips that are played over and over: where they begin again, nothing jumps.

use glam::{DVec3, Quat, Vec3};
use retargetd::{
    model::{Clip, Scene, Track},
    retarget::{Metric, MetricName, RetargetSpec, StackResult, Verdict},
    samples,
};

use crate::support::corpus_file;

use super::figure::{
    Figure, degrees_between, measured, moved, moved_with, position, rig_of, rotations, with_clip, with_roots_moved,
    world,
};

/// A cycle of the walk, on the spot: it begins in the middle of a step, and ends there.
fn cycle(frames: std::ops::RangeInclusive<usize>) -> Scene {
    let walk = with_roots_moved(&samples::walk_scene(), |time| -Vec3::Z * (samples::WALK_SPEED * time) as f32);
    cut(walk, frames)
}

fn cut(walk: Scene, frames: std::ops::RangeInclusive<usize>) -> Scene {
    let clip = walk.clips[0].section(*frames.start()..*frames.end() + 1);
    Scene { clips: vec![clip], ..walk }
}

/// The mannequin with arms and legs of other lengths, and feet that are longer.
fn mannequin() -> Scene {
    let mut scene = samples::mannequin_scene();
    let joints = scene.skeleton.joints().iter().map(|joint| {
        let factor = match joint.name.as_str() {
            "calf_l" | "calf_r" => 0.8,
            "ball_l" | "ball_r" => 1.8,
            "thigh_l" | "thigh_r" => 1.5,
            _ => 1.0,
        };
        let mut joint = joint.clone();
        joint.rest.translation *= factor;
        joint
    });
    scene.skeleton = retargetd::model::Skeleton::new(joints.collect()).expect("the same joints");
    scene
}

fn result(source: &Scene, target: &Scene) -> StackResult {
    moved(&rig_of("source", source), &rig_of("target", target))
}

fn seam(source: &Scene, target: &Scene, result: &StackResult) -> Metric {
    let mut measures = measured(&rig_of("source", source), &rig_of("target", target), result);
    measures.metrics.remove(&MetricName::LoopSeam).expect("it is told")
}

/// By how much any joint is turned otherwise at one frame than at another, degrees, and how far any is from there, seen from the first one.
fn apart(target: &Scene, clip: &Clip, [one, other]: [usize; 2]) -> (f64, f64) {
    let turns = [one, other].map(|frame| rotations(&target.skeleton, clip, frame));
    let worlds = [one, other].map(|frame| world(&target.skeleton, Some((clip, frame))));
    let pelvis = rig_of("target", target).role("pelvis")[0];
    let way = |pose: &[glam::DMat4]| position(pose, pelvis) * DVec3::new(1.0, 0.0, 1.0);
    let joints = (0..target.skeleton.len()).filter(|joint| target.skeleton.is_ancestor_or_self(pelvis, *joint));
    let turned = joints.clone().map(|joint| degrees_between(turns[0][joint], turns[1][joint])).fold(0.0, f64::max);
    let places = |joint: usize| worlds.each_ref().map(|pose| position(pose, joint) - way(pose));
    let moved = joints.map(|joint| places(joint)[0].distance(places(joint)[1])).fold(0.0, f64::max);
    (turned, moved)
}

#[test]
fn a_cycle_of_a_walk_ends_where_it_begins() {
    let target = mannequin();
    let walking = cut(samples::walk_scene(), 17..=77);
    for (source, what) in [(cycle(17..=77), "on the spot"), (walking, "that gets on")] {
        let own = apart(&source, &source.clips[0], [0, 60]);
        assert!(own.0 < 0.01, "the walk {what} is a cycle: {own:?}");
        let result = result(&source, &target);
        let (turned, moved) = apart(&target, &result.clip, [0, 60]);
        assert!(turned < 0.02 && moved < 1e-4, "the walk {what}: {turned} degrees and {moved} m apart");
        assert_eq!(result.clip.frame_count(), 61, "as long as the cycle");
        let metric = seam(&source, &target, &result);
        assert!(metric.value.is_some_and(|jump| jump < 0.02), "{what}: {metric:?}");
    }
}

/// Tools leave out the last frame of a cycle, since it is the first again.
#[test]
fn a_cycle_without_its_last_frame_goes_on_as_the_whole_one() {
    let target = mannequin();
    let (whole, cut) = (cycle(17..=77), cycle(17..=76));
    let result = |source: &Scene| result(source, &target);
    let [whole, cut] = [whole, cut].map(|source| result(&source));
    for frame in 0..60 {
        let turns = [&whole, &cut].map(|result| rotations(&target.skeleton, &result.clip, frame));
        let apart = turns[0].iter().zip(&turns[1]).map(|(one, other)| degrees_between(*one, *other));
        let apart = apart.fold(0.0, f64::max);
        assert!(apart < 0.5, "frame {frame}: {apart} degrees");
    }
}

/// Where a cycle is cut hardly matters: the level of the floor is found in all frames, of which the one at the cut is there twice.
#[test]
fn a_cycle_is_the_same_wherever_it_begins() {
    let target = mannequin();
    let [early, late] = [cycle(17..=77), cycle(32..=92)].map(|source| result(&source, &target));
    for frame in 0..=60 {
        let poses = [(&late, frame), (&early, (frame + 15) % 60)];
        let turns = poses.map(|(result, frame)| rotations(&target.skeleton, &result.clip, frame));
        let apart = turns[0].iter().zip(&turns[1]).map(|(one, other)| degrees_between(*one, *other));
        let apart = apart.fold(0.0, f64::max);
        assert!(apart < 1.0, "frame {frame}: {apart} degrees");
    }
}

#[test]
fn a_result_that_jumps_where_it_begins_again_fails() {
    let (source, target) = (cycle(17..=77), mannequin());
    let mut result = result(&source, &target);
    let knee = rig_of("target", &target).role("left_shin")[0];
    let mut joints = result.clip.joints().to_vec();
    let Track::Sampled(rotations) = &mut joints[knee].rotation else { panic!("the knee bends") };
    let frames = rotations.len();
    for (frame, rotation) in rotations.iter_mut().enumerate() {
        let share = (frame as f32 - (frames - 11) as f32).max(0.0) / 10.0;
        *rotation *= Quat::from_rotation_z(share * 0.3);
    }
    result.clip = result.clip.with_joints(joints).expect("a clip");
    let metric = seam(&source, &target, &result);
    assert_eq!(metric.verdict, Verdict::Fail, "{metric:?}");
    let worst = &metric.worst[0];
    assert!(worst.frame == 60 && worst.part.starts_with("left_"), "{worst:?}");
}

/// A source whose root carries the pelvis along, and a target whose root stays: nothing of it is seen.
#[test]
fn a_root_that_stays_does_not_jump() {
    let target = mannequin();
    let walked = result(&cut(samples::walk_scene(), 17..=77), &target);
    let (mut tracks, level) = (walked.clip.joints().to_vec(), Vec3::new(1.0, 0.0, 1.0));
    let pelvis = rig_of("target", &target).role("pelvis")[0];
    let root = target.skeleton.parent(pelvis).expect("a root");
    let Track::Sampled(places) = &mut tracks[pelvis].translation else { panic!("the pelvis moves") };
    let ways: Vec<Vec3> = places.iter().map(|place| *place * level).collect();
    places.iter_mut().zip(&ways).for_each(|(place, way)| *place -= *way);
    tracks[root].translation = Track::Sampled(ways);
    let source = Scene { clips: vec![walked.clip.with_joints(tracks).expect("a clip")], ..target.clone() };
    let moved = result(&source, &target);
    assert!(!moved.clip.joints()[root].translation.is_animated(), "the root stays");
    let metric = seam(&source, &target, &moved);
    assert!(metric.value.is_some_and(|jump| jump < 0.05), "{metric:?}");
}

#[test]
fn half_a_step_is_no_cycle() {
    let (source, target) = (cycle(17..=62), mannequin());
    let metric = seam(&source, &target, &result(&source, &target));
    assert_eq!((metric.verdict, metric.value), (Verdict::NotApplicable, None), "{metric:?}");
}

/// What is said of frames and seconds is said of the clip, whatever is played before it.
#[test]
fn frames_and_seconds_of_a_config_are_those_of_the_clip() {
    let (source, target) = (cycle(17..=77), mannequin());
    let times = source.clips[0].times_seconds();
    let contacts = |rule: serde_json::Value| {
        let mut op = serde_json::json!({"op": "contacts"});
        op.as_object_mut().expect("an op").extend(rule.as_object().expect("fields").clone());
        let ops = serde_json::json!({"ops": [{"op": "pelvis"}, {"op": "fk"}, op, {"op": "ik"}, {"op": "plant"}]});
        let spec: RetargetSpec = serde_json::from_value(ops).expect("a spec");
        moved_with(&rig_of("source", &source), &rig_of("target", &target), &spec).contacts
    };
    let set = contacts(serde_json::json!({"set": {"left_foot": [[times[10], times[25]]]}, "detect": false}));
    let heel = set.iter().find(|track| track.point == "left_foot").expect("it is set");
    assert_eq!(heel.seconds, [[times[10], times[25]]], "the contact is where it was set");
    let touching = |touches: &[bool]| (0..touches.len()).filter(|frame| touches[*frame]).collect::<Vec<usize>>();
    assert_eq!(touching(&heel.touches), (10..=25).collect::<Vec<_>>());
    let some = contacts(serde_json::json!({"frames": [10, 20]}));
    let frames: Vec<usize> = some.iter().flat_map(|track| touching(&track.touches)).collect();
    assert!(!frames.is_empty() && frames.iter().all(|frame| (10..=20).contains(frame)), "{frames:?}");
}

/// Steps of games, onto figures of other proportions: legs and pelvis come back in all of them.
#[test]
fn steps_of_games_come_back() {
    let clips = [
        ("cc0-stylised/robot_expressive.glb", "Walking"),
        ("cc0-stylised/kaykit_knight.glb", "Running_A"),
        ("mixamo/gltf/Soldier.glb", "Walk"),
        ("mixamo/gltf/Xbot.glb", "walk"),
        ("rigify-blender/gdquest_sophia.glb", "Run"),
        // A blow from a stance: both feet stand all the time, and turn about their heels and back about their balls.
        ("cc0-stylised/kaykit_knight.glb", "1H_Melee_Attack_Stab"),
    ];
    let targets = [
        "vrm0/catbot.vrm",
        "mixamo/gltf/Soldier.glb",
        "unreal/makehuman_game_engine_tpose.glb",
        "cc0-stylised/godot_robot.glb",
        "mixamo/gltf/mousey_meshopt.glb",
    ];
    for (file, name) in clips {
        let Some(file) = corpus_file(file) else { return };
        let source = with_clip(Figure::read(&file).scene, name);
        for target in targets {
            let Some(file) = corpus_file(target) else { return };
            let onto = Figure::read(&file).scene;
            let metric = seam(&source, &onto, &result(&source, &onto));
            let of_legs = metric
                .parts
                .iter()
                .filter(|(part, _)| ["pelvis", "thigh", "shin", "foot", "toe"].iter().any(|name| part.contains(name)));
            for (part, jump) in of_legs {
                assert!(*jump < 0.3, "{name} onto {target}: {part} jumps by {jump} cm");
            }
        }
    }
}
