//! Bone maps of other tools: each form is known by its shape, moves the walk as the automatic mapping does, and names what is wrong.

use glam::DVec3;
use retargetd::{
    engine::{self, Inputs, Limits, NamedBytes},
    model::{Control, Scene},
    retarget::{parse_document, parse_spec},
    samples,
};
use serde_json::{Value, json};

/// Joints of the walk, joints of the mannequin, and the part of the body in Rokoko's words.
const PAIRS: [(&str, &str, &str); 16] = [
    ("mixamorig:Hips", "pelvis", "hip"),
    ("mixamorig:Spine", "spine_01", "spine"),
    ("mixamorig:Neck", "neck_01", "neck"),
    ("mixamorig:Head", "head", "head"),
    ("mixamorig:LeftArm", "upperarm_l", "leftUpperArm"),
    ("mixamorig:LeftForeArm", "lowerarm_l", "leftLowerArm"),
    ("mixamorig:LeftHand", "hand_l", "leftHand"),
    ("mixamorig:RightArm", "upperarm_r", "rightUpperArm"),
    ("mixamorig:RightForeArm", "lowerarm_r", "rightLowerArm"),
    ("mixamorig:RightHand", "hand_r", "rightHand"),
    ("mixamorig:LeftUpLeg", "thigh_l", "leftUpLeg"),
    ("mixamorig:LeftLeg", "calf_l", "leftLeg"),
    ("mixamorig:LeftFoot", "foot_l", "leftFoot"),
    ("mixamorig:RightUpLeg", "thigh_r", "rightUpLeg"),
    ("mixamorig:RightLeg", "calf_r", "rightLeg"),
    ("mixamorig:RightFoot", "foot_r", "rightFoot"),
];

fn bmap() -> String {
    let record = |(source, target, part): &(&str, &str, &str)| {
        let is_root = if *part == "hip" { "True" } else { "False" };
        format!("{target}%False%ABSOLUTE%0.0,0.0,0.0%0.0,0.0,0.0%1.0%False%False%\n{source}\n{is_root}\nFalse\n\n")
    };
    let nobody =
        "None%False%ABSOLUTE%0.0,0.0,0.0%0.0,0.0,0.0%1.0%False%False%\nmixamorig:HeadTop_End\nFalse\nFalse\n\n";
    PAIRS.iter().map(record).collect::<String>() + nobody
}

fn keemap() -> String {
    let bone = |(source, target, part): &(&str, &str, &str)| {
        json!({ "name": target, "SourceBoneName": source, "DestinationBoneName": target, "keyframe_this_bone": true,
                "CorrectionFactorX": 0.0, "set_bone_position": *part == "hip", "set_bone_rotation": true })
    };
    let bones: Vec<Value> = PAIRS.iter().map(bone).collect();
    json!({ "start_frame_to_apply": 0, "source_rig_name": "walk", "bones": bones }).to_string()
}

fn unreal() -> String {
    let side = |root: &str, side: fn(&(&'static str, &'static str, &'static str)) -> &'static str| {
        let chain = |pair| json!({ "ChainName": pair_name(pair), "StartBone": {"BoneName": side(pair)}, "EndBone": side(pair) });
        json!({ "RootBone": root, "BoneChains": PAIRS.iter().map(chain).collect::<Vec<Value>>() })
    };
    json!({ "source": side(PAIRS[0].0, |pair| pair.0), "target": side(PAIRS[0].1, |pair| pair.1) }).to_string()
}

fn pair_name(pair: &(&'static str, &'static str, &'static str)) -> &'static str {
    pair.2
}

fn rokoko() -> String {
    let bones: serde_json::Map<String, Value> = PAIRS
        .iter()
        .map(|(source, target, part)| ((*part).to_owned(), json!([source.to_lowercase(), target, "another_rigs_name"])))
        .collect();
    json!({ "rokoko_custom_names": true, "version": 1, "bones": bones, "shapes": {} }).to_string()
}

fn retargeted(config: &str) -> (Scene, Vec<&'static str>) {
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    let inputs = Inputs {
        source: NamedBytes { name: "walk.glb", bytes: &walk },
        target: NamedBytes { name: "mannequin.glb", bytes: &mannequin },
        source_rest: None,
        target_rest: None,
        config: Some(NamedBytes { name: "map", bytes: config.as_bytes() }),
        formats: &[],
    };
    let outcome = engine::retarget(&inputs, &Limits::default(), &Control::new());
    let outcome = outcome.unwrap_or_else(|failure| panic!("{config}: {failure:?}"));
    let codes = outcome.report.warnings.iter().map(|warning| warning.code).collect();
    (crate::quality::figure::read_scene(&outcome.outputs[0].bytes, "out.glb"), codes)
}

/// The largest angle between the directions of limbs, in degrees.
fn apart(one: &Scene, other: &Scene) -> f64 {
    let limbs = [("thigh_l", "calf_l"), ("calf_r", "foot_r"), ("upperarm_l", "lowerarm_l"), ("lowerarm_r", "hand_r")];
    let direction = |scene: &Scene, frame: usize, (from, to): (&str, &str)| -> DVec3 {
        let pose = scene.clips[0].local_pose(&scene.skeleton, frame).to_model(&scene.skeleton);
        let place = |name| pose.transforms()[scene.skeleton.find(name).expect("a joint")].translation;
        (place(to) - place(from)).normalize()
    };
    let frames = (0..one.clips[0].frame_count()).step_by(5);
    let angles = frames.flat_map(|frame| {
        limbs.map(|limb| direction(one, frame, limb).angle_between(direction(other, frame, limb)).to_degrees())
    });
    angles.fold(0.0, f64::max)
}

#[test]
fn every_form_moves_the_walk_as_the_automatic_mapping_does() {
    let (automatic, _) = retargeted(r#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#);
    for (name, map) in [("bmap", bmap()), ("KeeMap", keemap()), ("Unreal", unreal()), ("Rokoko", rokoko())] {
        let (scene, _) = retargeted(&map);
        let off = apart(&scene, &automatic);
        assert!(off < 8.0, "{name}: limbs point {off} degrees elsewhere");
        let pelvis = scene.skeleton.find("pelvis").expect("a pelvis");
        let place = |frame: usize| {
            scene.clips[0].local_pose(&scene.skeleton, frame).to_model(&scene.skeleton).transforms()[pelvis].translation
        };
        let way = place(scene.clips[0].frame_count() - 1) - place(0);
        assert!(way.z > 3.0, "{name}: it walks: {way}");
    }
}

#[test]
fn pairs_become_chains_and_nobody_is_left_out() {
    let document = parse_document(bmap().as_bytes()).expect("a map");
    assert_eq!(
        document["map"].as_array().map(Vec::len),
        Some(PAIRS.len()),
        "without the bone that is assigned to none"
    );
    assert_eq!(
        (&document["source"]["root"], &document["target"]["root"]),
        (&json!("mixamorig:Hips"), &json!("pelvis"))
    );
    assert_eq!(document["source"]["chains"]["hand_l"], json!(["mixamorig:LeftHand", "mixamorig:LeftHand"]));
    let spec = parse_spec(rokoko().as_bytes()).expect("a spec");
    assert_eq!(spec.source.role_names["left_hand"][0][0], "mixamorig:lefthand", "names for both rigs");
}

#[test]
fn what_is_wrong_is_named() {
    let head = "a%False%ABSOLUTE%0.0,0.0,0.0%0.0,0.0,0.0%1.0%False%False%\n";
    let cases = [
        (format!("{head}b\nmaybe\nFalse\n"), "/line/3"),
        (format!("{head}b\nTrue\nFalse\n\n{head}"), "/line/6"),
        (format!("{head}b\nTrue\nFalse\n\n{head}c\nFalse\nFalse\n"), "/line/6"),
        (r#"{"bones": [{"DestinationBoneName": "a"}]}"#.to_owned(), "/bones/0/SourceBoneName"),
        (
            r#"{"rokoko_custom_names": true, "version": 1, "bones": {"leftWing": ["w"]}, "shapes": {}}"#.to_owned(),
            "/bones/leftWing",
        ),
        (
            r#"{"rokoko_custom_names": true, "version": 1, "bones": {"hip": "h"}, "shapes": {}}"#.to_owned(),
            "/bones/hip",
        ),
        (
            r#"{"source": {"BoneChains": [{"ChainName": "a", "StartBone": "b"}]}, "target": {"BoneChains": []}}"#
                .to_owned(),
            "/source/BoneChains/0/EndBone",
        ),
    ];
    for (text, pointer) in cases {
        let error = parse_spec(text.as_bytes()).expect_err(&format!("{text} is refused"));
        assert_eq!(error.fields.first().map(|field| field.pointer.as_str()), Some(pointer), "{text}: {error:?}");
    }
    assert!(parse_spec(br#"{"bones": [], "version": 1}"#).is_err(), "no map, and no config of ours");
}
