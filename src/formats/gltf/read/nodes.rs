//! The node graph: all nodes of the document, parents before children, with their rest transforms.

use glam::{DMat4, DQuat, DVec3};

use crate::{
    formats::{Budget, FormatError, Limit, gltf::json::Cursor},
    model::{Joint, Reporter, Transform},
};

/// The nodes in topological order.
#[derive(Debug, Default)]
pub(super) struct Graph {
    /// One per node, parents before children; no node is marked as a joint yet.
    pub(super) joints: Vec<Joint>,
    /// The place in `joints` of every node.
    pub(super) joint_of_node: Vec<usize>,
    /// Whether the node gives its transform as a matrix, per joint.
    pub(super) has_matrix: Vec<bool>,
    /// The joint at the top of the tree that a joint is in, per joint.
    pub(super) root_of: Vec<usize>,
    /// Whether viewers show the node: whether it is in the default scene, else in the first; per joint.
    pub(super) is_shown: Vec<bool>,
}

impl Graph {
    /// The joint of a node that the document refers to.
    pub(super) fn joint(&self, node: &Cursor<'_, '_>) -> Result<usize, FormatError> {
        Ok(self.joint_of_node[node.index(self.joint_of_node.len(), "nodes")?])
    }
}

/// A unit quaternion may be off by this much before we say so.
pub(super) const UNIT_TOLERANCE: f64 = 1e-3;

/// Reads `nodes`, and of `scenes` which of them are shown.
pub(super) fn read(root: &Cursor<'_, '_>, budget: &Budget<'_>, reporter: &mut Reporter) -> Result<Graph, FormatError> {
    let Some(nodes) = root.get("nodes")? else {
        shown_nodes(root, 0)?;
        return Ok(Graph::default());
    };
    let count = nodes.length()?;
    budget.check(Limit::Nodes, count as u64, "/nodes")?;
    let is_listed = shown_nodes(root, count)?;

    let mut parents: Vec<Option<usize>> = vec![None; count];
    let mut children: Vec<Vec<usize>> = Vec::with_capacity(count);
    for (index, node) in nodes.elements()?.enumerate() {
        let mut own = Vec::new();
        if let Some(list) = node.get("children")? {
            for entry in list.elements()? {
                let child = entry.index(count, "nodes")?;
                if let Some(other) = parents[child] {
                    return Err(entry.malformed(format!("node {child} is a child of node {other} already")));
                }
                parents[child] = Some(index);
                own.push(child);
            }
        }
        children.push(own);
    }

    let order = topological_order(&parents, &children, budget)?;
    let mut joint_of_node = vec![0; count];
    for (joint, node) in order.iter().enumerate() {
        joint_of_node[*node] = joint;
    }
    let mut graph = Graph { joint_of_node, ..Graph::default() };
    for node in order {
        let cursor = nodes.element(node)?;
        let parent = parents[node].map(|parent| graph.joint_of_node[parent]);
        let name = cursor.get("name")?.map_or(Ok(""), |name| name.text())?.to_owned();
        graph.root_of.push(parent.map_or(graph.joints.len(), |parent| graph.root_of[parent]));
        graph.is_shown.push(is_listed[node] || parent.is_some_and(|parent| graph.is_shown[parent]));
        graph.has_matrix.push(cursor.get("matrix")?.is_some());
        graph.joints.push(Joint { name, parent, rest: read_transform(&cursor, reporter)?, is_joint: false, node });
    }
    Ok(graph)
}

/// Depth first from the roots, in the order of the file.
fn topological_order(
    parents: &[Option<usize>],
    children: &[Vec<usize>],
    budget: &Budget<'_>,
) -> Result<Vec<usize>, FormatError> {
    let mut order = Vec::with_capacity(parents.len());
    let roots = (0..parents.len()).filter(|node| parents[*node].is_none());
    let mut open: Vec<(usize, u64)> = Vec::new();
    for root in roots {
        open.push((root, 1));
        while let Some((node, depth)) = open.pop() {
            if depth > budget.limits().hierarchy_depth {
                budget.check(Limit::HierarchyDepth, depth, &format!("/nodes/{node}"))?;
            }
            order.push(node);
            open.extend(children[node].iter().rev().map(|child| (*child, depth + 1)));
        }
    }
    if order.len() == parents.len() {
        return Ok(order);
    }
    // Every node has at most one parent, so what no root reaches is on a cycle or below one.
    let mut is_reached = vec![false; parents.len()];
    for node in &order {
        is_reached[*node] = true;
    }
    let mut node = is_reached.iter().position(|reached| !reached).unwrap_or(0);
    for _ in 0..parents.len() {
        node = parents[node].unwrap_or(node);
    }
    Err(FormatError::malformed("nodes", format!("/nodes/{node}/children"), format!("node {node} is its own ancestor")))
}

/// Whether each node is listed by the scene that viewers show: the default one, else the first. All are where there is no scene.
fn shown_nodes(root: &Cursor<'_, '_>, nodes: usize) -> Result<Vec<bool>, FormatError> {
    let mut lists: Vec<Vec<usize>> = Vec::new();
    if let Some(scenes) = root.get("scenes")? {
        for scene in scenes.elements()? {
            let list = scene.get("nodes")?;
            let entries = list.as_ref().map(Cursor::elements).transpose()?;
            let indices: Result<_, _> =
                entries.into_iter().flatten().map(|entry| entry.index(nodes, "nodes")).collect();
            lists.push(indices?);
        }
    }
    let default = root.get("scene")?.map_or(Ok(0), |scene| scene.index(lists.len(), "scenes"))?;
    let Some(list) = lists.get(default) else { return Ok(vec![true; nodes]) };
    let mut is_listed = vec![false; nodes];
    list.iter().for_each(|node| is_listed[*node] = true);
    Ok(is_listed)
}

fn read_transform(node: &Cursor<'_, '_>, reporter: &mut Reporter) -> Result<Transform, FormatError> {
    let parts = [node.get("translation")?, node.get("rotation")?, node.get("scale")?];
    if let Some(matrix) = node.get("matrix")? {
        if parts.iter().any(Option::is_some) {
            let detail = "the node has a matrix and a translation, rotation or scale; the matrix was used";
            reporter.warn("matrix_and_transform", node.to_string(), detail, "");
        }
        return read_matrix(&matrix, reporter);
    }
    let [translation, rotation, scale] = parts;
    let translation = translation.map_or(Ok([0.0; 3]), |value| value.numbers::<3>())?;
    let scale = scale.map_or(Ok([1.0; 3]), |value| value.numbers::<3>())?;
    let rotation = rotation.map_or(Ok(DQuat::IDENTITY), |value| read_rotation(&value, reporter))?;
    Ok(Transform { translation: DVec3::from_array(translation), rotation, scale: DVec3::from_array(scale) })
}

fn read_rotation(value: &Cursor<'_, '_>, reporter: &mut Reporter) -> Result<DQuat, FormatError> {
    let rotation = DQuat::from_array(value.numbers::<4>()?);
    let length = rotation.length();
    if length < f64::MIN_POSITIVE || !length.is_finite() {
        reporter.warn("rotation_zero", value.to_string(), "the rotation has no direction; none was taken instead", "");
        return Ok(DQuat::IDENTITY);
    }
    if (length - 1.0).abs() > UNIT_TOLERANCE {
        let detail = format!("the rotation has the length {length:.4} instead of 1; it was normalized");
        reporter.warn("rotation_not_unit", value.to_string(), detail, "");
    }
    // What is a unit quaternion already keeps its bits, so that reading what was written changes nothing.
    Ok(if (length - 1.0).abs() < 1e-12 { rotation } else { rotation / length })
}

fn read_matrix(value: &Cursor<'_, '_>, reporter: &mut Reporter) -> Result<Transform, FormatError> {
    let matrix = DMat4::from_cols_array(&value.numbers::<16>()?);
    let transform = Transform::from_matrix(&matrix);
    let largest = matrix.to_cols_array().into_iter().fold(1.0_f64, |most, number| most.max(number.abs()));
    if !transform.is_finite() || !transform.to_matrix().abs_diff_eq(matrix, largest * 1e-5) {
        let detail = "the matrix cannot be split into translation, rotation and scale (it shears or flattens); the nearest was taken";
        reporter.warn(
            "matrix_sheared",
            value.to_string(),
            detail,
            "apply the transform in the program that made the file",
        );
    }
    if transform.is_finite() { Ok(transform) } else { Err(value.malformed("the matrix cannot be decomposed")) }
}
