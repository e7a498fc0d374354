//! The triangles of a document: with normals, texture coordinates and colors, what moves them, and the shapes that they can take.

use std::collections::{BTreeMap, BTreeSet};

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, Mat4, Vec2, Vec3, Vec4};

use super::{
    accessor::{Accessors, Shape},
    paints::{self, Paints},
};
use crate::{
    formats::{
        Budget, ErrorKind, FormatError,
        appearance::sane_color,
        gltf::{document::Document, json::Cursor},
    },
    model::{Appearance, Carrier, FourInfluences, ModelPose, MorphPlace, Reporter, Scene, Surface, SurfaceShape},
};

/// Sets of four joints of a vertex that are looked at.
const MAX_SETS: usize = 4;
/// The modes of primitives that are triangles: each by itself, in strips, in fans.
const TRIANGLES: u64 = 4;
const STRIP: u64 = 5;
const FAN: u64 = 6;

/// See [`crate::formats::appearance`]; nothing where the scene came from no glTF.
pub(in crate::formats) fn appearance(
    scene: &Scene,
    wanted: &BTreeSet<usize>,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Option<Appearance>, FormatError> {
    let Some(document) = scene.payload.get::<Document>() else { return Ok(None) };
    let joint_of_node = scene.skeleton.joints().iter().enumerate().map(|(joint, node)| (node.node, joint)).collect();
    let reader = SurfaceReader {
        accessors: Accessors::new(document),
        scene,
        wanted,
        joint_of_node,
        rest: scene.skeleton.rest_pose().to_model(&scene.skeleton),
        paints: paints::read(document, budget)?,
        surfaces: Vec::new(),
    };
    reader.read(document, budget, reporter).map(Some)
}

struct SurfaceReader<'d> {
    accessors: Accessors<'d>,
    scene: &'d Scene,
    wanted: &'d BTreeSet<usize>,
    joint_of_node: BTreeMap<usize, usize>,
    rest: ModelPose,
    paints: Paints,
    surfaces: Vec<Surface>,
}

/// Who wears a mesh.
struct Wearer {
    joint: usize,
    skin: Option<usize>,
    /// The first of its morphs in the scene, and how many there are.
    morphs: Option<(usize, usize)>,
}

impl SurfaceReader<'_> {
    fn read(
        mut self,
        document: &Document,
        budget: &mut Budget<'_>,
        reporter: &mut Reporter,
    ) -> Result<Appearance, FormatError> {
        let root = document.root();
        if let (Some(nodes), Some(meshes)) = (root.get("nodes")?, root.get("meshes")?) {
            let mesh_count = meshes.length()?;
            for (index, node) in nodes.elements()?.enumerate() {
                let Some(mesh) = node.get("mesh")? else { continue };
                let Some(wearer) = self.wearer(index, &node)? else { continue };
                let mesh = meshes.element(mesh.index(mesh_count, "meshes")?)?;
                for primitive in mesh.require("primitives")?.elements()? {
                    budget.check_canceled()?;
                    match self.surface(&primitive, &wearer, budget) {
                        Ok(surface) => self.surfaces.extend(surface),
                        Err(error) if matches!(error.kind, ErrorKind::Malformed | ErrorKind::UnsupportedFeature) => {
                            let detail = format!("{}; it is not in the picture", error.detail);
                            reporter.warn(
                                "mesh_not_shown",
                                error.place.as_str(),
                                detail,
                                "export the mesh uncompressed",
                            );
                        }
                        Err(error) => return Err(error),
                    }
                }
            }
        }
        let Paints { paints, images, .. } = self.paints;
        Ok(Appearance { surfaces: self.surfaces, paints, images })
    }

    fn wearer(&self, index: usize, node: &Cursor<'_, '_>) -> Result<Option<Wearer>, FormatError> {
        let Some(&joint) = self.joint_of_node.get(&index) else { return Ok(None) };
        if self.scene.hidden_joints.binary_search(&joint).is_ok() {
            return Ok(None);
        }
        let skin = node.get("skin")?.map(|skin| skin.index(self.scene.skins.len(), "skins")).transpose()?;
        let morphs = self.scene.morphs.iter().enumerate().find_map(|(first, morph)| match morph.place {
            MorphPlace::Mesh { node, index: 0, count } if node == index => Some((first, count)),
            _ => None,
        });
        Ok(Some(Wearer { joint, skin, morphs }))
    }

    /// One primitive; nothing of points and lines.
    fn surface(
        &mut self,
        primitive: &Cursor<'_, '_>,
        wearer: &Wearer,
        budget: &mut Budget<'_>,
    ) -> Result<Option<Surface>, FormatError> {
        let mode = primitive.get("mode")?.map_or(Ok(TRIANGLES), |mode| mode.whole())?;
        let attributes = primitive.require("attributes")?;
        let Some(place) = attributes.get("POSITION")? else { return Ok(None) };
        if !(TRIANGLES..=FAN).contains(&mode) {
            return Ok(None);
        }
        let accessor = self.accessors.accessor(&place)?;
        if !accessor.has_data() {
            return Err(place.malformed("the mesh has no data that can be decoded"));
        }
        accessor.expect(Shape::Vec3, false, &place)?;
        let count = accessor.count;
        let positions: Vec<Vec3> = self.accessors.decode(&accessor, count, &place, budget)?;
        if !positions.iter().all(|position| position.is_finite()) {
            return Err(place.malformed("a vertex is not a finite number"));
        }
        let paint =
            primitive.get("material")?.and_then(|entry| entry.index(self.paints.paints.len(), "materials").ok());
        let texture = paint.filter(|paint| self.paints.paints[*paint].image.is_some());
        let coordinates = format!("TEXCOORD_{}", texture.map_or(0, |paint| self.paints.texture_sets[paint]));
        let normals = self.optional::<Vec3>(&attributes, "NORMAL", Shape::Vec3, count, budget)?;
        let texture_coordinates = match texture {
            Some(_) => self.optional::<Vec2>(&attributes, &coordinates, Shape::Vec2, count, budget)?,
            None => Vec::new(),
        };
        Ok(Some(Surface {
            normals: normals.into_iter().map(|normal| finite(normal).normalize_or_zero()).collect(),
            texture_coordinates: texture_coordinates
                .into_iter()
                .map(|at| if at.is_finite() { at } else { Vec2::ZERO })
                .collect(),
            colors: self.colors(&attributes, count, budget)?,
            indices: self.indices(primitive, mode, count, budget)?,
            paint,
            carrier: self.carrier(&attributes, wearer, count, budget)?,
            shapes: self.shapes(primitive, wearer, count, budget)?,
            positions,
        }))
    }

    /// An attribute; nothing where it is not there, or of another shape.
    fn optional<T: Pod + Zeroable>(
        &mut self,
        attributes: &Cursor<'_, '_>,
        name: &str,
        shape: Shape,
        count: usize,
        budget: &mut Budget<'_>,
    ) -> Result<Vec<T>, FormatError> {
        let Some(place) = attributes.get(name)? else { return Ok(Vec::new()) };
        let accessor = self.accessors.accessor(&place)?;
        if accessor.expect(shape, false, &place).is_err() || accessor.count < count || !accessor.has_data() {
            return Ok(Vec::new());
        }
        self.accessors.decode(&accessor, count, &place, budget)
    }

    fn colors(
        &mut self,
        attributes: &Cursor<'_, '_>,
        count: usize,
        budget: &mut Budget<'_>,
    ) -> Result<Vec<Vec4>, FormatError> {
        let opaque = self.optional::<Vec3>(attributes, "COLOR_0", Shape::Vec3, count, budget)?;
        if !opaque.is_empty() {
            return Ok(opaque.into_iter().map(|color| sane_color(color.extend(1.0))).collect());
        }
        let colors = self.optional::<Vec4>(attributes, "COLOR_0", Shape::Vec4, count, budget)?;
        Ok(colors.into_iter().map(sane_color).collect())
    }

    /// Three for each triangle, however the file lists them.
    fn indices(
        &mut self,
        primitive: &Cursor<'_, '_>,
        mode: u64,
        count: usize,
        budget: &mut Budget<'_>,
    ) -> Result<Vec<u32>, FormatError> {
        let listed: Vec<u32> = match primitive.get("indices")? {
            None => (0..count as u32).collect(),
            Some(place) => {
                let accessor = self.accessors.accessor(&place)?;
                accessor.expect(Shape::Scalar, false, &place)?;
                let indices = self.accessors.decode_indices(&accessor, &place, budget)?;
                if indices.iter().any(|index| *index as usize >= count) {
                    return Err(place.malformed(format!("an index is beyond the {count} vertices")));
                }
                indices
            }
        };
        let triangles = |triangle: &dyn Fn(usize) -> [u32; 3]| {
            (0..listed.len().saturating_sub(2)).flat_map(triangle).collect::<Vec<u32>>()
        };
        Ok(match mode {
            STRIP => triangles(&|at| [listed[at], listed[at + 1 + at % 2], listed[at + 2 - at % 2]]),
            FAN => triangles(&|at| [listed[0], listed[at + 1], listed[at + 2]]),
            _ => listed[..listed.len() / 3 * 3].to_vec(),
        })
    }

    fn carrier(
        &mut self,
        attributes: &Cursor<'_, '_>,
        wearer: &Wearer,
        count: usize,
        budget: &mut Budget<'_>,
    ) -> Result<Carrier, FormatError> {
        let mut influences = Vec::new();
        let Some(skin) = wearer.skin else { return Ok(Carrier::Joint(wearer.joint)) };
        let joints = self.bound_joints(skin, budget)?;
        for set in 0..MAX_SETS {
            let slots = self.optional::<Vec4>(attributes, &format!("JOINTS_{set}"), Shape::Vec4, count, budget)?;
            let shares = self.optional::<Vec4>(attributes, &format!("WEIGHTS_{set}"), Shape::Vec4, count, budget)?;
            if slots.is_empty() || shares.is_empty() {
                break;
            }
            budget.take_array(count as u64, size_of::<FourInfluences>() as u64, "/meshes")?;
            influences
                .push(slots.iter().zip(&shares).map(|(slots, shares)| four(*slots, *shares, joints.len())).collect());
        }
        if influences.is_empty() {
            return Ok(Carrier::Joint(wearer.joint));
        }
        normalize(&mut influences);
        Ok(Carrier::Skin { joints, influences })
    }

    /// The joints of a skin, each with `joint_from_vertex`.
    fn bound_joints(&mut self, skin: usize, budget: &mut Budget<'_>) -> Result<Vec<(usize, Mat4)>, FormatError> {
        let joints = &self.scene.skins[skin].joints;
        let root = self.accessors.root();
        let skins = root.require("skins")?;
        let object = skins.element(skin)?;
        let given: Option<Vec<Mat4>> = match object.get("inverseBindMatrices")? {
            Some(place) => {
                let accessor = self.accessors.accessor(&place)?;
                accessor.expect(Shape::Mat4, true, &place)?;
                Some(self.accessors.decode(&accessor, joints.len().min(accessor.count), &place, budget)?)
            }
            None => None,
        };
        let rest = |joint: usize| {
            let inverse: DMat4 = self.rest.transforms()[joint].to_matrix().inverse();
            if inverse.is_finite() { inverse.as_mat4() } else { Mat4::IDENTITY }
        };
        let is_unknown = self.scene.skins[skin].has_identity_binds;
        let given = given.filter(|_| !is_unknown);
        let matrix = |(slot, &joint): (usize, &usize)| {
            let given = given.as_ref().and_then(|given| given.get(slot)).copied().filter(Mat4::is_finite);
            (joint, given.unwrap_or_else(|| rest(joint)))
        };
        Ok(joints.iter().enumerate().map(matrix).collect())
    }

    fn shapes(
        &mut self,
        primitive: &Cursor<'_, '_>,
        wearer: &Wearer,
        count: usize,
        budget: &mut Budget<'_>,
    ) -> Result<Vec<SurfaceShape>, FormatError> {
        let (Some((first, morphs)), Some(targets)) = (wearer.morphs, primitive.get("targets")?) else {
            return Ok(Vec::new());
        };
        let mut shapes = Vec::new();
        for (index, target) in targets.elements()?.enumerate().take(morphs) {
            if !self.wanted.contains(&(first + index)) {
                continue;
            }
            let moved = self.optional::<Vec3>(&target, "POSITION", Shape::Vec3, count, budget)?;
            let offsets = moved.iter().enumerate().filter(|(_, offset)| offset.is_finite() && **offset != Vec3::ZERO);
            let offsets: Vec<(u32, Vec3)> = offsets.map(|(vertex, offset)| (vertex as u32, *offset)).collect();
            budget.take_array(offsets.len() as u64, size_of::<(u32, Vec3)>() as u64, "/meshes")?;
            shapes.push(SurfaceShape { morph: first + index, offsets });
        }
        Ok(shapes)
    }
}

fn finite(value: Vec3) -> Vec3 {
    if value.is_finite() { value } else { Vec3::ZERO }
}

/// Four influences, without those of joints that the skin does not have.
fn four(slots: Vec4, shares: Vec4, joint_count: usize) -> FourInfluences {
    let mut found = FourInfluences::default();
    for (place, (slot, share)) in slots.to_array().into_iter().zip(shares.to_array()).enumerate() {
        // It was an integer of 16 bits.
        let slot = slot as u16;
        if share > 0.0 && share.is_finite() && usize::from(slot) < joint_count {
            (found.joints[place], found.shares[place]) = (slot, share);
        }
    }
    found
}

/// Makes the shares of each vertex 1 together; one that nothing moves hangs on the first joint.
fn normalize(sets: &mut [Vec<FourInfluences>]) {
    for vertex in 0..sets[0].len() {
        let sum: f32 = sets.iter().flat_map(|set| set[vertex].shares).sum();
        if sum > 0.0 {
            sets.iter_mut().for_each(|set| set[vertex].shares = set[vertex].shares.map(|share| share / sum));
        } else {
            sets[0][vertex] = FourInfluences { joints: [0; 4], shares: [1.0, 0.0, 0.0, 0.0] };
        }
    }
}
