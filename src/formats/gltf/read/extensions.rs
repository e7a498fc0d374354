//! Whether the extensions that a file requires change what we read of it.

use serde_json::Value;

use crate::{
    formats::{FormatError, gltf::json::Cursor},
    model::Reporter,
};

const PHASE: &str = "extensions";

/// Extensions that are decoded, or that say nothing about node transforms, skins and animations of nodes.
const UNDERSTOOD: [&str; 22] = [
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_avif",
    "EXT_texture_webp",
    "FB_ngon_encoding",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_node_visibility",
    "KHR_techniques_webgl",
    "KHR_xmp_json_ld",
    "MSFT_lod",
    "VRM",
    "VRMC_node_constraint",
    "VRMC_springBone",
    "VRMC_vrm",
    "VRMC_vrm_animation",
    "VRMC_materials_mtoon",
];

/// Families of extensions about the look of surfaces.
const UNDERSTOOD_PREFIXES: [&str; 5] =
    ["EXT_materials_", "KHR_materials_", "KHR_texture_", "MSFT_texture_", "VRMC_materials_"];

/// The collections that we read; an unknown extension inside them may change their meaning.
const COLLECTIONS_READ: [&str; 6] = ["nodes", "skins", "animations", "accessors", "bufferViews", "buffers"];

/// Refuses a file that requires an extension that may change what we read. An unknown one that is used elsewhere only is
/// passed through.
pub(super) fn check_required(root: &Cursor<'_, '_>, reporter: &mut Reporter) -> Result<(), FormatError> {
    let Some(required) = root.get("extensionsRequired")? else { return Ok(()) };
    for entry in required.elements()? {
        let name = entry.text()?;
        let is_understood =
            UNDERSTOOD.contains(&name) || UNDERSTOOD_PREFIXES.iter().any(|prefix| name.starts_with(prefix));
        if is_understood {
            continue;
        }
        let used_in = collections_using(root, name)?;
        let is_harmless = !used_in.is_empty() && used_in.iter().all(|key| !COLLECTIONS_READ.contains(key));
        if !is_harmless {
            let place = used_in.first().map_or_else(|| "nowhere".into(), |key| format!("in '{key}'"));
            return Err(FormatError::unsupported(
                PHASE,
                entry.to_string(),
                format!("the file requires the extension '{name}' (used {place}), which cannot be read"),
                format!("export the file without '{name}'"),
            ));
        }
        let detail = format!("the required extension '{name}' is not understood and was passed through as it is");
        reporter.warn("extension_passed_through", entry.to_string(), detail, "");
    }
    Ok(())
}

/// The top-level members below which an object `extensions` has that key.
fn collections_using<'d>(root: &Cursor<'d, '_>, name: &str) -> Result<Vec<&'d str>, FormatError> {
    let users = root.object()?.iter().filter(|(key, member)| {
        let at_root = *key == "extensions" && member.get(name).is_some();
        at_root || (*key != "extensions" && uses(member, name))
    });
    Ok(users.map(|(key, _)| key.as_str()).collect())
}

/// Searches a value without recursion.
fn uses(value: &Value, name: &str) -> bool {
    let mut open = vec![value];
    while let Some(value) = open.pop() {
        match value {
            Value::Object(members) => {
                if members.get("extensions").is_some_and(|extensions| extensions.get(name).is_some()) {
                    return true;
                }
                open.extend(members.values());
            }
            Value::Array(elements) => open.extend(elements),
            _ => {}
        }
    }
    false
}
