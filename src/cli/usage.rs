//! What is wrong with a command line, in one sentence and a hint.

use std::ffi::OsString;

use clap::{
    Command, Error,
    error::{ContextKind, ContextValue, ErrorKind},
};

use super::exit::{BAD_USAGE, Exit};

/// The parser's words, without what is the same each time. Nothing where help was asked for, which is no error.
/// `asked` is the command that was typed, with its subcommand.
pub(super) fn refused(error: &Error, asked: &str) -> Option<Exit> {
    let is_help = matches!(
        error.kind(),
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
    );
    if is_help {
        return None;
    }
    let text = error.render().to_string();
    let mut message = String::new();
    let (mut hint, mut command) = (String::new(), asked.to_owned());
    let mut is_usage = false;
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty()) {
        if let Some(usage) = line.strip_prefix("Usage: ") {
            is_usage = true;
            command = usage
                .split(' ')
                .take_while(|word| word.starts_with(|letter: char| letter.is_ascii_lowercase()))
                .collect::<Vec<_>>()
                .join(" ");
        } else if let Some(tip) = line.strip_prefix("tip: ") {
            hint = if hint.is_empty() { tip.to_owned() } else { hint };
        } else if line.starts_with("For more information") || is_usage {
        } else {
            let separator = if message.is_empty() {
                ""
            } else if message.ends_with(':') {
                " "
            } else {
                ", "
            };
            message.push_str(separator);
            message.push_str(line.strip_prefix("error: ").unwrap_or(line));
        }
    }
    if let Some((told, values)) = no_such_value(error) {
        message = told;
        hint = if hint.is_empty() { format!("use {values}") } else { hint };
    }
    message = undoubled(message);
    if hint.is_empty() && is_plain_word(&message) {
        hint = format!("files follow a flag, such as --source FILE; '{command} --help' lists the flags");
    }
    if hint.is_empty() {
        hint = format!("'{command} --help' says what it takes");
    }
    Some(Exit::new(BAD_USAGE, message, hint))
}

/// The command that is meant by the words of a command line, as far as they name one.
pub(super) fn named(mut program: Command, words: &[OsString]) -> String {
    program.build();
    let (mut command, mut names) = (&program, vec![program.get_name().to_owned()]);
    for word in words.iter().skip(1).filter_map(|word| word.to_str()) {
        let Some(found) = command.find_subcommand(word) else { break };
        names.push(found.get_name().to_owned());
        command = found;
    }
    names.join(" ")
}

/// What is wrong with a value that is none of a few, and those.
fn no_such_value(error: &Error) -> Option<(String, String)> {
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    let Some(ContextValue::Strings(known)) = error.get(ContextKind::ValidValue) else { return None };
    let (flag, value) = (text(ContextKind::InvalidArg)?, text(ContextKind::InvalidValue)?);
    let flag = flag.split(' ').next().unwrap_or(flag);
    let values = match known.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => return None,
    };
    let message =
        if value.is_empty() { format!("{flag} needs a value") } else { format!("'{value}' is not a value of {flag}") };
    Some((message, values))
}

/// The same where what is wrong with a value names it once more.
fn undoubled(message: String) -> String {
    let parts = message.strip_prefix("invalid value '").and_then(|rest| rest.split_once("' for '"));
    let told = parts.and_then(|(value, rest)| {
        let (argument, reason) = rest.split_once("': ")?;
        reason.starts_with(&format!("'{value}' is ")).then(|| format!("{argument}: {reason}"))
    });
    told.unwrap_or(message)
}

/// Whether a word without a flag stands where none belongs.
fn is_plain_word(message: &str) -> bool {
    let word = message.strip_prefix("unexpected argument '");
    word.is_some_and(|word| !word.starts_with('-'))
}

#[cfg(test)]
mod tests {
    use clap::{Arg, Command};

    use super::*;

    #[test]
    fn a_command_line_is_refused_in_two_lines() {
        let command = || {
            Command::new("retargetd")
                .arg(Arg::new("source").long("source").required(true))
                .arg(Arg::new("target").long("target").required(true))
        };
        let refused =
            |words: &[&str]| refused(&command().try_get_matches_from(words).expect_err("it is wrong"), "retargetd");
        let missing = refused(&["retargetd"]).expect("an error");
        assert_eq!(
            missing.message, "the following required arguments were not provided: --source <source>, --target <target>",
            "all in one line"
        );
        assert_eq!(missing.hint, "'retargetd --help' says what it takes", "where to look");
        let unknown = refused(&["retargetd", "--sorce", "a"]).expect("an error");
        assert!(unknown.message.contains("--sorce") && unknown.hint.contains("--source"), "{unknown:?}");
        assert!(refused(&["retargetd", "--help"]).is_none(), "help is no error");
    }

    #[test]
    fn a_value_that_is_none_is_told_with_those_that_are_and_with_its_command() {
        let command = || {
            let verdict = Arg::new("fail-on").long("fail-on").value_parser(["warn", "fail"]);
            let label = Arg::new("label").long("label").value_parser(|text: &str| match text.contains('=') {
                true => Ok(text.to_owned()),
                false => Err("expected NAME=TEXT"),
            });
            Command::new("retargetd").subcommand(Command::new("submit").arg(verdict).arg(label))
        };
        let refused = |words: &[&str]| {
            let words: Vec<OsString> = words.iter().map(OsString::from).collect();
            let error = command().try_get_matches_from(&words).expect_err("it is wrong");
            let exit = refused(&error, &named(command(), &words)).expect("an error");
            (exit.message, exit.hint)
        };
        let (message, hint) = refused(&["retargetd", "submit", "--fail-on", "bad"]);
        assert_eq!((message.as_str(), hint.as_str()), ("'bad' is not a value of --fail-on", "use warn or fail"));
        let (message, hint) = refused(&["retargetd", "submit", "--label", "shot"]);
        assert!(message.ends_with("expected NAME=TEXT"), "{message}");
        assert_eq!(hint, "'retargetd submit --help' says what it takes", "of the command");
        let told = |text: &str| undoubled(text.to_owned());
        assert_eq!(
            told("invalid value 'A' for '<NAME>': 'A' is not a name"),
            "<NAME>: 'A' is not a name",
            "once is enough"
        );
        assert_eq!(told("invalid value 'A' for '<NAME>': too short"), "invalid value 'A' for '<NAME>': too short");
    }
}
