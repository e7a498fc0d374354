//! Chain lists as Unreal's IK rigs and retargeters have them: a root and chains of each side, and which drives which.

use serde_json::{Map, Value, json};

use crate::rig::error::{SpecError, SpecErrorKind, SpecField};

const SIDES: [&str; 2] = ["source", "target"];

/// Whether a document is such a list.
pub(in crate::retarget) fn is_map(document: &Value) -> bool {
    SIDES.iter().all(|side| document[side]["BoneChains"].is_array())
}

/// The spec that such a list stands for. Without a `ChainMap`, chains of equal names drive each other.
pub(in crate::retarget) fn convert(document: &Value) -> Result<Value, SpecError> {
    let mut fields = Vec::new();
    let [source, target] = SIDES.map(|side| rig(&document[side], side, &mut fields));
    let map: Vec<Value> = match document["ChainMap"].as_array() {
        Some(rows) => rows
            .iter()
            .enumerate()
            .filter_map(|(index, row)| {
                let [from, onto] = ["SourceChain", "TargetChain"]
                    .map(|field| name(&row[field], &format!("/ChainMap/{index}/{field}"), &mut fields));
                // A target chain that follows none is written with the source None.
                let is_none = from.as_deref() == Some("None");
                from.zip(onto).filter(|_| !is_none).map(|(from, onto)| json!({ "source": from, "target": onto }))
            })
            .collect(),
        None => {
            let known = source["chains"].as_object();
            let names = target["chains"].as_object().into_iter().flatten().map(|(name, _)| name);
            let both = names.filter(|name| known.is_some_and(|known| known.contains_key(*name)));
            both.map(|name| json!({ "source": name, "target": name })).collect()
        }
    };
    match SpecError::from_fields(fields) {
        Some(error) => Err(error),
        None => Ok(json!({ "source": source, "target": target, "map": map })),
    }
}

fn rig(side: &Value, at: &str, fields: &mut Vec<SpecField>) -> Value {
    let mut chains = Map::new();
    for (index, chain) in side["BoneChains"].as_array().into_iter().flatten().enumerate() {
        let pointer = format!("/{at}/BoneChains/{index}");
        let names = ["ChainName", "StartBone", "EndBone"]
            .map(|field| name(&chain[field], &format!("{pointer}/{field}"), fields));
        let [Some(called), Some(start), Some(end)] = names else { continue };
        if chains.insert(called.clone(), json!([start, end])).is_some() {
            let detail = format!("the chain '{called}' is there twice");
            fields.push(SpecField::new(SpecErrorKind::InvalidValue, pointer, detail));
        }
    }
    let mut rig = json!({ "chains": chains });
    if !side["RootBone"].is_null()
        && let Some(root) = name(&side["RootBone"], &format!("/{at}/RootBone"), fields)
    {
        rig["root"] = root.into();
    }
    rig
}

/// A name, which may be wrapped as `{"BoneName": …}`.
fn name(value: &Value, pointer: &str, fields: &mut Vec<SpecField>) -> Option<String> {
    let found = value.as_str().or_else(|| value["BoneName"].as_str()).filter(|name| !name.is_empty());
    if found.is_none() {
        fields.push(SpecField::new(SpecErrorKind::InvalidValue, pointer.to_owned(), "a name belongs here"));
    }
    found.map(str::to_owned)
}
