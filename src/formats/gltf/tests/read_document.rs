//! Nodes, skins, humanoid maps and extensions.

use glam::{DQuat, DVec3};
use serde_json::json;

use super::{Builder, codes};
use crate::{
    formats::ErrorKind,
    model::{Axes, Transform},
};

#[test]
fn parents_come_before_children_whatever_the_order_of_the_file() {
    let mut builder = Builder::new();
    builder.json["nodes"] =
        json!([{"name": "a"}, {"name": "b", "children": [0]}, {}, {"name": "c", "children": [1, 2]}]);
    let (scene, _) = builder.read().expect("readable");
    let joints = scene.skeleton.joints();
    let listed: Vec<_> = joints.iter().map(|joint| (joint.name.as_str(), joint.parent, joint.node)).collect();
    let expected = [("c", None, 3), ("b", Some(0), 1), ("a", Some(1), 0), ("", Some(0), 2)];
    assert_eq!(listed, expected, "depth first, with the nodes of the file");
    assert_eq!((scene.axes, scene.unit_meters), (Some(Axes::Y_UP_Z_FRONT), Some(1.0)), "as glTF says");
}

#[test]
fn matrices_are_split_and_shear_is_said() {
    let mut builder = Builder::new();
    let turned = glam::DMat4::from_scale_rotation_translation(
        DVec3::new(2.0, 3.0, 4.0),
        DQuat::from_rotation_y(0.5),
        DVec3::new(1.0, 2.0, 3.0),
    );
    let sheared = [1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    builder.json["nodes"] = json!([{"matrix": turned.to_cols_array()}, {"matrix": sheared}]);
    let (scene, warnings) = builder.read().expect("readable");
    let rest = scene.skeleton.joints()[0].rest;
    assert!((rest.scale - DVec3::new(2.0, 3.0, 4.0)).length() < 1e-12, "scale {}", rest.scale);
    assert!(rest.rotation.angle_between(DQuat::from_rotation_y(0.5)) < 1e-7, "rotation {}", rest.rotation);
    assert_eq!(rest.translation, DVec3::new(1.0, 2.0, 3.0), "translation");
    assert_eq!(codes(&warnings), ["matrix_sheared"], "only the second");
    assert_eq!(warnings[0].place, "/nodes/1/matrix", "where");
}

#[test]
fn the_first_skin_that_binds_a_joint_says_how() {
    let mut builder = Builder::new();
    let moved = glam::Mat4::from_translation(glam::Vec3::new(0.0, -2.0, 0.0)).to_cols_array();
    let first = builder.floats(&[moved, [0.0; 16]].concat(), "MAT4");
    builder.json["skins"] = json!([
        {"name": "body", "joints": [0, 1], "inverseBindMatrices": first},
        {"joints": [1, 0]},
    ]);
    let (scene, warnings) = builder.read().expect("readable");
    let up = Transform::from_translation(DVec3::new(0.0, 2.0, 0.0));
    let expected = [Some(up), Some(Transform::IDENTITY), None];
    assert_eq!(scene.bind_pose, expected, "inverted; singular ones give way; no skin, no pose");
    assert_eq!(codes(&warnings), ["bind_matrix_singular"], "said");
    assert_eq!((scene.skins[0].name.as_str(), &scene.skins[1].joints), ("body", &vec![1, 0]), "both skins are listed");
    let marked: Vec<_> = scene.skeleton.joints().iter().map(|joint| joint.is_joint).collect();
    assert_eq!(marked, [true, true, false], "joints of skins");
}

#[test]
fn humanoid_maps_of_all_three_kinds() {
    let zero = json!({"VRM": {"humanoid": {"humanBones": [{"bone": "hips", "node": 2}, {"bone": "jaw", "node": -1}]}}});
    let one = json!({"VRMC_vrm": {"humanoid": {"humanBones": {"hips": {"node": 2}}}}});
    let animation = json!({"VRMC_vrm_animation": {"humanoid": {"humanBones": {"hips": {"node": 2}}}}});
    for (extensions, convention) in [(zero, "vrm0"), (one, "vrm1"), (animation, "vrma")] {
        let mut builder = Builder::new();
        builder.json["extensions"] = extensions;
        let (scene, _) = builder.read().expect("readable");
        assert_eq!(scene.declared_convention, Some(convention), "found in a file of any name");
        assert_eq!(scene.declared_roles, [("hips".to_owned(), 2)], "{convention}: role and joint");
        assert!(scene.skeleton.joints()[2].is_joint, "{convention}: what has a role is a joint");
    }
}

#[test]
fn required_extensions_are_refused_only_where_they_matter() {
    let read = |name: &str, member: &str| {
        let mut builder = Builder::new();
        builder.json["extensionsRequired"] = json!([name]);
        if !member.is_empty() {
            builder.json[member] = json!([{"extensions": {name: {}}}]);
        }
        builder.read()
    };
    assert!(read("KHR_draco_mesh_compression", "meshes").is_ok(), "meshes are not read");
    let (_, warnings) = read("ACME_paint", "materials").expect("materials are not read");
    assert_eq!(codes(&warnings), ["extension_passed_through"], "said");
    for member in ["nodes", ""] {
        let error = read("ACME_bend", member).expect_err("may change what we read");
        assert_eq!(error.kind, ErrorKind::UnsupportedFeature, "used in '{member}'");
        assert!(error.detail.contains("ACME_bend"), "named: {error}");
    }
}
