//! Closed sets of words, as named types: a client that misspells one does not compile.

use serde_json::{Value, json};

use super::{operations, schema_of};
use crate::{
    engine::{FindingCode, Format, Phase, Severity},
    http::code::Code,
    jobs::{DeliveryState, JobKind, JobState, JobVerdict, Scope},
};

/// A named set: its name, what it is, and the words.
type Words = (&'static str, &'static str, Vec<&'static str>);

/// All of them.
fn all() -> Vec<Words> {
    let events = ["job.queued", "job.running", "job.canceling", "job.succeeded", "job.failed", "job.canceled"];
    vec![
        ("JobState", "The last three never change.", JobState::ALL.map(JobState::name).to_vec()),
        ("JobKind", "What a job does.", JobKind::ALL.map(JobKind::name).to_vec()),
        ("Verdict", "What a report says of a result as a whole.", JobVerdict::ALL.map(JobVerdict::name).to_vec()),
        ("Phase", "What a job is at.", Phase::ALL.map(Phase::name).to_vec()),
        (
            "FormatName",
            "A file format, as `GET /v1/formats` lists them.",
            Format::ALL.map(|format| format.info().name).to_vec(),
        ),
        (
            "ProblemCode",
            "What went wrong; `/problems` explains each.",
            Code::ALL.iter().map(|code| code.name()).collect(),
        ),
        (
            "FindingCode",
            "Something about a rig; `GET /v1/findings` explains each.",
            FindingCode::ALL.iter().map(|code| code.name()).collect(),
        ),
        ("Severity", "How bad a finding is.", Severity::ALL.map(Severity::name).to_vec()),
        ("Scope", "What a key allows.", Scope::ALL.map(Scope::name).to_vec()),
        ("JobEventType", "`job.` and the state that a job came into.", events.to_vec()),
        ("WebhookEventType", "What a webhook is told.", events[3..].to_vec()),
        ("DeliveryType", "What a webhook was told.", events[3..].iter().copied().chain(["ping"]).collect()),
        ("DeliveryState", "How far a delivery is.", DeliveryState::ALL.map(DeliveryState::name).to_vec()),
        ("WebhookState", "Whether a webhook is told anything.", vec!["enabled", "disabled"]),
        ("CacheWord", "Whether results were taken from another job.", vec!["hit", "miss"]),
        ("LimitUnit", "What the value of a limit counts.", vec!["bytes", "seconds", "count"]),
    ]
}

/// Members that hold one of the words, or a list of them: (schema, member, words).
const MEMBERS: [(&str, &str, &str); 29] = [
    ("Job", "state", "JobState"),
    ("Job", "kind", "JobKind"),
    ("Job", "verdict", "Verdict"),
    ("Job", "output", "FormatName"),
    ("Job", "cache", "CacheWord"),
    ("NewJob", "output", "FormatName"),
    ("Asset", "format", "FormatName"),
    ("Result", "format", "FormatName"),
    ("Format", "name", "FormatName"),
    ("Skeleton", "format", "FormatName"),
    ("Batch", "state", "JobState"),
    ("Batch", "on_error", "OnError"),
    ("JobEvent", "type", "JobEventType"),
    ("JobEvent", "state", "JobState"),
    ("JobEvent", "verdict", "Verdict"),
    ("Progress", "phase", "Phase"),
    ("Problem", "code", "ProblemCode"),
    ("Finding", "code", "FindingCode"),
    ("Finding", "severity", "Severity"),
    ("FindingKind", "code", "FindingCode"),
    ("FindingKind", "severity", "Severity"),
    ("Key", "scopes", "Scope"),
    ("NewKey", "scopes", "Scope"),
    ("NewWebhook", "events", "WebhookEventType"),
    ("Webhook", "events", "WebhookEventType"),
    ("Webhook", "state", "WebhookState"),
    ("Delivery", "state", "DeliveryState"),
    ("Delivery", "type", "DeliveryType"),
    ("Limit", "unit", "LimitUnit"),
];

/// Parameters of queries that are one of the words: (operation, parameter, words).
const PARAMETERS: [(&str, &str, &str); 6] = [
    ("list_jobs", "state", "JobState"),
    ("list_jobs", "kind", "JobKind"),
    ("list_jobs", "verdict", "Verdict"),
    ("list_batch_jobs", "state", "JobState"),
    ("list_batch_jobs", "verdict", "Verdict"),
    ("list_deliveries", "state", "DeliveryState"),
];

/// Puts the sets among the schemas, and refers to them where their words stand.
pub(super) fn name_closed_sets(document: &mut Value) {
    for (name, description, words) in all() {
        document["components"]["schemas"][name] = json!({"type": "string", "enum": words, "description": description});
    }
    for (schema, member, words) in MEMBERS {
        if let Some(member) = schema_of(document, schema).and_then(|schema| schema["properties"].get_mut(member)) {
            refer(member, words);
        }
    }
    for operation in operations(document) {
        let id = operation["operationId"].as_str().unwrap_or_default().to_owned();
        for parameter in operation.get_mut("parameters").and_then(Value::as_array_mut).into_iter().flatten() {
            let of = |(of, name, _): &&(&str, &str, &str)| *of == id && parameter["name"] == *name;
            if let Some((_, _, words)) = PARAMETERS.iter().find(of) {
                refer(&mut parameter["schema"], words);
            }
        }
    }
}

/// Has a schema be one of the words, or a list of them where it is a list.
fn refer(schema: &mut Value, words: &str) {
    let is_list = schema.get("items").is_some();
    let place = if is_list { &mut schema["items"] } else { schema };
    let description = place.get("description").cloned();
    *place = json!({"$ref": format!("#/components/schemas/{words}")});
    if let Some(description) = description {
        place["description"] = description;
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::openapi_document;
    use super::*;

    #[test]
    fn every_place_is_there_and_refers_to_its_words() {
        let document = openapi_document();
        let sets = all();
        for (schema, member, words) in MEMBERS {
            let place = &document["components"]["schemas"][schema]["properties"][member];
            let reference = place.get("$ref").or_else(|| place["items"].get("$ref"));
            assert_eq!(reference, Some(&json!(format!("#/components/schemas/{words}"))), "{schema}.{member}");
        }
        for (operation, parameter, words) in PARAMETERS {
            let text = document["paths"].to_string();
            assert!(
                text.contains(operation) && sets.iter().any(|(name, ..)| *name == words),
                "{operation} {parameter}"
            );
        }
        for (name, _, words) in sets {
            assert!(!words.is_empty(), "{name} has words");
        }
    }
}
