//! How a command talks: to people on standard error, in color where it is a terminal; to programs on standard output, where they ask for it.

use std::{
    fmt::Display,
    io::Write,
    sync::atomic::{AtomicBool, Ordering},
};

use clap::builder::styling::{AnsiColor, Style};

/// What every command can be told of how to talk.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(super) struct Manner {
    /// Say nothing on standard error but errors
    #[arg(long, short, global = true, help_heading = "How it talks")]
    quiet: bool,
    /// Print one JSON object on standard output: what was done, or the error
    #[arg(long, global = true, help_heading = "How it talks")]
    json: bool,
}

// A process runs one command, and all of it talks in the same way.
static IS_QUIET: AtomicBool = AtomicBool::new(false);
static SPEAKS_JSON: AtomicBool = AtomicBool::new(false);

impl Manner {
    /// What words of a command line that could not be read ask for.
    pub(super) fn of_words(words: impl Iterator<Item = std::ffi::OsString>) -> Self {
        Self { quiet: false, json: words.into_iter().any(|word| word == "--json") }
    }

    /// Has the whole command talk like that.
    pub(super) fn set(self) {
        IS_QUIET.store(self.quiet, Ordering::Relaxed);
        SPEAKS_JSON.store(self.json, Ordering::Relaxed);
    }
}

/// Whether nothing but errors is to be told.
pub(super) fn is_quiet() -> bool {
    IS_QUIET.load(Ordering::Relaxed)
}

/// Whether a program reads what goes to standard output.
pub(super) fn speaks_json() -> bool {
    SPEAKS_JSON.load(Ordering::Relaxed)
}

/// The colors of words that say how things are.
fn style_of(word: &str) -> Style {
    match word {
        "error" | "fail" | "failed" => AnsiColor::Red.on_default().bold(),
        "warning" | "warn" => AnsiColor::Yellow.on_default(),
        "hint" => AnsiColor::Cyan.on_default(),
        "pass" | "wrote" => AnsiColor::Green.on_default(),
        _ => Style::new(),
    }
}

/// One line on standard error, whether or not it is to be quiet. That it is closed is no reason to fail.
pub(super) fn say_aloud(line: impl Display) {
    let line = line.to_string();
    let mut output = anstream::stderr().lock();
    // `verdict: fail: …` and `verdict of walk: fail: …` have the word that matters in second place.
    let (before, rest) = match line.split_once(": ") {
        Some((start, _)) if start.starts_with("verdict") => line.split_at(start.len() + 2),
        _ => ("", line.as_str()),
    };
    let end = rest.find([':', ' ']).unwrap_or(rest.len());
    let (word, rest) = rest.split_at(end);
    let style = style_of(word);
    let _ = writeln!(output, "{before}{style}{word}{style:#}{rest}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_that_matter_have_colors() {
        assert_ne!(style_of("error"), Style::new(), "what is wrong");
        assert_ne!(style_of("pass"), style_of("fail"), "how good it is");
        assert_eq!(style_of("following"), Style::new(), "everything else");
    }
}
