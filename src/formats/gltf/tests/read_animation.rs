//! Accessors and interpolation, by exact values.

use glam::{Quat, Vec3};
use serde_json::json;

use super::{Builder, codes};
use crate::model::{JointTracks, Track};

const QUARTER: f32 = std::f32::consts::FRAC_1_SQRT_2;

fn only_tracks(builder: &Builder) -> (Vec<f64>, JointTracks) {
    let (scene, _) = builder.read().expect("readable");
    (scene.clips[0].times_seconds().to_vec(), scene.clips[0].joints()[0].clone())
}

#[test]
fn every_component_type_is_decoded() {
    let cases: [(u64, bool, Vec<u8>, [f32; 4]); 8] = [
        (5120, true, vec![127, 0, 0, 0], [1.0, 0.0, 0.0, 0.0]),
        (5120, true, vec![128, 0, 0, 0], [-1.0, 0.0, 0.0, 0.0]),
        (5121, true, vec![0, 255, 0, 0], [0.0, 1.0, 0.0, 0.0]),
        (5122, true, bytemuck::cast_slice(&[0_i16, 0, -32767, 0]).to_vec(), [0.0, 0.0, -1.0, 0.0]),
        (5123, true, bytemuck::cast_slice(&[0_u16, 0, 0, 65535]).to_vec(), [0.0, 0.0, 0.0, 1.0]),
        (5120, false, vec![1, 0, 0, 0], [1.0, 0.0, 0.0, 0.0]),
        (5125, false, bytemuck::cast_slice(&[0_u32, 1, 0, 0]).to_vec(), [0.0, 1.0, 0.0, 0.0]),
        (5126, false, bytemuck::cast_slice(&[0.0_f32, 0.0, 1.0, 0.0]).to_vec(), [0.0, 0.0, 1.0, 0.0]),
    ];
    for (component, normalized, bytes, expected) in cases {
        let mut builder = Builder::new();
        let input = builder.floats(&[0.0], "SCALAR");
        let view = builder.view(&bytes);
        let output = builder.accessor(view, component, 1, "VEC4");
        builder.json["accessors"][output]["normalized"] = json!(normalized);
        builder.animation(0, "rotation", json!({"input": input, "output": output}));
        let (_, tracks) = only_tracks(&builder);
        let expected = Track::Constant(Quat::from_array(expected));
        assert_eq!(tracks.rotation, expected, "component type {component}, normalized {normalized}");
    }
}

#[test]
fn strides_and_offsets_are_followed() {
    let mut builder = Builder::new();
    let input = builder.floats(&[0.0, 1.0], "SCALAR");
    let floats = [9.0_f32, 1.0, 2.0, 3.0, 9.0, 4.0, 5.0, 6.0];
    let view = builder.view(bytemuck::cast_slice(&floats));
    builder.json["bufferViews"][view]["byteStride"] = json!(16);
    let output = builder.accessor(view, 5126, 2, "VEC3");
    builder.json["accessors"][output]["byteOffset"] = json!(4);
    builder.animation(0, "translation", json!({"input": input, "output": output}));
    let (_, tracks) = only_tracks(&builder);
    let expected = vec![Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)];
    assert_eq!(tracks.translation, Track::Sampled(expected), "every sixteen bytes, from the fourth on");
}

#[test]
fn sparse_values_lie_over_zeros_or_over_a_view() {
    for has_view in [false, true] {
        let mut builder = Builder::new();
        let input = builder.floats(&[0.0, 1.0, 2.0], "SCALAR");
        let base = builder.floats(&[1.0; 9], "VEC3");
        let indices = builder.view(&[1]);
        let values = builder.view(bytemuck::cast_slice(&[7.0_f32, 8.0, 9.0]));
        let accessor = &mut builder.json["accessors"][base];
        accessor["sparse"] = json!({
            "count": 1,
            "indices": {"bufferView": indices, "componentType": 5121},
            "values": {"bufferView": values},
        });
        if !has_view {
            accessor.as_object_mut().expect("an object").remove("bufferView");
        }
        builder.animation(0, "scale", json!({"input": input, "output": base}));
        let (_, tracks) = only_tracks(&builder);
        let around = Vec3::splat(f32::from(u8::from(has_view)));
        let expected = Track::Sampled(vec![around, Vec3::new(7.0, 8.0, 9.0), around]);
        assert_eq!(tracks.scale, expected, "with a view below: {has_view}");
    }
}

#[test]
fn meshopt_views_are_decoded_with_their_filter() {
    let rotations = [[0.0, 0.0, 0.0, 1.0], [QUARTER, 0.0, 0.0, QUARTER], [0.0, 1.0, 0.0, 0.0], [0.5, 0.5, 0.5, 0.5]];
    let encoded = meshopt::encode_vertex_buffer(&meshopt::encode_filter_quat(&rotations, 16)).expect("encodes");
    for name in super::super::MESHOPT_EXTENSIONS {
        let mut builder = Builder::new();
        let input = builder.floats(&[0.0, 1.0, 2.0, 3.0], "SCALAR");
        let source = builder.view(&encoded);
        let source = builder.json["bufferViews"][source].clone();
        let view = super::push(
            &mut builder.json["bufferViews"],
            json!({"buffer": 1, "byteLength": 32, "extensions": {name: {
                "buffer": 0, "byteOffset": source["byteOffset"], "byteLength": encoded.len(),
                "byteStride": 8, "count": 4, "mode": "ATTRIBUTES", "filter": "QUATERNION",
            }}}),
        );
        let output = builder.accessor(view, 5122, 4, "VEC4");
        builder.json["accessors"][output]["normalized"] = json!(true);
        builder.animation(0, "rotation", json!({"input": input, "output": output}));
        let text = String::from_utf8(builder.bytes()).expect("JSON");
        let mut document: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        super::push(&mut document["buffers"], json!({"byteLength": 32, "extensions": {name: {"fallback": true}}}));
        let (scene, _) = super::read_bytes(document.to_string().as_bytes()).expect("readable");
        let Track::Sampled(actual) = &scene.clips[0].joints()[0].rotation else { panic!("{name}: not sampled") };
        for (actual, expected) in actual.iter().zip(rotations) {
            let cosine = actual.dot(Quat::from_array(expected)).abs();
            assert!(cosine > 1.0 - 1e-4, "{name}: {actual} for {expected:?}");
        }
    }
}

#[test]
fn channels_meet_on_the_union_of_their_times() {
    let mut builder = Builder::new();
    let few = builder.floats(&[0.0, 1.0], "SCALAR");
    let other = builder.floats(&[0.5, 2.0], "SCALAR");
    let translations = builder.floats(&[0.0, 0.0, 0.0, 2.0, 0.0, 0.0], "VEC3");
    let rotations = builder.floats(&[0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0], "VEC4");
    builder.json["animations"] = json!([{
        "channels": [
            {"sampler": 0, "target": {"node": 0, "path": "translation"}},
            {"sampler": 1, "target": {"node": 0, "path": "rotation"}},
        ],
        "samplers": [{"input": few, "output": translations}, {"input": other, "output": rotations}],
    }]);
    let (times, tracks) = only_tracks(&builder);
    assert_eq!(times, [0.0, 0.5, 1.0, 2.0], "sorted, each once");
    let x = |x: f32| Vec3::new(x, 0.0, 0.0);
    assert_eq!(tracks.translation, Track::Sampled(vec![x(0.0), x(1.0), x(2.0), x(2.0)]), "lines, then held");
    let Track::Sampled(rotations) = tracks.rotation else { panic!("not sampled") };
    assert_eq!(rotations[0], Quat::IDENTITY, "held before the first key");
    assert!((rotations[2].to_axis_angle().1 - std::f32::consts::FRAC_PI_3).abs() < 1e-5, "a third of a half turn");
    assert!(rotations.windows(2).all(|pair| pair[0].dot(pair[1]) >= 0.0), "one hemisphere");
}

#[test]
fn curves_and_steps_keep_their_shape() {
    let mut builder = Builder::new();
    let input = builder.floats(&[0.0, 0.5], "SCALAR");
    let step = builder.floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0], "VEC3");
    builder.animation(0, "translation", json!({"input": input, "output": step, "interpolation": "STEP"}));
    let hermite = [[0.0; 3], [0.0; 3], [4.0, 0.0, 0.0], [0.0; 3], [0.0; 3], [0.0; 3]].concat();
    let cubic = builder.floats(&hermite, "VEC3");
    builder.animation(0, "translation", json!({"input": input, "output": cubic, "interpolation": "CUBICSPLINE"}));
    let (scene, warnings) = builder.read().expect("readable");
    assert_eq!(codes(&warnings), ["keys_densified"], "said once");
    let step = &scene.clips[0];
    assert_eq!(step.times_seconds(), [0.0, f64::from(0.4999_f32), 0.5], "held until just before the step");
    let held = vec![Vec3::ZERO, Vec3::ZERO, Vec3::X];
    assert_eq!(step.joints()[0].translation, Track::Sampled(held), "no slope");

    let cubic = &scene.clips[1];
    assert_eq!(cubic.frame_count(), 31, "sixty per second");
    // Half way, only the tangent counts: 1/8 · 4 per second · 0.5 s.
    let middle = cubic.joints()[0].translation.at(15, Vec3::ZERO);
    assert!((middle.x - 0.25).abs() < 1e-6, "tangents are scaled by the length of the segment: {middle}");
}

#[test]
fn a_step_that_is_only_rounding_adds_no_key() {
    let mut builder = Builder::new();
    let input = builder.floats(&[0.0, 0.5], "SCALAR");
    let output = builder.floats(&[1.0, 0.0, 0.0, 1.000_000_1, 0.0, 0.0], "VEC3");
    builder.animation(0, "scale", json!({"input": input, "output": output, "interpolation": "STEP"}));
    let (scene, warnings) = builder.read().expect("readable");
    assert_eq!(scene.clips[0].times_seconds(), [0.0, 0.5], "the keys of the file");
    assert_eq!(codes(&warnings), [""; 0], "nothing was added");
}

#[test]
fn rotations_are_repaired_and_said_so() {
    let mut builder = Builder::new();
    let input = builder.floats(&[0.0, 1.0, 2.0], "SCALAR");
    let output = builder.floats(&[0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0], "VEC4");
    builder.animation(0, "rotation", json!({"input": input, "output": output}));
    let (scene, warnings) = builder.read().expect("readable");
    assert_eq!(codes(&warnings), ["keyframe_rotation_not_unit", "keyframe_rotation_zero"], "both, once");
    let expected = Track::Constant(Quat::IDENTITY);
    assert_eq!(scene.clips[0].joints()[0].rotation, expected, "normalized, held, flipped: all the same then");
}

#[test]
fn channels_that_drive_no_joint_are_left_out() {
    let mut builder = Builder::new();
    let input = builder.floats(&[3.0, 2.0], "SCALAR");
    builder.json["animations"] = json!([{
        "name": "face",
        "channels": [
            {"sampler": 0, "target": {"node": 0, "path": "weights"}},
            {"sampler": 0, "target": {"path": "translation"}},
            {"sampler": 0, "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/x"}}}},
        ],
        "samplers": [{"input": input, "output": input}],
    }]);
    let (scene, warnings) = builder.read().expect("readable");
    assert_eq!(
        codes(&warnings),
        ["channel_without_node", "weights_skipped", "animation_pointer_skipped"],
        "one warning each, and their data is not looked at"
    );
    let clip = &scene.clips[0];
    assert_eq!((clip.name(), clip.frame_count(), clip.is_animated()), ("face", 1, false), "it still counts");
}
