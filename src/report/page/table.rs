//! The table of verdicts, and the list of contacts that slide most.

use super::text::{Escaped, number, spaced, verdict};
use crate::retarget::{Measures, Metric, MetricName, Verdict};

/// Contacts of the list.
const MAX_CONTACTS: usize = 12;

/// What is worst comes first.
pub(super) fn metrics(page: &mut String, measures: &Measures) {
    let mut rows: Vec<(&MetricName, &Metric)> = measures.metrics.iter().collect();
    rows.sort_by_key(|(name, metric)| (std::cmp::Reverse(metric.verdict), **name));
    page.push_str(
        "<section>\n<h2>Metrics</h2>\n<div class=\"wide\"><table>\n<thead><tr><th>metric</th><th>verdict</th>",
    );
    page.push_str(
        "<th class=\"number\">value</th><th class=\"number\">source</th><th class=\"number\">warns above</th>",
    );
    page.push_str("<th class=\"number\">fails above</th><th>worst</th></tr></thead>\n<tbody>\n");
    for (name, metric) in rows {
        row(page, *name, metric);
    }
    page.push_str("</tbody>\n</table></div>\n");
    let frames = measures.frames_measured;
    page.push_str(&format!(
        "<p><small>Feet, knees, spine, pelvis and keys were looked at in every frame, the rest in {frames} frames. \
         Lengths of feet are at 1 m leg length.</small></p>\n</section>\n"
    ));
}

fn row(page: &mut String, name: MetricName, metric: &Metric) {
    let (class, unit) = (metric.verdict.name(), unit(&metric.unit));
    let value = metric.value.map_or_else(|| "–".to_owned(), |value| format!("{}{unit}", number(value)));
    let deepest = metric.absolute_value.map(|value| format!("<br><small>at most {}{unit}</small>", number(value)));
    let value = value + &deepest.unwrap_or_default();
    let source = metric.source_value.map_or_else(String::new, |value| format!("{}{unit}", number(value)));
    let worst = metric.worst.first().filter(|_| metric.verdict >= Verdict::Pass).map_or_else(String::new, |worst| {
        let place = if worst.part.is_empty() { worst.joint.clone() } else { spaced(&worst.part) };
        format!("frame {} ({} s), {}", worst.frame, number(worst.time_seconds), Escaped(&place))
    });
    let reason = metric.reason.as_deref().map(|reason| format!("<br><small>{}</small>", Escaped(reason)));
    page.push_str(&format!(
        "<tr><th scope=\"row\" title=\"{}\">{}</th><td><span class=\"chip {class}\">{}</span>{}</td>\
         <td class=\"number\">{value}</td><td class=\"number\">{source}</td><td class=\"number\">{}</td>\
         <td class=\"number\">{}</td><td>{worst}</td></tr>\n",
        Escaped(&metric.about),
        Escaped(&spaced(name.name())),
        verdict(metric.verdict),
        reason.unwrap_or_default(),
        number(metric.warn_above),
        number(metric.fail_above),
    ));
}

/// The unit behind a number; shares, ratios and counts have none.
fn unit(name: &str) -> String {
    match name {
        "degrees" => "°".to_owned(),
        "degrees/frame²" => " °/frame²".to_owned(),
        "percent" => " %".to_owned(),
        "cm" | "cm/s" => format!(" {name}"),
        _ => String::new(),
    }
}

/// The contacts that slide most.
pub(super) fn contacts(page: &mut String, measures: &Measures) {
    let mut contacts: Vec<_> = measures.contacts.iter().collect();
    if contacts.is_empty() {
        return;
    }
    contacts.sort_by(|first, second| second.slide_cm.total_cmp(&first.slide_cm));
    let count = contacts.len() + measures.contacts_left_out;
    page.push_str(&format!("<section>\n<h2>Contacts that slide most <small>({count} in all)</small></h2>\n"));
    page.push_str("<div class=\"wide\"><table>\n<thead><tr><th>foot</th><th class=\"number\">frames</th>");
    page.push_str("<th class=\"number\">slide</th><th class=\"number\">source's slide</th>");
    page.push_str("<th class=\"number\">height over the floor</th></tr></thead>\n<tbody>\n");
    for contact in contacts.into_iter().take(MAX_CONTACTS) {
        page.push_str(&format!(
            "<tr><th scope=\"row\">{} {}</th><td class=\"number\">{} to {}</td><td class=\"number\">{} cm</td>\
             <td class=\"number\">{} cm</td><td class=\"number\">{} cm</td></tr>\n",
            Escaped(&spaced(&contact.part)),
            Escaped(&contact.point),
            contact.first_frame,
            contact.last_frame,
            number(contact.slide_cm),
            number(contact.source_slide_cm),
            number(contact.height_cm),
        ));
    }
    page.push_str("</tbody>\n</table></div>\n</section>\n");
}
