//! Fields of a document that its JSON Schema does not have, and tags that stand for none of its variants.
//!
//! The schema comes from the spec's own types, so a new field needs nothing here.

use serde_json::{Map, Value};

use super::{
    error::{SpecErrorKind, SpecField},
    lookup::list,
    nearest::{by_likeness, nearest},
};

/// So many things that are wrong are told at once; nobody reads more, and a document could hold any number.
pub(crate) const MAX_TOLD: usize = 100;

/// The fields of `document` that `schema` does not have, and the tags (such as `op`) that no variant has, with the nearest names; the
/// first [`MAX_TOLD`] of each.
pub(crate) fn unknown_fields(document: &Value, schema: &Value) -> Vec<SpecField> {
    let (mut tags, mut found) = (Vec::new(), Vec::new());
    let enter = |pointer: &str, value: &Value, union: &Value| {
        let (Some(tag), Value::Object(fields)) = (Tag::of(union, schema), value) else { return true };
        let wrong = tag.wrong(fields, pointer);
        let is_right = wrong.is_none();
        tags.extend(wrong.filter(|_| tags.len() < MAX_TOLD));
        is_right
    };
    walk_into(document, schema, enter, |pointer, value, node| {
        let Value::Object(fields) = value else { return };
        let properties = properties(node, schema);
        if properties.is_empty() || is_open(node) {
            return;
        }
        let unknown = fields.keys().filter(|name| !properties.iter().any(|(known, _)| known == *name));
        for name in unknown.take(MAX_TOLD - found.len()) {
            let names: Vec<&str> = properties.iter().map(|(known, _)| *known).collect();
            let nearest = nearest(name, names.iter().copied());
            let elsewhere = homes(name, schema, pointer);
            let more = match (elsewhere.as_slice(), nearest.is_empty()) {
                ([], true) => format!("; its fields are {}", list(&names)),
                ([], false) => String::new(),
                (homes, _) => format!("; it belongs to {}", homes.join(" or ")),
            };
            let (at, detail) =
                (format!("{pointer}/{}", escape(name)), format!("there is no field '{name}' here{more}"));
            let did_you_mean = if elsewhere.is_empty() { nearest } else { Vec::new() };
            found.push(SpecField { did_you_mean, ..SpecField::new(SpecErrorKind::UnknownField, at, detail) });
        }
    });
    found.extend(tags);
    found.sort_by(|first, second| first.pointer.cmp(&second.pointer));
    found
}

/// Places that are told where a field is put wrongly.
const MAX_HOMES: usize = 3;
/// Fields are looked for within so many objects.
const MAX_HOME_DEPTH: usize = 4;

/// The objects beside the one at `pointer` in which a document has a field of that name, such as `'output.view'`: the outermost, in the order of
/// the schema.
fn homes(name: &str, schema: &Value, pointer: &str) -> Vec<String> {
    let is_name = |part: &&str| !part.is_empty() && !part.bytes().all(|byte| byte.is_ascii_digit());
    let here = pointer.split('/').filter(is_name).collect::<Vec<_>>().join(".");
    let mut level: Vec<(String, &Value)> = vec![(String::new(), schema)];
    let mut seen: Vec<*const Value> = Vec::new();
    for _ in 0..=MAX_HOME_DEPTH {
        let mut found = Vec::new();
        let mut next = Vec::new();
        while let Some((path, node)) = level.pop() {
            let node = resolve(node, schema);
            if seen.iter().any(|other| std::ptr::eq(*other, node)) {
                continue;
            }
            seen.push(node);
            for key in ["oneOf", "anyOf"] {
                let alternatives = node.get(key).and_then(Value::as_array).into_iter().flatten();
                level.extend(alternatives.rev().map(|alternative| (path.clone(), alternative)));
            }
            level.extend(node.get("items").map(|items| (path.clone(), items)));
            for (own, property) in properties(node, schema) {
                if own == name && path != here {
                    found.push(if path.is_empty() { "the top level".to_owned() } else { format!("'{path}'") });
                }
                let path = if path.is_empty() { own.to_owned() } else { format!("{path}.{own}") };
                next.push((path, property));
            }
        }
        found.dedup();
        if !found.is_empty() {
            found.truncate(MAX_HOMES);
            return found;
        }
        next.reverse();
        level = next;
    }
    Vec::new()
}

/// Visits every value of a document with its pointer and the part of the schema that is about it. The document's depth is bounded
/// by its parser.
pub(crate) fn walk(document: &Value, schema: &Value, visit: impl FnMut(&str, &Value, &Value)) {
    walk_into(document, schema, |_, _, _| true, visit);
}

/// The same; `enter` is asked before of several alternatives one is chosen, and may say that the value is not to be looked into.
fn walk_into(
    document: &Value,
    schema: &Value,
    mut enter: impl FnMut(&str, &Value, &Value) -> bool,
    mut visit: impl FnMut(&str, &Value, &Value),
) {
    let mut pending = vec![(String::new(), document, schema)];
    while let Some((pointer, value, node)) = pending.pop() {
        let union = resolve(node, schema);
        if !enter(&pointer, value, union) {
            continue;
        }
        let node = choose(union, value, schema);
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

/// The field that tells the variants of a tagged union apart, and the values that it may have.
struct Tag<'a> {
    name: &'a str,
    values: Vec<&'a str>,
}

impl<'a> Tag<'a> {
    /// The tag of a union; nothing where it has none.
    fn of(node: &'a Value, schema: &'a Value) -> Option<Self> {
        let variants = node.get("oneOf").and_then(Value::as_array)?;
        let constants = |variant: &'a Value| {
            let all = properties(resolve(variant, schema), schema).into_iter();
            all.filter_map(|(name, property)| Some((name, property.get("const")?.as_str()?))).next()
        };
        let found: Vec<(&str, &str)> = variants.iter().map(constants).collect::<Option<_>>()?;
        let (name, _) = found.first()?;
        found
            .iter()
            .all(|(other, _)| other == name)
            .then(|| Self { name, values: found.iter().map(|(_, value)| *value).collect() })
    }

    /// What is wrong with the tag of an object.
    fn wrong(&self, fields: &Map<String, Value>, pointer: &str) -> Option<SpecField> {
        let Self { name, values } = self;
        /// More are not told at once.
        const MOST: usize = 8;
        let seen = fields.get(*name).and_then(Value::as_str).unwrap_or_default();
        let near = by_likeness(seen, values.iter().copied());
        let known = near.iter().take(MOST).map(|value| format!("'{value}'")).collect::<Vec<_>>().join(", ");
        let known = match near.len().checked_sub(MOST) {
            Some(more @ 1..) => format!("{known} and {more} more"),
            _ => known,
        };
        let (detail, seen) = match fields.get(*name) {
            Some(Value::String(seen)) if values.contains(&seen.as_str()) => return None,
            Some(Value::String(seen)) => (format!("there is no {name} '{seen}'; there are {known}"), seen.as_str()),
            Some(other) => (format!("'{name}' is {other} where one of {known} is expected"), ""),
            None => (format!("'{name}' is missing; it is one of {known}"), ""),
        };
        let field = SpecField::new(SpecErrorKind::InvalidValue, format!("{pointer}/{name}"), detail);
        Some(field.with_nearest(seen, values.iter().copied()))
    }
}

fn resolve<'a>(node: &'a Value, schema: &'a Value) -> &'a Value {
    let pointer = node.get("$ref").and_then(Value::as_str).and_then(|reference| reference.strip_prefix('#'));
    // A node that has properties beside its reference is a tagged variant; its own properties count too.
    match pointer {
        Some(pointer) if node.get("properties").is_none() => schema.pointer(pointer).unwrap_or(node),
        _ => node,
    }
}

/// Of several alternatives, which may have alternatives themselves, the one that the value is meant for: of those whose constant fields
/// agree the first that has the most of its fields, else the first of its type.
fn choose<'a>(node: &'a Value, value: &Value, schema: &'a Value) -> &'a Value {
    let alternatives = ["oneOf", "anyOf"].iter().find_map(|key| node.get(key).and_then(Value::as_array));
    let Some(alternatives) = alternatives else { return node };
    let unknown = |alternative: &'a Value| -> Option<usize> {
        let known = properties(alternative, schema);
        let kind = alternative.get("type").and_then(Value::as_str);
        match value {
            Value::Object(fields) => {
                let is_meant = !known.is_empty() && constants_agree(alternative, fields, schema);
                let is_unknown = |name: &&String| !known.iter().any(|(known, _)| known == name);
                is_meant.then(|| fields.keys().filter(is_unknown).count())
            }
            Value::Array(_) => (kind == Some("array")).then_some(0),
            _ => None,
        }
    };
    let chosen = alternatives.iter().filter_map(|alternative| {
        let alternative = choose(resolve(alternative, schema), value, schema);
        Some((unknown(alternative)?, alternative))
    });
    // `min_by_key` gives the first of equals.
    chosen.min_by_key(|(unknown, _)| *unknown).map_or(node, |(_, alternative)| alternative)
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

/// The words that a place takes, by its part of the schema; none where it takes something else too.
pub(crate) fn words_of(node: &Value) -> Vec<&str> {
    let listed = node.get("enum").and_then(Value::as_array);
    let words = match listed {
        Some(words) => words.iter().map(Value::as_str).collect::<Option<_>>(),
        None => {
            let one_of = node.get("oneOf").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
            one_of.iter().map(|one| one.get("const")?.as_str()).collect()
        }
    };
    words.unwrap_or_default()
}

fn escape(name: &str) -> String {
    name.replace('~', "~0").replace('/', "~1")
}
