//! Every `sh` block of a page runs as it stands, in order, in a folder with the two samples.

use std::{
    collections::BTreeSet,
    path::Path,
    process::{Command, Stdio},
};

use super::{Block, blocks, pages, text_of};
use crate::service_process::ServiceProcess;

/// Commands of `bash` blocks: they build, install or need Docker, so no test runs them.
const NOT_RUN_HERE: [&str; 14] = [
    "cargo run --release -- demo",
    "tests/run",
    "cargo install --locked --path .",
    "pip install ./python",
    "python/blender/build retargetd_blender.zip",
    "pip wheel --no-deps --wheel-dir dist ./python",
    "docker compose --file docker/compose.yaml up --build",
    "docker compose --file docker/compose.scaled.yaml up --build --scale worker=4",
    "cp --archive retargetd-data/blobs backup/",
    r#"sqlite3 retargetd-data/state.db ".backup backup/state.db""#,
    "cp --archive --update retargetd-data/blobs backup/",
    "aws s3 sync --only-show-errors s3://clips s3://clips-backup",
    r#"pg_dump --format=custom --file=backup/records "$RETARGETD_DATABASE""#,
    r#"pg_restore --exit-on-error --no-owner --dbname="$EMPTY_DATABASE" backup/records"#,
];

/// The address that the recipes use.
const ADDRESS: &str = "http://127.0.0.1:8080";

/// The command that starts the service.
const SERVE: &str = "retargetd serve";

fn binary_folder() -> &'static Path {
    Path::new(env!("CARGO_BIN_EXE_retargetd")).parent().expect("it lies in a folder")
}

/// `retargetd serve` of a recipe, on a port of its own.
fn serve(folder: &Path) -> ServiceProcess {
    ServiceProcess::listening(
        Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .arg("serve")
            .current_dir(folder)
            .env("RETARGETD_LISTEN", "127.0.0.1:0")
            .env("RETARGETD_LOG", "warn"),
    )
}

fn run(page: &Path, line: usize, text: &str, folder: &Path) {
    #[expect(clippy::disallowed_methods, reason = "the recipes need the commands of the machine, and ours before them")]
    let path = std::env::var("PATH").expect("there is a PATH");
    let output = Command::new("bash")
        .args(["-euo", "pipefail", "-c", text])
        .current_dir(folder)
        .env("PATH", format!("{}:{path}", binary_folder().display()))
        .stdin(Stdio::null())
        .output()
        .expect("bash runs");
    assert!(
        output.status.success(),
        "{} line {line}: {}\n{text}\n{}\n{}",
        page.display(),
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
}

/// Runs the recipes of one page, and returns how many there were.
fn run_page(page: &Path) -> usize {
    let recipes: Vec<Block> = blocks(&text_of(page)).into_iter().filter(|block| block.kind == "sh").collect();
    if recipes.is_empty() {
        return 0;
    }
    let folder = tempfile::tempdir().expect("a folder");
    run(page, 0, "retargetd samples", folder.path());
    let starts_it = recipes.iter().any(|recipe| recipe.text.trim() == SERVE);
    let uses_it = recipes.iter().any(|recipe| recipe.text.contains(ADDRESS));
    let mut server = (uses_it && !starts_it).then(|| serve(folder.path()));
    for recipe in &recipes {
        if recipe.text.trim() == SERVE {
            server = Some(serve(folder.path()));
            continue;
        }
        let text = match &server {
            Some(server) => recipe.text.replace(ADDRESS, &server.url),
            None => recipe.text.clone(),
        };
        assert!(!text.contains(ADDRESS), "{} line {}: the service is not running yet", page.display(), recipe.line);
        run(page, recipe.line, &text, folder.path());
    }
    recipes.len()
}

#[test]
fn every_recipe_runs_as_it_stands() {
    let count: usize = pages().iter().map(|page| run_page(page)).sum();
    assert!(count >= 40, "the documents have recipes, found {count}");
}

#[test]
fn what_is_not_run_is_known() {
    let mut seen = BTreeSet::new();
    for page in pages() {
        let blocks = blocks(&text_of(&page));
        seen.extend(
            blocks
                .iter()
                .filter(|block| block.kind == "bash")
                .flat_map(|block| block.text.lines().map(str::to_owned).collect::<Vec<_>>()),
        );
        for block in &blocks {
            // Those of Python are run by python/tests/test_documents.py.
            let is_known = ["bash", "sh", "text", "rust", "python"].contains(&block.kind.as_str());
            assert!(is_known, "{} line {}: no block escapes the tests: {:?}", page.display(), block.line, block.kind);
        }
    }
    let expected: BTreeSet<String> = NOT_RUN_HERE.map(str::to_owned).into();
    assert_eq!(seen, expected, "blocks marked bash are these commands and no others");
}

#[test]
fn the_first_two_commands_are_the_two_promised() {
    let blocks = blocks(&text_of(Path::new("README.md")));
    let command = |index: usize| blocks.get(index).map(|block| block.text.trim());
    assert_eq!(command(0), Some("cargo run --release -- demo"), "the first command runs the main job");
    assert_eq!(command(1), Some("tests/run"), "the second runs all tests");
}
