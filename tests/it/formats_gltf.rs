//! The gltf reader and writer: real files round trip under the Khronos validator, an independent reader agrees, hostile
//! files fail cleanly.

pub(crate) mod same_document;
mod scenes;

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    sync::mpsc,
    thread,
    time::Duration,
};

use glam::{Quat, Vec3};
use retargetd::{
    formats::{self, Compression, ErrorKind, Format, FormatError, Include, Limits, TargetClips, WriteOptions},
    model::{Clip, Control, JointTracks, Reporter, Scene, Track, Warning},
};

use crate::support::{corpus_file, gltf_json, validate_gltf, with_buffers};
use same_document::assert_same_document;

const ENDINGS: [&str; 4] = ["glb", "gltf", "vrm", "vrma"];

/// Real files whose buffers lie in other files.
const WITH_OTHER_FILES: [&str; 2] = ["LeftHandHumanoid.gltf", "CesiumMan_draco/CesiumMan.gltf"];

#[test]
fn real_files_round_trip() {
    let Some(corpus) = corpus_file("") else { return };
    let files = gltf_files(&corpus, |path| !path.starts_with(corpus.join("hostile")));
    assert!(files.len() > 40, "the corpus holds real files, found {}", files.len());
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut pairs = Vec::new();
    for (index, file) in files.iter().enumerate() {
        let name = file.display().to_string();
        let mut bytes = fs::read(file).expect("readable");
        if WITH_OTHER_FILES.iter().any(|other| file.ends_with(other)) {
            let error = read(&bytes, file).map(|_| ()).expect_err("its buffer lies in another file");
            assert_eq!(error.kind, ErrorKind::UnsupportedFeature, "{name}: {error}");
            bytes = with_buffers(&bytes, file);
        }
        let (scene, _) = read(&bytes, file).unwrap_or_else(|error| panic!("{name}: {error}"));
        let json = gltf_json(&bytes);
        let wears_skin = |joint: usize| json["nodes"][scene.skeleton.joints()[joint].node]["skin"].is_u64();
        let clip = made_up_clip(scene.skeleton.len(), wears_skin);
        for (format, include, ending) in [
            (Format::Glb, Include::Everything, "glb"),
            (Format::Gltf, Include::Everything, "gltf"),
            (Format::Glb, Include::SkeletonAndAnimation, "skeleton.glb"),
        ] {
            let options = WriteOptions { include, ..WriteOptions::new(format) };
            let written = formats::write(&scene, &clip, &options, &Control::new(), &mut Reporter::new())
                .unwrap_or_else(|error| panic!("{name} as {ending}: {error}"));
            let (back, _) = read(&written, file).unwrap_or_else(|error| panic!("{name} as {ending}: {error}"));
            if scene.stretched.is_none() {
                // The nodes of a VRM animation are the weights of its expressions as well.
                let joints = back.clips[0].clone().with_morphs(Vec::new()).expect("a clip");
                assert_eq!(joints, clip, "{name} as {ending}: the clip comes back");
            } else {
                assert_same_places(&back, &scene, &clip, &name);
            }
            if include == Include::Everything {
                assert_same_document(&bytes, &written, &name);
                assert_eq!(back.clips[1..], scene.clips, "{name}: the old clips follow");
                assert_eq!(back.skins, scene.skins, "{name}: skins");
                assert_eq!(back.bind_pose, scene.bind_pose, "{name}: bind pose");
                assert_eq!(back.declared_roles, scene.declared_roles, "{name}: roles");
                assert_eq!(back.skeleton, scene.skeleton, "{name}: skeleton");
            } else {
                let rests = |scene: &Scene| -> Vec<_> {
                    let joints = scene.skeleton.joints().iter();
                    joints.map(|joint| (joint.name.clone(), joint.parent, joint.rest, joint.is_joint)).collect()
                };
                let any_marked = scene.skeleton.joints().iter().any(|joint| joint.is_joint);
                assert_eq!(back.skeleton.len(), scene.skeleton.len(), "{name}: as many nodes");
                for (ours, theirs) in rests(&back).into_iter().zip(rests(&scene)).filter(|_| any_marked) {
                    assert_eq!(ours, theirs, "{name}: a node of the skeleton alone");
                }
            }
            let path = folder.path().join(format!("{index}.{ending}"));
            fs::write(&path, written).expect("a file in the temporary folder");
            pairs.push((include == Include::Everything, file.clone(), path));
        }
        for (compression, target_clips) in [
            (Compression::Quantized, TargetClips::Keep),
            (Compression::Meshopt, TargetClips::Keep),
            (Compression::None, TargetClips::Drop),
        ] {
            let options = WriteOptions { compression, target_clips, ..WriteOptions::new(Format::Glb) };
            let written = formats::write(&scene, &clip, &options, &Control::new(), &mut Reporter::new())
                .unwrap_or_else(|error| panic!("{name}, {compression:?}: {error}"));
            assert_same_document(&bytes, &written, &name);
            let (back, _) = read(&written, file).unwrap_or_else(|error| panic!("{name}, {compression:?}: {error}"));
            let old = if target_clips == TargetClips::Keep { scene.clips.as_slice() } else { &[] };
            assert_eq!(back.clips[1..], *old, "{name}, {compression:?}: the old clips follow, or are dropped");
            assert_eq!(
                (&back.skins, &back.bind_pose),
                (&scene.skins, &scene.bind_pose),
                "{name}, {compression:?}: skins"
            );
            let path = folder.path().join(format!("{index}.{compression:?}.{target_clips:?}.glb"));
            fs::write(&path, written).expect("a file in the temporary folder");
            pairs.push((true, file.clone(), path));
        }
    }
    assert_nothing_new_is_wrong(&pairs);
}

/// Every code of an error or a warning that the validator finds in an output was there as often in its input; new documents have none.
pub(crate) fn assert_nothing_new_is_wrong<P: AsRef<Path>>(pairs: &[(bool, P, P)]) {
    let files: BTreeSet<&Path> =
        pairs.iter().flat_map(|(_, input, output)| [input.as_ref(), output.as_ref()]).collect();
    let Some(reports) = validate_gltf(&files.into_iter().collect::<Vec<_>>()) else { return };
    let mut problems = Vec::new();
    for (has_input, input, output) in pairs {
        let (input, output) = (input.as_ref(), output.as_ref());
        let (before, after) = (&reports[input], &reports[output]);
        for severity in ["codes", "warning_codes"] {
            for (code, count) in after[severity].as_object().expect("an object") {
                let had = if *has_input { before[severity][code].as_u64().unwrap_or(0) } else { 0 };
                if count.as_u64().unwrap_or(u64::MAX) > had {
                    let first = &after["first_error"];
                    problems.push(format!(
                        "{} from {}: {code} {had} → {count}: {first}",
                        output.display(),
                        input.display()
                    ));
                }
            }
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn an_independent_reader_agrees() {
    let Some(corpus) = corpus_file("") else { return };
    let mut compared = 0;
    for file in gltf_files(&corpus, |path| !path.starts_with(corpus.join("hostile"))) {
        let bytes = fs::read(&file).expect("readable");
        let name = file.display().to_string();
        let (Ok((scene, warnings)), Ok(document)) = (read(&bytes, &file), gltf::Gltf::from_slice(&bytes)) else {
            continue;
        };
        compared += 1;
        let joints = scene.skeleton.joints();
        assert_eq!(joints.len(), document.nodes().count(), "{name}: nodes");
        for joint in joints {
            let node = document.nodes().nth(joint.node).expect("as many nodes");
            assert_eq!(joint.name, node.name().unwrap_or(""), "{name}: name of node {}", joint.node);
            let parent = joint.parent.map(|parent| joints[parent].node);
            let theirs = document.nodes().find(|other| other.children().any(|child| child.index() == joint.node));
            assert_eq!(parent, theirs.map(|node| node.index()), "{name}: parent of node {}", joint.node);
        }
        let skins: Vec<Vec<usize>> =
            document.skins().map(|skin| skin.joints().map(|node| node.index()).collect()).collect();
        let ours: Vec<Vec<usize>> =
            scene.skins.iter().map(|skin| skin.joints.iter().map(|joint| joints[*joint].node).collect()).collect();
        assert_eq!(ours, skins, "{name}: joints of skins");
        assert_eq!(scene.clips.len(), document.animations().count(), "{name}: clips");
        // Joints that a clip stretches are turned as joints that keep their lengths.
        let is_straightened = |clip: &Clip| {
            warnings.iter().any(|warning| {
                let quoted = format!("'{}'", clip.name());
                warning.code == "stretched_clip" && (warning.place == clip.name() || warning.detail.contains(&quoted))
            })
        };
        let pairs = scene.clips.iter().zip(document.animations());
        for (clip, animation) in pairs.filter(|(clip, _)| !is_straightened(clip)) {
            assert_same_keys(&scene, clip, &animation, document.blob.as_deref(), &name);
        }
    }
    assert!(compared > 30, "the other reader can read most files, but compared only {compared}");
}

fn assert_same_keys(scene: &Scene, clip: &Clip, animation: &gltf::Animation<'_>, blob: Option<&[u8]>, name: &str) {
    assert_eq!(clip.name(), animation.name().unwrap_or(""), "{name}: name of a clip");
    for channel in animation.channels() {
        let Some(gltf::animation::util::ReadOutputs::Rotations(rotations)) = channel.reader(|_| blob).read_outputs()
        else {
            continue;
        };
        let Some(times) = channel.reader(|_| blob).read_inputs().map(|times| times.collect::<Vec<f32>>()) else {
            continue;
        };
        assert!(times.len() <= clip.frame_count(), "{name}: no key is lost");
        if channel.sampler().interpolation() != gltf::animation::Interpolation::Linear {
            continue;
        }
        let node = channel.target().node().index();
        let joint = scene.skeleton.joints().iter().position(|joint| joint.node == node).expect("the node is there");
        for (time, rotation) in times.iter().zip(rotations.into_f32()) {
            let frame =
                clip.times_seconds().iter().position(|other| *other == f64::from(*time)).expect("the key is there");
            let ours = clip.joints()[joint].rotation.at(frame, Quat::IDENTITY);
            let theirs = Quat::from_array(rotation).normalize();
            assert!(ours.dot(theirs).abs() > 1.0 - 1e-6, "{name}: node {node} at {time} s: {ours} and {theirs}");
        }
    }
}

#[test]
fn hostile_files_fail_cleanly_or_are_read() {
    let Some(corpus) = corpus_file("hostile") else { return };
    let files = gltf_files(&corpus, |_| true);
    assert!(files.len() > 150, "the corpus holds hostile files, found {}", files.len());
    for file in files {
        let bytes = fs::read(&file).expect("readable");
        read_and_write_under_watch(bytes, &file);
    }
}

#[test]
fn hostile_files_that_must_be_refused_are() {
    let accepted = [
        "reference_ok",
        "anim_single_key",
        "anim_quaternion_zero",
        "node_rotation_zero_quaternion",
        "node_scale_zero",
        "skin_ibm_singular",
        "no_skin_no_animation",
        "anim_duration_1e9",
        "json_duplicate_keys",
    ];
    let Some(folder) = corpus_file("hostile/gltf") else { return };
    for file in gltf_files(&folder, |_| true) {
        let stem = file.file_stem().and_then(|stem| stem.to_str()).expect("a name");
        let result = read(&fs::read(&file).expect("readable"), &file);
        match result {
            Ok(_) => assert!(accepted.contains(&stem), "{stem} must be refused"),
            Err(error) => {
                assert!(!accepted.contains(&stem), "{stem} must be read: {error}");
                assert!(!error.hint.is_empty(), "{stem}: says what to do: {error}");
            }
        }
    }
}

#[test]
fn damaged_bytes_never_panic() {
    let Some(small) = corpus_file("vrma/test_small.vrma") else { return };
    let Some(compressed) = corpus_file("humanik-unity/viverse_mannequin_meshopt.glb") else { return };
    for (file, rounds) in [(small, 400_u64), (compressed, 60)] {
        let whole = fs::read(&file).expect("readable");
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let mut next = |below: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % below
        };
        for round in 0..rounds {
            let mut bytes = whole.clone();
            for _ in 0..=round % 8 {
                let at = next(bytes.len());
                bytes[at] = next(256) as u8;
            }
            if round % 5 == 0 {
                bytes.truncate(next(whole.len()));
            }
            read_and_write_under_watch(bytes, &file);
        }
    }
}

/// Reads, and writes what could be read. Fails when that panics, or hangs for as long as no file may take.
fn read_and_write_under_watch(bytes: Vec<u8>, file: &Path) {
    let name = file.display().to_string();
    let (sender, receiver) = mpsc::sync_channel(1);
    let path = file.to_owned();
    let worker = thread::spawn(move || {
        if let Ok((scene, _)) = read(&bytes, &path) {
            let clip = made_up_clip(scene.skeleton.len(), |_| false);
            let options =
                WriteOptions { extras: Some(serde_json::json!({"test": true})), ..WriteOptions::new(Format::Glb) };
            formats::write(&scene, &clip, &options, &Control::new(), &mut Reporter::new()).map(|_| ()).ok();
        }
        sender.send(()).ok();
    });
    match receiver.recv_timeout(Duration::from_secs(60)) {
        Ok(()) => {}
        Err(mpsc::RecvTimeoutError::Timeout) => panic!("{name}: hangs"),
        Err(mpsc::RecvTimeoutError::Disconnected) => panic!("{name}: panicked: {:?}", worker.join()),
    }
}

/// Reads what sniffing says, as long as that is one of the glTF formats.
fn read(bytes: &[u8], file: &Path) -> Result<(Scene, Vec<Warning>), FormatError> {
    let name = file.file_name().and_then(|name| name.to_str()).unwrap_or("");
    let format = formats::sniff(bytes, name)?;
    if !matches!(format, Format::Glb | Format::Gltf | Format::Vrm | Format::Vrma) {
        return Err(FormatError::malformed("test", "", "not glTF"));
    }
    let mut reporter = Reporter::new();
    let scene = formats::read(bytes, format, &Limits::default(), &Control::new(), &mut reporter)?;
    Ok((scene, reporter.into_warnings()))
}

/// Four frames that move every joint but those that stay: moving a node that wears a skin does nothing, and the validator says so.
fn made_up_clip(joints: usize, stays: impl Fn(usize) -> bool) -> Clip {
    let frames = 0..4_u8;
    let times = frames.clone().map(|frame| f64::from(f32::from(frame) / 30.0)).collect();
    let tracks = |joint: usize| {
        if stays(joint) {
            return JointTracks::default();
        }
        let angle = |frame: u8| f32::from(frame) * 0.2 + joint as f32 * 0.01;
        JointTracks {
            translation: Track::Sampled(frames.clone().map(|frame| Vec3::new(angle(frame), 1.0, -0.5)).collect()),
            rotation: Track::Sampled(frames.clone().map(|frame| Quat::from_rotation_y(angle(frame))).collect()),
            scale: Track::Constant(Vec3::ONE),
        }
    };
    Clip::new("made up".into(), times, (0..joints).map(tracks).collect()).expect("a valid clip")
}

/// Joints that their file stretches are where the clip has them, though its own rotations and scales say so otherwise.
fn assert_same_places(back: &Scene, scene: &Scene, clip: &Clip, name: &str) {
    for frame in 0..clip.frame_count() {
        let places = |clip: &Clip, scene: &Scene| clip.local_pose(&scene.skeleton, frame).to_model(&scene.skeleton);
        let (found, expected) = (places(&back.clips[0], back), places(clip, scene));
        for (found, expected) in found.transforms().iter().zip(expected.transforms()) {
            let distance = found.translation.distance(expected.translation);
            assert!(distance < 1e-4 * expected.translation.length(), "{name}: frame {frame}: {distance} m away");
        }
    }
}

/// All files below a folder with an ending of ours, in order.
fn gltf_files(folder: &Path, wanted: impl Fn(&Path) -> bool) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or("");
            if path.is_dir() {
                open.push(path);
            } else if ENDINGS.contains(&ending) && wanted(&path) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}
