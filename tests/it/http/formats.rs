//! Every format and option of the output, over HTTP.

use reqwest::{
    Client, Response, StatusCode,
    multipart::{Form, Part},
};
use retargetd::{
    formats::{Format, sniff},
    samples,
};
use serde_json::{Value, json};

use super::support::{PATIENCE, ServiceProcess, header, start_service};
use crate::support::{corpus_file, gltf_json};

async fn retargeted(server: &ServiceProcess, target: (&'static str, Vec<u8>), output: Value) -> Response {
    let config = json!({"ops": [{"op": "pelvis"}, {"op": "fk"}], "output": output}).to_string();
    let part = |bytes: Vec<u8>, name: &'static str| Part::bytes(bytes).file_name(name);
    let form = Form::new()
        .part("source", part(samples::walk_clip(), "walk.glb"))
        .part("target", part(target.1, target.0))
        .part("config", part(config.into_bytes(), "config.json"));
    let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
    client.post(format!("{}/v1/retarget", server.url)).multipart(form).send().await.expect("an answer")
}

#[tokio::test(flavor = "multi_thread")]
async fn every_format_that_is_written_comes_out() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let avatar = corpus_file("vrm1/makehuman_body_vrm1.vrm").map(|path| std::fs::read(path).expect("a file"));
    for format in Format::ALL.into_iter().filter(|format| format.info().writes && !format.info().is_drawn) {
        let target = match (format, &avatar) {
            // Only an avatar can be written as one.
            (Format::Vrm | Format::Vrma, None) => continue,
            (Format::Vrm | Format::Vrma, Some(avatar)) => ("avatar.vrm", avatar.clone()),
            _ => ("mannequin.glb", samples::mannequin()),
        };
        let info = format.info();
        let output = match info.is_picture {
            true => json!({"format": info.name, "view": {"size": [64, 64], "fps": 5}}),
            false => json!({"format": info.name}),
        };
        let answer = retargeted(&server, target, output).await;
        assert_eq!(answer.status(), StatusCode::OK, "{format:?}");
        assert!(header(&answer, "content-type").starts_with(info.media_type), "{format:?}: its type");
        let bytes = answer.bytes().await.expect("a file");
        let begins = match format {
            Format::Png | Format::Apng => Some(&b"\x89PNG"[..]),
            Format::Gif => Some(&b"GIF89a"[..]),
            Format::Webp => Some(&b"RIFF"[..]),
            _ => None,
        };
        if let Some(begins) = begins {
            assert!(bytes.starts_with(begins), "{format:?}: a picture");
        } else if format == Format::Mp4 {
            assert_eq!(bytes.get(4..8), Some(&b"ftyp"[..]), "a video");
        } else if format == Format::PositionsCsv {
            assert!(bytes.starts_with(b"frame,time_seconds,"), "a table: {:?}", String::from_utf8_lossy(&bytes[..40]));
        } else {
            let found = sniff(&bytes, &format!("result.{}", info.endings[0]));
            assert_eq!(found.ok(), Some(format), "what came out is of that format");
        }
    }
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

#[tokio::test(flavor = "multi_thread")]
async fn options_of_the_output_are_heard() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &[]);
    let file = async |output: Value| {
        let answer = retargeted(&server, ("mannequin.glb", samples::mannequin()), output).await;
        assert_eq!(answer.status(), StatusCode::OK, "done");
        answer.bytes().await.expect("a file")
    };
    let plain = gltf_json(&file(json!({})).await);
    assert!(plain["meshes"].is_array(), "the whole target");
    let small = gltf_json(&file(json!({"compression": "meshopt", "include": "skeleton+animation"})).await);
    assert_eq!(small["extensionsRequired"], json!(["EXT_meshopt_compression"]), "compressed");
    assert!(small["meshes"].is_null(), "without the mesh");
    let rounded = gltf_json(&file(json!({"compression": "quantized", "clip_name": "Marching"})).await);
    let kinds: Vec<&Value> =
        rounded["accessors"].as_array().expect("accessors").iter().map(|each| &each["componentType"]).collect();
    assert!(kinds.contains(&&json!(5122)), "rotations in shorts");
    assert_eq!(rounded["animations"][0]["name"], "Marching", "called as asked");
    let ordered = file(json!({"format": "bvh", "rotation_order": "xyz"})).await;
    let text = String::from_utf8_lossy(&ordered);
    assert!(text.contains("CHANNELS 6 Xposition Yposition Zposition Xrotation Yrotation Zrotation"), "in that order");
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}
