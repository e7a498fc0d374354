//! Key reduction: what is left gives the motion back, measured on the file that was written.

use std::sync::Arc;

use glam::{DVec3, Quat, Vec3};
use retargetd::{
    editing::{Reduction, Tolerance, reduce_keys},
    engine::{self, EditInputs, Format, Limits, NamedBytes},
    formats::{self, Include, TargetClips, WriteOptions},
    model::{Clip, Control, Joint, JointContacts, JointTracks, Reporter, Scene, Skeleton, Track, Transform},
    retarget::{KeyInterpolation, RetargetSpec},
    rig::Rig,
    samples,
};
use serde_json::json;

use super::{edited, real_clips};

const TOLERANCE_METERS: f64 = 0.0005;
const SHELL_METERS: f64 = 0.1;

/// The most that points on the shells of all joints differ between two clips of the same frames, in meters.
fn worst(scene: &Scene, ours: &Clip, theirs: &Clip, unit: f64) -> f64 {
    assert_eq!(ours.frame_count(), theirs.frame_count(), "frames");
    let points = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z];
    let pose = |clip: &Clip, frame| clip.local_pose(&scene.skeleton, frame).to_model(&scene.skeleton);
    let mut worst = 0.0_f64;
    for frame in 0..ours.frame_count() {
        let (ours, theirs) = (pose(ours, frame), pose(theirs, frame));
        for (one, other) in ours.transforms().iter().zip(theirs.transforms()) {
            for point in points {
                let at = point * (SHELL_METERS / unit);
                let place = |of: &Transform| of.translation + of.rotation * at;
                worst = worst.max(place(one).distance(place(other)) * unit);
            }
        }
    }
    worst
}

fn reduced(scene: &Scene, clip: &Clip, unit: f64) -> Reduction {
    let tolerance = Tolerance {
        distance: TOLERANCE_METERS / unit,
        shell: SHELL_METERS / unit,
        interpolation: KeyInterpolation::Auto,
    };
    reduce_keys(clip, &scene.skeleton, tolerance, &Control::new()).expect("not canceled")
}

/// The clip as a reader of the file with the keys that are left sees it, at the frames of the original.
fn through_a_file(scene: &Scene, clip: &Clip, reduction: &Reduction) -> Clip {
    let sparse = clip.clone().with_sparse_keys(Arc::new(reduction.keys.clone()));
    let options = WriteOptions {
        include: Include::SkeletonAndAnimation,
        target_clips: TargetClips::Drop,
        ..WriteOptions::new(Format::Glb)
    };
    let mut reporter = Reporter::new();
    let bytes = formats::write(scene, &sparse, &options, &Control::new(), &mut reporter).expect("it is written");
    let read =
        formats::read(&bytes, Format::Glb, &Limits::default(), &Control::new(), &mut reporter).expect("it reads");
    let back = &read.clips[0];
    let span = (clip.duration_seconds() - back.duration_seconds()).abs();
    assert!(span < 1e-4 * clip.duration_seconds().max(1.0), "as long as before, off by {span} s");
    let frames = clip.frame_count();
    let resampled = edited(&read, back, json!({"fps": (frames - 1) as f64 / clip.duration_seconds()}));
    assert_eq!(resampled.frame_count(), frames, "frames of the original");
    // Joints keep their order, but may have been written as other nodes.
    let joints = scene.skeleton.joints().iter().map(|joint| {
        let found = read.skeleton.joints().iter().position(|other| other.name == joint.name).expect("a joint");
        resampled.joints()[found].clone()
    });
    Clip::new(String::new(), clip.times_seconds().to_vec(), joints.collect()).expect("a clip")
}

#[test]
fn what_is_left_gives_the_motion_back() {
    let scene = samples::walk_scene();
    let clip = &scene.clips[0];
    let reduction = reduced(&scene, clip, 1.0);
    let after = reduction.keys.count();
    assert!(after * 2 < reduction.keys_before, "{after} of {} keys are left", reduction.keys_before);
    let back = through_a_file(&scene, clip, &reduction);
    let worst = worst(&scene, &back, clip, 1.0);
    assert!(worst <= TOLERANCE_METERS + 1e-5, "points move by {worst} m");
    assert!(worst <= reduction.worst.0 + 1e-5, "no more than was said: {worst} m, {} m", reduction.worst.0);
}

#[test]
fn real_clips_lose_less_than_half_a_millimeter() {
    for (name, scene) in real_clips() {
        let spec = RetargetSpec::default();
        let unit = Rig::new("source", &scene, None, &spec.source, &mut Reporter::new()).expect("a rig").unit_meters;
        let clip = scene.clips.iter().find(|clip| clip.is_animated()).expect("a clip");
        let reduction = reduced(&scene, clip, unit);
        let (before, after) = (reduction.keys_before, reduction.keys.count());
        assert!(reduction.worst.0 * unit <= TOLERANCE_METERS, "{name}: {:?}", reduction.worst);
        assert!(after * 5 < before * 2, "{name}: {after} of {before} keys are left");
        assert!(reduction.keys.bytes() < reduction.bytes_before, "{name}: and fewer bytes");
        if clip.uniform_fps().is_some() && name.ends_with("noskin.fbx") {
            let worst = worst(&scene, &through_a_file(&scene, clip, &reduction), clip, unit);
            assert!(worst <= TOLERANCE_METERS + 2e-5, "{name}: points of the file move by {worst} m");
        }
    }
}

fn arm(rotations: Vec<Quat>) -> Scene {
    let joint = |name: &str, parent, place| Joint {
        name: name.into(),
        parent,
        rest: Transform::from_translation(place),
        is_joint: true,
        node: parent.map_or(0, |parent: usize| parent + 1),
    };
    let joints = vec![joint("root", None, DVec3::ZERO), joint("tip", Some(0), DVec3::X)];
    let frames = rotations.len();
    let tracks = vec![
        JointTracks { rotation: Track::Sampled(rotations), ..JointTracks::default() },
        JointTracks { translation: Track::Sampled(vec![Vec3::X; frames]), ..JointTracks::default() },
    ];
    let times = (0..frames).map(|frame| frame as f64 / 30.0).collect();
    Scene {
        skeleton: Skeleton::new(joints).expect("a skeleton"),
        clips: vec![Clip::new("arm".into(), times, tracks).expect("a clip")],
        ..Scene::default()
    }
}

#[test]
fn straight_ways_need_their_ends_only() {
    let scene = arm((0..=60).map(|frame| Quat::from_rotation_z(frame as f32 * 0.02)).collect());
    let keys = reduced(&scene, &scene.clips[0], 1.0).keys;
    assert_eq!(keys.joints[0].rotation.frames, [0, 60], "a steady turn");
    assert_eq!(keys.joints[1].translation.frames, [0], "what stands still has one key");
    let bent = arm((0..=60_i32).map(|frame| Quat::from_rotation_z((frame - 30).abs() as f32 * 0.02)).collect());
    assert_eq!(reduced(&bent, &bent.clips[0], 1.0).keys.joints[0].rotation.frames, [0, 30, 60], "there and back");
    let still = arm(vec![Quat::IDENTITY; 61]);
    assert_eq!(
        reduced(&still, &still.clips[0], 1.0).keys.joints[0].rotation.frames,
        [0, 60],
        "one track keeps the length"
    );
}

#[test]
fn what_touches_the_ground_keeps_to_its_place() {
    let scene = samples::walk_scene();
    let clip = &scene.clips[0];
    let rig = Rig::new("source", &scene, None, &RetargetSpec::default().source, &mut Reporter::new()).expect("a rig");
    let foot = rig.role("left_foot")[0];
    let touches: Vec<bool> = (0..clip.frame_count()).map(|frame| frame % 30 < 15).collect();
    let contacts = vec![JointContacts { joint: foot, touches: touches.clone() }];
    let touching = clip.clone().with_contacts(contacts).expect("as long as the clip");
    let reduction = reduced(&scene, &touching, 1.0);
    let back = through_a_file(&scene, &touching, &reduction);
    let off = |frame: usize| {
        let place = |clip: &Clip| {
            clip.local_pose(&scene.skeleton, frame).to_model(&scene.skeleton).transforms()[foot].translation
        };
        place(&back).distance(place(clip))
    };
    let worst = |wanted: bool| {
        let frames = (0..touches.len()).filter(|frame| touches[*frame] == wanted);
        frames.map(off).fold(0.0, f64::max)
    };
    assert!(worst(true) <= TOLERANCE_METERS / 4.0 + 1e-6, "touching, the foot moves by {} m", worst(true));
    assert!(worst(false) > worst(true), "in the air it may move more: {} m", worst(false));
    let more = reduction.keys.count() as f64 / reduced(&scene, clip, 1.0).keys.count() as f64;
    assert!((1.0..1.6).contains(&more), "it takes {more} times the keys");
}

#[test]
fn without_tolerance_every_key_that_matters_is_kept() {
    let scene = samples::walk_scene();
    let clip = &scene.clips[0];
    let none = Tolerance { distance: 0.0, shell: 0.1, interpolation: KeyInterpolation::Auto };
    let reduction = reduce_keys(clip, &scene.skeleton, none, &Control::new()).expect("not canceled");
    assert_eq!((reduction.keys.count(), reduction.worst.0), (reduction.keys_before, 0.0), "nothing is lost");
}

#[test]
fn an_output_tells_how_many_keys_it_needs() {
    let walk = samples::walk_clip();
    let config =
        br#"{"output": [{"format": "glb", "keys": "needed"}, {"format": "bvh", "keys": {"shell_meters": 0.2}}]}"#;
    let inputs = EditInputs {
        source: NamedBytes { name: "walk.glb", bytes: &walk },
        source_rest: None,
        unread_target: false,
        config: Some(NamedBytes { name: "config.json", bytes: config }),
        formats: &[],
    };
    let outcome = engine::edit(&inputs, &Limits::default(), &Control::new()).expect("an outcome");
    let [keys] = &outcome.report.keys[..] else { panic!("one output has fewer keys: {:?}", outcome.report.keys) };
    assert_eq!(keys.format, "glb", "the one that can");
    assert!(keys.keys_after * 2 < keys.keys_before && keys.worst_millimeters <= 0.5, "{keys:?}");
    let codes: Vec<&str> = outcome.report.warnings.iter().map(|warning| warning.code).collect();
    assert!(codes.contains(&"keys_all_written"), "and the one that cannot says so: {codes:?}");
}
