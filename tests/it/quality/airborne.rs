//! Jumps and falls: feet that are slow in the air stand on nothing, and feet that dangle through the floor draw nobody down.

use glam::Vec3;
use retargetd::{
    model::Scene,
    retarget::{MetricName, StackResult},
    samples,
};

use super::figure::{Figure, measured, moved, position, rig_of, with_clip, with_roots_moved, world};
use crate::support::corpus_file;

/// How high the lower ankle of the target is at the lowest, in meters.
fn lowest_ankle(target: &Scene, result: &StackResult) -> f64 {
    let feet = ["left_foot", "right_foot"].map(|role| rig_of("target", target).role(role)[0]);
    let frames = 0..result.clip.frame_count();
    let heights = frames.flat_map(|frame| {
        let pose = world(&target.skeleton, Some((&result.clip, frame)));
        feet.map(|foot| position(&pose, foot).y)
    });
    heights.fold(f64::INFINITY, f64::min)
}

#[test]
fn feet_in_the_air_stand_on_nothing() {
    let (walk, target) = (samples::walk_scene(), samples::mannequin_scene());
    let made = |meters: f32| {
        let source = with_roots_moved(&walk, |_| Vec3::Y * meters);
        let (from, onto) = (rig_of("source", &source), rig_of("target", &target));
        let result = moved(&from, &onto);
        let measures = measured(&from, &onto, &result);
        let touches = result.contacts.iter().any(|track| track.touches.contains(&true));
        (touches, measures.metrics[&MetricName::FloorFloat].value.is_some(), lowest_ankle(&target, &result))
    };
    let (on_floor, off_by_a_shoe, in_air) = (made(0.0), made(0.03), made(0.5));
    assert!(on_floor.0 && on_floor.1, "a walk stands");
    assert!(off_by_a_shoe.0 && off_by_a_shoe.1, "so does one whose floor is off by the thickness of a shoe");
    assert!(!in_air.0 && !in_air.1, "nothing touches half a meter above the floor, and nothing is to float there");
    assert!(in_air.2 - on_floor.2 > 0.4, "nor is anything drawn down: {} and {} m", in_air.2, on_floor.2);
}

/// A game's jump that stays where it begins, with toes that hang 27 cm below its floor at a leg of 1 m.
#[test]
fn feet_that_dangle_through_the_floor_draw_nobody_down() {
    let files = ["rigify-blender/gdquest_sophia.glb", "mixamo/gltf/Xbot.glb"];
    let Some([source, target]) = Figure::of_corpus(files) else { return };
    let source = with_clip(source.scene, "Jump");
    let result = moved(&rig_of("source", &source), &rig_of("target", &target.scene));
    let toes = ["left_toe", "right_toe"].map(|role| target.roles[role]);
    for frame in 0..result.clip.frame_count() {
        let pose = world(target.skeleton(), Some((&result.clip, frame)));
        let lowest = toes.map(|toe| position(&pose, toe).y).into_iter().fold(f64::INFINITY, f64::min);
        assert!(lowest > -0.06, "frame {frame}: toes are {lowest} m below the floor");
    }
}

/// Rotations alone raise and sink feet by centimeters within a few frames of the crouches before and after a leap.
#[test]
fn feet_stay_on_the_floor_in_a_crouch() {
    let Some(robot) = corpus_file("cc0-stylised/robot_expressive.glb") else { return };
    let source = with_clip(Figure::read(&robot).scene, "Jump");
    for file in ["mixamo/gltf/Soldier.glb", "readyplayerme/rpm_avatar_a.glb", "vrm1/makehuman_body_vrm1.vrm"] {
        let Some(target) = corpus_file(file) else { return };
        let target = Figure::read(&target);
        let (from, onto) = (rig_of("source", &source), rig_of("target", &target.scene));
        let result = moved(&from, &onto);
        let float = measured(&from, &onto, &result).metrics[&MetricName::FloorFloat].value.expect("it stands");
        assert!(float < 1.0, "{file}: {float} cm");
    }
}

/// A knight with long feet beside its legs hops: its toes touch while others are still a third of a leg above the floor.
#[test]
fn toes_of_long_feet_that_touch_early_tear_no_leg_down() {
    let Some(knight) = corpus_file("cc0-stylised/kaykit_knight.glb") else { return };
    let source = with_clip(Figure::read(&knight).scene, "1H_Melee_Attack_Chop");
    for file in ["mixamo/gltf/Xbot.glb", "cc0-stylised/quaternius_adventurer.gltf", "vrm1/makehuman_body_vrm1.vrm"] {
        let Some(target) = corpus_file(file) else { return };
        let target = Figure::read(&target);
        let (from, onto) = (rig_of("source", &source), rig_of("target", &target.scene));
        let result = moved(&from, &onto);
        let measures = measured(&from, &onto, &result);
        let value = |name: MetricName| measures.metrics[&name].value.expect("legs are measured");
        let (jerk, residual) = (value(MetricName::JerkRatio), value(MetricName::ReachResidual));
        assert!(jerk < 1.4 && residual < 2.5, "{file}: jerk {jerk}, {residual} cm out of reach");
    }
}
