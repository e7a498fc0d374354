//! A studio: one database, one file store, as many processes as it likes, and a client that remembers what it was promised.

use std::{collections::BTreeMap, time::Instant};

use reqwest::{Client, StatusCode, multipart};
use serde_json::{Value, json};

use super::support::{PATIENCE, Postgres, S3, ServiceProcess, of_role, serve, worker};
use crate::{event_stream::EventReader, support::sha256_of};

/// The smallest clip that is worth a job: two joints, two frames.
pub(crate) const CLIP: &str = "HIERARCHY\nROOT Hips\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation \
                               Xrotation Yrotation\n JOINT Spine\n {\n  OFFSET 0 10 0\n  CHANNELS 3 Zrotation Xrotation \
                               Yrotation\n  End Site\n  {\n   OFFSET 0 10 0\n  }\n }\n}\nMOTION\nFrames: 2\nFrame Time: \
                               0.0333333\n0 90 0 0 0 0 0 0 0\n0 91 0 0 5 0 0 0 5\n";

/// Where records and files are kept.
pub(super) enum Place {
    /// In one folder, by one process.
    Folder(tempfile::TempDir),
    /// In a database and a folder that processes share.
    Shared(Postgres, tempfile::TempDir),
    /// In a database and a bucket that processes share.
    Cloud(Postgres, S3),
}

impl Place {
    pub(super) fn folder() -> Self {
        Self::Folder(tempfile::tempdir().expect("a temporary folder"))
    }

    pub(super) fn shared() -> Option<Self> {
        Self::shared_under(&[])
    }

    /// The same, of a database with these variables of its environment.
    pub(super) fn shared_under(variables: &[(&'static str, String)]) -> Option<Self> {
        Some(Self::Shared(Postgres::start_with(variables)?, tempfile::tempdir().expect("a temporary folder")))
    }

    pub(super) fn cloud() -> Option<Self> {
        Some(Self::Cloud(Postgres::start()?, S3::start()?))
    }

    pub(super) fn flags(&self, more: &[&str]) -> Vec<String> {
        let own = match self {
            Self::Folder(root) => vec!["--data".to_owned(), root.path().display().to_string()],
            Self::Shared(database, root) => {
                vec![
                    "--database".to_owned(),
                    database.url(),
                    "--blobs".to_owned(),
                    format!("file://{}", root.path().display()),
                ]
            }
            Self::Cloud(database, _) => vec!["--database".to_owned(), database.url(), "--blobs".to_owned(), S3::url()],
        };
        // Every promised job is to be worked on, however many are the same.
        let own = own.into_iter().chain(["--result-cache".to_owned(), "off".to_owned()]);
        own.chain(more.iter().map(ToString::to_string)).collect()
    }

    pub(super) fn variables(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::Cloud(_, files) => files.variables(),
            _ => Vec::new(),
        }
    }

    pub(super) fn serve(&self, more: &[&str], variables: &[(&'static str, String)]) -> ServiceProcess {
        serve(&self.flags(more), &[self.variables(), variables.to_vec()].concat())
    }

    /// A worker that says where it answers probes.
    pub(super) fn worker_with_probes(&self) -> ServiceProcess {
        let more = ["--workers", "1", "--probes-listen", "127.0.0.1:0"];
        ServiceProcess::listening(&mut of_role("worker", &self.flags(&more), &self.variables()))
    }

    pub(super) fn worker(&self, more: &[&str], variables: &[(&'static str, String)]) -> ServiceProcess {
        worker(&self.flags(more), &[self.variables(), variables.to_vec()].concat())
    }
}

/// The smallest job: writes a clip again.
pub(super) fn edit_of(asset: &str) -> Value {
    json!({"source": {"asset": asset}, "config": {"task": "edit"}, "output": ["bvh"]})
}

/// Somebody who uploads, asks for jobs, and comes back for all of them.
pub(super) struct Customer {
    client: Client,
    /// The jobs that were acknowledged.
    pub(super) promised: Vec<String>,
}

impl Customer {
    pub(super) fn new() -> Self {
        let client = Client::builder().timeout(PATIENCE).no_proxy().build().expect("a client");
        Self { client, promised: Vec::new() }
    }

    /// Uploads the clip with a comment of its own; `None` when the service does not answer.
    pub(super) async fn upload(&self, url: &str, clip: &str) -> Option<String> {
        let answer = self.client.post(format!("{url}/v1/assets?filename=clip.bvh")).body(clip.to_owned()).send().await;
        let answer = answer.ok()?;
        let status = answer.status();
        let body: Value = answer.json().await.ok()?;
        let may_be_tried_again = body["retryable"] == true && status != StatusCode::INSUFFICIENT_STORAGE;
        assert!(status.is_success() || may_be_tried_again, "taken, or to be tried again: {status} {body}");
        Some(body["id"].as_str()?.to_owned())
    }

    /// Asks for a job; gives whether it was acknowledged.
    pub(super) async fn ask(&mut self, url: &str, asset: &str) -> bool {
        self.ask_for(url, &edit_of(asset), "").await.is_some()
    }

    /// Asks for a job under a key, so that who asks again has the same job; an empty key is none. Gives the job when it was acknowledged.
    pub(super) async fn ask_for(&mut self, url: &str, body: &Value, key: &str) -> Option<String> {
        let request = self.client.post(format!("{url}/v1/jobs")).json(body);
        let request = if key.is_empty() { request } else { request.header("idempotency-key", key) };
        let answer = request.send().await.ok()?;
        // A key that was used before finds its job, which may have ended.
        if ![StatusCode::ACCEPTED, StatusCode::OK].contains(&answer.status()) {
            let (status, body) = (answer.status(), answer.json::<Value>().await.unwrap_or_default());
            assert!(body["retryable"] == true || body.is_null(), "taken, or to be tried again: {status} {body}");
            return None;
        }
        let job: Value = answer.json().await.ok()?;
        let id = job["id"].as_str().expect("an id").to_owned();
        self.promised.push(id.clone());
        Some(id)
    }

    /// All items of a list, page by page.
    pub(super) async fn list(&self, url: &str, path: &str) -> Vec<Value> {
        let (mut items, mut cursor) = (Vec::new(), String::new());
        loop {
            let page = self.client.get(format!("{url}{path}?limit=100{cursor}")).send().await.expect("an answer");
            let page: Value = page.json().await.expect("JSON");
            items.extend(page["items"].as_array().expect("a page").clone());
            let Some(next) = page["next_cursor"].as_str() else { return items };
            cursor = format!("&cursor={next}");
        }
    }

    /// Follows what happens to all jobs, from behind the event of that number.
    pub(super) async fn follow(&self, url: &str, last_id: &str) -> EventReader {
        EventReader::open(self.client.get(format!("{url}/v1/events")), Some(last_id)).await
    }

    /// Has a clip written again and waits for the file; gives the job and the digest of what came, `None` when the service dies meanwhile.
    pub(super) async fn have_at_once(&mut self, url: &str, clip: &str) -> Option<(String, String)> {
        let part = multipart::Part::text(clip.to_owned()).file_name("clip.bvh");
        let request = self.client.post(format!("{url}/v1/edits")).header("accept", "text/plain");
        let answer = request.multipart(multipart::Form::new().part("source", part)).send().await.ok()?;
        let header = |name: &str| answer.headers()[name].to_str().expect("text").trim_matches('"').to_owned();
        assert_eq!(answer.status(), StatusCode::OK, "a file");
        let (id, tag) = (header("job-id"), header("etag"));
        let bytes = answer.bytes().await.ok()?;
        assert_eq!(tag, sha256_of(&bytes), "all of it came");
        self.promised.push(id.clone());
        Some((id, tag))
    }

    pub(super) async fn job(&self, url: &str, id: &str) -> Option<Value> {
        let answer = self.client.get(format!("{url}/v1/jobs/{id}")).send().await.ok()?;
        let status = answer.status();
        assert!(status != StatusCode::NOT_FOUND, "an acknowledged job is never lost: {id}");
        if status == StatusCode::OK { answer.json().await.ok() } else { None }
    }

    /// Waits until every promise is kept, and checks every result. Gives the states with how often each came.
    pub(super) async fn collect(&self, url: &str) -> BTreeMap<String, usize> {
        let mut states = BTreeMap::new();
        let began = Instant::now();
        for id in &self.promised {
            let job = loop {
                let job = self.job(url, id).await.unwrap_or_default();
                let state = job["state"].as_str().unwrap_or_default();
                if ["succeeded", "failed", "canceled"].contains(&state) {
                    break job;
                }
                assert!(began.elapsed() < PATIENCE, "every acknowledged job ends: {job}");
                tokio::time::sleep(std::time::Duration::from_millis(20)).await;
            };
            for result in job["results"].as_array().expect("a list") {
                self.check_result(url, result).await;
            }
            assert!(
                job["state"] != "succeeded" || job["results"].as_array().is_some_and(|all| all.len() == 1),
                "{job}"
            );
            *states.entry(job["state"].as_str().expect("a state").to_owned()).or_insert(0) += 1;
        }
        states
    }

    /// What is visible is complete: the bytes have the digest that the job says.
    pub(super) async fn check_result(&self, url: &str, result: &Value) {
        let path = format!("/v1/results/{}/content", result["id"].as_str().expect("an id"));
        let answer = self.client.get(format!("{url}{path}")).send().await.expect("an answer");
        assert_eq!(answer.status(), StatusCode::OK, "the result is there");
        let bytes = answer.bytes().await.expect("its bytes");
        assert_eq!(result["sha256"], sha256_of(&bytes).as_str(), "the bytes are whole");
    }

    /// Where the service sends who wants the result of the first job.
    pub(super) async fn redirect(&self, url: &str) -> String {
        let job = self.job(url, &self.promised[0]).await.expect("is there");
        let path = format!("/v1/results/{}/content", job["results"][0]["id"].as_str().expect("an id"));
        let policy = reqwest::redirect::Policy::none();
        let client = Client::builder().timeout(PATIENCE).no_proxy().redirect(policy).build().expect("a client");
        let answer = client.get(format!("{url}{path}")).send().await.expect("an answer");
        assert_eq!(answer.status(), StatusCode::TEMPORARY_REDIRECT, "sent elsewhere");
        answer.headers()["location"].to_str().expect("text").to_owned()
    }

    pub(super) async fn cancel(&self, url: &str, id: &str) -> Value {
        let answer = self.client.post(format!("{url}/v1/jobs/{id}/cancel")).send().await.expect("an answer");
        answer.json().await.expect("JSON")
    }

    pub(super) async fn status(&self, url: &str, path: &str) -> StatusCode {
        self.client.get(format!("{url}{path}")).send().await.expect("an answer").status()
    }
}
