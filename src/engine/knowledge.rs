//! What the engine knows of rigs beside what it comes with, and what users may keep for later: rig templates and presets.

use std::{borrow::Cow, sync::Arc};

use serde_json::{Map, Value, json};

use crate::{
    retarget::{parse_document, parse_value},
    rig::{Recognizer, RigTemplate, SpecError, SpecErrorKind, SpecField, builtin_templates, parse_template},
};

use super::{Failure, FailureCode, Memory, NamedBytes};

/// What the engine knows beside what it comes with.
#[derive(Clone, Debug, Default)]
pub struct Knowledge {
    rigs: Vec<RigTemplate>,
    /// Templates that nobody has parsed yet.
    unread: Vec<String>,
    /// What was found out before.
    memory: Option<Arc<Memory>>,
}

impl Knowledge {
    /// Reads rig templates, as JSON or YAML. They are tried in this order, before the built-in ones.
    ///
    /// # Errors
    /// When one of them cannot be used.
    pub fn read<'a>(documents: impl IntoIterator<Item = &'a str>) -> Result<Self, Failure> {
        let read = |text: &str| parse_document(text.as_bytes()).and_then(parse_template).map_err(in_rig);
        Ok(Self { rigs: documents.into_iter().map(read).collect::<Result<_, _>>()?, ..Self::default() })
    }

    /// Rig templates as they are written, for somebody else to read: until then they are not among [`Self::rigs`].
    #[must_use]
    pub fn unread(documents: Vec<String>) -> Self {
        Self { unread: documents, ..Self::default() }
    }

    /// The same, with what was found out before; what is found out now is added to it.
    #[must_use]
    pub fn remembering(self, memory: Arc<Memory>) -> Self {
        Self { memory: Some(memory), ..self }
    }

    /// All of it, read.
    ///
    /// # Errors
    /// When a template cannot be used.
    pub fn parsed(&self) -> Result<Cow<'_, Self>, Failure> {
        if self.unread.is_empty() {
            return Ok(Cow::Borrowed(self));
        }
        let Self { mut rigs, .. } = Self::read(self.unread.iter().map(String::as_str))?;
        rigs.extend(self.rigs.iter().cloned());
        Ok(Cow::Owned(Self { rigs, unread: Vec::new(), memory: self.memory.clone() }))
    }

    /// The templates that nobody has read, as they are written.
    #[must_use]
    pub fn written(&self) -> &[String] {
        &self.unread
    }

    /// What recognizes rigs.
    pub(crate) fn recognizer(&self) -> Recognizer<'_> {
        self.memory.as_ref().map_or_else(|| self.rigs.as_slice().into(), |memory| memory.recognizer(&self.rigs))
    }

    /// What was found out before.
    pub(super) fn memory(&self) -> Option<&Memory> {
        self.memory.as_deref()
    }

    /// The user's own rig templates.
    #[must_use]
    pub fn rigs(&self) -> &[RigTemplate] {
        &self.rigs
    }
}

/// The rig templates that the program comes with: name and document.
#[must_use]
pub fn built_in_rigs() -> Vec<(String, Value)> {
    let document = |template: &RigTemplate| Some((template.name.clone(), serde_json::to_value(template).ok()?));
    builtin_templates().iter().filter_map(document).collect()
}

/// Checks a rig template that is to be kept under a name, and gives it back with the name in it.
///
/// # Errors
/// When it cannot be used, or says another name.
pub fn check_rig(name: &str, mut document: Value) -> Result<Value, Failure> {
    if let Value::Object(members) = &mut document {
        let said = members.entry("name").or_insert_with(|| name.into());
        if said.as_str().is_some_and(|said| said != name) {
            let detail = format!("the template calls itself {said}, but is to be kept as '{name}'");
            let field = SpecField::new(SpecErrorKind::InvalidValue, "/name", detail);
            return Err(SpecError::from_fields(vec![field]).map_or_else(|| unusable(name), in_rig));
        }
    }
    let template = parse_template(document).map_err(in_rig)?;
    serde_json::to_value(template).map_err(|_| unusable(name))
}

/// The presets that the program comes with: name and document.
#[must_use]
pub fn built_in_presets() -> Vec<(String, Value)> {
    // What other programs import without questions: one clip, its joints and no mesh, at their usual rate.
    let profile = |fps: u32, format: &str| {
        let output = json!({"format": format, "include": "skeleton+animation", "target_clips": "drop"});
        json!({"edit": {"fps": fps}, "output": output})
    };
    let presets = [
        ("default", json!({})),
        ("plain_fk", json!({"ops": [{"op": "pelvis"}, {"op": "fk"}]})),
        ("animation_only", json!({"output": {"include": "skeleton+animation", "target_clips": "drop"}})),
        ("unreal", profile(30, "fbx")),
        ("unity", profile(30, "fbx")),
        ("godot", profile(30, "glb")),
        ("maya", profile(24, "fbx")),
    ];
    presets.into_iter().map(|(name, document)| (name.to_owned(), document)).collect()
}

/// Checks a preset that is to be kept under a name, and gives it back. A config of another tool becomes a spec of ours.
///
/// # Errors
/// When the name is none, or the document is no config that can be used.
pub fn check_preset(name: &str, document: Value) -> Result<Value, Failure> {
    if !is_name(name) {
        let detail =
            format!("'{name}' is not a valid preset name: use up to 64 lower-case letters, digits, '_' and '-'");
        return Err(Failure::new(FailureCode::InvalidValue, detail).in_part("preset"));
    }
    if crate::drawing::is_draw_document(&document) {
        crate::drawing::parse_draw_value(document.clone()).map_err(in_preset)?;
        return Ok(document);
    }
    let spec = parse_value(document.clone()).map_err(in_preset)?;
    if is_ours(&document) { Ok(document) } else { serde_json::to_value(spec).map_err(|_| unusable(name)) }
}

fn is_name(name: &str) -> bool {
    let is_plain = |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit();
    name.starts_with(is_plain)
        && name.len() <= 64
        && name.chars().all(|letter| is_plain(letter) || matches!(letter, '_' | '-'))
}

/// A config as it is written, JSON or YAML, whatever it says.
///
/// # Errors
/// When it is neither.
pub fn parse_config(bytes: &[u8]) -> Result<Value, Failure> {
    parse_document(bytes).map_err(|error| Failure::from(error).in_part("config"))
}

/// Lays a config over a preset: objects are merged member by member, everything else (lists too) is taken from the config where
/// it says something, and `null` takes a member of the preset away. This is JSON Merge Patch (RFC 7396).
///
/// # Errors
/// When the config is no JSON or YAML object, or one of another tool.
pub fn merge_config(preset: &Value, config: Option<NamedBytes<'_>>) -> Result<String, Failure> {
    let Some(config) = config else { return Ok(preset.to_string()) };
    let in_config = |error: SpecError| Failure::from(error).in_part("config");
    let over = parse_document(config.bytes).map_err(in_config)?;
    let Value::Object(over) = over else {
        parse_value(over).map_err(in_config)?;
        return Ok(preset.to_string());
    };
    if !is_ours(&Value::Object(over.clone())) {
        let detail = "a config of another tool is complete, so it cannot extend a preset";
        let hint = "leave the preset out, or send a config with fields of the retarget spec";
        return Err(Failure::new(FailureCode::InvalidValue, detail).in_part("config").with_hint(hint));
    }
    let mut merged = preset.clone();
    merge_patch(&mut merged, over);
    Ok(merged.to_string())
}

/// Lays an object over a document, as [`merge_config`] says: JSON Merge Patch (RFC 7396).
pub fn merge_patch(merged: &mut Value, over: Map<String, Value>) {
    let mut open = vec![(String::new(), over)];
    while let Some((pointer, over)) = open.pop() {
        let Some(base) = merged.pointer_mut(&pointer) else { continue };
        if !base.is_object() {
            *base = Value::Object(Map::new());
        }
        let Value::Object(members) = base else { continue };
        for (name, value) in over {
            match value {
                Value::Null => drop(members.remove(&name)),
                Value::Object(inner) => {
                    let below = format!("{pointer}/{}", name.replace('~', "~0").replace('/', "~1"));
                    members.entry(name).or_insert(Value::Null);
                    open.push((below, inner));
                }
                value => drop(members.insert(name, value)),
            }
        }
    }
}

/// Whether a document has the shape of our own spec.
fn is_ours(document: &Value) -> bool {
    crate::retarget::is_own_shape(document)
}

fn in_rig(error: SpecError) -> Failure {
    Failure::from(error).in_part("rig")
}

fn in_preset(error: SpecError) -> Failure {
    Failure::from(error).in_part("preset")
}

fn unusable(name: &str) -> Failure {
    Failure::new(FailureCode::Internal, format!("'{name}' cannot be written as JSON"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn merged(preset: Value, config: &str) -> Value {
        let config = NamedBytes { name: "config.yaml", bytes: config.as_bytes() };
        serde_json::from_str(&merge_config(&preset, Some(config)).expect("merges")).expect("JSON")
    }

    #[test]
    fn a_config_is_laid_over_a_preset() {
        let preset = json!({"align": "off", "source": {"root": "Hips", "unit": 0.01}, "ops": [{"op": "fk"}]});
        assert_eq!(merged(preset.clone(), ""), preset, "nothing changes nothing");
        assert_eq!(merged(preset.clone(), "source: {root: Pelvis}")["source"], json!({"root": "Pelvis", "unit": 0.01}));
        assert_eq!(merged(preset.clone(), "ops: []")["ops"], json!([]), "lists are taken whole");
        assert_eq!(merged(preset.clone(), "align: null").get("align"), None, "null takes away");
        assert_eq!(merged(preset.clone(), "source: null").get("source"), None, "objects, too");
        assert_eq!(merged(preset, "target: {chains: {a/b: [x, y]}}")["target"]["chains"]["a/b"], json!(["x", "y"]));
    }

    #[test]
    fn what_is_no_spec_is_not_merged() {
        let ikrig = NamedBytes { name: "ikrig.json", bytes: br#"{"SourceChains": [], "TargetChains": []}"# };
        let refused = merge_config(&json!({}), Some(ikrig)).expect_err("refused");
        assert_eq!(refused.code, FailureCode::InvalidValue, "{refused}");
        let list = NamedBytes { name: "list.json", bytes: b"[1]" };
        assert_eq!(merge_config(&json!({}), Some(list)).expect_err("refused").code, FailureCode::MalformedConfig);
    }

    #[test]
    fn everything_built_in_can_be_used() {
        assert!(built_in_rigs().len() > 5, "there are templates");
        for (name, document) in built_in_rigs() {
            assert_eq!(check_rig(&name, document.clone()).expect(&name), document, "{name} reads back as it is");
        }
        for (name, document) in built_in_presets() {
            assert_eq!(check_preset(&name, document.clone()).expect(&name), document, "{name} reads back as it is");
        }
    }

    #[test]
    fn names_are_checked() {
        let rig = json!({"kind": "biped", "roles": {"pelvis": ["Hips"]}});
        assert_eq!(check_rig("mine", rig.clone()).expect("usable")["name"], "mine", "the name is filled in");
        let other = json!({"name": "other", "kind": "biped", "roles": {"pelvis": ["Hips"]}});
        assert_eq!(check_rig("mine", other).expect_err("refused").errors[0].pointer, "/name");
        assert!(check_rig("No Name", rig).is_err(), "no name");
        assert!(check_preset("../x", json!({})).is_err(), "no name");
        assert!(check_preset("mine", json!({"sorce": {}})).is_err(), "no config");
    }
}
