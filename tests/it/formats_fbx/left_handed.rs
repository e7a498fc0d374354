//! Files whose third axis points the other way: the same scene, with left and right where they were.

use glam::{DQuat, DVec3};
use retargetd::{
    formats::{self, Format, WriteOptions},
    model::{Clip, Control, LocalPose, Reporter, Scene},
};

use super::{
    made::{self, Channel, Document, Of, deformer, line, node_id, triangle, vector},
    oracle, read,
    records::Value,
};
use crate::support::{corpus_file, fbx_axis};

const MOVE: &str = "Lcl Translation";
const TURN: &str = "Lcl Rotation";
/// Skinned and without a mesh, Y up and Z up, of Mixamo, Unreal and 3ds Max.
const FILES: [&str; 4] = [
    "mixamo/fbx/samba_dancing_skin.fbx",
    "mixamo/fbx/walking_noskin.fbx",
    "unreal/ue4_names_apose_zup_xfwd.fbx",
    "fbx-semantics/max_geometry_transform_types_7700_binary.fbx",
];

/// A binary file with the sign of one of its axes turned about: a property with a type, a label, no flags and a whole number.
fn with_sign_turned(bytes: &[u8], property: &str) -> Vec<u8> {
    let after = |from: usize, wanted: &[u8]| {
        let place = bytes[from..].windows(wanted.len()).position(|window| window == wanted).expect("it is there");
        from + place + wanted.len()
    };
    let value = after(after(0, property.as_bytes()), b"Integer") + b"S\0\0\0\0I".len();
    let sign = i32::from_le_bytes(bytes[value..value + 4].try_into().expect("four bytes"));
    assert_eq!(sign.abs(), 1, "{property} is a sign");
    let mut turned = bytes.to_vec();
    turned[value..value + 4].copy_from_slice(&(-sign).to_le_bytes());
    turned
}

/// Where the joints are, and where the vertices that they move.
fn places(scene: &Scene, local: &LocalPose) -> (Vec<DVec3>, Vec<DVec3>, Vec<DQuat>) {
    let model = local.to_model(&scene.skeleton);
    let joints = model.transforms().iter().map(|transform| transform.translation).collect();
    let turns = model.transforms().iter().map(|transform| transform.rotation).collect();
    let points = model.transforms().iter().enumerate().flat_map(|(joint, transform)| {
        let points = scene.skin_points.of(joint).iter();
        points.map(|point| transform.to_matrix().transform_point3(point.position.as_dvec3())).collect::<Vec<_>>()
    });
    let points = points.collect();
    (joints, points, turns)
}

/// Where the parser has the nodes of a file before it converts anything, taken along the axes that the file names, in meters.
fn as_the_file_says(bytes: &[u8]) -> Vec<DVec3> {
    let file = ufbx::load_memory(bytes, ufbx::LoadOpts::default()).expect("the parser reads it");
    let axes = file.settings.axes;
    let [right, up, front] = [axes.right, axes.up, axes.front].map(fbx_axis);
    let places = oracle::worlds(&file).into_iter().map(|world| world.w_axis.truncate() * file.settings.unit_meters);
    places.map(|place| DVec3::new(right.dot(place), up.dot(place), front.dot(place))).collect()
}

fn assert_close(found: &[DVec3], expected: impl IntoIterator<Item = DVec3>, what: &str) {
    let expected: Vec<DVec3> = expected.into_iter().collect();
    assert_eq!(found.len(), expected.len(), "{what}: as many");
    let size = expected.iter().map(|place| place.length()).fold(1e-3, f64::max);
    for (found, expected) in found.iter().zip(&expected) {
        assert!(found.distance(*expected) < 1e-5 * size, "{what}: at {found}, not {expected}");
    }
}

/// Every joint and every vertex of a real file is mirrored with the axis that is, whatever is up, at rest and in the clip; and the
/// joints are where the parser has them before it converts anything.
#[test]
fn real_files_are_mirrored_as_a_whole() {
    let mirrors = [("CoordAxisSign", DVec3::new(-1.0, 1.0, 1.0)), ("FrontAxisSign", DVec3::new(1.0, 1.0, -1.0))];
    for name in FILES {
        let Some(path) = corpus_file(name) else { continue };
        let bytes = std::fs::read(path).expect("a file");
        let plain = read(&bytes).expect("it is read");
        for (setting, mirror) in mirrors {
            let what = format!("{name}, {setting}");
            let turned = with_sign_turned(&bytes, setting);
            let mirrored = read(&turned).unwrap_or_else(|error| panic!("{what}: {error}"));
            assert_eq!(mirrored.skeleton.len(), plain.skeleton.len(), "{what}");
            let poses = |scene: &Scene| -> Vec<LocalPose> {
                let clip = scene.clips.first();
                let at =
                    |part: usize, clip: &Clip| clip.local_pose(&scene.skeleton, part * (clip.frame_count() - 1) / 4);
                let in_clip = clip.into_iter().flat_map(|clip| (0..5).map(move |part| at(part, clip)));
                std::iter::once(scene.skeleton.rest_pose()).chain(in_clip).collect()
            };
            let first_turns = places(&plain, &plain.skeleton.rest_pose()).2;
            let first_mirrored = places(&mirrored, &mirrored.skeleton.rest_pose()).2;
            assert_close(
                &places(&mirrored, &mirrored.skeleton.rest_pose()).0,
                as_the_file_says(&turned),
                &format!("{what}, as the parser has it"),
            );
            for (here, there) in poses(&plain).iter().zip(&poses(&mirrored)) {
                let (joints, points, turns) = places(&plain, here);
                let (found, found_points, found_turns) = places(&mirrored, there);
                assert_close(&found, joints.iter().map(|place| *place * mirror), &what);
                assert_close(&found_points, points.iter().map(|place| *place * mirror), &what);
                // What turns about an axis turns the other way about its mirror image.
                for (joint, (turn, found)) in turns.iter().zip(&found_turns).enumerate() {
                    let turn = *turn * first_turns[joint].inverse();
                    let axis = -mirror * turn.xyz();
                    let expected = DQuat::from_xyzw(axis.x, axis.y, axis.z, turn.w);
                    let off = (*found * first_mirrored[joint].inverse()).angle_between(expected);
                    assert!(off < 1e-5, "{what}: joint {joint} is {off} off");
                }
            }
        }
    }
}

/// Any axis up, any other in front, and the third on the wrong side: where everything is by hand, with a mesh, and written again.
#[test]
fn every_left_handed_pair_of_axes_is_the_same_scene() {
    let axes: Vec<(usize, f64)> = (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]).collect();
    let direction = |(axis, sign): (usize, f64)| {
        let mut direction = DVec3::ZERO;
        direction[axis] = sign;
        direction
    };
    let pairs = axes.iter().flat_map(|up| axes.iter().map(move |front| (*up, *front)));
    for (up, front) in pairs.filter(|(up, front)| up.0 != front.0) {
        let side = -direction(up).cross(direction(front));
        let side_axis = axes.iter().copied().find(|axis| direction(*axis) == side).expect("an axis");
        let in_file =
            |place: [f64; 3]| (side * place[0] + direction(up) * place[1] + direction(front) * place[2]).to_array();
        let hips = [vector(MOVE, in_file([1.0, 2.0, 3.0]))];
        let spine = [vector(MOVE, in_file([5.0, 0.0, 0.0]))];
        let turn = Channel::new(Of::Node(0), TURN, &[(["X", "Y", "Z"][up.0], line(&[(0.0, 0.0), (1.0, 90.0 * up.1)]))]);
        let cluster = deformer(52, "Spine", "Cluster")
            .field("Indexes", Value::Wholes(vec![0, 1, 2]))
            .field("Weights", Value::Numbers(vec![1.0; 3]));
        let document = Document::chain(&[("Hips", &hips), ("Spine", &spine)])
            .node("Body", "Mesh", None, &[])
            .settings(&made::axes(up, front, side_axis))
            .object(triangle(50), 50, node_id(2))
            .object(deformer(51, "Skin", "Skin"), 51, 50)
            .object(cluster, 52, 51)
            .connected(node_id(1), 52)
            .moved(&[turn]);
        let scene = read(&document.text()).expect("it is read");
        let what = format!("up {up:?}, front {front:?}");
        let centimeters = |place: &DVec3| *place * 100.0;
        // A quarter turn about up, as the numbers of the file have it: from its side to its front, which is the left hand's way.
        for (frame, spine) in [(None, [6.0, 2.0, 3.0]), (Some(scene.clips[0].frame_count() - 1), [1.0, 2.0, 8.0])] {
            let pose = frame
                .map_or_else(|| scene.skeleton.rest_pose(), |frame| scene.clips[0].local_pose(&scene.skeleton, frame));
            let joints: Vec<DVec3> = places(&scene, &pose).0.iter().map(centimeters).collect();
            assert_close(&joints[..2], [DVec3::new(1.0, 2.0, 3.0), DVec3::from_array(spine)], &what);
        }
        let points = places(&scene, &scene.skeleton.rest_pose()).1;
        assert_eq!(points.len(), 3, "{what}: the triangle");
        let options = WriteOptions::new(Format::Fbx);
        let written = formats::write(&scene, &scene.clips[0], &options, &Control::new(), &mut Reporter::new());
        let back = read(&written.expect("it is written")).expect("it is read back");
        let found = places(&back, &back.clips[0].local_pose(&back.skeleton, back.clips[0].frame_count() - 1));
        let before = places(&scene, &scene.clips[0].local_pose(&scene.skeleton, scene.clips[0].frame_count() - 1));
        assert_close(&found.0, before.0, &format!("{what}, written and read"));
        assert_close(&found.1, before.1, &format!("{what}, its mesh written and read"));
    }
}
