//! The BVH reader and writer, on text made here and on files of the corpus.

use glam::{DQuat, DVec3, Quat, Vec3};
use retargetd::{
    formats::{self, ErrorKind, Format, FormatError, Limit, Limits, WriteOptions},
    model::{Clip, Control, Joint, JointTracks, Reporter, Scene, Skeleton, Track, Transform, Warning},
};

use crate::support::corpus_file;

fn read_with(bytes: &[u8], limits: &Limits) -> (Result<Scene, FormatError>, Vec<&'static str>) {
    let mut reporter = Reporter::new();
    let scene = formats::read(bytes, Format::Bvh, limits, &Control::new(), &mut reporter);
    (scene, codes(&reporter.into_warnings()))
}

fn read(bytes: &[u8]) -> (Scene, Vec<&'static str>) {
    let (scene, codes) = read_with(bytes, &Limits::default());
    (scene.unwrap_or_else(|error| panic!("it is read: {error}")), codes)
}

fn refusal(bytes: &[u8]) -> FormatError {
    read_with(bytes, &Limits::default()).0.expect_err("it is refused")
}

fn write(scene: &Scene, clip: &Clip) -> (Vec<u8>, Vec<&'static str>) {
    let options = WriteOptions::new(Format::Bvh);
    let mut reporter = Reporter::new();
    let bytes = formats::write(scene, clip, &options, &Control::new(), &mut reporter).expect("it is written");
    (bytes, codes(&reporter.into_warnings()))
}

fn codes(warnings: &[Warning]) -> Vec<&'static str> {
    warnings.iter().map(|warning| warning.code).collect()
}

const TWO_JOINTS: &str = "HIERARCHY\nROOT Hips\n{\n OFFSET 1 2 3\n CHANNELS 6 Xposition Yposition Zposition Zrotation \
    Xrotation Yrotation\n JOINT Spine\n {\n  OFFSET 0 10 0\n  CHANNELS 3 Zrotation Xrotation Yrotation\n  End Site\n  {\n   \
    OFFSET 0 5 0\n  }\n }\n}\nMOTION\nFrames: 2\nFrame Time: 0.04\n0 0 0 0 0 0 0 0 0\n4 5 6 90 0 0 0 90 0\n";

/// Model-space positions of the joints of that name at a frame.
fn positions(scene: &Scene, clip: &Clip, frame: usize) -> Vec<(String, DVec3)> {
    let model = clip.local_pose(&scene.skeleton, frame).to_model(&scene.skeleton);
    let joints = scene.skeleton.joints().iter().zip(model.transforms());
    joints.filter(|(joint, _)| joint.is_joint).map(|(joint, at)| (joint.name.clone(), at.translation)).collect()
}

fn size(positions: &[(String, DVec3)]) -> f64 {
    let low = positions.iter().fold(DVec3::INFINITY, |low, (_, at)| low.min(*at));
    let high = positions.iter().fold(DVec3::NEG_INFINITY, |high, (_, at)| high.max(*at));
    (high - low).length().max(1e-9)
}

/// The worst distance between joints of two clips, as a part of the size, over all frames.
fn worst_distance(before: (&Scene, &Clip), after: (&Scene, &Clip)) -> f64 {
    assert_eq!(before.1.frame_count(), after.1.frame_count(), "as many frames");
    let mut worst = 0.0_f64;
    for frame in 0..before.1.frame_count() {
        let was = positions(before.0, before.1, frame);
        let is = positions(after.0, after.1, frame);
        let size = size(&was);
        for (name, expected) in &was {
            let (_, at) = is.iter().find(|(other, _)| other == name).expect("every joint is written");
            worst = worst.max(at.distance(*expected) / size);
        }
    }
    worst
}

#[test]
fn a_small_file_by_hand() {
    let (scene, codes) = read(TWO_JOINTS.as_bytes());
    assert_eq!(codes, Vec::<&str>::new(), "nothing to say about a good file");
    let names: Vec<(&str, Option<usize>, bool)> =
        scene.skeleton.joints().iter().map(|joint| (joint.name.as_str(), joint.parent, joint.is_joint)).collect();
    let expected = [("Hips", None, true), ("Spine", Some(0), true), ("Spine_end", Some(1), false)];
    assert_eq!(names, expected, "the End Site is a node but no joint");
    assert_eq!((scene.axes, scene.unit_meters), (None, None), "a BVH does not say");
    assert_eq!(scene.skeleton.joints()[0].rest.translation, DVec3::new(1.0, 2.0, 3.0), "the offset is the rest");
    let clip = &scene.clips[0];
    assert_eq!(clip.times_seconds(), [0.0, 0.04], "frame k at k times the frame time");
    let model = clip.local_pose(&scene.skeleton, 1).to_model(&scene.skeleton);
    // A quarter turn about Z takes the spine's +Y to −X; the spine's own quarter turn about X then lifts the end to +Z.
    for (joint, expected) in [(0, [4.0, 5.0, 6.0]), (1, [-6.0, 5.0, 6.0]), (2, [-6.0, 5.0, 11.0])] {
        let at = model.transforms()[joint].translation;
        assert!(at.distance(DVec3::from(expected)) < 1e-5, "joint {joint} is at {at}");
    }
}

#[test]
fn rotations_multiply_in_the_order_of_the_channels() {
    for (order, expected) in [
        (
            ["Xrotation", "Yrotation", "Zrotation"],
            DQuat::from_rotation_x(0.1) * DQuat::from_rotation_y(0.2) * DQuat::from_rotation_z(0.3),
        ),
        (
            ["yROTATION", "ZRotation", "XROTATION"],
            DQuat::from_rotation_y(0.1) * DQuat::from_rotation_z(0.2) * DQuat::from_rotation_x(0.3),
        ),
    ] {
        let degrees = [0.1_f64, 0.2, 0.3].map(|angle| angle.to_degrees().to_string()).join(" ");
        let text = format!(
            "hierarchy\nroot a\n{{\noffset 0 0 0\nchannels 4 {} Yposition\n}}\nmotion\nframes: 1\nframe time: 1\n{degrees} 7\n",
            order.join(" ")
        );
        let (scene, _) = read(text.as_bytes());
        let pose = scene.clips[0].local_pose(&scene.skeleton, 0);
        let local = pose.transforms()[0];
        assert!(local.rotation.angle_between(expected) < 1e-6, "{order:?}");
        assert_eq!(local.translation, DVec3::new(0.0, 7.0, 0.0), "a position after the rotations");
    }
}

#[test]
fn positions_that_are_next_to_nothing_are_added_to_the_offsets() {
    let file = |position: &str| {
        let mut text = "HIERARCHY\nROOT a\n{\nOFFSET 0 5 0\nCHANNELS 3 Xposition Yposition Zposition\n".to_owned();
        for name in ["b", "c", "d", "e"] {
            text += &format!("JOINT {name}\n{{\nOFFSET 1 2 3\nCHANNELS 3 Xposition Yposition Zposition\n");
        }
        text += &"}\n".repeat(5);
        text + &format!("MOTION\nFrames: 1\nFrame Time: 0.1\n0 0.001 0 {}\n", [position; 4].join(" "))
    };
    let place = |text: String| {
        let (scene, codes) = read(text.as_bytes());
        let pose = scene.clips[0].local_pose(&scene.skeleton, 0);
        (pose.transforms()[0].translation.y, pose.transforms()[4].translation, codes)
    };
    let (root, joint, codes) = place(file("0 0 0.5"));
    assert_eq!((joint, codes), (DVec3::new(0.0, 0.0, 0.5), Vec::new()), "positions replace offsets");
    assert!((root - 0.001).abs() < 1e-9, "the root's too: {root}");
    let (root, joint, codes) = place(file("0 0 0.001"));
    assert!(joint.distance(DVec3::new(1.0, 2.0, 3.001)) < 1e-6, "added: {joint}");
    assert!((root - 0.001).abs() < 1e-9, "the root's is what it says: {root}");
    assert_eq!(codes, ["positions_from_offsets"], "and it says so");
}

#[test]
fn no_frame_is_no_clip() {
    let hierarchy = TWO_JOINTS.split("MOTION").next().expect("text");
    for motion in ["", "MOTION\nFrames: 0\nFrame Time: 0.1\n"] {
        let (scene, codes) = read(format!("{hierarchy}{motion}").as_bytes());
        assert_eq!((scene.clips.len(), codes), (0, vec!["no_frames"]), "only the skeleton, and it says so: {motion:?}");
    }
}

#[test]
fn refusals_say_where_and_what() {
    let swap = |from: &str, to: &str| TWO_JOINTS.replace(from, to);
    for (text, line, word) in [
        (swap("4 5 6 90", "4 5 nan 90"), "line 20", "frame 1, Zposition of 'Hips'"),
        (swap("4 5 6 90", "4 5 1e999 90"), "line 20", "frame 1, Zposition of 'Hips'"),
        (swap("4 5 6 90", "4,5 5 6 90"), "line 20", "frame 1, Xposition of 'Hips'"),
        (swap("0 0 0 0 0 0 0 0 0", "0 0 0 0 0 0 0 0"), "line 19", "row 1 of MOTION has 8 values"),
        (swap("Time: 0.04", "Time: 0"), "line 18", "Frame Time"),
        (swap("Time: 0.04", "Time: -0.04"), "line 18", "Frame Time"),
        (swap("Time: 0.04", "Time: nan"), "line 18", "Frame Time"),
        (swap("Frames: 2", "Frames: -2"), "line 17", "Frames"),
        (swap("Frames: 2", "Frames: 2.5"), "line 17", "Frames"),
        (swap("CHANNELS 3", "CHANNELS 4"), "line 10", "a channel"),
        (swap("CHANNELS 6", "CHANNELS 5"), "line 5", "more channels"),
        (swap("CHANNELS 6", "CHANNELS 1e30"), "line 5", "channels"),
        (swap("Xrotation Yrotation\n JOINT", "Xrotation Xrotation\n JOINT"), "line 5", "twice"),
        (swap("OFFSET 0 10 0", "OFFSET 0 10"), "line 9", "OFFSET"),
        (swap("ROOT Hips", "JOINT Hips"), "line 2", "ROOT"),
        (swap("MOTION", "}\nMOTION"), "line 16", "closes nothing"),
    ] {
        let error = refusal(text.as_bytes());
        assert_eq!(error.kind, ErrorKind::Malformed, "{error}");
        assert_eq!(error.place, line, "{error}");
        assert!(error.detail.contains(word), "'{}' names '{word}'", error.detail);
    }
    let comma = refusal(swap("Time: 0.04", "Time: 0,04").as_bytes());
    assert!(comma.hint.contains("decimal point"), "the hint is about commas: {}", comma.hint);
}

#[test]
fn rows_are_what_is_there() {
    let row = "4 5 6 90 0 0 0 90 0\n";
    let (more, codes) = read(format!("{TWO_JOINTS}{row}").as_bytes());
    assert_eq!((more.clips[0].frame_count(), codes), (3, vec!["row_count_differs"]), "one row more than declared");
    let (cut, codes) = read(&TWO_JOINTS.as_bytes()[..TWO_JOINTS.len() - 8]);
    let expected = vec!["last_row_incomplete", "row_count_differs"];
    assert_eq!((cut.clips[0].frame_count(), codes), (1, expected), "a file that was cut off in its last row");
    let (wrapped, codes) = read(TWO_JOINTS.replace("4 5 6 90", "4 5 6\n90").as_bytes());
    assert_eq!((wrapped.clips[0].frame_count(), codes), (2, vec!["rows_wrapped"]), "a row over two lines");
}

#[test]
fn declared_counts_allocate_nothing() {
    let error = refusal(TWO_JOINTS.replace("Frames: 2", "Frames: 1000000000").as_bytes());
    assert!(
        matches!(error.kind, ErrorKind::LimitExceeded { limit: Limit::FramesPerClip, .. }),
        "a count past the limit is refused as that: {error}"
    );
}

#[test]
fn limits_hold_at_the_limit_and_one_past_it() {
    for (limits, is_fine) in [
        (Limits { nodes: 3, ..Limits::default() }, true),
        (Limits { nodes: 2, ..Limits::default() }, false),
        (Limits { hierarchy_depth: 3, ..Limits::default() }, true),
        (Limits { hierarchy_depth: 2, ..Limits::default() }, false),
        (Limits { frames_per_clip: 2, ..Limits::default() }, true),
        (Limits { frames_per_clip: 1, ..Limits::default() }, false),
        (Limits { samples: 6, ..Limits::default() }, true),
        (Limits { samples: 5, ..Limits::default() }, false),
        (Limits { decoded_bytes: 64, ..Limits::default() }, false),
    ] {
        let (result, _) = read_with(TWO_JOINTS.as_bytes(), &limits);
        assert_eq!(result.is_ok(), is_fine, "{limits:?}");
    }
}

#[test]
fn cancellation_is_heard() {
    let control = Control::new();
    control.cancel();
    let mut reporter = Reporter::new();
    let result = formats::read(TWO_JOINTS.as_bytes(), Format::Bvh, &Limits::default(), &control, &mut reporter);
    assert_eq!(result.expect_err("canceled").kind, ErrorKind::Canceled, "the read stops");
}

/// A skeleton with a turned, scaled armature, rest rotations, an animated translation and a nameless joint.
fn awkward() -> (Scene, Clip) {
    let joint = |name: &str, parent, translation: [f64; 3], rotation, scale, is_joint| Joint {
        name: name.into(),
        parent,
        rest: Transform { translation: translation.into(), rotation, scale },
        is_joint,
        node: 0,
    };
    let turned = DQuat::from_rotation_z(0.4) * DQuat::from_rotation_x(-1.2);
    let joints = vec![
        joint("Armature", None, [0.1, 0.0, -0.3], DQuat::from_rotation_x(-1.57), DVec3::splat(0.01), false),
        joint("Mesh", Some(0), [5.0, 0.0, 0.0], DQuat::IDENTITY, DVec3::ONE, false),
        joint("Hips", Some(0), [0.0, 3.0, 90.0], turned, DVec3::ONE, true),
        joint("Spine{1}", Some(2), [0.0, 20.0, 1.0], turned.conjugate(), DVec3::new(1.0, 2.0, 0.5), true),
        joint("", Some(3), [4.0, 15.0, 2.0], turned, DVec3::splat(-1.0), true),
        joint("Leg", Some(2), [8.0, -5.0, 0.0], turned * turned, DVec3::ONE, true),
        joint("Leg_end", Some(5), [0.0, -40.0, 0.0], DQuat::IDENTITY, DVec3::ONE, false),
    ];
    let frames = 50;
    let turns = |speed: f32| {
        let turn = |frame: i32| (Quat::from_rotation_y(speed * frame as f32) * Quat::from_rotation_x(0.3)).normalize();
        Track::Sampled((0..frames).map(turn).collect())
    };
    let mut tracks = vec![JointTracks::default(); joints.len()];
    tracks[2].rotation = turns(0.2);
    tracks[2].translation = Track::Sampled((0..frames).map(|frame| Vec3::new(frame as f32, 3.0, 90.0)).collect());
    tracks[3].rotation = turns(-0.35);
    tracks[3].scale = Track::Sampled((0..frames).map(|frame| Vec3::new(1.0, 2.0 + frame as f32 * 0.01, 0.5)).collect());
    tracks[4].rotation = turns(0.6);
    tracks[5].rotation = Track::Constant(Quat::from_rotation_z(1.0));
    let times = (0..frames).map(|frame| f64::from(frame) / 30.0).collect();
    let clip = Clip::new("walk".into(), times, tracks).expect("valid");
    (Scene { skeleton: Skeleton::new(joints).expect("valid"), ..Scene::default() }, clip)
}

#[test]
fn written_positions_are_exact_whatever_the_rest_is() {
    let (scene, clip) = awkward();
    let (bytes, mut codes) = write(&scene, &clip);
    codes.sort_unstable();
    let expected = [
        "joint_renamed",
        "joint_renamed",
        "rest_rotations_folded",
        "rotation_order_chosen",
        "scale_animation_lost",
        "scales_folded",
    ];
    assert_eq!(codes, expected, "every loss is said");
    let (back, codes) = read(&bytes);
    assert_eq!(codes, Vec::<&str>::new(), "what we write is a good file");
    let names: Vec<&str> = back.skeleton.joints().iter().map(|joint| joint.name.as_str()).collect();
    assert_eq!(
        names,
        ["Hips", "Spine_1_", "joint_4", "joint_4_end", "Leg", "Leg_end"],
        "the armature and the mesh are folded away"
    );
    for frame in 0..clip.frame_count() {
        let was = clip.local_pose(&scene.skeleton, frame).to_model(&scene.skeleton);
        let is = back.clips[0].local_pose(&back.skeleton, frame).to_model(&back.skeleton);
        for (ours, theirs) in [(2, 0), (3, 1), (4, 2), (5, 4), (6, 5)] {
            let distance = was.transforms()[ours].translation.distance(is.transforms()[theirs].translation);
            assert!(distance < 1e-6, "frame {frame}, joint {ours}: {distance} of a size of about one");
        }
    }
    assert!((back.clips[0].uniform_fps().expect("even") - 30.0).abs() < 1e-6, "the rate stays");
}

#[test]
fn angles_change_smoothly_over_several_turns() {
    let (scene, clip) = awkward();
    let (bytes, _) = write(&scene, &clip);
    let text = String::from_utf8(bytes).expect("text");
    let rows: Vec<Vec<f64>> = text
        .split("Frame Time:")
        .nth(1)
        .expect("a motion")
        .lines()
        .skip(1)
        .map(|row| row.split(' ').map(|number| number.parse().expect("a number")).collect())
        .collect();
    for (frame, pair) in rows.windows(2).enumerate() {
        let jump = pair[0].iter().zip(&pair[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(jump < 120.0, "frame {frame}: an angle jumps by {jump} degrees");
    }
}

#[test]
fn uneven_keys_are_resampled_and_it_says_so() {
    let (scene, _) = read(TWO_JOINTS.as_bytes());
    let mut tracks = vec![JointTracks::default(); 3];
    tracks[0].translation = Track::Sampled(vec![Vec3::ZERO, Vec3::X, Vec3::X * 4.0]);
    let clip = Clip::new(String::new(), vec![0.0, 0.1, 0.4], tracks).expect("valid");
    let (bytes, codes) = write(&scene, &clip);
    assert_eq!(codes, ["resampled_uniform"], "it says so");
    let (back, _) = read(&bytes);
    assert_eq!(back.clips[0].frame_count(), 5, "at the densest spacing of the keys");
    assert!((back.clips[0].duration_seconds() - 0.4).abs() < 1e-9, "as long as before");
    let at = positions(&back, &back.clips[0], 3)[0].1;
    assert!(at.distance(DVec3::X * 3.0) < 1e-5, "between the keys on a line: {at}");
}

/// Path, joints, frames, frames per second, as the corpus describes them.
const CORPUS: [(&str, usize, usize, f64); 32] = [
    ("bvh/bandai-namco/dataset-1_bow_active_001.bvh", 22, 128, 30.0),
    ("bvh/bandai-namco/dataset-1_walk_normal_001.bvh", 22, 195, 30.0),
    ("bvh/cmu/01_01_motionbuilder.bvh", 31, 2752, 120.0),
    ("bvh/cmu/12_01_walk.bvh", 31, 524, 120.0),
    ("bvh/cmu/boxing_toes_row_mismatch.bvh", 21, 3070, 100.0),
    ("bvh/cmu/jumping_jacks_max_names.bvh", 31, 125, 30.0),
    ("bvh/cmu/xia_angry_inches.bvh", 31, 140, 120.0),
    ("bvh/fair1/dab_zup.bvh", 27, 339, 30.0),
    ("bvh/fair1/wave_hello_zup.bvh", 27, 839, 119.88),
    ("bvh/geno/Geno_bind.bvh", 75, 2, 60.0),
    ("bvh/misc/hunyuan_like_20fps.bvh", 22, 80, 20.0),
    ("bvh/misc/liveanimation_sample01.bvh", 19, 551, 60.0),
    ("bvh/misc/makehuman_tpose_173joints.bvh", 173, 1, 24.0),
    ("bvh/misc/makehuman_zombie_walk.bvh", 75, 31, 24.0),
    ("bvh/misc/meredith_8walk_vicon.bvh", 23, 1064, 120.0),
    ("bvh/misc/mia_78joints_allpos.bvh", 78, 250, 24.0),
    ("bvh/misc/mocapbank.bvh", 19, 455, 30.0),
    ("bvh/misc/momask_template_lafan_names.bvh", 22, 720, 60.0),
    ("bvh/misc/olympe_root_two_frames.bvh", 18, 2, 24.0),
    ("bvh/misc/pybvh_mixed_orders.bvh", 24, 75, 30.0),
    ("bvh/misc/pybvh_rotation_first_root.bvh", 4, 4, 25.0),
    ("bvh/misc/walk01_24fps.bvh", 19, 101, 24.0),
    ("bvh/rokoko/jesse_dance.bvh", 60, 1007, 100.0),
    ("bvh/xsens/aitviewer_sample.bvh", 23, 1300, 40.0),
    ("bvh/xsens/dragposer_example_2_zup_metres.bvh", 22, 2920, 120.0),
    ("bvh/xsens/pybvh_test2_chest4.bvh", 23, 61, 120.0),
    ("mixamo/bvh/beta_walking_mixed_orders.bvh", 53, 32, 30.0),
    ("mixamo/bvh/freebvh_mixamorig.bvh", 55, 69, 30.0),
    ("mixamo/bvh/kate_sign_49posjoints.bvh", 65, 127, 30.0),
    ("mixamo/bvh/mousey_salsa.bvh", 57, 270, 60.0),
    ("mixamo/bvh/ortiz_salsa.bvh", 65, 270, 60.0),
    ("poser-daz/pirouette_daz_friendly.bvh", 43, 592, 120.0),
];

#[test]
fn the_corpus_reads_as_described_and_survives_writing() {
    for (path, joints, frames, fps) in CORPUS {
        let Some(file) = corpus_file(path) else { continue };
        let (scene, _) = read(&std::fs::read(file).expect("the file can be read"));
        let clip = &scene.clips[0];
        let found = scene.skeleton.joints().iter().filter(|joint| joint.is_joint).count();
        assert_eq!((found, clip.frame_count()), (joints, frames), "{path}: joints and frames");
        if frames > 1 {
            let found = clip.uniform_fps().expect("evenly spaced");
            assert!((found - fps).abs() < fps * 2e-3, "{path}: {found} frames per second");
        }
        let (bytes, _) = write(&scene, clip);
        let (back, codes) = read(&bytes);
        assert!(codes.iter().all(|code| *code == "names_repeated"), "{path}: what we write is a good file: {codes:?}");
        let worst = worst_distance((&scene, clip), (&back, &back.clips[0]));
        assert!(worst < 1e-6, "{path}: {worst} of the size");
    }
}

#[test]
fn rigs_of_other_formats_keep_their_positions() {
    for path in [
        "mixamo/fbx/walking_noskin.fbx",
        "readyplayerme/rpm_talking_noskin.fbx",
        "smpl/text2motion_smpl_skeleton.fbx",
        // Joints scaled by [-1, -1, -1].
        "misc-rigs/ozz_pab_walk.fbx",
        // Below an armature scaled by 100.
        "misc-rigs/17_keypoints_walk.fbx",
        "roblox-r15/g9_roblox_facs.fbx",
    ] {
        let Some(file) = corpus_file(path) else { continue };
        let bytes = std::fs::read(file).expect("the file can be read");
        let mut reporter = Reporter::new();
        let scene = formats::read(&bytes, Format::Fbx, &Limits::default(), &Control::new(), &mut reporter);
        let scene = scene.unwrap_or_else(|error| panic!("{path}: {error}"));
        let clip = scene.clips.iter().find(|clip| clip.is_animated()).expect("a clip that moves");
        let (back, _) = read(&write(&scene, clip).0);
        let worst = worst_distance((&scene, clip), (&back, &back.clips[0]));
        assert!(worst < 1e-6, "{path}: {worst} of the size");
    }
}

#[test]
fn hostile_files_end_as_they_should() {
    for (name, frames) in [
        ("crlf", 3),
        ("names_duplicate", 3),
        ("names_spaces_unicode", 3),
        ("no_end_site", 3),
        ("reference_ok", 3),
        ("tabs_extra_blank_lines", 3),
        ("two_roots", 3),
        ("utf8_bom", 3),
        ("values_on_one_line", 3),
        ("offset_missing", 3),
        ("single_joint", 1),
        ("frames_zero", 0),
        ("motion_missing", 0),
    ] {
        let Some(file) = corpus_file(&format!("hostile/bvh/{name}.bvh")) else { continue };
        let (scene, _) = read(&std::fs::read(file).expect("the file can be read"));
        let found = scene.clips.first().map_or(0, Clip::frame_count);
        assert_eq!(found, frames, "{name}: frames");
    }
    for (name, word) in [
        ("braces_unbalanced", "}"),
        ("channels_unknown_name", "Wposition"),
        ("comma_decimals", "-80,5"),
        ("deep_5000_joints", "hierarchy_depth"),
        ("frames_negative", "Frames"),
        ("frames_one_billion_declared", "frames_per_clip"),
        ("frametime_nan", "Frame Time"),
        ("frametime_zero", "Frame Time"),
        ("rows_too_short", "row"),
        ("values_nan_inf", "frame"),
    ] {
        let Some(file) = corpus_file(&format!("hostile/bvh/{name}.bvh")) else { continue };
        let error = refusal(&std::fs::read(file).expect("the file can be read"));
        assert!(error.detail.contains(word), "{name}: '{error}' names '{word}'");
    }
    if let Some(file) = corpus_file("hostile/truncated/walk_midrow.bvh") {
        let (scene, codes) = read(&std::fs::read(file).expect("the file can be read"));
        assert!(scene.clips[0].frame_count() > 1, "the complete rows are there");
        assert!(codes.contains(&"last_row_incomplete"), "and it says what is not: {codes:?}");
    }
}

proptest::proptest! {
    #[test]
    fn no_text_panics(cut in 0..TWO_JOINTS.len(), at in 0..TWO_JOINTS.len(), byte in 0..=255_u8) {
        let mut bytes = TWO_JOINTS.as_bytes().to_vec();
        bytes[at] = byte;
        let _ = read_with(&bytes, &Limits::default());
        let _ = read_with(&bytes[..cut], &Limits::default());
    }
}
