//! Which bone of the drawing each triangle of its mesh belongs to: the nearest, measured within the mesh.

use glam::DVec2;

use super::{PlanarRig, lattice::Lattice};

/// Points along a bone from which distances are measured.
const SEEDS: usize = 20;

/// For each joint of the rig the triangles that its bone, from its parent, carries along.
pub(super) fn triangles_of_joints(rig: &PlanarRig, mesh: &Lattice) -> Vec<Vec<[usize; 3]>> {
    let mut nearest: Vec<(f64, usize)> = vec![(f64::INFINITY, 0); mesh.vertices.len()];
    for (joint, parent) in rig.parents.iter().enumerate() {
        let Some(parent) = *parent else { continue };
        for seed in 0..SEEDS {
            let at = rig.rest[joint].lerp(rig.rest[parent], seed as f64 / SEEDS as f64);
            seed_vertices(at, joint, mesh, &mut nearest);
        }
    }
    spread(mesh, &mut nearest);
    let mut parts = vec![Vec::new(); rig.rest.len()];
    for &triangle in &mesh.triangles {
        let best = triangle.map(|vertex| nearest[vertex]).into_iter().min_by(|one, other| one.0.total_cmp(&other.0));
        parts[best.map_or(0, |best| best.1)].push(triangle);
    }
    parts
}

/// Starts from the vertex next to a point.
fn seed_vertices(at: DVec2, joint: usize, mesh: &Lattice, nearest: &mut [(f64, usize)]) {
    let distances = mesh.vertices.iter().map(|vertex| vertex.distance(at)).enumerate();
    if let Some((vertex, distance)) = distances.min_by(|one, other| one.1.total_cmp(&other.1))
        && distance < nearest[vertex].0
    {
        nearest[vertex] = (distance, joint);
    }
}

/// Distances along the edges of the mesh, until nothing becomes shorter.
fn spread(mesh: &Lattice, nearest: &mut [(f64, usize)]) {
    let mut has_changed = true;
    while has_changed {
        has_changed = false;
        for &[one, two, three] in &mesh.triangles {
            for (from, to) in [(one, two), (two, three), (three, one), (two, one), (three, two), (one, three)] {
                let distance = nearest[from].0 + mesh.vertices[from].distance(mesh.vertices[to]);
                if distance < nearest[to].0 {
                    nearest[to] = (distance, nearest[from].1);
                    has_changed = true;
                }
            }
        }
    }
}
