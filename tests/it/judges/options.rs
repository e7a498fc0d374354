//! Outputs in all their forms say the same.

use std::fs;

use retargetd::engine::Format;
use serde_json::Value;

use super::{Axes, MAX_DEGREES, MAX_OF_SIZE, Written, angle, retargeted, three};
use crate::{
    formats_gltf::assert_nothing_new_is_wrong,
    support::{corpus_file, gltf_json},
};

const SOURCE: &str = "mixamo/fbx/walking_noskin.fbx";
/// Half a thousand frames: of a short clip, the document is most of the file.
const LONG: &str = "mixamo/fbx/samba_dancing_skin.fbx";
const TARGET: &str = "mixamo/gltf/Xbot.glb";

fn pair() -> Option<(Vec<u8>, Vec<u8>)> {
    Some((fs::read(corpus_file(SOURCE)?).expect("a file"), fs::read(corpus_file(TARGET)?).expect("a file")))
}

/// The largest distance in meters and angle in degrees between the joints of two files.
fn apart(one: &Written, other: &Written) -> (f64, f64) {
    let (skeleton, mut farthest, mut widest) = (&one.scene.skeleton, 0.0_f64, 0.0_f64);
    for frame in 0..one.clip.frame_count() {
        let [here, there] = [one, other].map(|file| file.clip.local_pose(&file.scene.skeleton, frame));
        for (here, there) in here.to_model(skeleton).transforms().iter().zip(there.to_model(skeleton).transforms()) {
            farthest = farthest.max(here.translation.distance(there.translation));
            widest = widest.max(angle(here.rotation, there.rotation).to_degrees());
        }
    }
    (farthest, widest)
}

#[test]
fn small_files_move_as_large_ones_do() {
    let Some(((_, target), long)) = pair().zip(corpus_file(LONG)) else { return };
    let source = fs::read(long).expect("a file");
    let folder = tempfile::tempdir().expect("a folder");
    let written = |config: &str, name: &str| {
        let outcome = retargeted((LONG, &source), (TARGET, &target), config, &[]);
        let bytes = outcome.outputs[0].bytes.clone();
        let file = folder.path().join(name);
        fs::write(&file, &bytes).expect("a file");
        (Written::of(&bytes, name), bytes, file)
    };
    let skeleton = r#""include": "skeleton+animation""#;
    let (plain, large, _) = written(&format!(r#"{{"output": {{{skeleton}}}}}"#), "plain.glb");
    let mut files = Vec::new();
    for (compression, most_of_size) in [("quantized", 0.8), ("meshopt", 0.55)] {
        let small = format!(r#"{{"output": {{{skeleton}, "compression": "{compression}"}}}}"#);
        let (back, bytes, file) = written(&small, &format!("{compression}.glb"));
        let (farthest, widest) = apart(&plain, &back);
        assert!(
            farthest < MAX_OF_SIZE * plain.size() && widest < MAX_DEGREES,
            "{compression}: {farthest} m, {widest} degrees"
        );
        let size = bytes.len() as f64 / large.len() as f64;
        assert!(size < most_of_size, "{compression}: {size} of the size");
        files.push(file);
        // With the whole document around it, and as text.
        let whole = format!(r#"{{"output": {{"format": "gltf", "compression": "{compression}"}}}}"#);
        let (back, _, file) = written(&whole, &format!("{compression}.gltf"));
        let (farthest, widest) = apart(&plain, &back);
        let is_close = farthest < MAX_OF_SIZE * plain.size() && widest < MAX_DEGREES;
        assert!(is_close, "{compression}, in the whole document: {farthest} m, {widest} degrees");
        files.push(file);
    }
    let paths: Vec<_> = files.iter().map(|file| file.as_path()).collect();
    let input = corpus_file(TARGET).expect("it was there");
    // Skeletons alone, and the whole document, in turn.
    let pairs: Vec<_> =
        paths.iter().enumerate().map(|(index, path)| (index % 2 == 1, input.as_path(), *path)).collect();
    assert_nothing_new_is_wrong(&pairs);
    let names: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    let Some(answers) = three::read(&names) else { return };
    for seen in &answers {
        let apart = plain.apart(seen, 1.0, Axes::Same, |joint| {
            let joint = &plain.scene.skeleton.joints()[joint];
            joint.is_joint.then(|| joint.name.clone())
        });
        assert!(apart.size < MAX_OF_SIZE && apart.degrees < MAX_DEGREES, "{}: {apart:?}", seen["file"]);
    }
}

#[test]
fn an_archive_holds_the_document_and_its_buffer() {
    let Some((source, target)) = pair() else { return };
    let outcome = retargeted((SOURCE, &source), (TARGET, &target), "{}", &[Format::Glb, Format::Zip]);
    let [glb, zip] = [0, 1].map(|index| &outcome.outputs[index].bytes);
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(zip)).expect("an archive");
    let names: Vec<String> = (0..archive.len())
        .map(|index| archive.by_index(index).expect("a file").name().expect("a name").into_owned())
        .collect();
    assert_eq!(names, ["scene.bin", "scene.gltf"], "nothing else");
    let document: Value = serde_json::from_reader(archive.by_name("scene.gltf").expect("there")).expect("JSON");
    assert_eq!(document["buffers"][0]["uri"], "scene.bin", "relative");
    let mut same = document;
    same["buffers"][0].as_object_mut().expect("an object").remove("uri");
    assert_eq!(same, gltf_json(glb), "but for that, the document of the GLB");
    assert_eq!(Written::of(glb, "a.glb").clip, Written::of(zip, "a.zip").clip, "it comes back");
    // An archive is unpacked by whoever takes it; then it is an ordinary pair of files.
    let folder = tempfile::tempdir().expect("a folder");
    archive.extract(folder.path()).expect("it can be unpacked");
    let file = folder.path().join("scene.gltf");
    let input = corpus_file(TARGET).expect("it was there");
    assert_nothing_new_is_wrong(&[(true, &input, &file)]);
}

/// Everything that can be asked of a glTF, each with each other.
#[test]
fn whatever_is_asked_for_is_valid() {
    let Some((source, target)) = pair() else { return };
    let mut asked = Vec::new();
    for format in ["glb", "gltf"] {
        for include in ["full", "skeleton+animation"] {
            for compression in ["none", "quantized", "meshopt"] {
                for target_clips in ["keep", "drop"] {
                    for keys in ["all", "needed"] {
                        asked.push(serde_json::json!({
                            "format": format, "include": include, "compression": compression,
                            "target_clips": target_clips, "keys": keys, "clip_name": "walk",
                        }));
                    }
                }
            }
        }
    }
    let folder = tempfile::tempdir().expect("a folder");
    let input = corpus_file(TARGET).expect("it was there");
    let mut files = Vec::new();
    // As many as one run may be asked for.
    for some in asked.chunks(8) {
        let config = serde_json::json!({"edit": {"fps": 30}, "output": some}).to_string();
        let outcome = retargeted((SOURCE, &source), (TARGET, &target), &config, &[]);
        for output in &outcome.outputs {
            let file = folder.path().join(format!("{}.{}", files.len(), output.format.info().endings[0]));
            fs::write(&file, &output.bytes).expect("a file");
            files.push(file);
        }
    }
    assert_eq!(files.len(), asked.len(), "one for each");
    let has_input = |index: usize| asked[index]["include"] == "full";
    let pairs: Vec<_> =
        files.iter().enumerate().map(|(index, file)| (has_input(index), input.as_path(), file.as_path())).collect();
    assert_nothing_new_is_wrong(&pairs);
}

#[test]
fn a_table_says_where_joints_are() {
    let Some((source, target)) = pair() else { return };
    let outcome = retargeted((SOURCE, &source), (TARGET, &target), "{}", &[Format::Glb, Format::PositionsCsv]);
    let ours = Written::of(&outcome.outputs[0].bytes, "a.glb");
    assert_eq!(outcome.outputs[1].name.rsplit('.').next(), Some("csv"));
    let text = String::from_utf8(outcome.outputs[1].bytes.clone()).expect("text");
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().expect("a header");
    let column = header.iter().position(|cell| *cell == "mixamorig:LeftHand.x").expect("the hand");
    let hand = ours.scene.skeleton.find("mixamorig:LeftHand").expect("the hand");
    let rows: Vec<Vec<&str>> = lines.collect();
    assert_eq!(rows.len(), ours.clip.frame_count(), "one row per frame");
    for (frame, row) in rows.iter().enumerate() {
        let pose = ours.clip.local_pose(&ours.scene.skeleton, frame).to_model(&ours.scene.skeleton);
        let told = glam::DVec3::from_array([0, 1, 2].map(|axis| row[column + axis].parse().expect("a number")));
        assert!(told.distance(pose.transforms()[hand].translation) < 2e-6, "frame {frame}");
    }
}

#[test]
fn outputs_say_what_they_were_made_of() {
    let Some((_, target)) = pair() else { return };
    // A walk that goes somewhere, so that its feet stand now and then.
    let source = retargetd::samples::walk_clip();
    let config = r#"{"ops": [{"op": "contacts"}, {"op": "pelvis"}, {"op": "fk"}]}"#;
    let outcome = retargeted(("walk.glb", &source), (TARGET, &target), config, &[Format::Glb]);
    let extras = gltf_json(&outcome.outputs[0].bytes)["asset"]["extras"]["retargetd"].clone();
    assert_eq!(extras["engine"]["name"], "retargetd", "{extras}");
    for part in ["source_sha256", "spec_sha256"] {
        assert_eq!(extras[part].as_str().map(str::len), Some(64), "{part}");
    }
    let contacts = extras["contacts"].as_array().expect("what stands when");
    let last = Written::of(&outcome.outputs[0].bytes, "a.glb").clip.frame_count() as u64 - 1;
    assert!(contacts.len() >= 2, "both feet of a walk: {contacts:?}");
    for contact in contacts {
        let spans = contact["frames"].as_array().expect("spans");
        let ends: Vec<u64> = spans.iter().flat_map(|span| [&span[0], &span[1]]).filter_map(Value::as_u64).collect();
        assert!(!ends.is_empty() && ends.is_sorted() && ends.iter().all(|frame| *frame <= last), "{contact}");
        assert!(
            contact["joint"].as_str().is_some_and(|name| name.contains("Foot") || name.contains("Toe")),
            "{contact}"
        );
    }
    let resolved = outcome.resolved_spec.to_string();
    let again = retargeted(("walk.glb", &source), (TARGET, &target), &resolved, &[Format::Glb]);
    assert_eq!(
        again.outputs[0].bytes, outcome.outputs[0].bytes,
        "the resolved spec makes the same file, digests and all"
    );
}

#[test]
fn clips_are_called_kept_and_thinned_as_asked() {
    let Some((source, target)) = pair() else { return };
    let written = |output: &str, format: Format| {
        let config = format!(r#"{{"output": {output}}}"#);
        retargeted((SOURCE, &source), (TARGET, &target), &config, &[format]).outputs.remove(0).bytes
    };
    let clips = |bytes: &[u8]| -> Vec<String> {
        let animations = gltf_json(bytes)["animations"].as_array().cloned().unwrap_or_default();
        animations.iter().map(|animation| animation["name"].as_str().unwrap_or_default().to_owned()).collect()
    };
    let own = clips(&target);
    assert!(own.len() > 1, "the target has clips of its own: {own:?}");
    let kept = clips(&written(r#"{"clip_name": "stroll"}"#, Format::Glb));
    assert_eq!(
        (kept[0].as_str(), &kept[1..]),
        ("stroll", own.as_slice()),
        "the new one first, and all that were there"
    );
    assert_eq!(clips(&written(r#"{"clip_name": "stroll", "target_clips": "drop"}"#, Format::Glb)), ["stroll"]);
    for format in [Format::Fbx, Format::PosesNpz, Format::Vrma] {
        let bytes = written(r#"{"clip_name": "stroll"}"#, format);
        let name = format!("out.{}", format.info().endings[0]);
        assert_eq!(Written::of(&bytes, &name).clip.name(), "stroll", "{format:?}");
    }

    let plain = Written::of(&written(r#"{"target_clips": "drop"}"#, Format::Glb), "plain.glb");
    let thin = written(r#"{"target_clips": "drop", "keys": "needed"}"#, Format::Glb);
    let keys = |bytes: &[u8]| -> u64 {
        let json = gltf_json(bytes);
        let samplers = json["animations"][0]["samplers"].as_array().expect("samplers");
        samplers
            .iter()
            .filter_map(|sampler| json["accessors"][sampler["input"].as_u64()? as usize]["count"].as_u64())
            .sum()
    };
    let all = keys(&written(r#"{"target_clips": "drop"}"#, Format::Glb));
    assert!(keys(&thin) * 2 < all, "{} keys of {all}", keys(&thin));
    let thin = Written::of(&thin, "thin.glb");
    for part in 0..5 {
        let seconds = f64::from(part) * 0.25 * plain.clip.duration_seconds();
        let [one, other] = [&plain, &thin].map(|file| file.pose(seconds).to_model(&file.scene.skeleton));
        let pairs = one.transforms().iter().zip(other.transforms());
        let farthest = pairs.map(|(one, other)| one.translation.distance(other.translation)).fold(0.0, f64::max);
        assert!(farthest < 0.01 * plain.size(), "{farthest} m off at {seconds} s");
    }
}
