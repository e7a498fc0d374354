//! The samples are what their documentation says.

use glam::DVec3;

use crate::model::{Clip, Scene, Skeleton};

use super::{WALK_SPEED, mannequin, mannequin_scene, walk_clip, walk_scene};

fn positions(scene: &Scene, name: &str) -> Vec<DVec3> {
    let clip = &scene.clips[0];
    let joint = scene.skeleton.find(name).expect("the name is in the table");
    let at = |frame| clip.local_pose(&scene.skeleton, frame).to_model(&scene.skeleton).transforms()[joint].translation;
    (0..clip.frame_count()).map(at).collect()
}

fn height(skeleton: &Skeleton) -> f64 {
    let pose = skeleton.rest_pose().to_model(skeleton);
    pose.transforms().iter().map(|joint| joint.translation.y).fold(0.0, f64::max)
}

#[test]
fn the_walker_has_the_joints_of_a_mixamo_character() {
    let scene = walk_scene();
    assert_eq!(scene.skeleton.len(), 65, "with fingers and toes");
    assert!((height(&scene.skeleton) - 1.8).abs() < 1e-9, "1.80 m to the crown");
    for joint in scene.skeleton.joints() {
        let other = joint.name.replace(":Left", ":Right");
        assert!(scene.skeleton.find(&other).is_some(), "{} has a counterpart", joint.name);
    }
}

#[test]
fn the_walk_goes_forward_and_loops() {
    let scene = walk_scene();
    let clip: &Clip = &scene.clips[0];
    assert_eq!(clip.frame_count(), 121, "four seconds at thirty frames");
    let hips = positions(&scene, "mixamorig:Hips");
    assert!((hips[120].z - hips[0].z - 4.0 * WALK_SPEED).abs() < 1e-5, "four seconds of travel");
    for (index, tracks) in clip.joints().iter().enumerate() {
        let rest = scene.skeleton.joints()[index].rest.rotation.as_quat();
        let angle = tracks.rotation.at(0, rest).angle_between(tracks.rotation.at(120, rest));
        assert!(angle < 2e-3, "joint {index} ends as it begins, {angle}");
    }
}

#[test]
fn planted_feet_do_not_slide_or_sink() {
    let scene = walk_scene();
    for side in ["Left", "Right"] {
        let ball = positions(&scene, &format!("mixamorig:{side}ToeBase"));
        let resting = scene.skeleton.rest_pose().to_model(&scene.skeleton);
        let joint = scene.skeleton.find(&format!("mixamorig:{side}ToeBase")).expect("a toe");
        let rest_height = resting.transforms()[joint].translation.y;
        let mut planted_frames = 0;
        for pair in ball.windows(2) {
            let planted = pair.iter().all(|point| (point.y - rest_height).abs() < 1e-6);
            planted_frames += usize::from(planted);
            assert!(!planted || pair[0].distance(pair[1]) < 1e-6, "{side}: a ball on the ground stays where it is");
        }
        assert!(
            planted_frames >= 4 * 12,
            "{side}: the ball is on the ground for nearly half of each cycle, {planted_frames}"
        );
        assert!(ball.iter().all(|point| point.y > rest_height - 1e-6), "{side}: never below the ground");
    }
}

#[test]
fn legs_reach_their_feet() {
    let scene = walk_scene();
    for side in ["Left", "Right"] {
        let [hip, knee, foot] =
            ["UpLeg", "Leg", "Foot"].map(|part| positions(&scene, &format!("mixamorig:{side}{part}")));
        for frame in 0..hip.len() {
            let length = hip[frame].distance(knee[frame]) + knee[frame].distance(foot[frame]);
            let stretch = hip[frame].distance(foot[frame]) / length;
            assert!(stretch < 0.999, "{side} at frame {frame}: the leg is bent, {stretch}");
        }
    }
}

#[test]
fn the_mannequin_is_of_other_proportions() {
    let (walker, mannequin) = (walk_scene().skeleton, mannequin_scene().skeleton);
    let rest = |skeleton: &Skeleton, joint: &str| {
        let index = skeleton.find(joint).expect("the name is in the table");
        skeleton.rest_pose().to_model(skeleton).transforms()[index]
    };
    let leg = rest(&mannequin, "thigh_l").translation.y / 1.65;
    let walker_leg = rest(&walker, "mixamorig:LeftUpLeg").translation.y / 1.8;
    assert!(leg > walker_leg + 0.03, "longer legs for its height");
    let (shoulder, elbow) = (rest(&mannequin, "upperarm_l"), rest(&mannequin, "lowerarm_l"));
    let down = (shoulder.translation - elbow.translation).y / shoulder.translation.distance(elbow.translation);
    assert!((down.asin().to_degrees() - 45.0).abs() < 1e-6, "the arm is 45 degrees down");
    for (side, sign) in [("_l", 1.0), ("_r", -1.0)] {
        let [upper, lower] = ["upperarm", "lowerarm"].map(|part| rest(&mannequin, &format!("{part}{side}")));
        let bone = (lower.translation - upper.translation).normalize();
        assert!((upper.rotation * DVec3::X * sign).distance(bone) < 1e-9, "{side}: X along the bone");
    }
}

#[test]
fn the_files_are_the_same_every_time() {
    assert_eq!(walk_clip(), walk_clip(), "the walk");
    assert_eq!(mannequin(), mannequin(), "the mannequin");
}
