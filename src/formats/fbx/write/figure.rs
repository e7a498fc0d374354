//! The nodes that are written, and how their angles are.

use glam::{DQuat, DVec3};

use crate::{formats::euler::EulerOrder, model::Skeleton};

/// FBX's X, Y, Z: the rotation about X is applied first.
pub(super) const USUAL_ORDER: EulerOrder = EulerOrder::ZYX;
/// Ids of nodes count from here, those of their attributes from [`FIRST_ATTRIBUTE_ID`].
const FIRST_NODE_ID: i64 = 1 << 20;
const FIRST_ATTRIBUTE_ID: i64 = 1 << 30;

/// The nodes that are written.
pub(super) struct Figure<'a> {
    pub(super) skeleton: &'a Skeleton,
    pub(super) nodes: Vec<LimbNode>,
    /// Centimeters per unit of the scene.
    pub(super) centimeters: f64,
}

/// A node of the file.
pub(super) struct LimbNode {
    /// Joint of the skeleton.
    pub(super) joint: usize,
    pub(super) id: i64,
    pub(super) attribute_id: i64,
    /// The id of the node above, 0 for the scene's own root.
    pub(super) parent_id: i64,
    pub(super) is_limb: bool,
    pub(super) pre_rotation: DQuat,
    /// Of the node's own angles; those before them are always in the usual one.
    pub(super) order: EulerOrder,
}

impl LimbNode {
    /// What FBX calls the order: the rotation that is named first is applied first.
    pub(super) fn rotation_order(&self) -> i32 {
        const NAMES: [&str; 6] = ["XYZ", "XZY", "YZX", "YXZ", "ZXY", "ZYX"];
        let name: String = self.order.name().chars().rev().collect();
        NAMES.iter().position(|known| *known == name).map_or(0, |index| index as i32)
    }
}

/// The id of a joint's node.
pub(super) const fn node_id(joint: usize) -> i64 {
    FIRST_NODE_ID + joint as i64
}

impl<'a> Figure<'a> {
    pub(super) fn new(skeleton: &'a Skeleton, joints: &[usize], centimeters: f64) -> Self {
        let nodes = joints.iter().map(|joint| {
            let joint = *joint;
            LimbNode {
                joint,
                id: node_id(joint),
                attribute_id: FIRST_ATTRIBUTE_ID + joint as i64,
                parent_id: skeleton.parent(joint).map_or(0, node_id),
                is_limb: skeleton.joints()[joint].is_joint,
                pre_rotation: skeleton.joints()[joint].rest.rotation,
                order: USUAL_ORDER,
            }
        });
        Self { skeleton, nodes: nodes.collect(), centimeters }
    }

    /// What a node is called; nobody can tell nameless ones apart.
    pub(super) fn name(&self, node: &LimbNode) -> String {
        let name = &self.skeleton.joints()[node.joint].name;
        if name.is_empty() { format!("joint_{}", node.joint) } else { name.clone() }
    }
}

pub(super) fn degrees(angles: [f64; 3]) -> DVec3 {
    DVec3::from_array(angles.map(f64::to_degrees))
}
