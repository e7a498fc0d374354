//! The page that shows what every edit does.

use retargetd::{report::edits_article, retarget::spec_schema, samples};

#[test]
fn every_edit_has_a_figure() {
    let page = edits_article(&samples::walk_scene()).expect("a page");
    assert_eq!(page, edits_article(&samples::walk_scene()).expect("a page"), "the same every time");
    let schema = spec_schema();
    let edits = schema["$defs"]["EditSpec"]["properties"].as_object().expect("the fields of 'edit'");
    assert!(edits.len() > 12, "the edits are there: {edits:?}");
    for name in edits.keys().map(String::as_str).chain(["layer", "keys"]) {
        let section = page.split(&format!("<h2 id=\"{name}\">")).nth(1);
        let section = section.unwrap_or_else(|| panic!("'{name}' has no figure: add one to report/edits/entries.rs"));
        let section = section.split("<h2").next().unwrap_or_default();
        assert!(section.contains(&format!("&quot;{name}&quot;")), "the config of '{name}' names it: {section:.200}");
        let lines: Vec<&str> =
            section.split("<polyline").skip(1).filter(|line| line.contains("stroke-width=\"2\"")).collect();
        assert!(lines.len() >= 2, "'{name}' has a curve before and one after, and {} lines", lines.len());
        let points =
            |line: &str| line.split("points=\"").nth(1).and_then(|rest| rest.split('"').next()).map(str::to_owned);
        assert_ne!(points(lines[0]), points(lines[1]), "'{name}' changes something that can be seen");
    }
}
