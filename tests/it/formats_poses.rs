//! The poses reader and writer.

use std::{
    io::{Cursor, Write},
    process::Command,
};

use glam::{DQuat, DVec3, Quat, Vec3};
use retargetd::{
    formats::{self, ErrorKind, Format, FormatError, Limits, WriteOptions},
    model::{Axes, Clip, Control, Joint, JointTracks, Reporter, Scene, Skeleton, Track, Transform},
    samples,
};
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

use crate::support::{python_with, skip};

const CODECS: [Format; 2] = [Format::PosesNpz, Format::PosesJson];

fn read(bytes: &[u8], format: Format) -> Result<(Scene, Vec<&'static str>), FormatError> {
    read_under(bytes, format, &Limits::default())
}

fn read_under(bytes: &[u8], format: Format, limits: &Limits) -> Result<(Scene, Vec<&'static str>), FormatError> {
    let mut reporter = Reporter::new();
    let scene = formats::read(bytes, format, limits, &Control::new(), &mut reporter)?;
    Ok((scene, reporter.into_warnings().iter().map(|warning| warning.code).collect()))
}

fn write(scene: &Scene, clip: &Clip, format: Format, extras: Option<serde_json::Value>) -> Vec<u8> {
    let options = WriteOptions { extras, ..WriteOptions::new(format) };
    formats::write(scene, clip, &options, &Control::new(), &mut Reporter::new()).expect("it can be written")
}

/// Two joints, three frames; a test replaces what it is about. An empty value takes a key away.
fn document(changes: &[(&str, &str)]) -> Vec<u8> {
    let mut members = vec![
        ("joint_names", r#"["root", "tip"]"#),
        ("parents", "[-1, 0]"),
        ("rest_translations", "[[0, 1, 0], [0, 0.5, 0]]"),
        ("times", "[0, 0.5, 1]"),
        ("translations", "[[[0,1,0],[0,0.5,0]],[[0,1,0.1],[0,0.5,0]],[[0,1,0.2],[0,0.5,0]]]"),
        ("rotations", "[[[0,0,0,1],[0,0,0,1]],[[0,0,0,1],[0,0,0,1]],[[0,0,0,1],[0,0,0,1]]]"),
    ];
    for (key, value) in changes {
        members.retain(|member| member.0 != *key);
        if !value.is_empty() {
            members.push((key, value));
        }
    }
    let members: Vec<String> = members.iter().map(|(key, value)| format!("{key:?}: {value}")).collect();
    format!("{{{}}}", members.join(", ")).into_bytes()
}

fn refusal(changes: &[(&str, &str)]) -> String {
    let error = read(&document(changes), Format::PosesJson).expect_err("it breaks a rule");
    assert!(!error.hint.is_empty(), "an error says what to do: {error}");
    error.to_string()
}

#[test]
fn the_smallest_document_is_read() {
    let (scene, warnings) = read(&document(&[]), Format::PosesJson).expect("valid");
    assert_eq!(warnings, Vec::<&str>::new(), "nothing to warn of");
    assert_eq!(scene.skeleton.joints()[1].parent, Some(0), "parents");
    assert!(scene.skeleton.joints().iter().all(|joint| joint.is_joint), "all are joints");
    assert_eq!(scene.skeleton.joints()[0].rest.rotation, DQuat::IDENTITY, "no rest rotations: identity");
    assert_eq!((scene.axes, scene.unit_meters), (Some(Axes::Y_UP_Z_FRONT), Some(1.0)), "the defaults");
    let clip = &scene.clips[0];
    assert_eq!(clip.times_seconds(), [0.0, 0.5, 1.0], "key times");
    assert_eq!(clip.joints()[0].translation.at(2, Vec3::ZERO), Vec3::new(0.0, 1.0, 0.2), "a sample");
    assert_eq!(
        clip.joints()[1].translation,
        Track::Constant(Vec3::new(0.0, 0.5, 0.0)),
        "constant tracks are made small"
    );
    assert_eq!(clip.joints()[0].scale, Track::Rest, "an absent channel stays at rest");
}

#[test]
fn broken_documents_name_the_key_and_the_index() {
    for (changes, expected) in [
        (&[("parents", "[-1, 1]")][..], "parents[1]"),
        (&[("parents", "[-1, -2]")], "parents[1]"),
        (&[("parents", "[-1, 0.5]")], "parents[1]"),
        (&[("parents", "[-1]")], "parents: the shape is [1]"),
        (&[("joint_names", "")], "joint_names"),
        (&[("joint_names", "[]")], "joint_names"),
        (&[("rest_translations", "")], "rest_translations"),
        (&[("rest_translations", "[[0, 1], [0, 0]]")], "rest_translations: the shape is [2, 2]"),
        (&[("rest_rotations", "[[0, 0, 0, 1], [0, 0, 0, 0]]")], "rest_rotations[1]"),
        (&[("translations", "[[[0,1,0],[0,1]]]")], "translations[0, 1]"),
        (&[("translations", "[[[0,1,0],[0,1,null]]]")], "translations[0, 1, 2]"),
        (&[("rotations", "[[[0,0,0,1],[0,0,0,1]]]")], "rotations: the shape is [1, 2, 4]"),
        (&[("translations", "[[[0,1,0],[0,1e39,0]],[[0,0,0],[0,0,0]],[[0,0,0],[0,0,0]]]")], "translations[0, 1, 1]"),
        (&[("times", "[0, 1, 1]")], "times[2]"),
        (&[("times", "")], "times"),
        (&[("times", "[0, 1]")], "times: the shape is [2]"),
        (&[("times", "{}")], "times"),
        (&[("translations", ""), ("rotations", "")], "times"),
        (&[("meta", r#""{\"axes\": \"+y+y\"}""#)], "meta.axes"),
        (&[("meta", r#""{\"unit\": 0}""#)], "meta.unit"),
        (&[("meta", r#""{\"fps\": -1}""#)], "meta.fps"),
        (&[("meta", r#""{""#)], "meta"),
        (&[("contacts", "[[true], [false], [true]]")], "contact_joints"),
        (&[("contact_joints", r#"["nobody"]"#), ("contacts", "[[true], [false], [true]]")], "contact_joints[0]"),
        (&[("contact_joints", "[]"), ("contacts", "[[true], [false], [true]]")], "contacts: the shape is [3, 1]"),
        (&[("morph_weights", "[[0], [1], [0]]")], "morph_weights: the shape is [3, 1]"),
        (&[("morph_names", r#"["smile"]"#), ("morph_weights", "[[0], [1e39], [0]]")], "morph_weights[1, 0]"),
    ] {
        let text = refusal(changes);
        assert!(text.starts_with(expected), "{changes:?} gives {text:?} where {expected:?} is expected");
    }
}

#[test]
fn repairs_and_losses_are_warnings() {
    let codes = |changes: &[(&str, &str)]| read(&document(changes), Format::PosesJson).expect("readable").1;
    assert_eq!(codes(&[("joint_names", r#"["a", "a"]"#)]), ["joint_name_not_unique"], "repeated names");
    assert_eq!(codes(&[("joint_names", r#"["", "a"]"#)]), ["joint_name_empty"], "no name");
    assert_eq!(codes(&[("rest_rotations", "[[0,0,0,1.01],[0,0,0,1]]")]), ["quaternion_not_unit"], "length");
    assert_eq!(codes(&[("rest_rotations", "[[0,0,0,1.0005],[0,0,0,1]]")]), [""; 0], "rounding is no fault");
    assert_eq!(codes(&[("velocities", "[[[[1]]]]"), ("heading", "[]")]), ["poses_keys_ignored"], "one for all");
    assert_eq!(codes(&[("translations", "")]), ["poses_channel_absent"], "an absent channel");
}

#[test]
fn rotations_stay_on_one_hemisphere() {
    let flipped = "[[[0,0,0,1],[0,0,0,1]],[[0,0,0,-1],[0,0,0,1]],[[0.6,0,0,-0.8],[0,0,0,1]]]";
    let (scene, _) = read(&document(&[("rotations", flipped)]), Format::PosesJson).expect("valid");
    let track = &scene.clips[0].joints()[0].rotation;
    let values: Vec<Quat> = (0..3).map(|frame| track.at(frame, Quat::IDENTITY)).collect();
    assert!(values.windows(2).all(|pair| pair[0].dot(pair[1]) > 0.0), "{values:?}");
}

#[test]
fn key_times_come_from_the_frame_rate() {
    for meta in [
        r#""{\"fps\": 2, \"axes\": \"+z-y\", \"unit\": 0.01, \"name\": \"Jump\"}""#,
        r#"{"fps": 2, "axes": "+z-y", "unit": 0.01, "name": "Jump"}"#,
    ] {
        let (scene, _) = read(&document(&[("times", ""), ("meta", meta)]), Format::PosesJson).expect("valid");
        assert_eq!(scene.clips[0].times_seconds(), [0.0, 0.5, 1.0], "frame k at k / fps");
        assert_eq!(scene.clips[0].name(), "Jump", "the name");
        assert_eq!(scene.axes, "+z-y".parse().ok(), "declared, not converted");
        assert_eq!(scene.unit_meters, Some(0.01), "declared, not converted");
    }
}

#[test]
fn a_file_without_frames_is_a_skeleton() {
    for changes in [
        &[("times", ""), ("translations", ""), ("rotations", "")][..],
        &[("times", "[]"), ("translations", "[]"), ("rotations", "[]")],
        &[("times", ""), ("translations", "[]"), ("rotations", "[]")],
    ] {
        let (scene, _) = read(&document(changes), Format::PosesJson).expect("valid");
        assert_eq!((scene.skeleton.len(), scene.clips.len()), (2, 0), "{changes:?}");
    }
}

#[test]
fn both_codecs_give_back_what_they_were_given() {
    let mut scene = samples::walk_scene();
    scene.axes = Some(Axes::Z_UP_Y_FRONT);
    scene.unit_meters = Some(0.01);
    let clip = &scene.clips[0];
    for format in CODECS {
        let bytes = write(&scene, clip, format, Some(serde_json::json!({"version": "1"})));
        assert_eq!(bytes, write(&scene, clip, format, Some(serde_json::json!({"version": "1"}))), "the same bytes");
        let (back, warnings) = read(&bytes, format).expect("our own file");
        assert_eq!(warnings, Vec::<&str>::new(), "{format:?}: nothing to warn of");
        assert_eq!((back.axes, back.unit_meters), (scene.axes, scene.unit_meters), "{format:?}: space");
        assert_eq!(back.clips[0].name(), clip.name(), "{format:?}: name");
        for frame in [0, 37, 120] {
            let (expected, actual) =
                (clip.local_pose(&scene.skeleton, frame), back.clips[0].local_pose(&back.skeleton, frame));
            for (expected, actual) in expected.transforms().iter().zip(actual.transforms()) {
                assert!((expected.translation - actual.translation).length() < 1e-6, "{format:?}: translation");
                assert!(expected.rotation.angle_between(actual.rotation) < 1e-3, "{format:?}: rotation");
                assert!((expected.rotation - actual.rotation).length() < 1e-6, "{format:?}: rotation, sign included");
            }
        }
        let again = write(&back, &back.clips[0], format, Some(serde_json::json!({"version": "1"})));
        let settled = read(&again, format).expect("our own file").0;
        assert!(settled.clips == back.clips, "{format:?}: a second round changes nothing");
    }
}

#[test]
fn joints_are_written_with_what_is_above_and_between_them() {
    let node = |name: &str, parent, is_joint| Joint {
        name: name.into(),
        parent,
        rest: Transform::from_translation(DVec3::Y),
        is_joint,
        node: 0,
    };
    let joints = vec![
        node("mesh", None, false),
        node("armature", None, false),
        node("hips", Some(1), true),
        node("helper", Some(2), false),
        node("spine", Some(3), true),
        node("hat", Some(4), false),
    ];
    let scene = Scene { skeleton: Skeleton::new(joints).expect("valid"), ..Scene::default() };
    let clip = Clip::new("rest".into(), vec![0.0], vec![JointTracks::default(); 6]).expect("valid");
    for format in CODECS {
        let (back, _) = read(&write(&scene, &clip, format, None), format).expect("our own file");
        let names: Vec<&str> = back.skeleton.joints().iter().map(|joint| joint.name.as_str()).collect();
        assert_eq!(names, ["armature", "hips", "helper", "spine"], "{format:?}: no mesh and no hat");
        assert_eq!(back.skeleton.parent(1), Some(0), "{format:?}: indices are new");
    }
}

#[test]
fn a_still_clip_may_shrink_as_far_as_it_can() {
    let scene = samples::mannequin_scene();
    let times = (0..5000).map(f64::from).collect();
    let clip = Clip::new("still".into(), times, vec![JointTracks::default(); scene.skeleton.len()]).expect("valid");
    let bytes = write(&scene, &clip, Format::PosesNpz, None);
    let (back, _) = read(&bytes, Format::PosesNpz).expect("16 MB of repetition in our own file is no attack");
    assert_eq!(back.clips[0].frame_count(), 5000, "all frames");
}

#[test]
fn an_archive_keeps_times_to_the_last_bit() {
    let scene = samples::mannequin_scene();
    let times: Vec<f64> = (0..900).map(|frame| f64::from(frame) * 0.0333333).collect();
    let clip = Clip::new("still".into(), times.clone(), vec![JointTracks::default(); scene.skeleton.len()]);
    let bytes = write(&scene, &clip.expect("valid"), Format::PosesNpz, None);
    let (back, _) = read(&bytes, Format::PosesNpz).expect("our own file");
    assert_eq!(
        back.clips[0].times_seconds(),
        times,
        "in single precision, the last ones would be off by a microsecond"
    );
}

fn archive(members: &[(&str, Vec<u8>)], method: CompressionMethod) -> Vec<u8> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in members {
        archive.start_file(*name, SimpleFileOptions::default().compression_method(method)).expect("a member");
        archive.write_all(bytes).expect("its bytes");
    }
    archive.finish().expect("an archive").into_inner()
}

fn npy(description: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let text = format!("{{'descr': '{description}', 'fortran_order': False, 'shape': {shape}, }}\n");
    [b"\x93NUMPY\x01\x00", &(text.len() as u16).to_le_bytes()[..], text.as_bytes(), data].concat()
}

#[test]
fn lying_headers_are_stopped_before_anything_is_allocated() {
    let huge = archive(&[("joint_names.npy", npy("<U8", "(1000000000000,)", b""))], CompressionMethod::Stored);
    let error = read(&huge, Format::PosesNpz).expect_err("32 TB");
    assert!(matches!(error.kind, ErrorKind::LimitExceeded { .. }), "by the budget: {error:?}");
    let product = archive(&[("times.npy", npy("<f4", "(4294967296, 4294967296)", b""))], CompressionMethod::Stored);
    assert_eq!(read(&product, Format::PosesNpz).expect_err("an overflow").kind, ErrorKind::Malformed, "no wrap around");
    let short = archive(&[("times.npy", npy("<f4", "(3,)", &[0; 8]))], CompressionMethod::Stored);
    assert!(
        read(&short, Format::PosesNpz).expect_err("two of three").to_string().starts_with("times"),
        "names the key"
    );
    let empty_text = archive(&[("joint_names.npy", npy("<U0", "(9000000000,)", b""))], CompressionMethod::Stored);
    assert!(read(&empty_text, Format::PosesNpz).is_err(), "names of no bytes cost memory as well");
}

#[test]
fn bombs_are_stopped_by_their_ratio() {
    let zeros = npy("<f4", "(10000000,)", &vec![0; 40_000_000]);
    let bomb = archive(&[("times.npy", zeros)], CompressionMethod::Deflated);
    let error = read(&bomb, Format::PosesNpz).expect_err("a thousand to one");
    assert!(error.to_string().contains("decompression_ratio"), "names the limit: {error}");
    let many: Vec<(String, Vec<u8>)> = (0..1100).map(|index| (format!("{index}.npy"), Vec::new())).collect();
    let many: Vec<(&str, Vec<u8>)> = many.iter().map(|(name, bytes)| (name.as_str(), bytes.clone())).collect();
    assert!(read(&archive(&many, CompressionMethod::Stored), Format::PosesNpz).is_err(), "a long directory");
}

#[test]
fn limits_of_joints_frames_and_depth_hold() {
    let bytes = document(&[]);
    for limits in [
        Limits { nodes: 1, ..Limits::default() },
        Limits { frames_per_clip: 2, ..Limits::default() },
        Limits { samples: 5, ..Limits::default() },
        Limits { hierarchy_depth: 1, ..Limits::default() },
        Limits { decoded_bytes: 100, ..Limits::default() },
    ] {
        let error = read_under(&bytes, Format::PosesJson, &limits).expect_err("one too many");
        assert!(matches!(error.kind, ErrorKind::LimitExceeded { .. }), "{limits:?} gives {error:?}");
    }
}

#[test]
fn no_cut_and_no_flipped_bit_panics() {
    let scene = samples::mannequin_scene();
    let clip = Clip::new("still".into(), vec![0.0], vec![JointTracks::default(); scene.skeleton.len()]).expect("valid");
    for format in CODECS {
        let bytes = write(&scene, &clip, format, None);
        for length in (0..bytes.len()).step_by(7) {
            assert!(read(&bytes[..length], format).is_err(), "{format:?} cut to {length} bytes is refused");
        }
        for index in (0..bytes.len()).step_by(5) {
            let mut damaged = bytes.clone();
            damaged[index] ^= 0x55;
            // Some damage is a different valid file; all of it must be survived.
            let _ = read(&damaged, format);
        }
    }
}

#[test]
fn deep_nesting_does_not_recurse() {
    let deep = format!("{{\"contacts\": {}1{}}}", "[".repeat(200_000), "]".repeat(200_000));
    assert!(read(deep.as_bytes(), Format::PosesJson).is_err(), "refused, and the stack is whole");
    let deep = format!("{{\"translations\": {}", "[".repeat(200_000));
    assert!(read(deep.as_bytes(), Format::PosesJson).is_err(), "refused, and the stack is whole");
}

#[test]
fn pickled_objects_are_never_decoded() {
    let objects = archive(&[("joint_names.npy", npy("|O", "(1,)", b"cos\nsystem\n"))], CompressionMethod::Stored);
    let error = read(&objects, Format::PosesNpz).expect_err("objects");
    assert_eq!(error.kind, ErrorKind::UnsupportedFeature, "refused by type");
    assert!(error.to_string().contains("pickled"), "says why: {error}");
}

#[test]
fn numpy_reads_what_is_written_and_the_other_way_round() {
    let Some(python) = python_with("numpy") else { return skip("there is no Python with numpy") };
    let scene = samples::walk_scene();
    let folder = tempfile::tempdir().expect("a folder");
    let (ours, theirs) = (folder.path().join("ours.npz"), folder.path().join("theirs.npz"));
    std::fs::write(&ours, write(&scene, &scene.clips[0], Format::PosesNpz, None)).expect("written");
    let script = "
import sys, json, numpy
z = numpy.load(sys.argv[1], allow_pickle=False)
a = {k: z[k] for k in z.files}
assert a['translations'].shape == (121, 65, 3) and a['rotations'].shape == (121, 65, 4), a['rotations'].shape
wanted = lambda k, v: v.dtype.str == '<f8' if k == 'times' else v.dtype.str in ('<f4', '<i4') or v.dtype.kind == 'U'
assert all(wanted(k, v) for k, v in a.items()), {k: v.dtype for k, v in a.items()}
assert a['parents'][0] == -1 and str(a['joint_names'][0]) == 'mixamorig:Hips'
meta = json.loads(str(a['meta'])); assert meta['fps'] == 30 and meta['axes'] == '+y+z' and meta['unit'] == 1, meta
a['rotations'] = numpy.asfortranarray(a['rotations'].astype('>f8'))
a['parents'] = a['parents'].astype('>i8'); a['joint_names'] = a['joint_names'].astype('S')
numpy.savez_compressed(sys.argv[2], **a)
";
    let output = Command::new(python).args(["-c", script]).arg(&ours).arg(&theirs).output().expect("python runs");
    assert!(output.status.success(), "numpy: {}", String::from_utf8_lossy(&output.stderr));
    let [ours, theirs] =
        [ours, theirs].map(|path| read(&std::fs::read(path).expect("a file"), Format::PosesNpz).expect("valid").0);
    assert_eq!(ours.skeleton, theirs.skeleton, "the skeleton in other types and orders");
    for (ours, theirs) in ours.clips[0].joints().iter().zip(theirs.clips[0].joints()) {
        for frame in 0..121 {
            let [a, b] = [ours, theirs].map(|tracks| tracks.rotation.at(frame, Quat::IDENTITY));
            assert!((a - b).length() < 1e-6, "big-endian doubles in column-major order");
        }
    }
}

#[test]
fn contacts_and_morphs_come_in_and_go_out() {
    let beside = [
        ("contact_joints", r#"["tip"]"#),
        ("contacts", "[[true], [0], [1]]"),
        ("morph_names", r#"["jawOpen", "eyeBlinkLeft"]"#),
        ("morph_weights", "[[0, 0.25], [0.5, 0.25], [1, 0.25]]"),
    ];
    let (scene, codes) = read(&document(&beside), Format::PosesJson).expect("valid");
    assert!(codes.is_empty(), "nothing is lost: {codes:?}");
    let clip = &scene.clips[0];
    assert_eq!(clip.contacts().len(), 1, "one joint");
    assert_eq!((clip.contacts()[0].joint, clip.contacts()[0].touches.as_slice()), (1, &[true, false, true][..]));
    assert_eq!(clip.morphs()[0].weights, Track::Sampled(vec![0.0, 0.5, 1.0]));
    assert_eq!(clip.morphs()[1].weights, Track::Constant(0.25));
    for format in [Format::PosesJson, Format::PosesNpz] {
        let (back, _) = read(&write(&scene, clip, format, None), format).expect("what was written is read");
        assert_eq!((back.clips[0].contacts(), back.clips[0].morphs()), (clip.contacts(), clip.morphs()), "{format:?}");
        assert_eq!(back.morphs, scene.morphs, "{format:?}: names");
    }
}
