//! What the report of a job says of its result as a whole, kept beside the report so that lists, counts and filters need not open it.

use serde::{Deserialize, Serialize};
use sqlx::{Row, any::AnyRow};

use crate::store::StoreError;

named! {
    /// The verdict of a report.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
    pub enum JobVerdict {
        /// As good as one could wish.
        Pass = "pass",
        /// Worth a look.
        Warn = "warn",
        /// Visibly wrong.
        Fail = "fail",
        /// Nothing could be measured.
        NotApplicable = "not_applicable",
    }
}

/// A verdict and what it is about.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Judgment {
    /// The worst verdict of all metrics.
    pub verdict: JobVerdict,
    /// For people: the metric, its value, and the frame and joint where it is worst.
    pub reason: String,
    /// The share of the target's body that is driven, from 0 to 1.
    pub coverage: Option<f64>,
}

/// The columns of a judgment.
pub(super) fn read(row: &AnyRow) -> Result<Option<Judgment>, StoreError> {
    let (verdict, reason): (Option<String>, Option<String>) = (row.try_get("verdict")?, row.try_get("verdict_reason")?);
    let coverage: Option<f64> = row.try_get("coverage")?;
    let verdict = verdict.as_deref().and_then(JobVerdict::from_name);
    Ok(verdict.map(|verdict| Judgment { verdict, reason: reason.unwrap_or_default(), coverage }))
}
