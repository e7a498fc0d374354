//! Faces made of a bent grid, whose shapes are known.

use glam::Vec3;

use super::*;

const RULE: FitRule = FitRule { bounds: [0.0, 1.0], regularization: 1e-6 };

/// A bent sheet of so many points to a side, and bumps on it that rise; the same places whatever the number of points.
fn face(side: usize, size: f32, bumps: &[(f32, f32, Vec3)]) -> MorphMesh {
    let at = |index: usize| {
        let (x, y) = ((index % side) as f32 / (side - 1) as f32, (index / side) as f32 / (side - 1) as f32);
        (x * 2.0 - 1.0, y * 2.0 - 1.0)
    };
    let position = |(x, y): (f32, f32)| Vec3::new(x, y * 1.3 + 0.2 * x * y, 0.6 - 0.4 * x * x - 0.3 * y * y) * size;
    let bump = |(x, y): (f32, f32), (u, v, rise): (f32, f32, Vec3)| {
        rise * size * (-((x - u).powi(2) + (y - v).powi(2)) / 0.08).exp()
    };
    let points = || (0..side * side).map(at);
    MorphMesh {
        first: 0,
        positions: points().map(position).collect(),
        displacements: bumps.iter().map(|one| points().map(|place| bump(place, *one)).collect()).collect(),
    }
}

const LEFT: (f32, f32, Vec3) = (-0.5, 0.4, Vec3::new(0.0, -0.2, 0.05));
const RIGHT: (f32, f32, Vec3) = (0.5, 0.4, Vec3::new(0.0, -0.2, 0.05));
const JAW: (f32, f32, Vec3) = (0.0, -0.6, Vec3::new(0.0, -0.4, 0.0));

fn side<'a>(mesh: &'a MorphMesh, shapes: &'a [Vec<usize>]) -> FitSide<'a> {
    FitSide { meshes: std::slice::from_ref(mesh), shapes, landmarks: &[], turn: DQuat::IDENTITY }
}

fn alone(count: usize) -> Vec<Vec<usize>> {
    (0..count).map(|index| vec![index]).collect()
}

fn assert_near(found: &[f64], wanted: &[f64], slack: f64) {
    assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < slack), "{found:?} for {wanted:?}");
}

#[test]
fn the_same_shapes_get_the_same_weights_in_whatever_order_and_size() {
    let (source, target) = (face(20, 1.0, &[LEFT, RIGHT, JAW]), face(20, 0.13, &[JAW, LEFT, RIGHT]));
    let shapes = alone(3);
    let fit = MorphFit::new(side(&source, &shapes), side(&target, &shapes), RULE).expect("a fit");
    assert!(fit.quality.is_same_topology && fit.quality.mean_distance_share < 1e-6, "{:?}", fit.quality);
    let given = [0.7, 0.1, 0.4];
    let weights = fit.weights(&given);
    assert_near(&weights, &[0.4, 0.7, 0.1], 1e-4);
    let (missed, all) = fit.missed(&weights, &given);
    assert!(missed < 1e-6 * all, "{missed} of {all}");
}

#[test]
fn faces_of_other_points_are_laid_over_each_other() {
    let (source, target) = (face(23, 1.0, &[LEFT, RIGHT, JAW]), face(31, 2.6, &[JAW, RIGHT, LEFT]));
    let moved = MorphMesh {
        positions: target.positions.iter().map(|position| *position + Vec3::new(0.4, 7.0, -3.0)).collect(),
        ..target
    };
    let shapes = alone(3);
    let fit = MorphFit::new(side(&source, &shapes), side(&moved, &shapes), RULE).expect("a fit");
    assert!(!fit.quality.is_same_topology, "{:?}", fit.quality);
    assert_near(&fit.weights(&[0.7, 0.1, 0.4]), &[0.4, 0.1, 0.7], 0.05);
}

#[test]
fn landmarks_lay_faces_over_each_other_that_move_in_other_places() {
    // One face only moves its jaw, the other one everything: what moves does not say where the jaw is.
    let (source, target) = (face(23, 1.0, &[JAW]), face(31, 2.0, &[LEFT, RIGHT, JAW]));
    let (one, three) = (alone(1), alone(3));
    let eyes = |size: f64| [(0, DVec3::new(-0.5, 0.5, 0.4) * size), (1, DVec3::new(0.5, 0.5, 0.4) * size)];
    let (here, there) = (eyes(1.0), eyes(2.0));
    let with = |source_eyes, target_eyes| {
        let source = FitSide { landmarks: source_eyes, ..side(&source, &one) };
        let target = FitSide { landmarks: target_eyes, ..side(&target, &three) };
        MorphFit::new(source, target, RULE).expect("a fit").weights(&[0.8])
    };
    assert_near(&with(&here, &there), &[0.0, 0.0, 0.8], 0.05);
}

#[test]
fn one_shape_for_two_and_two_for_one() {
    let source = face(20, 1.0, &[LEFT, RIGHT, JAW]);
    let both: Vec<Vec3> =
        source.displacements[0].iter().zip(&source.displacements[1]).map(|(left, right)| *left + *right).collect();
    let target = MorphMesh { displacements: vec![both, source.displacements[2].clone()], ..source.clone() };
    let (three, two) = (alone(3), alone(2));
    let fit = MorphFit::new(side(&source, &three), side(&target, &two), RULE).expect("a fit");
    assert_near(&fit.weights(&[0.6, 0.6, 0.0]), &[0.6, 0.0], 1e-3);
    let given = [0.6, 0.0, 0.0];
    let weights = fit.weights(&given);
    assert_near(&weights, &[0.3, 0.0], 0.01);
    let (missed, all) = fit.missed(&weights, &given);
    assert!((missed / all - 0.5).abs() < 0.02, "half of one lid cannot be met by both: {}", missed / all);

    let back = MorphFit::new(side(&target, &two), side(&source, &three), RULE).expect("a fit");
    assert_near(&back.weights(&[0.6, 0.2]), &[0.6, 0.6, 0.2], 1e-3);
}

#[test]
fn weights_keep_to_their_bounds_and_nothing_asks_for_nothing() {
    let mesh = face(20, 1.0, &[LEFT, RIGHT, JAW]);
    let shapes = alone(3);
    let fit = MorphFit::new(side(&mesh, &shapes), side(&mesh, &shapes), RULE).expect("a fit");
    assert_near(&fit.weights(&[1.5, -0.5, 0.5]), &[1.0, 0.0, 0.5], 1e-2);
    assert_eq!(fit.weights(&[0.0; 3]), [0.0; 3]);
    let flat = face(20, 1.0, &[(0.0, 0.0, Vec3::ZERO)]);
    assert!(MorphFit::new(side(&flat, &alone(1)), side(&mesh, &shapes), RULE).is_none(), "a face that cannot move");
}
