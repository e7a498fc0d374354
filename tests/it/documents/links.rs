//! Links of the documents: each leads to a file and a heading that are there, and every page is reached from the README.

use std::{
    collections::BTreeSet,
    path::{Component, Path, PathBuf},
};

use super::{pages, root, text_of};

/// Where the links of a page lead, as paths from the root of the project, with the anchor if there is one.
fn links(page: &Path) -> Vec<(PathBuf, Option<String>)> {
    let text = text_of(page);
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split_once(')').map(|(link, _)| link.to_owned()));
    let here = page.parent().unwrap_or(Path::new(""));
    let resolve = |link: String| {
        let (file, anchor) = match link.split_once('#') {
            Some((file, anchor)) => (file.to_owned(), Some(anchor.to_owned())),
            None => (link, None),
        };
        (if file.is_empty() { page.to_owned() } else { normalized(&here.join(file)) }, anchor)
    };
    targets.filter(|link| !link.starts_with("http")).map(resolve).collect()
}

/// The path without `..`.
fn normalized(path: &Path) -> PathBuf {
    let mut parts = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => assert!(parts.pop(), "{} stays in the project", path.display()),
            part => parts.push(part),
        }
    }
    parts
}

/// The anchors of the headings of a page.
fn anchors(page: &Path) -> BTreeSet<String> {
    let is_page = page.extension().is_some_and(|ending| ending == "md");
    let text = if is_page { text_of(page) } else { String::new() };
    text.lines().filter_map(|line| line.strip_prefix('#')).map(anchor).collect()
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

#[test]
fn every_link_leads_somewhere() {
    for page in pages() {
        for (target, anchor) in links(&page) {
            assert!(root().join(&target).exists(), "{}: {} is not there", page.display(), target.display());
            if let Some(anchor) = anchor {
                let anchors = anchors(&target);
                let page = page.display();
                assert!(anchors.contains(&anchor), "{page}: {} has no #{anchor}; it has {anchors:?}", target.display());
            }
        }
    }
}

#[test]
fn every_page_is_within_three_links_of_the_readme() {
    let mut reached = BTreeSet::from([PathBuf::from("README.md")]);
    for _ in 0..3 {
        let is_page = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "md");
        let next: Vec<PathBuf> = reached
            .iter()
            .filter(|path| is_page(path))
            .flat_map(|page| links(page).into_iter().map(|(target, _)| target))
            .collect();
        reached.extend(next);
    }
    let lost: Vec<PathBuf> = pages().into_iter().filter(|page| !reached.contains(page)).collect();
    assert!(lost.is_empty(), "no reader finds {lost:?} from the README within three links");
}
