//! Mistakes over HTTP.

use std::process::Command;

use reqwest::{
    Client, Method, RequestBuilder,
    multipart::{Form, Part},
};
use retargetd::samples;
use serde_json::{Value, json};

use super::{Told, check};
use crate::service_process::{ServiceProcess, taken};

/// What is sent.
enum Sent {
    Nothing,
    Json(Value),
    /// A body with its content type.
    Text(&'static str, &'static str),
    /// Parts of a form: names of files, or texts.
    Form(&'static [(&'static str, &'static str)]),
}

use Sent::{Form as Parts, Json, Nothing, Text};

/// A mistake: the status, the code, and the request, in which `{source}`, `{target}`, `{failed}` and `{done}` stand for ids.
type Mistake = (u16, &'static str, &'static str, &'static str, Sent);

/// An id of nothing.
const NOTHING: &str = "ast_00000000000000000000000000";

fn mistakes() -> Vec<Mistake> {
    let file = |id: &str| json!({"asset": id});
    let both = || json!({"source": file("{source}"), "target": file("{target}")});
    let with = |name: &str, value: Value| {
        let mut body = both();
        body[name] = value;
        Json(body)
    };
    vec![
        (404, "not_found", "GET", "/v1/job", Nothing),
        (404, "not_found", "GET", "/jobs", Nothing),
        (404, "not_found", "GET", "/docs/nothing", Nothing),
        (405, "method_not_allowed", "DELETE", "/v1/jobs", Nothing),
        (405, "method_not_allowed", "GET", "/v1/retarget", Nothing),
        (404, "not_found", "GET", "/v1/jobs/7", Nothing),
        (404, "not_found", "GET", "/v1/jobs/job_00000000000000000000000000", Nothing),
        (404, "not_found", "GET", "/v1/assets/ast_00000000000000000000000000", Nothing),
        (404, "not_found", "GET", "/v1/results/{source}", Nothing),
        (404, "not_found", "GET", "/v1/rigs/nothing", Nothing),
        (404, "not_found", "GET", "/v1/presets/nothing", Nothing),
        (400, "malformed_request", "GET", "/v1/jobs?limit=many", Nothing),
        (400, "malformed_request", "GET", "/v1/jobs?limit=0", Nothing),
        (400, "malformed_request", "GET", "/v1/jobs?limit=-1", Nothing),
        (400, "malformed_request", "GET", "/v1/jobs?sate=failed", Nothing),
        (400, "malformed_request", "GET", "/v1/jobs?state=done", Nothing),
        (400, "malformed_request", "GET", "/v1/jobs?verdict=bad", Nothing),
        (400, "malformed_request", "GET", "/v1/jobs?since=yesterday", Nothing),
        (400, "malformed_request", "GET", "/v1/jobs?label=shot", Nothing),
        (400, "malformed_request", "GET", "/v1/jobs?cursor=abc", Nothing),
        (415, "unsupported_media_type", "POST", "/v1/jobs", Nothing),
        (415, "unsupported_media_type", "POST", "/v1/jobs", Text("text/plain", "{}")),
        (400, "malformed_request", "POST", "/v1/jobs", Text("application/json", "")),
        (400, "malformed_request", "POST", "/v1/jobs", Text("application/json", "{\"source\": ")),
        (400, "malformed_request", "POST", "/v1/jobs", Text("application/json", "source=a")),
        (422, "invalid_value", "POST", "/v1/jobs", Json(json!([]))),
        (422, "invalid_value", "POST", "/v1/jobs", Json(json!({}))),
        (422, "invalid_value", "POST", "/v1/jobs", Json(json!({"source": "{source}", "target": "{target}"}))),
        (
            422,
            "unknown_field",
            "POST",
            "/v1/jobs",
            Json(json!({"sorce": file("{source}"), "target": file("{target}")})),
        ),
        (422, "invalid_value", "POST", "/v1/jobs", Json(json!({"source": file("{source}")}))),
        (
            422,
            "invalid_value",
            "POST",
            "/v1/jobs",
            Json(json!({"source": file("walk.glb"), "target": file("{target}")})),
        ),
        (422, "unknown_asset", "POST", "/v1/jobs", Json(json!({"source": file(NOTHING), "target": file("{target}")}))),
        (422, "invalid_value", "POST", "/v1/jobs", with("output", json!(["gbl"]))),
        (422, "invalid_value", "POST", "/v1/jobs", with("output", json!("glb"))),
        (422, "invalid_value", "POST", "/v1/jobs", with("priority", json!(101))),
        (422, "invalid_value", "POST", "/v1/jobs", with("priority", json!("high"))),
        (422, "invalid_value", "POST", "/v1/jobs", with("labels", json!({"shot": 12}))),
        (422, "unknown_preset", "POST", "/v1/jobs", with("preset", json!("plain_kf"))),
        (422, "unknown_field", "POST", "/v1/retarget", with("config", json!({"alighn": "auto"}))),
        (422, "invalid_value", "POST", "/v1/retarget", with("config", json!({"align": "sometimes"}))),
        (422, "invalid_value", "POST", "/v1/jobs", with("webhook", json!("mine"))),
        (409, "no_results", "GET", "/v1/jobs/{failed}/report", Nothing),
        (422, "invalid_value", "POST", "/v1/batches", Json(json!({}))),
        (422, "invalid_value", "POST", "/v1/batches", Json(json!({"items": []}))),
        (422, "invalid_value", "POST", "/v1/batches", Json(json!({"items": [{"source": file("x")}]}))),
        (422, "unknown_field", "POST", "/v1/batches", Json(json!({"jobs": []}))),
        (415, "unsupported_format", "POST", "/v1/assets", Text("application/octet-stream", "")),
        (415, "unsupported_format", "POST", "/v1/assets", Text("application/octet-stream", "tuesday is better")),
        (403, "url_input_off", "POST", "/v1/assets/by-url", Json(json!({"url": "https://studio.example/walk.glb"}))),
        (422, "invalid_value", "POST", "/v1/retarget", Json(json!([]))),
        (422, "missing_part", "POST", "/v1/retarget", Parts(&[("source", "walk.glb")])),
        (422, "unknown_part", "POST", "/v1/retarget", Parts(&[("sourc", "walk.glb"), ("target", "hero.glb")])),
        (422, "repeated_part", "POST", "/v1/retarget", Parts(&[("source", "walk.glb"), ("source", "walk.glb")])),
        (415, "unsupported_format", "POST", "/v1/retarget", Parts(&[("source", "walk.glb"), ("target", "notes")])),
        (
            422,
            "malformed_config",
            "POST",
            "/v1/retarget",
            Parts(&[("source", "walk.glb"), ("target", "hero.glb"), ("config", "{\"a\"")]),
        ),
        (422, "no_animation", "POST", "/v1/retarget", Parts(&[("source", "hero.glb"), ("target", "hero.glb")])),
        (422, "unknown_part", "POST", "/v1/edits", Parts(&[("source", "walk.glb"), ("target", "hero.glb")])),
        (400, "malformed_request", "POST", "/v1/poses?to=standing", Parts(&[("target", "hero.glb")])),
        (422, "forbidden_url", "POST", "/v1/webhooks", Json(json!({"url": "http://127.0.0.1/"}))),
        (403, "forbidden", "GET", "/v1/keys", Nothing),
    ]
}

/// The service, and ids of what is there.
struct Studio {
    client: Client,
    service: ServiceProcess,
    ids: Vec<(&'static str, String)>,
}

impl Studio {
    async fn open(data: &std::path::Path) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
        command.args(["serve", "--listen", "127.0.0.1:0", "--log", "warn", "--data"]).arg(data);
        let service = ServiceProcess::listening(&mut command);
        let client = Client::builder().no_proxy().build().expect("a client");
        let mut studio = Self { client, service, ids: Vec::new() };
        for (name, bytes) in [("source", samples::walk_clip()), ("target", samples::mannequin())] {
            let upload = studio.client.post(studio.at(&format!("/v1/assets?filename={name}.glb"))).body(bytes);
            let id = taken(upload.send().await.expect("an answer")).await;
            studio.ids.push((name, id));
        }
        // Nothing moves in it, so it fails.
        let body =
            studio.filled(&json!({"source": {"asset": "{target}"}, "target": {"asset": "{target}"}}).to_string());
        let job = studio
            .client
            .post(studio.at("/v1/jobs"))
            .header("prefer", "wait=20")
            .header("content-type", "application/json");
        let id = taken(job.body(body).send().await.expect("an answer")).await;
        studio.ids.push(("failed", id));
        studio
    }

    fn at(&self, path: &str) -> String {
        format!("{}{}", self.service.url, self.filled(path))
    }

    fn filled(&self, text: &str) -> String {
        self.ids.iter().fold(text.to_owned(), |text, (name, id)| text.replace(&format!("{{{name}}}"), id))
    }

    fn request(&self, method: &str, path: &str, sent: &Sent) -> RequestBuilder {
        let method: Method = method.parse().expect("a method");
        let request = self.client.request(method, self.at(path)).header("x-request-id", "mine");
        match sent {
            Nothing => request,
            Json(body) => request.header("content-type", "application/json").body(self.filled(&body.to_string())),
            Text(kind, text) => request.header("content-type", *kind).body(*text),
            Parts(parts) => request.multipart(parts.iter().fold(Form::new(), |form, (name, content)| {
                let bytes = match *content {
                    "walk.glb" => samples::walk_clip(),
                    "hero.glb" => samples::mannequin(),
                    text => text.as_bytes().to_vec(),
                };
                form.part(*name, Part::bytes(bytes).file_name((*content).to_owned()))
            })),
        }
    }
}

fn shown(sent: &Sent) -> String {
    match sent {
        Nothing => String::new(),
        Json(body) => format!(" {body}"),
        Text(kind, text) => format!(" {kind} {text:?}"),
        Parts(parts) => {
            let parts = parts.iter().map(|(name, content)| format!("{name}={content}"));
            format!(" form {}", parts.collect::<Vec<_>>().join(" "))
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn mistakes_over_http_are_told_with_a_hint() {
    let data = tempfile::tempdir().expect("a folder");
    let studio = Studio::open(data.path()).await;
    let (mut told, mut wrong) = (Vec::new(), Vec::new());
    let mistakes = mistakes();
    assert_eq!(mistakes.len(), 60, "as many as are asked for");
    for (status, code, method, path, sent) in mistakes {
        let mistake = format!("{method} {path}{}", shown(&sent));
        let answer = studio.request(method, path, &sent).send().await.expect("an answer");
        let seen = answer.status().as_u16();
        let problem: Value = answer.json().await.unwrap_or_default();
        let text = |member: &str| problem[member].as_str().unwrap_or_default().to_owned();
        if (seen, text("code").as_str()) != (status, code) {
            wrong.push(format!("{mistake} was answered with {seen} {}, not {status} {code}: {problem}", text("code")));
        }
        if text("hint").is_empty() {
            wrong.push(format!("{mistake} has no hint: {problem}"));
        }
        let place =
            [text("part"), text("place")].into_iter().filter(|text| !text.is_empty()).collect::<Vec<_>>().join(" ");
        let place = if place.is_empty() { place } else { format!("{place}: ") };
        let errors = problem["errors"].as_array().into_iter().flatten();
        let pointers: Vec<String> = errors
            .map(|error| {
                let like: Vec<&str> =
                    error["did_you_mean"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
                let like =
                    if like.is_empty() { String::new() } else { format!(" (did you mean {}?)", like.join(", ")) };
                let pointer =
                    error["pointer"].as_str().filter(|pointer| !pointer.is_empty()).unwrap_or("the whole body");
                format!("{pointer}{like}")
            })
            .collect();
        let mut lines =
            vec![format!("{seen} {}: {place}{}", text("code"), text("detail")), format!("hint: {}", text("hint"))];
        if !pointers.is_empty() {
            lines.push(format!("at: {}", pointers.join(", ")));
        }
        // Ids are others each time.
        let named = |line: String| {
            studio.ids.iter().fold(line, |line, (name, id)| line.replace(id.as_str(), &format!("{{{name}}}")))
        };
        told.push(Told { mistake, lines: lines.into_iter().map(named).collect() });
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    check(&told, "http.txt");
}
