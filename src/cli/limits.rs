//! The limits that files are read under: those of the service, which a command line can raise by the same names.

use clap::{ArgMatches, Command, error::ErrorKind};

use crate::{
    config::{Setting, Settings},
    formats::{Limit, Limits},
    jobs::engine_limits,
};

use super::setting_argument::setting_argument;

/// What a hint of the engine says to those who ask a service.
const ASK_OPERATOR: &str = "ask the operator to raise the limit";

/// One flag and one environment variable per limit of files, made from the table of settings.
#[derive(Clone, Copy, Debug)]
pub(super) struct LimitArguments {
    pub(super) limits: Limits,
}

/// The limit that a setting sets; nothing for a setting that is none of files.
fn limit_of(setting: &Setting) -> Option<Limit> {
    let name = setting.name.strip_prefix("max_")?;
    Limit::ALL.into_iter().find(|limit| limit.name() == name)
}

/// The settings of limits of files.
fn settings() -> impl Iterator<Item = &'static Setting> {
    Settings::TABLE.iter().filter(|setting| limit_of(setting).is_some())
}

impl clap::Args for LimitArguments {
    fn augment_args(command: Command) -> Command {
        command.args(settings().map(|setting| {
            setting_argument(setting).hide_env_values(true).help_heading("Limits of files").hide_short_help(true)
        }))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl clap::FromArgMatches for LimitArguments {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let given = |setting: &Setting| matches.get_one::<String>(setting.name).cloned();
        match Settings::read(|setting| limit_of(setting).and_then(|_| given(setting))) {
            Ok(settings) => Ok(Self { limits: engine_limits(&settings) }),
            Err(errors) => Err(clap::Error::raw(ErrorKind::ValueValidation, format!("{errors}\n"))),
        }
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// A hint of the engine for somebody who is at the command line: nobody else has to be asked. `message` names the limit.
pub(super) fn hint_for_command_line(message: &str, hint: &str) -> String {
    let is_named =
        |setting: &&Setting| limit_of(setting).is_some_and(|limit| message.contains(&format!("'{}'", limit.name())));
    let Some(setting) = settings().find(is_named) else { return hint.to_owned() };
    hint.replace(ASK_OPERATOR, &format!("raise the limit: {}, or {}", setting.flag(), setting.variable()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_limit_of_files_is_a_setting() {
        for limit in Limit::ALL {
            assert!(settings().any(|setting| limit_of(setting) == Some(limit)), "{}", limit.name());
        }
        let defaults = Settings::read(|_| None).expect("defaults are good");
        assert_eq!(engine_limits(&defaults), Limits::default(), "the service and the library agree");
    }

    #[test]
    fn a_hint_names_the_flag() {
        let hint = hint_for_command_line("the limit 'clips' is 1", "send less, or ask the operator to raise the limit");
        assert_eq!(hint, "send less, or raise the limit: --max-clips, or RETARGETD_MAX_CLIPS");
        assert_eq!(hint_for_command_line("no limit", "check it"), "check it", "others stay");
    }
}
