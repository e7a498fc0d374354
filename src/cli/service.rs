//! What the subcommands that run until they are told to stop have in common: their settings, their logs, their signals.

use std::{collections::BTreeMap, process::ExitCode};

use clap::{Arg, ArgMatches, Command};

use super::exit;
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
        Settings::TABLE.iter().fold(command.arg(collector), |command, setting| {
            let argument = Arg::new(setting.name)
                .long(setting.name.replace('_', "-"))
                .env(setting.variable())
                .value_name(setting.unit.name().to_ascii_uppercase())
                .help(format!("{} [default: {}]", setting.help.trim(), setting.default));
            command.arg(argument)
        })
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
