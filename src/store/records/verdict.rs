//! What the report of a job says of its result as a whole, kept beside the report so that lists, counts and filters need not open it.

use serde::{Deserialize, Serialize};
use sqlx::{Row, any::AnyRow};

use crate::store::StoreError;

/// The verdict of a report.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum JobVerdict {
    /// As good as one could wish.
    Pass,
    /// Worth a look.
    Warn,
    /// Visibly wrong.
    Fail,
    /// Nothing could be measured.
    NotApplicable,
}

impl JobVerdict {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Pass, Self::Warn, Self::Fail, Self::NotApplicable];

    /// The name on the wire and in the database.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Warn => "warn",
            Self::Fail => "fail",
            Self::NotApplicable => "not_applicable",
        }
    }

    /// The one of a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|verdict| verdict.name() == name)
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
