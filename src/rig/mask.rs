//! Joints that are named by role, limb, chain or joint.

use super::{
    auto_map::{known_names, roles_of},
    error::{SpecError, SpecErrorKind, SpecField},
    rig::Rig,
    spec::RigSpec,
};

/// The joints that the names stand for, in the skeleton's order: of a role or limb all that it has, of a chain its first.
///
/// `pointer` is that of the list in the spec.
///
/// # Errors
/// For every name that stands for nothing, with the nearest ones.
pub fn named_joints(rig: &Rig<'_>, spec: &RigSpec, names: &[String], pointer: &str) -> Result<Vec<usize>, SpecError> {
    let (mut joints, mut fields) = (Vec::new(), Vec::new());
    for (index, name) in names.iter().enumerate() {
        let of_roles: Vec<usize> = roles_of(name).iter().flat_map(|role| rig.role(role)).copied().collect();
        let at = format!("{pointer}/{index}");
        if !of_roles.is_empty() {
            joints.extend(of_roles);
            continue;
        }
        let joint = spec.chains.get(name).map_or(name, |[first, _]| first);
        match rig.joint(joint, &at) {
            Ok(joint) => joints.push(joint),
            Err(_) => {
                let skeleton = rig.skeleton().joints().iter().map(|joint| joint.name.clone());
                let known: Vec<String> =
                    known_names(rig).into_iter().chain(spec.chains.keys().cloned()).chain(skeleton).collect();
                let detail = format!("the {} rig has no role, limb, chain or joint '{name}'", rig.name);
                let field = SpecField::new(SpecErrorKind::UnknownName, at, detail);
                fields.push(field.with_nearest(name, known.iter().map(String::as_str)));
            }
        }
    }
    joints.sort_unstable();
    joints.dedup();
    SpecError::from_fields(fields).map_or(Ok(joints), Err)
}
