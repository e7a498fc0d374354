//! Words that texts for users do not have: idioms of this house instead of the terms of the field.

use std::path::Path;

use super::{code::code_files, none, root};

/// Parts whose strings users read.
const PARTS: [&str; 11] =
    ["cli", "config", "engine", "formats", "http", "identity", "jobs", "outbound", "report", "retargeter", "store"];

/// What is not said, and what is said instead.
const BANNED: [(&str, &str); 11] = [
    ("nobody", "no caller, no process, nothing"),
    ("somebody", "another caller, another process"),
    ("everybody", "every caller, everyone"),
    ("whoever", "the caller that"),
    ("who asks", "the caller"),
    ("who wants", "callers that"),
    ("of your own for", "chosen by the client"),
    ("can be had", "is available"),
    ("anew", "again"),
    ("brought down", "crashed"),
    ("misbehave", "fail"),
];

/// Words behind "is no" that are plain English.
const AFTER_NO: [&str; 6] = ["longer", "more", "less", "earlier", "later", "such"];

/// The strings of a line of code without its comment; escapes stay as they are.
fn strings(line: &str) -> Vec<&str> {
    let (mut found, mut rest) = (Vec::new(), line);
    while let Some(begin) = rest.find('"') {
        if rest[..begin].contains("//") {
            break;
        }
        let text = &rest[begin + 1..];
        let mut escaped = false;
        let end = text.char_indices().find(|(_, letter)| {
            let is_end = *letter == '"' && !escaped;
            escaped = *letter == '\\' && !escaped;
            is_end
        });
        let end = end.map_or(text.len(), |(end, _)| end);
        found.push(&text[..end]);
        rest = text.get(end + 1..).unwrap_or_default();
    }
    found
}

/// "X is no Y" where Y is a thing: an engineer writes "X is not a Y".
fn says_is_no(text: &str) -> bool {
    [" is no ", " are no "].iter().any(|verb| {
        text.match_indices(verb).any(|(at, _)| {
            let (before, after) = (&text[..at], &text[at + verb.len()..]);
            let next = after.split(|letter: char| !letter.is_alphabetic()).next().unwrap_or_default();
            !before.to_lowercase().ends_with("there") && !AFTER_NO.contains(&next)
        })
    })
}

#[test]
fn texts_for_users_have_the_terms_of_the_field() {
    let mut broken = Vec::new();
    let mut check = |path: &Path, line: usize, text: &str| {
        let lower = text.to_lowercase();
        for (banned, instead) in BANNED.iter().filter(|(banned, _)| lower.contains(banned)) {
            broken.push(format!("{}:{}: '{banned}'; better: {instead}", path.display(), line + 1));
        }
        if says_is_no(text) {
            broken.push(format!("{}:{}: 'is no …'; better: is not a …", path.display(), line + 1));
        }
    };
    for part in PARTS {
        for (path, code) in code_files(&root().join("src").join(part)) {
            if path.to_string_lossy().contains("tests") {
                continue;
            }
            let own = code.raw.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
            for (line, text) in own.lines().enumerate() {
                strings(text).into_iter().for_each(|text| check(&path, line, text));
            }
        }
    }
    let document = std::fs::read_to_string(root().join("openapi/openapi.json")).expect("the document");
    for (line, text) in document.lines().enumerate().filter(|(_, text)| text.contains("\"description\"")) {
        check(Path::new("openapi/openapi.json"), line, text);
    }
    // The help of settings is made of comments.
    let settings = std::fs::read_to_string(root().join("docs/reference/settings.md")).expect("the settings");
    settings.lines().enumerate().for_each(|(line, text)| check(Path::new("docs/reference/settings.md"), line, text));
    none(&broken, "words of texts that users read");
}

#[test]
fn a_banned_word_is_found_in_strings_alone() {
    assert_eq!(strings(r#"f("a \" b", "c"); // "d""#), [r#"a \" b"#, "c"]);
    assert!(says_is_no("'x' is no id") && says_is_no("these are no bounds"));
    assert!(!says_is_no("it is no longer there") && !says_is_no("There is no joint 'x'"));
}
