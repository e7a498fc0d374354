//! The alert rules are rules, about metrics that there are.

use std::process::Command;

use crate::support::skip;

const RULES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docker/alerts.yaml");

#[test]
fn alert_rules_are_about_metrics_that_there_are() {
    let rules = std::fs::read_to_string(RULES).expect("the rules");
    let metrics =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/src/telemetry/metrics.rs")).expect("the metrics");
    let is_of_name = |letter: char| letter.is_ascii_lowercase() || letter == '_';
    let names: Vec<&str> =
        rules.split(|letter| !is_of_name(letter)).filter(|word| word.starts_with("retargetd_")).collect();
    assert!(names.len() > 8, "rules name metrics: {names:?}");
    for name in names {
        assert!(metrics.contains(&format!("\"{name}\"")), "{name} is no metric");
    }
}

#[test]
fn prometheus_takes_the_alert_rules() {
    let Ok(done) = Command::new("promtool").args(["check", "rules", RULES]).output() else {
        return skip("promtool is not installed; the package prometheus has it");
    };
    let said = String::from_utf8_lossy(&done.stdout).into_owned() + &String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success() && said.contains("SUCCESS"), "{said}");
}
