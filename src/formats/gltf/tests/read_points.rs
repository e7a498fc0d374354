//! The vertices of skinned meshes.

use glam::{Mat4, Vec3};
use serde_json::json;

use super::{Builder, codes};
use crate::model::SkinPoint;

/// `hips` at the origin and `spine` two above it, a node with a mesh, and one primitive without attributes.
fn bound() -> Builder {
    let mut builder = Builder::new();
    let matrices = [Mat4::IDENTITY, Mat4::from_translation(Vec3::new(0.0, -2.0, 0.0))];
    let matrices = builder.floats(&matrices.map(|matrix| matrix.to_cols_array()).concat(), "MAT4");
    builder.json["skins"] = json!([{"joints": [0, 1], "inverseBindMatrices": matrices}]);
    builder.json["nodes"][2]["skin"] = json!(0);
    builder.json["nodes"][2]["mesh"] = json!(0);
    builder.json["meshes"] = json!([{"primitives": [{"attributes": {}}]}]);
    builder
}

/// Three vertices: one of the hips, one of the spine, one between them.
fn vertices(builder: &mut Builder) -> serde_json::Value {
    let positions = builder.floats(&[0.0, 0.0, 0.0, 0.0, 3.0, 0.5, 1.0, 1.0, 0.0], "VEC3");
    let joints = builder.view(&[0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0]);
    let joints = builder.accessor(joints, 5121, 3, "VEC4");
    let weights = builder.view(&[255, 0, 0, 0, 255, 0, 0, 0, 51, 204, 0, 0]);
    let weights = builder.accessor(weights, 5121, 3, "VEC4");
    builder.json["accessors"][weights]["normalized"] = json!(true);
    json!({"POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights})
}

#[test]
fn points_are_in_the_joint_s_own_space() {
    let mut builder = bound();
    let attributes = vertices(&mut builder);
    // A second primitive of the same vertices adds nothing.
    builder.json["meshes"][0]["primitives"] = json!([{"attributes": attributes}, {"attributes": attributes}]);
    let (scene, warnings) = builder.read().expect("readable");
    assert_eq!(codes(&warnings), [""; 0], "nothing is odd");
    assert_eq!(scene.skin_points.of(0), [SkinPoint { position: Vec3::ZERO, weight: 1.0 }], "a fifth is too little");
    let spine = [
        SkinPoint { position: Vec3::new(0.0, 1.0, 0.5), weight: 1.0 },
        SkinPoint { position: Vec3::new(1.0, -1.0, 0.0), weight: 0.8 },
    ];
    assert_eq!(scene.skin_points.of(1), spine, "below the joint by two");
    assert_eq!(scene.skins[0].most_influences, 2, "the vertex between them, whatever its arrays have room for");
}

#[test]
fn positions_may_be_quantized() {
    let mut builder = bound();
    let mut attributes = vertices(&mut builder);
    let shorts: [i16; 12] = [0, 0, 0, 0, 0, i16::MAX, 0, 0, 0, 0, i16::MIN, 0];
    let view = builder.view(bytemuck::cast_slice(&shorts));
    builder.json["bufferViews"][view]["byteStride"] = json!(8);
    let positions = builder.accessor(view, 5122, 3, "VEC3");
    builder.json["accessors"][positions]["normalized"] = json!(true);
    attributes["POSITION"] = json!(positions);
    builder.json["meshes"][0]["primitives"][0]["attributes"] = attributes;
    let (scene, _) = builder.read().expect("readable");
    let positions: Vec<Vec3> = scene.skin_points.of(1).iter().map(|point| point.position).collect();
    assert_eq!(positions, [Vec3::new(0.0, -1.0, 0.0), Vec3::new(0.0, -2.0, -1.0)], "as parts of the largest");
}

#[test]
fn a_broken_mesh_costs_its_points_and_nothing_else() {
    let mut builder = bound();
    let attributes = vertices(&mut builder);
    let mut missing = attributes.clone();
    missing["POSITION"] = json!(99);
    let mut past_the_skin = attributes.clone();
    let joints = builder.view(&[7; 12]);
    past_the_skin["JOINTS_0"] = json!(builder.accessor(joints, 5121, 3, "VEC4"));
    let mut compressed = attributes;
    let empty = builder.accessor(0, 5126, 3, "VEC3");
    builder.json["accessors"][empty].as_object_mut().expect("an object").remove("bufferView");
    compressed["POSITION"] = json!(empty);
    let extensions = json!({"KHR_draco_mesh_compression": {}});
    builder.json["meshes"][0]["primitives"] = json!([
        {"attributes": missing}, {"attributes": past_the_skin}, {"attributes": compressed, "extensions": extensions}
    ]);
    let (scene, warnings) = builder.read().expect("the skeleton is sound");
    assert!(scene.skin_points.is_empty(), "no primitive can be read");
    assert_eq!(codes(&warnings), ["skin_points_unreadable"; 3], "each says why");
    assert!(warnings[2].detail.contains("Draco"), "{}", warnings[2].detail);
}

#[test]
fn a_skin_without_inverse_bind_matrices_says_nothing() {
    let mut builder = bound();
    let attributes = vertices(&mut builder);
    builder.json["meshes"][0]["primitives"][0]["attributes"] = attributes;
    builder.json["nodes"][1]["translation"] = json!([0.0, 2.0, 0.0]);
    builder.json["skins"][0].as_object_mut().expect("an object").remove("inverseBindMatrices");
    let (scene, warnings) = builder.read().expect("readable");
    assert_eq!(codes(&warnings), ["bind_matrices_missing"], "said");
    assert_eq!(scene.bind_pose, [None; 3], "the node transforms are the rest pose");
    assert!(scene.skin_points.is_empty(), "where the vertices are is not known");
}
