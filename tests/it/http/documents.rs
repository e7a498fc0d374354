//! The committed documents are those that the code makes, and the routes are those that the document has.

use std::path::Path;

use retargetd::http::{Code, openapi_document, problems_page};
use serde_json::Value;

use super::support::{Service, header};

fn committed(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("openapi").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{} cannot be read: {error}", path.display()))
}

/// Compares a document with the committed one, or writes it with `RETARGETD_UPDATE=1`.
#[expect(clippy::disallowed_methods, reason = "tests have no settings")]
fn compare(made: &str, name: &str) {
    if std::env::var_os("RETARGETD_UPDATE").is_some_and(|value| value == "1") {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("openapi").join(name);
        std::fs::write(path, made).expect("the document can be written");
    }
    assert!(
        made == committed(name),
        "run 'RETARGETD_UPDATE=1 cargo it http::documents' and look at what changed in openapi/{name}"
    );
}

#[test]
fn the_committed_document_is_what_the_code_makes() {
    compare(&format!("{:#}\n", openapi_document()), "openapi.json");
}

#[test]
fn the_committed_problems_are_those_of_the_code() {
    compare(&problems_page(), "problems.md");
    assert!(Code::ALL.iter().all(|code| problems_page().contains(code.name())), "every code is on the page");
}

#[test]
fn every_operation_says_what_it_answers() {
    let document: Value = openapi_document();
    let paths = document["paths"].as_object().expect("paths");
    assert!(paths.len() > 15, "all routes are described");
    for (path, item) in paths {
        for (method, operation) in item.as_object().expect("operations") {
            assert!(!operation["summary"].as_str().unwrap_or_default().is_empty(), "{method} {path} has a summary");
            assert!(!operation["responses"].as_object().expect("responses").is_empty(), "{method} {path} answers");
        }
    }
}

#[test]
fn every_operation_has_a_name_of_its_own_and_links_lead_somewhere() {
    let document: Value = openapi_document();
    let paths = document["paths"].as_object().expect("paths");
    let operations: Vec<&Value> =
        paths.values().flat_map(|item| item.as_object().expect("operations").values()).collect();
    let names: Vec<&str> =
        operations.iter().map(|operation| operation["operationId"].as_str().expect("a name")).collect();
    let unique: std::collections::BTreeSet<&str> = names.iter().copied().collect();
    assert_eq!(unique.len(), names.len(), "generated clients have one function for each: {names:?}");
    let answers = operations.iter().flat_map(|operation| operation["responses"].as_object().expect("answers").values());
    let links: Vec<&Value> =
        answers.filter_map(|answer| answer.get("links")?.as_object()).flat_map(serde_json::Map::values).collect();
    assert!(links.len() > 15, "what belongs together is linked: {links:?}");
    for link in links {
        assert!(unique.contains(link["operationId"].as_str().expect("a name")), "{link} leads to an operation");
    }
    let text = document.to_string();
    for place in text.split("\"$ref\":\"#/").skip(1).filter_map(|rest| rest.split('"').next()) {
        assert!(document.pointer(&format!("/{place}")).is_some(), "'{place}' is referred to, and is there");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_route_answers_in_a_type_that_it_declares() {
    let service = Service::start(&[]).await;
    let document: Value = openapi_document();
    for (path, item) in document["paths"].as_object().expect("paths") {
        if item.get("get").is_none() {
            continue;
        }
        let id = path.trim_start_matches("/v1/").chars().next().map_or("", |first| match first {
            'a' => "ast_00000000000000000000000000",
            'j' => "job_00000000000000000000000000",
            _ => "res_00000000000000000000000000",
        });
        let answer = service.get(&path.replace("{id}", id).replace("{name}", "default")).await;
        let status = answer.status().as_u16().to_string();
        let responses = &item["get"]["responses"];
        let declared = responses.get(&status).or_else(|| responses.get("default"));
        let declared = declared.unwrap_or_else(|| panic!("GET {path} answers {status}, which it does not declare"));
        let media_type = header(&answer, "content-type").split(';').next().unwrap_or_default().to_owned();
        let types: Vec<&String> =
            declared["content"].as_object().map(|content| content.keys().collect()).unwrap_or_default();
        assert!(types.contains(&&media_type), "GET {path} answers {status} {media_type}; declared are {types:?}");
        assert_eq!(header(&answer, "x-content-type-options"), "nosniff", "GET {path} is not sniffed");
        assert!(!header(&answer, "x-request-id").is_empty(), "GET {path} has a request id");
    }
    service.stop().await;
}
