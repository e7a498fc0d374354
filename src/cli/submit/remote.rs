//! Talking to a service over a connection that may break: what fails for a moment is tried again.

use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::Duration,
};

use reqwest::{Client, Method, RequestBuilder, Response, StatusCode, Url, header};
use serde_json::Value;
use sha2::{Digest, Sha256};
use tokio::time::{Instant, sleep};

use crate::{
    cli::{
        exit::{BAD_USAGE, Exit, FAILED, INPUT_REFUSED, one_line, say},
        files::InputFile,
    },
    jobs::hexadecimal,
};

/// How long a service may be away before it is given up, once it has answered.
const PATIENCE: Duration = Duration::from_secs(120);
/// How long it may take until it answers for the first time: an address that is wrong stays wrong.
const FIRST_PATIENCE: Duration = Duration::from_secs(2);
/// The pauses between tries begin with this and double.
const FIRST_PAUSE: Duration = Duration::from_millis(250);
const LONGEST_PAUSE: Duration = Duration::from_secs(15);
/// How long nothing may arrive. A stream of events has a heartbeat well within it.
const LONGEST_SILENCE: Duration = Duration::from_secs(60);

/// A service, and who asks.
pub(super) struct Remote {
    /// Whether it has answered yet.
    has_answered: AtomicBool,
    client: Client,
    url: String,
    key: Option<String>,
}

/// When to try again, and when to give up.
pub(super) struct Patience {
    end: Instant,
    pause: Duration,
}

impl Patience {
    pub(super) fn new() -> Self {
        Self::of(PATIENCE)
    }

    fn of(patience: Duration) -> Self {
        Self { end: Instant::now() + patience, pause: FIRST_PAUSE }
    }

    /// Waits for as long as the service asks for, else longer each time; gives up with that reason when the time is over.
    pub(super) async fn pause(&mut self, asked: Option<Duration>, reason: Exit) -> Result<(), Exit> {
        let pause = asked.unwrap_or(self.pause).min(LONGEST_PAUSE);
        if Instant::now() + pause > self.end {
            return Err(reason);
        }
        sleep(pause).await;
        self.pause = (self.pause * 2).min(LONGEST_PAUSE);
        Ok(())
    }
}

impl Remote {
    pub(super) fn new(url: &str, key: Option<String>) -> Result<Self, Exit> {
        let client = Client::builder().connect_timeout(Duration::from_secs(10)).read_timeout(LONGEST_SILENCE).build();
        let client = client.map_err(|error| Exit::new(FAILED, format!("no connection can be made: {error}"), ""))?;
        let parsed = Url::parse(url).ok().filter(|url| matches!(url.scheme(), "http" | "https") && url.has_host());
        if parsed.is_none() {
            let message = format!("--service {url}: this is not the address of a service");
            return Err(Exit::new(BAD_USAGE, message, "an address is like http://127.0.0.1:8080"));
        }
        let url = url.trim_end_matches('/').to_owned();
        Ok(Self { has_answered: AtomicBool::new(false), client, url, key })
    }

    /// A request with the caller's key.
    pub(super) fn request(&self, method: Method, path: &str) -> RequestBuilder {
        let request = self.client.request(method, format!("{}{path}", self.url));
        self.key.iter().fold(request, |request, key| request.bearer_auth(key))
    }

    /// Sends a request that may be sent any number of times, until it is answered for good.
    pub(super) async fn send(&self, request: impl Fn() -> RequestBuilder) -> Result<Response, Exit> {
        self.greet().await?;
        let mut patience = Patience::new();
        loop {
            match request().send().await {
                Ok(answer) if answer.status().is_success() => return Ok(answer),
                Ok(answer) => {
                    let (asked, problem) = (retry_after(&answer), problem_of(answer).await);
                    if problem["retryable"] != true {
                        return Err(exit_of(&problem, "the service refuses"));
                    }
                    patience.pause(asked, exit_of(&problem, "the service refuses")).await?;
                }
                Err(error) => patience.pause(None, self.unreachable(&error)).await?,
            }
        }
    }

    /// Finds out whether anybody answers at all before anything large is sent: an address that is wrong is told at once.
    async fn greet(&self) -> Result<(), Exit> {
        if self.has_answered.load(Ordering::Relaxed) {
            return Ok(());
        }
        let mut patience = Patience::of(FIRST_PATIENCE);
        let mut is_told = false;
        loop {
            let left = patience.end.saturating_duration_since(Instant::now()).max(FIRST_PAUSE);
            let exit = match self.client.get(format!("{}/livez", self.url)).timeout(left).send().await {
                Ok(_) => {
                    self.has_answered.store(true, Ordering::Relaxed);
                    return Ok(());
                }
                Err(error) if error.is_timeout() => self.silent(),
                Err(error) => self.unreachable(&error),
            };
            if !std::mem::replace(&mut is_told, true) {
                say(format_args!("{}; trying again for {} s", one_line(&exit.message), FIRST_PATIENCE.as_secs()));
            }
            patience.pause(None, exit).await?;
        }
    }

    fn silent(&self) -> Exit {
        let message = format!("the service at {} does not answer", self.url);
        Exit::new(FAILED, message, "is it running? --service or RETARGETD_URL says where it is")
    }

    /// Uploads a file; gives its id. The same bytes again give the same id.
    pub(super) async fn upload(&self, part: &str, file: &InputFile) -> Result<String, Exit> {
        use base64::{Engine as _, engine::general_purpose::STANDARD};
        let named = file.as_named();
        let digest = format!("sha-256=:{}:", STANDARD.encode(Sha256::digest(named.bytes)));
        let bytes = bytes::Bytes::copy_from_slice(named.bytes);
        let path = format!("/v1/assets?{}", query_of("filename", named.name));
        let request = || {
            self.request(Method::POST, &path)
                .header(header::CONTENT_TYPE, "application/octet-stream")
                .header("content-digest", &digest)
                .body(bytes.clone())
        };
        // Who may not come in, or meets nobody, does not for any file.
        let about_part = |exit: Exit| match exit.code {
            INPUT_REFUSED => Exit { message: format!("{part} {}: {}", file.path.display(), exit.message), ..exit },
            _ => exit,
        };
        let answer = self.send(request).await.map_err(about_part)?;
        self.text(json_of(answer).await?, "id")
    }

    /// Asks for a job or a batch; gives its id. However often the request has to be sent, there is one.
    pub(super) async fn ask(&self, path: &str, body: &Value) -> Result<String, Exit> {
        let word = uuid::Uuid::now_v7().to_string();
        let request = || self.request(Method::POST, path).header("idempotency-key", &word).json(body);
        let answer = self.send(request).await?;
        self.text(json_of(answer).await?, "id")
    }

    /// A JSON document.
    pub(super) async fn get(&self, path: &str) -> Result<Value, Exit> {
        let request = || self.request(Method::GET, path).header(header::ACCEPT, "application/json");
        json_of(self.send(request).await?).await
    }

    /// The bytes of a result. A download that breaks goes on where it was; what comes must have the digest of the result.
    pub(super) async fn download(&self, result: &Value) -> Result<Vec<u8>, Exit> {
        let path = self.text(result.clone(), "content")?;
        let mut bytes: Vec<u8> = Vec::new();
        let mut patience = Patience::new();
        loop {
            let request = || {
                let request = self.request(Method::GET, &path);
                if bytes.is_empty() {
                    request
                } else {
                    request.header(header::RANGE, format!("bytes={}-", bytes.len()))
                }
            };
            let mut answer = self.send(request).await?;
            if answer.status() != StatusCode::PARTIAL_CONTENT {
                bytes.clear();
            }
            let broken = loop {
                match answer.chunk().await {
                    Ok(Some(chunk)) => bytes.extend_from_slice(&chunk),
                    Ok(None) => break None,
                    Err(error) => break Some(error),
                }
            };
            match broken {
                Some(error) => patience.pause(None, self.unreachable(&error)).await?,
                None => break,
            }
        }
        if result["sha256"] != digest_of(&bytes).as_str() {
            return Err(Exit::new(FAILED, format!("{path}: what arrived is not what the service holds"), "try again"));
        }
        Ok(bytes)
    }

    pub(super) fn unreachable(&self, error: &reqwest::Error) -> Exit {
        let cause = cause(error);
        let message = format!("the service at {} does not answer: {cause}", self.url);
        Exit::new(FAILED, message, "is it running? --service or RETARGETD_URL says where it is")
    }

    fn text(&self, answer: Value, member: &str) -> Result<String, Exit> {
        let text = answer[member].as_str().map(str::to_owned);
        text.ok_or_else(|| {
            let message = format!("the answer of {} has no '{member}'", self.url);
            Exit::new(FAILED, message, "is this a retargetd service, and of a version that this one knows?")
        })
    }
}

/// The last of the reasons, which is the one that somebody can do something about.
fn cause(error: &dyn std::error::Error) -> String {
    error.source().map_or_else(|| error.to_string(), cause)
}

/// The SHA-256 of bytes, in hexadecimal.
pub(super) fn digest_of(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

/// A query of one member, with what has a meaning in addresses written otherwise.
fn query_of(name: &str, value: &str) -> String {
    let url = Url::parse_with_params("http://service/", [(name, value)]);
    url.ok().and_then(|url| url.query().map(str::to_owned)).unwrap_or_default()
}

fn retry_after(answer: &Response) -> Option<Duration> {
    let seconds = answer.headers().get(header::RETRY_AFTER)?.to_str().ok()?.parse().ok()?;
    Some(Duration::from_secs(seconds))
}

pub(super) async fn json_of(answer: Response) -> Result<Value, Exit> {
    let place = answer.url().path().to_owned();
    let failed = |reason: String| Exit::new(FAILED, format!("{place}: the answer cannot be read: {reason}"), "");
    let bytes = answer.bytes().await.map_err(|error| failed(error.to_string()))?;
    serde_json::from_slice(&bytes).map_err(|error| failed(error.to_string()))
}

/// The problem that an answer is; something like it where a proxy answered.
pub(super) async fn problem_of(answer: Response) -> Value {
    let status = answer.status();
    let problem = answer.bytes().await.ok().and_then(|bytes| serde_json::from_slice::<Value>(&bytes).ok());
    let gateways = [StatusCode::BAD_GATEWAY, StatusCode::SERVICE_UNAVAILABLE, StatusCode::GATEWAY_TIMEOUT];
    problem.filter(|problem| problem["code"].is_string()).unwrap_or_else(|| {
        let detail = format!("something on the way to the service answers {status}");
        serde_json::json!({"status": status.as_u16(), "detail": detail, "retryable": gateways.contains(&status)})
    })
}

/// A problem as it is told: the service's own words, and 3 where what was sent is to blame.
pub(super) fn exit_of(problem: &Value, subject: &str) -> Exit {
    let text = |member: &str| problem[member].as_str().unwrap_or_default();
    let code = match problem["status"].as_u64() {
        Some(401 | 403) => BAD_USAGE,
        Some(400 | 404 | 410 | 413 | 415 | 422) => INPUT_REFUSED,
        _ => FAILED,
    };
    // The sentence may begin with the place already.
    let place = Some(text("place")).filter(|place| !text("detail").starts_with(place)).unwrap_or_default();
    let subject = [subject, text("part"), place].into_iter().filter(|text| !text.is_empty());
    let message = subject.chain([text("detail")]).collect::<Vec<_>>().join(": ");
    let hint = match problem["status"].as_u64() {
        Some(401) => "put a key into the environment variable RETARGETD_KEY",
        _ => text("hint"),
    };
    let errors = problem["errors"].as_array().map_or(&[][..], Vec::as_slice);
    let detail = |error: &Value| {
        let names: Vec<&str> =
            error["did_you_mean"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        let suggestion = match names.is_empty() {
            true => String::new(),
            false => format!(" (did you mean {}?)", names.join(" or ")),
        };
        let member = |name: &str| error[name].as_str().unwrap_or_default().to_owned();
        format!("{}: {}{suggestion}", member("pointer"), member("detail"))
    };
    Exit { details: errors.iter().map(detail).collect(), ..Exit::new(code, message, hint) }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn problems_are_told_in_the_words_of_the_service() {
        let problem = json!({
            "status": 422, "code": "unknown_joint", "detail": "there is no joint 'Hip'", "part": "config", "hint": "look",
            "errors": [{"pointer": "/source/root", "detail": "no such joint", "did_you_mean": ["Hips"]}],
        });
        let exit = exit_of(&problem, "job job_1 failed");
        assert_eq!((exit.code, exit.hint.as_str()), (INPUT_REFUSED, "look"), "what was sent is to blame");
        assert_eq!(exit.message, "job job_1 failed: config: there is no joint 'Hip'", "which part, and what");
        assert_eq!(exit.details, ["/source/root: no such joint (did you mean Hips?)"], "where");
        assert_eq!(query_of("filename", "a&b ü.glb"), "filename=a%26b+%C3%BC.glb", "no name breaks an address");
        assert_eq!(exit_of(&json!({"status": 504}), "").code, FAILED, "nobody's fault");
        assert!(exit_of(&json!({"status": 401}), "").hint.contains("RETARGETD_KEY"), "what to do");
    }
}
