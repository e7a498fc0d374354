//! Walks on the spot: the floor runs below the figure, and feet stand on it as they do where the figure gets on.

use glam::Vec3;
use retargetd::{
    model::{Scene, Track},
    retarget::{MetricName, StackResult, parse_spec},
    samples,
};

use super::figure::{
    agreement, measured, moved, moved_with, position, rig_of, value, with_roots_moved, with_tracks, world,
};

/// The result, and the joints of the target's toes.
fn walked(source: &Scene, target: &Scene) -> (StackResult, [usize; 2]) {
    let (from, onto) = (rig_of("source", source), rig_of("target", target));
    (moved(&from, &onto), ["left_toe", "right_toe"].map(|role| onto.role(role)[0]))
}

/// The walk with every joint that hangs from nothing taken back by so many meters a second along its way.
fn taken_back(walk: &Scene, meters_per_second: f32) -> Scene {
    with_roots_moved(walk, |time| -Vec3::Z * (meters_per_second * time as f32))
}

#[test]
fn feet_of_a_walk_on_the_spot_stand_when_those_of_the_walk_do() {
    let (walk, target) = (samples::walk_scene(), samples::mannequin_scene());
    let speed = samples::WALK_SPEED as f32;
    let ((over_floor, toes), (on_spot, _)) = (walked(&walk, &target), walked(&taken_back(&walk, speed), &target));
    let same = agreement(&over_floor.contacts, &on_spot.contacts);
    assert!(same > 0.97, "contacts agree in {same} of the frames");
    // The same steps, one figure taken back by what the floor runs: the pose is the same, and only its place differs.
    let end = position(&world(&target.skeleton, Some((&over_floor.clip, 120))), toes[0]);
    let begin = position(&world(&target.skeleton, Some((&over_floor.clip, 0))), toes[0]);
    assert!((end - begin).z > 3.0, "the walk gets on");
    for frame in 10..110 {
        let poses = [&over_floor.clip, &on_spot.clip].map(|clip| world(&target.skeleton, Some((clip, frame))));
        let heights = toes.map(|toe| poses.each_ref().map(|pose| position(pose, toe).y));
        for [over_floor, on_spot] in heights {
            assert!((over_floor - on_spot).abs() < 0.004, "frame {frame}: toes at {over_floor} and {on_spot} m");
        }
    }
}

#[test]
fn the_report_measures_feet_of_a_walk_on_the_spot_over_the_floor_that_runs() {
    let (walk, target) = (samples::walk_scene(), samples::mannequin_scene());
    let on_spot = taken_back(&walk, samples::WALK_SPEED as f32);
    let [standing, running] = [&walk, &on_spot].map(|source| {
        let (from, onto) = (rig_of("source", source), rig_of("target", &target));
        measured(&from, &onto, &moved(&from, &onto))
    });
    assert_eq!(standing.floor_speed_meters_per_second, None, "the floor of a walk that gets on stands");
    let speed = running.floor_speed_meters_per_second.expect("the floor runs");
    let source = speed.source.expect("it is known");
    assert!((source / samples::WALK_SPEED - 1.0).abs() < 0.02, "{source} m/s");
    for name in [MetricName::FootSlide, MetricName::FloorFloat, MetricName::FloorPenetration] {
        let values = [&standing, &running].map(|measures| value(measures, name));
        assert!((values[0] - values[1]).abs() < 0.5, "{name:?}: {values:?} cm");
    }
    assert!(value(&running, MetricName::ContactDisagreement) < 0.1, "the target stands when the source does");
    assert!(running.contacts.len().abs_diff(standing.contacts.len()) <= 2, "the same contacts");
}

/// Legs of other proportions move feet back at a speed that is not even; they are held at one.
#[test]
fn feet_go_along_with_the_floor_as_evenly_as_the_source_does() {
    let (walk, target) = (samples::walk_scene(), samples::mannequin_scene());
    let on_spot = taken_back(&walk, samples::WALK_SPEED as f32);
    let (from, onto) = (rig_of("source", &on_spot), rig_of("target", &target));
    let slide = |spec: &[u8]| {
        let measures = measured(&from, &onto, &moved_with(&from, &onto, &parse_spec(spec).expect("a spec")));
        (value(&measures, MetricName::FootSlide), measures.metrics[&MetricName::FootSlide].source_value)
    };
    let (alone, _) = slide(br#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#);
    let (planted, source) = slide(b"{}");
    let source = source.expect("the source's");
    assert!(planted < source + 0.5 && planted < alone, "{planted} cm; rotations alone {alone}, the source {source}");
}

#[test]
fn a_figure_that_slides_along_does_not_make_the_floor_run() {
    let (walk, target) = (samples::walk_scene(), samples::mannequin_scene());
    let mut joints = walk.clips[0].joints().to_vec();
    let frames = walk.clips[0].frame_count();
    for tracks in &mut joints {
        if let Track::Sampled(rotations) = &mut tracks.rotation {
            let first = rotations[0];
            rotations.fill(first);
        }
        if let Track::Sampled(places) = &mut tracks.translation {
            let first = places[0];
            *places = (0..frames).map(|frame| first + Vec3::Z * (frame as f32 / 30.0)).collect();
        }
    }
    let (slid, _) = walked(&with_tracks(&walk, joints), &target);
    assert!(slid.contacts.iter().all(|track| !track.touches.contains(&true)), "nothing stands");
}
