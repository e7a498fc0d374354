//! The README keeps its word: every recipe runs, every table is what the code says, every link leads somewhere.

mod tables;
mod warnings;

use std::{
    collections::BTreeSet,
    path::Path,
    process::{Command, Stdio},
};

use crate::service_process::ServiceProcess;

/// Commands that build or install; they are what runs the tests, so the tests cannot run them.
const NOT_RUN_HERE: [&str; 11] = [
    "cargo run --release -- demo",
    "tests/run",
    "cargo install --locked --path .",
    "docker compose --file docker/compose.yaml up --build",
    "docker compose --file docker/compose.scaled.yaml up --build --scale worker=4",
    "cp --archive retargetd-data/blobs backup/",
    r#"sqlite3 retargetd-data/state.db ".backup backup/state.db""#,
    "cp --archive --update retargetd-data/blobs backup/",
    "aws s3 sync --only-show-errors s3://clips s3://clips-backup",
    r#"pg_dump --format=custom --file=backup/records "$RETARGETD_DATABASE""#,
    r#"pg_restore --exit-on-error --no-owner --dbname="$EMPTY_DATABASE" backup/records"#,
];

/// The address that the README's recipes use.
const ADDRESS: &str = "http://127.0.0.1:8080";

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn readme() -> String {
    std::fs::read_to_string(root().join("README.md")).expect("the README")
}

/// A fenced block.
struct Block {
    /// What stands behind the opening fence.
    kind: String,
    line: usize,
    text: String,
}

fn blocks(readme: &str) -> Vec<Block> {
    let (mut blocks, mut open): (Vec<Block>, Option<Block>) = (Vec::new(), None);
    for (index, line) in readme.lines().enumerate() {
        match (&mut open, line.strip_prefix("```")) {
            (None, Some(kind)) => open = Some(Block { kind: kind.to_owned(), line: index + 1, text: String::new() }),
            (Some(_), Some(_)) => blocks.extend(open.take()),
            (Some(block), None) => {
                block.text.push_str(line);
                block.text.push('\n');
            }
            (None, None) => {}
        }
    }
    assert!(open.is_none(), "every fence is closed");
    blocks
}

/// `retargetd serve` of the README, on a port of its own.
fn serve(folder: &Path) -> ServiceProcess {
    ServiceProcess::listening(
        Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .arg("serve")
            .current_dir(folder)
            .env("RETARGETD_LISTEN", "127.0.0.1:0")
            .env("RETARGETD_LOG", "warn"),
    )
}

#[test]
fn every_recipe_runs_as_it_stands() {
    let folder = tempfile::tempdir().expect("a folder");
    let binary = Path::new(env!("CARGO_BIN_EXE_retargetd")).parent().expect("it lies in a folder");
    #[expect(clippy::disallowed_methods, reason = "the recipes need the commands of the machine, and ours before them")]
    let path = std::env::var("PATH").expect("there is a PATH");
    let mut server: Option<ServiceProcess> = None;
    let recipes: Vec<Block> = blocks(&readme()).into_iter().filter(|block| block.kind == "sh").collect();
    assert!(recipes.len() >= 10, "the README has recipes, found {}", recipes.len());
    for recipe in recipes {
        if recipe.text.trim() == "retargetd serve" {
            server = Some(serve(folder.path()));
            continue;
        }
        let text = match &server {
            Some(server) => recipe.text.replace(ADDRESS, &server.url),
            None => recipe.text.clone(),
        };
        assert!(!text.contains("127.0.0.1:8080"), "line {}: the service has been started before", recipe.line);
        let output = Command::new("bash")
            .args(["-euo", "pipefail", "-c", &text])
            .current_dir(folder.path())
            .env("PATH", format!("{}:{path}", binary.display()))
            .stdin(Stdio::null())
            .output()
            .expect("bash runs");
        assert!(
            output.status.success(),
            "README.md line {}: {}\n{text}\n{}\n{}",
            recipe.line,
            output.status,
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        );
    }
    assert!(server.is_some(), "one of the recipes starts the service");
}

#[test]
fn what_is_not_run_is_known() {
    let readme = readme();
    let blocks = blocks(&readme);
    let seen: BTreeSet<&str> =
        blocks.iter().filter(|block| block.kind == "bash").flat_map(|block| block.text.lines()).collect();
    assert_eq!(seen, BTreeSet::from(NOT_RUN_HERE), "blocks marked bash are these commands and no others");
    let first = blocks.first().map(|block| block.text.trim());
    assert_eq!(first, Some("cargo run --release -- demo"), "the first command runs the main job");
    assert_eq!(blocks.get(1).map(|block| block.text.trim()), Some("tests/run"), "the second runs all tests");
    let kinds: BTreeSet<&str> = blocks.iter().map(|block| block.kind.as_str()).collect();
    assert!(kinds.is_subset(&BTreeSet::from(["bash", "sh", "text"])), "no block escapes the tests: {kinds:?}");
}

#[test]
fn every_link_leads_somewhere() {
    let readme = readme();
    let anchors: BTreeSet<String> = readme.lines().filter_map(|line| line.strip_prefix('#')).map(anchor).collect();
    let links: Vec<&str> =
        readme.split("](").skip(1).filter_map(|rest| rest.split_once(')').map(|(link, _)| link)).collect();
    assert!(links.len() > 5, "the README links to things");
    for link in links {
        match link.strip_prefix('#') {
            Some(name) => assert!(anchors.contains(name), "there is no heading #{name}; there are {anchors:?}"),
            None if link.starts_with("http") => {}
            None => assert!(root().join(link).exists(), "{link} is not there"),
        }
    }
}

/// What a heading is linked to by.
fn anchor(heading: &str) -> String {
    let text = heading.trim_start_matches('#').trim().to_lowercase();
    let keep = |letter: char| match letter {
        ' ' => Some('-'),
        _ if letter.is_alphanumeric() || letter == '-' || letter == '_' => Some(letter),
        _ => None,
    };
    text.chars().filter_map(keep).collect()
}
