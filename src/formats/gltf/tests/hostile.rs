//! Each broken thing is an error that says where, or a warning.

use serde_json::{Value, json};

use super::{Builder, read_bytes};
use crate::{
    formats::{self, ErrorKind, Format, Limits},
    model::{Control, Reporter},
};

/// A valid document with a skin and an animation, to be broken.
fn whole() -> Builder {
    let mut builder = Builder::new();
    let input = builder.floats(&[0.0, 1.0], "SCALAR");
    let output = builder.floats(&[0.0; 6], "VEC3");
    let matrices = builder.floats(&glam::Mat4::IDENTITY.to_cols_array(), "MAT4");
    builder.animation(0, "translation", json!({"input": input, "output": output}));
    builder.json["skins"] = json!([{"joints": [0], "inverseBindMatrices": matrices}]);
    builder
}

#[test]
fn errors_point_to_what_is_broken() {
    let cases: [(&str, Value, &str); 26] = [
        ("/asset/version", json!("3.0"), "/asset/version"),
        ("/asset/version", json!(2), "/asset/version"),
        ("/nodes", json!({}), "/nodes"),
        ("/nodes/0/children", json!([7]), "/nodes/0/children/0"),
        ("/nodes/0/children", json!([1, 1]), "/nodes/0/children/1"),
        ("/nodes/2/children", json!([1]), "/nodes/2/children/0"),
        ("/nodes/1/children", json!([0]), "/nodes/1/children"),
        ("/nodes/0/translation", json!([0, 1]), "/nodes/0/translation"),
        ("/nodes/0/scale", json!([1, 1, null]), "/nodes/0/scale/2"),
        ("/scenes", json!([{"nodes": [9]}]), "/scenes/0/nodes/0"),
        ("/skins/0/joints", json!([3]), "/skins/0/joints/0"),
        ("/skins/0/joints", json!([0, 1]), "/skins/0/inverseBindMatrices"),
        ("/skins/0/inverseBindMatrices", json!(0), "/skins/0/inverseBindMatrices"),
        ("/bufferViews/0/buffer", json!(1), "/bufferViews/0/buffer"),
        ("/bufferViews/0/byteLength", json!(u64::MAX), "/bufferViews/0"),
        ("/bufferViews/0/byteStride", json!(3), "/bufferViews/0/byteStride"),
        ("/accessors/0/count", json!(0), "/accessors/0/count"),
        ("/accessors/0/count", json!(u64::MAX / 2), ""),
        ("/accessors/1/byteOffset", json!(usize::MAX), "/animations/0/samplers/0/output"),
        ("/accessors/0/componentType", json!(5125), "/animations/0/samplers/0/input"),
        ("/accessors/1/type", json!("VEC5"), "/accessors/1/type"),
        ("/accessors/1/count", json!(1), "/animations/0/samplers/0/output"),
        ("/animations/0/channels/0/sampler", json!(1), "/animations/0/channels/0/sampler"),
        ("/animations/0/channels/0/target/node", json!(-1), "/animations/0/channels/0/target/node"),
        ("/animations/0/samplers/0/interpolation", json!("CUBIC"), "/animations/0/samplers/0/interpolation"),
        ("/animations/0/samplers/0", json!({"output": 1}), "/animations/0/samplers/0"),
    ];
    assert!(whole().read().is_ok(), "valid before it is broken");
    for (pointer, value, place) in cases {
        let mut builder = whole();
        let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
        let parent = builder.json.pointer_mut(parent).expect("there");
        match key.parse::<usize>() {
            Ok(index) => parent[index] = value.clone(),
            Err(_) => parent[key] = value.clone(),
        }
        let error = builder.read().map(|_| ()).expect_err(pointer);
        assert!(!error.detail.is_empty() && !error.hint.is_empty(), "{pointer} = {value}: says what and what to do");
        if !place.is_empty() {
            assert_eq!(error.place, place, "{pointer} = {value}: {error}");
        }
    }
}

#[test]
fn values_that_are_not_finite_are_errors() {
    for (accessor, float) in [(0, f32::NAN), (0, f32::INFINITY), (0, 5.0), (1, f32::NAN)] {
        let mut builder = whole();
        let offset = builder.json["bufferViews"][accessor]["byteOffset"].as_u64().expect("a number") as usize;
        builder.binary[offset..offset + 4].copy_from_slice(&float.to_le_bytes());
        let error = builder.read().map(|_| ()).expect_err("broken");
        assert_eq!(error.kind, ErrorKind::Malformed, "{float} in accessor {accessor}: {error}");
        assert!(error.place.starts_with("/animations/0/samplers/0/"), "points: {}", error.place);
    }
}

/// Found by fuzzing: finite in the document, infinite where weights are kept.
#[test]
fn weights_too_large_for_single_precision_count_as_none() {
    let document = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "weights": [3.5e38, 0.5]}],
        "meshes": [{"primitives": [{"attributes": {}, "targets": [{}, {}]}]}],
    });
    let (scene, _) = read_bytes(document.to_string().as_bytes()).expect("reads");
    let rests: Vec<f32> = scene.morphs.iter().map(|morph| morph.rest).collect();
    assert_eq!(rests, [0.0, 0.5]);
}

#[test]
fn other_files_are_named_and_never_opened() {
    for uri in ["buffer.bin", "file:///etc/passwd", "http://127.0.0.1/x", "../../x", "%FF.bin", ""] {
        let mut builder = whole();
        builder.json["buffers"] = json!([{"byteLength": 1000, "uri": uri}]);
        let error = builder.read().map(|_| ()).expect_err(uri);
        assert_eq!(error.kind, ErrorKind::UnsupportedFeature, "{uri}");
        assert!(error.detail.contains(uri) && error.hint.contains(".glb"), "names it and the fix: {error}");
    }
    let mut builder = whole();
    builder.json["buffers"] = json!([{"byteLength": 1000, "uri": "data:application/octet-stream;base64,$$$"}]);
    let error = builder.read().map(|_| ()).expect_err("no base64");
    assert_eq!(error.place, "/buffers/0/uri", "{error}");
}

#[test]
fn graphs_and_counts_stay_within_limits() {
    let chain: Vec<Value> = (1..=20_000).map(|child| json!({"children": [child]})).chain([json!({})]).collect();
    let document = json!({"asset": {"version": "2.0"}, "nodes": chain});
    let error = read_bytes(document.to_string().as_bytes()).map(|_| ()).expect_err("too deep");
    assert!(error.detail.contains("hierarchy_depth"), "{error}");

    let limit = |change: fn(&mut Limits)| {
        let mut limits = Limits::default();
        change(&mut limits);
        let format = Format::Gltf;
        formats::read(&whole().bytes(), format, &limits, &Control::new(), &mut Reporter::new()).map(|_| ())
    };
    assert_eq!(limit(|_| ()), Ok(()), "fits");
    assert!(limit(|limits| limits.nodes = 2).is_err(), "nodes");
    assert!(limit(|limits| limits.clips = 0).is_err(), "clips");
    assert!(limit(|limits| limits.frames_per_clip = 1).is_err(), "frames");
    assert!(limit(|limits| limits.samples = 5).is_err(), "samples");
    assert!(limit(|limits| limits.decoded_bytes = 1000).is_err(), "bytes");
    assert!(limit(|limits| limits.json_depth = 2).is_err(), "depth");
}

#[test]
fn a_long_curve_is_refused_before_it_is_sampled() {
    let mut builder = Builder::new();
    let input = builder.floats(&[0.0, 1e9], "SCALAR");
    let values = [[0.0; 3], [0.0; 3], [1.0; 3], [0.0; 3], [1.0; 3], [0.0; 3]].concat();
    let output = builder.floats(&values, "VEC3");
    builder.animation(0, "scale", json!({"input": input, "output": output, "interpolation": "CUBICSPLINE"}));
    let error = builder.read().map(|_| ()).expect_err("sixty billion samples");
    assert!(matches!(error.kind, ErrorKind::LimitExceeded { .. }), "{error}");
}

#[test]
fn canceled_work_stops() {
    let control = Control::new();
    control.cancel();
    let result =
        formats::read(&whole().bytes(), Format::Gltf, &Limits::default(), &control, &mut Reporter::new()).map(|_| ());
    assert_eq!(result.map_err(|error| error.kind), Err(ErrorKind::Canceled), "no scene");
}

#[test]
fn what_is_moved_is_paid_for_once() {
    const KEYS: u16 = 50_000;
    let mut builder = Builder::new();
    let times: Vec<f32> = (0..KEYS).map(|key| f32::from(key) / 60.0).collect();
    let input = builder.floats(&times, "SCALAR");
    let turns: Vec<f32> = (0..KEYS).flat_map(|key| [0.0, f32::from(key % 7) * 0.01, 0.0, 1.0]).collect();
    let output = builder.floats(&turns, "VEC4");
    builder.animation(0, "rotation", json!({"input": input, "output": output}));
    let (text, binary, keys) = (builder.bytes().len(), builder.binary.len(), usize::from(KEYS));
    // The document, its buffer, the decoded keys, and the times of the clip.
    let needed = (text + binary + keys * (16 + 4) + keys * 4) as u64;
    let limits = Limits { decoded_bytes: needed + 100_000, ..Limits::default() };
    let read = formats::read(&builder.bytes(), Format::Gltf, &limits, &Control::new(), &mut Reporter::new());
    assert_eq!(read.map(|scene| scene.clips[0].frame_count()), Ok(keys), "no second copy of the rotations is charged");
}
