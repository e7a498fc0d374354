//! Configs of every shape that is understood.

use retargetd::{
    engine::{self, Inputs, Knowledge, Limits, NamedBytes},
    model::Control,
    retarget::Op,
};
use serde_json::{Value, json};

use super::{Seed, clip, figure};

const BONE_MAP: &str = "pelvis%False%ABSOLUTE%0.0,0.0,0.0%0.0,0.0,0.0%1.0%False%False%\nmixamorig:Hips\nTrue\nFalse\n\n\
    head%False%ABSOLUTE%0.0,0.0,0.0%0.0,0.0,0.0%1.0%False%False%\nmixamorig:Head\nFalse\nFalse\n\n";
const TABLE: &str = "source;target;source end;position;rotation;position gain;axis order;axis offset z;space\n\
    mixamorig:Hips;pelvis;;x;1;0,5;;;\n\"mixamorig:Head\";head;;;yes;;x-zy;45,0;local\n";
const YAML: &str = "version: 1\nalign: off\nstrict: false\nsource: {rest: bind, axes: '+y+z'}\nops:\n  - op: pelvis\n    scale: &s 1.5\n  \
    - {op: fk, rotation_alpha: *s}\nedit:\n  reverse: true\n  range: [0, 0.1]\noutput: [{format: bvh}, {format: poses_npz}]\n";

pub(super) fn all() -> Vec<Seed> {
    let mut all: Vec<Seed> =
        Op::NAMES.iter().map(|op| seed(op, json!({"ops": [{"op": "pelvis"}, {"op": "fk"}, {"op": op}]}))).collect();
    all.extend(edits());
    all.extend(poses());
    all.extend([
        seed("resolved", resolved()),
        seed("rows", json!({"ops": [{"op": "joints", "rows": [
            {"source": ["mixamorig:Hips", "mixamorig:Head"], "target": "pelvis", "position": true, "rotation": true, "position_gain": 0.5,
             "axis_order": "x-zy", "axis_offset": [0, 0, 45], "space": "local"}]}]})),
        seed("pins", json!({"ops": [{"op": "pelvis"}, {"op": "fk"}, {"op": "pin", "pins": [{"joint": "hand_l", "to": "hand_r"}]},
            {"op": "limits", "ranges": [{"joint": "head", "x": [-10, 10]}]}, {"op": "reach", "alpha": [[0, 0], [0.1, 1]]}]})),
        seed("chains", json!({"source": {"chains": {"leg": ["mixamorig:LeftUpLeg", "mixamorig:LeftFoot"]}, "root": "mixamorig:Hips",
            "unit": 0.01, "pose": [{"joint": "mixamorig:Head", "degrees": [0, 10, 0]}]},
            "target": {"chains": {"leg": ["thigh_l", "foot_l"]}}, "map": [{"source": "leg", "target": "leg", "also": []}], "align": "auto",
            "report": {"level": "full", "thresholds": {}}, "output": {"format": "glb", "include": "skeleton+animation", "keys": "reduced"},
            "tune": {"max_evaluations": 2}})),
        seed("ikrigretarget", json!({"SourceCoord": "RightHandZupYfront", "TargetCoord": "RightHandYupZfront",
            "SourceRootBone": "mixamorig:Hips", "TargetRootBone": "pelvis", "SourceRootType": "RootZ", "TargetRootType": "RootZMinusGroundZ",
            "SourceChains": [{"chainName": "spine", "startBone": "mixamorig:Spine", "endBone": "mixamorig:Head"}],
            "TargetChains": [["spine", "spine_01", "head"]],
            "ChainMapping": [{"sourceChain": "spine", "targetChain": "spine", "fk": true}]})),
        seed("keemap", json!({"bones": [{"name": "pelvis", "SourceBoneName": "mixamorig:Hips", "DestinationBoneName": "pelvis"}]})),
        seed("unreal", json!({"source": {"RootBone": "mixamorig:Hips", "BoneChains": [
            {"ChainName": "Spine", "StartBone": {"BoneName": "mixamorig:Spine"}, "EndBone": "mixamorig:Head"}]},
            "target": {"BoneChains": [{"ChainName": "Spine", "StartBone": "spine_01", "EndBone": "head"}]},
            "ChainMap": [{"source": "Spine", "target": "Spine"}]})),
        seed("rokoko", json!({"rokoko_custom_names": true, "version": 1, "bones": {"hip": ["mixamorig:hips", "pelvis"]}, "shapes": {}})),
        ("bone_map".to_owned(), BONE_MAP.into()),
        ("table".to_owned(), TABLE.into()),
        ("yaml".to_owned(), YAML.into()),
        ("empty".to_owned(), b"{}".to_vec()),
    ]);
    all
}

pub(super) fn edits() -> Vec<Seed> {
    let layer = json!({"clip": "walk", "weight": 0.5, "mask": ["left_upper_arm"]});
    [
        ("range", json!({"range": {"frames": [0, 2]}, "reverse": true, "fps": 60, "interpolation": "cubic"})),
        ("cycle", json!({"range": {"cycles": 1}, "make_loop": {"times": 2, "blend_seconds": 0.05, "root": "in_place"}})),
        ("time", json!({"warp": [[0, 0], [0.05, 0.1], [0.1, 1]], "speed": 2, "every": 2, "start_seconds": -1, "margin_seconds": 0.1})),
        ("hold", json!({"hold": {"before_seconds": 0.5, "after_seconds": 0.5}, "ping_pong": true, "range": {"fraction": [0, 0.5]}})),
        ("mirror", json!({"mirror": {"mode": "all", "pairs": [["mixamorig:LeftArm", "mixamorig:RightArm"]]}})),
        ("filter", json!({"filter": {"kind": "butterworth", "cutoff_hz": 6}, "additive": "rest", "layers": [layer]})),
    ]
    .map(|(name, edit)| seed(name, json!({"edit": edit})))
    .into()
}

pub(super) fn poses() -> Vec<Seed> {
    let turn = json!([{"joint": "head", "degrees": [10, 0, 0]}, {"joint": "upperarm_l", "direction": [0, 1, 0]}]);
    vec![seed("pose", json!({"task": "pose", "target": {"pose": turn}})), seed("nothing", json!({}))]
}

pub(super) fn rig_templates() -> Vec<Seed> {
    engine::built_in_rigs().into_iter().map(|(name, document)| seed(&name, document)).collect()
}

/// What a retarget without a config finds out: every field of a spec.
///
/// # Panics
/// When the samples do not fit each other.
fn resolved() -> Value {
    let (clip, figure) = (clip(), figure());
    let inputs = Inputs {
        source: NamedBytes { name: "clip.glb", bytes: &clip },
        target: NamedBytes { name: "figure.glb", bytes: &figure },
        source_rest: None,
        target_rest: None,
        config: None,
        formats: &[],
    };
    let proposal = engine::propose(&inputs, &Knowledge::default(), &Limits::default(), &Control::new());
    proposal.expect("the samples fit each other").resolved_spec
}

fn seed(name: &str, document: Value) -> Seed {
    (name.to_owned(), document.to_string().into_bytes())
}
