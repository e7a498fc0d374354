//! Exit codes, and how failures and warnings are told on standard error.

use std::{
    fmt::Display,
    io::{self, Write},
    process::ExitCode,
};

use serde_json::{Value, json};

use super::{
    hints::in_words_of_commands,
    manner::{is_quiet, say_aloud, speaks_json},
};
use crate::engine::{Failure, FailureCode};

/// The command line or the environment cannot be used.
pub(super) const BAD_USAGE: u8 = 2;
/// An input was refused.
pub(super) const INPUT_REFUSED: u8 = 3;
/// The work failed for a reason that is not the input's.
pub(super) const FAILED: u8 = 4;
/// The results are there, and worse than `--fail-on` allows.
pub(super) const WORSE: u8 = 5;

/// Why a subcommand ends without its result: what to say, and the exit code.
#[derive(Debug)]
pub(super) struct Exit {
    pub(super) code: u8,
    pub(super) message: String,
    pub(super) hint: String,
    /// One line each: the single things that are wrong.
    pub(super) details: Vec<String>,
    /// Whether a program that asks has been told already what came of it.
    pub(super) is_reported: bool,
}

impl Exit {
    pub(super) fn new(code: u8, message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { code, message: message.into(), hint: hint.into(), details: Vec::new(), is_reported: false }
    }

    /// A failure of the engine; `subject` names the input that it is about, as the user gave it.
    pub(super) fn from_failure(failure: &Failure, subject: &str) -> Self {
        let is_about_nothing = subject.is_empty() || failure.code == FailureCode::Canceled;
        let message = if is_about_nothing { failure.to_string() } else { format!("{subject}: {failure}") };
        let details = failure.errors.iter().map(|error| {
            let pointer = if error.pointer.is_empty() { &*error.code } else { &error.pointer };
            let suggestion = match error.did_you_mean.as_slice() {
                [] => String::new(),
                names => format!(" (did you mean {}?)", quoted(names)),
            };
            format!("{pointer}: {}{suggestion}", error.detail)
        });
        // One thing that is wrong is told by the message and the hint; a list is for several.
        let details = if failure.errors.len() > 1 { details.collect() } else { Vec::new() };
        let hint = in_words_of_commands(&message, &failure.hint);
        Self { details, ..Self::new(exit_code(failure), message, hint) }
    }

    /// Says it on standard error, in three lines at most, and gives the exit code.
    pub(super) fn tell(&self) -> ExitCode {
        say_aloud(format_args!("error: {}", one_line(&self.message)));
        if !self.details.is_empty() {
            say_aloud(format_args!("  {}", one_line(&self.details.join("; "))));
        }
        if !self.hint.is_empty() {
            say_aloud(format_args!("hint: {}", one_line(&self.hint)));
        }
        if speaks_json() && !self.is_reported {
            // Standard output that is gone has nobody to tell.
            let _ = to_json(&json!({"error": self.view()})).and_then(|text| print(&text));
        }
        ExitCode::from(self.code)
    }

    /// The same for programs.
    pub(super) fn view(&self) -> Value {
        json!({"exit_code": self.code, "message": self.message, "hint": self.hint, "details": self.details})
    }
}

/// 3 when the input is to blame, 4 otherwise.
fn exit_code(failure: &Failure) -> u8 {
    match failure.code {
        FailureCode::Canceled | FailureCode::EngineCrashed | FailureCode::Internal => FAILED,
        _ => INPUT_REFUSED,
    }
}

/// One line on standard error, unless it is to be quiet.
pub(super) fn say(line: impl Display) {
    if !is_quiet() {
        say_aloud(line);
    }
}

/// Text on standard output. A reader that has gone away (`| head`) ends the work quietly.
pub(super) fn print(text: &str) -> Result<(), Exit> {
    print_bytes(text.as_bytes())
}

/// The same for what is no text.
pub(super) fn print_bytes(bytes: &[u8]) -> Result<(), Exit> {
    let mut output = io::stdout().lock();
    match output.write_all(bytes).and_then(|()| output.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Exit::new(FAILED, format!("standard output cannot be written: {error}"), ""))
        }
        _ => Ok(()),
    }
}

/// Tells a program what was done, where one asks; people have been told.
pub(super) fn report(done: impl FnOnce() -> Value) -> Result<(), Exit> {
    if speaks_json() { print(&to_json(&done())?) } else { Ok(()) }
}

/// A document as text, with a line feed at its end.
pub(super) fn to_json(document: &impl serde::Serialize) -> Result<String, Exit> {
    let text = serde_json::to_string_pretty(document);
    text.map(|text| text + "\n")
        .map_err(|error| Exit::new(FAILED, format!("the result cannot be written: {error}"), ""))
}

/// Text from files may hold line feeds and control characters; a message is one line and moves no cursor.
pub(super) fn one_line(text: &str) -> String {
    text.chars().map(|character| if character.is_control() { ' ' } else { character }).collect()
}

fn quoted(names: &[String]) -> String {
    names.iter().map(|name| format!("'{name}'")).collect::<Vec<_>>().join(" or ")
}

/// Tells the reason on standard error and gives the exit code.
pub(super) fn refuse(code: u8, reason: &dyn Display) -> ExitCode {
    let text = reason.to_string();
    say_aloud(format_args!("error: {text}"));
    if speaks_json() {
        // Standard output that is gone has nobody to tell.
        let _ = to_json(&json!({"error": Exit::new(code, text, "").view()})).and_then(|text| print(&text));
    }
    ExitCode::from(code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_of_ours_are_not_the_inputs() {
        let code = |code| exit_code(&Failure::new(code, ""));
        assert_eq!(code(FailureCode::AssetMalformed), INPUT_REFUSED, "the file is to blame");
        assert_eq!(code(FailureCode::Canceled), FAILED, "nobody is to blame");
        assert_eq!(code(FailureCode::Internal), FAILED, "we are to blame");
    }

    #[test]
    fn a_message_is_one_line() {
        assert_eq!(one_line("a\nb\x1b[31m"), "a b [31m", "no line feed and no escape sequence");
    }
}
