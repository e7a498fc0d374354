//! Rust sources as the rules look at them: without comments and strings, each line knowing whether it is test code.

use std::path::{Path, PathBuf};

/// One file.
pub(super) struct Code {
    /// As it stands.
    pub(super) raw: String,
    /// Its module path, such as `["formats", "gltf", "read"]`; empty for `lib.rs`.
    pub(super) module: Vec<String>,
    /// Without comments and the contents of strings; as many lines as `raw`.
    bare: String,
    /// Offset into `bare` from which on everything is test code.
    tests_from: usize,
}

/// A path such as `std::time::Instant` and where it stands.
pub(super) struct Place {
    segments: Vec<String>,
    pub(super) line: usize,
    pub(super) in_test: bool,
    /// Whether it is of a `pub use`.
    pub(super) is_handed_on: bool,
}

impl Place {
    pub(super) fn segment(&self, index: usize) -> &str {
        self.segments.get(index).map_or("", String::as_str)
    }

    pub(super) fn text(&self) -> String {
        self.segments.join("::")
    }

    pub(super) fn segments(&self) -> &[String] {
        &self.segments
    }
}

/// Every Rust file below a folder, in the order of their names, with paths relative to the project.
pub(super) fn code_files(folder: &Path) -> Vec<(PathBuf, Code)> {
    let (mut open, mut found) = (vec![folder.to_owned()], Vec::new());
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(&next).expect("a folder of the project") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                found.push(path);
            }
        }
    }
    found.sort();
    let of_project = |path: &Path| path.strip_prefix(env!("CARGO_MANIFEST_DIR")).unwrap_or(path).to_owned();
    let read = |path: PathBuf| {
        let raw = std::fs::read_to_string(&path).expect("a file of the project");
        let within = path.strip_prefix(folder).unwrap_or(&path).with_extension("");
        (of_project(&path), Code::new(raw, &within))
    };
    found.into_iter().map(read).collect()
}

impl Code {
    pub(super) fn new(raw: String, within: &Path) -> Self {
        let mut module: Vec<String> =
            within.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
        if module.last().is_some_and(|last| last == "mod" || last == "lib") {
            module.pop();
        }
        let bare = bare(&raw);
        let is_test_file = module.iter().skip(1).any(|part| part == "tests");
        // By the house rules the tests of a file are its end.
        let tests_from = if is_test_file { 0 } else { bare.find("#[cfg(test)]\nmod tests {").unwrap_or(bare.len()) };
        Self { raw, module, bare, tests_from }
    }

    /// Every path that begins with that name, `use` trees unfolded.
    pub(super) fn paths(&self, first: &str) -> Vec<Place> {
        let mut places = Vec::new();
        for start in self.word_starts(first) {
            let rest = &self.bare[start + first.len()..];
            let before = self.bare[..start].trim_end();
            let is_first = !before.ends_with("::") && !before.ends_with('$') && !before.ends_with('.');
            let names_crate =
                rest.trim_start().starts_with("::") || before.ends_with("use") || before.ends_with("crate");
            if is_first && names_crate {
                let mut found = Vec::new();
                unfold(rest, vec![first.to_owned()], &mut found);
                let (line, in_test) = (self.line(start), start >= self.tests_from);
                let is_handed_on = before.strip_suffix("use").is_some_and(|before| is_public(before.trim_end()));
                places.extend(found.into_iter().map(|segments| Place { segments, line, in_test, is_handed_on }));
            }
        }
        places
    }

    /// Lines outside tests that have that word.
    pub(super) fn words(&self, word: &str) -> impl Iterator<Item = usize> {
        self.word_starts(word).into_iter().filter(|start| *start < self.tests_from).map(|start| self.line(start))
    }

    /// Lines outside tests that have that text.
    pub(super) fn finds(&self, text: &str) -> impl Iterator<Item = usize> {
        let starts = self.bare[..self.tests_from].match_indices(text);
        starts.map(|(start, _)| self.line(start)).collect::<Vec<_>>().into_iter()
    }

    /// Lines outside tests whose `super::super::…` ends outside the top-level module.
    pub(super) fn escapes(&self) -> Vec<usize> {
        let supers = |start: usize| self.bare[start..].split("::").take_while(|part| *part == "super").count();
        let starts = self.word_starts("super").into_iter().filter(|start| *start < self.tests_from);
        starts.filter(|start| supers(*start) >= self.module.len().max(1)).map(|start| self.line(start)).collect()
    }

    /// Every function that has a body: its name, the line that it begins on, and how many lines it has.
    pub(super) fn functions(&self) -> Vec<(&str, usize, usize)> {
        let starts = self.word_starts("fn").into_iter();
        starts
            .filter_map(|start| {
                let text = &self.bare[start..];
                let name =
                    text[2..].trim_start().split(|letter: char| !letter.is_alphanumeric() && letter != '_').next();
                let body = body_of_function(text)?;
                let mut depth = 0;
                let end = text[body..].char_indices().find_map(|(at, letter)| {
                    depth += i32::from(letter == '{') - i32::from(letter == '}');
                    (depth == 0).then_some(body + at)
                })?;
                let name = name.filter(|name| !name.is_empty())?;
                Some((name, self.line(start), text[..end].matches('\n').count() + 1))
            })
            .collect()
    }

    fn word_starts(&self, word: &str) -> Vec<usize> {
        let is_word = |byte: Option<&u8>| byte.is_some_and(|byte| byte.is_ascii_alphanumeric() || *byte == b'_');
        let bytes = self.bare.as_bytes();
        let starts = self.bare.match_indices(word).map(|(start, _)| start);
        starts
            .filter(|start| {
                let before = start.checked_sub(1).and_then(|before| bytes.get(before));
                !is_word(before) && !is_word(bytes.get(start + word.len()))
            })
            .collect()
    }

    fn line(&self, offset: usize) -> usize {
        self.bare[..offset].matches('\n').count() + 1
    }
}

/// Where the braces begin behind a signature; none for one that ends in a semicolon. `[u8; 4]` has one of its own.
fn body_of_function(text: &str) -> Option<usize> {
    let mut depth = 0;
    for (at, letter) in text.char_indices() {
        match letter {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            '{' if depth == 0 => return Some(at),
            ';' if depth == 0 => return None,
            _ => {}
        }
    }
    None
}

/// Whether `pub`, or `pub` with where, is the last of a text.
fn is_public(before: &str) -> bool {
    let place = before.strip_suffix(')').and_then(|before| before.rsplit_once("pub("));
    before.ends_with("pub") || place.is_some_and(|(_, place)| !place.contains(['{', '}', ';']))
}

/// Adds the paths that `::a::{b, c::d}` stands for, behind `prefix`.
fn unfold(rest: &str, mut prefix: Vec<String>, found: &mut Vec<Vec<String>>) {
    let mut rest = rest.trim_start();
    while let Some(behind) = rest.strip_prefix("::") {
        rest = behind.trim_start();
        if let Some(group) = rest.strip_prefix('{') {
            for item in items(group) {
                let end = item.find(|letter: char| !letter.is_alphanumeric() && letter != '_').unwrap_or(item.len());
                let mut path = prefix.clone();
                path.push(item[..end].to_owned());
                unfold(&item[end..], path, found);
            }
            return;
        }
        let end = rest.find(|letter: char| !letter.is_alphanumeric() && letter != '_').unwrap_or(rest.len());
        prefix.push(rest[..end].to_owned());
        rest = rest[end..].trim_start();
    }
    found.push(prefix);
}

/// The items of a brace group that has been opened.
fn items(group: &str) -> Vec<&str> {
    let (mut depth, mut begin, mut items) = (0, 0, Vec::new());
    for (at, letter) in group.char_indices() {
        match letter {
            '{' => depth += 1,
            '}' if depth > 0 => depth -= 1,
            ',' | '}' if depth == 0 => {
                items.push(group[begin..at].trim());
                begin = at + 1;
                if letter == '}' {
                    break;
                }
            }
            _ => {}
        }
    }
    items.retain(|item| !item.is_empty());
    items
}

/// Blanks comments and the contents of strings and keeps the lines.
fn bare(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = match first {
            '/' if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
            '/' if rest.starts_with("/*") => rest.find("*/").map_or(rest.len(), |end| end + 2),
            '"' => quoted_length(rest),
            'r' if !out.ends_with(|letter: char| letter.is_alphanumeric() || letter == '_') => raw_length(rest),
            '\'' => letter_length(rest),
            _ => 0,
        };
        if length == 0 {
            out.push(first);
            rest = &rest[first.len_utf8()..];
        } else {
            let is_text = first != '/';
            out.push_str(if is_text { "\"" } else { "" });
            out.extend(rest[..length].chars().filter(|letter| *letter == '\n'));
            out.push_str(if is_text { "\"" } else { "" });
            rest = &rest[length..];
        }
    }
    out
}

fn quoted_length(text: &str) -> usize {
    let mut escaped = false;
    for (at, letter) in text.char_indices().skip(1) {
        match letter {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return at + 1,
            _ => {}
        }
    }
    text.len()
}

/// The length of a raw string that begins here; 0 if none does.
fn raw_length(text: &str) -> usize {
    let hashes = text[1..].chars().take_while(|letter| *letter == '#').count();
    if !text[1 + hashes..].starts_with('"') {
        return 0;
    }
    let close = format!("\"{}", "#".repeat(hashes));
    let begin = hashes + 2;
    text[begin..].find(&close).map_or(text.len(), |end| begin + end + close.len())
}

/// The length of a character literal that begins here; 0 for a lifetime.
fn letter_length(text: &str) -> usize {
    let mut letters = text.char_indices().skip(1);
    match letters.next() {
        Some((_, '\\')) => {
            text[2..].char_indices().skip(1).find(|(_, letter)| *letter == '\'').map_or(0, |(at, _)| at + 3)
        }
        Some((at, letter)) if text[at + letter.len_utf8()..].starts_with('\'') => at + letter.len_utf8() + 1,
        _ => 0,
    }
}

#[test]
fn comments_strings_and_trees_are_understood() {
    let text = "use crate::{\n    model::{Clip, Scene},\n    rig,\n};\n// crate::http\nlet a = \"crate::store\"; let b = '\"';\n\
                fn f<'a>(x: &'a str) { crate::jobs::run(r#\"crate::cli \"x\"\"#, b\"\\\"\") }\n#[cfg(test)]\nmod tests {\nuse crate::app;\n}";
    let code = Code::new(text.to_owned(), Path::new("engine/mod"));
    let seen: Vec<(String, usize, bool)> =
        code.paths("crate").iter().map(|place| (place.text(), place.line, place.in_test)).collect();
    let seen: Vec<(&str, usize, bool)> = seen.iter().map(|(path, line, test)| (path.as_str(), *line, *test)).collect();
    let expected = [
        ("crate::model::Clip", 1, false),
        ("crate::model::Scene", 1, false),
        ("crate::rig", 1, false),
        ("crate::jobs::run", 7, false),
        ("crate::app", 10, true),
    ];
    assert_eq!(seen, expected, "paths, lines, and whether they are test code");
    let escaping =
        Code::new("use super::super::http;\nuse super::super::super::x;".to_owned(), Path::new("formats/gltf/read"));
    assert_eq!(escaping.escapes(), [2], "three levels up is the crate's root");
}
