//! The skins of a new document: those that meshes are bound by, as few as can be, or one for each tree of joints.

use std::collections::BTreeMap;

use glam::DMat4;

use super::{
    Output,
    schema::{self, Accessor, Component, List, Shape},
};
use crate::{
    formats::{
        FormatError,
        meshes::{Binding, Mesh},
    },
    model::{Reporter, Scene},
};

/// Bind matrices that differ by less than this share are the same, and so are their skins.
const SAME: f32 = 2e-6;
/// How many skins a binding is compared with, the last ones.
const MAX_COMPARED: usize = 64;
/// The identity matrix, as glTF lists it.
const IDENTITY: [f32; 16] = glam::Mat4::IDENTITY.to_cols_array();

/// Which skin each mesh has.
#[derive(Debug, Default)]
pub(super) struct Skins {
    /// The index of the skin of each mesh, and for each joint of its binding its place in that; nothing for meshes without.
    pub(super) of_meshes: Vec<Option<(usize, Vec<u16>)>>,
    /// Whether a skin has joints in several trees, which need one top.
    pub(super) need_common_root: bool,
}

/// A skin on its way into the document.
struct Skin {
    name: String,
    tree: usize,
    joints: Vec<usize>,
    joint_from_vertex: Vec<[f32; 16]>,
    places: BTreeMap<usize, usize>,
}

impl Skin {
    const fn new(name: String, tree: usize) -> Self {
        Self { name, tree, joints: Vec::new(), joint_from_vertex: Vec::new(), places: BTreeMap::new() }
    }

    /// The place of a joint, added where it is not there.
    fn place(&mut self, joint: usize, joint_from_vertex: [f32; 16]) -> usize {
        *self.places.entry(joint).or_insert_with(|| {
            self.joints.push(joint);
            self.joint_from_vertex.push(joint_from_vertex);
            self.joints.len() - 1
        })
    }

    /// Whether the joints that both have are bound alike.
    fn agrees(&self, joints: &[(usize, [f32; 16])]) -> bool {
        joints.iter().all(|(joint, matrix)| {
            self.places.get(joint).is_none_or(|place| is_same(&self.joint_from_vertex[*place], matrix))
        })
    }
}

/// Adds the skins: of what meshes are bound by, one wherever they agree; and all other joints of a tree to its first skin, so that
/// readers know them for joints. The joints of a skin must be in one tree.
pub(super) fn add(
    output: &mut Output<'_>,
    target: &Scene,
    meshes: &[Mesh],
    reporter: &mut Reporter,
) -> Result<Skins, FormatError> {
    let joints = target.skeleton.joints();
    let mut tree_of: Vec<usize> = Vec::with_capacity(joints.len());
    for (index, joint) in joints.iter().enumerate() {
        tree_of.push(joint.parent.map_or(index, |parent| tree_of[parent]));
    }
    let bindings = || meshes.iter().filter_map(|mesh| mesh.binding.as_ref());
    let spans =
        |binding: &Binding| binding.joints.iter().any(|(joint, _)| tree_of[*joint] != tree_of[binding.joints[0].0]);
    let need_common_root = bindings().any(spans);
    if need_common_root {
        tree_of.fill(0);
    }

    let mut skins: Vec<Skin> = Vec::new();
    let mut first_of_tree: BTreeMap<usize, usize> = BTreeMap::new();
    let mut of_meshes = Vec::with_capacity(meshes.len());
    for mesh in meshes {
        let Some(binding) = &mesh.binding else {
            of_meshes.push(None);
            continue;
        };
        let bound: Vec<(usize, [f32; 16])> =
            binding.joints.iter().map(|(joint, matrix)| (*joint, columns(matrix).unwrap_or(IDENTITY))).collect();
        let tree = tree_of[bound[0].0];
        let looked_at = skins.len().saturating_sub(MAX_COMPARED);
        let same = skins[looked_at..].iter().position(|skin| skin.tree == tree && skin.agrees(&bound));
        let index = same.map_or(skins.len(), |index| looked_at + index);
        if index == skins.len() {
            skins.push(Skin::new(binding.name.clone(), tree));
            first_of_tree.entry(tree).or_insert(index);
        }
        let places = bound.iter().map(|(joint, matrix)| skins[index].place(*joint, *matrix) as u16).collect();
        of_meshes.push(Some((index, places)));
    }

    let name = target.skins.first().map_or("", |skin| skin.name.as_str());
    let any_marked = joints.iter().any(|joint| joint.is_joint);
    let model_from_joint = bind_pose(target, !skins.is_empty());
    for (index, joint) in joints.iter().enumerate().filter(|(_, joint)| joint.is_joint || !any_marked) {
        let tree = tree_of[index];
        let first = *first_of_tree.entry(tree).or_insert(skins.len());
        if first == skins.len() {
            skins.push(Skin::new(name.to_owned(), tree));
        }
        if skins[first].places.contains_key(&index) {
            continue;
        }
        let matrix = columns(&model_from_joint[index].inverse()).unwrap_or_else(|| {
            let detail =
                "the rest pose flattens this joint, so it has no inverse bind matrix; the identity was written";
            reporter.warn("bind_matrix_singular", joint.name.as_str(), detail, "");
            IDENTITY
        });
        skins[first].place(index, matrix);
    }
    for skin in skins {
        write(output, &skin)?;
    }
    Ok(Skins { of_meshes, need_common_root })
}

/// Where the joints are at rest, or where there are meshes, where they were bound: a joint that none is bound to lies below the one
/// above it as at rest.
fn bind_pose(target: &Scene, has_meshes: bool) -> Vec<DMat4> {
    let mut model_from_joint: Vec<DMat4> = Vec::with_capacity(target.skeleton.len());
    for (index, joint) in target.skeleton.joints().iter().enumerate() {
        let bound = target.bind_pose.get(index).copied().flatten().filter(|_| has_meshes);
        let local = joint.rest.to_matrix();
        let at_rest = joint.parent.map_or(local, |parent| model_from_joint[parent] * local);
        model_from_joint.push(bound.map_or(at_rest, |bound| bound.to_matrix()));
    }
    model_from_joint
}

fn write(output: &mut Output<'_>, skin: &Skin) -> Result<(), FormatError> {
    let view = output.add_values(&skin.joint_from_vertex, None)?;
    let accessor = Accessor::of_view(view, Component::Float, skin.joints.len(), Shape::Mat4);
    let inverse_bind_matrices = output.add_accessor(&accessor)?;
    let skin = schema::Skin { name: &skin.name, inverse_bind_matrices, joints: &skin.joints };
    output.push(List::Skins, &skin).map(drop)
}

/// A matrix as glTF lists it; nothing where it is not finite.
fn columns(joint_from_vertex: &DMat4) -> Option<[f32; 16]> {
    let mut columns = joint_from_vertex.is_finite().then(|| joint_from_vertex.as_mat4())?.to_cols_array();
    // The last row of an affine matrix, without rounding: validators compare it bit for bit.
    (columns[3], columns[7], columns[11], columns[15]) = (0.0, 0.0, 0.0, 1.0);
    columns.iter().all(|number| number.is_finite()).then_some(columns)
}

fn is_same(one: &[f32; 16], other: &[f32; 16]) -> bool {
    let largest = |part: std::ops::Range<usize>| {
        one[part.clone()].iter().chain(&other[part]).fold(0.0_f32, |most, number| most.max(number.abs()))
    };
    let (turns, places) = (largest(0..12), largest(12..15));
    one.iter().zip(other).enumerate().all(|(index, (one, other))| {
        let largest = if index < 12 { turns } else { places };
        (one - other).abs() <= largest * SAME
    })
}
