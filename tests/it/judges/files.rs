//! GLB, FBX and BVH of one clip, read by three.js, by Blender and by assimp: the same poses from all of them.

use std::fs;

use retargetd::engine::Format;
use serde_json::Value;

use super::{Apart, Axes, MAX_DEGREES, MAX_OF_SIZE, Written, assimp, blender, retargeted, three};
use crate::support::corpus_file;

const SOURCE: &str = "mixamo/fbx/walking_noskin.fbx";
/// A skinned glTF, a skinned FBX, and a rig that is not made of Mixamo's names.
const TARGETS: [&str; 3] = ["mixamo/gltf/Xbot.glb", "mixamo/fbx/ybot_prerotation_skin.fbx", "unreal/mannequiny.glb"];
const FORMATS: [Format; 3] = [Format::Glb, Format::Fbx, Format::Bvh];

/// Files of all targets in all formats, and what is in those of a target.
struct Files {
    _folder: tempfile::TempDir,
    paths: Vec<String>,
    written: Vec<(&'static str, Written)>,
}

fn files() -> Option<Files> {
    let source = fs::read(corpus_file(SOURCE)?).expect("a file");
    let folder = tempfile::tempdir().expect("a folder");
    let (mut paths, mut written) = (Vec::new(), Vec::new());
    for (index, name) in TARGETS.into_iter().enumerate() {
        let target = fs::read(corpus_file(name)?).expect("a file");
        // So many frames that readers are asked for whole ones: what they do between two is theirs.
        let config = r#"{"edit": {"fps": 30, "range": [0, 0.8]}, "output": {"target_clips": "drop"}}"#;
        let outcome = retargeted((SOURCE, &source), (name, &target), config, &FORMATS);
        for output in &outcome.outputs {
            let path = folder.path().join(format!("{index}.{}", output.format.info().endings[0]));
            fs::write(&path, &output.bytes).expect("a file");
            paths.push(path.display().to_string());
        }
        written.push((name, Written::of(&outcome.outputs[0].bytes, "out.glb")));
    }
    Some(Files { _folder: folder, paths, written })
}

/// Joints of the first written clip that a reader has, compared.
fn compare(ours: &Written, seen: &Value, unit_meters: f64, axes: Axes) -> Apart {
    ours.apart(seen, unit_meters, axes, |joint| {
        let joint = &ours.scene.skeleton.joints()[joint];
        (joint.is_joint && !seen["joints"][&joint.name].is_null()).then(|| joint.name.clone())
    })
}

fn judge(files: &Files, answers: &[Value], centimeters: f64, axes_of: impl Fn(Format) -> Axes) {
    for (index, seen) in answers.iter().enumerate() {
        let (name, ours) = &files.written[index / FORMATS.len()];
        let format = FORMATS[index % FORMATS.len()];
        let unit = if format == Format::Fbx { centimeters } else { 1.0 };
        let apart = compare(ours, seen, unit, axes_of(format));
        let joints = ours.scene.skeleton.joints().iter().filter(|joint| joint.is_joint).count();
        assert!(apart.joints * 10 >= joints * 9, "{name} as {format:?}: {apart:?} of {joints}");
        assert!(apart.size < MAX_OF_SIZE && apart.degrees < MAX_DEGREES, "{name} as {format:?}: {apart:?}");
    }
}

#[test]
fn three_reads_the_same_poses() {
    let Some(files) = files() else { return };
    let Some(answers) = three::read(&files.paths) else { return };
    // Joints of a BVH have the axes of the world at rest.
    judge(&files, &answers, 0.01, |format| if format == Format::Bvh { Axes::Own } else { Axes::Same });
}

#[test]
fn blender_reads_the_same_poses() {
    let Some(files) = files() else { return };
    let Some(answers) = blender::read(&files.paths) else { return };
    judge(&files, &answers, 1.0, |_| Axes::Own);
}

#[test]
fn assimp_reads_the_same_poses() {
    let Some(files) = files() else { return };
    let Some(answers) = assimp::read(&files.paths) else { return };
    judge(&files, &answers, 0.01, |format| if format == Format::Bvh { Axes::Own } else { Axes::Same });
}
