//! The vertices of meshes, with the joints that move them: of skinned meshes, and of meshes that hang on a skin's joints.
//!
//! Nothing here is an error but cancellation: a mesh that cannot be decoded costs its points, and the file says so. Every set of
//! vertex arrays is decoded once per skin or node, however many primitives share it.

use std::collections::BTreeSet;

use glam::{Vec3, Vec4};

use super::{
    accessor::{Accessor, Accessors, Shape},
    nodes::Graph,
    skins::Skins,
};
use crate::{
    formats::{Budget, ErrorKind, FormatError, gltf::json::Cursor},
    model::{Influence, Reporter, SkinPoints, SkinVertices},
};

/// Sets of four joints per vertex; nothing in the field has more.
const MAX_SETS: usize = 4;
/// Influences of one set.
const PER_SET: usize = 4;

const DRACO: &str = "KHR_draco_mesh_compression";

/// Collects the vertices of all meshes that a node binds to a skin or that hang on its joints, and counts the joints that move each vertex: skins whose meshes
/// can all be decoded learn how many there are at most, the others keep what their arrays have room for.
pub(super) fn read(
    accessors: &mut Accessors<'_>,
    graph: &Graph,
    skins: &mut Skins,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<SkinVertices, FormatError> {
    if skins.skins.is_empty() {
        return Ok(SkinVertices::default());
    }
    let influences = vec![Some(0); skins.skins.len()];
    let mut collector =
        Collector { skins: &*skins, graph, vertices: SkinVertices::default(), seen: BTreeSet::new(), influences };
    match collector.read(accessors, budget, reporter) {
        Err(error) if error.kind == ErrorKind::Canceled => return Err(error),
        Err(error) => {
            warn(reporter, &error);
            collector.influences.fill(None);
        }
        Ok(()) => {}
    }
    let Collector { vertices, influences, .. } = collector;
    for (skin, counted) in skins.skins.iter_mut().zip(influences) {
        skin.most_influences = counted.filter(|most| *most > 0).unwrap_or(skin.most_influences);
    }
    Ok(vertices)
}

struct Collector<'s> {
    skins: &'s Skins,
    graph: &'s Graph,
    vertices: SkinVertices,
    /// Skin and accessors of what has been decoded.
    seen: BTreeSet<(usize, Vec<usize>)>,
    /// The most joints that move one vertex, per skin; nothing where a mesh of it cannot be decoded.
    influences: Vec<Option<usize>>,
}

impl Collector<'_> {
    fn read(
        &mut self,
        accessors: &mut Accessors<'_>,
        budget: &mut Budget<'_>,
        reporter: &mut Reporter,
    ) -> Result<(), FormatError> {
        let root = accessors.root();
        let (Some(nodes), Some(meshes)) = (root.get("nodes")?, root.get("meshes")?) else { return Ok(()) };
        let mesh_count = meshes.length()?;
        let is_carried = self.carried();
        let mut rigid = Vec::new();
        for (index, node) in nodes.elements()?.enumerate() {
            let Some(mesh) = node.get("mesh")? else { continue };
            let joint = self.graph.joint_of_node[index];
            let Some(skin) = node.get("skin")? else {
                rigid.extend(
                    mesh.index(mesh_count, "meshes").ok().filter(|_| is_carried[joint]).map(|mesh| (joint, mesh)),
                );
                continue;
            };
            let skin = skin.index(self.skins.skins.len(), "skins")?;
            if self.skins.joint_from_mesh[skin].is_empty() {
                self.influences[skin] = None;
                continue;
            }
            let mesh = meshes.element(mesh.index(mesh_count, "meshes")?)?;
            let Some(primitives) = mesh.get("primitives")? else { continue };
            for primitive in primitives.elements()? {
                budget.check_canceled()?;
                match self.read_primitive(&primitive, skin, accessors, budget, reporter) {
                    Err(error) if error.kind == ErrorKind::Canceled => return Err(error),
                    Err(error) => {
                        warn(reporter, &error);
                        self.influences[skin] = None;
                    }
                    Ok(()) => {}
                }
            }
        }
        for (joint, mesh) in rigid {
            let mesh = meshes.element(mesh)?;
            let Some(primitives) = mesh.get("primitives")? else { continue };
            let mut seen = BTreeSet::new();
            for primitive in primitives.elements()? {
                budget.check_canceled()?;
                match self.read_rigid(&primitive, joint, &mut seen, accessors, budget) {
                    Err(error) if error.kind == ErrorKind::Canceled => return Err(error),
                    Err(error) => warn(reporter, &error),
                    Ok(()) => {}
                }
            }
        }
        Ok(())
    }

    /// Whether a joint of a skin carries a node or is it, per joint of the scene.
    fn carried(&self) -> Vec<bool> {
        let mut is_carried = vec![false; self.graph.joints.len()];
        self.skins.skins.iter().flat_map(|skin| &skin.joints).for_each(|joint| is_carried[*joint] = true);
        for (index, joint) in self.graph.joints.iter().enumerate() {
            is_carried[index] |= joint.parent.is_some_and(|parent| is_carried[parent]);
        }
        is_carried
    }

    /// A mesh without a skin moves with its node alone.
    fn read_rigid(
        &mut self,
        primitive: &Cursor<'_, '_>,
        joint: usize,
        seen: &mut BTreeSet<usize>,
        accessors: &mut Accessors<'_>,
        budget: &mut Budget<'_>,
    ) -> Result<(), FormatError> {
        let Some(attributes) = primitive.get("attributes")? else { return Ok(()) };
        let Some(place) = attributes.get("POSITION")? else { return Ok(()) };
        let position = accessors.accessor(&place)?;
        let Ok(joint) = u32::try_from(joint) else { return Ok(()) };
        if !seen.insert(position.index) {
            return Ok(());
        }
        check_data(&position, primitive)?;
        position.expect(Shape::Vec3, false, &place)?;
        let positions: Vec<Vec3> = accessors.decode(&position, position.count, &place, budget)?;
        let vertex_size = (size_of::<Influence>() + size_of::<u32>()) as u64;
        budget.take_array(positions.len() as u64, vertex_size, "/meshes")?;
        let mut influences = Vec::with_capacity(1);
        for position in positions {
            influences.clear();
            influences.push(Influence { joint, weight: 1.0, position });
            self.vertices.push(&mut influences, false);
        }
        Ok(())
    }

    fn read_primitive(
        &mut self,
        primitive: &Cursor<'_, '_>,
        skin: usize,
        accessors: &mut Accessors<'_>,
        budget: &mut Budget<'_>,
        reporter: &mut Reporter,
    ) -> Result<(), FormatError> {
        let Some(attributes) = primitive.get("attributes")? else { return Ok(()) };
        let Some(place) = attributes.get("POSITION")? else { return Ok(()) };
        let position = accessors.accessor(&place)?;
        let mut sets: Vec<(Accessor, Accessor)> = Vec::new();
        for set in 0..MAX_SETS {
            let (joints, weights) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
            let (Some(joints), Some(weights)) = (attributes.get(&joints)?, attributes.get(&weights)?) else { break };
            sets.push((accessors.accessor(&joints)?, accessors.accessor(&weights)?));
        }
        if sets.is_empty() {
            return Ok(());
        }
        check_data(&position, primitive)?;
        let arrays = sets.iter().flat_map(|(joints, weights)| [joints.index, weights.index]);
        if !self.seen.insert((skin, std::iter::once(position.index).chain(arrays).collect())) {
            return Ok(());
        }
        position.expect(Shape::Vec3, false, &place)?;
        let count = position.count;
        let positions: Vec<Vec3> = accessors.decode(&position, count, &place, budget)?;
        let mut decoded: Vec<(Vec<Vec4>, Vec<Vec4>)> = Vec::with_capacity(sets.len());
        for (joints, weights) in sets {
            joints.expect(Shape::Vec4, false, &attributes)?;
            weights.expect(Shape::Vec4, false, &attributes)?;
            let joints = accessors.decode(&joints, count, &attributes, budget)?;
            decoded.push((joints, accessors.decode(&weights, count, &attributes, budget)?));
        }
        let vertex_size = PER_SET * decoded.len() * size_of::<Influence>() + size_of::<u32>();
        budget.take_array(count as u64, vertex_size.min(SkinVertices::MAX_VERTEX_BYTES) as u64, "/meshes")?;
        let (most, left_out) = self.collect(skin, &positions, &decoded);
        if left_out > 0 {
            let detail = format!("{left_out} vertices are bound to joints that the skin does not have");
            warn(reporter, &attributes.malformed(detail));
        }
        if let Some(counted) = &mut self.influences[skin] {
            *counted = (*counted).max(most);
        }
        Ok(())
    }

    /// Returns how many joints move one vertex at most, and how many vertices name a joint that there is not.
    fn collect(&mut self, skin: usize, positions: &[Vec3], sets: &[(Vec<Vec4>, Vec<Vec4>)]) -> (usize, usize) {
        let (joint_from_mesh, skin) = (&self.skins.joint_from_mesh[skin], &self.skins.skins[skin]);
        let (mut most, mut left_out) = (0, 0);
        let mut influences = Vec::with_capacity(sets.len() * PER_SET);
        for (vertex, position) in positions.iter().enumerate() {
            influences.clear();
            let mut count = 0;
            for (joints, weights) in sets {
                for (slot, weight) in joints[vertex].to_array().into_iter().zip(weights[vertex].to_array()) {
                    if weight <= 0.0 || weight.is_nan() {
                        continue;
                    }
                    count += 1;
                    // It was an integer.
                    let slot = slot as usize;
                    let (Some(matrix), Some(&joint)) = (joint_from_mesh.get(slot), skin.joints.get(slot)) else {
                        left_out += usize::from(weight >= SkinPoints::MIN_WEIGHT);
                        continue;
                    };
                    let position = matrix.transform_point3(*position);
                    // The limit of nodes is far below.
                    influences.push(Influence { joint: joint as u32, weight, position });
                }
            }
            most = most.max(count);
            self.vertices.push(&mut influences, true);
        }
        (most, left_out)
    }
}

fn check_data(position: &Accessor, primitive: &Cursor<'_, '_>) -> Result<(), FormatError> {
    if position.has_data() {
        return Ok(());
    }
    let compressed = primitive.get("extensions")?.is_some_and(|all| matches!(all.get(DRACO), Ok(Some(_))));
    let with = if compressed { "is compressed with Draco, which is not decoded" } else { "has no data" };
    let detail = format!("the mesh {with}; its shape is not known");
    Err(FormatError::unsupported("meshes", primitive.to_string(), detail, ""))
}

fn warn(reporter: &mut Reporter, error: &FormatError) {
    reporter.warn(
        "skin_points_unreadable",
        error.place.as_str(),
        format!("{}; hands, feet and soles are judged without it", error.detail),
        "export the mesh without that compression or damage if the feet or hands come out turned",
    );
}
