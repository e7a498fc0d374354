//! What bodies are: files are bytes, the form that clients use comes first, and examples can be sent as they are.

use serde_json::{Map, Value, json};

use super::operations;

/// The media type under which every file can be described to every generator. Some know no other for bytes.
const BYTES: &str = "application/octet-stream";
const FORM: &str = "multipart/form-data";
const JSON: &str = "application/json";

/// A body of any bytes.
fn bytes() -> Value {
    json!({"schema": {"type": "string", "format": "binary"}})
}

/// Says of every body which it is.
pub(super) fn tell_bytes_and_order(document: &mut Value) {
    let forms = document["components"]["schemas"].clone();
    for operation in operations(document) {
        let id = operation["operationId"].as_str().unwrap_or_default().to_owned();
        for answer in operation["responses"].as_object_mut().into_iter().flat_map(Map::values_mut) {
            if let Some(content) = answer.get_mut("content").and_then(Value::as_object_mut) {
                tell_bytes(content);
            }
        }
        let Some(request) = operation.get_mut("requestBody") else { continue };
        request["required"] = true.into();
        if let Some(content) = request["content"].as_object_mut() {
            order_request(content, &id, &forms);
        }
        if let Some(example) = example_of(&id) {
            request["content"][JSON]["example"] = example;
        }
    }
    let is_form = |(_, schema): &(&String, &Value)| has_files(schema);
    let names: Vec<String> =
        forms.as_object().into_iter().flatten().filter(is_form).map(|(name, _)| name.clone()).collect();
    if let Some(schemas) = document["components"]["schemas"].as_object_mut() {
        schemas.retain(|name, _| !names.contains(name));
    }
}

/// Whether an answer in that media type is a file.
fn is_file(media_type: &str) -> bool {
    let kinds = ["model/", "image/", "video/"];
    media_type == BYTES
        || media_type == "*/*"
        || media_type.ends_with("/zip")
        || media_type.ends_with("/x-npz")
        || kinds.iter().any(|kind| media_type.starts_with(kind))
}

/// Files are bytes, and what may be any of many kinds of file is said as one that all generators know, then in full.
fn tell_bytes(content: &mut Map<String, Value>) {
    if !content.keys().any(|media_type| is_file(media_type)) {
        return;
    }
    let before = std::mem::take(content);
    content.insert(BYTES.to_owned(), bytes());
    for (media_type, _) in before {
        content.insert(media_type, bytes());
    }
}

/// Whether a schema is that of a form with files.
fn has_files(schema: &Value) -> bool {
    let members = schema["properties"].as_object().into_iter().flat_map(Map::values);
    members.into_iter().any(|member| member["contentMediaType"] == BYTES)
}

/// Routes that answer a form with the file itself. Their JSON is told in words: where a route lists it, some generators send it whatever
/// they are given, and empty where they are given a form.
const ONE_SHOTS: [&str; 3] = ["retarget", "edit", "pose"];

/// The body of a request: bytes before forms before JSON, since many generators see the first alone; but a job is asked for in JSON.
fn order_request(content: &mut Map<String, Value>, id: &str, forms: &Value) {
    let mut before = std::mem::take(content);
    if ONE_SHOTS.contains(&id) {
        before.remove(JSON);
    }
    let is_second = id == "create_job" && before.contains_key(JSON);
    let order = if is_second { [JSON, FORM, BYTES] } else { [BYTES, FORM, JSON] };
    for media_type in order {
        let Some(mut body) = before.remove(media_type) else { continue };
        match media_type {
            BYTES => body = bytes(),
            // A form that is not the first is told in words: generators that see one alone would name what they did not make.
            FORM if is_second => {
                let description = "The parts of `POST /v1/retarget`.";
                body = json!({"schema": {"type": "object", "additionalProperties": true, "description": description}});
            }
            FORM => body["schema"] = form_of(&body["schema"], id, forms),
            _ => {}
        }
        content.insert(media_type.to_owned(), body);
    }
    content.extend(before);
}

/// The form of one operation. It stands at the operation and is a type of its own: a form that several share is one that generators
/// name and do not make.
fn form_of(schema: &Value, id: &str, forms: &Value) -> Value {
    let name = schema["$ref"].as_str().and_then(|place| place.rsplit('/').next()).unwrap_or_default();
    let mut form = if name.is_empty() { schema.clone() } else { forms[name].clone() };
    let in_json = match ONE_SHOTS.contains(&id) {
        true => " JSON with the same members does it too, each file as `{\"asset\": \"ast_…\"}`.",
        false => "",
    };
    form["additionalProperties"] = false.into();
    form["description"] =
        format!("The parts of `{id}`, in any order. An optional part that is empty counts as absent.{in_json}").into();
    for (name, member) in form["properties"].as_object_mut().into_iter().flatten() {
        if member["contentMediaType"] == BYTES {
            member["format"] = "binary".into();
        } else {
            // What explorers put into the field to begin with.
            member["example"] = if name == "config" { "{}" } else { "" }.into();
        }
    }
    form
}

/// A body that can be sent as it is: its files are the samples that every caller has.
fn example_of(id: &str) -> Option<Value> {
    const SOURCE: &str = "ast_00000000000000000000000001";
    const TARGET: &str = "ast_00000000000000000000000002";
    let files = json!({"source": {"asset": SOURCE}, "target": {"asset": TARGET}});
    Some(match id {
        "create_job" => json!({"source": {"asset": SOURCE}, "target": {"asset": TARGET}, "output": ["glb"]}),
        "create_batch" => json!({"defaults": {"target": {"asset": TARGET}}, "items": [{"source": {"asset": SOURCE}}]}),
        "check_config" => json!({"config": {"align": "auto", "output": {"format": "glb"}}}),
        "suggest" | "explain" => files,
        "fetch_asset" => json!({"url": "https://studio.example/clips/walk.bvh"}),
        "create_key" => json!({"principal": "studio", "scopes": ["read", "write"]}),
        "create_webhook" => {
            json!({"url": "https://studio.example/hooks/retargetd", "events": ["job.succeeded", "job.failed"]})
        }
        "put_preset" => json!({"align": "full", "output": {"format": "glb"}}),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::super::super::openapi_document;
    use super::*;

    #[test]
    fn files_are_bytes_and_no_form_is_shared() {
        let document = openapi_document();
        let operation = |path: &str, method: &str| document["paths"][path][method].clone();
        let upload = operation("/v1/assets", "post");
        let first = upload["requestBody"]["content"].as_object().expect("bodies").keys().next().expect("one");
        assert_eq!(first, BYTES, "the file itself before everything else");
        let download = operation("/v1/results/{id}/content", "get");
        assert_eq!(download["responses"]["200"]["content"][BYTES], bytes(), "what comes back is bytes");
        let form = operation("/v1/retarget", "post")["requestBody"]["content"][FORM]["schema"].clone();
        assert_eq!(form["properties"]["source"]["format"], "binary", "files of a form too");
        assert!(form.get("$ref").is_none(), "a type of its own");
        assert!(!document["components"].to_string().contains("contentMediaType\":\"application/octet-stream"), "moved");
    }

    #[test]
    fn what_is_sent_has_one_kind_of_body_first() {
        let document = openapi_document();
        let content = document["paths"]["/v1/jobs"]["post"]["requestBody"]["content"].clone();
        let kinds: Vec<&String> = content.as_object().expect("bodies").keys().collect();
        assert_eq!(kinds, [JSON, FORM], "a job is asked for in JSON");
        assert_eq!(content[JSON]["example"]["output"], json!(["glb"]), "with an example of nothing that is not needed");
    }
}
