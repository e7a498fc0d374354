//! Humanoid maps of VRM 0.x, VRM 1.0 and VRM animations, found in files of any name.

use super::nodes::Graph;
use crate::{
    formats::{FormatError, gltf::json::Cursor},
    model::Reporter,
};

/// What a humanoid map says.
#[derive(Debug)]
pub(super) struct Humanoid {
    /// The convention of its role names.
    pub(super) convention: &'static str,
    /// Role name and joint, in the order of the file.
    pub(super) roles: Vec<(String, usize)>,
}

/// The extensions and the conventions that they follow, the one to be preferred first.
const CONVENTIONS: [(&str, &str); 3] = [("VRMC_vrm", "vrm1"), ("VRM", "vrm0"), ("VRMC_vrm_animation", "vrma")];

/// Reads the humanoid map, where the file has one.
pub(super) fn read(
    root: &Cursor<'_, '_>,
    graph: &Graph,
    reporter: &mut Reporter,
) -> Result<Option<Humanoid>, FormatError> {
    let Some(extensions) = root.get("extensions")? else { return Ok(None) };
    for (name, convention) in CONVENTIONS {
        let Some(extension) = extensions.get(name)? else { continue };
        let Some(humanoid) = extension.get("humanoid")? else { continue };
        let Some(bones) = humanoid.get("humanBones")? else { continue };
        let mut roles = Vec::new();
        if convention == "vrm0" {
            for bone in bones.elements()? {
                push_role(&mut roles, bone.require("bone")?.text()?, &bone, graph, reporter)?;
            }
        } else {
            for role in bones.object()?.keys() {
                push_role(&mut roles, role, &bones.require(role)?, graph, reporter)?;
            }
        }
        return Ok((!roles.is_empty()).then_some(Humanoid { convention, roles }));
    }
    Ok(None)
}

fn push_role(
    roles: &mut Vec<(String, usize)>,
    role: &str,
    bone: &Cursor<'_, '_>,
    graph: &Graph,
    reporter: &mut Reporter,
) -> Result<(), FormatError> {
    let node = bone.require("node")?;
    // Exporters of VRM 0.x write -1 for a bone that is not assigned.
    if node.value().as_i64() == Some(-1) {
        let detail = format!("the humanoid map lists '{role}' without a node; it was left out");
        reporter.warn("humanoid_bone_unassigned", node.to_string(), detail, "");
        return Ok(());
    }
    roles.push((role.to_owned(), graph.joint(&node)?));
    Ok(())
}
