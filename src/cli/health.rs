//! The `health` subcommand: for containers that have no shell to ask with.

use std::time::Duration;

use super::exit::{Exit, FAILED, report};

/// Arguments of `retargetd health`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Address of the service.
    #[arg(long, env = "RETARGETD_URL", default_value = "http://127.0.0.1:8080")]
    url: String,
}

pub(super) fn run(arguments: Arguments) -> Result<(), Exit> {
    match super::runtime()?.block_on(ask(arguments.url.trim_end_matches('/'))) {
        Ok(()) => report(|| serde_json::json!({"ready": true})),
        Err(reason) => Err(Exit::new(FAILED, reason, "is it running? --url or RETARGETD_URL says where it is")),
    }
}

/// The last of the reasons, which is the one that somebody can do something about.
fn cause(error: &dyn std::error::Error) -> String {
    error.source().map_or_else(|| error.to_string(), cause)
}

async fn ask(url: &str) -> Result<(), String> {
    const PATIENCE: Duration = Duration::from_secs(3);
    let url = format!("{url}/readyz");
    let unreachable = |error: reqwest::Error| format!("{url} does not answer: {}", cause(&error));
    let client = reqwest::Client::builder().timeout(PATIENCE).no_proxy().build().map_err(unreachable)?;
    let status = client.get(&url).send().await.map_err(unreachable)?.status();
    if status.is_success() { Ok(()) } else { Err(format!("{url} says {status}; the service is not ready")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn why_nobody_answers_is_said() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
        let url = format!("http://{}", listener.local_addr().expect("an address"));
        drop(listener);
        let reason = ask(&url).await.expect_err("nobody listens");
        assert!(reason.contains("refused"), "the cause: {reason}");
    }
}
