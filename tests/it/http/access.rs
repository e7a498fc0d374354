//! Access, and that callers see nothing of one another.

use std::{process::Command, time::Duration};

use reqwest::{Method, RequestBuilder, StatusCode};
use retargetd::{
    http::openapi_document,
    jobs::{KeyText, Scope},
};
use serde_json::{Value, json};

use super::support::{BVH, Service, header, json as read, problem, start_service};

async fn guarded() -> Service {
    Service::start(&[("authentication", "keys")]).await
}

fn ask(service: &Service, key: &KeyText, method: Method, path: &str) -> RequestBuilder {
    service.client.request(method, service.at(path)).bearer_auth(key.reveal())
}

async fn text_of(request: RequestBuilder, member: &str) -> String {
    let answer = request.send().await.expect("an answer");
    let (status, url) = (answer.status(), answer.url().clone());
    let body = read(answer).await;
    body[member].as_str().unwrap_or_else(|| panic!("{url} has a {member}: {status} {body}")).to_owned()
}

/// Every operation of the document, as (method, path).
fn operations() -> Vec<(Method, String)> {
    let document = openapi_document();
    let paths = document["paths"].as_object().expect("paths").clone();
    let methods = |(path, item): (String, Value)| {
        let names: Vec<String> = item.as_object().expect("operations").keys().cloned().collect();
        names.into_iter().filter_map(move |name| Some((name.to_uppercase().parse().ok()?, path.clone())))
    };
    paths.into_iter().flat_map(methods).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn nobody_comes_in_without_a_key_but_where_everybody_may() {
    let service = guarded().await;
    let mut open = Vec::new();
    for (method, path) in operations() {
        let answer = service.client.request(method.clone(), service.at(&path)).send().await.expect("an answer");
        if answer.status() != StatusCode::UNAUTHORIZED {
            open.push(format!("{method} {path}"));
            continue;
        }
        assert!(header(&answer, "www-authenticate").starts_with("Bearer"), "{method} {path} says how");
        let problem = problem(answer, 401, "unauthenticated").await;
        assert!(problem["hint"].as_str().is_some_and(|hint| hint.contains("keys create")), "what to do: {problem}");
    }
    let expected = [
        "GET /",
        "GET /livez",
        "GET /readyz",
        "GET /v1/findings",
        "GET /v1/formats",
        "GET /v1/limits",
        "GET /v1/schemas/draw-spec",
        "GET /v1/schemas/retarget-spec",
        "GET /v1/schemas/rig-template",
        "GET /version",
    ];
    open.sort();
    assert_eq!(open, expected, "open to everybody");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_key_opens_what_its_scopes_say_until_it_is_revoked() {
    let service = guarded().await;
    let admin = service.key("operator", &[Scope::Admin]).await;
    let body = json!({"principal": "studio", "scopes": ["read"]});
    let made = read(ask(&service, &admin, Method::POST, "/v1/keys").json(&body).send().await.expect("an answer")).await;
    let (id, secret) = (made["id"].as_str().expect("an id"), made["secret"].as_str().expect("the key"));
    let with = |method: Method, path: &str| service.client.request(method, service.at(path)).bearer_auth(secret);

    assert_eq!(with(Method::GET, "/v1/jobs").send().await.expect("an answer").status(), StatusCode::OK, "it may look");
    let refused = with(Method::POST, "/v1/assets").body(BVH).send().await.expect("an answer");
    let refused = problem(refused, 403, "forbidden").await;
    assert!(refused["detail"].as_str().is_some_and(|detail| detail.contains("'write'")), "which scope: {refused}");
    problem(with(Method::GET, "/v1/keys").send().await.expect("an answer"), 403, "forbidden").await;
    let wrong = service.client.get(service.at("/v1/jobs")).header("authorization", "Basic YTpi").send().await;
    problem(wrong.expect("an answer"), 401, "unauthenticated").await;

    let list =
        ask(&service, &admin, Method::GET, "/v1/keys").send().await.expect("an answer").text().await.expect("text");
    assert!(list.contains(id) && !list.contains(secret), "the list tells no secrets: {list}");
    let typo = json!({"principal": "studio", "scopes": ["reed"]});
    let typo = ask(&service, &admin, Method::POST, "/v1/keys").json(&typo).send().await.expect("an answer");
    assert_eq!(problem(typo, 422, "invalid_value").await["errors"][0]["pointer"], "/scopes/0", "where");
    let again = || ask(&service, &admin, Method::POST, "/v1/keys").json(&body).send();
    assert_eq!(again().await.expect("an answer").status(), StatusCode::CREATED, "the one that follows");
    problem(again().await.expect("an answer"), 409, "too_many_keys").await;

    let revoked = ask(&service, &admin, Method::DELETE, &format!("/v1/keys/{id}")).send().await.expect("an answer");
    assert_eq!(revoked.status(), StatusCode::NO_CONTENT, "it is gone");
    problem(with(Method::GET, "/v1/jobs").send().await.expect("an answer"), 401, "unauthenticated").await;
    service.stop().await;
}

/// What one caller has.
struct Belongings {
    asset: String,
    batch: String,
    job: String,
    result: String,
    webhook: String,
    delivery: String,
}

async fn belongings(service: &Service, key: &KeyText) -> Belongings {
    let upload = ask(service, key, Method::POST, "/v1/assets?filename=walk.bvh").body(BVH);
    let asset = text_of(upload, "id").await;
    let body = json!({"source": {"asset": asset}, "target": {"asset": asset}});
    let ended = ask(service, key, Method::POST, "/v1/jobs").header("prefer", "wait=30").json(&body);
    let ended = read(ended.send().await.expect("an answer")).await;
    let text_at = |pointer: &str| ended.pointer(pointer).and_then(Value::as_str);
    let text = |pointer: &str| text_at(pointer).unwrap_or_else(|| panic!("a {pointer} in {ended}")).to_owned();
    for (path, document) in [
        ("/v1/presets/hero", json!({"align": "off"})),
        ("/v1/rigs/hero", json!({"kind": "biped", "roles": {"pelvis": ["huefte"], "head": ["kopf"]}})),
    ] {
        let kept = ask(service, key, Method::PUT, path).json(&document).send().await.expect("an answer");
        assert!(kept.status().is_success(), "{path} is kept: {}", kept.text().await.unwrap_or_default());
    }
    let batch = ask(service, key, Method::POST, "/v1/batches").json(&json!({"items": [body]}));
    let batch = text_of(batch, "id").await;
    let wait = ask(service, key, Method::GET, &format!("/v1/batches/{batch}")).header("prefer", "wait=30");
    assert_eq!(text_of(wait, "state").await, "succeeded", "it has ended");
    let webhook = ask(service, key, Method::POST, "/v1/webhooks").json(&json!({"url": "https://studio.example/"}));
    let webhook = text_of(webhook, "id").await;
    let delivery = text_of(ask(service, key, Method::POST, &format!("/v1/webhooks/{webhook}/ping")), "id").await;
    Belongings { batch, job: text("/id"), result: text("/results/0/id"), asset, webhook, delivery }
}

/// Every route that names something, of every method, with what belongs to somebody else: made from the document, so that new routes
/// are tried by themselves.
#[tokio::test(flavor = "multi_thread")]
async fn what_belongs_to_others_is_not_found_on_any_route() {
    let service = guarded().await;
    let (ann, bob) = (service.key("ann", &[Scope::Read, Scope::Write]).await, service.key("bob", &Scope::ALL).await);
    let hers = belongings(&service, &ann).await;
    let mut tried = 0;
    for (method, path) in operations() {
        let place = match path.split('/').nth(2) {
            Some("assets") => &hers.asset,
            Some("jobs") => &hers.job,
            Some("batches") => &hers.batch,
            Some("results") => &hers.result,
            Some("webhooks") => &hers.webhook,
            Some("deliveries") => &hers.delivery,
            Some("rigs" | "presets") => "hero",
            Some("keys") => continue,
            _ if path.contains('{') => panic!("{path} names something that this test does not know: teach it"),
            _ => continue,
        };
        // A name is free to whoever has none of that name.
        if !path.contains('{') || method == Method::PUT {
            continue;
        }
        let path = path.replace("{id}", place).replace("{name}", place).replace("{ending}", "png");
        assert!(!path.contains('{'), "{path} is filled in");
        let answer = ask(&service, &bob, method.clone(), &path).send().await.expect("an answer");
        assert_eq!(answer.status(), StatusCode::NOT_FOUND, "{method} {path} to somebody else");
        if method == Method::GET {
            let own = ask(&service, &ann, method, &path).send().await.expect("an answer");
            assert_eq!(own.status(), StatusCode::OK, "{path} to its owner");
        }
        tried += 1;
    }
    assert!(tried >= 15, "the document has such routes: {tried}");

    let inputs = json!({"source": {"asset": hers.asset}, "target": {"asset": hers.asset}});
    for path in ["/v1/jobs", "/v1/mapping-suggestions", "/v1/explanations?frame=0&joint=Hips"] {
        problem(
            ask(&service, &bob, Method::POST, path).json(&inputs).send().await.expect("an answer"),
            422,
            "unknown_asset",
        )
        .await;
    }
    let learn = ask(&service, &bob, Method::PUT, "/v1/rigs/learned").json(&json!({"asset": hers.asset}));
    problem(learn.send().await.expect("an answer"), 404, "not_found").await;
    let batch = json!({"items": [inputs], "atomic": true});
    let refused = ask(&service, &bob, Method::POST, "/v1/batches").json(&batch).send().await.expect("an answer");
    problem(refused, 422, "unknown_asset").await;
    for list in ["/v1/assets", "/v1/jobs", "/v1/batches"] {
        let seen = read(ask(&service, &bob, Method::GET, list).send().await.expect("an answer")).await;
        assert_eq!(seen["items"], json!([]), "{list} shows him nothing");
    }
    let again =
        ask(&service, &bob, Method::POST, "/v1/assets?filename=walk.bvh").body(BVH).send().await.expect("an answer");
    assert_eq!(again.status(), StatusCode::CREATED, "that she has the same bytes is not told");
    service.stop().await;
}

/// The operator's way in: the command line makes the first key while the service runs.
#[tokio::test(flavor = "multi_thread")]
async fn keys_are_made_listed_and_revoked_on_the_command_line() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = start_service(data.path(), &["--authentication", "keys"]);
    let keys = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
        let output = command.arg("keys").args(arguments).arg("--data").arg(data.path()).output().expect("it runs");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
        (output.status.code(), text(output.stdout), text(output.stderr))
    };
    let client = reqwest::Client::builder().no_proxy().timeout(Duration::from_secs(60)).build().expect("a client");
    let status = async |key: &str| {
        let answer = client.get(format!("{}/v1/jobs", server.url)).bearer_auth(key).send().await;
        answer.expect("an answer").status().as_u16()
    };
    let (code, key, told) = keys(&["create", "studio", "--lifetime", "90d", "--note", "render farm, north"]);
    assert_eq!((code, key.trim().lines().count()), (Some(0), 1), "the key alone, for scripts: {told}");
    assert!(told.contains("studio read,write"), "what it is, apart from it: {told}");
    assert_eq!(status(key.trim()).await, 200, "it opens at once");
    let (code, list, _) = keys(&["list"]);
    assert!(code == Some(0) && list.contains("studio") && !list.contains(key.trim()), "without secrets: {list}");
    assert!(list.contains("last used 2") && list.contains("render farm, north"), "used when, and for what: {list}");
    let id = list.split(' ').next().expect("an id");
    assert_eq!(keys(&["revoke", id]).0, Some(0), "revoked");
    assert_eq!(status(key.trim()).await, 401, "it opens nothing any more");
    let (code, _, told) = keys(&["revoke", id]);
    assert!(code == Some(2) && told.contains("keys list"), "revoked already: {told}");
    assert!(!keys(&["list"]).1.contains(id), "what opens nothing is not listed");
    let (_, all, _) = keys(&["list", "--all"]);
    assert!(all.contains(id) && all.contains("revoked 2") && all.contains("render farm"), "but where all are: {all}");
    let (_, told, _) = keys(&["list", "--all", "--json"]);
    assert!(told.contains("\"revoked_at\": \"2") && told.contains("\"note\": \"render farm, north\""), "{told}");
    assert_eq!(keys(&["create", "studio", "--note", "two\nlines"]).0, Some(2), "a note is one line");
    assert_eq!(keys(&["create", "Studio 1"]).0, Some(2), "no such name");
    assert_eq!(keys(&["create", "studio", "--scope", "all"]).0, Some(2), "no such scope");
    assert_eq!(server.terminate(), Some(0), "SIGTERM ends it well");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stream_opens_with_a_token_in_its_address() {
    let service = guarded().await;
    let key = service.key("studio", &[Scope::Read]).await;
    let made = ask(&service, &key, Method::POST, "/v1/stream-tokens").send().await.expect("an answer");
    assert_eq!(made.status(), StatusCode::CREATED, "for who may look");
    let token = read(made).await["token"].as_str().expect("a token").to_owned();
    let open = async |path: &str| {
        let request = service.client.get(service.at(path)).timeout(Duration::from_secs(20));
        request.send().await.expect("an answer")
    };
    let stream = open(&format!("/v1/events?token={token}")).await;
    assert_eq!((stream.status(), header(&stream, "content-type")), (StatusCode::OK, "text/event-stream"), "opens");
    drop(stream);
    let job = open(&format!("/v1/jobs/job_00000000000000000000000000/events?token={token}")).await;
    problem(job, 404, "not_found").await;
    problem(open("/v1/events?token=rts_nothing").await, 401, "unauthenticated").await;
    problem(open(&format!("/v1/jobs?token={token}")).await, 401, "unauthenticated").await;
    let unknown = service.client.post(service.at("/v1/stream-tokens")).send().await.expect("an answer");
    problem(unknown, 401, "unauthenticated").await;
    service.stop().await;
}
