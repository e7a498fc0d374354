//! Support points of feet made by code.

use glam::{DQuat, Vec3};

use super::*;
use crate::rig::limb_joints::leg_of;
use crate::{
    model::{Influence, Joint, Reporter, Scene, Skeleton, SkinVertices, Transform},
    retarget::RetargetSpec,
};

const SPINE: [(&str, usize, [f64; 3]); 9] = [
    ("Spine", 0, [0.0, 0.15, 0.0]),
    ("Chest", 1, [0.0, 0.15, 0.0]),
    ("Neck", 2, [0.0, 0.2, 0.0]),
    ("Head", 3, [0.0, 0.1, 0.0]),
    ("LeftArm", 2, [0.2, 0.15, 0.0]),
    ("LeftForeArm", 5, [0.28, 0.0, 0.0]),
    ("LeftHand", 6, [0.25, 0.0, 0.0]),
    ("RightArm", 2, [-0.2, 0.15, 0.0]),
    ("RightForeArm", 8, [-0.28, 0.0, 0.0]),
];

/// A body of joints with legs of 0.9 m above ankles 0.1 m high, with or without toes, whose foot joints have axes of their own.
fn body(has_toes: bool) -> Scene {
    let mut joints: Vec<(String, Option<usize>, [f64; 3])> = vec![("Hips".into(), None, [0.0, 1.0, 0.0])];
    joints.extend(SPINE.map(|(name, parent, place)| (name.to_owned(), Some(parent), place)));
    joints.push(("RightHand".into(), Some(9), [-0.25, 0.0, 0.0]));
    for (side, x) in [("Left", 0.1), ("Right", -0.1)] {
        let first = joints.len();
        joints.push((format!("{side}UpLeg"), Some(0), [x, 0.0, 0.0]));
        joints.push((format!("{side}Leg"), Some(first), [0.0, -0.45, 0.0]));
        joints.push((format!("{side}Foot"), Some(first + 1), [0.0, -0.45, 0.0]));
        if has_toes {
            joints.push((format!("{side}ToeBase"), Some(first + 2), [0.0, -0.07, 0.13]));
        }
    }
    let turned = |name: &str| if name.ends_with("Foot") { DQuat::from_rotation_x(0.7) } else { DQuat::IDENTITY };
    let joint = |(node, (name, parent, place)): (usize, (String, Option<usize>, [f64; 3]))| {
        let above = if name.ends_with("ToeBase") { turned("Foot").conjugate() } else { DQuat::IDENTITY };
        let rotation = above * turned(&name);
        let rest = Transform { translation: above * DVec3::from(place), rotation, scale: DVec3::ONE };
        Joint { name, parent, rest, is_joint: true, node }
    };
    let joints = joints.into_iter().enumerate().map(joint).collect();
    Scene { skeleton: Skeleton::new(joints).expect("a skeleton"), unit_meters: Some(1.0), ..Scene::default() }
}

/// Adds a shoe: a box about each ankle, with the part before the ball on the toes; and something else where it is wanted.
fn with_shoes(mut scene: Scene, more: &[DVec3]) -> Scene {
    let rest = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let index = |name: &str| scene.skeleton.joints().iter().position(|joint| joint.name == name);
    let mut vertices = SkinVertices::default();
    for side in ["Left", "Right"] {
        let foot = index(&format!("{side}Foot")).expect("a foot");
        let toes = index(&format!("{side}ToeBase")).unwrap_or(foot);
        let ankle = rest.transforms()[foot].translation;
        let mut add = |place: DVec3| {
            let joint = if place.z > ankle.z + 0.131 { toes } else { foot };
            let position = rest.transforms()[joint].relative(&Transform::from_translation(place)).translation;
            let joint = u32::try_from(joint).expect("few joints");
            vertices.push(&mut vec![Influence { joint, weight: 1.0, position: position.as_vec3() }], true);
        };
        for step in 0..=20 {
            for x in [-0.05, 0.0, 0.05] {
                for y in [0.0, 0.08] {
                    add(DVec3::new(ankle.x + x, y, -0.07 + 0.015 * f64::from(step)));
                }
            }
        }
        more.iter().for_each(|place| add(ankle + *place));
    }
    scene.skin_vertices = vertices.into();
    scene
}

fn left_foot(scene: &Scene) -> (FootShape, LimbJoints) {
    let spec = RetargetSpec::default();
    let rig = Rig::new("target", scene, None, &spec.target, &mut Reporter::new()).expect("a rig");
    let leg = leg_of(&rig).expect("a leg");
    (foot_shape(&rig, &leg, 1.0, true, true), leg)
}

/// The points of a foot from its ankle, in the body's axes.
fn places(scene: &Scene, shape: &FootShape, leg: &LimbJoints) -> Vec<DVec3> {
    let rest = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let turn = rest.transforms()[leg.end].rotation;
    shape.points.iter().map(|point| turn * point.from_end).collect()
}

fn has(places: &[DVec3], place: [f64; 3]) -> bool {
    places.iter().any(|other| other.distance(DVec3::from(place)) < 0.02)
}

#[test]
fn a_shoe_stands_on_its_heel_its_edges_and_its_toes() {
    for has_toes in [true, false] {
        let scene = with_shoes(body(has_toes), &[]);
        let (shape, leg) = left_foot(&scene);
        let places = places(&scene, &shape, &leg);
        assert!(shape.is_from_mesh, "there is a mesh");
        for x in [-0.05, 0.05] {
            assert!(has(&places, [x, -0.1, -0.07]), "the back of the heel: {places:?}");
            assert!(has(&places, [x, -0.1, 0.23]), "the tips of the toes: {places:?}");
        }
        assert!(shape.points.len() < 40, "few of them: {}", shape.points.len());
        let gives_way = shape.points.iter().filter(|point| point.gives_way).count();
        assert_eq!(gives_way > 0, has_toes, "toes lift their tips");
        let down = scene.skeleton.rest_pose().to_model(&scene.skeleton).transforms()[leg.end].rotation.conjugate()
            * DVec3::NEG_Y;
        assert!((shape.depth(down) - 0.1).abs() < 1e-6, "as deep as the shoe: {}", shape.depth(down));
        assert!(shape.contacts.iter().all(Option::is_some), "heel, ball and tip, with or without toes");
    }
}

/// The same body with a joint in the middle of each shin that takes a share of its twist, and one more vertex of each shoe, so far from the
/// ankle in the body's axes, on it by a share.
fn with_twist_joints(scene: &Scene, from_ankle: DVec3, share: f32) -> Scene {
    let mut joints = scene.skeleton.joints().to_vec();
    let rest = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let index = |name: String| joints.iter().position(|joint| joint.name == name).expect("a joint");
    let sides = ["Left", "Right"].map(|side| (index(format!("{side}Leg")), index(format!("{side}Foot"))));
    let mut vertices = scene.skin_vertices.as_ref().clone();
    for (shin, foot) in sides {
        let number = |joint: usize| u32::try_from(joint).expect("few joints");
        let place = rest.transforms()[foot].translation + from_ankle;
        let from_foot = rest.transforms()[foot].relative(&Transform::from_translation(place)).translation.as_vec3();
        // The ankle is 0.25 m below the joint.
        let (of_foot, of_twist) = ((number(foot), 1.0 - share, from_foot), from_ankle.as_vec3() + Vec3::NEG_Y * 0.25);
        let of_twist = (number(joints.len()), share, of_twist);
        let influence = |(joint, weight, position)| Influence { joint, weight, position };
        vertices.push(&mut [of_foot, of_twist].map(influence).to_vec(), true);
        let rest = Transform::from_translation(DVec3::new(0.0, -0.2, 0.0));
        let name = format!("{}Twist", joints[shin].name);
        joints.push(Joint { name, parent: Some(shin), rest, is_joint: true, node: joints.len() });
    }
    let skeleton = Skeleton::new(joints).expect("a skeleton");
    Scene { skeleton, skin_vertices: vertices.into(), unit_meters: Some(1.0), ..Scene::default() }
}

#[test]
fn a_heel_that_hangs_on_a_joint_of_the_shin_leans_with_it() {
    // Shoes that are bound smoothly follow the shin by little, and their soles are in the floor by that when it leans.
    let from_ankle = DVec3::new(0.0, -0.1, -0.12);
    for share in [0.5, 0.15] {
        let scene = with_twist_joints(&with_shoes(body(true), &[]), from_ankle, share);
        let (shape, leg) = left_foot(&scene);
        let back = shape.points.iter().find(|point| point.from_end.length() > 0.15 && point.shin > 0.0);
        let back = back.unwrap_or_else(|| panic!("a share of the heel is the shin's: {:?}", shape.points));
        assert!((back.shin - f64::from(share)).abs() < 1e-6, "{share} of it: {}", back.shin);
        let rest = scene.skeleton.rest_pose().to_model(&scene.skeleton);
        let place = rest.transforms()[leg.shin].rotation * back.from_shin;
        assert!(place.distance(from_ankle) < 1e-6, "from the ankle: {place}");
    }
}

#[test]
fn an_edge_that_follows_the_shin_is_the_lowest_when_that_leans_aside() {
    // A little above the sole, beside the ankle: nothing else makes it the lowest.
    let scene = with_twist_joints(&with_shoes(body(true), &[]), DVec3::new(0.05, -0.0995, 0.0), 0.2);
    let (shape, _) = left_foot(&scene);
    assert!(shape.points.iter().any(|point| point.shin > 0.0), "{:?}", shape.points);
}

#[test]
fn feet_that_are_meshes_without_a_skin_have_their_soles() {
    for has_toes in [true, false] {
        let shod = with_shoes(body(has_toes), &[]);
        let mut meshes = SkinVertices::default();
        shod.skin_vertices.iter().for_each(|influences| meshes.push(&mut influences.to_vec(), false));
        let hung = Scene { skin_vertices: meshes.into(), ..shod.clone() };
        let ((skinned, leg), (rigid, _)) = (left_foot(&shod), left_foot(&hung));
        assert!(rigid.is_from_mesh, "the meshes that hang on its joints");
        assert_eq!(places(&hung, &rigid, &leg), places(&shod, &skinned, &leg), "the same as with a skin");
    }
}

#[test]
fn a_cape_is_no_foot() {
    let scene = with_shoes(body(true), &[DVec3::new(0.0, 0.2, -0.9), DVec3::new(0.1, -0.09, -0.85)]);
    let (shape, leg) = left_foot(&scene);
    let farthest = places(&scene, &shape, &leg).iter().map(|place| place.length()).fold(0.0, f64::max);
    assert!(farthest < 0.3, "what is {farthest} away is left out");
}

#[test]
fn a_foot_without_a_mesh_has_a_heel_and_toes() {
    for has_toes in [true, false] {
        let scene = body(has_toes);
        let (shape, leg) = left_foot(&scene);
        assert!(!shape.is_from_mesh, "there is no mesh");
        let places = places(&scene, &shape, &leg);
        let along = |pick: fn(f64, f64) -> f64, start: f64| places.iter().map(|place| place.z).fold(start, pick);
        assert!(along(f64::min, 0.0) < -0.03, "a heel behind the ankle: {places:?}");
        assert!(along(f64::max, 0.0) > 0.17, "toes beyond the last joint: {places:?}");
        let wide = places.iter().map(|place| place.x.abs()).fold(0.0, f64::max);
        assert!((0.02..0.08).contains(&wide), "a width: {wide}");
    }
}

#[test]
fn a_mesh_far_below_the_foot_is_no_sole() {
    let mut scene = with_shoes(body(true), &[]);
    let moved = scene.skin_vertices.map(|one| one.position + Vec3::new(0.0, -0.9, -0.9));
    scene.skin_vertices = moved.into();
    let (shape, _) = left_foot(&scene);
    assert!(!shape.is_from_mesh, "it is guessed from the joints");
}

#[test]
fn toes_count_where_most_vertices_lie_about_the_ankle() {
    let about = |index: usize| {
        let angle = index as f64 * 0.37;
        DVec3::new(0.03 * angle.cos(), 0.02 * (angle * 1.7).sin(), 0.03 * angle.sin())
    };
    let ankle: Vec<DVec3> = (0..600).map(about).collect();
    let scene = with_shoes(body(true), &ankle);
    let (shape, leg) = left_foot(&scene);
    let places = places(&scene, &shape, &leg);
    for x in [-0.05, 0.05] {
        assert!(has(&places, [x, -0.1, 0.23]), "the tips of the toes: {places:?}");
    }
}
