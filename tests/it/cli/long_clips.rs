//! Clips that are worked through in sections, by the real binary: their results against those of the whole clip, what cannot be done so, and
//! what is said of files that are not what they seem.

use std::{io::Cursor, path::Path};

use glam::{Quat, Vec3};
use retargetd::{
    engine::{Sectioned, open_in_sections},
    formats::{self, Compression, Format, Limits, TargetClips, WriteOptions},
    model::{Clip, Control, JointTracks, LocalPose, Reporter, Scene, Track},
    samples,
};
use serde_json::Value;
use tempfile::TempDir;

use super::{code, error, retargetd};
use crate::support::{corpus_file, files_below, validate_gltf};

fn write(scene: &Scene, clip: &Clip, options: &WriteOptions) -> Vec<u8> {
    let scene = Scene { clips: Vec::new(), ..scene.clone() };
    formats::write(&scene, clip, options, &Control::new(), &mut Reporter::new()).expect("it can be written")
}

fn read(bytes: &[u8], format: Format) -> Scene {
    formats::read(bytes, format, &Limits::default(), &Control::new(), &mut Reporter::new()).expect("it can be read")
}

fn read_file(folder: &Path, name: &str) -> Scene {
    let format = Format::from_file_name(name).expect("an ending");
    read(&std::fs::read(folder.join(name)).expect("the file"), format)
}

/// The sample walk, walked on and on: where it ends it begins again, farther on.
fn long_walk(frames: usize) -> Clip {
    let walk = &samples::walk_scene().clips[0];
    let steps = walk.frame_count() - 1;
    let place = |tracks: &JointTracks, frame: usize| tracks.translation.at(frame, Vec3::ZERO);
    let joints = walk.joints().iter().map(|tracks| {
        let way = place(tracks, steps) - place(tracks, 0);
        let translation = match &tracks.translation {
            Track::Sampled(values) => Track::Sampled(
                (0..frames).map(|frame| values[frame % steps] + way * (frame / steps) as f32).collect::<Vec<Vec3>>(),
            ),
            other => other.clone(),
        };
        let rotation = match &tracks.rotation {
            Track::Sampled(values) => {
                Track::Sampled((0..frames).map(|frame| values[frame % steps]).collect::<Vec<Quat>>())
                    .on_one_hemisphere()
            }
            other => other.clone(),
        };
        JointTracks { translation, rotation, scale: tracks.scale.clone() }
    });
    let times = (0..frames).map(|frame| frame as f64 / 30.0).collect();
    Clip::new("walk on".into(), times, joints.collect()).expect("a clip")
}

/// A folder with the mannequin and a long walk.
fn folder(frames: usize, source: Format) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let walk = write(&samples::walk_scene(), &long_walk(frames), &WriteOptions::new(source));
    std::fs::write(folder.path().join(format!("walk.{}", source.info().endings[0])), walk).expect("the walk");
    std::fs::write(folder.path().join("mannequin.glb"), samples::mannequin()).expect("the mannequin");
    folder
}

fn report(folder: &Path, name: &str) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join(name)).expect("a report")).expect("JSON")
}

/// The largest distances between two clips: of joints, in the unit of the file, and of rotations, in degrees.
fn apart(one: &Scene, other: &Scene) -> (f64, f64) {
    assert_eq!(one.skeleton, other.skeleton, "one skeleton");
    let (ours, theirs) = (&one.clips[0], &other.clips[0]);
    assert_eq!(ours.frame_count(), theirs.frame_count(), "as long");
    let (mut places, mut turns) = (0.0_f64, 0.0_f64);
    for frame in 0..ours.frame_count() {
        assert!((ours.times_seconds()[frame] - theirs.times_seconds()[frame]).abs() < 1e-4, "frame {frame}");
        let pose = |clip: &Clip| clip.local_pose(&one.skeleton, frame);
        let (mine, yours) = (pose(ours), pose(theirs));
        for (mine, yours) in mine.transforms().iter().zip(yours.transforms()) {
            turns = turns.max(mine.rotation.angle_between(yours.rotation).to_degrees());
        }
        let (mine, yours) = (mine.to_model(&one.skeleton), yours.to_model(&one.skeleton));
        for (mine, yours) in mine.transforms().iter().zip(yours.transforms()) {
            places = places.max(mine.translation.distance(yours.translation));
        }
    }
    (places, turns)
}

/// Whether no rotation goes the long way to the next frame.
fn is_continuous(scene: &Scene) -> bool {
    scene.clips[0].joints().iter().all(|tracks| match &tracks.rotation {
        Track::Sampled(values) => values.windows(2).all(|pair| pair[0].dot(pair[1]) > 0.0),
        Track::Rest | Track::Constant(_) => true,
    })
}

#[test]
fn sections_give_what_the_whole_clip_gives() {
    let folder = folder(9_000, Format::Glb);
    let base = ["retarget", "--source", "walk.glb", "--target", "mannequin.glb"];
    let run = |more: &[&str]| {
        let output = retargetd(&[&base[..], more].concat(), folder.path());
        assert_eq!(code(&output), Some(0), "{}", error(&output));
        error(&output)
    };
    run(&["--output", "whole.glb", "--report", "whole.json"]);
    let told = run(&["--output", "long.glb", "--output", "long.bvh", "--report", "long.json", "--sections"]);
    assert!(told.contains("9000 frames in 3 sections"), "{told}");

    let (long, whole) = (read_file(folder.path(), "long.glb"), read_file(folder.path(), "whole.glb"));
    let (places, turns) = apart(&long, &whole);
    assert!(places < 3e-3 && turns < 0.3, "{places} m and {turns} degrees apart");
    assert!(is_continuous(&long), "rotations go the short way over seams too");
    let file = folder.path().join("long.glb");
    if let Some(judged) = validate_gltf(&[&file]) {
        let judgement = &judged[file.as_path()];
        assert!(judgement["errors"] == 0 && judgement["warnings"] == 0, "{judgement}");
    }

    // The BVH is the same motion by its joints' places; its rotations are read from angles.
    let bvh = read_file(folder.path(), "long.bvh");
    let written = write(&whole, &whole.clips[0], &WriteOptions::new(Format::Bvh));
    let (places, _) = apart(&bvh, &read(&written, Format::Bvh));
    assert!(places < 3e-3, "{places} m apart");
    let text = std::fs::read_to_string(folder.path().join("long.bvh")).expect("text");
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip_while(|line| !line.starts_with("Frame Time"))
        .skip(1)
        .map(|line| line.split_whitespace().map(|number| number.parse().expect("a number")).collect())
        .collect();
    let jumps = rows.windows(2).flat_map(|pair| pair[0].iter().zip(&pair[1]).map(|(from, to)| (from - to).abs()));
    assert!(jumps.fold(0.0, f64::max) < 180.0, "no angle starts anew at a seam");

    let (long, whole) = (report(folder.path(), "long.json"), report(folder.path(), "whole.json"));
    assert_eq!(long["measures"]["verdict"], whole["measures"]["verdict"]);
    assert_eq!(long["sections"]["count"], 3);
    assert_eq!(long["counts"], whole["counts"]);
    assert!(whole.get("sections").is_none() && long.get("contacts").is_none());
    for (name, metric) in long["measures"]["metrics"].as_object().expect("metrics") {
        let value = |metric: &Value| metric["value"].as_f64().unwrap_or(0.0);
        let (ours, theirs) = (value(metric), value(&whole["measures"]["metrics"][name]));
        let warn = metric["warn_above"].as_f64().expect("a threshold");
        assert!((ours - theirs).abs() <= 0.1 * theirs.abs() + 0.1 * warn + 1e-6, "{name}: {ours} and {theirs}");
    }
}

#[test]
fn a_bvh_in_sections_gives_what_the_whole_one_gives() {
    let folder = folder(4_500, Format::Bvh);
    let base = ["retarget", "--source", "walk.bvh", "--target", "mannequin.glb"];
    for more in [&["--output", "whole.glb"][..], &["--output", "long.glb", "--sections"]] {
        let output = retargetd(&[&base[..], more].concat(), folder.path());
        assert_eq!(code(&output), Some(0), "{}", error(&output));
    }
    let (places, turns) = apart(&read_file(folder.path(), "long.glb"), &read_file(folder.path(), "whole.glb"));
    assert!(places < 3e-3 && turns < 0.3, "{places} m and {turns} degrees apart");
}

#[test]
fn a_clip_beyond_the_limits_is_worked_through_without_being_asked() {
    let folder = tempfile::tempdir().expect("a folder");
    let rows: String = (0..216_100).map(|row| format!("{} 0 0 {} 0 0\n", row % 90, row % 45)).collect();
    let text = format!(
        "HIERARCHY\nROOT Root\n{{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\nJOINT Arm\n{{\nOFFSET 0 10 0\n\
         CHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{{\nOFFSET 0 10 0\n}}\n}}\n}}\n\
         MOTION\nFrames: 216100\nFrame Time: 0.01\n{rows}"
    );
    std::fs::write(folder.path().join("arm.bvh"), &text).expect("the file");
    let one = text.replace("Frames: 216100", "Frames: 1");
    let (rest, _) = one.split_once("1 0 0 1").expect("the second row");
    std::fs::write(folder.path().join("still.bvh"), rest).expect("the target");
    let base = ["retarget", "--source", "arm.bvh", "--target", "still.bvh", "--output"];
    let output = retargetd(&[&base[..], &["out.bvh"]].concat(), folder.path());
    assert_eq!(code(&output), Some(0), "{}", error(&output));
    assert!(error(&output).contains("216100 frames in 53 sections"), "{}", error(&output));
    let text = std::fs::read_to_string(folder.path().join("out.bvh")).expect("text");
    assert_eq!(text.lines().rev().take_while(|line| !line.starts_with("Frame Time")).count(), 216_100, "every row");

    // What needs the whole clip says so, and what then forbids it.
    let output = retargetd(&[&base[..], &["out.fbx"]].concat(), folder.path());
    let told = error(&output);
    assert_eq!(code(&output), Some(3), "{told}");
    assert!(
        told.contains("held as a whole, since a fbx is written as a whole") && told.contains("frames_per_clip"),
        "{told}"
    );
    assert!(!folder.path().join("out.fbx").exists());
}

#[test]
fn what_cannot_be_done_in_sections_is_refused_and_leaves_nothing() {
    let folder = folder(300, Format::Glb);
    let walk = long_walk(300);
    let fbx = write(&samples::walk_scene(), &walk, &WriteOptions::new(Format::Fbx));
    let compressed = WriteOptions { compression: Compression::Meshopt, ..WriteOptions::new(Format::Glb) };
    let compressed = write(&samples::walk_scene(), &walk, &compressed);
    let bvh = String::from_utf8(write(&samples::walk_scene(), &walk, &WriteOptions::new(Format::Bvh))).expect("text");
    let glb = std::fs::read(folder.path().join("walk.glb")).expect("the walk");
    for (name, content) in [
        ("walk.fbx", fbx.as_slice()),
        ("compressed.glb", &compressed),
        ("short.bvh", bvh.replace("Frames: 300", "Frames: 400").as_bytes()),
        ("cut.glb", &glb[..glb.len() / 2]),
        ("speed.json", br#"{"edit": {"speed": 2}}"#),
        ("quantized.json", br#"{"output": {"compression": "quantized"}}"#),
        (
            "strict.json",
            br#"{"strict": true, "report": {"thresholds": {"jerk_ratio": {"warn_above": 0.1, "fail_above": 0.2}}}}"#,
        ),
    ] {
        std::fs::write(folder.path().join(name), content).expect("a file");
    }
    for (source, more, status, told) in [
        ("walk.fbx", &["--output", "out.glb"][..], 2, "only GLB and BVH files are read in sections"),
        ("compressed.glb", &["--output", "out.glb"], 2, "the file does not have one buffer"),
        ("walk.glb", &["--output", "out.fbx"], 2, "a fbx is written as a whole"),
        (
            "walk.glb",
            &["--output", "out.glb", "--config", "speed.json"],
            2,
            "/edit of the config is about the whole clip",
        ),
        ("walk.glb", &["--output", "-"], 2, "output -: a long clip is not written from its beginning to its end"),
        ("-", &["--output", "out.glb"], 2, "standard input is read as a whole"),
        ("short.bvh", &["--output", "out.glb"], 3, "declares 400 frames and has 300 rows"),
        ("cut.glb", &["--output", "out.glb"], 3, "the file is cut short"),
        ("walk.glb", &["--output", "out.glb", "--config", "quantized.json"], 3, "cannot be written in sections"),
        ("walk.glb", &["--output", "out.glb", "--config", "strict.json"], 3, "jerk_ratio"),
    ] {
        let arguments =
            [&["retarget", "--source", source, "--target", "mannequin.glb", "--sections"][..], more].concat();
        let output = retargetd(&arguments, folder.path());
        assert!(error(&output).contains(told), "{arguments:?}: {}", error(&output));
        assert_eq!(code(&output), Some(status), "{arguments:?}: {}", error(&output));
    }
    let left: Vec<_> = std::fs::read_dir(folder.path())
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .filter(|name| name.starts_with("out") || name.ends_with(".part"))
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

/// Real files, and hostile ones: what opens reads as the whole file does, or says what is wrong with it.
#[test]
fn sections_of_files_of_the_corpus_are_those_of_the_whole() {
    let Some(corpus) = corpus_file("") else { return };
    let control = Control::new();
    let (mut compared, mut whole_only, mut refused) = (0, 0, 0);
    for file in files_below(&corpus) {
        let ending = file.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        let is_small = std::fs::metadata(&file).is_ok_and(|metadata| metadata.len() < 8 << 20);
        if !["glb", "vrm", "bvh"].contains(&ending.as_str()) || !is_small {
            continue;
        }
        let bytes = std::fs::read(&file).expect("a file");
        let mut sections = match open_in_sections(Box::new(Cursor::new(bytes.clone())), &Limits::default(), &control) {
            Ok(Sectioned::File(sections)) => sections,
            Ok(Sectioned::WholeOnly(_) | Sectioned::OtherFormat) => {
                whole_only += 1;
                continue;
            }
            Err(_) => {
                refused += 1;
                continue;
            }
        };
        let format = sections.format();
        let frames = sections.times().frames();
        let part = frames / 3..frames / 3 + 10.min(frames - frames / 3);
        let read = |bytes: &[u8]| formats::read(bytes, format, &Limits::default(), &control, &mut Reporter::new());
        let section = sections.section(part.clone(), &control).and_then(|section| read(&section));
        // A file with fewer rows than it declares is read as a whole all the same, as are extras that we leave out.
        let (Ok(section), Ok(whole)) = (section, read(&bytes)) else {
            refused += 1;
            continue;
        };
        let shown = file.display();
        assert_eq!(section.skeleton, whole.skeleton, "{shown}");
        let clips = section.clips.first().zip(whole.clips.first()).filter(|(_, whole)| whole.frame_count() == frames);
        let Some((ours, theirs)) = clips else { continue };
        for (ours, theirs) in part.enumerate() {
            let (ours, theirs) = (pose_at(&section, ours), pose_at(&whole, theirs));
            for (ours, theirs) in ours.transforms().iter().zip(theirs.transforms()) {
                let size = 1.0 + theirs.translation.length();
                assert!(ours.translation.abs_diff_eq(theirs.translation, 1e-6 * size), "{shown}: {ours:?}, {theirs:?}");
                assert!(ours.rotation.dot(theirs.rotation).abs() > 1.0 - 1e-6, "{shown}: {ours:?}, {theirs:?}");
            }
        }
        assert_eq!(ours.name(), theirs.name(), "{shown}");
        compared += 1;
    }
    assert!(compared > 30, "{compared} files compared, {whole_only} whole only, {refused} refused");
}

fn pose_at(scene: &Scene, frame: usize) -> LocalPose {
    scene.clips[0].local_pose(&scene.skeleton, frame)
}

#[test]
fn a_face_that_is_not_moved_in_sections_is_told_of() {
    let Some(speaking) = crate::morphs::speaking(&[("A", "viseme_aa")]) else { return };
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("speaking.glb"), speaking).expect("the file");
    let base =
        ["retarget", "--source", "speaking.glb", "--target", "speaking.glb", "--output", "out.glb", "--sections"];
    let output = retargetd(&base, folder.path());
    let told = error(&output);
    assert_eq!(code(&output), Some(0), "{told}");
    assert!(told.contains("warning: morphs_not_written"), "{told}");
}

/// The sections of a file, read, against the same frames of the whole file, read.
#[track_caller]
fn assert_sections_are_those_of_the_whole(file: &[u8], format: Format) {
    let control = Control::new();
    let opened = open_in_sections(Box::new(Cursor::new(file.to_vec())), &Limits::default(), &control);
    let Ok(Sectioned::File(mut sections)) = opened else { panic!("it can be read in sections") };
    let whole = read(file, format);
    let clip = &whole.clips[0];
    assert_eq!(sections.times().frames(), clip.frame_count());
    for frames in [0..1, 0..clip.frame_count(), 100..140, 298..300] {
        let section = read(&sections.section(frames.clone(), &control).expect("a section"), format);
        assert_eq!(section.skeleton, whole.skeleton, "{frames:?}");
        assert_eq!(section.skin_points, whole.skin_points, "{frames:?}");
        assert_eq!(section.clips.len(), 1, "{frames:?}");
        let (ours, theirs) = (&section.clips[0], clip.section(frames.clone()));
        assert_eq!(ours.frame_count(), frames.len(), "{frames:?}");
        for frame in 0..frames.len() {
            let (ours, theirs) = (ours.local_pose(&whole.skeleton, frame), theirs.local_pose(&whole.skeleton, frame));
            for (ours, theirs) in ours.transforms().iter().zip(theirs.transforms()) {
                assert!(ours.translation.abs_diff_eq(theirs.translation, 1e-9), "{frames:?}, frame {frame}");
                assert!(ours.rotation.dot(theirs.rotation).abs() > 1.0 - 1e-9, "{frames:?}, frame {frame}");
            }
        }
    }
}

#[test]
fn sections_of_files_have_their_frames_and_everything_else() {
    let walk = long_walk(300);
    let mut still = walk.joints().to_vec();
    still[5].rotation = Track::Constant(Quat::from_rotation_x(0.3));
    let still = walk.clone().with_joints(still).expect("a clip");
    let options = WriteOptions { target_clips: TargetClips::Drop, ..WriteOptions::new(Format::Glb) };
    let quantized = WriteOptions { compression: Compression::Quantized, ..options.clone() };
    let of_walk = samples::walk_scene();
    assert_sections_are_those_of_the_whole(&write(&of_walk, &walk, &options), Format::Glb);
    assert_sections_are_those_of_the_whole(&write(&of_walk, &still, &options), Format::Glb);
    assert_sections_are_those_of_the_whole(&write(&of_walk, &walk, &quantized), Format::Glb);
    assert_sections_are_those_of_the_whole(&write(&of_walk, &walk, &WriteOptions::new(Format::Bvh)), Format::Bvh);
    // With a mesh, whose points are those of the whole file.
    let mannequin = read(&samples::mannequin(), Format::Glb);
    let moved = {
        let mut joints = vec![JointTracks::default(); mannequin.skeleton.len()];
        joints[3].rotation = Track::Sampled((0..300).map(|frame| Quat::from_rotation_y(frame as f32 * 0.01)).collect());
        Clip::new("turn".into(), (0..300).map(|frame| f64::from(frame) / 25.0).collect(), joints).expect("a clip")
    };
    assert_sections_are_those_of_the_whole(&write(&mannequin, &moved, &options), Format::Glb);
}
