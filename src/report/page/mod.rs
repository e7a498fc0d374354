//! A report as one HTML page: verdicts, plots, contacts, warnings. It holds everything that it shows, so it can be mailed, filed
//! beside a take and opened without a network; it follows the reader's light or dark setting and runs no script.
//!
//! Made from the report's JSON, so that a report which was stored years ago can still be shown.

mod plots;
mod table;
mod text;

#[cfg(test)]
mod tests;

use base64::{Engine as _, prelude::BASE64_STANDARD};
use serde_json::Value;

pub(super) use self::plots::{Line, line_plot};
pub(crate) use self::text::Escaped;

use self::text::number;
use crate::retarget::Measures;

pub(super) const STYLE: &str = include_str!("style.css");

/// What a page shows beside what the report says.
#[derive(Clone, Debug, Default)]
pub struct Illustration {
    /// What the report is about: names of files, of the job; each with what it is.
    pub about: Vec<(&'static str, String)>,
    /// A PNG of the result; none where it could not be drawn.
    pub picture: Option<Vec<u8>>,
}

/// The page of a report. What the report does not have, the page does not show.
#[must_use]
pub fn report_page(report: &Value, illustration: &Illustration) -> String {
    let measures: Option<Measures> =
        report.get("measures").and_then(|measures| serde_json::from_value(measures.clone()).ok());
    let mut page = String::with_capacity(64 << 10);
    page.push_str("<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
    page.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    page.push_str("<meta name=\"color-scheme\" content=\"light dark\">\n<title>Retarget report</title>\n<style>\n");
    page.push_str(STYLE);
    page.push_str("</style>\n</head>\n<body>\n<main>\n");
    head(&mut page, report, measures.as_ref(), &illustration.about);
    if let Some(picture) = &illustration.picture {
        let data = BASE64_STANDARD.encode(picture);
        page.push_str(&format!(
            "<figure><img src=\"data:image/png;base64,{data}\" alt=\"The result, in frames evenly spread over the clip\"></figure>\n"
        ));
    }
    if let Some(measures) = &measures {
        table::metrics(&mut page, measures);
        plots::all(&mut page, measures);
        table::contacts(&mut page, measures);
    } else {
        page.push_str("<p>Nothing was measured: the config asks for <code>\"report\": \"none\"</code>.</p>\n");
    }
    warnings(&mut page, report);
    timings(&mut page, report);
    page.push_str("</main>\n</body>\n</html>\n");
    page
}

fn head(page: &mut String, report: &Value, measures: Option<&Measures>, about: &[(&'static str, String)]) {
    page.push_str("<header>\n<h1>Retarget report</h1>\n");
    let about: Vec<String> = about.iter().map(|(what, name)| format!("{what} <b>{}</b>", Escaped(name))).collect();
    if !about.is_empty() {
        page.push_str(&format!("<p>{}</p>\n", about.join(", ")));
    }
    if let Some(measures) = measures {
        let name = measures.verdict.name();
        page.push_str(&format!(
            "<p class=\"overall\"><span class=\"chip {name}\">{}</span> score {} <small>(0 is best)</small></p>\n",
            text::verdict(measures.verdict),
            number(measures.score)
        ));
        page.push_str(&format!("<p>{}</p>\n", Escaped(&measures.verdict_reason)));
        if let Some(speed) = measures.floor_speed() {
            page.push_str(&format!("<p>floor: {}</p>\n", Escaped(&speed)));
        }
    }
    let rig = |side: &str| {
        let facts = &report["rigs"][side];
        let kind = facts["recognised_as"].as_str().unwrap_or("no known rig");
        let format = facts["format"].as_str().unwrap_or_default();
        format!("{} <small>({})</small>", Escaped(kind), Escaped(format))
    };
    let frames = report["counts"]["frames"].as_u64().unwrap_or_default();
    let joints = |name: &str| report["counts"][name].as_u64().unwrap_or_default();
    page.push_str(&format!(
        "<p>{} → {}, {frames} frames, {} of {} target joints driven</p>\n</header>\n",
        rig("source"),
        rig("target"),
        joints("driven_joints"),
        joints("target_joints"),
    ));
}

fn warnings(page: &mut String, report: &Value) {
    let Some(warnings) = report["warnings"].as_array().filter(|warnings| !warnings.is_empty()) else { return };
    page.push_str("<section>\n<h2>Warnings</h2>\n<ul class=\"warnings\">\n");
    for warning in warnings {
        let field = |name: &str| warning[name].as_str().unwrap_or_default();
        let (place, hint) = (field("place"), field("hint"));
        let place = if place.is_empty() { String::new() } else { format!("{}: ", Escaped(place)) };
        let hint = if hint.is_empty() { String::new() } else { format!("<br><small>{}</small>", Escaped(hint)) };
        let (code, detail) = (Escaped(field("code")), Escaped(field("detail")));
        page.push_str(&format!("<li><code>{code}</code> {place}{detail}{hint}</li>\n"));
    }
    page.push_str("</ul>\n</section>\n");
}

fn timings(page: &mut String, report: &Value) {
    let Some(timings) = report["timings"].as_object() else { return };
    let phases = timings.iter().filter_map(|(name, seconds)| {
        let phase = name.strip_suffix("_seconds")?;
        Some(format!("{} {} ms", Escaped(phase), number(seconds.as_f64()? * 1e3)))
    });
    let phases: Vec<String> = phases.collect();
    page.push_str(&format!("<footer><p>Time: {}</p></footer>\n", phases.join(", ")));
}
