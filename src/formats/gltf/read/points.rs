//! The vertices of skinned meshes, by the joints that move them.
//!
//! Nothing here is an error but cancellation: a mesh that cannot be decoded costs its points, and the file says so. Every set of
//! vertex arrays is decoded once per skin, however many primitives share it.

use std::collections::BTreeSet;

use glam::{Vec3, Vec4};

use super::{
    accessor::{Accessor, Accessors, Shape},
    nodes::Graph,
    skins::Skins,
};
use crate::{
    formats::{Budget, ErrorKind, FormatError, gltf::json::Cursor},
    model::{Reporter, SkinPoint, SkinPoints},
};

/// Sets of four joints per vertex; nothing in the field has more.
const MOST_SETS: usize = 4;
/// Entries that one vertex can give, as each takes a share of at least [`SkinPoints::LEAST_WEIGHT`].
const MOST_ENTRIES_PER_VERTEX: u64 = 3;

const DRACO: &str = "KHR_draco_mesh_compression";

/// Collects the points of all meshes that a node binds to a skin, and counts the joints that move each vertex: skins whose meshes
/// can all be decoded learn how many there are at most, the others keep what their arrays have room for.
pub(super) fn read(
    accessors: &mut Accessors<'_>,
    graph: &Graph,
    skins: &mut Skins,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<SkinPoints, FormatError> {
    if skins.skins.is_empty() {
        return Ok(SkinPoints::default());
    }
    let influences = vec![Some(0); skins.skins.len()];
    let mut collector = Collector { skins: &*skins, entries: Vec::new(), seen: BTreeSet::new(), influences };
    match collector.read(accessors, budget, reporter) {
        Err(error) if error.kind == ErrorKind::Canceled => return Err(error),
        Err(error) => {
            warn(reporter, &error);
            collector.influences.fill(None);
        }
        Ok(()) => {}
    }
    let Collector { entries, influences, .. } = collector;
    for (skin, counted) in skins.skins.iter_mut().zip(influences) {
        skin.most_influences = counted.filter(|most| *most > 0).unwrap_or(skin.most_influences);
    }
    Ok(SkinPoints::new(graph.joints.len(), &entries))
}

struct Collector<'s> {
    skins: &'s Skins,
    entries: Vec<(u32, SkinPoint)>,
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
        for node in nodes.elements()? {
            let (Some(skin), Some(mesh)) = (node.get("skin")?, node.get("mesh")?) else { continue };
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
        for set in 0..MOST_SETS {
            let (joints, weights) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
            let (Some(joints), Some(weights)) = (attributes.get(&joints)?, attributes.get(&weights)?) else { break };
            sets.push((accessors.accessor(&joints)?, accessors.accessor(&weights)?));
        }
        if sets.is_empty() {
            return Ok(());
        }
        if !position.has_data() {
            let compressed = primitive.get("extensions")?.is_some_and(|all| matches!(all.get(DRACO), Ok(Some(_))));
            let with = if compressed { "is compressed with Draco, which is not decoded" } else { "has no data" };
            let detail = format!("the mesh {with}; its shape is not known");
            return Err(FormatError::unsupported("meshes", primitive.to_string(), detail, ""));
        }
        let arrays = sets.iter().flat_map(|(joints, weights)| [joints.index, weights.index]);
        if !self.seen.insert((skin, std::iter::once(position.index).chain(arrays).collect())) {
            return Ok(());
        }
        position.expect(Shape::Vec3, false, &place)?;
        let count = position.count;
        let positions: Vec<Vec3> = accessors.decode(&position, count, &place, budget)?;
        budget.take_array(count as u64, size_of::<u8>() as u64, "/meshes")?;
        let mut counts = vec![0_u8; count];
        for (joints, weights) in sets {
            joints.expect(Shape::Vec4, false, &attributes)?;
            weights.expect(Shape::Vec4, false, &attributes)?;
            let joints: Vec<Vec4> = accessors.decode(&joints, count, &attributes, budget)?;
            let weights: Vec<Vec4> = accessors.decode(&weights, count, &attributes, budget)?;
            let entry_size = size_of::<(u32, SkinPoint)>() as u64;
            budget.take_array(count as u64 * MOST_ENTRIES_PER_VERTEX, entry_size, "/meshes")?;
            for (count, weights) in counts.iter_mut().zip(&weights) {
                *count = weights.to_array().iter().fold(*count, |count, weight| count + u8::from(*weight > 0.0));
            }
            let left_out = self.collect(skin, &positions, &joints, &weights);
            if left_out > 0 {
                let detail = format!("{left_out} vertices are bound to joints that the skin does not have");
                warn(reporter, &attributes.malformed(detail));
            }
        }
        let most = usize::from(counts.into_iter().max().unwrap_or(0));
        if let Some(counted) = &mut self.influences[skin] {
            *counted = (*counted).max(most);
        }
        Ok(())
    }

    /// Returns how many vertices name a joint that there is not.
    fn collect(&mut self, skin: usize, positions: &[Vec3], joints: &[Vec4], weights: &[Vec4]) -> usize {
        let (joint_from_mesh, skin) = (&self.skins.joint_from_mesh[skin], &self.skins.skins[skin]);
        let mut left_out = 0;
        for ((position, joints), weights) in positions.iter().zip(joints).zip(weights) {
            for (slot, weight) in joints.to_array().into_iter().zip(weights.to_array()) {
                if weight < SkinPoints::LEAST_WEIGHT {
                    continue;
                }
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it was an integer")]
                let slot = slot as usize;
                let (Some(matrix), Some(&joint)) = (joint_from_mesh.get(slot), skin.joints.get(slot)) else {
                    left_out += 1;
                    continue;
                };
                let point = SkinPoint { position: matrix.transform_point3(*position), weight };
                #[expect(clippy::cast_possible_truncation, reason = "the limit of nodes is far below")]
                self.entries.push((joint as u32, point));
            }
        }
        left_out
    }
}

fn warn(reporter: &mut Reporter, error: &FormatError) {
    reporter.warn(
        "skin_points_unreadable",
        error.place.as_str(),
        format!("{}; hands, feet and soles are judged without it", error.detail),
        "export the mesh without that compression or damage if the feet or hands come out turned",
    );
}
