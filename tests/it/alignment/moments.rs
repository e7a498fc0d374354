//! Rest poses that are a frame of a clip: what such a frame tells, and what it does not.

use super::*;

#[test]
fn captures_without_a_rest_pose_are_measured_from_a_frame() {
    for path in ["bvh/rokoko/jesse_dance.bvh", "bvh/geno/Geno_bind.bvh"] {
        let Some(path) = corpus_file(path) else { continue };
        let figure = Figure::read(&path);
        let view = figure.inspection.rigs.first().expect("a body");
        assert!(["standing_frame", "solved"].contains(&view.rest_source), "{}: {}", figure.file_name, view.rest_source);
        assert_ne!(view.rest_reason, "", "{}: why", figure.file_name);
        assert_eq!((view.kind, view.up.is_some()), ("biped", true), "{}: a body that stands", figure.file_name);
    }
}

/// Formats that say their axes have a rest pose by design, and have none where they were written from a capture without one.
#[test]
fn captures_without_a_rest_pose_have_none_in_other_formats_either() {
    for path in ["bvh/bandai-namco/dataset-1_walk_normal_001.bvh", "bvh/rokoko/jesse_dance.bvh"] {
        let Some(path) = corpus_file(path) else { continue };
        let (source, target) = (Figure::read(&path), samples::mannequin_scene());
        let moved = |scene: &Scene| {
            let clip = scene.clips.iter().find(|clip| clip.is_animated()).expect("a clip");
            retargeted(scene, &target, clip, &spec(json!({})))
        };
        let of_capture = moved(&source.scene);
        let (spec, control) = (spec(json!({})), Control::new());
        let own = rig("source", &source.scene, &spec);
        let space = (own.axes, own.unit_meters);
        for format in [Format::PosesNpz, Format::Glb, Format::Fbx] {
            let options = WriteOptions { target_clips: TargetClips::Drop, ..WriteOptions::new(format) };
            let (clip, mut reporter) = (source.clip(), Reporter::new());
            let bytes = formats::write_in_space(&source.scene, &[], clip, space, &options, &control, &mut reporter);
            let name = format!("capture.{}", format.info().endings[0]);
            let written = read_scene(&bytes.expect("it can be written"), &name);
            let of_written = moved(&written);
            for frame in (0..of_capture.frame_count()).step_by(20) {
                let poses = [&of_capture, &of_written].map(|clip| world(&target.skeleton, Some((clip, frame))));
                for joint in 0..target.skeleton.len() {
                    let apart = position(&poses[0], joint).distance(position(&poses[1], joint));
                    let what = format!("{} as {name}", source.file_name);
                    assert!(apart < 0.02, "{what}: joint {joint} at frame {frame} is {apart:.3} m off");
                }
            }
        }
    }
}

/// The left foot of its first frame swings with its toes below the ankle, or even behind it.
#[test]
fn a_foot_that_swings_in_the_frame_that_is_measured_from_stands_flat_when_it_lands() {
    let files = ["bvh/bandai-namco/dataset-1_walk_normal_001.bvh", "readyplayerme/rpm_avatar_a.glb"];
    let Some([source, target]) = Figure::of_corpus(files) else { return };
    let clip = retargeted(&source.scene, &target.scene, source.clip(), &spec(json!({})));
    let rest = world(target.skeleton(), None);
    for side in ["left", "right"] {
        let [foot, toe] = ["foot", "toe"].map(|part| target.roles[&format!("{side}_{part}")]);
        let mut poses: Vec<Vec<DMat4>> =
            (0..clip.frame_count()).map(|frame| world(target.skeleton(), Some((&clip, frame)))).collect();
        let height = |pose: &Vec<DMat4>| position(pose, foot).y + position(pose, toe).y;
        poses.sort_by(|one, other| height(one).total_cmp(&height(other)));
        for pose in poses.iter().take(clip.frame_count() / 10) {
            let turned = rotation(pose, foot) * rotation(&rest, foot).conjugate();
            let tilted = (turned * DVec3::Y).angle_between(DVec3::Y).to_degrees();
            assert!(tilted < 15.0, "the {side} foot is tilted by {tilted:.1} degrees where it stands");
        }
    }
}

/// A mannequin whose feet slope otherwise between ankle and ball, as those of another shoe do.
fn with_sloping_feet(degrees: f64) -> Scene {
    let mut scene = samples::mannequin_scene();
    let rest = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let mut joints = scene.skeleton.joints().to_vec();
    for ball in ["ball_l", "ball_r"] {
        let joint = scene.skeleton.find(ball).expect("a ball");
        let ankle = rest.transforms()[scene.skeleton.parent(joint).expect("an ankle")];
        let bone = DVec3::new(0.0, -degrees.to_radians().sin(), degrees.to_radians().cos()) * 0.12;
        joints[joint].rest.translation = ankle.rotation.conjugate() * bone;
    }
    scene.skeleton = Skeleton::new(joints).expect("a skeleton");
    scene
}

#[test]
fn feet_are_tilted_as_the_soles_of_the_frame_that_is_measured_from() {
    let source = samples::walk_scene();
    let bind = source.skeleton.rest_pose().to_model(&source.skeleton);
    let pitch = |pose: &ModelPose, skeleton: &Skeleton, ankle: &str, ball: &str| {
        let place = |name: &str| pose.transforms()[skeleton.find(name).expect("a joint")].translation;
        (place(ball) - place(ankle)).normalize().y.asin().to_degrees()
    };
    for degrees in [5.0, 28.0, 45.0] {
        let target = with_sloping_feet(degrees);
        for frame in [0, 9, 18, 27] {
            let spec = spec(json!({"source": {"rest": {"clip": 0, "frame": frame}}}));
            let rest = resolved(&source, &target, &source.clips[0], &spec).mapping.target_rest;
            let posed = source.clips[0].local_pose(&source.skeleton, frame).to_model(&source.skeleton);
            for (side, ankle, ball) in [("Left", "foot_l", "ball_l"), ("Right", "foot_r", "ball_r")] {
                let (foot, toe) = (format!("mixamorig:{side}Foot"), format!("mixamorig:{side}ToeBase"));
                let of_source = |pose: &ModelPose| pitch(pose, &source.skeleton, &foot, &toe);
                let wanted = of_source(&posed) - of_source(&bind);
                let found = pitch(&rest, &target.skeleton, ankle, ball) + degrees;
                // Feet within 5 degrees of flat count as flat.
                assert!(
                    (found - wanted).abs() < 6.0,
                    "{side} foot of {degrees} degrees at {frame}: {found:.1}, not {wanted:.1}"
                );
            }
        }
    }
}

/// As programs write captures: what stands in the nodes is the first frame of the walk.
#[test]
fn nodes_in_the_middle_of_a_step_count_as_a_frame_of_the_clip() {
    let mut source = samples::walk_scene();
    (source.skins, source.bind_pose) = (Vec::new(), Vec::new());
    let (clip, target) = (source.clips[0].clone(), samples::mannequin_scene());
    let laid_out = source.skeleton.clone();
    let rest_source = |source: &Scene| rig("source", source, &spec(json!({}))).rest_source;
    assert_eq!(rest_source(&source), RestSource::Nodes, "a T pose is a T pose");
    let first = clip.local_pose(&laid_out, 0);
    let mut joints = laid_out.joints().to_vec();
    joints.iter_mut().zip(first.transforms()).for_each(|(joint, first)| joint.rest = *first);
    source.skeleton = Skeleton::new(joints).expect("a skeleton");
    assert_eq!(rest_source(&source), RestSource::StandingFrame, "a step is none");
    let rest = |document: Value| resolved(&source, &target, &clip, &spec(document)).mapping.target_rest;
    let (found, named) = (rest(json!({})), rest(json!({"source": {"rest": {"clip": 0, "frame": 0}}})));
    let nodes = rest(json!({"source": {"rest": "nodes"}}));
    let foot = target.skeleton.find("foot_l").expect("a foot");
    let turned = |pose: &ModelPose| pose.transforms()[foot].rotation;
    assert!(degrees_between(turned(&found), turned(&named)) < 1e-6, "as if that frame had been named");
    assert!(degrees_between(turned(&found), turned(&nodes)) > 0.1, "who asks for the nodes has them laid out");
}

/// Captures whose position channels override the offsets, in a format that has a rest pose, and a skin so that viewers show them.
#[test]
fn a_skin_that_no_mesh_has_says_nothing_of_rest() {
    let mut source = samples::walk_scene();
    source.skins = vec![Skin { joints: (0..source.skeleton.len()).collect(), ..Skin::default() }];
    let places = source.clips[0].local_pose(&source.skeleton, 0);
    let in_place = |(joint, place): (&JointTracks, &Transform)| JointTracks {
        translation: match &joint.translation {
            Track::Rest => Track::Constant(place.translation.as_vec3()),
            moves => moves.clone(),
        },
        ..joint.clone()
    };
    let tracks = source.clips[0].joints().iter().zip(places.transforms()).map(in_place).collect();
    source.clips = vec![source.clips[0].clone().with_joints(tracks).expect("a clip")];
    let rest_source = |source: &Scene| rig("source", source, &spec(json!({}))).rest_source;
    assert_eq!(rest_source(&source), RestSource::Nodes, "a T pose is a T pose");
    let mut joints = source.skeleton.joints().to_vec();
    joints.iter_mut().for_each(|joint| joint.rest.translation = DVec3::X * joint.rest.translation.length());
    source.skeleton = Skeleton::new(joints).expect("a skeleton");
    assert_eq!(rest_source(&source), RestSource::StandingFrame, "all bones on one axis are none");
}

/// Who leans with the shoulders turned against the hips does so with the whole spine: no frame tells which joint it was.
#[test]
fn hips_and_shoulders_of_a_frame_are_turned_against_one_another_by_the_whole_spine() {
    let (mut source, target) = (samples::walk_scene(), samples::mannequin_scene());
    let turn = DQuat::from_rotation_y(24.0_f64.to_radians()) * DQuat::from_rotation_x(16.0_f64.to_radians());
    let clip = turned(&source, role(&source, "spine"), turn);
    source.clips = vec![clip.clone()];
    let rest = |document: Value| resolved(&source, &target, &clip, &spec(document)).mapping.target_rest;
    let (bind, found) = (rest(json!({"align": "off"})), rest(json!({"source": {"rest": {"clip": 0, "frame": 0}}})));
    let names = ["pelvis", "spine_01", "spine_02", "spine_03", "spine_04", "spine_05", "neck_01", "head"];
    let joints = names.map(|name| target.skeleton.find(name).unwrap_or_else(|| panic!("{name}")));
    let turns = joints.map(|joint| found.transforms()[joint].rotation * bind.transforms()[joint].rotation.conjugate());
    for (pair, names) in turns.windows(2).zip(names.windows(2)) {
        let degrees = degrees_between(pair[0], pair[1]);
        // A head is held level.
        let most = if names[1] == "head" { 17.0 } else { 13.0 };
        assert!(degrees < most, "{names:?} are bent by {degrees:.1} degrees");
    }
    let line = |pose: &ModelPose| {
        let place = |joint: usize| pose.transforms()[joints[joint]].translation;
        (place(6) - place(1)).normalize()
    };
    let degrees = line(&found).angle_between(turn * line(&bind)).to_degrees();
    assert!(degrees < 3.0, "the line of the spine is {degrees:.1} degrees off");
    let degrees = degrees_between(turns[5], turn);
    assert!(degrees < 3.0, "the chest is {degrees:.1} degrees off");
}
