//! What the subcommands that run until they are told to stop have in common: their settings, their logs, their signals.

use std::{collections::BTreeMap, process::ExitCode};

use clap::{Arg, ArgMatches, Command, parser::ValueSource};

use super::{exit, setting_argument::setting_argument};
use crate::{
    config::{LogFormat, Setting, Settings},
    jobs, telemetry,
};

/// Arguments of `retargetd serve` and `retargetd worker`: one flag and one environment variable per setting, made from the table of settings.
#[derive(Debug)]
pub(super) struct Arguments {
    given: BTreeMap<&'static str, String>,
}

/// Where every program that speaks OpenTelemetry finds the collector; stands where the setting is not given.
const COLLECTOR: &str = "OTEL_EXPORTER_OTLP_ENDPOINT";

impl clap::Args for Arguments {
    fn augment_args(command: Command) -> Command {
        let collector = Arg::new(COLLECTOR).long("otel-exporter-otlp-endpoint").env(COLLECTOR).hide(true);
        command.arg(collector).args(Settings::TABLE.iter().map(setting_argument))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl clap::FromArgMatches for Arguments {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let given = Settings::TABLE.iter().filter_map(|Setting { name, .. }| {
            let text = matches.get_one::<String>(name)?;
            Some((*name, text.clone()))
        });
        let mut given: BTreeMap<_, _> = given.collect();
        if let Some(collector) = matches.get_one::<String>(COLLECTOR) {
            given.entry("otlp_endpoint").or_insert_with(|| collector.clone());
        }
        Ok(Self { given })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Settings of requests, which a process without an API has no use for.
const OF_REQUESTS: [&str; 26] = [
    "listen",
    "authentication",
    "token_issuer",
    "token_audience",
    "token_keys",
    "token_algorithms",
    "token_principal_claim",
    "token_scope_claim",
    "token_scope_prefix",
    "token_leeway",
    "token_keys_period",
    "token_keys_pause",
    "allowed_hosts",
    "cors_origins",
    "default_wait",
    "max_wait",
    "max_event_streams",
    "event_stream_period",
    "event_heartbeat",
    "max_page_items",
    "max_webhooks",
    "url_input",
    "url_input_timeout",
    "max_concurrent_requests",
    "max_principal_requests",
    "upload_timeout",
];

/// Bounds of requests and of what they leave behind. A worker has no use for them either, but processes of both kinds are often started with
/// the same bounds, so they are only left out of its help.
const BOUNDS_OF_REQUESTS: [&str; 18] = [
    "upload_idle_timeout",
    "studio",
    "max_request_bytes",
    "max_document_bytes",
    "max_json_values",
    "max_batch_items",
    "max_batch_bytes",
    "max_labels",
    "max_label_bytes",
    "max_outputs_per_job",
    "max_queued_jobs",
    "max_queued_batch_jobs",
    "max_queued_bytes",
    "max_principal_jobs",
    "max_stored_documents",
    "max_stored_document_bytes",
    "max_document_versions",
    "download_link_period",
];

/// Arguments of `retargetd worker`: those of `serve` that do something there. The others are left alone in the environment, which processes
/// of both kinds may share, and refused on the command line.
#[derive(Debug)]
pub(super) struct WorkerArguments(pub(super) Arguments);

impl clap::Args for WorkerArguments {
    fn augment_args(command: Command) -> Command {
        let command = Arguments::augment_args(command);
        let hidden = OF_REQUESTS.into_iter().chain(BOUNDS_OF_REQUESTS);
        hidden.fold(command, |command, name| command.mut_arg(name, |argument| argument.hide(true)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl clap::FromArgMatches for WorkerArguments {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let is_typed = |name: &&str| matches.value_source(name) == Some(ValueSource::CommandLine);
        if let Some(name) = OF_REQUESTS.into_iter().find(is_typed) {
            let message = format!(
                "--{} does nothing in a worker, which takes no requests\n\n  tip: give it to 'retargetd serve'\n",
                name.replace('_', "-")
            );
            return Err(clap::Error::raw(clap::error::ErrorKind::UnknownArgument, message));
        }
        Arguments::from_arg_matches(matches).map(Self)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Reads the settings, starts the logs, and runs `role` on a runtime of its own.
pub(super) fn run<F: Future<Output = anyhow::Result<()>>>(
    arguments: &Arguments,
    role: impl FnOnce(Settings) -> F,
) -> ExitCode {
    if let Some(misspelt) = misspelt_variables(set_variables()) {
        return exit::refuse(exit::BAD_USAGE, &misspelt);
    }
    jobs::keep_memory_private();
    let settings = match Settings::read(|setting| arguments.given.get(setting.name).cloned()) {
        Ok(settings) => settings,
        Err(errors) => return exit::refuse(exit::BAD_USAGE, &errors),
    };
    let json = match settings.log_format {
        LogFormat::Auto => None,
        LogFormat::Text => Some(false),
        LogFormat::Json => Some(true),
    };
    if let Err(error) = telemetry::start_logs(json, &settings.log) {
        return exit::refuse(exit::BAD_USAGE, &error);
    }
    let runtime = match tokio::runtime::Builder::new_multi_thread().enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return exit::refuse(exit::FAILED, &error),
    };
    match runtime.block_on(role(settings)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => exit::refuse(exit::FAILED, &format!("{error:#}")),
    }
}

/// The names of the variables that are set.
fn set_variables() -> impl Iterator<Item = String> {
    std::env::vars_os().filter_map(|(name, _)| name.into_string().ok())
}

/// What is wrong with variables that look like a setting and are none; nothing where nothing is. Others that begin as ours do are left: an
/// orchestrator makes some of its own for every service that it knows.
fn misspelt_variables(names: impl Iterator<Item = String>) -> Option<String> {
    const PREFIX: &str = "RETARGETD_";
    /// Names with a letter too many, too few or another one are nearer than this; those that only begin alike are not.
    const NEAR: f64 = 0.85;
    let known: Vec<String> = Settings::TABLE.iter().map(|setting| setting.name.to_ascii_uppercase()).collect();
    let misspelt = names.filter_map(|name| {
        let own = name.strip_prefix(PREFIX)?;
        let nearness = |known: &String| strsim::normalized_damerau_levenshtein(own, known);
        let nearest = known.iter().max_by(|one, other| nearness(one).total_cmp(&nearness(other)))?;
        (own != nearest && nearness(nearest) >= NEAR).then(|| format!("\n  {name}: did you mean {PREFIX}{nearest}?"))
    });
    let misspelt: Vec<String> = misspelt.collect();
    (!misspelt.is_empty()).then(|| format!("there are variables that are not settings:{}", misspelt.concat()))
}

/// The signals that stop a service.
pub(super) struct Signals {
    #[cfg(unix)]
    terminate: tokio::signal::unix::Signal,
}

impl Signals {
    /// Begins to listen; signals from here on are not missed.
    pub(super) fn listen() -> std::io::Result<Self> {
        Ok(Self {
            #[cfg(unix)]
            terminate: tokio::signal::unix::signal(tokio::signal::unix::SignalKind::terminate())?,
        })
    }

    /// Waits for the next one.
    pub(super) async fn next(&mut self) {
        #[cfg(unix)]
        tokio::select! {
            _ = tokio::signal::ctrl_c() => {}
            _ = self.terminate.recv() => {}
        }
        #[cfg(not(unix))]
        let _ = tokio::signal::ctrl_c().await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_only_requests_need_is_a_setting_and_not_a_workers() {
        use clap::{Args as _, FromArgMatches as _};

        for name in OF_REQUESTS.into_iter().chain(BOUNDS_OF_REQUESTS) {
            assert!(Settings::TABLE.iter().any(|setting| setting.name == name), "{name} is a setting");
        }
        let read = |words: &[&str]| {
            let command = WorkerArguments::augment_args(Command::new("worker"));
            WorkerArguments::from_arg_matches(&command.get_matches_from(words))
                .map(|_| ())
                .map_err(|error| error.to_string())
        };
        assert!(read(&["worker", "--workers", "2"]).is_ok(), "what it does");
        assert!(read(&["worker", "--max-queued-jobs", "9"]).is_ok(), "bounds that serve is started with, too");
        assert!(
            read(&["worker", "--listen", "0.0.0.0:1"]).is_err_and(|error| error.contains("--listen does nothing")),
            "what it does not"
        );
    }

    #[test]
    fn a_misspelt_variable_is_an_error_and_a_strange_one_is_not() {
        let wrong = |names: &[&str]| misspelt_variables(names.iter().map(|name| (*name).to_owned()));
        let error = wrong(&["RETARGETD_WORKRES", "HOME", "RETARGETD_LISTEN"]).expect("one is misspelt");
        assert!(error.contains("RETARGETD_WORKRES: did you mean RETARGETD_WORKERS?"), "{error}");
        assert!(!error.contains("LISTEN"), "the others are settings or somebody else's: {error}");
        let kubernetes = ["RETARGETD_PORT", "RETARGETD_SERVICE_HOST", "RETARGETD_PORT_80_TCP_ADDR"];
        assert_eq!(wrong(&kubernetes), None, "of an orchestrator");
        assert_eq!(wrong(&["RETARGETD_TEST_JOBS", "RETARGETD_URL", "RETARGETD_KEY"]), None, "of tools");
    }
}
