//! What a viewer sees: soles of a mesh in the floor, kinks, springs, sway, arms in the trunk, limbs at rest.

use std::{f64::consts::TAU, sync::Arc};

use glam::{DQuat, DVec3, Vec3};

use super::{
    Measures, Verdict, clip, clip_at, close, joint, leg, measure, measured, measured_onto, move_root, turn, value,
    verdict, walker,
};
use crate::{
    model::{
        Clip, Influence, Joint, JointTracks, Reporter, Scene, Skeleton, SkinPoint, SkinPoints, SkinVertices, Track,
        Transform,
    },
    retarget::{
        resolve::resolve,
        spec::{MetricName, ReportChoice, ReportDetail, RetargetSpec},
    },
    rig::Rig,
};

/// The walker with shoes: boxes about its feet, `thick` below the floor under the ankles and longer behind and before than the joints
/// say. Vertices of the forefoot move with the toes.
fn shod(thick: f64) -> Scene {
    let mut scene = walker();
    let pose = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let mut vertices = SkinVertices::default();
    for side in ["Left", "Right"] {
        let foot = joint(&scene.skeleton, &format!("mixamorig:{side}Foot")).0;
        let toe = joint(&scene.skeleton, &format!("mixamorig:{side}ToeBase")).0;
        let ankle = pose.transforms()[foot].translation;
        for index in 0..200_usize {
            let (along, across, up) = (index % 10, index / 10 % 5, index / 50);
            let place = DVec3::new(
                ankle.x + 0.02 * across as f64 - 0.04,
                -thick + 0.02 * up as f64,
                ankle.z - 0.08 + 0.035 * along as f64,
            );
            let owner = if along < 6 { foot } else { toe };
            let transform = pose.transforms()[owner];
            let position =
                (transform.rotation.conjugate() * (place - transform.translation) / transform.scale).as_vec3();
            #[expect(clippy::cast_possible_truncation, reason = "a joint")]
            vertices.push(&mut vec![Influence { joint: owner as u32, weight: 1.0, position }], true);
        }
    }
    scene.skin_vertices = Arc::new(vertices);
    scene
}

fn standing(scene: &Scene, frames: usize) -> Clip {
    clip(&scene.skeleton, frames, |_, _| {})
}

#[test]
fn soles_of_a_mesh_are_what_is_in_the_floor() {
    let scene = shod(0.0);
    let still = standing(&scene, 20);
    // The heel goes down behind the ankle: points below ankle, ball and tip hardly notice.
    let tilted = clip(&scene.skeleton, 20, |_, pose| {
        for side in ["Left", "Right"] {
            turn(pose, &scene.skeleton, &format!("mixamorig:{side}Foot"), DQuat::from_rotation_x(-0.4));
        }
    });
    let without = measured(&walker(), &still, &tilted, ReportDetail::Full);
    let with = measured(&scene, &still, &tilted, ReportDetail::Full);
    let (blind, seen) = (value(&without, MetricName::FloorPenetration), value(&with, MetricName::FloorPenetration));
    assert!(seen > blind + 1.0, "the heel is in the floor: {seen} where joints say {blind}");
    let metric = &with.metrics[&MetricName::FloorPenetration];
    assert!(metric.verdict > Verdict::Pass, "it is seen: {metric:?}");
    assert!((metric.absolute_value.expect("the deepest") - seen).abs() < 1e-6, "all frames are alike");
    assert!(metric.worst[0].joint.contains("Foot"), "{metric:?}");
}

#[test]
fn a_depth_that_the_source_has_too_is_a_warning() {
    let scene = shod(0.0);
    let sunk_from = |first: usize| {
        clip(&scene.skeleton, 100, |frame, pose| {
            if frame >= first {
                move_root(pose, DVec3::Y * (-0.04 * leg(&scene)));
            }
        })
    };
    let briefly = measured(&scene, &sunk_from(97), &sunk_from(97), ReportDetail::Full);
    let metric = &briefly.metrics[&MetricName::FloorPenetration];
    assert_eq!(metric.verdict, Verdict::Warn, "4 cm are seen, whoever is to blame: {metric:?}");
    close(metric.absolute_value.expect("the deepest"), 4.0, 1e-3, "at most");
    assert!(briefly.verdict_reason.contains("floor_penetration"), "{}", briefly.verdict_reason);
    let always = measured(&scene, &sunk_from(0), &sunk_from(0), ReportDetail::Full);
    let metric = &always.metrics[&MetricName::FloorPenetration];
    assert_eq!(metric.verdict, Verdict::Fail, "a source that is off as a whole is no excuse: {metric:?}");
}

#[test]
fn a_mesh_that_slides_says_how_far() {
    let scene = shod(0.0);
    let by = 0.03 * leg(&scene);
    let sliding = clip(&scene.skeleton, 31, |frame, pose| move_root(pose, DVec3::X * (by * frame as f64 / 30.0)));
    let measures = measured(&scene, &standing(&scene, 31), &sliding, ReportDetail::Summary);
    close(value(&measures, MetricName::FootSlide), 3.0, 0.01, "centimeters at 1 m leg length");
    close(value(&measures, MetricName::FloorFloat), 0.0, 0.01, "it stays on the floor");
}

#[test]
fn a_soft_heel_that_the_shin_pulls_along_does_not_slide() {
    let mut scene = shod(0.0);
    let pose = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let mut vertices = SkinVertices::default();
    for influences in scene.skin_vertices.iter() {
        let mut influences = influences.to_vec();
        let one = influences[0];
        let foot = &pose.transforms()[one.joint as usize];
        let place = foot.transform_point(one.position.as_dvec3());
        if place.z < foot.translation.z - 0.04 {
            let shin = scene.skeleton.parent(one.joint as usize).expect("a shin");
            let from_shin = pose.transforms()[shin].relative(&Transform::from_translation(place)).translation;
            #[expect(clippy::cast_possible_truncation, reason = "a joint")]
            let pulled = Influence { joint: shin as u32, weight: 0.4, position: from_shin.as_vec3() };
            influences = vec![Influence { weight: 0.6, ..one }, pulled];
        }
        vertices.push(&mut influences, true);
    }
    scene.skin_vertices = Arc::new(vertices);
    // Shins turn about themselves, and feet stay.
    let twisting = clip(&scene.skeleton, 31, |frame, pose| {
        for side in ["Left", "Right"] {
            let (foot, rest) = joint(&scene.skeleton, &format!("mixamorig:{side}Foot"));
            let twist = DQuat::from_axis_angle(rest.translation.normalize(), 0.6 * frame as f64 / 30.0);
            turn(pose, &scene.skeleton, &format!("mixamorig:{side}Leg"), twist);
            pose.transforms_mut()[foot].rotation = twist.conjugate() * rest.rotation;
        }
    });
    let measures = measured(&scene, &standing(&scene, 31), &twisting, ReportDetail::Summary);
    close(value(&measures, MetricName::FootSlide), 0.0, 0.05, "the foot stands");
}

#[test]
fn soles_that_sweep_as_a_foot_without_a_mesh_does_are_forgiven() {
    let (bones, shoes) = (walker(), shod(0.0));
    // A foot that turns about its ankle and back within a second. Its toes go to the side and back.
    let turning = |radians: f64| {
        clip(&bones.skeleton, 61, |frame, pose| {
            let turned = radians * (1.0 - (frame as f64 / 60.0 * TAU).cos()) / 2.0;
            turn(pose, &bones.skeleton, "mixamorig:LeftFoot", DQuat::from_rotation_y(turned));
        })
    };
    let slide = |source: f64, result: f64| {
        let sides = ((&bones, &turning(source)), (&shoes, &turning(result)));
        let mut measures = measured_onto(sides.0, sides.1, ReportDetail::Full);
        measures.metrics.remove(&MetricName::FootSlide).expect("it stands")
    };
    let same = slide(0.15, 0.15);
    let (value, source) = (same.value.expect("it stands"), same.source_value.expect("it stands"));
    assert!(value > 1.0 && (value - source).abs() < 0.1, "the same foot with and without a mesh: {value} and {source}");
    assert_eq!(same.verdict, Verdict::Pass, "{same:?}");
    let more = slide(0.05, 0.15);
    assert!(more.verdict > Verdict::Pass, "it turns three times as far as the source's: {more:?}");
    assert!(slide(0.0, 0.15).source_value.expect("it stands") < 1e-6, "a source that stands still has none");
}

#[test]
fn one_joint_that_bends_for_the_whole_spine_is_a_kink() {
    let scene = walker();
    let bend = |names: &'static [&'static str], degrees: f64| {
        clip(&scene.skeleton, 10, |_, pose| {
            for name in names {
                let share = degrees.to_radians() / names.len() as f64;
                turn(pose, &scene.skeleton, name, DQuat::from_rotation_x(share));
            }
        })
    };
    let spread = bend(&["mixamorig:Spine", "mixamorig:Spine1", "mixamorig:Spine2"], 30.0);
    let kinked = bend(&["mixamorig:Spine1"], 30.0);
    let kink = |source: &Clip, result: &Clip| {
        let measures = measured(&scene, source, result, ReportDetail::Full);
        (value(&measures, MetricName::SpineKink), verdict(&measures, MetricName::SpineKink))
    };
    let straight = standing(&scene, 10);
    assert_eq!(kink(&straight, &kinked).1, Verdict::Fail, "30 degrees in one joint, and the source is straight");
    close(kink(&straight, &kinked).0, 30.0, 1e-3, "degrees");
    close(kink(&straight, &spread).0, 10.0, 1e-3, "a third each");
    close(kink(&kinked, &kinked).0, 0.0, 1e-3, "the source's own");
    close(kink(&spread, &kinked).0, 0.0, 1e-2, "no more than all that the source bends");
}

#[test]
fn a_knee_that_springs_is_named() {
    let scene = walker();
    let knees = |spring_at: Option<usize>| {
        clip(&scene.skeleton, 30, |frame, pose| {
            let sprung = if spring_at.is_some_and(|at| frame >= at) { 15.0 } else { 0.0 };
            let bend = (30.0 + frame as f64 + sprung).to_radians();
            turn(pose, &scene.skeleton, "mixamorig:LeftLeg", DQuat::from_rotation_x(bend));
        })
    };
    let (smooth, springs) = (knees(None), knees(Some(12)));
    let measures = measured(&scene, &smooth, &springs, ReportDetail::Summary);
    let metric = &measures.metrics[&MetricName::KneePop];
    close(metric.value.expect("a value"), 15.0, 0.1, "degrees per frame²");
    assert_eq!(metric.verdict, Verdict::Fail, "{metric:?}");
    assert_eq!(
        (metric.worst[0].part.as_str(), metric.worst[0].joint.as_str()),
        ("left_knee", "mixamorig:LeftLeg"),
        "where"
    );
    assert!((11..=12).contains(&metric.worst[0].frame), "when: {metric:?}");
    let own = measured(&scene, &springs, &springs, ReportDetail::Summary);
    close(value(&own, MetricName::KneePop), 0.0, 1e-6, "the source's own");
}

/// At twelve frames a second a knee that swings smoothly changes its speed by four times as much per frame as at 24, and turns by
/// twice as much.
#[test]
fn a_smooth_knee_passes_at_every_frame_rate() {
    let scene = walker();
    let measures = |fps: f64| {
        let swinging = |degrees: f64| {
            clip_at(fps, &scene.skeleton, 40, |frame, pose| {
                let phase = std::f64::consts::TAU * frame as f64 / fps;
                let bend = (80.0 - degrees * phase.cos()).to_radians();
                turn(pose, &scene.skeleton, "mixamorig:LeftLeg", DQuat::from_rotation_x(bend));
            })
        };
        measured(&scene, &swinging(5.0), &swinging(55.0), ReportDetail::Summary)
    };
    let (fine, film, coarse) = (measures(60.0), measures(24.0), measures(12.0));
    let (at_24, at_12) = (value(&film, MetricName::KneePop), value(&coarse, MetricName::KneePop));
    close(at_24, 50.0 * 2.0 * (1.0 - (std::f64::consts::TAU / 24.0).cos()), 0.02, "the second difference of the swing");
    close(at_12, at_24, 0.1, "a fourth of its own");
    let at_30 = 50.0 * 2.0 * (1.0 - (std::f64::consts::TAU / 30.0).cos());
    close(value(&fine, MetricName::KneePop), at_30, 0.02, "two frames of 60 a second are one of 30");
    for (measures, what) in [(fine, "60"), (film, "24"), (coarse, "12")] {
        close(value(&measures, MetricName::RotationJumps), 0.0, 0.0, what);
    }
}

#[test]
fn a_pelvis_that_sways_to_and_fro_is_told() {
    let scene = walker();
    let walk = &scene.clips[0];
    let swaying = |centimeters: f64| {
        clip(&scene.skeleton, walk.frame_count(), |frame, pose| {
            *pose = walk.local_pose(&scene.skeleton, frame);
            let phase = walk.times_seconds()[frame] * std::f64::consts::TAU * 2.0;
            move_root(pose, DVec3::X * (centimeters / 100.0 * leg(&scene) * phase.sin()));
        })
    };
    let sway = |result: &Clip| value(&measured(&scene, walk, result, ReportDetail::Full), MetricName::PelvisSway);
    close(sway(walk), 0.0, 1e-3, "the walk itself");
    close(sway(&swaying(6.0)), 6.0, 1.0, "twice a second");
}

#[test]
fn an_arm_in_the_belly_is_told() {
    let scene = walker();
    let apart = standing(&scene, 10);
    let measures = measured(&scene, &apart, &apart, ReportDetail::Full);
    close(value(&measures, MetricName::SelfPenetration), 0.0, 1e-9, "arms are out");
    // Whichever way the walker's arm axes lie, one of the four turns by 100 degrees brings the forearm into the trunk.
    let deepest = [DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z]
        .map(|axis| {
            let bent = clip(&scene.skeleton, 10, |_, pose| {
                turn(pose, &scene.skeleton, "mixamorig:LeftArm", DQuat::from_axis_angle(axis, 100.0_f64.to_radians()));
            });
            value(&measured(&scene, &apart, &bent, ReportDetail::Full), MetricName::SelfPenetration)
        })
        .into_iter()
        .fold(0.0, f64::max);
    assert!(deepest > 3.0, "the forearm is in the trunk: {deepest}");
}

/// The result with the tracks of some joints left out.
fn at_rest(scene: &Scene, source: &Clip, names: &[&str]) -> Measures {
    let held: Vec<usize> = names.iter().map(|name| joint(&scene.skeleton, name).0).collect();
    let tracks = source.joints().iter().enumerate().map(|(index, tracks)| {
        if held.contains(&index) { JointTracks { rotation: Track::Rest, ..tracks.clone() } } else { tracks.clone() }
    });
    let result = source.clone().with_joints(tracks.collect()).expect("as many");
    measured(scene, source, &result, ReportDetail::Full)
}

#[test]
fn a_limb_that_is_left_at_rest_is_no_pass() {
    let scene = walker();
    // The walk with arms that swing.
    let walk = clip(&scene.skeleton, 60, |frame, pose| {
        *pose = scene.clips[0].local_pose(&scene.skeleton, frame);
        let swing = DQuat::from_axis_angle(Vec3::Z.as_dvec3(), 0.5 * (frame as f64 * 0.2).sin());
        for name in ["mixamorig:RightArm", "mixamorig:RightForeArm"] {
            turn(pose, &scene.skeleton, name, swing);
        }
    });
    let whole = at_rest(&scene, &walk, &[]);
    close(value(&whole, MetricName::UndrivenBody), 0.0, 0.0, "all of it moves");
    let limp = at_rest(&scene, &walk, &["mixamorig:RightArm", "mixamorig:RightForeArm"]);
    let metric = &limp.metrics[&MetricName::UndrivenBody];
    assert_eq!(metric.verdict, Verdict::Fail, "an arm is left at rest: {metric:?}");
    assert!(metric.parts.contains_key("right_upper_arm") && metric.parts.contains_key("right_forearm"), "{metric:?}");
    assert_eq!(metric.worst[0].joint, "mixamorig:RightArm", "{metric:?}");
}

#[test]
fn a_figure_that_rests_in_the_air_is_looked_at_where_its_clip_stands() {
    let source = shod(0.0);
    let still = standing(&source, 20);
    // The same figure, laid out two meters above the floor; the result stands where the source does.
    let joints = source.skeleton.joints().iter().cloned().map(|mut joint| {
        if joint.parent.is_none() {
            joint.rest.translation += DVec3::Y * 2.0;
        }
        joint
    });
    let target = Scene { skeleton: Skeleton::new(joints.collect()).expect("parents come first"), ..source.clone() };
    let spec = RetargetSpec::default();
    let mut reporter = Reporter::new();
    let rig = |name, scene| Rig::new(name, scene, None, &spec.source, &mut Reporter::new()).expect("a rig");
    let (source_rig, target_rig) = (rig("source", &source), rig("target", &target));
    let mapping = resolve(&spec, &source_rig, &target_rig, &still, &mut reporter).expect("it maps").mapping;
    let detail = ReportChoice::Detail(ReportDetail::Full);
    let measures = measure(&mapping, &source_rig, &target_rig, &still, &still, &detail, &[]);
    let depth = value(&measures, MetricName::FloorPenetration);
    assert!(depth < 0.1, "it stands on the floor: {depth} cm in it");
}

#[test]
fn a_foot_that_is_held_in_the_air_does_not_stand() {
    let scene = shod(0.0);
    let on_one_leg = clip(&scene.skeleton, 30, |_, pose| {
        turn(pose, &scene.skeleton, "mixamorig:RightUpLeg", DQuat::from_rotation_x(-1.2));
    });
    let measures = measured(&scene, &on_one_leg, &on_one_leg, ReportDetail::Full);
    let parts: Vec<&str> = measures.contacts.iter().map(|contact| contact.part.as_str()).collect();
    assert!(!parts.is_empty() && parts.iter().all(|part| *part == "left_foot"), "{parts:?}");
}

#[test]
fn a_foot_that_would_be_in_the_floor_is_right_where_it_is_flatter() {
    let scene = shod(0.0);
    // Both glide along, so that no foot stands; the source's toes point down.
    let gliding = |height: f64, pitch: f64, heading: f64| {
        clip(&scene.skeleton, 20, |frame, pose| {
            move_root(pose, DVec3::new(0.0, height, 0.05 * frame as f64));
            let turned = DQuat::from_rotation_y(heading) * DQuat::from_rotation_x(pitch);
            turn(pose, &scene.skeleton, "mixamorig:LeftFoot", turned);
        })
    };
    let error = |height: f64, heading: f64| {
        let (source, result) = (gliding(height, -0.7, 0.0), gliding(height, 0.0, heading));
        measured(&scene, &source, &result, ReportDetail::Full).metrics[&MetricName::EndOrientation].parts["left_foot"]
    };
    assert!(error(0.0, 0.0) < 15.0, "near the floor: {}", error(0.0, 0.0));
    close(error(1.0, 0.0), 0.7_f64.to_degrees(), 0.5, "in the air");
    assert!(error(0.0, 0.6) > 25.0, "it heads elsewhere: {}", error(0.0, 0.6));
}

/// Jumps of a result on a rig that differs from the source's.
fn rotation_jumps(source: (&Scene, &Clip), target: (&Scene, &Clip)) -> f64 {
    value(&measured_onto(source, target, ReportDetail::Summary), MetricName::RotationJumps)
}

/// An angle at every other frame.
fn every_other(frame: usize, radians: f64) -> f64 {
    if frame.is_multiple_of(2) { 0.0 } else { radians }
}

/// A joint of the forearm takes half of what the hand is turned by: it follows the hand, as fast as that turns.
#[test]
fn a_twist_that_follows_a_fast_hand_does_not_jump() {
    let (source, mut target) = (walker(), walker());
    let mut joints = target.skeleton.joints().to_vec();
    let forearm = joint(&target.skeleton, "mixamorig:LeftForeArm").0;
    let half = joint(&target.skeleton, "mixamorig:LeftHand").1.translation * 0.5;
    let rest = Transform { translation: half, ..Transform::IDENTITY };
    let node = joints.len();
    joints.push(Joint { name: "LeftForeArmTwist".into(), parent: Some(forearm), rest, is_joint: true, node });
    target.skeleton = Skeleton::new(joints).expect("valid");
    let along = half.normalize();
    let turned = |frame: usize, by: f64| DQuat::from_axis_angle(along, every_other(frame, by));
    let waving = |scene: &Scene, hand: f64, twist: f64| {
        clip(&scene.skeleton, 10, |frame, pose| {
            turn(pose, &scene.skeleton, "mixamorig:LeftHand", turned(frame, hand));
            if scene.skeleton.find("LeftForeArmTwist").is_some() {
                turn(pose, &scene.skeleton, "LeftForeArmTwist", turned(frame, twist));
            }
        })
    };
    let jumps =
        |hand: f64| rotation_jumps((&source, &waving(&source, hand, 0.0)), (&target, &waving(&target, hand, 0.4)));
    close(jumps(0.8), 0.0, 0.0, "the hand turns twice as much");
    close(jumps(0.1), 9.0, 0.0, "the hand hardly turns");
}

/// Toes that stay on the floor while the heel rises turn as fast against the foot as that does, though the source's do not bend.
#[test]
fn toes_that_stay_flat_under_a_fast_heel_do_not_jump() {
    let scene = walker();
    let pitched = |frame: usize, by: f64| DQuat::from_rotation_x(every_other(frame, by));
    let raised = |foot: f64, toe: f64| {
        clip(&scene.skeleton, 10, |frame, pose| {
            turn(pose, &scene.skeleton, "mixamorig:LeftFoot", pitched(frame, foot));
            turn(pose, &scene.skeleton, "mixamorig:LeftToeBase", pitched(frame, toe));
        })
    };
    let jumps = |foot: f64| rotation_jumps((&scene, &raised(foot, 0.0)), (&scene, &raised(foot, -0.5)));
    close(jumps(0.3), 0.0, 0.0, "the foot turns by more than half of it");
    close(jumps(0.1), 9.0, 0.0, "the foot hardly turns");
}

/// A foot that hangs from the root of its rig and is carried by the shin: seen from the root it turns with the whole leg.
#[test]
fn a_loose_foot_that_turns_with_its_leg_does_not_jump() {
    let (source, mut target) = (walker(), walker());
    let model = target.skeleton.rest_pose().to_model(&target.skeleton);
    let foot = joint(&target.skeleton, "mixamorig:LeftFoot").0;
    let mut joints = target.skeleton.joints().to_vec();
    joints[foot].parent = Some(0);
    let [root, placed] = [0, foot].map(|joint| model.transforms()[joint]);
    let root_from_model = root.rotation.conjugate();
    joints[foot].rest = Transform {
        translation: root_from_model * (placed.translation - root.translation),
        rotation: root_from_model * placed.rotation,
        ..placed
    };
    target.skeleton = Skeleton::new(joints).expect("valid");
    let turned = |frame: usize, by: f64| DQuat::from_rotation_x(every_other(frame, by));
    let kicking = |by: f64| {
        clip(&source.skeleton, 10, |frame, pose| {
            turn(pose, &source.skeleton, "mixamorig:LeftUpLeg", turned(frame, by));
        })
    };
    let result = clip(&target.skeleton, 10, |frame, pose| {
        turn(pose, &target.skeleton, "mixamorig:LeftFoot", turned(frame, 0.6));
    });
    close(rotation_jumps((&source, &kicking(0.6)), (&target, &result)), 0.0, 0.0, "its leg turns as much");
    close(rotation_jumps((&source, &kicking(0.1)), (&target, &result)), 9.0, 0.0, "its leg hardly turns");
}

/// The helpers of Unreal's rigs follow hands and move nothing: seen from each other they turn fast.
#[test]
fn helpers_that_move_no_vertex_do_not_jump() {
    let (source, mut scene) = (walker(), walker());
    let mut joints = scene.skeleton.joints().to_vec();
    let node = joints.len();
    joints.push(Joint { name: "ik_hand_gun".into(), parent: Some(0), rest: Transform::IDENTITY, is_joint: true, node });
    scene.skeleton = Skeleton::new(joints).expect("valid");
    let helper = joint(&scene.skeleton, "ik_hand_gun").0;
    let still = clip(&source.skeleton, 10, |_, _| {});
    let turned = |frame: usize| DQuat::from_rotation_x(every_other(frame, 0.8));
    let jumping = clip(&scene.skeleton, 10, |frame, pose| turn(pose, &scene.skeleton, "ik_hand_gun", turned(frame)));
    let mut jumps = |skinned: &[usize]| {
        let point = SkinPoint { position: Vec3::ZERO, weight: 1.0 };
        let entries: Vec<(u32, SkinPoint)> =
            skinned.iter().map(|joint| (u32::try_from(*joint).expect("few joints"), point)).collect();
        scene.skin_points = SkinPoints::new(scene.skeleton.len(), &entries);
        rotation_jumps((&source, &still), (&scene, &jumping))
    };
    close(jumps(&[0]), 0.0, 0.0, "it moves no vertex");
    close(jumps(&[0, helper]), 9.0, 0.0, "it moves one");
    close(jumps(&[]), 9.0, 0.0, "nobody knows what it moves");
}
