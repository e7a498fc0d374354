//! glTF 2.0 in all its coats: `.gltf` with embedded buffers, `.glb`, `.vrm`, `.vrma`.
//!
//! Reading works on the document itself, not on a typed copy of it: whatever is not understood stays in the JSON and in the
//! buffers, and comes out again when the scene is written. Only nodes, skins, animations and humanoid maps are looked at, and
//! of skinned meshes where their vertices are; materials and images are never decoded.
//!
//! | file | answers |
//! |---|---|
//! | `container` | where the JSON and the binary chunk of a file are |
//! | `json` | is this text safe to parse; what stands at this place of it |
//! | `document` | the parsed file: JSON, buffers, buffer views |
//! | `read` | accessors, nodes, skins, humanoid maps, animations to a scene |
//! | `sections` | a long file, some frames at a time |
//! | `write` | a scene and a clip to a file |
//!
//! Must never know: rigs, roles beyond their names in the file, the algorithm, the file system, the network.

mod container;
mod document;
mod json;
mod read;
mod sections;
#[cfg(test)]
mod tests;
mod write;

pub(super) use container::MAGIC;
pub(super) use json::parse as parse_json;
pub(super) use read::{appearance, morph_meshes, read};
pub(super) use sections::open_in_sections;
pub(super) use write::{FRAMES_OF_DOCUMENT, GlbSectionWriter, contain, write, write_display};

/// Both names of the mesh compression extension; they share one layout.
const MESHOPT_EXTENSIONS: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

// Tracks and accessors are copied as they lie in memory, and glTF is little-endian.
#[cfg(target_endian = "big")]
compile_error!("the glTF reader and writer copy memory as it lies and need a little-endian machine");

/// Whether a scene came from a file of these formats.
pub(super) fn has_document(scene: &crate::model::Scene) -> bool {
    scene.payload.get::<document::Document>().is_some()
}
