//! The page of a real report, and pages of reports that lack things.

use serde_json::{Value, json};

use super::{Illustration, report_page};
use crate::{
    engine::{Control, Inputs, Limits, NamedBytes, retarget},
    samples,
};

fn report() -> Value {
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    let inputs = Inputs {
        source: NamedBytes { name: "walk.glb", bytes: &walk },
        target: NamedBytes { name: "mannequin.glb", bytes: &mannequin },
        source_rest: None,
        target_rest: None,
        config: None,
        formats: &[],
    };
    let outcome = retarget(&inputs, &Limits::default(), &Control::new()).expect("a result");
    serde_json::to_value(&outcome.report).expect("JSON")
}

#[test]
fn a_page_has_the_verdicts_and_the_plots_and_needs_nothing_else() {
    let report = report();
    let page = report_page(&report, &Illustration::default());
    for metric in report["measures"]["metrics"].as_object().expect("metrics").keys() {
        assert!(page.contains(&metric.replace('_', " ")), "{metric} is in the table");
    }
    assert_eq!(page.matches("<svg").count(), 4, "direction, height, slide, contacts");
    for foreign in ["http://", "https://", "<script", "<link", "@import", "url("] {
        let own = page.replace("http://www.w3.org/2000/svg", "");
        assert!(!own.contains(foreign), "the page holds all that it shows: {foreign}");
    }
    assert_eq!(page.matches("<svg").count(), page.matches("</svg>").count(), "every plot is whole");
}

#[test]
fn text_of_files_cannot_become_markup() {
    let mut report = report();
    report["warnings"] = json!([{"code": "x", "place": "<b>", "detail": "<script>alert(1)</script>", "hint": "\"&'"}]);
    report["rigs"]["source"]["recognised_as"] = json!("<img src=x>");
    let page = report_page(&report, &Illustration::default());
    assert!(!page.contains("<script") && !page.contains("<img") && !page.contains("<b>"), "escaped");
    assert!(page.contains("&lt;script&gt;"), "and told");
}

#[test]
fn the_page_says_how_fast_to_move_who_walks_on_the_spot() {
    let mut report = report();
    assert!(!report_page(&report, &Illustration::default()).contains("on the spot"), "the sample gets on");
    report["measures"]["floor_speed_meters_per_second"] = json!({"source": 1.2, "target": 1.345_678});
    let page = report_page(&report, &Illustration::default());
    assert!(page.contains("moved at 1.35 m/s (source: 1.20 m/s)"), "the speeds");
}

#[test]
fn what_is_missing_is_left_out() {
    for report in [json!({}), json!({"measures": {"score": "odd"}}), json!([1]), Value::Null] {
        let page = report_page(&report, &Illustration::default());
        assert!(page.starts_with("<!doctype html>") && page.ends_with("</html>\n"), "{report}");
    }
}
