//! The matrix as a table and as a summary.

use std::{collections::BTreeMap, fmt::Write as _, fs, path::Path};

use super::pair::{LIMBS, Row};

/// Share of the rows that are within all limits.
pub(super) fn share_within(rows: &[Row]) -> f64 {
    rows.iter().filter(|row| row.is_within()).count() as f64 / rows.len().max(1) as f64
}

/// Writes `pairs.csv` and `summary.md`.
pub(super) fn write(rows: &[Row]) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/matrix");
    fs::create_dir_all(&folder).expect("a folder for the results");
    fs::write(folder.join("pairs.csv"), csv(rows)).expect("the table can be written");
    fs::write(folder.join("summary.md"), summary(rows)).expect("the summary can be written");
}

fn csv(rows: &[Row]) -> String {
    let mut text = "source,target,within".to_owned();
    for (limb, _) in LIMBS {
        write!(text, ",{limb}_p95_degrees").expect("text");
    }
    text.push_str(
        ",hands_p95_degrees,feet_p95_degrees,length_drift,longest_drift,ground_offset,beyond,warnings,error\n",
    );
    for row in rows {
        write!(text, "{},{},{}", row.source, row.target, row.is_within()).expect("text");
        let optional = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.4}"));
        match &row.result {
            Ok(measured) => {
                let mut values: Vec<String> = measured.directions.map(optional).to_vec();
                values.extend([measured.hands, measured.feet].map(optional));
                values.extend([format!("{:.6}", measured.length_drift), measured.longest_drift.clone()]);
                values.push(optional(measured.ground));
                values.push(measured.excesses().join(" "));
                write!(text, ",{}", values.join(",")).expect("text");
            }
            Err(_) => text.push_str(&",".repeat(LIMBS.len() + 6)),
        }
        let error = row.result.as_ref().err().map_or_else(String::new, |error| error.replace(',', ";"));
        writeln!(text, ",{},\"{error}\"", row.warnings.join(" ")).expect("text");
    }
    text
}

/// Shares within the limits: in all, by limit, and the sources and targets with most pairs beyond them.
pub(super) fn summary(rows: &[Row]) -> String {
    let mut text = String::new();
    let failed = rows.iter().filter(|row| row.result.is_err()).count();
    let (within, all) = (rows.iter().filter(|row| row.is_within()).count(), rows.len());
    let share = share_within(rows) * 100.0;
    writeln!(text, "{within} of {all} pairs ({share:.2} %) are within all limits; {failed} were refused.\n")
        .expect("text");
    let mut by_limit: BTreeMap<String, usize> = BTreeMap::new();
    let (mut by_source, mut by_target): (BTreeMap<&str, Tally>, BTreeMap<&str, Tally>) = Default::default();
    for row in rows.iter().filter(|row| !row.is_within()) {
        let beyond = match &row.result {
            Ok(measured) => measured.excesses(),
            Err(_) => vec!["refused".to_owned()],
        };
        for what in beyond {
            *by_limit.entry(what.clone()).or_default() += 1;
            by_source.entry(&row.source).or_default().add(&what);
            by_target.entry(&row.target).or_default().add(&what);
        }
        by_source.entry(&row.source).or_default().rows += 1;
        by_target.entry(&row.target).or_default().rows += 1;
    }
    text.push_str("| beyond the limit of | pairs |\n| --- | --- |\n");
    for (what, count) in by_limit {
        writeln!(text, "| {what} | {count} |").expect("text");
    }
    for (title, tallies) in [("source", by_source), ("target", by_target)] {
        write!(text, "\n| {title} | pairs beyond a limit | of |\n| --- | --- | --- |\n").expect("text");
        let mut tallies: Vec<_> = tallies.into_iter().collect();
        tallies.sort_by_key(|(name, tally)| (usize::MAX - tally.rows, *name));
        for (name, tally) in tallies {
            writeln!(text, "| {name} | {} | {:?} |", tally.rows, tally.by_limit).expect("text");
        }
    }
    text
}

#[derive(Default)]
struct Tally {
    rows: usize,
    by_limit: BTreeMap<String, usize>,
}

impl Tally {
    fn add(&mut self, what: &str) {
        *self.by_limit.entry(what.to_owned()).or_default() += 1;
    }
}
