//! The documents that the binary carries: which there are, where the service has them, and the pages made of them.

use std::sync::OnceLock;

use serde::Serialize;

use super::markdown::{Rendered, render};

/// A document as it lies in the repository.
struct Document {
    /// Path from the root of the repository.
    path: &'static str,
    text: &'static str,
}

macro_rules! documents {
    ($($path:literal),* $(,)?) => {
        /// All documents, in the order of the navigation. A test compares them with the files of `docs/`.
        const DOCUMENTS: &[Document] = &[$(Document {
            path: $path,
            text: include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/", $path)),
        }),*];
    };
}

documents![
    "README.md",
    "docs/guide/studio.md",
    "docs/guide/command-line.md",
    "docs/guide/jobs.md",
    "docs/guide/python.md",
    "docs/guide/blender.md",
    "docs/guide/configs.md",
    "docs/guide/feet.md",
    "docs/guide/rigs.md",
    "docs/guide/rest-poses.md",
    "docs/guide/editing.md",
    "docs/guide/faces.md",
    "docs/guide/pictures.md",
    "docs/guide/drawings.md",
    "docs/guide/quality.md",
    "docs/guide/formats.md",
    "docs/guide/library.md",
    "docs/operate.md",
    "docs/reference/config.md",
    "docs/reference/settings.md",
    "docs/reference/formats.md",
    "docs/reference/metrics.md",
    "docs/reference/warnings.md",
    "docs/reference/findings.md",
    "docs/reference/errors.md",
    "docs/verdicts.md",
    "docs/limitations.md",
    "docs/architecture.md",
    "docs/algorithm/README.md",
    "docs/algorithm/recognition.md",
    "docs/algorithm/alignment.md",
    "docs/algorithm/spine.md",
    "docs/algorithm/forward-kinematics.md",
    "docs/algorithm/contacts.md",
    "docs/algorithm/soles.md",
    "docs/algorithm/legs.md",
    "docs/algorithm/cuts.md",
    "docs/algorithm/loops.md",
    "docs/algorithm/joints.md",
    "docs/algorithm/body.md",
    "docs/algorithm/clips.md",
    "docs/algorithm/faces.md",
    "docs/algorithm/annotation.md",
    "docs/CONTRIBUTING.md",
    "docs/CHANGELOG.md",
    "docs/SECURITY.md",
    "benches/README.md",
];

/// A file that documents link to or show.
pub(super) struct LinkedFile {
    /// Path from the root of the repository.
    path: &'static str,
    pub media_type: &'static str,
    pub bytes: &'static [u8],
}

macro_rules! linked_files {
    ($($path:literal as $media_type:literal),* $(,)?) => {
        const FILES: &[LinkedFile] = &[$(LinkedFile {
            path: $path,
            media_type: $media_type,
            bytes: include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/", $path)),
        }),*];
    };
}

linked_files![
    "LICENSE" as "text/plain; charset=utf-8",
    "openapi/examples/retarget.py" as "text/plain; charset=utf-8",
    "openapi/examples/retarget.mts" as "text/plain; charset=utf-8",
    "openapi/examples/receive.py" as "text/plain; charset=utf-8",
    "docs/pictures/walk_on_mannequin.png" as "image/png",
    "docs/pictures/drawing_walk.gif" as "image/gif",
    "docs/pictures/drawing_joints.png" as "image/png",
];

/// Groups of the navigation, by the beginning of the path.
const GROUPS: [(&str, &str); 4] =
    [("docs/guide/", "Guide"), ("docs/reference/", "Reference"), ("docs/algorithm/", "Algorithm"), ("", "Project")];

/// Everything behind `/docs`, made once.
pub(super) struct Site {
    /// Address and HTML of each page.
    pages: Vec<(String, String)>,
    /// What the search of the pages reads.
    pub search_index: String,
    /// The list of all pages, none of them marked.
    navigation: String,
}

/// A section in the index of the search.
#[derive(Serialize)]
struct Found<'a> {
    page: &'a str,
    heading: &'a str,
    address: String,
    text: &'a str,
}

impl Site {
    /// The site, which is made at the first call.
    pub(super) fn get() -> &'static Self {
        static SITE: OnceLock<Site> = OnceLock::new();
        SITE.get_or_init(Self::new)
    }

    fn new() -> Self {
        let rendered: Vec<(&Document, Rendered)> = DOCUMENTS
            .iter()
            .map(|document| (document, render(document.text, |link| translated(document.path, link))))
            .collect();
        let titles: Vec<(&str, &str)> =
            rendered.iter().map(|(document, page)| (document.path, page.title.as_str())).collect();
        let page = |(document, page): &(&Document, Rendered)| {
            (address(document.path), html(&page.title, &navigation(&titles, document.path), &page.html))
        };
        let found: Vec<Found<'_>> = rendered
            .iter()
            .flat_map(|(document, page)| {
                page.sections.iter().map(|section| Found {
                    page: &page.title,
                    heading: &section.heading,
                    address: format!("{}#{}", address(document.path), section.anchor),
                    text: section.text.trim(),
                })
            })
            .collect();
        let search_index = serde_json::to_string(&found).unwrap_or_default();
        Self { pages: rendered.iter().map(page).collect(), search_index, navigation: navigation(&titles, "") }
    }

    /// A page of the site for Markdown that is no document of the repository.
    pub(super) fn page_of(&self, markdown: &str) -> String {
        let rendered = render(markdown, |link| translated("", link));
        html(&rendered.title, &self.navigation, &rendered.html)
    }

    /// A page of the site around a body that is HTML already.
    pub(super) fn page_around(&self, title: &str, body: &str) -> String {
        html(title, &self.navigation, body)
    }

    /// The HTML of the page at an address.
    pub(super) fn page(&self, address: &str) -> Option<&str> {
        self.pages.iter().find(|(known, _)| known == address).map(|(_, html)| html.as_str())
    }
}

/// A linked file by its address.
pub(super) fn file(wanted: &str) -> Option<&'static LinkedFile> {
    FILES.iter().find(|file| address(file.path) == wanted)
}

/// The address under which the service has a file of the repository.
fn address(path: &str) -> String {
    match path {
        "README.md" => "/docs".to_owned(),
        "openapi/openapi.json" => "/openapi.json".to_owned(),
        "openapi/problems.md" => "/problems".to_owned(),
        path => format!("/docs/{}", path.trim_start_matches("docs/").trim_end_matches(".md")),
    }
}

/// The address that a link of a document leads to.
fn translated(page: &str, link: &str) -> String {
    if link.contains("://") || link.starts_with('#') {
        return link.to_owned();
    }
    let (file, anchor) = link.split_once('#').map_or((link, None), |(file, anchor)| (file, Some(anchor)));
    let mut parts: Vec<&str> = page.split('/').collect();
    parts.pop();
    for part in file.split('/') {
        match part {
            ".." => drop(parts.pop()),
            part => parts.push(part),
        }
    }
    let address = address(&parts.join("/"));
    anchor.map_or(address.clone(), |anchor| format!("{address}#{anchor}"))
}

/// The list of all pages, with the one that is shown marked.
fn navigation(titles: &[(&str, &str)], shown: &str) -> String {
    let group_of = |path: &str| GROUPS.iter().position(|(prefix, _)| path.starts_with(prefix));
    let entry = |(path, title): &(&str, &str)| {
        let mark = if *path == shown { " aria-current=\"page\"" } else { "" };
        format!("<li><a href=\"{}\"{mark}>{title}</a></li>", address(path))
    };
    let mut list = String::new();
    for (index, (_, group)) in GROUPS.iter().enumerate() {
        let entries: String = titles.iter().filter(|(path, _)| group_of(path) == Some(index)).map(entry).collect();
        list.push_str(&format!("<h2>{group}</h2><ul>{entries}</ul>"));
    }
    list.push_str("<h2>API</h2><ul><li><a href=\"/docs/api/\">Explorer</a></li>");
    list.push_str("<li><a href=\"/openapi.json\">OpenAPI</a></li><li><a href=\"/problems\">Problems</a></li>");
    list.push_str("<li><a href=\"/docs/edits\">What edits do</a></li></ul>");
    list
}

/// A whole page. Style and script are files of the service, as its content security policy asks.
fn html(title: &str, navigation: &str, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title} · retargetd</title>\n<link rel=\"stylesheet\" href=\"/docs/site/page.css\">\n\
         <link rel=\"icon\" href=\"/docs/site/icon.svg\">\n\
         <script src=\"/docs/site/search.js\" defer></script></head>\n<body><nav>\
         <a class=\"home\" href=\"/docs\">retargetd</a>\n\
         <input id=\"search\" type=\"search\" placeholder=\"Search\" aria-label=\"Search the documents\">\n\
         <ol id=\"found\" hidden></ol>\n<details id=\"pages\" open><summary>All pages</summary>{navigation}</details></nav>\n<main>{body}</main></body></html>\n"
    )
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_link_of_every_page_leads_to_a_page() {
        let site = Site::get();
        for (address, html) in &site.pages {
            let places = ["href=\"", "src=\""].into_iter().flat_map(|key| html.split(key).skip(1));
            for link in places.filter_map(|rest| rest.split('"').next()) {
                let (target, _) = link.split_once('#').unwrap_or((link, ""));
                let is_elsewhere = target.is_empty() || target.contains("://");
                let is_route = ["/openapi.json", "/problems", "/docs/edits", "/docs/api/"].contains(&target)
                    || target.starts_with("/docs/site/");
                let is_there = site.page(target).is_some() || file(target).is_some();
                assert!(is_elsewhere || is_route || is_there, "{address} links to {link}");
            }
        }
    }

    #[test]
    fn every_document_is_carried() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut files = BTreeSet::new();
        let mut folders = vec![root.join("docs")];
        while let Some(folder) = folders.pop() {
            for entry in folder.read_dir().expect("a folder") {
                let path = entry.expect("an entry").path();
                match path.extension() {
                    None => folders.push(path),
                    Some(ending) if ending == "md" => drop(files.insert(path)),
                    Some(_) => {}
                }
            }
        }
        for file in files {
            let path = file.strip_prefix(root).expect("below the root").to_string_lossy().into_owned();
            assert!(DOCUMENTS.iter().any(|document| document.path == path), "{path} is not in the list");
        }
    }

    #[test]
    fn links_are_relative_to_their_page() {
        assert_eq!(translated("docs/guide/jobs.md", "../operate.md#keys"), "/docs/operate#keys", "up one folder");
        assert_eq!(translated("README.md", "docs/guide/jobs.md"), "/docs/guide/jobs", "from the root");
        assert_eq!(translated("docs/guide/jobs.md", "../../openapi/problems.md"), "/problems", "a route of its own");
        assert_eq!(translated("docs/guide/jobs.md", "#batches"), "#batches", "on the same page");
    }
}
