//! The nodes of the file as one forest, in topological order, and their rest transforms.

use std::collections::BTreeSet;

use glam::{DQuat, DVec3};

use crate::{
    formats::{Budget, FormatError, Limit},
    model::{Joint, Reporter, Skeleton, Transform},
};

/// Anything larger is no length or factor, and would become infinite as an f32.
const LARGEST: f64 = 1e30;
/// Shear that moves no joint by more than this part of the size is rounding.
const SHEAR: f64 = 1e-4;

/// Which of the parser's nodes is which joint of ours. The parser's own root is no joint.
#[derive(Debug)]
pub(super) struct Nodes {
    /// Index into the parser's nodes, per joint.
    node_of_joint: Vec<usize>,
    /// Joint, per node of the parser.
    joint_of_node: Vec<Option<usize>>,
    parents: Vec<Option<usize>>,
    rests: Vec<Transform>,
    is_joint: Vec<bool>,
}

impl Nodes {
    /// Walks the tree depth first, children in file order.
    ///
    /// # Errors
    /// When there are more nodes than the budget allows.
    pub(super) fn collect(
        file: &ufbx::Scene,
        budget: &mut Budget<'_>,
        reporter: &mut Reporter,
    ) -> Result<Self, FormatError> {
        let count = file.nodes.len();
        budget.take(Limit::Nodes, count as u64, "Objects")?;
        budget.take_array(count as u64, size_of::<Joint>() as u64, "Objects")?;
        let mut nodes = Self {
            node_of_joint: Vec::with_capacity(count),
            joint_of_node: vec![None; count],
            parents: Vec::with_capacity(count),
            rests: Vec::with_capacity(count),
            is_joint: Vec::with_capacity(count),
        };
        let bound = bound_nodes(file);
        let mut open: Vec<usize> = children_reversed(&file.root_node);
        while let Some(index) = open.pop() {
            let node = &file.nodes[index];
            if nodes.joint_of_node[index].is_some() {
                continue;
            }
            let parent = node.parent.as_ref().and_then(|parent| nodes.joint_of_node[id(parent)]);
            nodes.joint_of_node[index] = Some(nodes.node_of_joint.len());
            nodes.node_of_joint.push(index);
            nodes.parents.push(parent);
            nodes.rests.push(rest(node, reporter));
            nodes.is_joint.push(node.bone.is_some() || bound.contains(&index));
            open.extend(children_reversed(node));
        }
        Ok(nodes)
    }

    /// The joints for a skeleton.
    pub(super) fn joints(&self, file: &ufbx::Scene) -> Vec<Joint> {
        (0..self.len())
            .map(|joint| Joint {
                name: self.node(file, joint).element.name.to_string(),
                parent: self.parents[joint],
                rest: self.rests[joint],
                is_joint: self.is_joint[joint],
                node: joint,
            })
            .collect()
    }

    /// How many joints there are.
    pub(super) fn len(&self) -> usize {
        self.node_of_joint.len()
    }

    /// The parser's node of a joint.
    pub(super) fn node<'a>(&self, file: &'a ufbx::Scene, joint: usize) -> &'a ufbx::Node {
        &file.nodes.as_ref()[self.node_of_joint[joint]]
    }

    /// The joint of a parser's node; nothing for its root.
    pub(super) fn joint(&self, node: &ufbx::Node) -> Option<usize> {
        self.joint_of_node.get(id(node)).copied().flatten()
    }

    /// Whether a node is a joint or hangs on one.
    pub(super) fn is_carried(&self, joint: usize) -> bool {
        std::iter::successors(Some(joint), |joint| self.parents[*joint]).any(|joint| self.is_joint[joint])
    }

    /// The parent of a joint.
    pub(super) fn parent(&self, joint: usize) -> Option<usize> {
        self.parents[joint]
    }

    /// The rest transform of a joint.
    pub(super) fn rest(&self, joint: usize) -> Transform {
        self.rests[joint]
    }

    /// Whether the file says that this node is a joint.
    pub(super) fn is_joint(&self, joint: usize) -> bool {
        self.is_joint[joint]
    }
}

/// The transform of a node as the parser gives it, in our types; not yet checked, not yet free of scale inheritance.
pub(super) fn transform(transform: &ufbx::Transform) -> Transform {
    let ufbx::Transform { translation, rotation, scale } = transform;
    Transform {
        translation: DVec3::new(translation.x, translation.y, translation.z),
        rotation: DQuat::from_xyzw(rotation.x, rotation.y, rotation.z, rotation.w),
        scale: DVec3::new(scale.x, scale.y, scale.z),
    }
}

/// Whether every number is one that an f32 can hold.
pub(super) fn is_sane(transform: &Transform) -> bool {
    transform.is_finite()
        && transform.translation.abs().max_element() < LARGEST
        && transform.scale.abs().max_element() < LARGEST
        && transform.rotation.length_squared() > 0.5
}

/// Whether the file has shear, which [`Transform`] cannot hold: a scale that differs by axis above turned joints.
pub(super) fn is_sheared(file: &ufbx::Scene, nodes: &Nodes, skeleton: &Skeleton) -> bool {
    let (distance, size, _) = farthest_off(file, nodes, skeleton);
    distance > size * SHEAR
}

/// Warns where joints are not where the file has them.
pub(super) fn report_shear(file: &ufbx::Scene, nodes: &Nodes, skeleton: &Skeleton, reporter: &mut Reporter) {
    let (distance, size, joint) = farthest_off(file, nodes, skeleton);
    if distance > size * SHEAR {
        reporter.warn(
            "shear_lost",
            skeleton.label(joint),
            format!(
                "a scale that differs by axis lies above turned joints; without its shear this one is {:.2} % of the \
                 character's size away from where the file has it",
                distance / size * 100.0
            ),
            "apply the scale of the armature before exporting",
        );
    }
}

/// How far the joint that is farthest from where the parser has it is from there, the size of the character, and which joint it is.
fn farthest_off(file: &ufbx::Scene, nodes: &Nodes, skeleton: &Skeleton) -> (f64, f64, usize) {
    let model = skeleton.rest_pose().to_model(skeleton);
    let mut worst = (0.0_f64, 0);
    let mut size = f64::MIN_POSITIVE;
    for (joint, ours) in model.transforms().iter().enumerate() {
        let world = &nodes.node(file, joint).node_to_world;
        let position = DVec3::new(world.m03, world.m13, world.m23);
        let distance = position.distance(ours.translation);
        size = size.max(position.length());
        if distance.is_finite() && distance > worst.0 {
            worst = (distance, joint);
        }
    }
    (worst.0, size, worst.1)
}

/// Whether a node does not inherit the scale of its parent (Maya's segment scale compensation).
pub(super) const fn ignores_parent_scale(node: &ufbx::Node) -> bool {
    matches!(node.inherit_mode, ufbx::InheritMode::IgnoreParentScale)
}

/// Takes the parent's own scale out of a child's. Scales compose component by component here, which is what the other
/// two inheritance modes of FBX need as they stand; a parent scaled to nothing cannot be undone and is left in.
pub(super) fn without_parent_scale(scale: DVec3, parent_scale: DVec3) -> DVec3 {
    let undo = |factor: f64, parent: f64| if parent == 0.0 { factor } else { factor / parent };
    DVec3::new(undo(scale.x, parent_scale.x), undo(scale.y, parent_scale.y), undo(scale.z, parent_scale.z))
}

fn rest(node: &ufbx::Node, reporter: &mut Reporter) -> Transform {
    let mut rest = transform(&node.local_transform);
    if !is_sane(&rest) {
        reporter.warn(
            "rest_not_finite",
            node.element.name.to_string(),
            "the node's transform holds numbers that are not finite or absurdly large; it was replaced by no transform",
            "export the file again",
        );
        rest = Transform::IDENTITY;
    }
    rest.rotation = rest.rotation.normalize();
    if ignores_parent_scale(node)
        && let Some(parent) = node.parent.as_ref().filter(|parent| !parent.is_root)
    {
        let parent_scale = transform(&parent.local_transform).scale;
        if parent_scale.is_finite() {
            rest.scale = without_parent_scale(rest.scale, parent_scale);
        }
    }
    rest
}

fn bound_nodes(file: &ufbx::Scene) -> BTreeSet<usize> {
    file.skin_clusters.into_iter().filter_map(|cluster| cluster.bone_node.as_ref()).map(|node| id(node)).collect()
}

fn children_reversed(node: &ufbx::Node) -> Vec<usize> {
    let mut children: Vec<usize> = node.children.into_iter().map(id).collect();
    children.reverse();
    children
}

/// A node's index in the parser's list.
const fn id(node: &ufbx::Node) -> usize {
    node.element.typed_id as usize
}
