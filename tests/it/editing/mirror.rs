//! Swapping left and right.

use glam::{DQuat, DVec3, Quat, Vec3};
use retargetd::{
    editing::{Mirror, mirror_components},
    engine::{self, EditInputs, NamedBytes},
    model::{Clip, Control, Joint, JointTracks, Reporter, Scene, Skeleton, Track, Transform},
    retarget::{ComponentAxis, MirrorAxis, MirrorPlane, Plan, Resolved, RetargetSpec, resolve, run},
    rig::{RestSource, Rig},
    samples,
};

use super::real_clips;

/// Every joint's own axes turned at random; where joints are does not change.
fn with_other_axes(scene: &Scene, seed: u64) -> Scene {
    let mut state = seed;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let turns: Vec<DQuat> = (0..scene.skeleton.len())
        .map(|_| DQuat::from_xyzw(random(), random(), random(), random() + 1e-3).normalize())
        .collect();
    with_axes(scene, &turns)
}

/// Every joint's own axes turned; where joints are does not change.
fn with_axes(scene: &Scene, turns: &[DQuat]) -> Scene {
    let above = |parent: Option<usize>| parent.map_or(DQuat::IDENTITY, |parent| turns[parent].conjugate());
    let joints = scene.skeleton.joints().iter().enumerate().map(|(index, joint)| Joint {
        rest: Transform {
            translation: above(joint.parent) * joint.rest.translation,
            rotation: above(joint.parent) * joint.rest.rotation * turns[index],
            scale: joint.rest.scale,
        },
        ..joint.clone()
    });
    let clips = scene.clips.iter().map(|clip| {
        let tracks = clip.joints().iter().enumerate().map(|(index, tracks)| {
            let parent = above(scene.skeleton.parent(index));
            let place = |value: &Vec3| (parent * value.as_dvec3()).as_vec3();
            let turn = |value: &Quat| (parent * value.as_dquat() * turns[index]).normalize().as_quat();
            JointTracks {
                translation: map(&tracks.translation, place),
                rotation: map(&tracks.rotation, turn),
                scale: Track::Rest,
            }
        });
        Clip::new(clip.name().into(), clip.times_seconds().to_vec(), tracks.collect()).expect("a clip")
    });
    Scene {
        clips: clips.collect(),
        skeleton: Skeleton::new(joints.collect()).expect("a skeleton"),
        axes: scene.axes,
        unit_meters: scene.unit_meters,
        ..Scene::default()
    }
}

fn map<T: Copy>(track: &Track<T>, change: impl Fn(&T) -> T) -> Track<T> {
    match track {
        Track::Rest => Track::Rest,
        Track::Constant(value) => Track::Constant(change(value)),
        Track::Sampled(values) => Track::Sampled(values.iter().map(change).collect()),
    }
}

fn rig(scene: &Scene) -> Rig<'_> {
    Rig::new("source", scene, None, &RetargetSpec::default().source, &mut Reporter::new()).expect("a rig")
}

fn mirrored(scene: &Scene, clip: &Clip, plane: MirrorPlane) -> Clip {
    Mirror::new(&rig(scene), &[]).apply(clip, plane).expect("a clip")
}

fn places(scene: &Scene, clip: &Clip, frame: usize) -> Vec<DVec3> {
    let pose = clip.local_pose(&scene.skeleton, frame).to_model(&scene.skeleton);
    pose.transforms().iter().map(|transform| transform.translation).collect()
}

fn assert_same_places(scene: &Scene, ours: &Clip, expected: &Clip, most: f64, what: &str) {
    assert_eq!(ours.frame_count(), expected.frame_count(), "{what}: frames");
    let worst = (0..ours.frame_count())
        .flat_map(|frame| places(scene, ours, frame).into_iter().zip(places(scene, expected, frame)))
        .map(|(ours, expected)| ours.distance(expected))
        .fold(0.0, f64::max);
    assert!(worst <= most, "{what}: places differ by {worst}, at most {most}");
}

#[test]
fn places_mirror_whatever_the_axes_are() {
    let plain = samples::walk_scene();
    for seed in 1..5 {
        let scene = with_other_axes(&plain, seed);
        let rig = rig(&scene);
        let mirror = Mirror::new(&rig, &[]);
        assert!(mirror.twins().lonely.is_empty(), "everyone has a twin: {:?}", mirror.twins().lonely);
        let clip = &scene.clips[0];
        let image = mirror.apply(clip, MirrorPlane::Rest).expect("a clip");
        for frame in (0..clip.frame_count()).step_by(7) {
            let (ours, theirs) = (places(&scene, &image, frame), places(&scene, clip, frame));
            for (joint, place) in ours.iter().enumerate() {
                let expected = theirs[mirror.twins().of(joint)] * DVec3::new(-1.0, 1.0, 1.0);
                let error = place.distance(expected) / 1.8;
                assert!(error < 1e-5, "axes {seed}, frame {frame}, joint {joint}: off by {error} of the size");
            }
        }
    }
}

/// The scene with every joint's axes as riggers make them: on the left turned at random about the figure's left, on the right those of
/// the left mirrored and reversed.
fn with_riggers_axes(scene: &Scene) -> Scene {
    let rig = rig(scene);
    let twins = Mirror::new(&rig, &[]).twins().clone();
    let angle = |joint: usize| (joint as f64 * 2.399).rem_euclid(std::f64::consts::TAU);
    let turn = |joint: usize| {
        let twin = twins.of(joint);
        let of = |joint: usize| rig.rest.transforms()[joint].rotation;
        let wanted = if twin == joint {
            DQuat::from_rotation_x(angle(joint))
        } else {
            let left = joint.min(twin);
            let axes = DQuat::from_rotation_y(angle(left)) * DQuat::from_rotation_z(angle(left + 7));
            if joint == left { axes } else { DQuat::from_rotation_x(std::f64::consts::PI) * axes }
        };
        of(joint).conjugate() * wanted
    };
    let turns: Vec<DQuat> = (0..scene.skeleton.len()).map(turn).collect();
    with_axes(scene, &turns)
}

#[test]
fn by_components_is_the_same_where_the_rig_is_made_for_it() {
    let scene = with_riggers_axes(&samples::walk_scene());
    let rig = rig(&scene);
    let mirror = Mirror::new(&rig, &[]);
    let clip = &scene.clips[0];
    let general = mirror.apply(clip, MirrorPlane::Rest).expect("a clip");
    let components = mirror_components(&rig, &mirror, clip, None, None).expect("a clip");
    assert_same_places(&scene, &components, &general, 2e-5, "found axes");
    let x = Some(MirrorAxis::Both(ComponentAxis::X));
    let given = mirror_components(&rig, &mirror, clip, x, x).expect("a clip");
    assert_same_places(&scene, &given, &general, 2e-5, "given axes");
    let other = with_other_axes(&samples::walk_scene(), 3);
    let rig = super::mirror::rig(&other);
    let mirror = Mirror::new(&rig, &[]);
    let wrong = mirror_components(&rig, &mirror, &other.clips[0], None, None).expect("a clip");
    let right = mirror.apply(&other.clips[0], MirrorPlane::Rest).expect("a clip");
    let (one, two) = (places(&other, &wrong, 5), places(&other, &right, 5));
    let far = one.iter().zip(two).map(|(one, two)| one.distance(two));
    assert!(far.fold(0.0, f64::max) > 0.05, "on other axes it is not, which is why it is not the default");
}

#[test]
fn mirroring_twice_is_the_clip() {
    let scene = with_other_axes(&samples::walk_scene(), 9);
    let clip = &scene.clips[0];
    for plane in [MirrorPlane::Rest, MirrorPlane::Start] {
        let back = mirrored(&scene, &mirrored(&scene, clip, plane), plane);
        assert_same_places(&scene, &back, clip, 2e-5, &format!("{plane:?}"));
    }
}

#[test]
fn what_is_not_symmetric_about_a_real_rig_is_said() {
    let mut told = 0;
    for (name, scene) in real_clips() {
        let rig = rig(&scene);
        let mirror = Mirror::new(&rig, &[]);
        let asymmetry = mirror.twins().asymmetry.map_or(0.0, |(_, share)| share);
        let Some(path) = crate::support::corpus_file(name) else { continue };
        let bytes = std::fs::read(&path).expect("the file");
        let file = path.file_name().expect("a name").to_string_lossy();
        let inputs = EditInputs {
            source: NamedBytes { name: &file, bytes: &bytes },
            source_rest: None,
            unread_target: false,
            config: Some(NamedBytes { name: "config.json", bytes: br#"{"edit": {"mirror": true}}"# }),
            formats: &[engine::Format::PosesJson],
        };
        let outcome = engine::edit(&inputs, &engine::Limits::default(), &Control::new()).expect("an outcome");
        let is_told = outcome.report.warnings.iter().any(|warning| warning.code == "mirror_asymmetric_rest");
        assert_eq!(is_told, asymmetry > 0.02, "{name}: off by {asymmetry} of its size");
        told += usize::from(is_told);
        let clip = scene.clips.iter().find(|clip| clip.is_animated()).expect("a clip");
        let image = mirror.apply(clip, MirrorPlane::Start).expect("a clip");
        for tracks in image.joints() {
            if let Track::Sampled(values) = &tracks.rotation {
                assert!(
                    values.windows(2).all(|pair| pair[0].dot(pair[1]) >= 0.0),
                    "{name}: a quaternion flips its sign"
                );
            }
        }
    }
    assert!(told < 5, "not all of them are crooked");
}

#[test]
fn real_clips_come_back() {
    for (name, scene) in real_clips() {
        let rig = rig(&scene);
        let mirror = Mirror::new(&rig, &[]);
        let clip = scene.clips.iter().find(|clip| clip.is_animated()).expect("a clip");
        let there = mirror.apply(clip, MirrorPlane::Rest).expect("a clip");
        let back = mirror.apply(&there, MirrorPlane::Rest).expect("a clip");
        let size = places(&scene, clip, 0).iter().map(|place| place.length()).fold(0.0, f64::max);
        assert_same_places(&scene, &back, clip, size * 1e-4, name);
    }
}

#[test]
fn a_left_step_becomes_a_right_one() {
    let scene = samples::walk_scene();
    let (left, right) = ["LeftFoot", "RightFoot"]
        .map(|name| scene.skeleton.joints().iter().position(|joint| joint.name.ends_with(name)).expect("a foot"))
        .into();
    let clip = &scene.clips[0];
    let rig = rig(&scene);
    let pelvis = rig.role("pelvis")[0];
    let image = Mirror::new(&rig, &[]).apply(clip, MirrorPlane::Start).expect("a clip");
    // The plane stands upright through the first frame's pelvis, along the way that it faces there.
    let first = clip.local_pose(&scene.skeleton, 0).to_model(&scene.skeleton).transforms()[pelvis];
    let facing = first.rotation * rig.rest.transforms()[pelvis].rotation.conjugate() * DVec3::Z;
    let lateral = DVec3::Y.cross(DVec3::new(facing.x, 0.0, facing.z).normalize());
    for frame in [0, 10, 40] {
        let (ours, theirs) = (places(&scene, &image, frame), places(&scene, clip, frame));
        for (foot, other) in [(left, right), (right, left)] {
            let off = theirs[other] - first.translation;
            let expected = theirs[other] - lateral * (2.0 * off.dot(lateral));
            let error = ours[foot].distance(expected);
            assert!(error < 1e-4, "frame {frame}: joint {foot} is {error} m from the mirror image of joint {other}");
        }
    }
    assert!(places(&scene, &image, 0)[pelvis].distance(first.translation) < 1e-4, "it starts where it did");
}

#[test]
fn mirroring_commutes_with_retargeting() {
    let (source, target) = (samples::walk_scene(), samples::mannequin_scene());
    let spec = RetargetSpec::default();
    let retarget = |clip: &Clip| {
        let mut reporter = Reporter::new();
        let from = Rig::new("source", &source, None, &spec.source, &mut reporter).expect("a source");
        let onto = Rig::new("target", &target, None, &spec.target, &mut reporter).expect("a target");
        let Resolved { mapping, .. } = resolve(&spec, &from, &onto, clip, &mut reporter).expect("a mapping");
        run(&Plan::new(from.skeleton(), onto.skeleton(), &mapping), clip, &Control::new()).expect("a result")
    };
    let before = retarget(&mirrored(&source, &source.clips[0], MirrorPlane::Rest));
    let after = mirrored(&target, &retarget(&source.clips[0]), MirrorPlane::Rest);
    assert_same_places(&target, &before, &after, 1e-4, "mirror, then retarget");
}

#[test]
fn what_hands_carry_changes_hands() {
    let plain = samples::walk_scene();
    let hand = |name: &str| plain.skeleton.find(name).expect("a hand");
    let rest = plain.skeleton.rest_pose().to_model(&plain.skeleton);
    let mut joints = plain.skeleton.joints().to_vec();
    let mut tracks = plain.clips[0].joints().to_vec();
    let frames = plain.clips[0].frame_count();
    for (name, hand, side) in
        [("sword_l", hand("mixamorig:LeftHand"), 1.0), ("sword_r", hand("mixamorig:RightHand"), -1.0)]
    {
        // Half a meter ahead of the hand, in the model's axes; the one on the right is swung about.
        let from_hand = rest.transforms()[hand].rotation.conjugate();
        let place = DVec3::new(0.1 * side, 0.0, 0.5);
        let rest = Transform { translation: from_hand * place, rotation: from_hand, scale: DVec3::ONE };
        joints.push(Joint { name: name.into(), parent: Some(hand), rest, is_joint: true, node: joints.len() });
        let swing = |frame: usize| (from_hand * DQuat::from_rotation_x(frame as f64 * 0.05)).as_quat();
        let shift = |frame: usize| (from_hand * (place + DVec3::Y * frame as f64 * 0.002)).as_vec3();
        tracks.push(if side < 0.0 {
            JointTracks {
                translation: Track::Sampled((0..frames).map(shift).collect()),
                rotation: Track::Sampled((0..frames).map(swing).collect()),
                scale: Track::Rest,
            }
        } else {
            JointTracks::default()
        });
    }
    let clip = Clip::new("fight".into(), plain.clips[0].times_seconds().to_vec(), tracks).expect("a clip");
    let skeleton = Skeleton::new(joints).expect("a skeleton");
    let scene =
        Scene { skeleton, clips: vec![clip], axes: plain.axes, unit_meters: plain.unit_meters, ..Scene::default() };
    let image = mirrored(&scene, &scene.clips[0], MirrorPlane::Rest);
    let [left, right] = ["sword_l", "sword_r"].map(|name| scene.skeleton.find(name).expect("a sword"));
    for frame in (0..frames).step_by(9) {
        let (ours, theirs) = (places(&scene, &image, frame), places(&scene, &scene.clips[0], frame));
        for (joint, twin) in [(left, right), (right, left)] {
            let error = ours[joint].distance(theirs[twin] * DVec3::new(-1.0, 1.0, 1.0));
            assert!(error < 2e-5, "frame {frame}: the sword is {error} m from its mirror image");
        }
    }
}

#[test]
fn a_given_table_says_who_changes_sides() {
    // Two joints that nothing pairs: other names, other places.
    let plain = samples::walk_scene();
    let parent = plain.skeleton.find("mixamorig:Spine").expect("a spine");
    let mut joints = plain.skeleton.joints().to_vec();
    let mut tracks = plain.clips[0].joints().to_vec();
    let frames = plain.clips[0].frame_count();
    let turn = |frame: usize| Quat::from_rotation_z(frame as f32 * 0.01) * Quat::from_rotation_y(0.2);
    for (name, place) in [("lantern", DVec3::new(0.3, 0.1, 0.0)), ("rope", DVec3::new(-0.1, 0.4, 0.2))] {
        let rest = Transform::from_translation(place);
        joints.push(Joint { name: name.into(), parent: Some(parent), rest, is_joint: true, node: joints.len() });
        let rotation = if name == "rope" { Track::Sampled((0..frames).map(turn).collect()) } else { Track::Rest };
        tracks.push(JointTracks { rotation, ..JointTracks::default() });
    }
    let clip = Clip::new("work".into(), plain.clips[0].times_seconds().to_vec(), tracks).expect("a clip");
    let skeleton = Skeleton::new(joints).expect("a skeleton");
    let (lantern, rope) = (skeleton.find("lantern").expect("it"), skeleton.find("rope").expect("it"));
    let scene =
        Scene { skeleton, clips: vec![clip], axes: plain.axes, unit_meters: plain.unit_meters, ..Scene::default() };
    let rig = rig(&scene);
    let turned = |pairs: &[(usize, usize)]| {
        let image = Mirror::new(&rig, pairs).apply(&scene.clips[0], MirrorPlane::Rest).expect("a clip");
        [lantern, rope].map(|joint| {
            let rest = scene.skeleton.joints()[joint].rest.rotation.as_quat();
            image.joints()[joint].rotation.at(frames - 1, rest).angle_between(rest)
        })
    };
    let angle = turn(frames - 1).angle_between(Quat::IDENTITY);
    let [lantern_alone, rope_alone] = turned(&[]);
    assert!(
        lantern_alone < 1e-3 && (rope_alone - angle).abs() < 1e-3,
        "each mirrors its own: {lantern_alone}, {rope_alone}"
    );
    let [lantern_paired, rope_paired] = turned(&[(lantern, rope)]);
    assert!((lantern_paired - angle).abs() < 1e-3 && rope_paired < 1e-3, "swapped: {lantern_paired}, {rope_paired}");
}

#[test]
fn components_take_an_axis_for_rotations_and_one_for_translations() {
    let scene = with_riggers_axes(&samples::walk_scene());
    let rig = rig(&scene);
    let mirror = Mirror::new(&rig, &[]);
    let clip = &scene.clips[0];
    let axis = |text: &str| serde_json::from_str::<MirrorAxis>(text).ok();
    let found = mirror_components(&rig, &mirror, clip, axis(r#""x""#), axis(r#""x""#)).expect("a clip");
    let other = axis(r#"{"rotation": "x", "translation": "z"}"#);
    assert!(other.is_some(), "two axes are understood");
    let moved = mirror_components(&rig, &mirror, clip, axis(r#""x""#), other).expect("a clip");
    let pelvis = rig.role("pelvis")[0];
    assert_eq!(moved.joints()[pelvis].rotation, found.joints()[pelvis].rotation, "rotations have the same axis");
    let translation =
        |clip: &Clip, frame: usize| clip.local_pose(&scene.skeleton, frame).transforms()[pelvis].translation;
    let rest = scene.skeleton.joints()[pelvis].rest.translation;
    for frame in 0..clip.frame_count() {
        let change = translation(clip, frame) - rest;
        let wanted = rest + DVec3::new(change.x, change.y, -change.z);
        assert!(translation(&moved, frame).distance(wanted) < 1e-5, "frame {frame}: along Z");
    }
}

/// A capture whose zero pose is symmetric, though nobody could stand in it: its rest pose is a frame of the motion, which is not.
#[test]
fn captures_mirror_about_a_symmetric_zero_pose() {
    let scene = samples::walk_scene();
    let clip = &scene.clips[0];
    let mut rig = rig(&scene);
    let stride = clip.local_pose(&scene.skeleton, 20);
    rig.rest = stride.to_model(&scene.skeleton);
    rig.rest_local = stride;
    rig.rest_source = RestSource::StandingFrame;
    let mirror = Mirror::new(&rig, &[]);
    let asymmetry = mirror.twins().asymmetry.map_or(0.0, |(_, share)| share);
    assert!(asymmetry < 1e-6, "the zero pose is taken: {asymmetry}");
    let image = mirror.apply(clip, MirrorPlane::Rest).expect("a clip");
    let lateral = rig.canonical_from_scene.conjugate() * DVec3::X;
    let middle = rig.rest.transforms()[rig.role("pelvis")[0]].translation;
    for frame in (0..clip.frame_count()).step_by(7) {
        let (ours, theirs) = (places(&scene, &image, frame), places(&scene, clip, frame));
        for (joint, place) in ours.iter().enumerate() {
            let twin = theirs[mirror.twins().of(joint)];
            let expected = twin - lateral * (2.0 * (twin - middle).dot(lateral));
            let error = place.distance(expected);
            assert!(error < 1e-4, "frame {frame}, joint {joint}: off by {error} m");
        }
    }
    // Where somebody chose the frame, that is measured from.
    rig.rest_source = RestSource::ClipFrame;
    let asymmetry = Mirror::new(&rig, &[]).twins().asymmetry.map_or(0.0, |(_, share)| share);
    assert!(asymmetry > 0.02, "the frame is kept: {asymmetry}");
}
