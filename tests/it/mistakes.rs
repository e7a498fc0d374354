//! Typical mistakes, and what whoever makes them reads: every message is kept in a file, so that a change of one is looked at as a user would.
//!
//! `RETARGETD_UPDATE=1 cargo it mistakes` writes the files anew.

mod command_line;
mod over_http;

use std::path::Path;

/// Words that a user has nothing to do with: types of ours, phrases of libraries.
const INTERNALS: [&str; 14] = [
    "struct ",
    "deserialize",
    "serde",
    "panicked",
    "Some(",
    "None",
    "Err(",
    "at line ",
    "expected value",
    "invalid type",
    "invalid length",
    "elements",
    "src/",
    "error sending request",
];

/// What is told of one mistake.
struct Told {
    /// What was done.
    mistake: String,
    /// What is read, line by line.
    lines: Vec<String>,
}

/// Checks every message by itself, and all of them against the file.
fn check(told: &[Told], file: &str) {
    let mut wrong = Vec::new();
    for Told { mistake, lines } in told {
        let mut wrongly = |what: String| wrong.push(format!("{mistake}: {what}: {lines:#?}"));
        if lines.len() > 3 {
            wrongly("more than three lines".to_owned());
        }
        if lines.is_empty() {
            wrongly("nothing is told".to_owned());
        }
        for line in lines {
            if let Some(word) = INTERNALS.iter().find(|word| line.contains(**word)) {
                wrongly(format!("'{word}' is nothing of the user's"));
            }
            // A part of a sentence that stands twice in a row: `byte 8: byte 8: `.
            let parts: Vec<&str> = line.split(": ").collect();
            if parts.windows(2).any(|pair| pair[0] == pair[1]) {
                wrongly("doubled".to_owned());
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let text: String =
        told.iter().map(|Told { mistake, lines }| format!("$ {mistake}\n{}\n\n", lines.join("\n"))).collect();
    compare(&text, file);
}

#[expect(clippy::disallowed_methods, reason = "tests have no settings")]
fn compare(text: &str, file: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/mistakes").join(file);
    if std::env::var_os("RETARGETD_UPDATE").is_some() {
        std::fs::write(&path, text).expect("the file can be written");
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    for (made, kept) in text.split("\n\n").zip(kept.split("\n\n")) {
        assert_eq!(made, kept, "run 'RETARGETD_UPDATE=1 cargo it mistakes' and read what changed");
    }
    assert_eq!(text.len(), kept.len(), "run 'RETARGETD_UPDATE=1 cargo it mistakes' and read what changed");
}
