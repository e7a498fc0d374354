//! A service to talk to, as a child process or inside the test.

use std::{collections::BTreeMap, process::Command, sync::Arc, time::Duration};

use reqwest::{Client, Response, StatusCode};
use retargetd::{
    app::{self, Running},
    config::Settings,
    engine::{Control, Failure, FailureCode, Format, NamedBytes, Outcome, Output, Report},
    jobs::{Answer, Engine, EngineRequest, KeyText, NewKey, Principal, Question, Scope},
    telemetry::Clock,
};
use serde_json::Value;

pub(super) use crate::service_process::{ServiceProcess, taken};

/// Long enough for a busy machine; nothing waits this long when all is well.
pub(super) const PATIENCE: Duration = Duration::from_secs(60);

/// The smallest file that is taken for a BVH.
pub(super) const BVH: &str = "HIERARCHY\nROOT Hips\n";

/// A server on a folder of its own, with these flags.
pub(super) fn start_service(data: &std::path::Path, flags: &[&str]) -> ServiceProcess {
    ServiceProcess::listening(
        Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .args(["serve", "--listen", "127.0.0.1:0", "--log", "warn", "--data"])
            .arg(data)
            .args(flags),
    )
}

/// An engine that does what the config says: `wait` until canceled, `doze` for [`NAP`], `refuse`, `panic`, else the target's bytes as GLB.
pub(crate) struct Obedient;

/// How long a job takes that costs the processor nothing.
pub(crate) const NAP: Duration = Duration::from_millis(100);

impl Engine for Obedient {
    fn ask(&self, asked: &EngineRequest<'_>, control: &Control) -> Result<Answer, Failure> {
        let bytes = |file: Option<NamedBytes<'_>>| file.map_or_else(Vec::new, |file| file.bytes.to_vec());
        let target = bytes(asked.files.target.or(asked.files.source));
        let config = bytes(asked.files.config);
        match &asked.question {
            Question::Retarget | Question::Edit | Question::Pose { .. } | Question::Draw => {}
            Question::Inspect => {
                let name = asked.files.source.map(|file| file.name);
                return Ok(Answer::Document(serde_json::json!({"format": "bvh", "name": name})));
            }
            Question::Propose => return Ok(Answer::Document(serde_json::json!({"target_bytes": target.len()}))),
            Question::Explain { joint, .. } => return Ok(Answer::Document(serde_json::json!({"joint": joint}))),
            Question::Preview(options) => return Ok(Answer::Picture(options.ending.clone().into_bytes())),
            Question::Display(_) => return Ok(Answer::Picture(b"glTF".to_vec())),
            Question::Annotate { rig, .. } => return Ok(Answer::Document(serde_json::json!({"rig": rig}))),
            Question::CheckConfig => {
                return Ok(Answer::Document(serde_json::json!({"config_bytes": config.len()})));
            }
        }
        let says = |word: &str| String::from_utf8_lossy(&config).contains(word);
        if says("panic") {
            panic!("as the config says");
        }
        if says("refuse") {
            return Err(Failure::new(FailureCode::NoAnimation, "the source has no animation").in_part("source"));
        }
        if says("doze") {
            std::thread::sleep(NAP);
        }
        while says("wait") {
            control.check().map_err(|_| Failure::new(FailureCode::Canceled, "canceled"))?;
            std::thread::sleep(Duration::from_millis(1));
        }
        let formats = if asked.formats.is_empty() { &[Format::Glb] } else { asked.formats };
        let output =
            |format: &Format| Output::new(*format, format!("out.{}", format.info().endings[0]), target.clone());
        let outputs = formats.iter().map(output).collect();
        let resolved_spec = serde_json::json!({"version": 1});
        let outcome = Outcome::new(outputs, Report::default(), resolved_spec);
        Ok(Answer::EngineResult(Box::new(outcome.try_into()?)))
    }
}

/// A service inside the test, with the obedient engine.
pub(super) struct Service {
    pub(super) client: Client,
    pub(super) url: String,
    pub(super) clock: Clock,
    pub(super) data: tempfile::TempDir,
    running: Running,
}

impl Service {
    pub(super) async fn start(settings: &[(&str, &str)]) -> Self {
        let data = tempfile::tempdir().expect("a temporary folder");
        let mut given: BTreeMap<&str, String> =
            settings.iter().map(|(name, text)| (*name, (*text).to_owned())).collect();
        given.insert("listen", "127.0.0.1:0".to_owned());
        given.insert("data", data.path().display().to_string());
        given.entry("workers").or_insert("1".to_owned());
        let settings = Settings::read(|setting| given.get(setting.name).cloned()).expect("the settings are valid");
        let clock = Clock::system();
        let running = app::start_with(settings, Arc::new(Obedient), clock.clone()).await.expect("it starts");
        let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
        Self { client, url: running.url(), clock, data, running }
    }

    /// A key of its own for that principal, made beside the service as an operator does it.
    pub(super) async fn key(&self, principal: &str, scopes: &[Scope]) -> KeyText {
        let settings = Settings { data: self.data.path().to_owned(), ..Settings::default() };
        let principal = Principal::parse(principal).expect("a name");
        let new = NewKey { principal, scopes: scopes.to_vec(), lifetime: None, note: String::new() };
        app::keys(&settings).await.expect("opens").create(new).await.expect("is made").0
    }

    pub(super) fn address(&self) -> std::net::SocketAddr {
        self.running.address()
    }

    pub(super) fn at(&self, path: &str) -> String {
        format!("{}{path}", self.url)
    }

    pub(super) async fn get(&self, path: &str) -> Response {
        self.client.get(self.at(path)).send().await.expect("an answer")
    }

    pub(super) async fn post(&self, path: &str, body: &Value) -> Response {
        self.client.post(self.at(path)).json(body).send().await.expect("an answer")
    }

    /// Uploads a file and gives its id.
    pub(super) async fn upload(&self, bytes: &str) -> String {
        let path = self.at("/v1/assets?filename=walk.bvh");
        let answer = self.client.post(path).body(bytes.to_owned()).send().await.expect("an answer");
        taken(answer).await
    }

    /// Asks for a job whose config says `word`.
    pub(super) async fn job(&self, asset: &str, word: &str) -> Response {
        let body = serde_json::json!({"source": {"asset": asset}, "target": {"asset": asset}, "config": {"say": word}});
        self.post("/v1/jobs", &body).await
    }

    /// The job in that state.
    pub(super) async fn until(&self, id: &str, state: &str) -> Value {
        let reached = async {
            loop {
                let job = json(self.get(&format!("/v1/jobs/{id}")).await).await;
                if job["state"] == state {
                    return job;
                }
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        tokio::time::timeout(PATIENCE, reached).await.expect("the state is reached")
    }

    pub(super) async fn stop(self) {
        self.running.stop().await.expect("it stops");
    }
}

pub(super) async fn json(answer: Response) -> Value {
    answer.json().await.expect("JSON")
}

pub(super) fn header<'a>(answer: &'a Response, name: &str) -> &'a str {
    answer.headers().get(name).and_then(|value| value.to_str().ok()).unwrap_or_default()
}

/// Checks that an answer is a problem of that status and code, whole and of the right type, and gives it.
pub(super) async fn problem(answer: Response, status: u16, code: &str) -> Value {
    assert_eq!(header(&answer, "content-type"), "application/problem+json", "the type of '{code}'");
    let seen = answer.status();
    let problem = json(answer).await;
    assert_eq!(problem["code"], code, "the code: {problem}");
    assert_eq!(seen, StatusCode::from_u16(status).expect("a status"), "the status of '{code}'");
    assert_eq!(problem["status"], status, "the same status in the body of '{code}'");
    for member in ["type", "title", "detail", "instance", "request_id"] {
        assert!(!problem[member].as_str().unwrap_or_default().is_empty(), "'{code}' has a {member}: {problem}");
    }
    problem
}

/// A multipart form of text files.
pub(super) fn form(parts: &[(&'static str, &str)]) -> reqwest::multipart::Form {
    parts.iter().fold(reqwest::multipart::Form::new(), |form, (name, text)| {
        let ending = if *name == "config" { "json" } else { "bvh" };
        let part = reqwest::multipart::Part::text((*text).to_owned()).file_name(format!("{name}.{ending}"));
        form.part(*name, part)
    })
}
