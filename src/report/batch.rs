//! A batch as a page of HTML: what became of each item, its verdict and its files, with a picture where there is one. It lies in the batch's
//! archive, beside the files and pictures that it names, and needs nothing else.

use std::fmt::Write;

use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};
use serde_json::Value;

use super::page::{Escaped, STYLE};

/// The verdicts, and the mark before each, so that they are not told by color alone.
const VERDICTS: [(&str, &str); 4] =
    [("fail", "✗ fail"), ("warn", "! warn"), ("pass", "✓ pass"), ("not_applicable", "– not applicable")];

const OWN_STYLE: &str = "ul.items { list-style: none; padding: 0; display: grid; gap: 1rem; \
    grid-template-columns: repeat(auto-fill, minmax(13rem, 1fr)); }\n\
    .items li { border: 1px solid var(--line); border-radius: 6px; padding: .6rem; overflow-wrap: anywhere; }\n\
    .items img { width: 100%; aspect-ratio: 1; border-radius: 4px; display: block; margin-bottom: .4rem; object-fit: contain; }\n\
    .items h2 { font-size: 1rem; margin: 0 0 .3rem; } .items p { margin: .3rem 0; font-size: .9rem; }\n";

/// The page of an archive's manifest, in which items may have `preview`, the name of a picture beside the page.
#[must_use]
pub fn batch_page(manifest: &Value) -> String {
    let items = manifest["items"].as_array().map(Vec::as_slice).unwrap_or_default();
    let mut page = String::with_capacity((8 << 10) + items.len() * 1024);
    page.push_str("<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
    page.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    page.push_str("<meta name=\"color-scheme\" content=\"light dark\">\n<title>Retarget batch</title>\n<style>\n");
    page.push_str(STYLE);
    page.push_str(OWN_STYLE);
    page.push_str("</style>\n</head>\n<body>\n<main>\n<h1>Retarget batch</h1>\n");
    head(&mut page, manifest, items);
    page.push_str("<ul class=\"items\">\n");
    for item in items {
        show(&mut page, item);
    }
    page.push_str(
        "</ul>\n<footer>What is here for programs is in <a href=\"manifest.json\">manifest.json</a>.</footer>\n",
    );
    page.push_str("</main>\n</body>\n</html>\n");
    page
}

/// What batch it is, and how many items have which verdict.
fn head(page: &mut String, manifest: &Value, items: &[Value]) {
    let state = text(manifest, "state");
    let _ = writeln!(page, "<p><small>{} · {state} · {} items</small></p>", text(manifest, "batch"), items.len());
    let counts =
        VERDICTS.map(|(name, shown)| (name, shown, items.iter().filter(|item| item["verdict"] == name).count()));
    let failed = items.iter().filter(|item| item["state"] == "failed").count();
    page.push_str("<p class=\"overall\">");
    for (name, shown, count) in counts.into_iter().filter(|(_, _, count)| *count > 0) {
        let _ = write!(page, "<span class=\"chip {name}\">{shown}: {count}</span> ");
    }
    if failed > 0 {
        let _ = write!(page, "<span class=\"chip fail\">without a result: {failed}</span>");
    }
    page.push_str("</p>\n");
}

/// One item.
fn show(page: &mut String, item: &Value) {
    page.push_str("<li>");
    let pair = match (text(item, "source"), text(item, "target")) {
        (source, target) if target.is_empty() || source == target => source,
        (source, target) => format!("{source} on {target}"),
    };
    let picture = item["preview"].as_str().or_else(|| {
        let names = item["files"].as_array()?.iter().filter_map(|file| file["name"].as_str());
        names.into_iter().find(|name| [".png", ".webp", ".gif", ".apng"].iter().any(|ending| name.ends_with(ending)))
    });
    if let Some(picture) = picture {
        let _ = writeln!(page, "<img loading=\"lazy\" src=\"{}\" alt=\"{pair}\">", address(picture));
    }
    let _ = writeln!(page, "<h2>{pair}</h2>");
    if let Some((name, shown)) = VERDICTS.into_iter().find(|(name, _)| item["verdict"] == *name) {
        let _ = writeln!(page, "<p><span class=\"chip {name}\">{shown}</span> {}</p>", text(item, "verdict_reason"));
    } else if item["state"] != "succeeded" {
        let _ = writeln!(page, "<p><span class=\"chip fail\">{}</span></p>", text(item, "state"));
    }
    let problem = &item["problem"];
    if problem.is_object() {
        let _ = writeln!(page, "<p><code>{}</code>: {}</p>", text(problem, "code"), text(problem, "detail"));
    }
    for name in item["files"].as_array().into_iter().flatten().filter_map(|file| file["name"].as_str()) {
        let _ = writeln!(page, "<p><a href=\"{}\">{}</a></p>", address(name), Escaped(name));
    }
    page.push_str("</li>\n");
}

/// A member of an object as text that is safe in the page; nothing where it is none.
fn text(value: &Value, member: &str) -> String {
    Escaped(value[member].as_str().unwrap_or_default()).to_string()
}

/// A path inside the archive as an address relative to the page: whatever a browser would read otherwise is written in percent.
fn address(path: &str) -> String {
    const UNSAFE: AsciiSet = NON_ALPHANUMERIC.remove(b'/').remove(b'-').remove(b'_').remove(b'.').remove(b'~');
    format!("./{}", utf8_percent_encode(path, &UNSAFE))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_page_names_files_verdicts_and_problems_and_runs_nothing() {
        let manifest = json!({"batch": "bat_1", "state": "failed", "items": [
            {"source": "<b>walk.bvh", "target": "hero.glb", "state": "succeeded", "verdict": "warn", "verdict_reason": "foot_slide",
             "preview": "previews/hero #1/walk.webp", "files": [{"name": "hero #1/walk.glb"}]},
            {"source": "walk.bvh", "target": "walk.bvh", "state": "failed", "files": [],
             "problem": {"code": "no_animation", "detail": "nothing moves"}},
            {"source": "run.bvh", "target": "", "state": "succeeded", "files": [{"name": "run.gif"}]}]});
        let page = batch_page(&manifest);
        for part in [
            "&lt;b&gt;walk.bvh on hero.glb",
            "<img loading=\"lazy\" src=\"./previews/hero%20%231/walk.webp\"",
            "<a href=\"./hero%20%231/walk.glb\">hero #1/walk.glb</a>",
            "<span class=\"chip warn\">! warn</span> foot_slide",
            "<code>no_animation</code>: nothing moves",
            "src=\"./run.gif\"",
            "! warn: 1",
            "without a result: 1",
        ] {
            assert!(page.contains(part), "{part} in {page}");
        }
        assert!(!page.contains("<script") && !page.contains("<b>"), "escaped: {page}");
    }
}
