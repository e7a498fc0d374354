//! `fk`: chains that take shapes and lengths, and poles of limbs.

use glam::{DVec3, Vec3};
use retargetd::model::{Clip, ModelPose, Track};

use super::stage::{Played, Stage, degrees};

fn fk(fields: &str) -> String {
    format!(r#"{{"ops": [{{"op": "pelvis"}}, {{"op": "fk", "twist": false, {fields}}}]}}"#)
}

fn largest_turn(stage: &Stage, first: &Played, second: &Played) -> f64 {
    let mut largest: f64 = 0.0;
    for frame in [0, 33, 101] {
        let (first, second) = (stage.target_pose(first, frame), stage.target_pose(second, frame));
        for (first, second) in first.transforms().iter().zip(second.transforms()) {
            largest = largest.max(degrees(first.rotation, second.rotation));
        }
    }
    largest
}

#[test]
fn shapes_onto_the_same_rig_change_nothing() {
    let stage = Stage::onto_itself();
    let plain = stage.play(&fk(r#""rotation": "auto""#));
    for mode in ["match_chain", "match_scaled_chain", "copy_local"] {
        let played = stage.play(&fk(&format!(r#""rotation": "{mode}""#)));
        let off = largest_turn(&stage, &plain, &played);
        assert!(off < 0.02, "{mode}: {off}");
    }
    for mode in ["stretch_uniform", "stretch_by_segment", "orient_and_scale"] {
        let played = stage.play(&fk(&format!(r#""translation": "{mode}""#)));
        let off = largest_turn(&stage, &plain, &played);
        let moved =
            stage.place(&plain, 50, "mixamorig:LeftHand").distance(stage.place(&played, 50, "mixamorig:LeftHand"));
        assert!(off < 0.02 && moved < 1e-5, "{mode}: {off} degrees, {moved}");
    }
}

/// The distance of a point from a line of points.
fn off_line(point: DVec3, line: &[DVec3]) -> f64 {
    let off = |pair: &[DVec3]| {
        let way = pair[1] - pair[0];
        let share = ((point - pair[0]).dot(way) / way.length_squared()).clamp(0.0, 1.0);
        point.distance(pair[0] + way * share)
    };
    line.windows(2).map(off).fold(f64::INFINITY, f64::min)
}

#[test]
fn a_matched_spine_lies_on_the_sources() {
    let stage = Stage::walk();
    let played = stage.play(&fk(r#""rotation": "match_scaled_chain", "mask": ["spine", "neck", "head"]"#));
    let names = ["Spine", "Spine1", "Spine2", "Neck"].map(|name| stage.source_joint(&format!("mixamorig:{name}")));
    let targets =
        ["spine_01", "spine_02", "spine_03", "spine_04", "spine_05", "neck_01"].map(|name| stage.target_joint(name));
    let rest = |pose: &ModelPose, joints: &[usize]| -> f64 {
        let place = |joint: usize| pose.transforms()[joint].translation;
        joints.windows(2).map(|pair| place(pair[0]).distance(place(pair[1]))).sum()
    };
    let model = |scene: &retargetd::model::Scene| scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let ratio = rest(&model(&stage.target), &targets) / rest(&model(&stage.source), &names);
    for frame in [0, 20, 64] {
        let (source, target) = (stage.source_pose(frame), stage.target_pose(&played, frame));
        let begin = target.transforms()[targets[0]].translation;
        let origin = source.transforms()[names[0]].translation;
        let line: Vec<DVec3> =
            names.iter().map(|&joint| begin + (source.transforms()[joint].translation - origin) * ratio).collect();
        for &joint in &targets[..5] {
            let off = off_line(target.transforms()[joint].translation, &line);
            assert!(off < 2e-4, "{} at frame {frame} is {off} off the line", stage.target.skeleton.label(joint));
        }
    }
}

/// The walk with a left forearm whose hand is farther away.
fn with_long_forearm() -> Stage {
    let mut stage = Stage::onto_itself();
    let (elbow, hand) = (stage.source_joint("mixamorig:LeftForeArm"), stage.source_joint("mixamorig:LeftHand"));
    let clip = &stage.source.clips[0];
    let mut joints = clip.joints().to_vec();
    let rest = |joint: usize| stage.source.skeleton.joints()[joint].rest.translation;
    joints[elbow].translation = Track::Constant(rest(elbow).as_vec3());
    joints[hand].translation = Track::Constant((rest(hand) * 1.5).as_vec3());
    let clip = Clip::new("long".to_owned(), clip.times_seconds().to_vec(), joints).expect("a clip");
    stage.source.clips = vec![clip];
    stage
}

#[test]
fn bones_get_longer_with_the_sources() {
    let stage = with_long_forearm();
    let (elbow, hand) = (stage.target_joint("mixamorig:LeftForeArm"), stage.target_joint("mixamorig:LeftHand"));
    let rest = |joint: usize| stage.target.skeleton.joints()[joint].rest.translation.length();
    let (upper, lower) = (rest(elbow), rest(hand));
    let lengths = |mode: &str| {
        let played = stage.play(&fk(&format!(r#""translation": "{mode}""#)));
        let length = |joint: usize| f64::from(played.clip.joints()[joint].translation.at(20, Vec3::ZERO).length());
        (length(elbow), length(hand))
    };
    let whole = (upper + 1.5 * lower) / (upper + lower);
    for (mode, wanted) in [
        ("stretch_uniform", (upper * whole, lower * whole)),
        ("stretch_by_segment", (upper, lower * 1.5)),
        ("orient_and_scale", (upper, lower * 1.5)),
    ] {
        let found = lengths(mode);
        let off = (found.0 - wanted.0).abs().max((found.1 - wanted.1).abs());
        assert!(off < 1e-5, "{mode}: {found:?} where {wanted:?} is wanted");
    }
    let half = stage.play(&fk(r#""translation": "stretch_by_segment", "translation_alpha": 0.5"#));
    let length = f64::from(half.clip.joints()[hand].translation.at(20, Vec3::ZERO).length());
    assert!((length - lower * 1.25).abs() < 1e-5, "half of it: {length}");
}

#[test]
fn a_pole_turns_about_the_line_from_hip_to_ankle() {
    let stage = Stage::walk();
    let plain = stage.play(&fk(r#""rotation": "auto""#));
    let turned = stage.play(&fk(r#""pole_offset": 25"#));
    for frame in [10, 70] {
        let places = |played: &Played| ["thigh_l", "calf_l", "foot_l"].map(|name| stage.place(played, frame, name));
        let ([hip, knee, ankle], [_, turned_knee, turned_ankle]) = (places(&plain), places(&turned));
        assert!(ankle.distance(turned_ankle) < 1e-5, "the ankle stays: {ankle} {turned_ankle}");
        let line = (ankle - hip).normalize();
        let off = |knee: DVec3| (knee - hip) - line * (knee - hip).dot(line);
        let angle = off(knee).angle_between(off(turned_knee)).to_degrees();
        assert!((angle - 25.0).abs() < 0.1, "the knee turns by 25 degrees: {angle}");
        let foot = degrees(stage.turned(&plain, frame, "foot_l"), stage.turned(&turned, frame, "foot_l"));
        assert!(foot < 1e-3, "the foot keeps how it is turned: {foot}");
    }
}

#[test]
fn an_aligned_pole_points_as_the_sources() {
    let stage = Stage::walk();
    let played = stage.play(&fk(r#""align_pole": 1, "keep_pole_offset": false"#));
    let pole = |[start, middle, end]: [DVec3; 3]| {
        let line = (end - start).normalize();
        (((middle - start) - line * (middle - start).dot(line)).normalize(), line)
    };
    let source_names =
        ["LeftUpLeg", "LeftLeg", "LeftFoot"].map(|name| stage.source_joint(&format!("mixamorig:{name}")));
    // Frames at which the knee is well bent, so that its pole is sure.
    let bent = (0..121).filter(|&frame| {
        let [hip, knee, ankle] = source_names.map(|joint| stage.source_pose(frame).transforms()[joint].translation);
        (knee - hip).angle_between(ankle - knee) > 0.6
    });
    let mut count = 0;
    for frame in bent {
        let source = source_names.map(|joint| stage.source_pose(frame).transforms()[joint].translation);
        let target = ["thigh_l", "calf_l", "foot_l"].map(|name| stage.place(&played, frame, name));
        let ((wanted, source_line), (found, line)) = (pole(source), pole(target));
        let wanted = glam::DQuat::from_rotation_arc(source_line, line) * wanted;
        assert!(found.angle_between(wanted).to_degrees() < 0.2, "frame {frame}: {found} where {wanted} is wanted");
        count += 1;
    }
    assert!(count > 10, "the walk bends its knees: {count} frames");
}
