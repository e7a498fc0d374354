//! The `serve` subcommand: the API, and workers beside it, until it is told to stop.

use std::process::ExitCode;

use super::{
    manner::speaks_json,
    service::{self, Arguments, Signals},
};
use crate::{app, config::Settings};

pub(super) fn run(arguments: &Arguments) -> ExitCode {
    service::run(arguments, serve)
}

async fn serve(settings: Settings) -> anyhow::Result<()> {
    let mut signals = Signals::listen()?;
    let (asks_who_calls, is_reachable) = (settings.asks_who_calls(), !settings.listen.ip().is_loopback());
    let issuer = settings.token_issuer.clone();
    let running = app::start(settings).await?;
    announce(&running);
    if asks_who_calls {
        tracing::info!("callers must show a key; 'retargetd keys create' makes them");
        if !issuer.is_empty() {
            tracing::info!(issuer, "callers may show a token instead");
        }
    } else if is_reachable {
        tracing::warn!(address = %running.address(), "everyone who can reach this address can use the service: no authentication is required");
    } else {
        tracing::info!("every program on this machine can use the service: no keys are asked for");
    }
    signals.next().await;
    tracing::info!("stopping; a second signal stops at once");
    tokio::select! {
        stopped = running.stop() => stopped,
        // What runs is taken up by the next start, the same as after a crash.
        () = signals.next() => Ok(()),
    }
}

/// Says where to go, on standard output: scripts read the address from it.
#[allow(clippy::print_stdout, reason = "this line is the command's output")]
fn announce(running: &app::Running) {
    let url = running.url();
    if speaks_json() {
        println!("{}", serde_json::json!({"url": url, "probes_url": running.probes_url()}));
        return;
    }
    println!("retargetd listens on {url} (documentation: {url}/docs)");
    if let Some(url) = running.probes_url() {
        println!("probes on {url}");
    }
}
