//! The documents keep their word: every recipe runs, every table is what the code says, every link leads somewhere.

mod links;
mod recipes;
mod tables;
mod warnings;

use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The files below a folder with that ending.
fn files_below(folder: PathBuf, ending: &str) -> Vec<PathBuf> {
    let (mut files, mut folders) = (Vec::new(), vec![folder]);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder of the project") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|other| other == ending) {
                files.push(path);
            }
        }
    }
    files
}

/// README.md and every page below `docs/`, as paths from the root of the project, in the order of their names.
fn pages() -> Vec<PathBuf> {
    let below = |path: PathBuf| path.strip_prefix(root()).expect("a path below the root").to_owned();
    let mut pages: Vec<PathBuf> = files_below(root().join("docs"), "md").into_iter().map(below).collect();
    pages.push(PathBuf::from("README.md"));
    pages.sort();
    pages
}

fn text_of(page: &Path) -> String {
    std::fs::read_to_string(root().join(page)).unwrap_or_else(|error| panic!("{}: {error}", page.display()))
}

/// A fenced block of a page.
struct Block {
    /// The word behind the opening fence.
    kind: String,
    line: usize,
    text: String,
}

fn blocks(page: &str) -> Vec<Block> {
    let (mut blocks, mut open): (Vec<Block>, Option<Block>) = (Vec::new(), None);
    for (index, line) in page.lines().enumerate() {
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

#[test]
fn the_readme_is_short() {
    let length = text_of(Path::new("README.md")).len();
    assert!(length <= 12_000, "the README has {length} bytes; details belong to a page below docs/");
}
