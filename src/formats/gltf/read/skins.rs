//! Skins, and the pose in which they were bound.

use glam::{DMat4, DVec3, Mat4};
use serde_json::Value;

use super::{
    accessor::{Accessors, Shape},
    nodes::Graph,
};
use crate::{
    formats::{Budget, FormatError, gltf::json::Cursor},
    model::{Reporter, Skin, Transform},
};

/// What `skins` says.
#[derive(Debug, Default)]
pub(super) struct Skins {
    /// In the order of the file.
    pub(super) skins: Vec<Skin>,
    /// `model_from_joint` per joint; empty where there is no skin.
    pub(super) bind_pose: Vec<Option<Transform>>,
    /// The inverse bind matrices of each skin, by its own list of joints; empty where they say nothing.
    pub(super) joint_from_mesh: Vec<Vec<Mat4>>,
}

/// Reads `skins`. Where several bind one joint, the first one says in which pose.
pub(super) fn read(
    accessors: &mut Accessors<'_>,
    graph: &Graph,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Skins, FormatError> {
    let root = accessors.root();
    let mut skins = Skins::default();
    let Some(objects) = root.get("skins")? else { return Ok(skins) };
    for object in objects.elements()? {
        budget.check_canceled()?;
        let name = object.get("name")?.map_or(Ok(""), |name| name.text())?.to_owned();
        let list = object.require("joints")?;
        budget.take_array(list.length()? as u64, size_of::<usize>() as u64, "/skins")?;
        let joints: Vec<usize> = list.elements()?.map(|entry| graph.joint(&entry)).collect::<Result<_, _>>()?;
        if joints.is_empty() {
            reporter.warn("skin_without_joints", list.to_string(), "the skin lists no joint", "");
        }
        if joints.windows(2).any(|pair| graph.root_of[pair[0]] != graph.root_of[pair[1]]) {
            let detail =
                "the joints of the skin are in several trees, which glTF does not allow; they were kept as they are";
            reporter.warn("skin_without_common_root", list.to_string(), detail, "");
        }
        if let Some(skeleton) = object.get("skeleton")? {
            graph.joint(&skeleton)?;
        }
        skins.bind_pose.resize(graph.joints.len(), None);
        let joint_from_mesh = read_inverse_bind_matrices(&object, &joints, graph, accessors, budget, reporter)?;
        let bind = bind_transforms(&joint_from_mesh, &object, reporter);
        for (joint, transform) in joints.iter().zip(bind) {
            skins.bind_pose[*joint] = skins.bind_pose[*joint].or(transform);
        }
        let (says_nothing, is_given) = (joint_from_mesh.is_empty(), object.get("inverseBindMatrices")?.is_some());
        let has_no_inverse_binds = says_nothing && !is_given && !joints.is_empty();
        let has_identity_binds = says_nothing && is_given && !joints.is_empty();
        skins.joint_from_mesh.push(joint_from_mesh);
        skins.skins.push(Skin { name, joints, has_no_inverse_binds, has_identity_binds, most_influences: 0 });
    }
    for (skin, influences) in skins.skins.iter_mut().zip(influences(root.value())) {
        skin.most_influences = influences;
    }
    Ok(skins)
}

/// How many joints a vertex can be bound to, per skin: four for each set of joint attributes of the meshes that it deforms. What
/// is wrong with meshes is not looked at here.
fn influences(document: &Value) -> Vec<usize> {
    const PER_SET: usize = 4;
    const MAX_SETS: usize = 16;
    let list = |name: &str| document.get(name).and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let index = |node: &Value, name: &str| node.get(name)?.as_u64().and_then(|index| usize::try_from(index).ok());
    let mut most = vec![0; list("skins").len()];
    for node in list("nodes") {
        let (Some(skin), Some(mesh)) = (index(node, "skin"), index(node, "mesh")) else { continue };
        let primitives = list("meshes").get(mesh).and_then(|mesh| mesh.get("primitives")?.as_array());
        for attributes in primitives.into_iter().flatten().filter_map(|primitive| primitive.get("attributes")) {
            let sets = (0..MAX_SETS).take_while(|set| attributes.get(format!("JOINTS_{set}")).is_some()).count();
            if let Some(most) = most.get_mut(skin) {
                *most = (*most).max(sets * PER_SET);
            }
        }
    }
    most
}

/// Empty where they are not given, or are all the identity, and the joints are not in one place: the specification lets a mesh be
/// bound so that every joint's own space is the mesh's, but files that leave the matrices out mean that they do not know.
fn read_inverse_bind_matrices(
    skin: &Cursor<'_, '_>,
    joints: &[usize],
    graph: &Graph,
    accessors: &mut Accessors<'_>,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Vec<Mat4>, FormatError> {
    let joint_count = joints.len();
    let matrices: Option<Vec<Mat4>> = match skin.get("inverseBindMatrices")? {
        None => None,
        Some(entry) => {
            let accessor = accessors.accessor(&entry)?;
            accessor.expect(Shape::Mat4, true, &entry)?;
            if accessor.count < joint_count {
                let detail = format!("{} matrices are too few for {joint_count} joints", accessor.count);
                return Err(entry.malformed(detail));
            }
            Some(accessors.decode(&accessor, joint_count, &entry, budget)?)
        }
    };
    let says_something = |matrices: &Vec<Mat4>| matrices.iter().any(|one| *one != Mat4::IDENTITY);
    let are_apart = joints.iter().skip(1).any(|joint| graph.joints[*joint].rest.translation != DVec3::ZERO);
    let Some(matrices) = matrices.filter(|matrices| !are_apart || says_something(matrices)) else {
        if !are_apart {
            return Ok(vec![Mat4::IDENTITY; joint_count]);
        }
        let detail = "the inverse bind matrices of the skin are missing, or all the identity; the node transforms are \
                      taken as its bind pose";
        reporter.warn("bind_matrices_missing", skin.to_string(), detail, "bind the mesh again and export");
        return Ok(Vec::new());
    };
    Ok(matrices)
}

fn bind_transforms(matrices: &[Mat4], skin: &Cursor<'_, '_>, reporter: &mut Reporter) -> Vec<Option<Transform>> {
    let mut transforms = Vec::with_capacity(matrices.len());
    for (index, joint_from_model) in matrices.iter().enumerate() {
        let joint_from_model: DMat4 = joint_from_model.as_dmat4();
        // A determinant of 1e-30 is a scale of 1e-10: nothing that could be seen.
        let is_regular = joint_from_model.is_finite() && joint_from_model.determinant().abs() > 1e-30;
        let transform = is_regular.then(|| Transform::from_matrix(&joint_from_model.inverse()));
        let transform = transform.filter(Transform::is_finite);
        if transform.is_none() {
            let detail = format!("the inverse bind matrix of entry {index} has no inverse; it was left out");
            let place = format!("{skin}/inverseBindMatrices");
            reporter.warn("bind_matrix_singular", place, detail, "bind the mesh again and export");
        }
        transforms.push(transform);
    }
    transforms
}
