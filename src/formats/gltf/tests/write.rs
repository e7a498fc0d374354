//! What is written, read back.

use glam::{Quat, Vec3};
use proptest::prelude::*;
use serde_json::{Value, json};

use super::{Builder, codes, read_bytes};
use crate::{
    formats::{self, Compression, ErrorKind, Format, Include, TargetClips, WriteOptions},
    model::{Clip, Control, Joint, JointTracks, Payload, Reporter, Scene, Skeleton, Track, Transform, Warning},
};

fn options(format: Format) -> WriteOptions {
    WriteOptions::new(format)
}

fn write(target: &Scene, clip: &Clip, options: &WriteOptions) -> (Vec<u8>, Vec<Warning>) {
    let mut reporter = Reporter::new();
    let bytes = formats::write(target, clip, options, &Control::new(), &mut reporter).expect("writable");
    (bytes, reporter.into_warnings())
}

/// The JSON of a GLB or of a document.
fn json_of(bytes: &[u8]) -> Value {
    let parts = super::super::container::split(bytes, &mut Reporter::new()).expect("a container");
    serde_json::from_slice(parts.json).expect("JSON")
}

fn moving(joints: usize, frames: usize) -> Clip {
    let times = (0..frames).map(|frame| frame as f64 / 32.0).collect();
    let tracks = |joint: usize| JointTracks {
        translation: Track::Sampled((0..frames).map(|frame| Vec3::new(frame as f32, joint as f32, 0.5)).collect()),
        rotation: Track::Sampled((0..frames).map(|frame| Quat::from_rotation_x(frame as f32 * 0.1)).collect()),
        scale: Track::Constant(Vec3::splat(2.0)),
    };
    Clip::new("new".into(), times, (0..joints).map(tracks).collect()).expect("valid")
}

#[test]
fn everything_that_is_not_understood_survives() {
    let mut builder = Builder::new();
    let input = builder.floats(&[0.0, 1.0], "SCALAR");
    let output = builder.floats(&[0.0, 0.0, 0.0, 1.0, 1.0, 1.0], "VEC3");
    builder.animation(2, "scale", json!({"input": input, "output": output}));
    builder.json["materials"] = json!([{"extensions": {"ACME_x": {"factor": 0.1}}, "pbr": 1e-7}]);
    builder.json["extras"] = json!({"number": 3.0, "other": [1.10]});
    builder.json["asset"]["extras"] = json!({"retargetd": {"kept": 1}, "mine": true});
    let (scene, _) = builder.read().expect("readable");
    let clip = moving(3, 4);
    let extras = Some(json!({"made_from": "x"}));
    let (bytes, warnings) = write(&scene, &clip, &WriteOptions { extras, ..options(Format::Glb) });
    assert_eq!(codes(&warnings), [""; 0], "nothing lost");
    let json = json_of(&bytes);
    for key in ["nodes", "materials", "extras"] {
        assert_eq!(json[key].to_string(), builder.json[key].to_string(), "'{key}' is the same, number for number");
    }
    let noted = json!({"retargetd": {"kept": 1, "made_from": "x"}, "mine": true});
    assert_eq!(json["asset"]["extras"], noted, "provenance is merged");
    assert_eq!(json["bufferViews"].as_array().map(Vec::len), Some(3), "one view for the whole animation");

    let (back, _) = read_bytes(&bytes).expect("readable");
    assert_eq!(back.clips[0], clip, "the new clip is the first");
    assert_eq!(back.clips[1], scene.clips[0], "the old one follows");
    let dropped = WriteOptions { target_clips: TargetClips::Drop, ..options(Format::Gltf) };
    let (back, _) = read_bytes(&write(&scene, &clip, &dropped).0).expect("readable");
    assert_eq!(back.clips, [clip], "or is left out");
}

#[test]
fn what_drives_no_joint_goes_on_driving_what_it_did() {
    let mut builder = Builder::new();
    let input = builder.floats(&[0.0, 1.0], "SCALAR");
    let output = builder.floats(&[0.0, 1.0], "SCALAR");
    builder.json["materials"] = json!([{"pbrMetallicRoughness": {"roughnessFactor": 0.5}}]);
    builder.json["extensionsUsed"] = json!(["KHR_animation_pointer"]);
    let pointer = |pointer: &str| json!({"sampler": 0, "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}});
    let roughness = "/materials/0/pbrMetallicRoughness/roughnessFactor";
    builder.json["animations"] = json!([{
        "channels": [pointer(roughness), pointer("/animations/0/extras/speed")],
        "samplers": [{"input": input, "output": output}],
    }]);
    let (scene, _) = builder.read().expect("readable");
    for compression in [Compression::None, Compression::Quantized, Compression::Meshopt] {
        let json = json_of(&write(&scene, &moving(3, 4), &WriteOptions { compression, ..options(Format::Glb) }).0);
        let kept = &json["animations"][1];
        assert_eq!(kept["channels"][0], pointer(roughness), "{compression:?}: the material");
        assert_eq!(
            kept["channels"][1],
            pointer("/animations/1/extras/speed"),
            "{compression:?}: itself, where it is now"
        );
        assert_eq!(kept["samplers"], builder.json["animations"][0]["samplers"], "{compression:?}: by the same keys");
        assert_eq!(json["accessors"][1], builder.json["accessors"][1], "{compression:?}: which are where they were");
    }
}

#[test]
fn buffers_become_one_and_views_move_with_them() {
    let encoded = meshopt::encode_vertex_buffer(&[[1_u32, 2], [3, 4]]).expect("encodes");
    let uri = |bytes: &[u8]| {
        use base64::{Engine as _, engine::general_purpose::STANDARD};
        format!("data:application/octet-stream;base64,{}", STANDARD.encode(bytes))
    };
    let mut builder = Builder::new();
    let name = super::super::MESHOPT_EXTENSIONS[0];
    builder.json["buffers"] = json!([
        {"byteLength": 16, "extensions": {name: {"fallback": true}}},
        {"byteLength": 5, "uri": uri(b"hello")},
        {"byteLength": encoded.len(), "uri": uri(&encoded)},
    ]);
    builder.json["bufferViews"] = json!([
        {"buffer": 0, "byteLength": 16, "extensions": {name: {
            "buffer": 2, "byteLength": encoded.len(), "byteStride": 8, "count": 2, "mode": "ATTRIBUTES",
        }}},
        {"buffer": 1, "byteOffset": 1, "byteLength": 4},
    ]);
    let (scene, _) = builder.read().expect("readable");
    let json = json_of(&write(&scene, &moving(3, 2), &options(Format::Glb)).0);
    assert_eq!(json["buffers"].as_array().map(Vec::len), Some(2), "one with bytes, one without");
    assert_eq!(json["buffers"][1]["extensions"][name]["fallback"], json!(true), "the one without is behind");
    assert_eq!(json["bufferViews"][0]["buffer"], json!(1), "its view follows");
    let extension = &json["bufferViews"][0]["extensions"][name];
    assert_eq!((&extension["buffer"], &extension["byteOffset"]), (&json!(0), &json!(8)), "so does the compressed form");
    assert_eq!(
        (&json["bufferViews"][1]["buffer"], &json["bufferViews"][1]["byteOffset"]),
        (&json!(0), &json!(1)),
        "first"
    );
}

#[test]
fn only_what_is_animated_is_written() {
    let mut builder = Builder::new();
    builder.json["nodes"][0]["matrix"] = json!([2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 5, 0, 0, 1]);
    builder.json["nodes"][2]["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    let (scene, _) = builder.read().expect("readable");
    let still = JointTracks { rotation: Track::Constant(Quat::IDENTITY), ..JointTracks::default() };
    let tracks = vec![still, JointTracks::default(), JointTracks::default()];
    let clip = Clip::new(String::new(), vec![0.0, 0.5, 1.0], tracks).expect("valid");
    let (bytes, _) = write(&scene, &clip, &options(Format::Glb));
    let json = json_of(&bytes);
    assert_eq!(json["animations"][0]["channels"].as_array().map(Vec::len), Some(1), "one track, one channel");
    assert_eq!(json["nodes"][0]["matrix"], Value::Null, "an animated node has no matrix");
    assert_eq!(json["nodes"][0]["scale"], json!([2.0, 2.0, 2.0]), "but what it said");
    assert!(json["nodes"][2]["matrix"].is_array(), "the others stay as they are");
    let (back, _) = read_bytes(&bytes).expect("readable");
    assert_eq!(back.clips[0].times_seconds(), [0.0, 1.0], "as long as the clip");

    let nothing = Clip::new(String::new(), vec![0.0, 2.0], vec![JointTracks::default(); 3]).expect("valid");
    let (bytes, warnings) = write(&scene, &nothing, &options(Format::Glb));
    assert_eq!(codes(&warnings), ["clip_without_channels"], "said");
    let (back, _) = read_bytes(&bytes).expect("readable");
    assert_eq!(back.clips[0].duration_seconds(), 2.0, "still as long");
}

#[test]
fn times_rise_in_single_precision_and_begin_at_zero_or_later() {
    let (scene, _) = Builder::new().read().expect("readable");
    let clip = |times: Vec<f64>| {
        let rotation = Track::Sampled((0..times.len()).map(|frame| Quat::from_rotation_z(frame as f32)).collect());
        let moving = JointTracks { rotation, ..JointTracks::default() };
        Clip::new(String::new(), times, vec![moving, JointTracks::default(), JointTracks::default()]).expect("valid")
    };
    let (bytes, warnings) = write(&scene, &clip(vec![5000.0, 5000.0 + 1e-9, 5000.0 + 2e-9]), &options(Format::Glb));
    assert_eq!(codes(&warnings), ["times_nudged"], "said");
    let (back, _) = read_bytes(&bytes).expect("readable");
    assert_eq!(back.clips[0].frame_count(), 3, "no frame is lost");
    let (bytes, warnings) = write(&scene, &clip(vec![-1.0, 0.0]), &options(Format::Glb));
    assert_eq!(codes(&warnings), ["times_shifted"], "said");
    assert_eq!(read_bytes(&bytes).expect("readable").0.clips[0].times_seconds(), [0.0, 1.0], "moved");
}

#[test]
fn a_scene_from_elsewhere_becomes_a_skeleton() {
    let joint = |name: &str, parent, height: f64| Joint {
        name: name.into(),
        parent,
        rest: Transform::from_translation(glam::DVec3::new(0.0, height, 0.1)),
        is_joint: true,
        node: 40,
    };
    let joints = vec![joint("root", None, 1.0), joint("", Some(0), 0.5), joint("prop", None, 0.0)];
    let skeleton = Skeleton::new(joints).expect("valid");
    let scene = Scene { skeleton, payload: Payload::default(), ..Scene::default() };
    let clip = moving(3, 5);
    let (bytes, warnings) = write(&scene, &clip, &options(Format::Glb));
    assert_eq!(codes(&warnings), [""; 0], "nothing lost");
    let (back, _) = read_bytes(&bytes).expect("readable");
    let listed = |scene: &Scene| -> Vec<_> {
        scene.skeleton.joints().iter().map(|joint| (joint.name.clone(), joint.parent, joint.rest)).collect()
    };
    assert_eq!(listed(&back), listed(&scene), "names, parents and rest");
    assert_eq!(back.clips, std::slice::from_ref(&clip), "the clip");
    assert_eq!(back.skins.len(), 2, "a skin for each tree");
    let bound = back.bind_pose[1].expect("bound").translation;
    assert!((bound - glam::DVec3::new(0.0, 1.5, 0.2)).length() < 1e-6, "bound in the rest pose: {bound}");

    let refused = formats::write(&scene, &clip, &options(Format::Vrm), &Control::new(), &mut Reporter::new());
    assert_eq!(refused.map_err(|error| error.kind), Err(ErrorKind::UnsupportedFeature), "a skeleton is no VRM");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn what_is_written_comes_back_bit_for_bit(
        frames in 1_usize..20,
        seeds in prop::collection::vec((any::<[i16; 7]>(), 0_u8..3), 3),
        format in prop::sample::select(vec![Format::Glb, Format::Gltf]),
        include in prop::sample::select(vec![Include::Everything, Include::SkeletonAndAnimation]),
    ) {
        let (scene, _) = Builder::new().read().expect("readable");
        let tracks = |(numbers, kind): &([i16; 7], u8)| {
            let number = |at: usize, frame: usize| f32::from(numbers[at]) * 0.001 + frame as f32 * 0.01;
            let vector = |frame: usize| Vec3::new(number(0, frame), number(1, frame), number(2, frame));
            let axis = Vec3::new(number(3, 0), number(4, 0), number(5, 0)).try_normalize().unwrap_or(Vec3::X);
            let turn = |frame: usize| Quat::from_axis_angle(axis, number(6, 0) * 0.01 + frame as f32 * 0.05);
            JointTracks {
                translation: Track::Sampled((0..frames).map(vector).collect()).compacted(),
                rotation: Track::Sampled((0..frames).map(turn).collect()).compacted(),
                scale: if *kind == 0 { Track::Rest } else { Track::Constant(vector(1)) },
            }
        };
        let times = (0..frames).map(|frame| f64::from(frame as f32 / 30.0)).collect();
        let clip = Clip::new("clip".into(), times, seeds.iter().map(tracks).collect()).expect("valid");
        let (bytes, _) = write(&scene, &clip, &WriteOptions { include, ..options(format) });
        let (back, warnings) = read_bytes(&bytes).expect("readable");
        prop_assert_eq!(codes(&warnings), Vec::<&str>::new(), "nothing to repair");
        prop_assert_eq!(&back.clips[0], &clip, "times and tracks");
    }
}
