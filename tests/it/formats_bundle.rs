//! Models in several files: as a zip, and beside one another on the command line.

use std::{io::Write, path::Path, process::Command};

use retargetd::{
    engine::{self, Inputs, NamedBytes},
    formats::{self, Format, Limits},
    model::Control,
    samples,
};
use serde_json::{Value, json};
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

use crate::support::{corpus_file, gltf_json};

fn archive(members: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, bytes) in members {
        zip.start_file(*name, options).expect("a member");
        zip.write_all(bytes).expect("written");
    }
    zip.finish().expect("an archive").into_inner()
}

/// The mannequin as a document, and its buffer.
fn in_pieces(uri: &str) -> (Vec<u8>, Vec<u8>) {
    let glb = samples::mannequin();
    let mut json = gltf_json(&glb);
    let json_bytes = u32::from_le_bytes(glb[12..16].try_into().expect("four bytes")) as usize;
    let binary = glb[20 + json_bytes + 8..].to_vec();
    json["buffers"][0]["uri"] = Value::String(uri.to_owned());
    json["images"] = json!([{"uri": "skin.png"}]);
    (serde_json::to_vec(&json).expect("JSON"), binary)
}

fn unpack(bytes: &[u8]) -> Result<formats::Unpacked, String> {
    formats::unpack(bytes, &Limits::default(), &Control::new()).map_err(|error| error.to_string())
}

#[test]
fn a_zip_is_read_as_the_model_in_it() {
    let (document, buffer) = in_pieces("../my%20buffers/body.bin");
    let image = b"\x89PNG\r\n\x1a\n";
    let zip = archive(&[
        ("__MACOSX/model/._hero.gltf", b"junk"),
        ("my buffers/body.bin", &buffer),
        ("model/hero.gltf", &document),
        ("model/SKIN.png", image),
        ("read me.txt", b"hello"),
    ]);
    assert_eq!(formats::sniff(&zip, "hero.zip"), Ok(Format::Zip));
    let found = unpack(&zip).expect("one model");
    assert_eq!(found.name, "hero.gltf");
    let json: Value = serde_json::from_slice(&found.bytes).expect("JSON");
    assert!(json["buffers"][0]["uri"].as_str().is_some_and(|uri| uri.starts_with("data:application/octet-stream;")));
    assert_eq!(
        json["images"][0]["uri"], "data:image/png;base64,iVBORw0KGgo=",
        "the image goes along, whatever its case"
    );

    let (walk, limits, control) = (samples::walk_clip(), Limits::default(), Control::new());
    let onto = |name, bytes: &[u8]| {
        let target = NamedBytes { name, bytes };
        let source = NamedBytes { name: "walk.glb", bytes: &walk };
        let inputs =
            Inputs { source, target, source_rest: None, target_rest: None, config: None, formats: &[Format::PosesNpz] };
        engine::retarget(&inputs, &limits, &control).expect("it is retargeted").outputs.remove(0).bytes
    };
    assert!(onto("hero.zip", &zip) == onto("hero.glb", &samples::mannequin()), "the same as from one file");
    let source = archive(&[("walk.glb", &walk)]);
    assert_eq!(unpack(&source).expect("a GLB").bytes, walk, "what points nowhere is taken as it is");
}

#[test]
fn archives_that_are_no_model_say_what_they_are() {
    let (document, _) = in_pieces("body.bin");
    let refused = |members: &[(&str, &[u8])]| unpack(&archive(members)).expect_err("no model");
    assert!(refused(&[]).contains("holds no model"), "an empty archive");
    assert!(refused(&[("a.txt", b"")]).contains("only 'a.txt'"), "names what is there");
    let two = refused(&[("a.fbx", b""), ("b/c.GLB", b"")]);
    assert!(two.contains("2 models") && two.contains("'b/c.GLB'"), "names both: {two}");
    let alone = refused(&[("hero.gltf", &document)]);
    assert!(alone.contains("/buffers/0/uri") && alone.contains("'body.bin', which does not exist"), "{alone}");
    let (climbing, _) = in_pieces("../../etc/passwd");
    assert!(refused(&[("hero.gltf", &climbing)]).contains("which does not exist"), "nothing outside is looked for");
    let (elsewhere, _) = in_pieces("https://example.com/body.bin");
    let kept = unpack(&archive(&[("hero.gltf", &elsewhere)])).expect("left to the reader");
    let error = formats::read(&kept.bytes, Format::Gltf, &Limits::default(), &Control::new(), &mut Default::default());
    assert!(error.expect_err("not fetched").to_string().contains("another file"), "nothing is fetched");
    let nested = archive(&[("hero.glb", &archive(&[("hero.glb", b"")]))]);
    let read = formats::read(&nested, Format::Zip, &Limits::default(), &Control::new(), &mut Default::default());
    assert!(read.is_err(), "an archive in an archive is not opened");
    let bomb = archive(&[("hero.bvh", &vec![b' '; 64 << 20])]);
    assert!(
        unpack(&bomb).expect_err("a thousand to one").contains("decompression_ratio"),
        "paid for before it is unpacked"
    );
    let whole = archive(&[("hero.bvh", b"HIERARCHY ROOT a { }")]);
    for length in 0..whole.len() {
        assert!(unpack(&whole[..length]).is_err(), "cut to {length} bytes");
    }
    for index in 0..whole.len() {
        let mut damaged = whole.clone();
        damaged[index] ^= 0x55;
        // Some damage is a different valid archive; all of it must be survived.
        let _ = unpack(&damaged);
    }
}

#[test]
fn a_document_finds_its_neighbors_on_the_command_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (document, buffer) = in_pieces("data/body.bin");
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("data")).expect("a folder");
    std::fs::write(at("hero.gltf"), &document).expect("written");
    let inspect = |path: &Path| {
        let output = Command::new(env!("CARGO_BIN_EXE_retargetd")).arg("inspect").arg(path).output().expect("it runs");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (code, error) = inspect(&at("hero.gltf"));
    assert!(code == Some(3) && error.contains("'data/body.bin', which does not exist"), "{code:?} {error}");
    std::fs::write(at("data/body.bin"), &buffer).expect("written");
    assert_eq!(inspect(&at("hero.gltf")).0, Some(0), "with its buffer it is whole");
    std::fs::write(at("below.bin"), &buffer).expect("written");
    let (climbing, _) = in_pieces("../below.bin");
    std::fs::write(at("data/climbing.gltf"), climbing).expect("written");
    assert_eq!(inspect(&at("data/climbing.gltf")).0, Some(3), "what lies above its folder is not opened");
}

#[test]
fn real_documents_in_pieces_are_read() {
    for (folder, model) in
        [("khronos/CesiumMan_draco", "CesiumMan.gltf"), ("creatures/hand_left_only", "LeftHandHumanoid.gltf")]
    {
        let Some(folder) = corpus_file(folder) else { return };
        let members: Vec<(String, Vec<u8>)> = std::fs::read_dir(folder)
            .expect("a folder")
            .map(|entry| entry.expect("an entry").path())
            .map(|path| {
                (
                    path.file_name().expect("a name").to_string_lossy().into_owned(),
                    std::fs::read(&path).expect("a file"),
                )
            })
            .collect();
        let members: Vec<(&str, &[u8])> =
            members.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect();
        let zip = archive(&members);
        let (limits, control) = (Limits::default(), Control::new());
        let scene = formats::read(&zip, Format::Zip, &limits, &control, &mut Default::default());
        let scene = scene.unwrap_or_else(|error| panic!("{model}: {error}"));
        assert!(!scene.skins.is_empty() && !scene.skeleton.is_empty(), "{model}: joints and a skin");
    }
}
