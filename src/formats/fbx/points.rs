//! The vertices of meshes, with the joints that move them: of skinned meshes, and of meshes that hang on joints.

use glam::{DVec3, Vec3};

use crate::{
    formats::{Budget, FormatError},
    model::{Influence, SkinVertices},
};

use super::nodes::Nodes;

/// Collects the vertices of all meshes that a skin deforms or a joint carries. Vertices that a damaged file binds but does not have
/// are left out.
///
/// # Errors
/// When there are more than the budget allows; or when the work is canceled.
pub(super) fn skin_vertices(
    file: &ufbx::Scene,
    nodes: &Nodes,
    budget: &mut Budget<'_>,
) -> Result<SkinVertices, FormatError> {
    let mut vertices = SkinVertices::default();
    for mesh in &file.meshes {
        for skin in &mesh.skin_deformers {
            budget.check_canceled()?;
            collect(mesh, skin, nodes, &mut vertices, budget)?;
        }
    }
    for mesh in file.meshes.into_iter().filter(|mesh| mesh.skin_deformers.is_empty()) {
        budget.check_canceled()?;
        collect_rigid(mesh, nodes, &mut vertices, budget)?;
    }
    Ok(vertices)
}

/// The vertices of one mesh: a cluster lists the vertices of a joint, so they are turned about first.
fn collect(
    mesh: &ufbx::Mesh,
    skin: &ufbx::SkinDeformer,
    nodes: &Nodes,
    vertices: &mut SkinVertices,
    budget: &mut Budget<'_>,
) -> Result<(), FormatError> {
    let count = mesh.vertices.len();
    let totals = weight_totals(mesh, skin, budget)?;
    let pairs: usize = skin.clusters.into_iter().map(|cluster| cluster.weights.len()).sum();
    budget.take_array(pairs as u64, 2 * size_of::<Influence>() as u64, "Objects")?;
    budget.take_array(count as u64, 2 * size_of::<u32>() as u64, "Objects")?;
    // How many influences each vertex has, then where its influences begin.
    let mut begins = vec![0_usize; count + 1];
    for cluster in &skin.clusters {
        for vertex in cluster.vertices.as_ref().iter().filter(|vertex| (**vertex as usize) < count) {
            begins[*vertex as usize + 1] += 1;
        }
    }
    for vertex in 0..count {
        begins[vertex + 1] += begins[vertex];
    }
    let mut next = begins.clone();
    let mut sorted = vec![Influence { joint: 0, weight: 0.0, position: Vec3::ZERO }; begins[count]];
    for cluster in &skin.clusters {
        let Some(joint) = cluster.bone_node.as_ref().and_then(|node| nodes.joint(node)) else { continue };
        let Ok(joint) = u32::try_from(joint) else { continue };
        for (vertex, weight) in cluster.vertices.as_ref().iter().zip(cluster.weights.as_ref()) {
            let vertex = *vertex as usize;
            let (Some(position), Some(total)) = (mesh.vertices.as_ref().get(vertex), totals.get(vertex)) else {
                continue;
            };
            // A share from 0 to 1.
            let weight = (weight / total) as f32;
            sorted[next[vertex]] =
                Influence { joint, weight, position: transform(&cluster.geometry_to_bone, position) };
            next[vertex] += 1;
        }
    }
    let mut influences = Vec::new();
    for vertex in 0..count {
        influences.clear();
        influences.extend_from_slice(&sorted[begins[vertex]..next[vertex]]);
        vertices.push(&mut influences, true);
    }
    Ok(())
}

/// A mesh without a skin moves with the joint that carries it alone.
fn collect_rigid(
    mesh: &ufbx::Mesh,
    nodes: &Nodes,
    vertices: &mut SkinVertices,
    budget: &mut Budget<'_>,
) -> Result<(), FormatError> {
    for node in &mesh.element.instances {
        let Some(joint) = nodes.joint(node).filter(|joint| nodes.is_carried(*joint)) else { continue };
        let Ok(joint) = u32::try_from(joint) else { continue };
        let vertex_size = size_of::<Influence>() + size_of::<u32>();
        budget.take_array(mesh.vertices.len() as u64, vertex_size as u64, "Objects")?;
        let mut influences = Vec::with_capacity(1);
        for position in mesh.vertices.as_ref() {
            influences.clear();
            influences.push(Influence { joint, weight: 1.0, position: transform(&node.geometry_to_node, position) });
            vertices.push(&mut influences, false);
        }
    }
    Ok(())
}

/// The sum of all weights of every vertex: files may leave it to the reader to make shares of them.
fn weight_totals(
    mesh: &ufbx::Mesh,
    skin: &ufbx::SkinDeformer,
    budget: &mut Budget<'_>,
) -> Result<Vec<f64>, FormatError> {
    let count = mesh.vertices.len();
    budget.take_array(count as u64, size_of::<f64>() as u64, "Objects")?;
    let mut totals = vec![0.0; count];
    for cluster in &skin.clusters {
        for (vertex, weight) in cluster.vertices.as_ref().iter().zip(cluster.weights.as_ref()) {
            if let Some(total) = totals.get_mut(*vertex as usize) {
                *total += weight;
            }
        }
    }
    Ok(totals)
}

fn transform(matrix: &ufbx::Matrix, point: &ufbx::Vec3) -> Vec3 {
    let x = DVec3::new(matrix.m00, matrix.m10, matrix.m20) * point.x;
    let y = DVec3::new(matrix.m01, matrix.m11, matrix.m21) * point.y;
    let z = DVec3::new(matrix.m02, matrix.m12, matrix.m22) * point.z;
    (x + y + z + DVec3::new(matrix.m03, matrix.m13, matrix.m23)).as_vec3()
}
