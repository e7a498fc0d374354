//! What the report says of a result as a whole: how it is told, and when the command ends with a code of its own for it.

use clap::ValueEnum;
use serde::Serialize;
use serde_json::Value;

use crate::engine::Outcome;

use super::exit::{Exit, WORSE, one_line, say};

/// When a result that is there counts as a failure.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(super) struct Judging {
    /// End with exit code 5 where the verdict of the report is this or worse; the results are written all the same
    #[arg(long, value_name = "VERDICT", value_enum)]
    fail_on: Option<FailOn>,
}

/// The verdict from which on a result counts as a failure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FailOn {
    /// Worth a look, or visibly wrong
    Warn,
    /// Visibly wrong
    Fail,
}

impl FailOn {
    const fn name(self) -> &'static str {
        match self {
            Self::Warn => "warn",
            Self::Fail => "fail",
        }
    }

    fn refuses(self, verdict: &str) -> bool {
        verdict == "fail" || (self == Self::Warn && verdict == "warn")
    }
}

/// A verdict, why, and how much of the target's body is driven.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Judged {
    pub(super) verdict: String,
    #[serde(rename = "verdict_reason")]
    pub(super) reason: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) coverage: Option<f64>,
}

impl Judged {
    /// Of what the engine gave; nothing where nothing was measured.
    pub(super) fn of(outcome: &Outcome) -> Option<Self> {
        let measures = outcome.report.measures.as_ref()?;
        Some(Self {
            verdict: measures.verdict.name().to_owned(),
            reason: measures.verdict_reason.clone(),
            coverage: measures.coverage,
        })
    }

    /// Of a job of a service; nothing where nothing was measured.
    pub(super) fn of_job(job: &Value) -> Option<Self> {
        let text = |member: &str| job[member].as_str().unwrap_or_default().to_owned();
        job["verdict"].as_str().map(|verdict| Self {
            verdict: verdict.to_owned(),
            reason: text("verdict_reason"),
            coverage: job["coverage"].as_f64(),
        })
    }

    /// Says it in one line.
    pub(super) fn tell(&self, of: &str) {
        let coverage = self.coverage.map_or_else(String::new, |share| format!("; coverage {}", percent(share)));
        say(format_args!("verdict{of}: {}: {}{coverage}", self.verdict, one_line(&self.reason)));
    }
}

/// A share for people. What is not all of it never reads as all.
pub(super) fn percent(share: f64) -> String {
    let whole = (share * 100.0).round();
    let shown = if share < 1.0 { whole.min(99.0) } else { whole };
    format!("{shown:.0} %")
}

impl Judging {
    /// Ends the command with exit code 5 where one of the results is worse than is asked for. Each has the name that it is told by.
    pub(super) fn check<'j>(
        self,
        results: impl IntoIterator<Item = (&'j str, Option<&'j Judged>)>,
    ) -> Result<(), Exit> {
        let Some(fail_on) = self.fail_on else { return Ok(()) };
        let (mut worse, mut all, mut unmeasured) = (Vec::new(), 0, 0);
        for (name, judged) in results {
            all += 1;
            match judged {
                Some(judged) if fail_on.refuses(&judged.verdict) => worse.push((name, judged)),
                Some(_) => {}
                None => unmeasured += 1,
            }
        }
        if unmeasured > 0 {
            say(format_args!(
                "warning: {unmeasured} of {all} results were not measured, so --fail-on says nothing of them"
            ));
        }
        let message = match worse.as_slice() {
            [] => return Ok(()),
            [(_, judged)] if all == 1 => {
                format!("the verdict is {}, and --fail-on {} was asked for", judged.verdict, fail_on.name())
            }
            [(name, judged)] => {
                format!("the verdict of {name} is {}, and --fail-on {} was asked for", judged.verdict, fail_on.name())
            }
            more => format!("{} of {all} results have the verdict {} or worse", more.len(), fail_on.name()),
        };
        let hint = "the results are written; --report FILE.html shows what is wrong with them";
        // What was made has been told before it is judged.
        Err(Exit { is_reported: true, ..Exit::new(WORSE, message, hint) })
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn judged(verdict: &str) -> Judged {
        Judged { verdict: verdict.to_owned(), reason: String::new(), coverage: None }
    }

    #[test]
    fn results_worse_than_asked_for_have_a_code_of_their_own() {
        let check = |fail_on: Option<FailOn>, verdict: &str| {
            let judged = judged(verdict);
            Judging { fail_on }.check([("walk", Some(&judged))]).map_err(|exit| exit.code)
        };
        assert_eq!(check(None, "fail"), Ok(()), "nobody asked");
        assert_eq!(check(Some(FailOn::Fail), "warn"), Ok(()), "better than that");
        assert_eq!(check(Some(FailOn::Fail), "fail"), Err(WORSE), "that");
        assert_eq!(check(Some(FailOn::Warn), "fail"), Err(WORSE), "worse than that");
        assert_eq!(check(Some(FailOn::Warn), "not_applicable"), Ok(()), "nothing to judge");
        let (good, bad) = (judged("pass"), judged("fail"));
        let some = Judging { fail_on: Some(FailOn::Warn) }.check([("a", Some(&good)), ("b", Some(&bad))]);
        assert!(some.expect_err("one is worse").message.contains("of b is fail"), "which of them");
    }

    #[test]
    fn a_job_and_a_share_are_read_as_they_are() {
        let job = json!({"verdict": "warn", "verdict_reason": "foot_slide", "coverage": 0.999});
        let read = Judged::of_job(&job).expect("it has one");
        assert_eq!(
            (read.verdict.as_str(), read.coverage.map(percent)),
            ("warn", Some("99 %".to_owned())),
            "not all of it"
        );
        assert_eq!(Judged::of_job(&json!({"state": "succeeded"})), None, "not measured");
        assert_eq!(percent(1.0), "100 %", "all of it");
    }
}
