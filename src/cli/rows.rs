//! What became of many clips: a table for people, an object for programs, and how the command ends.

use serde_json::{Value, json};

use super::{
    exit::{Exit, FAILED, INPUT_REFUSED, one_line, print, report, say},
    manner::speaks_json,
    table::table,
    verdict::{Judged, Judging, percent},
};

/// What became of one clip.
pub(super) struct Row {
    pub(super) name: String,
    pub(super) ended: Result<Ended, Exit>,
}

/// A clip whose results are there.
pub(super) struct Ended {
    pub(super) judged: Option<Judged>,
    pub(super) warnings: u64,
}

/// Tells which clips failed, then the table.
pub(super) fn tell(rows: &[Row]) -> Result<(), Exit> {
    for Row { name, ended } in rows {
        if let Err(exit) = ended {
            say(format_args!("failed: {name}: {}", one_line(&exit.message)));
        }
    }
    if speaks_json() {
        return report(|| json!({"clips": rows.iter().map(view).collect::<Vec<_>>(), "verdicts": counts(rows)}));
    }
    let lines: Vec<[String; 5]> = rows.iter().map(line).collect();
    print(&table(["clip", "verdict", "coverage", "warnings", "why"], &lines))
}

fn line(Row { name, ended }: &Row) -> [String; 5] {
    let none = || "-".to_owned();
    match ended {
        Ok(Ended { judged, warnings }) => {
            let verdict = judged.as_ref().map_or_else(none, |judged| judged.verdict.clone());
            let coverage = judged.as_ref().and_then(|judged| judged.coverage).map_or_else(none, percent);
            let why = judged.as_ref().filter(|judged| judged.verdict != "pass").map(|judged| one_line(&judged.reason));
            [name.clone(), verdict, coverage, warnings.to_string(), why.unwrap_or_default()]
        }
        Err(exit) => [name.clone(), "failed".to_owned(), none(), none(), one_line(&exit.message)],
    }
}

fn view(Row { name, ended }: &Row) -> Value {
    match ended {
        Ok(Ended { judged, warnings }) => {
            let mut view = json!({"name": name, "warnings_count": warnings});
            if let (Some(judged), Some(members)) = (judged, view.as_object_mut()) {
                members.insert("verdict".to_owned(), judged.verdict.clone().into());
                members.insert("verdict_reason".to_owned(), judged.reason.clone().into());
                members.extend(judged.coverage.map(|coverage| ("coverage".to_owned(), coverage.into())));
            }
            view
        }
        Err(exit) => json!({"name": name, "error": exit.view()}),
    }
}

fn counts(rows: &[Row]) -> Value {
    let of = |verdict: &str| {
        let judged = rows.iter().filter_map(|row| row.ended.as_ref().ok()?.judged.as_ref());
        judged.filter(|judged| judged.verdict == verdict).count()
    };
    json!({"pass": of("pass"), "warn": of("warn"), "fail": of("fail")})
}

/// How the command ends: by the clips that have no results, else by the verdicts of the others. `again` says how to ask once more.
pub(super) fn end(rows: &[Row], judging: Judging, again: &str) -> Result<(), Exit> {
    let failed: Vec<&Exit> = rows.iter().filter_map(|row| row.ended.as_ref().err()).collect();
    let verdicts = counts(rows);
    let verdicts = ["pass", "warn", "fail"].map(|name| format!("{} {name}", verdicts[name]));
    let written = rows.len() - failed.len();
    if written > 0 {
        say(format_args!("wrote the results of {written} of {} clips: {}", rows.len(), verdicts.join(", ")));
    }
    if failed.is_empty() {
        let results = rows.iter().filter_map(|row| Some((row.name.as_str(), row.ended.as_ref().ok()?.judged.as_ref())));
        return judging.check(results);
    }
    let is_refused = failed.iter().all(|exit| exit.code == INPUT_REFUSED);
    let message = match failed.len() {
        1 => "1 clip has no results".to_owned(),
        count => format!("{count} clips have no results"),
    };
    // What a file is refused for stays as it is, however often one asks.
    let hint =
        if is_refused { "mend these clips, and try them again; the results of the others are there" } else { again };
    Err(Exit { is_reported: true, ..Exit::new(if is_refused { INPUT_REFUSED } else { FAILED }, message, hint) })
}
