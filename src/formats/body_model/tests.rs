//! Small captures whose poses are known.

use glam::{DQuat, DVec3};

use super::{
    features, positions,
    skeleton::{self, Body},
};
use crate::{
    formats::{
        Budget, ErrorKind, Limit, Limits,
        numpy::{NumberArray, Values, npy},
    },
    model::{Control, Reporter},
};

/// Where the joints of a body are that is turned by `rotations`.
fn forward(body: Body, rotations: &[DQuat], pelvis: DVec3) -> Vec<DVec3> {
    let mut world: Vec<(DQuat, DVec3)> = Vec::new();
    for (joint, (_, parent, place)) in body.joints().into_iter().enumerate() {
        let next = parent.map_or((rotations[joint], pelvis), |parent| {
            let (rotation, origin) = world[parent];
            (rotation * rotations[joint], origin + rotation * place)
        });
        world.push(next);
    }
    world.into_iter().map(|(_, place)| place).collect()
}

#[test]
fn every_family_has_the_joints_of_its_parameters() {
    for (count, last) in [(22, "R_Wrist"), (24, "R_Hand"), (52, "R_Thumb3"), (55, "R_Thumb3")] {
        let joints = Body::of_joint_count(count).expect("a family").joints();
        assert_eq!((joints.len(), joints[count - 1].0.as_str()), (count, last), "in the order of the parameters");
        assert!(joints.iter().enumerate().all(|(joint, (_, parent, _))| parent.is_none_or(|parent| parent < joint)));
    }
    let joints = Body::SmplX.joints();
    assert_eq!(joints[25].0, "L_Index1", "jaw and eyes come before the fingers");
    assert_eq!(joints[40].1, Some(skeleton::RIGHT_WRIST), "the right hand hangs from the right wrist");
    assert_eq!(Body::of_joint_count(21), None, "no such body");
}

#[test]
fn positions_are_met_by_the_pose_that_is_found() {
    let body = Body::Plain;
    let mut rotations = vec![DQuat::IDENTITY; 22];
    let turn = |x: f64, y: f64, z: f64| DQuat::from_scaled_axis(DVec3::new(x, y, z));
    rotations[skeleton::PELVIS] = turn(0.2, 1.1, -0.3);
    rotations[skeleton::SPINE] = turn(0.3, 0.0, 0.1);
    rotations[skeleton::CHEST] = turn(-0.1, 0.4, 0.0);
    rotations[skeleton::LEFT_HIP] = turn(-0.9, 0.0, 0.2);
    rotations[skeleton::LEFT_KNEE] = turn(1.2, 0.0, 0.0);
    rotations[skeleton::RIGHT_SHOULDER] = turn(0.0, 0.3, 1.0);
    rotations[skeleton::RIGHT_ELBOW] = turn(0.0, 1.4, 0.0);
    let still = vec![DQuat::IDENTITY; 22];
    let seen = [&still, &rotations].map(|rotations| forward(body, rotations, DVec3::new(0.3, 0.9, -2.0))).to_vec();
    let (limits, control) = (Limits::default(), Control::new());
    let found = positions::solve(&seen, &mut Budget::new(&limits, &control), &mut Reporter::new()).expect("a capture");
    for (frame, seen) in seen.iter().enumerate() {
        let local: Vec<DQuat> = found.rotations.iter().map(|track| track[frame]).collect();
        let met = forward(body, &local, found.pelvis[frame]);
        let worst = met.iter().zip(seen).map(|(met, seen)| met.distance(*seen)).fold(0.0, f64::max);
        assert!(worst < 1e-9, "frame {frame}: {worst} m off");
    }
    assert!(found.rotations.iter().all(|track| track[0].angle_between(DQuat::IDENTITY) < 1e-5), "the T pose is rest");
    // A knee that bends as knees do leaves no doubt how its thigh is rolled.
    let thigh = found.rotations[skeleton::LEFT_HIP][1].angle_between(rotations[skeleton::LEFT_HIP]).to_degrees();
    assert!(thigh < 5.0, "the roll of the thigh is {thigh} degrees off");
}

#[test]
fn a_hinge_tells_the_roll_without_a_jump() {
    let body = Body::Plain;
    let (limits, control) = (Limits::default(), Control::new());
    let seen: Vec<Vec<DVec3>> = (0..=200)
        .map(|step| {
            let mut rotations = vec![DQuat::IDENTITY; 22];
            rotations[skeleton::LEFT_SHOULDER] = DQuat::from_rotation_z(-1.2) * DQuat::from_rotation_x(0.7);
            rotations[skeleton::LEFT_ELBOW] = DQuat::from_rotation_y(-f64::from(step) * 0.01);
            forward(body, &rotations, DVec3::Y)
        })
        .collect();
    let found = positions::solve(&seen, &mut Budget::new(&limits, &control), &mut Reporter::new()).expect("a capture");
    let arm = &found.rotations[skeleton::LEFT_SHOULDER];
    let worst = arm.windows(2).map(|pair| pair[0].angle_between(pair[1]).to_degrees()).fold(0.0, f64::max);
    assert!(worst < 5.0, "between two frames of a bending elbow the arm turns {worst} degrees");
}

#[test]
fn features_walk_where_they_turn() {
    // One meter a frame to the front, a quarter turn after the first: +Z, then what the turn made of it.
    let mut values = vec![0.0; 3 * features::WIDTH];
    for frame in 0..3 {
        values[frame * features::WIDTH + 2] = 1.0;
        values[frame * features::WIDTH + 3] = 0.9;
        values[frame * features::WIDTH + 4] = 0.1;
    }
    values[0] = std::f64::consts::FRAC_PI_4;
    let array = NumberArray { shape: vec![3, features::WIDTH], values: Values::Double(values) };
    let places = features::places(&array);
    let root = |frame: usize| places[frame][0];
    assert!(root(0).distance(DVec3::new(0.0, 0.9, 0.0)) < 1e-12, "the first frame is the origin");
    assert!((root(1) - root(0)).distance(root(2) - root(1)) < 1e-12, "both steps are made after the turn");
    assert!(
        (root(1) - root(0)).distance(DVec3::NEG_X) < 1e-12,
        "half the angle is stored, and it turns the world back"
    );
    assert!(places[0][1].distance(DVec3::X * 0.1) < 1e-12, "places are seen from the heading");
}

#[test]
fn what_positions_become_is_paid_for_before_it_is_made() {
    let mut bytes = Vec::new();
    npy::write_header(&mut bytes, "<f4", &[10, 22, 3]);
    bytes.resize(bytes.len() + 10 * 22 * 3 * size_of::<f32>(), 0);
    let limits = Limits { decoded_bytes: 10_000, ..Limits::default() };
    let error = super::read_array(&bytes, &mut Budget::new(&limits, &Control::new()), &mut Reporter::new());
    let kind = error.map(drop).expect_err("places and turns of 220 joints take more").kind;
    assert!(matches!(kind, ErrorKind::LimitExceeded { limit: Limit::DecodedBytes, .. }), "the limit: {kind:?}");
}
