//! Skins, the pose that they were bound in, and the roles that a HumanIK characterization declares.

use std::collections::BTreeSet;

use glam::{DMat4, DVec3};

use crate::model::{Reporter, Skeleton, Skin, Transform};

use super::nodes::Nodes;

/// Bind positions of one joint in two skins that are further apart than this part of the skeleton's size disagree.
const DISAGREEMENT: f64 = 1e-3;

/// One entry per skin deformer, named after the mesh that it deforms.
pub(super) fn skins(file: &ufbx::Scene, nodes: &Nodes) -> Vec<Skin> {
    file.skin_deformers
        .into_iter()
        .map(|deformer| {
            let mut seen = BTreeSet::new();
            let bound = deformer.clusters.into_iter().filter_map(|cluster| nodes.joint(cluster.bone_node.as_ref()?));
            let joints = bound.filter(|joint| seen.insert(*joint)).collect();
            let most_influences = deformer.max_weights_per_vertex;
            Skin { name: mesh_name(deformer), joints, most_influences, ..Skin::default() }
        })
        .filter(|skin| !skin.joints.is_empty())
        .collect()
}

fn mesh_name(deformer: &ufbx::SkinDeformer) -> String {
    let mesh = deformer
        .element
        .connections_src
        .iter()
        .find(|connection| matches!(connection.dst.type_, ufbx::ElementType::Mesh));
    let Some(mesh) = mesh else { return deformer.element.name.to_string() };
    let instance = mesh.dst.instances.into_iter().next();
    instance.map_or_else(|| mesh.dst.name.to_string(), |node| node.element.name.to_string())
}

/// `model_from_joint` in the bind pose: what the skin clusters say, else what the file's bind pose says, per joint.
pub(super) fn bind_pose(
    file: &ufbx::Scene,
    nodes: &Nodes,
    skeleton: &Skeleton,
    reporter: &mut Reporter,
) -> Vec<Option<Transform>> {
    let mut bind: Vec<Option<Transform>> = vec![None; nodes.len()];
    let size = extent(skeleton);
    for cluster in &file.skin_clusters {
        let Some(joint) = cluster.bone_node.as_ref().and_then(|node| nodes.joint(node)) else { continue };
        let Some(transform) = rigid(&cluster.bind_to_world) else { continue };
        match &bind[joint] {
            None => bind[joint] = Some(transform),
            Some(first) if first.translation.distance(transform.translation) > size * DISAGREEMENT => reporter.warn(
                "bind_poses_differ",
                nodes.node(file, joint).element.name.to_string(),
                "the skins bind this joint in different places; the first one is taken",
                "give a T-pose file as the rest pose if the result looks wrong",
            ),
            Some(_) => {}
        }
    }
    for pose in file.poses.into_iter().filter(|pose| pose.is_bind_pose) {
        for bone in &pose.bone_poses {
            let Some(joint) = nodes.joint(&bone.bone_node) else { continue };
            if bind[joint].is_none() && nodes.is_joint(joint) {
                bind[joint] = rigid(&bone.bone_to_world);
            }
        }
    }
    if bind.iter().all(Option::is_none) { Vec::new() } else { bind }
}

/// Roles by the names of HumanIK (`LeftForeArm`), in the order of the file.
pub(super) fn declared_roles(file: &ufbx::Scene, nodes: &Nodes) -> Vec<(String, usize)> {
    let Some(character) = file.characters.into_iter().next() else { return Vec::new() };
    let mut roles = Vec::new();
    for connection in &character.element.connections_dst {
        let Some(role) = connection.dst_prop.strip_suffix("Link") else { continue };
        if !matches!(connection.src.type_, ufbx::ElementType::Node) {
            continue;
        }
        let node = file.nodes.as_ref().get(connection.src.typed_id as usize);
        if let Some(joint) = node.and_then(|node| nodes.joint(node)) {
            roles.push((role.to_owned(), joint));
        }
    }
    roles
}

/// The matrix as a transform; nothing where it is not finite or flattens space.
fn rigid(matrix: &ufbx::Matrix) -> Option<Transform> {
    let columns = [
        DVec3::new(matrix.m00, matrix.m10, matrix.m20),
        DVec3::new(matrix.m01, matrix.m11, matrix.m21),
        DVec3::new(matrix.m02, matrix.m12, matrix.m22),
        DVec3::new(matrix.m03, matrix.m13, matrix.m23),
    ];
    let [x, y, z, translation] = columns;
    let matrix = DMat4::from_cols(x.extend(0.0), y.extend(0.0), z.extend(0.0), translation.extend(1.0));
    let lengths = x.length() * y.length() * z.length();
    let solid = matrix.is_finite() && lengths.is_finite() && matrix.determinant().abs() > lengths * 1e-9;
    solid.then(|| Transform::from_matrix(&matrix)).filter(Transform::is_finite)
}

fn extent(skeleton: &Skeleton) -> f64 {
    let pose = skeleton.rest_pose().to_model(skeleton);
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for transform in pose.transforms() {
        low = low.min(transform.translation);
        high = high.max(transform.translation);
    }
    let size = (high - low).length();
    if size.is_finite() { size } else { 0.0 }
}
