//! Following a job by its events, over as many connections as it takes.

use reqwest::{Method, Response, StatusCode};
use serde_json::Value;

use super::remote::{Patience, Remote, exit_of, problem_of};
use crate::{
    cli::exit::{Exit, FAILED},
    model::Control,
};

/// Follows a job until it has ended; gives it as it is then. How far it is goes to `control`, for a bar to be drawn from.
pub(super) async fn to_its_end(remote: &Remote, id: &str, control: &Control) -> Result<Value, Exit> {
    let path = format!("/v1/jobs/{id}");
    let (mut last_heard, mut patience) = (None, Patience::new());
    loop {
        let job = remote.get(&path).await?;
        if matches!(job["state"].as_str(), Some("succeeded" | "failed" | "canceled")) {
            return Ok(job);
        }
        let request = remote.request(Method::GET, &format!("{path}/events"));
        let request = last_heard.iter().fold(request, |request, id: &String| request.header("last-event-id", id));
        match request.send().await {
            Ok(answer) if answer.status() == StatusCode::OK => {
                let before = last_heard.clone();
                read(answer, &mut last_heard, control).await;
                if last_heard != before {
                    patience = Patience::new();
                    continue;
                }
                let reason = Exit::new(FAILED, "the service ends the stream of events again and again", "");
                patience.pause(None, reason).await?;
            }
            // It has ended in the meantime.
            Ok(answer) if answer.status().is_success() => {}
            Ok(answer) => {
                let problem = problem_of(answer).await;
                let exit = exit_of(&problem, "the service refuses");
                if problem["retryable"] != true {
                    return Err(exit);
                }
                patience.pause(None, exit).await?;
            }
            Err(error) => patience.pause(None, remote.unreachable(&error)).await?,
        }
    }
}

/// Reads a stream until it ends or breaks.
async fn read(mut answer: Response, last_heard: &mut Option<String>, control: &Control) {
    let mut text = Vec::new();
    while let Ok(Some(chunk)) = answer.chunk().await {
        text.extend_from_slice(&chunk);
        // Letters of several bytes may be cut, lines are not.
        while let Some(end) = text.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = text.drain(..=end).collect();
            let line = String::from_utf8_lossy(&line);
            if let Some(id) = line.strip_prefix("id:") {
                *last_heard = Some(id.trim().to_owned());
            } else if let Some(data) = line.strip_prefix("data:") {
                show(data, control);
            }
        }
    }
}

fn show(data: &str, control: &Control) {
    let data: Value = serde_json::from_str(data).unwrap_or_default();
    let Some(progress) = data.get("progress") else { return };
    let count = |name: &str| progress[name].as_u64().unwrap_or(0);
    control.repeat(progress["phase"].as_str().unwrap_or_default(), count("done"), count("total"));
}
