//! What the OpenAPI document says of operations besides what stands at their routes: who may ask for them, and where they lead.

use axum::http::Method;
use serde_json::json;
use utoipa::openapi::{
    Content, OpenApi as Document, PathItem, Ref, RefOr, Response,
    link::Link,
    path::Operation,
    security::{Http, HttpAuthScheme, SecurityRequirement, SecurityScheme},
};

use crate::http::auth::needed_scope;

/// Which scope of a key or a token each operation asks for, where they are asked for; else it asks for nothing. What asks may refuse.
pub(super) fn tell_who_may_come_in(document: &mut Document) {
    const SCHEMES: [&str; 2] = ["key", "token"];
    let key = Http::builder().scheme(HttpAuthScheme::Bearer).bearer_format("rtk_…");
    let key = key
        .description(Some("Asked for where the setting `authentication` says so; `retargetd keys create` makes them."));
    let components = document.components.get_or_insert_default();
    let token = Http::builder().scheme(HttpAuthScheme::Bearer).bearer_format("JWT").description(Some(
        "Of the identity provider that the setting `token_issuer` names, for the audience `token_audience`. In the token, scopes have the \
         prefix `token_scope_prefix` before their names.",
    ));
    for (name, scheme) in SCHEMES.into_iter().zip([key, token]) {
        components.add_security_scheme(name, SecurityScheme::Http(scheme.build()));
    }
    for (path, item) in &mut document.paths.paths {
        for (method, operation) in operations(item) {
            if let Some(scope) = needed_scope(&method, path) {
                let asked = SCHEMES.map(|scheme| SecurityRequirement::new(scheme, [scope.name()]));
                operation.security = Some(asked.into_iter().chain([SecurityRequirement::default()]).collect());
                operation.responses.responses.insert("default".to_owned(), RefOr::T(problem()));
            }
        }
    }
}

/// What every refusal is.
fn problem() -> Response {
    let content = Content::new(Some(Ref::from_schema_name("Problem")));
    Response::builder().description("a problem").content("application/problem+json", content).build()
}

/// What an operation gives, and where it is used: (method, path, status, where in the answer, the start of the paths, their parameter).
const LEADS: [(Method, &str, &str, &str, &str, &str); 10] = [
    (Method::POST, "/v1/assets", "201", "$response.body#/id", "/v1/assets/{id}", "id"),
    (Method::POST, "/v1/assets", "200", "$response.body#/id", "/v1/assets/{id}", "id"),
    (Method::POST, "/v1/jobs", "202", "$response.body#/id", "/v1/jobs/{id}", "id"),
    (Method::POST, "/v1/batches", "202", "$response.body#/id", "/v1/batches/{id}", "id"),
    (Method::GET, "/v1/jobs/{id}", "200", "$response.body#/results/0/id", "/v1/results/{id}", "id"),
    (Method::POST, "/v1/keys", "201", "$response.body#/id", "/v1/keys/{id}", "id"),
    (Method::POST, "/v1/webhooks", "201", "$response.body#/id", "/v1/webhooks/{id}", "id"),
    (Method::POST, "/v1/webhooks/{id}/ping", "202", "$response.body#/id", "/v1/deliveries/{id}", "id"),
    (Method::PUT, "/v1/rigs/{name}", "201", "$request.path.name", "/v1/rigs/{name}", "name"),
    (Method::PUT, "/v1/presets/{name}", "201", "$request.path.name", "/v1/presets/{name}", "name"),
];

/// Which answers have what other operations ask for, so that generated clients and testers find their way.
pub(super) fn tell_what_leads_where(document: &mut Document) {
    for (method, path, status, expression, below, parameter) in LEADS {
        let names: Vec<String> = document
            .paths
            .paths
            .iter_mut()
            .filter(|(path, _)| path.starts_with(below))
            .flat_map(|(_, item)| operations(item))
            .filter_map(|(_, operation)| operation.operation_id.clone())
            .collect();
        let from = document.paths.paths.get_mut(path).into_iter().flat_map(operations);
        let from = from.filter(|(of, _)| *of == method).map(|(_, operation)| operation);
        for operation in from {
            let Some(RefOr::T(answer)) = operation.responses.responses.get_mut(status) else { continue };
            for name in &names {
                let link = Link::builder().operation_id(name).parameter(parameter, json!(expression)).build();
                answer.links.insert(name.clone(), RefOr::T(link));
            }
        }
    }
}

/// The operations of a path, with their methods.
fn operations(item: &mut PathItem) -> impl Iterator<Item = (Method, &mut Operation)> {
    let all = [
        (Method::GET, &mut item.get),
        (Method::HEAD, &mut item.head),
        (Method::POST, &mut item.post),
        (Method::PUT, &mut item.put),
        (Method::PATCH, &mut item.patch),
        (Method::DELETE, &mut item.delete),
    ];
    all.into_iter().filter_map(|(method, operation)| Some((method, operation.as_mut()?)))
}
