//! Bone maps of other tools, as the specs that they stand for. Each is known by its shape.
//!
//! | tool | form | becomes |
//! |---|---|---|
//! | Auto-Rig Pro | `.bmap`, text: a line with the target's bone and settings, then the source's, and whether it is the root | a chain per pair |
//! | KeeMap | JSON: `bones` with `SourceBoneName` and `DestinationBoneName` | a chain per pair |
//! | Unreal | JSON: `BoneChains` of `source` and `target`, each with `ChainName`, `StartBone`, `EndBone` | chains, mapped by `ChainMap` or by equal names |
//! | Rokoko | JSON: `rokoko_custom_names` with names for the parts of a body | `role_names` of both rigs |
//!
//! What those files say of corrections between two bones is what their tools work out from rest poses; that is done here anew, so
//! it is not taken over.

mod auto_rig_pro;
mod keemap;
mod pairs;
mod rokoko;
mod unreal;

use serde_json::Value;

pub(in crate::retarget) use auto_rig_pro::{is_bmap, read_bmap};

use crate::rig::error::SpecError;

/// Whether a document is a bone map of another tool.
pub(in crate::retarget) fn is_bone_map(document: &Value) -> bool {
    rokoko::is_scheme(document) || keemap::is_map(document) || unreal::is_map(document)
}

/// The spec that a bone map stands for.
///
/// # Errors
/// Where an entry cannot be read; pointers are into the bone map.
pub(in crate::retarget) fn convert(document: &Value) -> Result<Value, SpecError> {
    if rokoko::is_scheme(document) {
        rokoko::convert(document)
    } else if keemap::is_map(document) {
        keemap::convert(document)
    } else {
        unreal::convert(document)
    }
}
