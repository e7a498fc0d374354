//! Documents with several scenes: viewers show one of them, and that is where the character is looked for.

use std::fmt::Write as _;

use base64::{Engine as _, engine::general_purpose::STANDARD};
use retargetd::{
    engine::{self, Inputs, Limits, NamedBytes, Outcome},
    formats::Format,
    model::Control,
    samples,
};
use serde_json::{Value, json};

use super::same_document::assert_same_document;
use crate::{
    quality::figure::read_scene,
    support::{gltf_json, validate_gltf},
};

/// What the joints of the second character are called more.
const PREFIX: &str = "Second_";

/// The document of a GLB twice over, its nodes and skins: first as they were, then with names of their own. `lists` says for every
/// scene which of the two it shows, and `default` which scene is the default one; the clips are those of the character `moved`.
fn twice(glb: &[u8], lists: &[&[usize]], default: Option<usize>, moved: usize) -> Vec<u8> {
    let mut json = gltf_json(glb);
    let count = json["nodes"].as_array().expect("nodes").len() as u64;
    let shift = |value: &mut Value| *value = json!(value.as_u64().expect("an index") + count);
    let mut nodes = json["nodes"].as_array().expect("nodes").clone();
    for node in &mut nodes {
        node["name"] = json!(format!("{PREFIX}{}", node["name"].as_str().unwrap_or_default()));
        node["children"].as_array_mut().into_iter().flatten().for_each(shift);
        if node["children"].is_null() {
            node.as_object_mut().expect("an object").remove("children");
        }
        if node["skin"].is_u64() {
            node["skin"] = json!(1);
        }
    }
    json["nodes"].as_array_mut().expect("nodes").extend(nodes);
    if let Some(skin) = json["skins"].get(0).cloned() {
        let mut skin = skin;
        skin["joints"].as_array_mut().expect("joints").iter_mut().for_each(shift);
        if skin["skeleton"].is_u64() {
            shift(&mut skin["skeleton"]);
        }
        json["skins"].as_array_mut().expect("skins").push(skin);
    }
    if moved == 1 {
        let animations = json["animations"].as_array_mut().expect("a clip");
        let channels =
            animations.iter_mut().flat_map(|animation| animation["channels"].as_array_mut().expect("channels"));
        channels.for_each(|channel| shift(&mut channel["target"]["node"]));
    }
    let roots = json["scenes"][0]["nodes"].as_array().expect("roots").clone();
    let of = |which: &usize| {
        roots.iter().map(|root| json!(root.as_u64().expect("an index") + *which as u64 * count)).collect::<Vec<_>>()
    };
    let scenes: Vec<Value> =
        lists.iter().map(|list| json!({"nodes": list.iter().flat_map(of).collect::<Vec<_>>()})).collect();
    json["scenes"] = json!(scenes);
    json.as_object_mut().expect("an object").remove("scene");
    if let Some(default) = default {
        json["scene"] = json!(default);
    }
    let length = u32::from_le_bytes(glb[12..16].try_into().expect("four bytes")) as usize;
    let bytes = json["buffers"][0]["byteLength"].as_u64().expect("a length") as usize;
    let mut uri = "data:application/octet-stream;base64,".to_owned();
    write!(uri, "{}", STANDARD.encode(&glb[28 + length..28 + length + bytes])).expect("text");
    json["buffers"][0]["uri"] = json!(uri);
    json.to_string().into_bytes()
}

fn retargeted(source: &[u8], target: &[u8], config: &str) -> Outcome {
    let inputs = Inputs {
        source: NamedBytes { name: "source.gltf", bytes: source },
        target: NamedBytes { name: "target.gltf", bytes: target },
        source_rest: None,
        target_rest: None,
        config: Some(NamedBytes { name: "config.json", bytes: config.as_bytes() }),
        formats: &[Format::Gltf],
    };
    engine::retarget(&inputs, &Limits::default(), &Control::new()).expect("it can be retargeted")
}

/// Names of the nodes that the first clip of an output turns.
fn turned(outcome: &Outcome) -> Vec<String> {
    let json = gltf_json(&outcome.outputs[0].bytes);
    let channels = json["animations"][0]["channels"].as_array().expect("channels");
    let turns = channels.iter().filter(|channel| channel["target"]["path"] == "rotation");
    let node = |channel: &Value| channel["target"]["node"].as_u64().expect("a node") as usize;
    turns.map(|channel| json["nodes"][node(channel)]["name"].as_str().expect("a name").to_owned()).collect()
}

fn codes(outcome: &Outcome) -> Vec<&str> {
    outcome.report.warnings.iter().map(|warning| warning.code).collect()
}

#[test]
fn the_character_that_viewers_show_is_the_target() {
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    // Default scene first, second, none said, a scene of its own for each or one for both, a node in no scene.
    // Which characters each scene shows, the default one, whether the second is the target, and whether there is a warning.
    type Case<'a> = (&'a [&'a [usize]], Option<usize>, bool, bool);
    let cases: [Case<'_>; 7] = [
        (&[&[0], &[1]], Some(0), false, true),
        (&[&[0], &[1]], Some(1), true, true),
        (&[&[0], &[1]], None, false, true),
        (&[&[1], &[0]], None, true, true),
        (&[&[0, 1]], Some(0), false, false),
        (&[&[1]], Some(0), true, true),
        (&[&[], &[1]], Some(0), false, true),
    ];
    for (lists, default, is_second, is_warned) in cases {
        let target = twice(&mannequin, lists, default, 0);
        let outcome = retargeted(&walk, &target, "{}");
        let what = format!("{lists:?}, default {default:?}");
        let turned = turned(&outcome);
        assert!(turned.len() > 15, "{what}: {turned:?}");
        assert!(turned.iter().all(|name| name.starts_with(PREFIX) == is_second), "{what}: {turned:?}");
        assert_eq!(codes(&outcome).contains(&"joints_outside_scene"), is_warned, "{what}: {:?}", codes(&outcome));
        assert_same_document(&target, &outcome.outputs[0].bytes, &what);
    }
}

/// Roles and chains by name are the way to a character that viewers do not show.
#[test]
fn a_character_of_another_scene_can_be_asked_for() {
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    let target = twice(&mannequin, &[&[0], &[1]], Some(0), 0);
    let plain = retargeted(&walk, &target, "{}");
    let mut roles = plain.resolved_spec["target"]["roles"].clone();
    for joints in roles.as_object_mut().expect("roles").values_mut() {
        let names = match joints {
            Value::Array(names) => names.iter_mut().collect(),
            name => vec![name],
        };
        for name in names {
            *name = json!(format!("{PREFIX}{}", name.as_str().expect("a joint")));
        }
    }
    let config = json!({"target": {"roles": roles}}).to_string();
    let outcome = retargeted(&walk, &target, &config);
    let turned = turned(&outcome);
    assert!(turned.len() > 15 && turned.iter().all(|name| name.starts_with(PREFIX)), "{turned:?}");
}

#[test]
fn a_clip_of_another_scene_is_not_that_of_the_shown_character() {
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    // The walk is that of the second character.
    for (default, is_shown) in [(1, true), (0, false)] {
        let source = twice(&walk, &[&[0], &[1]], Some(default), 1);
        let outcome = retargeted(&source, &mannequin, "{}");
        assert!(codes(&outcome).contains(&"joints_outside_scene"), "{:?}", codes(&outcome));
        let scene = read_scene(&outcome.outputs[0].bytes, "out.gltf");
        let [first, middle] = [0, scene.clips[0].frame_count() / 2]
            .map(|frame| scene.clips[0].local_pose(&scene.skeleton, frame).to_model(&scene.skeleton));
        let pairs = first.transforms().iter().zip(middle.transforms());
        let farthest = pairs.map(|(one, other)| one.translation.distance(other.translation)).fold(0.0, f64::max);
        assert_eq!(farthest > 0.1, is_shown, "{farthest} m, default scene {default}");
    }
}

#[test]
fn what_is_written_of_several_scenes_is_valid() {
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    let target = twice(&mannequin, &[&[0], &[1]], Some(1), 0);
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("out.gltf");
    std::fs::write(&file, &retargeted(&walk, &target, "{}").outputs[0].bytes).expect("a file");
    let Some(reports) = validate_gltf(&[&file]) else { return };
    let report = &reports[file.as_path()];
    assert_eq!((report["errors"].as_u64(), report["warnings"].as_u64()), (Some(0), Some(0)), "{report}");
}
