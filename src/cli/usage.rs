//! What is wrong with a command line, in one sentence and a hint.

use clap::{Error, error::ErrorKind};

use super::exit::{BAD_USAGE, Exit};

/// The parser's words, without what is the same each time. Nothing where help was asked for, which is no error.
pub(super) fn refused(error: &Error) -> Option<Exit> {
    let is_help = matches!(
        error.kind(),
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
    );
    if is_help {
        return None;
    }
    let text = error.render().to_string();
    let mut message = String::new();
    let (mut hint, mut command) = (String::new(), "retargetd".to_owned());
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
    if hint.is_empty() && is_plain_word(&message) {
        hint = format!("files follow a flag, such as --source FILE; '{command} --help' lists the flags");
    }
    if hint.is_empty() {
        hint = format!("'{command} --help' says what it takes");
    }
    Some(Exit::new(BAD_USAGE, message, hint))
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
        let refused = |words: &[&str]| refused(&command().try_get_matches_from(words).expect_err("it is wrong"));
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
}
