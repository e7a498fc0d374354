//! The config's own schema, where a config stands.
//!
//! As generators of clients can use it: objects, words, numbers and lists are typed, and what may be one of several things (a name or a number,
//! a word or an object, the many ops) is left open there. `GET /v1/schemas/retarget-spec` has all of it.

use std::collections::BTreeSet;

use serde_json::{Map, Value, json};

use super::{each_object, leave_out_null_type, schema_of};
use crate::engine::spec_schema;

/// What the schemas of a config's parts begin with, so that they are told from those of the service.
const PREFIX: &str = "Spec";
const ROOT: &str = "RetargetSpec";
const PARTS: &str = "#/$defs/";
/// The part that is one of all ops.
const OP: &str = "Op";
/// What a schema of one value says besides its description.
const FACTS: [&str; 8] =
    ["type", "format", "enum", "minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum", "default"];

/// Members that are a whole config: (schema, member).
const CONFIGS: [(&str, &str); 6] = [
    ("NewJob", "config"),
    ("NewConfigCheck", "config"),
    ("NewMappingSuggestion", "config"),
    ("CheckedConfig", "spec"),
    ("Proposal", "resolved_spec"),
    ("NewEdit", "config"),
];

/// Puts the config's schema among the schemas, and refers to it where a config stands.
pub(super) fn give_configs_their_schema(document: &mut Value) {
    let mut root = spec_schema().clone();
    each_object(&mut root, &mut merge_words);
    let parts = root.as_object_mut().and_then(|root| root.remove("$defs")).unwrap_or_default();
    let parts = parts.as_object().cloned().unwrap_or_default();
    let mut needed = BTreeSet::new();
    let mut schemas = Map::new();
    schemas.insert(ROOT.to_owned(), simplified(&root, &parts, &mut needed));
    let mut done = BTreeSet::new();
    loop {
        let next: Option<String> = needed.difference(&done).next().cloned();
        let Some(name) = next else { break };
        let schema = simplified(&parts[&name], &parts, &mut needed);
        schemas.insert(format!("{PREFIX}{name}"), schema);
        done.insert(name);
    }
    if let Some(all) = document["components"]["schemas"].as_object_mut() {
        all.extend(schemas);
    }
    for (schema, member) in CONFIGS {
        let Some(schema) = schema_of(document, schema) else { continue };
        for place in members_called(schema, member) {
            let description = place.get("description").cloned();
            *place = json!({"$ref": format!("#/components/schemas/{ROOT}")});
            if let Some(description) = description {
                place["description"] = description;
            }
        }
    }
}

/// The words of a part of the config that is one of a closed set, as the schema of a parameter.
pub(super) fn words_of(part: &str) -> Value {
    let mut schema = spec_schema()["$defs"][part].clone();
    each_object(&mut schema, &mut merge_words);
    json!({"enum": schema["enum"]})
}

/// The members of that name of a schema, also where it is put together of several.
fn members_called<'s>(schema: &'s mut Value, name: &str) -> Vec<&'s mut Value> {
    let Some(schema) = schema.as_object_mut() else { return Vec::new() };
    let mut found = Vec::new();
    for (key, value) in schema {
        match key.as_str() {
            "properties" => found.extend(value.get_mut(name)),
            "allOf" => {
                let parts = value.as_array_mut().into_iter().flatten();
                found.extend(parts.filter_map(|part| part.get_mut("properties")?.get_mut(name)));
            }
            _ => {}
        }
    }
    found
}

/// Whether a part is a type that every generator has: words, or an object with members.
fn is_plain(part: &Value) -> bool {
    let is_union = ["oneOf", "anyOf", "allOf", "$ref"].iter().any(|key| part.get(key).is_some());
    let is_words = part["type"] == "string" && part.get("enum").is_some();
    is_words || (part["type"] == "object" && part.get("properties").is_some() && !is_union)
}

/// A schema without what generators cannot use. The parts that it refers to are added to `needed`.
fn simplified(schema: &Value, parts: &Map<String, Value>, needed: &mut BTreeSet<String>) -> Value {
    let mut simple = Map::new();
    let described = |simple: &mut Map<String, Value>, schema: &Value| {
        if let Some(description) = schema.get("description") {
            simple.insert("description".to_owned(), description.clone());
        }
    };
    described(&mut simple, schema);
    if let Some(name) = part_of(schema) {
        match parts.get(name) {
            Some(part) if name == OP => {
                simple.extend(op(part));
            }
            Some(part) if is_plain(part) => {
                needed.insert(name.to_owned());
                simple.insert("$ref".to_owned(), format!("#/components/schemas/{PREFIX}{name}").into());
            }
            // One of several things: what it is is said in words.
            Some(part) if !simple.contains_key("description") => described(&mut simple, part),
            _ => {}
        }
        return simple.into();
    }
    match schema["type"].as_str() {
        Some("object") if schema.get("properties").is_some() => {
            let properties = schema["properties"].as_object().into_iter().flatten();
            let properties: Map<String, Value> =
                properties.map(|(name, member)| (name.clone(), simplified(member, parts, needed))).collect();
            simple.insert("type".to_owned(), "object".into());
            simple.extend(schema.get("required").map(|required| ("required".to_owned(), required.clone())));
            simple.insert("properties".to_owned(), properties.into());
            simple.insert("additionalProperties".to_owned(), false.into());
        }
        Some("object") => {
            simple.insert("type".to_owned(), "object".into());
            simple.insert("additionalProperties".to_owned(), true.into());
        }
        Some("array") => {
            simple.insert("type".to_owned(), "array".into());
            let items = schema.get("items").map_or_else(|| json!({}), |items| simplified(items, parts, needed));
            simple.insert("items".to_owned(), items);
            for bound in ["minItems", "maxItems"] {
                simple.extend(schema.get(bound).map(|count| (bound.to_owned(), count.clone())));
            }
        }
        Some(_) => {
            let facts = FACTS.iter().filter_map(|fact| Some(((*fact).to_owned(), schema.get(fact)?.clone())));
            simple.extend(facts.filter(|(_, fact)| !fact.is_null()));
        }
        // A union, or a value that may be anything.
        None => {}
    }
    simple.into()
}

/// The name of the part that a schema refers to, also where it may be left out.
fn part_of(schema: &Value) -> Option<&str> {
    if let Some(place) = schema["$ref"].as_str() {
        return place.strip_prefix(PARTS);
    }
    let variants = schema.get("anyOf").or_else(|| schema.get("oneOf"))?.as_array()?;
    let mut others = variants.iter().filter(|variant| variant["type"] != "null");
    let only = others.next().filter(|_| others.next().is_none())?;
    only["$ref"].as_str()?.strip_prefix(PARTS)
}

/// An op: its name, and members of its own.
fn op(part: &Value) -> Map<String, Value> {
    let variants = part["oneOf"].as_array().into_iter().flatten();
    let names: Vec<Value> = variants.filter_map(|variant| variant["properties"]["op"].get("const").cloned()).collect();
    let schema = json!({"type": "object", "required": ["op"], "additionalProperties": true,
        "properties": {"op": {"type": "string", "enum": names}}});
    schema.as_object().cloned().unwrap_or_default()
}

/// Words that are told one by one, each with what it means, are one set of words; a member that may be null is one that may be absent.
fn merge_words(schema: &mut Map<String, Value>) {
    leave_out_null_type(schema);
    for union in ["oneOf", "anyOf"] {
        let Some(Value::Array(variants)) = schema.get(union) else { continue };
        let (mut words, mut told) = (Vec::new(), String::new());
        for variant in variants {
            let own: Vec<&Value> = match (variant.get("const"), variant["enum"].as_array()) {
                (Some(word), None) => vec![word],
                (None, Some(set)) => set.iter().collect(),
                _ => return,
            };
            if !own.iter().all(|word| word.is_string()) {
                return;
            }
            if let (Some(text), [word]) = (variant["description"].as_str(), own.as_slice()) {
                told.push_str(&format!("\n- `{}`: {text}", word.as_str().unwrap_or_default()));
            }
            words.extend(own.into_iter().cloned());
        }
        let before = schema.get("description").and_then(Value::as_str).unwrap_or_default();
        let description = format!("{before}\n{told}").trim().to_owned();
        schema.remove(union);
        schema.insert("type".to_owned(), "string".into());
        schema.insert("enum".to_owned(), words.into());
        schema.insert("description".to_owned(), description.into());
        return;
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::openapi_document;
    use super::*;

    #[test]
    fn a_config_is_typed_wherever_it_stands() {
        let document = openapi_document();
        let schemas = &document["components"]["schemas"];
        let config = &schemas["NewJob"]["properties"]["config"];
        assert_eq!(config["$ref"], format!("#/components/schemas/{ROOT}"), "{config}");
        let members = &schemas[ROOT]["properties"];
        assert!(members["align"]["$ref"].is_string() && schemas["SpecAlign"]["enum"].is_array(), "words: {members}");
        assert_eq!(members["ops"]["items"]["properties"]["op"]["enum"][0], "pelvis", "the names of the ops");
        assert!(!document.to_string().contains(PARTS), "and every part is among the schemas");
    }
}
