//! Skins, and the pose in which they were bound.

use glam::{DMat4, Mat4};

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
        if let Some(skeleton) = object.get("skeleton")? {
            graph.joint(&skeleton)?;
        }
        skins.bind_pose.resize(graph.joints.len(), None);
        let bind = read_bind_transforms(&object, &joints, accessors, budget, reporter)?;
        for (joint, transform) in joints.iter().zip(bind) {
            skins.bind_pose[*joint] = skins.bind_pose[*joint].or(transform);
        }
        skins.skins.push(Skin { name, joints });
    }
    Ok(skins)
}

fn read_bind_transforms(
    skin: &Cursor<'_, '_>,
    joints: &[usize],
    accessors: &mut Accessors<'_>,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Vec<Option<Transform>>, FormatError> {
    let Some(entry) = skin.get("inverseBindMatrices")? else {
        // The specification: where they are not given, each is the identity.
        return Ok(vec![Some(Transform::IDENTITY); joints.len()]);
    };
    let accessor = accessors.accessor(&entry)?;
    accessor.expect(Shape::Mat4, true, &entry)?;
    if accessor.count < joints.len() {
        return Err(entry.malformed(format!("{} matrices are too few for {} joints", accessor.count, joints.len())));
    }
    let matrices: Vec<Mat4> = accessors.decode(&accessor, joints.len(), &entry, budget)?;
    let mut transforms = Vec::with_capacity(joints.len());
    for (index, joint_from_model) in matrices.iter().enumerate() {
        let joint_from_model: DMat4 = joint_from_model.as_dmat4();
        // A determinant of 1e-30 is a scale of 1e-10: nothing that could be seen.
        let is_regular = joint_from_model.is_finite() && joint_from_model.determinant().abs() > 1e-30;
        let transform = is_regular.then(|| Transform::from_matrix(&joint_from_model.inverse()));
        let transform = transform.filter(Transform::is_finite);
        if transform.is_none() {
            let detail = format!("the inverse bind matrix of entry {index} has no inverse; it was left out");
            reporter.warn("bind_matrix_singular", entry.to_string(), detail, "bind the mesh again and export");
        }
        transforms.push(transform);
    }
    Ok(transforms)
}
