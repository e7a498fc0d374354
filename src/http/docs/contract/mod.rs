//! The OpenAPI document as a contract: what generators of clients need of it, and the types at the routes cannot say.
//!
//! Everything here is about how things are said, not what: bytes are bytes to every generator, closed sets of words are named types, what
//! may be left out is never null, and the config has its own schema.

mod bodies;
mod spec;
mod words;

use serde_json::{Map, Value, json};
use utoipa::openapi::OpenApi as Document;

/// The document as it is served.
pub(super) fn of(document: &Document) -> Value {
    let mut document = serde_json::to_value(document).unwrap_or_default();
    spec::give_configs_their_schema(&mut document);
    words::name_closed_sets(&mut document);
    leave_out_null(&mut document);
    leave_unions_bare(&mut document);
    close_objects(&mut document);
    bodies::tell_bytes_and_order(&mut document);
    tell_forms_of_parameters(&mut document);
    begin_with_what_is_used_most(&mut document);
    document["servers"] = json!([
        {"url": "/", "description": "The service that this document is from"},
        {"url": "http://127.0.0.1:8080", "description": "Where `retargetd serve` listens"},
    ]);
    document
}

/// Explorers list operations in the order of the document: those that everybody needs come first.
fn begin_with_what_is_used_most(document: &mut Value) {
    const FIRST: [&str; 5] = ["/v1/retarget", "/v1/assets", "/v1/jobs", "/v1/batches", "/v1/results"];
    let Some(paths) = document["paths"].as_object_mut() else { return };
    let rank = |path: &str| FIRST.iter().position(|first| path.starts_with(first)).unwrap_or(FIRST.len());
    let mut ordered: Vec<(String, Value)> = std::mem::take(paths).into_iter().collect();
    ordered.sort_by_key(|(path, _)| rank(path));
    paths.extend(ordered);
}

/// What a parameter looks like, wherever it is sent.
fn tell_forms_of_parameters(document: &mut Value) {
    const TAGS: &str = r#"^(\*|(W/)?"[^"]*"(, *(W/)?"[^"]*")*)$"#;
    for operation in operations(document) {
        let changes = operation.get("requestBody").is_some();
        let parameters = operation.get_mut("parameters").and_then(Value::as_array_mut);
        for parameter in parameters.into_iter().flatten() {
            let form = match parameter["name"].as_str() {
                Some("Idempotency-Key") => json!({"pattern": "^[!-~]{1,253}$"}),
                Some("Last-Event-ID") => json!({"pattern": "^[0-9]{1,15}$"}),
                // Of a change, only that there is nothing yet.
                Some("If-None-Match") if changes => json!({"pattern": r"^\*$"}),
                Some("If-Match" | "If-None-Match") => json!({"pattern": TAGS}),
                Some("camera") => spec::words_of("CameraKind"),
                Some("follow") => spec::words_of("Follow"),
                Some("background") => spec::words_of("Background"),
                Some("style") => spec::words_of("Style"),
                Some("fps") => json!({"minimum": 1, "maximum": 60}),
                Some("size") => json!({"pattern": "^[1-9][0-9]{1,3}(x[1-9][0-9]{1,3})?$"}),
                Some("sheet") => json!({"pattern": "^[1-9][0-9]?x[1-9][0-9]?$"}),
                Some("since") => json!({"format": "date-time"}),
                Some("label") => json!({"pattern": "^[^=]+="}),
                Some("joint") => json!({"minLength": 1}),
                Some("frame") => json!({"maximum": u32::MAX}),
                _ => continue,
            };
            if let (Value::Object(schema), Value::Object(form)) = (&mut parameter["schema"], form) {
                schema.extend(form);
            }
        }
    }
}

/// Of a type that may be null, only the other types.
fn leave_out_null_type(schema: &mut Map<String, Value>) {
    if let Some(Value::Array(types)) = schema.get_mut("type") {
        types.retain(|kind| kind != "null");
        if let [only] = types.as_slice() {
            let only = only.clone();
            schema.insert("type".to_owned(), only);
        }
    }
}

/// What may be absent is absent and never null, in requests and answers alike.
fn leave_out_null(value: &mut Value) {
    each_object(value, &mut |schema| {
        leave_out_null_type(schema);
        for union in ["oneOf", "anyOf"] {
            let Some(Value::Array(variants)) = schema.get_mut(union) else { continue };
            variants.retain(|variant| variant["type"] != "null");
            let [Value::Object(only)] = variants.as_slice() else { continue };
            let only = only.clone();
            schema.remove(union);
            for (name, member) in only {
                schema.entry(name).or_insert(member);
            }
        }
    });
}

/// References in unions stand by themselves: some generators lose what is said beside them, and the type with it.
fn leave_unions_bare(value: &mut Value) {
    each_object(value, &mut |schema| {
        for union in ["oneOf", "anyOf"] {
            for variant in schema.get_mut(union).and_then(Value::as_array_mut).into_iter().flatten() {
                if let Some(reference) = variant.get("$ref").cloned() {
                    *variant = json!({"$ref": reference});
                }
            }
        }
    });
}

/// An object of which nothing is known may have any members, and says so: else generators make it one that has none. Where it stands beside
/// what is known of the same object, it says nothing.
fn close_objects(value: &mut Value) {
    let is_open = |schema: &Value| {
        schema["type"] == "object" && schema.get("properties").is_none() && schema.get("$ref").is_none()
    };
    each_object(value, &mut |schema| {
        if let Some(Value::Array(parts)) = schema.get_mut("allOf") {
            let told: Vec<Value> =
                parts.iter().filter(|part| is_open(part)).map(|part| part["description"].clone()).collect();
            parts.retain(|part| !is_open(part));
            if let ([Value::Object(only)], false) = (parts.as_slice(), told.is_empty()) {
                let only = only.clone();
                let own = schema.get("description").cloned();
                let words: Vec<&str> = own.iter().chain(&told).filter_map(Value::as_str).collect();
                let description = words.join("\n\n");
                schema.remove("allOf");
                schema.extend(only);
                schema.insert("description".to_owned(), description.into());
            }
        }
        let has = |key: &str| schema.contains_key(key);
        let is_bare = !["properties", "additionalProperties", "allOf", "$ref", "oneOf"].iter().any(|key| has(key));
        if schema.get("type").is_some_and(|kind| kind == "object") && is_bare {
            schema.insert("additionalProperties".to_owned(), true.into());
        }
    });
}

/// Every object in a document, the inner ones first.
fn each_object(value: &mut Value, change: &mut impl FnMut(&mut Map<String, Value>)) {
    match value {
        Value::Object(members) => {
            members.values_mut().for_each(|member| each_object(member, change));
            change(members);
        }
        Value::Array(items) => items.iter_mut().for_each(|item| each_object(item, change)),
        _ => {}
    }
}

/// The operations of a document.
fn operations(document: &mut Value) -> impl Iterator<Item = &mut Value> {
    let paths = document["paths"].as_object_mut().into_iter().flat_map(Map::values_mut);
    paths.filter_map(Value::as_object_mut).flat_map(Map::values_mut)
}

/// A schema of the document by its name.
fn schema_of<'d>(document: &'d mut Value, name: &str) -> Option<&'d mut Value> {
    document["components"]["schemas"].get_mut(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_may_be_left_out_is_never_null() {
        let mut document = json!({"a": {"type": ["string", "null"], "description": "text"},
            "b": {"oneOf": [{"$ref": "#/x", "description": "inner"}, {"type": "null"}], "description": "outer"},
            "c": {"oneOf": [{"$ref": "#/x", "description": "lost"}, {"$ref": "#/y"}]}});
        leave_out_null(&mut document);
        leave_unions_bare(&mut document);
        let expected = json!({"a": {"type": "string", "description": "text"},
            "b": {"description": "outer", "$ref": "#/x"}, "c": {"oneOf": [{"$ref": "#/x"}, {"$ref": "#/y"}]}});
        assert_eq!(document, expected, "one type, one reference, references alone");
    }
}
