//! Bones that follow bones, one by one, as chains of single joints.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use crate::rig::error::{SpecError, SpecErrorKind, SpecField};

/// More pairs than this are refused.
const MAX_PAIRS: usize = 10_000;

/// One bone that follows another.
pub(in crate::retarget) struct Pair {
    /// Where it stands in the file, as a pointer.
    pub(in crate::retarget) pointer: String,
    pub(in crate::retarget) source: String,
    pub(in crate::retarget) target: String,
    /// Whether it carries the body.
    pub(in crate::retarget) is_root: bool,
    /// Whether it goes where the source's goes too.
    pub(in crate::retarget) has_position: bool,
}

/// The spec: a chain per pair, called as the target's bone is.
///
/// # Errors
/// When there is no pair, or two follow onto one bone.
pub(in crate::retarget) fn spec(pairs: &[Pair]) -> Result<Value, SpecError> {
    if pairs.is_empty() || pairs.len() > MAX_PAIRS {
        let detail = format!("the bone map has {} pairs of bones; between 1 and {MAX_PAIRS} are read", pairs.len());
        return Err(SpecError::new(SpecErrorKind::Malformed, detail, "export it again with its bones assigned"));
    }
    let mut fields = Vec::new();
    let mut known: BTreeMap<&str, &Pair> = BTreeMap::new();
    let (mut sources, mut targets, mut map) = (Map::new(), Map::new(), Vec::with_capacity(pairs.len()));
    let mut roots: Option<&Pair> = None;
    for pair in pairs {
        if let Some(first) = known.insert(&pair.target, pair) {
            let detail = format!("'{}' follows '{}' already", pair.target, first.source);
            fields.push(SpecField::new(SpecErrorKind::InvalidValue, pair.pointer.clone(), detail));
            continue;
        }
        sources.insert(pair.target.clone(), json!([pair.source, pair.source]));
        targets.insert(pair.target.clone(), json!([pair.target, pair.target]));
        let mut row = json!({ "source": pair.target, "target": pair.target, "rotation": "one_to_one" });
        if pair.has_position && !pair.is_root {
            row["translation"] = "globally_scaled".into();
        }
        map.push(row);
        roots = roots.or(pair.is_root.then_some(pair));
    }
    if let Some(error) = SpecError::from_fields(fields) {
        return Err(error);
    }
    let (mut source, mut target) = (json!({ "chains": sources }), json!({ "chains": targets }));
    if let Some(root) = roots {
        source["root"] = root.source.as_str().into();
        target["root"] = root.target.as_str().into();
    }
    Ok(json!({ "source": source, "target": target, "map": map }))
}
