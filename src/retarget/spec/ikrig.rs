//! ikrigretarget configs, as they stand.
//!
//! Accepted in every spelling that its users have: chains and mappings as objects or as plain lists in the order of its
//! constructors.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value;

use super::{ChainMap, RetargetSpec, RotationMode, TranslationMode};
use crate::{
    retarget::ops::{Carry, FkOp, HeightRule, Op, PelvisOp, ScaleOrigin},
    rig::{
        Align, RigSpec,
        error::{SpecError, SpecErrorKind, SpecField},
    },
};

/// Fields by which such a config is known.
const MARKS: [&str; 6] =
    ["SourceCoord", "TargetCoord", "SourceChains", "TargetChains", "ChainMapping", "SourceRootBone"];

/// Whether a document is such a config.
pub(in crate::retarget) fn is_config(document: &Value) -> bool {
    document.as_object().is_some_and(|fields| MARKS.iter().any(|mark| fields.contains_key(*mark)))
}

/// The same as a spec: explicit chains, rotation changes carried along under the target's parents, the root scaled about
/// the origin by the ratio of heights, no alignment.
pub(in crate::retarget) fn convert(document: Value) -> Result<RetargetSpec, SpecError> {
    let config: Config = serde_path_to_error::deserialize(document).map_err(|error| {
        let pointer = format!("/{}", error.path().to_string().replace('.', "/"));
        let detail = format!("ikrigretarget config: {}: {}", pointer, error.inner());
        SpecError {
            fields: vec![SpecField::new(SpecErrorKind::InvalidValue, pointer, error.inner().to_string())],
            ..SpecError::new(SpecErrorKind::InvalidValue, detail, "docs/guide/configs.md shows such a config")
        }
    })?;
    let ratio_known = config.source_root_type != RootType::Ignore && config.target_root_type != RootType::Ignore;
    let pelvis = PelvisOp {
        enabled: ratio_known && !config.skip_root,
        source_height: config.source_root_type.height_rule(),
        target_height: config.target_root_type.height_rule(),
        origin: ScaleOrigin::Origin,
        ..PelvisOp::default()
    };
    let fk = FkOp {
        carry: Carry::Parent,
        rotation: RotationMode::Interpolated,
        translation: TranslationMode::None,
        ..FkOp::default()
    };
    let driven: Vec<Mapping> = config.chain_mapping.into_iter().filter(|mapping| mapping.fk).collect();
    // Chains that nothing maps may name joints that this file lacks; that program never looks them up.
    let used = |chains: Vec<Chain>, name: fn(&Mapping) -> &str| -> Vec<Chain> {
        chains.into_iter().filter(|chain| driven.iter().any(|mapping| name(mapping) == chain.name)).collect()
    };
    let source_chains = used(config.source_chains, |mapping| &mapping.source);
    let target_chains = used(config.target_chains, |mapping| &mapping.target);
    let map = driven.iter().map(|mapping| ChainMap {
        also: Vec::new(),
        source: mapping.source.clone(),
        target: mapping.target.clone(),
        rotation: None,
        translation: None,
        rotation_alpha: None,
        translation_alpha: None,
    });
    Ok(RetargetSpec {
        version: Some(1),
        map: Some(map.collect()),
        source: rig(config.source_root_bone, config.source_ground_bone, config.source_coord, source_chains),
        target: rig(config.target_root_bone, config.target_ground_bone, config.target_coord, target_chains),
        align: Align::Off,
        ops: Some(vec![Op::Pelvis(pelvis), Op::Fk(fk)]),
        ..RetargetSpec::default()
    })
}

fn rig(root: Option<String>, ground: Option<String>, coordinates: Coordinates, chains: Vec<Chain>) -> RigSpec {
    let named = |name: Option<String>| name.filter(|name| !name.is_empty());
    RigSpec {
        root: named(root),
        ground: named(ground),
        axes: Some(coordinates.axes().to_owned()),
        unit: None,
        chains: chains.into_iter().map(|chain| (chain.name, [chain.start, chain.end])).collect::<BTreeMap<_, _>>(),
        ..RigSpec::default()
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "PascalCase", deny_unknown_fields)]
struct Config {
    #[serde(default)]
    source_coord: Coordinates,
    /// The space in which that program works; results do not depend on it.
    #[serde(default, rename = "WorkCoord")]
    _work_coord: Coordinates,
    #[serde(default)]
    target_coord: Coordinates,
    #[serde(default)]
    skip_root: bool,
    #[serde(default, rename = "UseGroundBone")]
    _use_ground_bone: Option<bool>,
    #[serde(default)]
    source_root_type: RootType,
    #[serde(default)]
    source_root_bone: Option<String>,
    #[serde(default)]
    source_ground_bone: Option<String>,
    #[serde(default)]
    target_root_type: RootType,
    #[serde(default)]
    target_root_bone: Option<String>,
    #[serde(default)]
    target_ground_bone: Option<String>,
    #[serde(default)]
    source_chains: Vec<Chain>,
    #[serde(default)]
    target_chains: Vec<Chain>,
    #[serde(default)]
    chain_mapping: Vec<Mapping>,
}

#[derive(Clone, Copy, Default, Deserialize)]
enum Coordinates {
    #[default]
    #[serde(
        alias = "right_hand_z_up_y_front",
        alias = "CoordType::RightHandZupYfront",
        alias = "CoordType.RightHandZupYfront"
    )]
    RightHandZupYfront,
    #[serde(
        alias = "right_hand_y_up_z_front",
        alias = "CoordType::RightHandYupZfront",
        alias = "CoordType.RightHandYupZfront"
    )]
    RightHandYupZfront,
}

impl Coordinates {
    const fn axes(self) -> &'static str {
        match self {
            Self::RightHandZupYfront => "+z+y",
            Self::RightHandYupZfront => "+y+z",
        }
    }
}

#[derive(Clone, Copy, Default, PartialEq, Eq, Deserialize)]
enum RootType {
    #[serde(alias = "ERootType::RootZ", alias = "ERootType.RootZ")]
    RootZ,
    #[default]
    #[serde(alias = "ERootType::RootZMinusGroundZ", alias = "ERootType.RootZMinusGroundZ")]
    RootZMinusGroundZ,
    #[serde(alias = "ERootType::Ignore", alias = "ERootType.Ignore")]
    Ignore,
}

impl RootType {
    const fn height_rule(self) -> HeightRule {
        match self {
            Self::RootZ | Self::Ignore => HeightRule::AboveOrigin,
            Self::RootZMinusGroundZ => HeightRule::AboveGroundJoint,
        }
    }
}

/// `["lleg", "LeftHip", "LeftAnkle"]` or an object.
#[derive(Deserialize)]
#[serde(from = "ChainForm")]
struct Chain {
    name: String,
    start: String,
    end: String,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected [name, start joint, end joint] or {chainName, startBone, endBone}")]
enum ChainForm {
    List(String, String, String),
    Object {
        #[serde(alias = "chainName", alias = "ChainName", alias = "Name")]
        name: String,
        #[serde(alias = "startBone", alias = "StartBone", alias = "Start", alias = "start_bone")]
        start: String,
        #[serde(alias = "endBone", alias = "EndBone", alias = "End", alias = "end_bone")]
        end: String,
    },
}

impl From<ChainForm> for Chain {
    fn from(form: ChainForm) -> Self {
        match form {
            ChainForm::List(name, start, end) | ChainForm::Object { name, start, end } => Self { name, start, end },
        }
    }
}

/// `[true, false, "lleg", "lleg"]` or an object.
#[derive(Deserialize)]
#[serde(from = "MappingForm")]
struct Mapping {
    fk: bool,
    source: String,
    target: String,
}

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected [fk, ik, source chain, target chain] or {EnableFK, EnableIK, SourceChain, TargetChain}"
)]
enum MappingForm {
    List(bool, bool, String, String),
    Object {
        #[serde(default = "yes", alias = "EnableFK", alias = "FK", alias = "enable_fk")]
        fk: bool,
        #[serde(default, alias = "EnableIK", alias = "IK", alias = "enable_ik")]
        ik: bool,
        #[serde(alias = "SourceChain", alias = "sourceChain", alias = "source_chain", alias = "Source")]
        source: String,
        #[serde(alias = "TargetChain", alias = "targetChain", alias = "target_chain", alias = "Target")]
        target: String,
    },
}

const fn yes() -> bool {
    true
}

impl From<MappingForm> for Mapping {
    fn from(form: MappingForm) -> Self {
        // That program's IK is a stub; its flag changes nothing there, and nothing here.
        match form {
            MappingForm::List(fk, _ik, source, target) | MappingForm::Object { fk, ik: _ik, source, target } => {
                Self { fk, source, target }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_and_objects_are_the_same() {
        let lists = serde_json::json!({
            "SourceCoord": "RightHandZupYfront", "TargetCoord": "RightHandYupZfront",
            "SourceRootType": "RootZMinusGroundZ", "SourceRootBone": "Hip", "SourceGroundBone": "Foot",
            "TargetRootType": "RootZ", "TargetRootBone": "Root", "TargetGroundBone": "",
            "SourceChains": [["leg", "Thigh", "Foot"]], "TargetChains": [["leg", "Thigh", "Foot"]],
            "ChainMapping": [[true, false, "leg", "leg"]]
        });
        let mut objects = lists.clone();
        objects["SourceChains"] = serde_json::json!([{"chainName": "leg", "startBone": "Thigh", "endBone": "Foot"}]);
        objects["ChainMapping"] = serde_json::json!([{"EnableFK": true, "SourceChain": "leg", "TargetChain": "leg"}]);
        let spec = convert(lists).expect("lists");
        assert_eq!(spec, convert(objects).expect("objects"), "both forms mean the same");
        assert_eq!(spec.source.axes.as_deref(), Some("+z+y"), "coordinates become axes");
        assert_eq!(spec.target.ground, None, "an empty name is none");
    }

    #[test]
    fn a_wrong_chain_names_its_place() {
        let config = serde_json::json!({"SourceChains": [["leg", "Thigh"]]});
        let error = convert(config).expect_err("two of three");
        assert!(error.fields[0].pointer.starts_with("/SourceChains"), "{error:?}");
    }
}
