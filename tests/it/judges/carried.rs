//! What a target has beside its skeleton, after a whole retarget onto it: nothing is lost, and it does what it did.

use std::fs;

use retargetd::{engine::Format, samples};
use serde_json::{Value, json};

use super::{Axes, MAX_DEGREES, MAX_OF_SIZE, Written, retargeted, three};
use crate::{
    formats_gltf::same_document::assert_same_document,
    support::{corpus_file, files_below, gltf_json, validate_gltf},
};

/// Meshes that nobody here decodes: the skeleton moves, and the mesh goes on as it came, bound to the same joints.
#[test]
fn compressed_meshes_go_through_with_their_skins() {
    const TARGET: &str = "cc0-stylised/quaternius_orc_draco.glb";
    let Some(path) = corpus_file(TARGET) else { return };
    let target = fs::read(&path).expect("a file");
    let outcome = retargeted(("walk.glb", &samples::walk_clip()), (TARGET, &target), "{}", &[Format::Glb]);
    let bytes = &outcome.outputs[0].bytes;
    assert_same_document(&target, bytes, TARGET);
    let (before, ours) = (Written::of(&target, TARGET), Written::of(bytes, "out.glb"));
    assert_eq!(ours.scene.skins, before.scene.skins, "bound to the same joints");
    assert!(ours.clip.is_animated(), "which move");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("out.glb");
    fs::write(&file, bytes).expect("a file");
    if let Some(reports) = validate_gltf(&[&path, &file]) {
        let codes = |path: &std::path::Path| (reports[path]["codes"].clone(), reports[path]["warning_codes"].clone());
        assert_eq!(codes(&file), codes(&path), "nothing is wrong that was not");
    }
    let Some(answers) = three::read(&[file.display().to_string()]) else { return };
    let apart = ours.apart(&answers[0], 1.0, Axes::Same, |joint| {
        let joint = &ours.scene.skeleton.joints()[joint];
        joint.is_joint.then(|| joint.name.clone())
    });
    assert!(apart.size < MAX_OF_SIZE && apart.degrees < MAX_DEGREES, "{apart:?}");
}

/// A document in pieces whose mesh is compressed, as an archive.
#[test]
fn compressed_meshes_in_pieces_go_through() {
    let Some(folder) = corpus_file("khronos/CesiumMan_draco") else { return };
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for path in files_below(&folder) {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        archive.start_file(name, zip::write::SimpleFileOptions::default()).expect("a member");
        std::io::Write::write_all(&mut archive, &fs::read(&path).expect("a file")).expect("it is written");
    }
    let archive = archive.finish().expect("an archive").into_inner();
    let walk = samples::walk_clip();
    let outcome = retargeted(("walk.glb", &walk), ("man.zip", &archive), "{}", &[Format::Glb, Format::Zip]);
    for output in &outcome.outputs {
        let ours = Written::of(&output.bytes, &output.name);
        assert!(ours.clip.is_animated() && ours.scene.skins.len() == 1, "{}: it moves its skin", output.name);
    }
    let json = gltf_json(&outcome.outputs[0].bytes);
    let draco = &json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"];
    assert!(draco["bufferView"].is_u64(), "the mesh is as compressed as it was: {draco}");
    assert!(json["images"][0]["bufferView"].is_u64(), "and the image is bytes of the GLB");
}

/// A material that an animation makes glow, on a character that gets a walk.
#[test]
fn what_an_animation_points_at_goes_on_moving() {
    let target = glowing();
    let outcome = retargeted(("walk.glb", &samples::walk_clip()), ("target.gltf", &target), "{}", &[Format::Glb]);
    let (before, after) = (gltf_json(&target), gltf_json(&outcome.outputs[0].bytes));
    assert_eq!(after["animations"].as_array().map(Vec::len), Some(2), "the walk, and what was there");
    assert_eq!(after["animations"][1], before["animations"][0], "the pointer, and its keys");
    assert_eq!(after["materials"], before["materials"]);
    assert!(after["extensionsUsed"].as_array().is_some_and(|used| used.contains(&json!("KHR_animation_pointer"))));
    assert_same_document(&target, &outcome.outputs[0].bytes, "the rest");
}

/// The mannequin with a material that glows more and more.
fn glowing() -> Vec<u8> {
    let scene = crate::quality::figure::read_scene(&samples::mannequin(), "mannequin.glb");
    let still = vec![retargetd::model::JointTracks::default(); scene.skeleton.len()];
    let clip = retargetd::model::Clip::new("still".into(), vec![0.0], still).expect("a clip");
    let options = retargetd::formats::WriteOptions {
        target_clips: retargetd::formats::TargetClips::Drop,
        ..retargetd::formats::WriteOptions::new(Format::Gltf)
    };
    let control = retargetd::model::Control::new();
    let bytes = retargetd::formats::write(&scene, &clip, &options, &control, &mut Default::default());
    let mut json: Value = serde_json::from_slice(&bytes.expect("it is written")).expect("JSON");
    let push = |json: &mut Value, list: &str, value: Value| {
        if json[list].is_null() {
            json[list] = json!([]);
        }
        let list = json[list].as_array_mut().expect("a list");
        list.push(value);
        list.len() - 1
    };
    let keys: Vec<u8> = [0.0_f32, 1.0].iter().flat_map(|key| key.to_le_bytes()).collect();
    let uri = {
        use base64::{Engine as _, engine::general_purpose::STANDARD};
        format!("data:application/octet-stream;base64,{}", STANDARD.encode(&keys))
    };
    let buffer = push(&mut json, "buffers", json!({"byteLength": keys.len(), "uri": uri}));
    let view = push(&mut json, "bufferViews", json!({"buffer": buffer, "byteLength": keys.len()}));
    let accessor =
        json!({"bufferView": view, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]});
    let accessor = push(&mut json, "accessors", accessor);
    let strength = json!({"emissiveStrength": 1});
    let material = json!({"name": "glow", "extensions": {"KHR_materials_emissive_strength": strength}});
    let material = push(&mut json, "materials", material);
    let pointer = format!("/materials/{material}/extensions/KHR_materials_emissive_strength/emissiveStrength");
    let target = json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}});
    json["animations"] = json!([{
        "name": "glow",
        "channels": [{"sampler": 0, "target": target}],
        "samplers": [{"input": accessor, "output": accessor}],
    }]);
    for extension in ["KHR_animation_pointer", "KHR_materials_emissive_strength"] {
        push(&mut json, "extensionsUsed", json!(extension));
    }
    json.to_string().into_bytes()
}
