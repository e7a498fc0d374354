//! The limits that files are read under: those of the service, which a command line can raise by the same names.

use clap::{Arg, ArgMatches, Command, error::ErrorKind};

use crate::{
    config::Settings,
    formats::{Limit, Limits},
    jobs::engine_limits,
};

use super::value_name::value_name;

/// What a hint of the engine says to those who ask a service.
const ASK_OPERATOR: &str = "ask the operator to raise the limit";

/// One flag and one environment variable per limit of files, made from the table of settings.
#[derive(Clone, Copy, Debug)]
pub(super) struct LimitArguments {
    pub(super) limits: Limits,
}

/// The setting of a limit.
fn setting_of(limit: Limit) -> String {
    format!("max_{}", limit.name())
}

fn is_of_files(setting: &str) -> bool {
    Limit::ALL.into_iter().any(|limit| setting_of(limit) == setting)
}

impl clap::Args for LimitArguments {
    fn augment_args(command: Command) -> Command {
        let settings = Settings::TABLE.iter().filter(|setting| is_of_files(setting.name));
        settings.fold(command, |command, setting| {
            let argument = Arg::new(setting.name)
                .long(setting.name.replace('_', "-"))
                .env(setting.variable())
                .hide_env_values(true)
                .value_name(value_name(setting))
                .help_heading("Limits of files")
                .hide_short_help(true)
                .help(format!("{} [default: {}]", setting.help.trim(), setting.default));
            command.arg(argument)
        })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl clap::FromArgMatches for LimitArguments {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let given = |name: &str| is_of_files(name).then(|| matches.get_one::<String>(name).cloned()).flatten();
        match Settings::read(|setting| given(setting.name)) {
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
    let named = |limit: &Limit| message.contains(&format!("'{}'", limit.name()));
    let Some(limit) = Limit::ALL.into_iter().find(named) else { return hint.to_owned() };
    let setting = setting_of(limit);
    let flag = setting.replace('_', "-");
    hint.replace(ASK_OPERATOR, &format!("raise the limit: --{flag}, or RETARGETD_{}", setting.to_uppercase()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_limit_of_files_is_a_setting() {
        for limit in Limit::ALL {
            let name = setting_of(limit);
            assert!(Settings::TABLE.iter().any(|setting| setting.name == name), "{name}");
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
