//! Hands that lie on the floor lie on it on other figures, too, and no hand is in it.

use std::f64::consts::PI;

use glam::{DQuat, DVec3, Vec3};
use retargetd::{
    model::{Clip, Scene, Skeleton},
    retarget::{Measures, MetricName, RetargetSpec, StackResult, Verdict},
    samples,
};

use super::{
    figure::{
        measured, moved, moved_with, position, read_scene, rig_of, rotation, rotations, value, with_roots_moved, world,
    },
    made_rigs::clip_of,
};
use crate::quality::figure::{degrees_between, with_clip};

const WITHOUT: &str = r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}, {"op": "contacts"}, {"op": "ik"}, {"op": "plant"},
    {"op": "floor", "hands": false}]}"#;
/// Arms of the source, times the mannequin's: those reach the floor.
const ARMS: f32 = 1.5;
/// The frame in which the body is bent down.
const DOWN: usize = 50;

/// The mannequin with arms so many times as long.
fn mannequin(arms: f32) -> Scene {
    let mut scene = read_scene(&samples::mannequin(), "mannequin.glb");
    let joints = scene.skeleton.joints().iter().map(|joint| {
        let mut joint = joint.clone();
        if joint.name.starts_with("lowerarm_") || joint.name.starts_with("hand_") {
            joint.rest.translation *= f64::from(arms);
        }
        joint
    });
    scene.skeleton = Skeleton::new(joints.collect()).expect("the same joints");
    scene
}

/// Height of the lowest vertex of a hand and its fingers at a frame.
fn lowest(scene: &Scene, clip: &Clip, frame: usize, side: &str) -> f64 {
    let pose = world(&scene.skeleton, Some((clip, frame)));
    let hand = rig_of("figure", scene).role(&format!("{side}_hand"))[0];
    let joints = (0..scene.skeleton.len()).filter(|joint| scene.skeleton.is_ancestor_or_self(hand, *joint));
    let heights = joints.flat_map(|joint| {
        let heights = scene.skin_points.of(joint).iter().filter(|point| point.weight > 0.5);
        let (pose, joint) = (&pose, joint);
        heights.map(move |point| pose[joint].transform_point3(point.position.as_dvec3()).y).collect::<Vec<f64>>()
    });
    heights.fold(f64::INFINITY, f64::min)
}

/// A body that bends down from the waist within a second, by so many radians, and stays there, forearms a little ahead of arms that hang down.
fn bending(bend: f64) -> Scene {
    let mut scene = mannequin(ARMS);
    let rest = world(&scene.skeleton, None);
    let joint = |name: &str| scene.skeleton.find(name).expect("a joint");
    let arm = |side: &str| {
        let [shoulder, wrist] = ["upperarm", "hand"].map(|part| position(&rest, joint(&format!("{part}_{side}"))));
        DQuat::from_rotation_arc((wrist - shoulder).normalize(), -DVec3::Y)
    };
    let elbow = |side: &str| arm(side).conjugate() * DQuat::from_rotation_x(-0.8) * arm(side);
    let clip = clip_of(&scene, 60, |name, frame| {
        let share = (frame as f64 / 30.0).min(1.0);
        let trunk = DQuat::from_rotation_x(bend * (1.0 - (share * PI).cos()) / 2.0);
        let turn = match name {
            "spine_01" => trunk,
            "upperarm_l" => trunk.conjugate() * arm("l"),
            "upperarm_r" => trunk.conjugate() * arm("r"),
            "lowerarm_l" => elbow("l"),
            "lowerarm_r" => elbow("r"),
            _ => return None,
        };
        let own = rotation(&rest, joint(name));
        Some(own.conjugate() * turn * own)
    });
    scene.clips = vec![clip];
    scene
}

/// A body that bends down until its hands are on the floor.
fn touching() -> Scene {
    let (mut from, mut to) = (1.0, 2.6);
    for _ in 0..30 {
        let middle = (from + to) / 2.0;
        let scene = bending(middle);
        *(if lowest(&scene, &scene.clips[0], DOWN, "left") > 0.0 { &mut from } else { &mut to }) = middle;
    }
    let scene = bending(from);
    assert!(lowest(&scene, &scene.clips[0], DOWN, "left").abs() < 1e-3, "the source's hands are on the floor");
    scene
}

fn without_hands(source: &Scene, target: &Scene) -> StackResult {
    let spec: RetargetSpec = serde_json::from_str(WITHOUT).expect("a spec");
    moved_with(&rig_of("source", source), &rig_of("target", target), &spec)
}

fn with_hands(source: &Scene, target: &Scene) -> StackResult {
    moved(&rig_of("source", source), &rig_of("target", target))
}

fn report(source: &Scene, target: &Scene, result: &StackResult) -> Measures {
    measured(&rig_of("source", source), &rig_of("target", target), result)
}

#[test]
fn hands_lie_on_the_floor_where_the_sources_do() {
    let source = touching();
    for arms in [1.8, 1.65, 1.35] {
        let target = mannequin(arms);
        let result = with_hands(&source, &target);
        for side in ["left", "right"] {
            let before = lowest(&target, &without_hands(&source, &target).clip, DOWN, side);
            let after = lowest(&target, &result.clip, DOWN, side);
            assert!(before.abs() > 0.03, "arms of {arms}: the {side} hand would be {before} m over the floor");
            assert!(
                after.abs() < 0.006,
                "arms of {arms}: the {side} hand is {after} m over the floor, {before} before"
            );
        }
        let measures = report(&source, &target, &result);
        let [deep, jumps, pops, direction] =
            [MetricName::BodyPenetration, MetricName::RotationJumps, MetricName::ElbowPop, MetricName::LimbDirection]
                .map(|name| value(&measures, name));
        assert!(deep < 0.6 && jumps == 0.0 && pops < 5.0, "arms of {arms}: {deep} cm, {jumps} jumps, {pops} at elbows");
        let float = value(&measures, MetricName::HandFloat);
        assert!(float < 1.0, "arms of {arms}: {float} cm off the floor");
        assert!(direction < 20.0, "arms that are kept out of the floor point where they have to: {direction}");
    }
}

/// How high a hand is over the floor where the body is bent down, in centimeters at a leg of 1 m, and what the report says of it.
fn told(arms: f32) -> (f64, Measures) {
    let (source, target) = (touching(), mannequin(arms));
    let result = without_hands(&source, &target);
    let rig = rig_of("target", &target);
    let pose = world(&target.skeleton, None);
    let [hip, knee, ankle] = ["left_thigh", "left_shin", "left_foot"].map(|role| position(&pose, rig.role(role)[0]));
    let leg = hip.distance(knee) + knee.distance(ankle);
    (lowest(&target, &result.clip, DOWN, "left") / leg * 100.0, report(&source, &target, &result))
}

#[test]
fn hands_in_the_floor_are_told_as_deep_as_they_are() {
    let (height, measures) = told(1.8);
    let metric = &measures.metrics[&MetricName::BodyPenetration];
    let told = metric.parts["left_hand"];
    assert!(height < -8.0 && (told + height).abs() < 0.1, "{told} is told where {height} is seen: {metric:?}");
    assert_eq!(metric.verdict, Verdict::Fail);
    assert!(metric.worst.iter().any(|worst| worst.joint == "hand_l"), "{:?}", metric.worst);
}

#[test]
fn hands_off_the_floor_are_told_as_high_as_they_are() {
    let (height, measures) = told(1.2);
    let told = measures.metrics[&MetricName::HandFloat].parts["left_hand"];
    assert!(height > 8.0 && (told - height).abs() < 0.1, "{told} is told where {height} is seen");
    let (source, target) = (samples::walk_scene(), mannequin(1.0));
    let measures = report(&source, &target, &with_hands(&source, &target));
    assert_eq!(measures.metrics[&MetricName::HandFloat].verdict, Verdict::NotApplicable, "of a walk");
    assert_eq!(value(&measures, MetricName::BodyPenetration), 0.0, "of a walk");
}

#[test]
fn hands_away_from_the_floor_and_a_figures_own_stay_as_they_are() {
    let source = samples::walk_scene();
    for arms in [1.0, 1.25] {
        let target = mannequin(arms);
        assert_eq!(with_hands(&source, &target).clip, without_hands(&source, &target).clip, "a walk, arms of {arms}");
    }
    let source = touching();
    let result = with_hands(&source, &mannequin(ARMS));
    for frame in 0..60 {
        let [own, moved] = [&source.clips[0], &result.clip].map(|clip| rotations(&source.skeleton, clip, frame));
        let apart = own.iter().zip(&moved).map(|(own, moved)| degrees_between(*own, *moved)).fold(0.0, f64::max);
        assert!(apart < 0.05, "frame {frame}: {apart} degrees");
    }
}

/// A clip may fall through the floor, or have its pelvis at the origin: arms do not fold for that.
#[test]
fn hands_of_a_figure_that_is_below_the_floor_are_left_alone() {
    let target = mannequin(1.25);
    let source = with_roots_moved(&samples::walk_scene(), |time| -Vec3::Y * (2.0 * time) as f32);
    assert_eq!(with_hands(&source, &target).clip, without_hands(&source, &target).clip);
}

/// A source of joints alone is as thick as bodies usually are; where that is in the floor, others are not put there.
#[test]
fn a_trunk_is_not_put_into_the_floor_for_a_source_without_a_mesh() {
    let mut source = with_clip(super::lying::lying(1.0), "lies");
    source.skin_points = retargetd::model::SkinPoints::default();
    source.skin_vertices = std::sync::Arc::default();
    let pelvis = rig_of("source", &source).role("pelvis")[0];
    let mut tracks = source.clips[0].joints().to_vec();
    if let retargetd::model::Track::Sampled(places) = &mut tracks[pelvis].translation {
        places.iter_mut().for_each(|place| *place -= Vec3::Y * 0.05);
    }
    let source = super::figure::with_tracks(&source, tracks);
    let target = super::lying::lying(1.0);
    let result = with_hands(&source, &target);
    let height = super::lying::lowest(&target, &result.clip, 15);
    assert!(height.abs() < 0.012, "the trunk is {height} m over the floor");
}
