//! Measures of clips in which it is known what is wrong, and by how much.

mod visible;

use glam::{DQuat, DVec3};

use super::{Measures, Verdict, measure};
use crate::{
    model::{Clip, JointTracks, LocalPose, Reporter, Scene, Skeleton, Track, Transform},
    retarget::{
        resolve::resolve,
        spec::{MetricName, ReportChoice, ReportDetail, RetargetSpec},
    },
    rig::Rig,
    samples,
};

const FPS: f64 = 30.0;

/// The samples' walker. Its leg is hip to knee to ankle.
fn walker() -> Scene {
    samples::walk_scene()
}

fn leg(scene: &Scene) -> f64 {
    let length = |name: &str| joint(&scene.skeleton, name).1.translation.length();
    length("mixamorig:LeftLeg") + length("mixamorig:LeftFoot")
}

fn joint(skeleton: &Skeleton, name: &str) -> (usize, Transform) {
    let joint = skeleton.find(name).expect("a joint of the walker");
    (joint, skeleton.joints()[joint].rest)
}

/// A clip from the rest pose, with a change of each frame.
fn clip(skeleton: &Skeleton, frames: usize, change: impl Fn(usize, &mut LocalPose)) -> Clip {
    clip_at(FPS, skeleton, frames, change)
}

fn clip_at(fps: f64, skeleton: &Skeleton, frames: usize, change: impl Fn(usize, &mut LocalPose)) -> Clip {
    let poses: Vec<LocalPose> = (0..frames)
        .map(|frame| {
            let mut pose = skeleton.rest_pose();
            change(frame, &mut pose);
            pose
        })
        .collect();
    let tracks = (0..skeleton.len()).map(|joint| JointTracks {
        translation: Track::Sampled(poses.iter().map(|pose| pose.transforms()[joint].translation.as_vec3()).collect()),
        rotation: Track::Sampled(poses.iter().map(|pose| pose.transforms()[joint].rotation.as_quat()).collect()),
        scale: Track::Rest,
    });
    let times = (0..frames).map(|frame| frame as f64 / fps).collect();
    Clip::new("made".into(), times, tracks.collect()).expect("a valid clip")
}

fn turn(pose: &mut LocalPose, skeleton: &Skeleton, name: &str, rotation: DQuat) {
    let joint = joint(skeleton, name).0;
    let local = &mut pose.transforms_mut()[joint].rotation;
    *local *= rotation;
}

fn move_root(pose: &mut LocalPose, by: DVec3) {
    pose.transforms_mut()[0].translation += by;
}

/// The measures of a result on the source's own rig.
fn measured(scene: &Scene, source: &Clip, result: &Clip, detail: ReportDetail) -> Measures {
    measured_onto((scene, source), (scene, result), detail)
}

/// The measures of a result on another rig.
fn measured_onto(
    (source, source_clip): (&Scene, &Clip),
    (target, result): (&Scene, &Clip),
    detail: ReportDetail,
) -> Measures {
    let (spec, mut reporter) = (RetargetSpec::default(), Reporter::new());
    let from = Rig::new("source", source, None, &spec.source, &mut reporter).expect("a rig");
    let onto = Rig::new("target", target, None, &spec.target, &mut reporter).expect("a rig");
    let mapping = resolve(&spec, &from, &onto, source_clip, &mut reporter).expect("it maps").mapping;
    measure(&mapping, &from, &onto, source_clip, result, &ReportChoice::Detail(detail), &[])
}

fn value(measures: &Measures, name: MetricName) -> f64 {
    measures.metrics[&name].value.unwrap_or_else(|| panic!("{name:?}: {:?}", measures.metrics[&name].reason))
}

fn verdict(measures: &Measures, name: MetricName) -> Verdict {
    measures.metrics[&name].verdict
}

fn close(actual: f64, expected: f64, slack: f64, what: &str) {
    assert!((actual - expected).abs() <= slack, "{what}: {actual} where {expected} is right");
}

#[test]
fn a_clip_against_itself_is_perfect() {
    let scene = walker();
    let walk = &scene.clips[0];
    let measures = measured(&scene, walk, walk, ReportDetail::Full);
    for (name, metric) in &measures.metrics {
        assert!(metric.verdict <= Verdict::Pass, "{name:?}: {metric:?}");
    }
    close(value(&measures, MetricName::LimbDirection), 0.0, 1e-4, "degrees");
    close(value(&measures, MetricName::EndOrientation), 0.0, 1e-4, "degrees");
    close(value(&measures, MetricName::JerkRatio), 1.0, 1e-6, "ratio");
    close(value(&measures, MetricName::ContactDisagreement), 0.0, 1e-9, "share");
    close(value(&measures, MetricName::PelvisPath), 0.0, 1e-4, "percent");
    close(measures.score, 0.0, 1e-3, "the score");
    assert!(measures.contacts.len() >= 4, "a walk has steps: {}", measures.contacts.len());
    assert_eq!(measures.frames_measured, 121, "all frames");
    assert_eq!(measures.curves["limb_direction"].times_seconds.len(), 121, "full means every frame");
}

#[test]
fn a_foot_that_slides_three_centimeters_says_so() {
    let scene = walker();
    let by = 0.03 * leg(&scene);
    let standing = clip(&scene.skeleton, 31, |_, _| {});
    let sliding = clip(&scene.skeleton, 31, |frame, pose| move_root(pose, DVec3::X * (by * frame as f64 / 30.0)));
    let measures = measured(&scene, &standing, &sliding, ReportDetail::Summary);
    close(value(&measures, MetricName::FootSlide), 3.0, 1e-3, "centimeters at 1 m leg length");
    assert_eq!(verdict(&measures, MetricName::FootSlide), Verdict::Fail, "beyond 2 cm");
    assert_eq!(measures.contacts.len(), 4, "heel and ball of both feet: {:?}", measures.contacts);
    for contact in &measures.contacts {
        close(contact.slide_cm, 3.0, 1e-3, &contact.part);
        assert_eq!((contact.first_frame, contact.last_frame), (0, 30), "all of the clip");
    }
    let own = measured(&scene, &sliding, &sliding, ReportDetail::Summary);
    assert_eq!(verdict(&own, MetricName::FootSlide), Verdict::Pass, "what the source does itself is forgiven");
}

#[test]
fn depth_and_height_over_the_floor_are_told() {
    let scene = walker();
    let standing = clip(&scene.skeleton, 20, |_, _| {});
    let off = |centimeters: f64| {
        let by = DVec3::Y * (centimeters / 100.0 * leg(&scene));
        let moved = clip(&scene.skeleton, 20, |_, pose| move_root(pose, by));
        measured(&scene, &standing, &moved, ReportDetail::Summary)
    };
    let sunk = off(-2.0);
    close(value(&sunk, MetricName::FloorPenetration), 2.0, 1e-3, "deep");
    close(value(&sunk, MetricName::FloorFloat), 0.0, 1e-9, "not in the air");
    let afloat = off(2.0);
    close(value(&afloat, MetricName::FloorPenetration), 0.0, 1e-9, "not deep");
    close(value(&afloat, MetricName::FloorFloat), 2.0, 1e-3, "in the air");
    assert_eq!(verdict(&afloat, MetricName::FloorFloat), Verdict::Warn, "between 1 and 4");
}

#[test]
fn limbs_that_point_or_turn_elsewhere_are_named() {
    let scene = walker();
    let standing = clip(&scene.skeleton, 10, |_, _| {});
    let at_frame_five = |name: &'static str, rotation: DQuat| {
        let turned = clip(&scene.skeleton, 10, |frame, pose| {
            if frame == 5 {
                turn(pose, &scene.skeleton, name, rotation);
            }
        });
        measured(&scene, &standing, &turned, ReportDetail::Full)
    };
    let bent = at_frame_five("mixamorig:LeftForeArm", DQuat::from_rotation_x(25.0_f64.to_radians()));
    let direction = &bent.metrics[&MetricName::LimbDirection];
    let worst = &direction.worst[0];
    assert_eq!((worst.part.as_str(), worst.frame), ("left_forearm", 5), "{direction:?}");
    close(worst.value, 25.0, 1e-3, "degrees");
    // +Y is along the bone of the walker.
    let twisted = at_frame_five("mixamorig:RightForeArm", DQuat::from_rotation_y(40.0_f64.to_radians()));
    let worst = &twisted.metrics[&MetricName::LimbTwist].worst[0];
    assert!(worst.part.starts_with("right_"), "{worst:?}");
    close(worst.value, 40.0, 0.5, "degrees about its own axis");
    close(twisted.limb_directions["right_forearm"].max_degrees, 0.0, 1e-3, "it points where it did");
}

#[test]
fn a_foot_that_stands_flat_is_right_however_the_source_is_tilted() {
    let scene = walker();
    let turned = |rotation: DQuat| {
        clip(&scene.skeleton, 20, |_, pose| {
            let model = scene.skeleton.rest_pose().to_model(&scene.skeleton);
            for name in ["mixamorig:LeftFoot", "mixamorig:RightFoot"] {
                let own = model.transforms()[joint(&scene.skeleton, name).0].rotation;
                turn(pose, &scene.skeleton, name, own.conjugate() * rotation * own);
            }
        })
    };
    let (flat, tilted) = (turned(DQuat::IDENTITY), turned(DQuat::from_rotation_x(0.35)));
    let of = |source: &Clip, result: &Clip| {
        let measures = measured(&scene, source, result, ReportDetail::Full);
        measures.metrics[&MetricName::EndOrientation].parts["left_foot"]
    };
    close(of(&tilted, &flat), 0.0, 1e-3, "it lies on the floor");
    close(of(&flat, &tilted), 0.35_f64.to_degrees(), 1e-3, "it does not");
    let aside = turned(DQuat::from_rotation_y(0.35));
    close(of(&tilted, &aside), 0.35_f64.to_degrees(), 2.0, "it lies on the floor and heads elsewhere");
}

#[test]
fn knees_that_bend_backwards_or_snap_are_flips() {
    let scene = walker();
    let squat = |flip_at: Option<usize>| {
        clip(&scene.skeleton, 40, |frame, pose| {
            let bend = 60.0_f64.to_radians() * if flip_at == Some(frame) { -1.0 } else { 1.0 };
            turn(pose, &scene.skeleton, "mixamorig:LeftUpLeg", DQuat::from_rotation_x(-bend / 2.0));
            turn(pose, &scene.skeleton, "mixamorig:LeftLeg", DQuat::from_rotation_x(bend));
        })
    };
    let (good, flipped) = (squat(None), squat(Some(20)));
    let measures = measured(&scene, &good, &flipped, ReportDetail::Summary);
    let flips = &measures.metrics[&MetricName::BendFlips];
    assert!(flips.value.is_some_and(|value| (1.0..=2.0).contains(&value)), "there and back: {flips:?}");
    assert!((20..=21).contains(&flips.worst[0].frame), "{flips:?}");
    assert_eq!(flips.worst[0].joint, "mixamorig:LeftLeg", "the knee");
    assert!(value(&measures, MetricName::RotationJumps) >= 1.0, "it is a jump as well");
    let own = measured(&scene, &flipped, &flipped, ReportDetail::Summary);
    close(value(&own, MetricName::BendFlips), 0.0, 0.0, "the source has it too");
    close(value(&own, MetricName::RotationJumps), 0.0, 0.0, "likewise");
}

#[test]
fn a_knee_that_is_folded_too_far_is_over_its_limit() {
    let scene = walker();
    let folded = |degrees: f64| {
        let bend = DQuat::from_rotation_x(degrees.to_radians());
        clip(&scene.skeleton, 5, |_, pose| turn(pose, &scene.skeleton, "mixamorig:LeftLeg", bend))
    };
    let rest = clip(&scene.skeleton, 5, |_, _| {});
    let straight = measured(&scene, &rest, &rest, ReportDetail::Full);
    let bend_at_rest = |degrees: f64| measured(&scene, &rest, &folded(degrees), ReportDetail::Full);
    close(value(&straight, MetricName::JointLimits), 0.0, 0.0, "straight");
    let far = value(&bend_at_rest(175.0), MetricName::JointLimits);
    // The walker's knee is not quite straight at rest, so the bend is a few degrees off the turn.
    assert!((3.0..15.0).contains(&far), "175 degrees are beyond 165: {far}");
}

#[test]
fn keys_on_opposite_hemispheres_are_counted() {
    let scene = walker();
    let good = clip(&scene.skeleton, 10, |_, _| {});
    let arm = joint(&scene.skeleton, "mixamorig:LeftArm").0;
    let bad = clip(&scene.skeleton, 10, |frame, pose| {
        if frame >= 4 {
            let rotation = &mut pose.transforms_mut()[arm].rotation;
            *rotation = -*rotation;
        }
    });
    let measures = measured(&scene, &good, &bad, ReportDetail::Summary);
    close(value(&measures, MetricName::QuaternionContinuity), 1.0, 0.0, "one change of sign");
    assert_eq!(verdict(&measures, MetricName::QuaternionContinuity), Verdict::Fail, "none is allowed");
    close(value(&measures, MetricName::RotationJumps), 0.0, 0.0, "the rotation itself is the same");
    close(value(&measures, MetricName::EndOrientation), 0.0, 1e-4, "likewise");
}

#[test]
fn bones_that_stretch_and_bodies_that_stray_or_turn_away() {
    let scene = walker();
    let walk = &scene.clips[0];
    let (skeleton, shin) = (&scene.skeleton, joint(&scene.skeleton, "mixamorig:LeftLeg").0);
    let change = |frame: usize, change: &dyn Fn(usize, &mut LocalPose)| {
        let mut pose = walk.local_pose(skeleton, frame);
        change(frame, &mut pose);
        pose
    };
    let changed = |edit: &dyn Fn(usize, &mut LocalPose)| {
        clip(skeleton, walk.frame_count(), |frame, pose| *pose = change(frame, edit))
    };
    let against_walk = |result: &Clip| measured(&scene, walk, result, ReportDetail::Full);
    let stretched = changed(&|_, pose| pose.transforms_mut()[shin].translation *= 1.1);
    close(value(&against_walk(&stretched), MetricName::BoneLengthDrift), 0.1, 1e-6, "a tenth longer");
    let scaled = changed(&|_, pose| pose.transforms_mut()[0].translation *= DVec3::new(0.8, 1.0, 0.8));
    close(value(&against_walk(&scaled), MetricName::PelvisPath), 0.0, 0.05, "another scale is the same path");
    let quarter = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
    let turned = changed(&|_, pose| {
        let root = &mut pose.transforms_mut()[0];
        *root = Transform { translation: quarter * root.translation, rotation: quarter * root.rotation, ..*root };
    });
    let measures = against_walk(&turned);
    close(value(&measures, MetricName::Facing), 90.0, 1e-3, "a quarter turn");
    assert_eq!(verdict(&measures, MetricName::Facing), Verdict::Fail, "far beyond 20 degrees");
    assert!(value(&measures, MetricName::PelvisPath) > 50.0, "it walks elsewhere");
}

#[test]
fn shaking_raises_the_jerk() {
    let scene = walker();
    let walk = &scene.clips[0];
    let shaken = clip(&scene.skeleton, walk.frame_count(), |frame, pose| {
        *pose = walk.local_pose(&scene.skeleton, frame);
        let side = if frame % 2 == 0 { 1.0 } else { -1.0 };
        turn(pose, &scene.skeleton, "mixamorig:LeftArm", DQuat::from_rotation_x(side * 2.0_f64.to_radians()));
    });
    let measures = measured(&scene, walk, &shaken, ReportDetail::Summary);
    let jerk = &measures.metrics[&MetricName::JerkRatio];
    assert!(jerk.parts["left_hand"] > 2.0, "the hand that shakes: {jerk:?}");
    close(jerk.parts["right_hand"], 1.0, 1e-6, "the hand that does not");
    assert_eq!(jerk.verdict, Verdict::Fail, "beyond 1.5");
}

#[test]
fn noise_of_a_fast_capture_is_no_jerk() {
    let scene = walker();
    // An arm that swings, at 120 frames per second.
    let fast = |noise: f64| {
        let swung = clip(&scene.skeleton, 480, |frame, pose| {
            let side = if frame * 7919 % 13 < 6 { 1.0 } else { -1.0 };
            let angle = 0.5 * (frame as f64 / 120.0 * std::f64::consts::TAU).sin() + side * noise;
            turn(pose, &scene.skeleton, "mixamorig:LeftArm", DQuat::from_rotation_x(angle));
        });
        let times = swung.times_seconds().iter().map(|seconds| seconds * FPS / 120.0).collect();
        Clip::new("fast".into(), times, swung.joints().to_vec()).expect("a valid clip")
    };
    // Less than a tenth of a millimeter at the hand.
    let measures = measured(&scene, &fast(0.0), &fast(0.000_12), ReportDetail::Summary);
    let jerk = &measures.metrics[&MetricName::JerkRatio];
    assert!(jerk.parts["left_hand"] < 1.15, "nobody sees it: {jerk:?}");
    let measures = measured(&scene, &fast(0.0), &fast(0.02), ReportDetail::Summary);
    assert!(measures.metrics[&MetricName::JerkRatio].parts["left_hand"] > 2.0, "a centimeter is seen");
}

#[test]
fn a_pelvis_that_shakes_over_feet_that_stand_raises_the_jerk() {
    let scene = walker();
    let (skeleton, walk) = (&scene.skeleton, &scene.clips[0]);
    let [hips, left, right] =
        ["mixamorig:Hips", "mixamorig:LeftUpLeg", "mixamorig:RightUpLeg"].map(|name| joint(skeleton, name).0);
    let world_turn = |pose: &LocalPose| pose.to_model(skeleton).transforms()[hips].rotation;
    let shaken = clip(skeleton, walk.frame_count(), |frame, pose| {
        *pose = walk.local_pose(skeleton, frame);
        let by = DVec3::Y * (0.002 * leg(&scene) * if frame % 2 == 0 { 1.0 } else { -1.0 });
        let back = world_turn(pose).conjugate() * by;
        pose.transforms_mut()[hips].translation += by;
        for thigh in [left, right] {
            pose.transforms_mut()[thigh].translation -= back;
        }
    });
    let measures = measured(&scene, walk, &shaken, ReportDetail::Summary);
    let jerk = &measures.metrics[&MetricName::JerkRatio];
    assert!(jerk.parts["pelvis"] > 2.0, "the pelvis shakes: {jerk:?}");
    close(jerk.parts["right_hand"], 1.0, 1e-3, "the hand hangs from it as before");
    assert_eq!(jerk.verdict, Verdict::Fail, "beyond 1.5");
}

#[test]
fn hands_that_no_longer_meet_are_told() {
    let scene = walker();
    let clap = |open_degrees: f64| {
        clip(&scene.skeleton, 10, |_, pose| {
            for (side, sign) in [("Left", 1.0), ("Right", -1.0)] {
                let arm = joint(&scene.skeleton, &format!("mixamorig:{side}Arm")).0;
                // Arms to the front: the model's +Y turn, seen from the shoulder.
                let model = scene.skeleton.rest_pose().to_model(&scene.skeleton);
                let own = model.transforms()[arm].rotation;
                let forward = DQuat::from_rotation_y(-sign * (open_degrees - 100.0).to_radians().abs());
                turn(pose, &scene.skeleton, &format!("mixamorig:{side}Arm"), own.conjugate() * forward * own);
            }
        })
    };
    let (together, apart) = (clap(0.0), clap(20.0));
    let same = measured(&scene, &together, &together, ReportDetail::Summary);
    close(value(&same, MetricName::HandGap), 0.0, 1e-6, "they meet");
    let measures = measured(&scene, &together, &apart, ReportDetail::Summary);
    assert!(
        value(&measures, MetricName::HandGap) > 5.0,
        "they are far apart: {:?}",
        measures.metrics[&MetricName::HandGap]
    );
    let never = measured(&scene, &apart, &together, ReportDetail::Summary);
    assert_eq!(verdict(&never, MetricName::HandGap), Verdict::NotApplicable, "the source's hands do not meet");
}

#[test]
fn odd_rigs_and_odd_clips_are_measured_as_far_as_they_can_be() {
    let scene = walker();
    for frames in [1, 2, 3] {
        let short = clip(&scene.skeleton, frames, |_, _| {});
        let measures = measured(&scene, &short, &short, ReportDetail::Full);
        assert_eq!(verdict(&measures, MetricName::JerkRatio), Verdict::NotApplicable, "{frames} frames have no jerk");
        assert!(verdict(&measures, MetricName::FootSlide) <= Verdict::Pass, "{frames} frames");
        assert!(measures.metrics.values().all(|metric| metric.value.is_none_or(f64::is_finite)), "{frames} frames");
    }
    let skeleton = Skeleton::new(scene.skeleton.joints()[..4].to_vec()).expect("a trunk");
    let trunk = Scene { skeleton, clips: Vec::new(), ..walker() };
    let still = clip(&trunk.skeleton, 5, |_, _| {});
    let spec: RetargetSpec =
        serde_json::from_str(r#"{"source": {"root": "mixamorig:Hips"}, "target": {"root": "mixamorig:Hips"}}"#)
            .expect("a spec");
    let mut reporter = Reporter::new();
    let mut rig = |name| Rig::new(name, &trunk, None, &spec.source, &mut reporter).expect("a rig");
    let (source, target) = (rig("source"), rig("target"));
    let mapping = resolve(&spec, &source, &target, &still, &mut reporter).expect("it maps").mapping;
    let measures = measure(&mapping, &source, &target, &still, &still, &ReportChoice::default(), &[]);
    for name in [MetricName::FootSlide, MetricName::BendFlips, MetricName::HandGap, MetricName::ReachResidual] {
        let metric = &measures.metrics[&name];
        assert_eq!(metric.verdict, Verdict::NotApplicable, "{name:?}");
        assert!(metric.reason.is_some(), "{name:?} says why");
    }
}

#[test]
fn long_clips_are_looked_at_in_parts_and_feet_in_whole() {
    let scene = walker();
    let by = 0.03 * leg(&scene);
    let frames = 5000;
    let standing = clip(&scene.skeleton, frames, |_, _| {});
    let sliding = clip(&scene.skeleton, frames, |frame, pose| {
        let share = (frame.saturating_sub(4000) as f64 / 30.0).min(1.0);
        move_root(pose, DVec3::X * (by * share));
    });
    let measures = measured(&scene, &standing, &sliding, ReportDetail::Summary);
    assert_eq!(measures.frames_measured, 400, "a summary looks at some");
    close(value(&measures, MetricName::FootSlide), 3.0, 1e-2, "and at all of the feet");
    assert!(measures.curves["sole_height"].times_seconds.len() <= 120, "coarse curves");
    let again = measured(&scene, &standing, &sliding, ReportDetail::Summary);
    assert_eq!(measures, again, "the same every time");
}
