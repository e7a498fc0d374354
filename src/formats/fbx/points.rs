//! The vertices of skinned meshes, by the joints that move them.

use glam::{DVec3, Vec3};

use crate::{
    formats::{Budget, FormatError},
    model::{SkinPoint, SkinPoints},
};

use super::nodes::Nodes;

/// Collects the points of all meshes that a skin deforms. Vertices that a damaged file binds but does not have are left out.
///
/// # Errors
/// When there are more than the budget allows; or when the work is canceled.
pub(super) fn skin_points(
    file: &ufbx::Scene,
    nodes: &Nodes,
    budget: &mut Budget<'_>,
) -> Result<SkinPoints, FormatError> {
    let mut entries: Vec<(u32, SkinPoint)> = Vec::new();
    for mesh in &file.meshes {
        for skin in &mesh.skin_deformers {
            budget.check_canceled()?;
            let totals = weight_totals(mesh, skin, budget)?;
            for cluster in &skin.clusters {
                let Some(joint) = cluster.bone_node.as_ref().and_then(|node| nodes.joint(node)) else { continue };
                let Ok(joint) = u32::try_from(joint) else { continue };
                let weights = cluster.weights.as_ref();
                budget.take_array(weights.len() as u64, size_of::<(u32, SkinPoint)>() as u64, "Objects")?;
                for (vertex, weight) in cluster.vertices.as_ref().iter().zip(weights) {
                    let vertex = *vertex as usize;
                    let (Some(position), Some(total)) = (mesh.vertices.as_ref().get(vertex), totals.get(vertex)) else {
                        continue;
                    };
                    #[expect(clippy::cast_possible_truncation, reason = "a share from 0 to 1")]
                    let weight = (weight / total) as f32;
                    if weight >= SkinPoints::LEAST_WEIGHT {
                        let position = transform(&cluster.geometry_to_bone, position);
                        entries.push((joint, SkinPoint { position, weight }));
                    }
                }
            }
        }
    }
    Ok(SkinPoints::new(nodes.len(), &entries))
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
