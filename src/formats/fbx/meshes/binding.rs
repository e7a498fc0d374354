//! Which joints move the vertices of a mesh, and by how much.

use std::collections::BTreeMap;

use glam::DMat4;

use crate::{
    formats::meshes::{Binding, FourInfluences},
    model::{ModelPose, Skeleton},
};

use super::{
    super::{FbxDocument, geometry::matrix},
    TooLarge, Work, is_solid,
};

/// More joints at one vertex than most programs know; what the others weigh next to these is not seen.
const MAX_INFLUENCES: usize = 8;

/// The world in which a mesh was bound, from its geometry; nothing where it is bound to no joint.
pub(super) fn space(document: &FbxDocument, skin: &ufbx::SkinDeformer) -> Option<DMat4> {
    let bound = skin.clusters.iter().filter(|cluster| joint_of(document, cluster).is_some());
    let worlds = bound.map(|cluster| matrix(&cluster.bind_to_world) * matrix(&cluster.geometry_to_bone));
    let mut first = None;
    for world in worlds {
        if is_solid(&world) {
            return Some(world);
        }
        first = first.or(Some(DMat4::IDENTITY));
    }
    first
}

fn joint_of(document: &FbxDocument, cluster: &ufbx::SkinCluster) -> Option<usize> {
    cluster.bone_node.as_ref().and_then(|node| document.nodes.joint(node))
}

/// The binding of these vertices of a mesh, whose space is `space`. What no joint moves goes with the node that wears the mesh, or where
/// that is in another tree with the top of the joints.
pub(super) fn binding(
    work: &mut Work<'_>,
    (wearer, node, mesh): (usize, &ufbx::Node, &ufbx::Mesh),
    skin: &ufbx::SkinDeformer,
    space: &DMat4,
    vertices: &[u32],
) -> Result<Option<Binding>, TooLarge> {
    use ufbx::SkinningMethod::{BlendedDqLinear, DualQuaternion};
    if matches!(skin.skinning_method, DualQuaternion | BlendedDqLinear) {
        work.lost.note("skinning by dual quaternions (it is linear there)", &node.element.name);
    }
    let weights: usize = skin.clusters.iter().map(|cluster| cluster.weights.len()).sum();
    work.take(weights, size_of::<(u32, u16, f64)>())?;
    let vertex_from_geometry = space.inverse();
    let (mut joints, mut slots) = (Vec::new(), BTreeMap::new());
    // Vertex of the mesh, weight, place in the list of joints.
    let mut entries: Vec<(u32, f64, u16)> = Vec::with_capacity(weights);
    for cluster in &skin.clusters {
        let Some(joint) = joint_of(work.document, cluster) else { continue };
        let from_vertex = matrix(&cluster.geometry_to_bone) * vertex_from_geometry;
        let slot = slot_of(&mut joints, &mut slots, joint, from_vertex);
        let Some(slot) = slot else { continue };
        let of_cluster = cluster.vertices.iter().zip(cluster.weights.iter());
        let counts = of_cluster.filter(|(vertex, weight)| (**vertex as usize) < mesh.vertices.len() && **weight > 0.0);
        entries.extend(counts.map(|(vertex, weight)| (*vertex, *weight, slot)));
    }
    let Some((first, _)) = joints.first().copied() else { return Ok(None) };
    // By vertex, the heaviest first.
    entries.sort_by(|one, other| one.0.cmp(&other.0).then(other.1.total_cmp(&one.1)).then(one.2.cmp(&other.2)));
    let of_vertex = |vertex: u32| {
        let begin = entries.partition_point(|entry| entry.0 < vertex);
        let end = begin + entries[begin..].partition_point(|entry| entry.0 == vertex);
        &entries[begin..end]
    };
    let most = vertices.iter().map(|vertex| of_vertex(*vertex).len()).max().unwrap_or(0);
    if most > MAX_INFLUENCES {
        work.lost.note("the weights of all but the heaviest 8 joints at a vertex", &node.element.name);
    }
    let sets = most.clamp(1, MAX_INFLUENCES).div_ceil(4);
    work.take(vertices.len(), sets * size_of::<FourInfluences>())?;
    let mut loose = None;
    if vertices.iter().any(|vertex| of_vertex(*vertex).is_empty()) {
        let from_vertex = matrix(&node.geometry_to_node) * vertex_from_geometry;
        let (joint, from_wearer) = anchor(&work.target.skeleton, &work.rest, wearer, first);
        loose = slot_of(&mut joints, &mut slots, joint, from_wearer * from_vertex);
    }
    let mut influences = vec![Vec::with_capacity(vertices.len()); sets];
    for vertex in vertices {
        let found = &of_vertex(*vertex)[..of_vertex(*vertex).len().min(MAX_INFLUENCES)];
        let mut fours = [FourInfluences::default(); MAX_INFLUENCES / 4];
        if found.is_empty() {
            fours[0] = FourInfluences { joints: [loose.unwrap_or(0), 0, 0, 0], shares: [1.0, 0.0, 0.0, 0.0] };
        }
        let total: f64 = found.iter().map(|entry| entry.1).sum();
        let mut others = 0.0_f32;
        for (index, (_, weight, slot)) in found.iter().enumerate().skip(1) {
            let share = (weight / total) as f32;
            // What rounds to nothing names no joint either.
            if share > 0.0 {
                fours[index / 4].joints[index % 4] = *slot;
                fours[index / 4].shares[index % 4] = share;
                others += share;
            }
        }
        if let Some((_, _, slot)) = found.first() {
            // So that all are 1 together to the last digit.
            (fours[0].joints[0], fours[0].shares[0]) = (*slot, 1.0 - others);
        }
        influences.iter_mut().zip(fours).for_each(|(set, four)| set.push(four));
    }
    Ok(Some(Binding { name: skin.element.name.to_string(), joints, influences }))
}

/// The place of a joint in the list, which it is added to; nothing where that is full.
fn slot_of(
    joints: &mut Vec<(usize, DMat4)>,
    slots: &mut BTreeMap<usize, u16>,
    joint: usize,
    from_vertex: DMat4,
) -> Option<u16> {
    if let Some(slot) = slots.get(&joint) {
        return Some(*slot);
    }
    let slot = u16::try_from(joints.len()).ok().filter(|_| from_vertex.is_finite())?;
    joints.push((joint, from_vertex));
    slots.insert(joint, slot);
    Some(slot)
}

/// What vertices go with that no joint moves, and where the node that wears them lies about it at rest.
fn anchor(skeleton: &Skeleton, rest: &ModelPose, wearer: usize, joint: usize) -> (usize, DMat4) {
    let top = |joint: usize| {
        let mut top = joint;
        while let Some(parent) = skeleton.parent(top) {
            top = parent;
        }
        top
    };
    let of_joints = top(joint);
    if top(wearer) == of_joints {
        return (wearer, DMat4::IDENTITY);
    }
    let world = |joint: usize| rest.transforms()[joint].to_matrix();
    let from_wearer = world(of_joints).inverse() * world(wearer);
    (of_joints, if from_wearer.is_finite() { from_wearer } else { DMat4::IDENTITY })
}
