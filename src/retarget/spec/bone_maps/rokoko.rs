//! Rokoko's custom naming schemes: JSON with the names that each part of a body may have, on any rig.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::rig::error::{SpecError, SpecErrorKind, SpecField};

/// Parts of the middle: the scheme's word, the role, and which joint of the role it is.
const MIDDLE: [(&str, &str, usize); 5] =
    [("hip", "pelvis", 0), ("spine", "spine", 0), ("chest", "spine", 1), ("neck", "neck", 0), ("head", "head", 0)];
/// Parts of a side, behind `left` or `right`.
const OF_A_SIDE: [(&str, &str, usize); 30] = [
    ("eye", "eye", 0),
    ("shoulder", "clavicle", 0),
    ("upperarm", "upper_arm", 0),
    ("lowerarm", "forearm", 0),
    ("hand", "hand", 0),
    ("upleg", "thigh", 0),
    ("upperleg", "thigh", 0),
    ("leg", "shin", 0),
    ("lowerleg", "shin", 0),
    ("foot", "foot", 0),
    ("toe", "toe", 0),
    ("toes", "toe", 0),
    ("thumbproximal", "thumb", 0),
    ("thumbmedial", "thumb", 1),
    ("thumbdistal", "thumb", 2),
    ("indexproximal", "index", 0),
    ("indexmedial", "index", 1),
    ("indexdistal", "index", 2),
    ("middleproximal", "middle", 0),
    ("middlemedial", "middle", 1),
    ("middledistal", "middle", 2),
    ("ringproximal", "ring", 0),
    ("ringmedial", "ring", 1),
    ("ringdistal", "ring", 2),
    ("littleproximal", "pinky", 0),
    ("littlemedial", "pinky", 1),
    ("littledistal", "pinky", 2),
    ("pinkyproximal", "pinky", 0),
    ("pinkymedial", "pinky", 1),
    ("pinkydistal", "pinky", 2),
];

/// Whether a document is such a scheme.
pub(in crate::retarget) fn is_scheme(document: &Value) -> bool {
    document.get("rokoko_custom_names").is_some() && document["bones"].is_object()
}

/// The spec that a scheme stands for: names for the roles of both rigs.
pub(in crate::retarget) fn convert(document: &Value) -> Result<Value, SpecError> {
    let mut roles: BTreeMap<String, Vec<Vec<String>>> = BTreeMap::new();
    let mut fields = Vec::new();
    for (part, names) in document["bones"].as_object().into_iter().flatten() {
        let pointer = format!("/bones/{}", part.replace('~', "~0").replace('/', "~1"));
        let all: Option<Vec<String>> =
            names.as_array().map(|names| names.iter().filter_map(|name| name.as_str().map(str::to_owned)).collect());
        let Some(all) = all else {
            fields.push(SpecField::new(SpecErrorKind::InvalidValue, pointer, "a list of names belongs here"));
            continue;
        };
        let Some((role, place)) = role_of(part) else {
            let detail = format!("'{part}' is no part of a body that is known");
            let field = SpecField::new(SpecErrorKind::UnknownName, pointer, detail);
            fields.push(field.with_nearest(part, MIDDLE.iter().chain(&OF_A_SIDE).map(|(word, ..)| *word)));
            continue;
        };
        let joints = roles.entry(role).or_default();
        joints.resize(joints.len().max(place + 1), Vec::new());
        joints[place].extend(all);
    }
    match SpecError::from_fields(fields) {
        Some(error) => Err(error),
        None => Ok(json!({ "source": { "role_names": roles }, "target": { "role_names": roles } })),
    }
}

fn role_of(part: &str) -> Option<(String, usize)> {
    let folded: String = part.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_lowercase();
    if let Some((_, role, place)) = MIDDLE.iter().find(|(word, ..)| *word == folded) {
        return Some(((*role).to_owned(), *place));
    }
    let (side, word) = ["left", "right"].into_iter().find_map(|side| Some((side, folded.strip_prefix(side)?)))?;
    let (_, role, place) = OF_A_SIDE.iter().find(|(known, ..)| *known == word)?;
    Some((format!("{side}_{role}"), *place))
}
