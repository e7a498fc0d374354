//! Log lines: for people on a terminal, one JSON object per line everywhere else.

use std::io::IsTerminal;

use tracing_subscriber::{EnvFilter, fmt};

/// Starts writing log lines to standard error. `json` decides the form; `None` asks whether a terminal is there. Does
/// nothing when logs have been started before.
///
/// # Errors
/// When `filter` is no filter.
pub fn start_logs(json: Option<bool>, filter: &str) -> Result<(), String> {
    let filter = EnvFilter::try_new(filter).map_err(|error| format!("'{filter}' is no log filter: {error}"))?;
    // Of changes that have been made before, Postgres says at each start that they have.
    let quiet = "sqlx::postgres::notice=warn".parse().map_err(|error| format!("no log filter: {error}"))?;
    let filter = filter.add_directive(quiet);
    let json = json.unwrap_or_else(|| !std::io::stderr().is_terminal());
    let lines = fmt().with_env_filter(filter).with_writer(std::io::stderr);
    // A second start in one process (tests, the demo) keeps the first subscriber; that is no failure.
    let _ = if json { lines.json().flatten_event(true).try_init() } else { lines.with_target(false).try_init() };
    Ok(())
}
