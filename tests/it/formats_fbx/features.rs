//! What FBX can say, each by itself: small documents, and where everything is by hand. Lengths are the centimeters of the files.

use glam::{DMat4, DQuat, DVec3};
use retargetd::model::{Clip, Scene, Track, Transform};

use super::{
    made::{
        Between, Channel, Curve, Document, Layer, Of, Property, deformer, line, node_id, number, shape, table,
        triangle, vector, whole,
    },
    read, read_with,
    records::Value,
};

const VERSIONS: [u32; 7] = [6100, 7100, 7200, 7300, 7400, 7500, 7700];
const MOVE: &str = "Lcl Translation";
const TURN: &str = "Lcl Rotation";
const STRETCH: &str = "Lcl Scaling";

fn scene(document: &Document) -> Scene {
    read(&document.text()).unwrap_or_else(|error| panic!("it is read: {error}"))
}

/// Where all nodes are, at rest or at a time of a clip that has a frame there.
fn places(scene: &Scene, at: Option<(&Clip, f64)>) -> Vec<Transform> {
    let local = match at {
        None => scene.skeleton.rest_pose(),
        Some((clip, seconds)) => {
            let frame = clip.times_seconds().iter().position(|time| (time - seconds).abs() < 1e-6);
            let frame = frame.unwrap_or_else(|| panic!("no frame at {seconds} s of {:?}", clip.times_seconds()));
            clip.local_pose(&scene.skeleton, frame)
        }
    };
    let centimeters = |place: &Transform| Transform { translation: place.translation * 100.0, ..*place };
    local.to_model(&scene.skeleton).transforms().iter().map(centimeters).collect()
}

/// How far the first node of the first clip is along X.
fn along(scene: &Scene, seconds: f64) -> f64 {
    places(scene, Some((&scene.clips[0], seconds)))[0].translation.x
}

fn assert_at(found: DVec3, expected: DVec3, what: &str) {
    assert!(found.distance(expected) < 1e-4 * expected.length().max(1.0), "{what}: at {found}, not {expected}");
}

#[test]
fn text_and_binary_of_all_versions_say_the_same() {
    let hips = [vector(MOVE, [1.0, 90.0, 2.0]), whole("RotationActive", 1), vector("PreRotation", [0.0, 0.0, 30.0])];
    let spine = [vector(MOVE, [0.0, 10.0, 0.0]), vector(TURN, [0.0, 45.0, 0.0]), vector(STRETCH, [1.5; 3])];
    let walk = [
        Channel::new(
            Of::Node(0),
            TURN,
            &[("X", line(&[(0.0, 0.0), (1.0, 6.0)])), ("Z", line(&[(0.0, 3.0), (1.0, 0.0)]))],
        ),
        Channel::of(1, MOVE, "Y", &[(0.0, 10.0), (1.0, 12.0)]),
    ];
    let ease = Curve { between: Between::Ease, ..line(&[(0.0, 0.0), (0.5, 80.0)]) };
    let layer = |channels: &[Channel]| [Layer { channels: channels.to_vec(), ..Layer::default() }];
    let document = Document::chain(&[("Hips", &hips), ("Spine", &spine)])
        .take("walk", Some((0.0, 1.0)), &layer(&walk))
        .take("wave", Some((0.0, 0.5)), &layer(&[Channel::new(Of::Node(1), TURN, &[("Y", ease)])]));
    let expected = scene(&document);
    assert_eq!(expected.clips.iter().map(Clip::name).collect::<Vec<_>>(), ["walk", "wave"]);
    for version in VERSIONS {
        for (what, bytes) in [("text", document.text_of(version)), ("binary", document.binary_of(version))] {
            let found = read(&bytes).unwrap_or_else(|error| panic!("{version} {what}: {error}"));
            assert_eq!(found.skeleton, expected.skeleton, "{version} {what}: the skeleton");
            assert_eq!(found.clips, expected.clips, "{version} {what}: the clips");
        }
    }
}

#[test]
fn every_axis_may_be_up_and_in_front_in_any_unit() {
    let axes: Vec<(usize, f64)> = (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]).collect();
    let direction = |(axis, sign): (usize, f64)| {
        let mut direction = DVec3::ZERO;
        direction[axis] = sign;
        direction
    };
    let units = [1.0, 100.0, 2.54, 30.48];
    let pairs = axes.iter().flat_map(|up| axes.iter().map(move |front| (*up, *front)));
    let pairs: Vec<_> = pairs.filter(|(up, front)| up.0 != front.0).collect();
    assert_eq!(pairs.len(), 24, "all there are");
    for (index, (up, front)) in pairs.into_iter().enumerate() {
        let unit = units[index % units.len()];
        let side = direction(up).cross(direction(front));
        let side_axis = axes.iter().copied().find(|axis| direction(*axis) == side).expect("an axis");
        let in_file =
            |place: [f64; 3]| (side * place[0] + direction(up) * place[1] + direction(front) * place[2]).to_array();
        let mut settings = super::made::axes(up, front, side_axis).to_vec();
        settings.push(number("UnitScaleFactor", unit));
        let hips = [vector(MOVE, in_file([1.0, 2.0, 3.0])), vector(TURN, (direction(up) * 90.0).to_array())];
        let spine = [vector(MOVE, in_file([5.0, 0.0, 0.0]))];
        let turn = Channel::new(Of::Node(0), TURN, &[(["X", "Y", "Z"][up.0], line(&[(0.0, 90.0 * up.1), (1.0, 0.0)]))]);
        let document = Document::chain(&[("Hips", &hips), ("Spine", &spine)]).settings(&settings).moved(&[turn]);
        let scene = scene(&document);
        let what = format!("up {up:?}, front {front:?}, unit {unit}");
        let rest = places(&scene, None);
        assert_at(rest[0].translation, DVec3::new(1.0, 2.0, 3.0) * unit, &what);
        assert_at(rest[1].translation, DVec3::new(1.0, 2.0, -2.0) * unit, &what);
        let end = places(&scene, Some((&scene.clips[0], 1.0)));
        assert_at(end[1].translation, DVec3::new(6.0, 2.0, 3.0) * unit, &what);
    }
}

/// The chain of transforms that Autodesk's documentation of the FBX SDK gives for a node.
#[test]
fn pivots_and_offsets_are_about_what_turns() {
    let (offset, pivot, scaling_offset) = ([0.0, 0.0, 3.0], [5.0, 1.0, 0.0], [0.5, 0.0, -1.0]);
    let (before, after) = ([0.0, 0.0, 90.0], [0.0, 30.0, 0.0]);
    let limb = [
        vector(MOVE, [0.0, 10.0, 0.0]),
        whole("RotationActive", 1),
        vector("RotationOffset", offset),
        vector("RotationPivot", pivot),
        vector("PreRotation", before),
        vector("PostRotation", after),
        vector("ScalingOffset", scaling_offset),
        vector("ScalingPivot", pivot),
    ];
    let hand = [vector(MOVE, [7.0, 0.0, 0.0])];
    let turn = Channel::of(0, TURN, "Z", &[(0.0, 0.0), (1.0, 90.0)]);
    let grow = ["X", "Y", "Z"].map(|axis| (axis, line(&[(0.0, 1.0), (1.0, 2.0)])));
    let document =
        Document::chain(&[("Arm", &limb), ("Hand", &hand)]).moved(&[turn, Channel::new(Of::Node(0), STRETCH, &grow)]);
    let scene = scene(&document);
    let moved = |by: [f64; 3]| DMat4::from_translation(by.into());
    let turned = |degrees: [f64; 3]| {
        let [x, y, z] = degrees.map(f64::to_radians);
        DMat4::from_rotation_z(z) * DMat4::from_rotation_y(y) * DMat4::from_rotation_x(x)
    };
    for seconds in [0.0, 0.5, 1.0] {
        let world = moved([0.0, 10.0, 0.0])
            * moved(offset)
            * moved(pivot)
            * turned(before)
            * turned([0.0, 0.0, 90.0 * seconds])
            * turned(after).inverse()
            * moved(pivot).inverse()
            * moved(scaling_offset)
            * moved(pivot)
            * DMat4::from_scale(DVec3::splat(1.0 + seconds))
            * moved(pivot).inverse();
        let found = places(&scene, Some((&scene.clips[0], seconds)));
        let hand = world.transform_point3(DVec3::X * 7.0);
        assert_at(found[1].translation, hand, &format!("the hand at {seconds} s"));
        let turn = world.to_scale_rotation_translation().1;
        assert!(found[1].rotation.angle_between(turn) < 1e-5, "and as it is turned at {seconds} s");
    }
}

#[test]
fn angles_are_applied_in_the_order_that_the_node_names() {
    let (x, y, z) = (DQuat::from_rotation_x(0.5), DQuat::from_rotation_y(-0.7), DQuat::from_rotation_z(1.1));
    let angles = [0.5_f64, -0.7, 1.1].map(f64::to_degrees);
    // The axis that is named first turns first.
    let orders = [z * y * x, y * z * x, x * z * y, z * x * y, y * x * z, x * y * z];
    for (order, expected) in orders.into_iter().enumerate() {
        let limb = [whole("RotationActive", 1), whole("RotationOrder", order as i32), vector(TURN, angles)];
        let found = scene(&Document::chain(&[("Limb", &limb)])).skeleton.joints()[0].rest.rotation;
        assert!(found.angle_between(expected) < 1e-9, "order {order}: {found} where {expected} should be");
    }
}

#[test]
fn layers_lie_on_one_another() {
    const ADD: i32 = 0;
    const OVERRIDE: i32 = 1;
    const PASS_THROUGH: i32 = 2;
    let base = |property, axis, value| Layer {
        channels: vec![Channel::of(0, property, axis, &[(0.0, value), (1.0, value)])],
        ..Layer::default()
    };
    let above = |mode, weight, property, axis, value: f64| Layer {
        properties: vec![whole("BlendMode", mode), number("Weight", weight)],
        ..base(property, axis, value)
    };
    let read = |layers: &[Layer]| scene(&Document::chain(&[("Limb", &[])]).take("Take", None, layers));
    for (mode, weight, expected) in
        [(ADD, 100.0, 15.0), (ADD, 50.0, 12.5), (ADD, 0.0, 10.0), (OVERRIDE, 100.0, 5.0), (PASS_THROUGH, 50.0, 7.5)]
    {
        let scene = read(&[base(MOVE, "X", 10.0), above(mode, weight, MOVE, "X", 5.0)]);
        let found = along(&scene, 1.0);
        assert!((found - expected).abs() < 1e-4, "mode {mode} of {weight} %: {found}, not {expected}");
    }
    // A weight that has keys.
    let mut fading = above(ADD, 100.0, MOVE, "X", 4.0);
    fading.channels.push(Channel::new(Of::Layer, "Weight", &[("Weight", line(&[(0.0, 0.0), (1.0, 100.0)]))]));
    let scene = read(&[base(MOVE, "X", 10.0), fading]);
    for (seconds, expected) in [(0.0, 10.0), (0.5, 12.0), (1.0, 14.0)] {
        let found = along(&scene, seconds);
        assert!((found - expected).abs() < 1e-4, "at {seconds} s: {found}, not {expected}");
    }
    // Rotations and scales are put together by layer or by channel.
    for (accumulation, turn, size) in [
        (0, DQuat::from_rotation_x(0.5) * DQuat::from_rotation_z(0.7), 6.0),
        (1, DQuat::from_rotation_z(0.7) * DQuat::from_rotation_x(0.5), 5.0),
    ] {
        let mut layers = [base(TURN, "X", 0.5_f64.to_degrees()), above(ADD, 100.0, TURN, "Z", 0.7_f64.to_degrees())];
        layers[1].properties.push(whole("RotationAccumulationMode", accumulation));
        let found = places(&read(&layers), Some((&read(&layers).clips[0], 1.0)))[0].rotation;
        assert!(found.angle_between(turn) < 1e-4, "accumulation {accumulation}: {found}, not {turn}");
        let mut layers = [base(STRETCH, "X", 2.0), above(ADD, 100.0, STRETCH, "X", 3.0)];
        layers[1].properties.push(whole("ScaleAccumulationMode", accumulation));
        let found = places(&read(&layers), Some((&read(&layers).clips[0], 1.0)))[0].scale.x;
        assert!((found - size).abs() < 1e-5, "accumulation {accumulation}: {found}, not {size}");
    }
}

#[test]
fn curves_go_on_before_and_after_their_keys() {
    let forever = |letter: char| Some((letter, -1));
    // The keys go from 0 to 10 between the second second and the third; the take lasts six.
    for (before, after, expected) in [
        (forever('R'), forever('R'), [(0.5, 5.0), (1.5, 5.0), (2.2, 2.0), (4.7, 7.0)]),
        (forever('M'), forever('M'), [(0.2, 8.0), (1.2, 2.0), (2.2, 8.0), (3.2, 2.0)]),
        (forever('A'), forever('A'), [(0.2, -8.0), (1.2, 2.0), (2.2, 12.0), (4.5, 35.0)]),
        (forever('K'), forever('K'), [(0.5, -5.0), (1.5, 5.0), (2.5, 15.0), (5.5, 45.0)]),
        (None, Some(('R', 1)), [(0.5, 0.0), (1.5, 5.0), (2.5, 5.0), (4.5, 10.0)]),
        (None, Some(('M', 2)), [(0.5, 0.0), (2.2, 8.0), (3.2, 2.0), (5.5, 10.0)]),
    ] {
        let curve = Curve { before, after, ..line(&[(1.0, 0.0), (2.0, 10.0)]) };
        let channels = vec![Channel::new(Of::Node(0), MOVE, &[("X", curve)])];
        let layers = [Layer { channels, ..Layer::default() }];
        let document = Document::chain(&[("Limb", &[])]).take("Take", Some((0.0, 6.0)), &layers);
        for (what, bytes) in [("7.4", document.text()), ("6.1", document.binary_of(6100))] {
            let scene = read(&bytes).expect("it is read");
            for (seconds, expected) in expected {
                let found = along(&scene, seconds);
                assert!(
                    (found - expected).abs() < 1e-3,
                    "{what}, {before:?}, {after:?} at {seconds} s: {found}, not {expected}"
                );
            }
        }
    }
    // What only holds its ends is as long as its keys.
    for hold in [None, forever('C')] {
        let curve = Curve { before: hold, after: hold, ..line(&[(1.0, 0.0), (2.0, 10.0)]) };
        let scene =
            scene(&Document::chain(&[("Limb", &[])]).moved(&[Channel::new(Of::Node(0), MOVE, &[("X", curve)])]));
        assert_eq!(scene.clips[0].times_seconds(), [0.0, 1.0], "{hold:?}");
        assert_eq!([0.0, 1.0].map(|seconds| along(&scene, seconds).round()), [0.0, 10.0], "{hold:?}");
    }
}

#[test]
fn keys_hold_run_straight_or_ease() {
    for (between, expected) in [
        (Between::Line, [(0.2, 2.0), (0.5, 5.0), (1.0, 10.0)]),
        (Between::Step, [(0.2, 0.0), (0.5, 0.0), (1.0, 10.0)]),
        (Between::Ease, [(0.2, 1.04), (0.5, 5.0), (1.0, 10.0)]),
    ] {
        let curve = Curve { between, ..line(&[(0.0, 0.0), (1.0, 10.0)]) };
        // A second curve that is cubic, so that there is a frame at each time.
        let other = Curve { between: Between::Ease, ..line(&[(0.0, 0.0), (1.0, 20.0)]) };
        let channels =
            [Channel::new(Of::Node(0), MOVE, &[("X", curve)]), Channel::new(Of::Node(0), TURN, &[("Y", other)])];
        let document = Document::chain(&[("Limb", &[])]).moved(&channels);
        for (what, bytes) in [("7.4", document.text()), ("6.1", document.text_of(6100))] {
            let scene = read(&bytes).expect("it is read");
            for (seconds, expected) in expected {
                let found = along(&scene, seconds);
                assert!((found - expected).abs() < 1e-4, "{what}, {between:?} at {seconds} s: {found}, not {expected}");
            }
        }
    }
}

#[test]
fn scales_are_handed_on_in_three_ways() {
    // A parent of scale (3, 4, 1), a child a quarter turn about Z, and a leaf 10 along the child's X.
    for (inherit, leaf) in [(0, 430.0), (1, 440.0), (2, 410.0)] {
        let child = [
            vector(MOVE, [0.0, 100.0, 0.0]),
            whole("RotationActive", 1),
            vector("PreRotation", [0.0, 0.0, 90.0]),
            whole("InheritType", inherit),
        ];
        let parent = [vector(STRETCH, [3.0, 4.0, 1.0])];
        let tip = [vector(MOVE, [10.0, 0.0, 0.0])];
        let document = Document::chain(&[("Parent", &parent), ("Child", &child), ("Leaf", &tip)]);
        let found = places(&scene(&document), None);
        assert_at(
            found[1].translation,
            DVec3::Y * 400.0,
            "the child is moved by the parent's scale whatever it inherits",
        );
        assert_at(
            found[2].translation,
            DVec3::Y * leaf,
            &format!("the leaf, where scales are inherited by way {inherit}"),
        );
    }
}

#[test]
fn geometric_transforms_move_the_mesh_and_nothing_else() {
    let matrix = |translation: DVec3| Value::Numbers(DMat4::from_translation(translation).to_cols_array().to_vec());
    let geometric = [vector("GeometricTranslation", [0.0, 10.0, 0.0]), vector("GeometricScaling", [2.0; 3])];
    let bone = [vector(MOVE, [0.0, 10.0, 0.0])];
    let cluster = deformer(31, "Cluster", "Cluster")
        .field("Indexes", Value::Wholes(vec![0, 1, 2]))
        .field("Weights", Value::Numbers(vec![1.0; 3]))
        .field("Transform", matrix(DVec3::NEG_Y * 10.0))
        .field("TransformLink", matrix(DVec3::Y * 10.0));
    let document = Document::chain(&[("Bone", &bone)])
        .node("Body", "Mesh", None, &geometric)
        .node("Held", "LimbNode", Some(1), &[vector(MOVE, [1.0, 0.0, 0.0])])
        .object(triangle(20), 20, node_id(1))
        .object(deformer(30, "Skin", "Skin"), 30, 20)
        .object(cluster, 31, 30)
        .connected(node_id(0), 31);
    let scene = scene(&document);
    let found = places(&scene, None);
    assert_at(found[1].translation, DVec3::ZERO, "the node of the mesh is where it was");
    assert_at(found[2].translation, DVec3::X, "and so is what hangs below it");
    let points = scene.skin_points.of(0);
    let points: Vec<DVec3> = points.iter().map(|point| point.position.as_dvec3() * 100.0).collect();
    let expected = [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]];
    assert_eq!(points.len(), expected.len(), "every vertex: {points:?}");
    for (found, expected) in points.into_iter().zip(expected) {
        assert_at(found, expected.into(), "a vertex about its bone");
    }
}

#[test]
fn shapes_of_a_mesh_are_morphs_with_their_weights() {
    let channel = deformer(41, "Face.Smile", "BlendShapeChannel")
        .field("DeformPercent", 25.0)
        .field("FullWeights", Value::Numbers(vec![100.0]))
        .holding([table(&[number("DeformPercent", 25.0)], 7400)]);
    let weight = ("DeformPercent", line(&[(0.0, 0.0), (1.0, 50.0), (2.0, 100.0)]));
    let document = Document::chain(&[("Head", &[])])
        .node("Mask", "Mesh", Some(0), &[])
        .object(triangle(20), 20, node_id(1))
        .object(deformer(40, "Face", "BlendShape"), 40, 20)
        .object(channel, 41, 40)
        .object(shape(42), 42, 41)
        .moved(&[Channel::new(Of::Object(41), "DeformPercent", &[weight])]);
    for bytes in [document.text(), document.binary_of(7400), document.binary_of(7700)] {
        let scene = read(&bytes).expect("it is read");
        let names: Vec<(&str, f32)> = scene.morphs.iter().map(|morph| (morph.name.as_str(), morph.rest)).collect();
        assert_eq!(names, [("Smile", 0.25)], "the shape, without its deformer, with its own weight");
        let clip = &scene.clips[0];
        assert_eq!(clip.times_seconds(), [0.0, 1.0, 2.0]);
        assert_eq!(clip.morphs()[0].weights, Track::Sampled(vec![0.0, 0.5, 1.0]));
    }
}

#[test]
fn takes_have_their_own_keys_and_spans() {
    let take = |keys: &[(f64, f64)]| [Layer { channels: vec![Channel::of(0, MOVE, "X", keys)], ..Layer::default() }];
    let document = Document::chain(&[("Limb", &[vector(MOVE, [3.0, 0.0, 0.0])])])
        .take("still", None, &[Layer::default()])
        .take("late", Some((10.0, 11.0)), &take(&[(10.0, 1.0), (11.0, 2.0)]))
        .take("cut", Some((0.0, 1.0)), &take(&[(-1.0, 0.0), (0.0, 10.0), (1.0, 20.0), (2.0, 30.0)]));
    let scene = scene(&document);
    let clips: Vec<(&str, usize, f64)> =
        scene.clips.iter().map(|clip| (clip.name(), clip.frame_count(), clip.duration_seconds())).collect();
    assert_eq!(clips, [("still", 1, 0.0), ("late", 2, 1.0), ("cut", 2, 1.0)], "in order, each as long as it says");
    for (clip, seconds, expected) in [(0, 0.0, 3.0), (1, 0.0, 1.0), (1, 1.0, 2.0), (2, 0.0, 10.0), (2, 1.0, 20.0)] {
        let found = places(&scene, Some((&scene.clips[clip], seconds)))[0].translation.x;
        assert!((found - expected).abs() < 1e-4, "clip {clip} at {seconds} s: {found}, not {expected}");
    }
}

#[test]
fn namespaces_tell_two_figures_apart() {
    let at = |x: f64| [vector(MOVE, [x, 0.0, 0.0])];
    let document = Document::default()
        .node("hero:Hips", "LimbNode", None, &at(1.0))
        .node("hero:Spine", "LimbNode", Some(0), &at(2.0))
        .node("rig:villain:Hips", "LimbNode", None, &at(4.0))
        .node("rig:villain:Spine", "LimbNode", Some(2), &at(8.0))
        .moved(&[Channel::of(3, MOVE, "X", &[(0.0, 8.0), (1.0, 16.0)])]);
    for bytes in [document.text(), document.binary_of(7400), document.text_of(6100), document.binary_of(6100)] {
        let scene = read(&bytes).expect("it is read");
        let joints = scene.skeleton.joints();
        let found: Vec<(&str, Option<usize>)> =
            joints.iter().map(|joint| (joint.name.as_str(), joint.parent)).collect();
        let expected =
            [("hero:Hips", None), ("hero:Spine", Some(0)), ("rig:villain:Hips", None), ("rig:villain:Spine", Some(2))];
        assert_eq!(found, expected, "names as they stand");
        let end = places(&scene, Some((&scene.clips[0], 1.0)));
        let along: Vec<f64> = end.iter().map(|place| place.translation.x.round()).collect();
        assert_eq!(along, [1.0, 3.0, 4.0, 20.0], "and the one that is meant moves");
    }
}

#[test]
fn only_limbs_are_joints() {
    let document = Document::chain(&[("Hips", &[])]).node("Prop", "Null", Some(0), &[vector(MOVE, [1.0, 0.0, 0.0])]);
    let joints: Vec<(String, bool)> =
        scene(&document).skeleton.joints().iter().map(|joint| (joint.name.clone(), joint.is_joint)).collect();
    assert_eq!(joints, [("Hips".to_owned(), true), ("Prop".to_owned(), false)]);
}

#[test]
fn a_wide_turn_between_two_keys_gets_frames() {
    let document = Document::chain(&[("Hips", &[])]).moved(&[Channel::of(0, TURN, "Y", &[(1.0, 0.0), (2.0, 270.0)])]);
    let (scene, warnings) = read_with(&document.text(), &Default::default());
    let scene = scene.expect("it is read");
    let clip = &scene.clips[0];
    assert_eq!((clip.name(), clip.frame_count()), ("Take", 31), "a second at 30 frames per second");
    assert_eq!(warnings.iter().map(|warning| warning.code).collect::<Vec<_>>(), ["keys_densified"], "and it says so");
    let found = clip.local_pose(&scene.skeleton, 20).transforms()[0].rotation;
    let expected = DQuat::from_rotation_y(std::f64::consts::PI);
    assert!(found.angle_between(expected) < 1e-4, "two thirds of the way around: {found}");
    let tracks = &clip.joints()[0];
    assert!(!tracks.translation.is_animated() && !tracks.scale.is_animated(), "only what has curves is animated");
}

#[test]
fn a_child_that_ignores_its_parents_scale_keeps_its_size() {
    let child: [Property; 2] = [vector(MOVE, [0.0, 100.0, 0.0]), whole("InheritType", 2)];
    let document = Document::chain(&[("Parent", &[]), ("Child", &child), ("Leaf", &child)]).moved(&[Channel::of(
        0,
        STRETCH,
        "Y",
        &[(0.0, 1.0), (1.0, 4.0)],
    )]);
    let scene = scene(&document);
    let [parent, child, leaf] =
        <[Transform; 3]>::try_from(places(&scene, Some((&scene.clips[0], 1.0)))).expect("three");
    assert!(parent.scale.abs_diff_eq(DVec3::new(1.0, 4.0, 1.0), 1e-5), "the parent is stretched: {}", parent.scale);
    assert!(child.scale.abs_diff_eq(DVec3::ONE, 1e-5), "the child is not: {}", child.scale);
    assert_at(child.translation, DVec3::Y * 400.0, "but it moves");
    assert_at(leaf.translation, DVec3::Y * 500.0, "the leaf moves with it");
}
