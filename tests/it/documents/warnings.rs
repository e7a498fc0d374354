//! The codes of warnings: those of the source against those that the reference explains.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use super::{files_below, root, text_of};

/// The page that explains them.
pub(super) const PAGE: &str = "docs/reference/warnings.md";

/// Every code that the source can give, and the top-level module and file that give it.
fn codes() -> BTreeMap<String, BTreeSet<String>> {
    let mut codes: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let is_product = |path: &PathBuf| !path.to_string_lossy().contains("tests");
    for path in files_below(root().join("src"), "rs").into_iter().filter(is_product) {
        let text = std::fs::read_to_string(&path).expect("a file of the project");
        let text = text.split("#[cfg(test)]").next().unwrap_or_default();
        for code in codes_of(&path, text) {
            codes.entry(code).or_default().insert(giver(&path));
        }
    }
    codes
}

/// `formats/bvh/write.rs` is told as `bvh`, `rig/rest.rs` as `rig`.
fn giver(path: &Path) -> String {
    let within = path.strip_prefix(root().join("src")).expect("a file of the sources");
    let parts: Vec<String> = within.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    let place = if parts[0] == "formats" && parts.len() > 2 { &parts[1] } else { &parts[0] };
    place.clone()
}

fn codes_of(path: &Path, text: &str) -> BTreeSet<String> {
    let is_code = |text: &str| {
        text.len() > 3
            && text.chars().all(|letter| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '_')
    };
    let literal = |text: &str| text.trim_start().strip_prefix('"')?.split_once('"').map(|(code, _)| code.to_owned());
    let mut codes = BTreeSet::new();
    for call in text.split(".warn(").skip(1) {
        let argument = call.trim_start();
        match literal(argument) {
            Some(code) => {
                assert!(is_code(&code), "{}: a code is in snake case: {code:?}", path.display());
                codes.insert(code);
            }
            // Reported from a table of `("code", "detail", "hint")`.
            None if argument.starts_with("code,") => {
                let rows = text.split("    (\"").skip(1).filter_map(|row| literal(&format!("\"{row}")));
                codes.extend(rows.filter(|code| is_code(code)));
            }
            // Taken over from another reporter, or a method of the same name that reports by itself.
            None => assert!(
                argument.starts_with("warning.code") || argument.starts_with("reporter)"),
                "{}: the code of a warning is a literal, so that it can be listed: {}",
                path.display(),
                argument.lines().next().unwrap_or_default()
            ),
        }
    }
    codes
}

/// The table, with the explanations that the page has already.
pub(super) fn table(page: &str) -> String {
    let known: BTreeMap<&str, &str> = page
        .split_once("<!-- warnings: made by a test -->")
        .map_or("", |(_, rest)| rest.split("<!-- warnings: end -->").next().unwrap_or_default())
        .lines()
        .filter_map(|line| {
            let mut cells = line.strip_prefix("| `")?.splitn(3, " | ");
            let code = cells.next()?.trim_end_matches('`');
            Some((code, cells.nth(1)?.trim_end_matches(" |").trim()))
        })
        .collect();
    let mut table = "| code | from | what it means |\n| --- | --- | --- |\n".to_owned();
    for (code, givers) in codes() {
        let givers: Vec<&str> = givers.iter().map(String::as_str).collect();
        let about = known.get(code.as_str()).copied().unwrap_or_default();
        table.push_str(&format!("| `{code}` | {} | {about} |\n", givers.join(", ")));
    }
    table
}

#[test]
fn every_warning_is_explained() {
    let unexplained: Vec<String> =
        table(&text_of(Path::new(PAGE))).lines().filter(|line| line.ends_with("|  |")).map(str::to_owned).collect();
    assert!(unexplained.is_empty(), "write what these warnings mean into {PAGE}:\n{}", unexplained.join("\n"));
}
