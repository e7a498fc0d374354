//! Meshes of an FBX in a GLB, vertex by vertex, as the gltf crate reads them.

use glam::{DMat4, DVec3, Mat4, Vec3, Vec4};
use retargetd::{
    formats::{self, Format, WriteOptions},
    model::{Clip, Control, MorphTrack, Reporter, Scene, Track},
};

use super::{
    files_below,
    made::{Document, Property, deformer, node_id, number, shape, table, triangle, vector},
    read,
    records::{Record, Value},
    write::turning,
};
use crate::formats_gltf::assert_nothing_new_is_wrong;

const MOVE: &str = "Lcl Translation";
/// A picture of one black point.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01\0\0\0\x01\x08\0\0\0\0:~\x9bU\0\0\0\nIDATx\xdac`\0\0\0\x02\0\x01\xe5'\xde\xfc\0\0\0\0IEND\xaeB`\x82";

/// Two joints, and a node aside that is moved and scaled and wears a square, which can smile, on a material with an image. The first
/// corner goes with the spine, the next two with both joints, and the last with none.
fn figure() -> Document {
    let body: [Property; 2] = [vector(MOVE, [10.0, 0.0, 0.0]), vector("Lcl Scaling", [2.0; 3])];
    let named =
        |kind: &'static str, id: i64, name: &str| Record::new(kind).with(id).with(Value::Name(kind, name.to_owned()));
    let layer = |kind: &'static str, reference: &str| {
        Record::new(kind)
            .with(0)
            .field("Version", 101)
            .field("Name", "map")
            .field("MappingInformationType", "ByPolygonVertex")
            .field("ReferenceInformationType", reference)
    };
    let square = named("Geometry", 20, "Square")
        .with("Mesh")
        .field("Vertices", Value::Numbers(vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]))
        .field("PolygonVertexIndex", Value::Wholes(vec![0, 1, 2, -4]))
        .holding([
            layer("LayerElementNormal", "Direct").field("Normals", Value::Numbers([0.0, 0.0, 1.0].repeat(4))),
            layer("LayerElementUV", "Direct").field("UV", Value::Numbers(vec![0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0])),
        ]);
    let matrix = |matrix: DMat4| Value::Numbers(matrix.to_cols_array().to_vec());
    let worn = DMat4::from_translation(DVec3::X * 10.0) * DMat4::from_scale(DVec3::splat(2.0));
    let cluster = |id: i64, name: &str, height: f64, vertices: &[i32], weights: &[f64]| {
        let bone = DMat4::from_translation(DVec3::Y * height);
        deformer(id, name, "Cluster")
            .field("Indexes", Value::Wholes(vertices.to_vec()))
            .field("Weights", Value::Numbers(weights.to_vec()))
            .field("Transform", matrix(bone.inverse() * worn))
            .field("TransformLink", matrix(bone))
    };
    let channel = deformer(41, "Face.Smile", "BlendShapeChannel")
        .field("DeformPercent", 25.0)
        .field("FullWeights", Value::Numbers(vec![100.0]))
        .holding([table(&[number("DeformPercent", 25.0)], 7400)]);
    let material = named("Material", 60, "Paint")
        .with("")
        .field("Version", 102)
        .field("ShadingModel", "phong")
        .holding([table(&[vector("DiffuseColor", [0.8, 0.5, 0.25])], 7400)]);
    let texture = named("Texture", 61, "Face")
        .with("")
        .field("Type", "TextureVideoClip")
        .field("Version", 202)
        .field("FileName", "C:\\\\art\\\\face.png")
        .field("RelativeFilename", "art/face.png");
    let video = named("Video", 62, "Image")
        .with("Clip")
        .field("Type", "Clip")
        .field("RelativeFilename", "art/face.png")
        .field("Content", Value::Bytes(PNG.to_vec()));
    Document::chain(&[("Hips", &[vector(MOVE, [0.0, 100.0, 0.0])]), ("Spine", &[vector(MOVE, [0.0, 50.0, 0.0])])])
        .node("Body", "Mesh", None, &body)
        .object(square, 20, node_id(2))
        .object(deformer(30, "Skin", "Skin"), 30, 20)
        .object(cluster(31, "Spine", 150.0, &[0, 1, 2], &[1.0, 0.5, 0.3]), 31, 30)
        .object(cluster(32, "Hips", 100.0, &[1, 2], &[0.5, 0.9]), 32, 30)
        .connected(node_id(1), 31)
        .connected(node_id(0), 32)
        .object(deformer(40, "Face", "BlendShape"), 40, 20)
        .object(channel, 41, 40)
        .object(shape(42), 42, 41)
        .object(material, 60, node_id(2))
        .object(video, 62, 61)
        .on_property(texture, 61, 60, "DiffuseColor")
}

fn written(scene: &Scene, clip: &Clip) -> (Vec<u8>, Vec<&'static str>) {
    let options = WriteOptions::new(Format::Glb);
    let mut reporter = Reporter::new();
    let bytes = formats::write(scene, clip, &options, &Control::new(), &mut reporter).expect("it can be written");
    (bytes, reporter.into_warnings().iter().map(|warning| warning.code).collect())
}

#[test]
fn a_square_is_where_it_was_bound_and_goes_with_its_joints() {
    let scene = read(&figure().binary_of(7400)).expect("it is read");
    let clip = turning(&scene);
    let (bytes, warnings) = written(&scene, &clip);
    assert!(warnings.is_empty(), "nothing is lost: {warnings:?}");
    let document = gltf::Gltf::from_slice(&bytes).expect("the crate reads it");
    let blob = document.blob.as_deref();
    let names: Vec<&str> = document.nodes().filter_map(|node| node.name()).collect();
    assert_eq!(
        names,
        ["Hips", "Spine", "Body", "Body_mesh"],
        "the target's nodes, and a plain one that wears the mesh"
    );
    let wearer = document.nodes().nth(3).expect("there");
    let (mesh, skin) = (wearer.mesh().expect("worn"), wearer.skin().expect("bound"));
    let primitive = mesh.primitives().next().expect("one");
    let reader = primitive.reader(|_| blob);
    let positions: Vec<Vec3> = reader.read_positions().expect("positions").map(Vec3::from_array).collect();
    assert_eq!(positions.len(), 4, "corners that are alike are one vertex");
    let indices: Vec<u32> = reader.read_indices().expect("indices").into_u32().collect();
    assert_eq!(indices.len(), 6, "two triangles");
    for triangle in indices.as_chunks::<3>().0 {
        let [one, two, three] = triangle.map(|vertex| positions[vertex as usize]);
        assert!((two - one).cross(three - one).z > 0.0, "it looks to the front still");
    }
    let uvs: Vec<[f32; 2]> = reader.read_tex_coords(0).expect("UVs").into_f32().collect();
    for (position, uv) in positions.iter().zip(uvs) {
        // In meters, twice as large and beside, where the node that wears it is; and V goes down.
        let square = (position * 100.0 - Vec3::X * 10.0) / 2.0;
        assert!((square.x - uv[0]).abs() < 1e-5 && (square.y - 1.0 + uv[1]).abs() < 1e-5, "{square} has {uv:?}");
    }
    // Where the joints take the vertices, by hand.
    let joints: Vec<usize> = skin.joints().map(|joint| joint.index()).collect();
    let inverses: Vec<Mat4> = skin
        .reader(|_| blob)
        .read_inverse_bind_matrices()
        .expect("there")
        .map(|m| Mat4::from_cols_array_2d(&m))
        .collect();
    let bound: Vec<([u16; 4], [f32; 4])> = reader
        .read_joints(0)
        .expect("joints")
        .into_u16()
        .zip(reader.read_weights(0).expect("weights").into_f32())
        .collect();
    let rest = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let pose = clip.local_pose(&scene.skeleton, 4).to_model(&scene.skeleton);
    let moved = |joint: usize| {
        (pose.transforms()[joint].to_matrix() * rest.transforms()[joint].to_matrix().inverse()).as_mat4()
    };
    for (position, (places, weights)) in positions.iter().zip(bound) {
        let square = (position * 100.0 - Vec3::X * 10.0) / 2.0;
        let spine = match (square.x > 0.5, square.y > 0.5) {
            (false, false) => 1.0,
            (true, false) => 0.5,
            (true, true) => 0.25,
            // Bound to nothing: with the top of the joints.
            (false, true) => 0.0,
        };
        let expected =
            moved(1).transform_point3(*position) * spine + moved(0).transform_point3(*position) * (1.0 - spine);
        let mut found = Vec4::ZERO;
        for (place, weight) in places.into_iter().zip(weights) {
            let joint = joints[usize::from(place)];
            let world = pose.transforms()[joint].to_matrix().as_mat4();
            found += world * inverses[usize::from(place)] * position.extend(1.0) * weight;
        }
        assert!(found.truncate().distance(expected) < 1e-5, "{square}: at {found}, not {expected}");
    }
}

#[test]
fn shapes_materials_and_images_go_along() {
    let scene = read(&figure().binary_of(7400)).expect("it is read");
    let weights = Track::Sampled(vec![0.0, 0.5, 1.0, 0.75, 0.25]);
    let clip = turning(&scene).with_morphs(vec![MorphTrack { morph: 0, weights: weights.clone() }]).expect("a clip");
    assert!(formats::holds_morph(&scene, 0, Format::Glb, formats::Include::Everything), "and it is known beforehand");
    let (bytes, _) = written(&scene, &clip);
    let document = gltf::Gltf::from_slice(&bytes).expect("the crate reads it");
    let blob = document.blob.as_deref();
    let mesh = document.meshes().next().expect("a mesh");
    assert_eq!(mesh.weights(), Some([0.25_f32].as_slice()), "as it rests");
    let primitive = mesh.primitives().next().expect("one");
    let reader = primitive.reader(|_| blob);
    let (offsets, ..) = reader.read_morph_targets().next().expect("a shape");
    let offsets: Vec<Vec3> = offsets.expect("positions").map(Vec3::from_array).collect();
    let positions: Vec<Vec3> = reader.read_positions().expect("positions").map(Vec3::from_array).collect();
    for (position, offset) in positions.iter().zip(offsets) {
        // The second corner of the square, by 3 in a node that is twice as large.
        let is_moved = position.x > 0.11 && position.y < 0.01;
        let expected = if is_moved { Vec3::Z * 0.06 } else { Vec3::ZERO };
        assert!(offset.distance(expected) < 1e-6, "{position} by {offset}");
    }
    let back = formats::read(&bytes, Format::Glb, &formats::Limits::default(), &Control::new(), &mut Reporter::new())
        .expect("we read it");
    assert_eq!(back.morphs[0].name, "Smile");
    assert_eq!(back.clips[0].morphs()[0].weights, weights, "and it moves");
    let material = primitive.material();
    let surface = material.pbr_metallic_roughness();
    assert_eq!((material.name(), surface.metallic_factor()), (Some("Paint"), 0.0));
    assert_eq!(surface.base_color_factor(), [1.0; 4], "the image is the color");
    let image = surface.base_color_texture().expect("on it").texture().source();
    assert_eq!(image.name(), Some("face.png"));
    let gltf::image::Source::View { view, mime_type } = image.source() else { panic!("in the file") };
    let bytes = &blob.expect("bytes")[view.offset()..view.offset() + view.length()];
    assert_eq!((mime_type, bytes), ("image/png", PNG));
}

/// What the file cannot show as it was is told: a mesh that is hidden, an image that lies elsewhere, a joint in another tree.
#[test]
fn what_is_not_there_is_said() {
    let hidden = Document::chain(&[("Hips", &[])]).node("Ghost", "Mesh", None, &[number("Visibility", 0.0)]).object(
        triangle(20),
        20,
        node_id(1),
    );
    let scene = read(&hidden.binary_of(7400)).expect("it is read");
    assert_eq!(written(&scene, &turning(&scene)).1, ["fbx_meshes_hidden"]);
    let alone =
        Document::chain(&[("Hips", &[])]).node("Body", "Mesh", Some(0), &[]).object(triangle(20), 20, node_id(1));
    let scene = read(&alone.binary_of(7400)).expect("it is read");
    let (bytes, warnings) = written(&scene, &turning(&scene));
    assert!(warnings.is_empty(), "{warnings:?}");
    let document = gltf::Gltf::from_slice(&bytes).expect("the crate reads it");
    let body = document.nodes().nth(1).expect("there");
    assert_eq!((body.name(), body.mesh().is_some(), body.skin().is_some()), (Some("Body"), true, false), "as it was");
    // Joints of one skin in two trees get one top.
    let cluster = |id: i64, name: &str, vertex: i32| {
        deformer(id, name, "Cluster")
            .field("Indexes", Value::Wholes(vec![vertex]))
            .field("Weights", Value::Numbers(vec![1.0]))
    };
    let apart = Document::default()
        .node("Left", "LimbNode", None, &[])
        .node("Right", "LimbNode", None, &[])
        .node("Body", "Mesh", None, &[])
        .object(triangle(20), 20, node_id(2))
        .object(deformer(30, "Skin", "Skin"), 30, 20)
        .object(cluster(31, "Left", 0), 31, 30)
        .object(cluster(32, "Right", 1), 32, 30)
        .connected(node_id(0), 31)
        .connected(node_id(1), 32);
    let scene = read(&apart.binary_of(7400)).expect("it is read");
    let (bytes, _) = written(&scene, &turning(&scene));
    let document = gltf::Gltf::from_slice(&bytes).expect("the crate reads it");
    let tops: Vec<&str> = document.scenes().next().expect("one").nodes().filter_map(|node| node.name()).collect();
    assert_eq!(tops, ["scene"], "all below it");
}

/// Whatever is in a file, hostile ones too: what comes out is a glTF that the validator has nothing to say of.
#[test]
fn every_file_of_the_corpus_becomes_a_valid_glb() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut written_files = Vec::new();
    for (index, path) in files_below("", "fbx").into_iter().enumerate() {
        let Ok(scene) = read(&std::fs::read(&path).expect("a file")) else { continue };
        let (bytes, _) = written(&scene, &turning(&scene));
        let stem = path.file_stem().expect("a name").to_string_lossy();
        let file = folder.path().join(format!("{index}_{stem}.glb"));
        std::fs::write(&file, bytes).expect("a file");
        written_files.push(file);
    }
    let pairs: Vec<_> = written_files.iter().map(|file| (false, file, file)).collect();
    assert_nothing_new_is_wrong(&pairs);
}
