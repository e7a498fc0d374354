//! Are joints below a stretching node where a viewer shows them, and do they keep their lengths?

use super::*;
use crate::model::Joint;

fn joint(parent: Option<usize>, rest: Transform) -> Joint {
    Joint { name: String::new(), parent, rest, is_joint: parent.is_some(), node: 0 }
}

/// An armature that is stretched upwards, and an arm of three joints that is turned in it.
fn arm(stretch: f64) -> Skeleton {
    let turned = |x: f64, angle: f64| Transform {
        translation: DVec3::new(x, 0.0, 0.1 * x),
        rotation: DQuat::from_euler(glam::EulerRot::XYZ, 0.3, angle, angle),
        scale: DVec3::ONE,
    };
    let armature = Transform { scale: DVec3::new(1.0, stretch, 1.0), ..Transform::IDENTITY };
    Skeleton::new(vec![
        joint(None, armature),
        joint(Some(0), turned(0.5, 0.7)),
        joint(Some(1), turned(1.0, -0.4)),
        joint(Some(2), turned(0.8, 0.9)),
    ])
    .expect("parents come first")
}

fn scene(stretch: f64) -> Scene {
    straightened(Scene { skeleton: arm(stretch), ..Scene::default() })
}

fn straightened(scene: Scene) -> Scene {
    match Stretched::of(&scene.skeleton) {
        Some(stretched) => stretched.straighten(scene).expect("finite"),
        None => scene,
    }
}

/// The arm swings about its first joint and bends at the second.
fn swing(skeleton: &Skeleton) -> Clip {
    let turns = |joint: usize, step: f64| {
        let own = skeleton.joints()[joint].rest.rotation;
        let keys = (0..5).map(|frame| (DQuat::from_rotation_z(step * f64::from(frame)) * own).as_quat().normalize());
        JointTracks { rotation: Track::Sampled(keys.collect()), ..JointTracks::default() }
    };
    let tracks = vec![JointTracks::default(), turns(1, 0.4), turns(2, -0.3), JointTracks::default()];
    Clip::new("swing".into(), (0..5).map(f64::from).collect(), tracks).expect("valid")
}

fn places(matrices: &[DMat4]) -> Vec<DVec3> {
    matrices.iter().map(|matrix| matrix.w_axis.truncate()).collect()
}

#[test]
fn joints_that_only_a_clip_stretches_are_where_it_shows_them() {
    let skeleton = arm(1.0);
    let mut tracks = swing(&skeleton).joints().to_vec();
    let plain = Clip::new("swing".into(), (0..5).map(f64::from).collect(), tracks.clone()).expect("valid");
    assert_eq!(joints_stretched_in(&skeleton, &plain), 0, "turning stretches nothing");
    let squash = |frame: u8| Vec3::new(1.0, 1.0 + 0.3 * f32::from(frame), 1.0 - 0.1 * f32::from(frame));
    tracks[1].scale = Track::Sampled((0..5).map(squash).collect());
    let clip = Clip::new("squash".into(), (0..5).map(f64::from).collect(), tracks).expect("valid");
    assert_eq!(joints_stretched_in(&skeleton, &clip), 3, "the joint and what is below it");
    let straight = straightened_clip(&skeleton, &clip).expect("finite");
    for frame in 0..5 {
        let shown = places(&matrices(&skeleton, clip.local_pose(&skeleton, frame).transforms()));
        let ours = straight.local_pose(&skeleton, frame).to_model(&skeleton);
        for (shown, ours) in shown.iter().zip(ours.transforms()) {
            assert!(shown.distance(ours.translation) < 1e-6, "frame {frame}: {shown} and {}", ours.translation);
            assert!((ours.scale.max_element() - ours.scale.min_element()).abs() < 1e-6, "nothing shears what is below");
        }
    }
}

#[test]
fn an_even_scale_is_no_stretching() {
    assert!(scene(1.0).stretched.is_none(), "nothing to do");
    let doubled = Transform { scale: DVec3::splat(2.0), ..Transform::IDENTITY };
    let mut joints = arm(1.0).joints().to_vec();
    joints[0].rest = doubled;
    let skeleton = Skeleton::new(joints).expect("valid");
    let scene = straightened(Scene { skeleton: skeleton.clone(), ..Scene::default() });
    assert_eq!((scene.stretched, scene.skeleton), (None, skeleton), "as it was");
}

#[test]
fn joints_rest_where_the_matrices_put_them() {
    let file = arm(1.35);
    let scene = scene(1.35);
    let models = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let expected = places(&matrices(&file, file.rest_pose().transforms()));
    for (joint, (model, place)) in models.transforms().iter().zip(expected).enumerate() {
        assert!(model.translation.distance(place) < 1e-12, "joint {joint}: {} instead of {place}", model.translation);
        assert!(
            joint == 0 || model.scale.max_element() - model.scale.min_element() < 1e-12,
            "joint {joint}: one scale"
        );
    }
    let stretched = scene.stretched.expect("it is");
    assert_eq!(stretched.joint_count(), 4, "the armature and what it stretches");
    assert_eq!(stretched.nodes(), file.rest_pose().transforms(), "what the file has");
}

#[test]
fn turned_joints_keep_their_lengths_in_the_file_and_stand_where_they_do_here() {
    let scene = scene(1.35);
    let stretched = scene.stretched.as_ref().expect("it is");
    let clip = swing(&scene.skeleton);
    let written = stretched.clip_of_nodes(&scene.skeleton, &clip).expect("finite");
    let file = stretched.skeleton_of_nodes(&scene.skeleton);
    for frame in 0..clip.frame_count() {
        let here = clip.local_pose(&scene.skeleton, frame).to_model(&scene.skeleton);
        let seen = places(&matrices(&file, written.local_pose(&file, frame).transforms()));
        for (joint, place) in seen.iter().enumerate() {
            let expected = here.transforms()[joint].translation;
            assert!(place.distance(expected) < 1e-6, "frame {frame}, joint {joint}: {place} instead of {expected}");
        }
        let length = seen[2].distance(seen[3]);
        let at_rest = {
            let rest = places(&matrices(&file, stretched.nodes()));
            rest[2].distance(rest[3])
        };
        assert!((length - at_rest).abs() < 1e-6, "frame {frame}: {length} instead of {at_rest}");
    }
}

#[test]
fn a_pose_at_rest_gives_the_nodes_of_the_file() {
    let scene = scene(1.35);
    let stretched = scene.stretched.as_ref().expect("it is");
    let nodes = stretched.skeleton_of_nodes(&scene.skeleton);
    for (joint, (found, expected)) in nodes.joints().iter().zip(stretched.nodes()).enumerate() {
        let Transform { translation, rotation, scale } = found.rest;
        assert!(translation.distance(expected.translation) < 1e-9, "joint {joint}: {translation}");
        assert!(1.0 - rotation.dot(expected.rotation).abs() < 1e-12, "joint {joint}: {rotation}");
        assert!(scale.distance(expected.scale) < 1e-9, "joint {joint}: {scale}");
    }
    let still = Clip::new(String::new(), vec![0.0], vec![JointTracks::default(); 4]).expect("valid");
    assert!(!stretched.clip_of_nodes(&scene.skeleton, &still).expect("finite").is_animated(), "and no tracks");
}

#[test]
fn a_clip_of_the_file_is_read_as_a_viewer_shows_it() {
    let file = arm(1.35);
    let clip = swing(&file);
    let source = Scene { skeleton: file.clone(), clips: vec![clip.clone()], ..Scene::default() };
    let scene = straightened(source);
    for frame in 0..clip.frame_count() {
        let seen = places(&matrices(&file, clip.local_pose(&file, frame).transforms()));
        let here = scene.clips[0].local_pose(&scene.skeleton, frame).to_model(&scene.skeleton);
        for (joint, place) in seen.iter().enumerate() {
            let found = here.transforms()[joint].translation;
            assert!(place.distance(found) < 1e-6, "frame {frame}, joint {joint}: {found} instead of {place}");
        }
    }
}
