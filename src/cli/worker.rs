//! The `worker` subcommand: runs jobs that other processes take on, until it is told to stop.

use std::process::ExitCode;

use tokio_util::sync::CancellationToken;

use super::{
    manner::speaks_json,
    service::{self, Signals, WorkerArguments},
};
use crate::{app, config::Settings};

pub(super) fn run(arguments: &WorkerArguments) -> ExitCode {
    service::run(&arguments.0, work)
}

async fn work(settings: Settings) -> anyhow::Result<()> {
    let mut signals = Signals::listen()?;
    let stop = CancellationToken::new();
    let mut working = std::pin::pin!(app::work(settings, stop.clone(), announce));
    tokio::select! {
        ended = &mut working => return ended,
        () = signals.next() => {}
    }
    tracing::info!("stopping; a second signal stops at once");
    stop.cancel();
    tokio::select! {
        ended = working => ended,
        // What runs is taken up by another worker when its lease has run out, the same as after a crash.
        () = signals.next() => Ok(()),
    }
}

/// Says where probes are answered, on standard output: scripts read the address from it.
#[allow(clippy::print_stdout, reason = "this line is the command's output")]
fn announce(probes: Option<std::net::SocketAddr>) {
    if speaks_json() {
        println!("{}", serde_json::json!({"probes_url": probes.map(|address| format!("http://{address}"))}));
    } else if let Some(address) = probes {
        println!("retargetd works, probes on http://{address}");
    }
}
