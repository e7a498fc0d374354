//! Fields of a document that its JSON Schema does not have.
//!
//! The schema comes from the spec's own types, so a new field needs nothing here.

use serde_json::{Map, Value};

use super::error::{SpecErrorKind, SpecField};

/// Every field of `document` that `schema` does not have, with the nearest names.
pub(super) fn unknown_fields(document: &Value, schema: &Value) -> Vec<SpecField> {
    let mut found = Vec::new();
    walk(document, schema, |pointer, value, node| {
        let Value::Object(fields) = value else { return };
        let properties = properties(node, schema);
        if properties.is_empty() || is_open(node) {
            return;
        }
        for name in fields.keys().filter(|name| !properties.iter().any(|(known, _)| known == *name)) {
            let names = properties.iter().map(|(known, _)| *known);
            let at = format!("{pointer}/{}", escape(name));
            let detail = format!("there is no field '{name}' here");
            found.push(SpecField::new(SpecErrorKind::UnknownField, at, detail).with_nearest(name, names));
        }
    });
    found.sort_by(|first, second| first.pointer.cmp(&second.pointer));
    found
}

/// Visits every value of a document with its pointer and the part of the schema that is about it. The document's depth is bounded
/// by its parser.
pub(super) fn walk(document: &Value, schema: &Value, mut visit: impl FnMut(&str, &Value, &Value)) {
    let mut pending = vec![(String::new(), document, schema)];
    while let Some((pointer, value, node)) = pending.pop() {
        let node = choose(resolve(node, schema), value, schema);
        visit(&pointer, value, node);
        match value {
            Value::Object(fields) => {
                let properties = properties(node, schema);
                for (name, field) in fields {
                    let at = format!("{pointer}/{}", escape(name));
                    if let Some(property) = properties.iter().find(|(known, _)| *known == name) {
                        pending.push((at, field, property.1));
                    } else if is_open(node) {
                        pending.push((at, field, &node["additionalProperties"]));
                    }
                }
            }
            Value::Array(items) => {
                if let Some(item_schema) = node.get("items") {
                    let item = |(index, item)| (format!("{pointer}/{index}"), item, item_schema);
                    pending.extend(items.iter().enumerate().map(item));
                }
            }
            _ => {}
        }
    }
}

/// Whether an object may have fields of any name.
fn is_open(node: &Value) -> bool {
    node.get("additionalProperties").is_some_and(Value::is_object)
}

fn resolve<'a>(node: &'a Value, schema: &'a Value) -> &'a Value {
    let pointer = node.get("$ref").and_then(Value::as_str).and_then(|reference| reference.strip_prefix('#'));
    // A node that has properties beside its reference is a tagged variant; its own properties count too.
    match pointer {
        Some(pointer) if node.get("properties").is_none() => schema.pointer(pointer).unwrap_or(node),
        _ => node,
    }
}

/// Of several alternatives the one that the value is meant for: the one whose constant fields agree, else the first of its type.
fn choose<'a>(node: &'a Value, value: &Value, schema: &'a Value) -> &'a Value {
    let alternatives = ["oneOf", "anyOf"].iter().find_map(|key| node.get(key).and_then(Value::as_array));
    let Some(alternatives) = alternatives else { return node };
    let fits = |alternative: &&'a Value| {
        let alternative = resolve(alternative, schema);
        let is_object = !properties(alternative, schema).is_empty();
        let kind = alternative.get("type").and_then(Value::as_str);
        match value {
            Value::Object(fields) => is_object && constants_agree(alternative, fields, schema),
            Value::Array(_) => kind == Some("array"),
            _ => false,
        }
    };
    alternatives.iter().find(fits).map_or(node, |alternative| resolve(alternative, schema))
}

fn constants_agree(node: &Value, fields: &Map<String, Value>, schema: &Value) -> bool {
    properties(node, schema).iter().all(|(name, property)| match (property.get("const"), fields.get(*name)) {
        (Some(constant), Some(value)) => constant == value,
        _ => true,
    })
}

fn properties<'a>(node: &'a Value, schema: &'a Value) -> Vec<(&'a str, &'a Value)> {
    let mut all = Vec::new();
    let referenced = node
        .get("$ref")
        .and_then(Value::as_str)
        .and_then(|reference| reference.strip_prefix('#'))
        .and_then(|pointer| schema.pointer(pointer));
    for part in [Some(node), referenced].into_iter().flatten() {
        if let Some(fields) = part.get("properties").and_then(Value::as_object) {
            all.extend(fields.iter().map(|(name, property)| (name.as_str(), property)));
        }
    }
    all
}

fn escape(name: &str) -> String {
    name.replace('~', "~0").replace('/', "~1")
}
