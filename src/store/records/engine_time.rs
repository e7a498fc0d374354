//! The time that workers spend on the jobs of each caller, by which callers take turns. The layout's triggers keep the sums; here is what
//! they are told.

use std::time::Duration;

use super::{Held, Lane, Records, database::ours, dialect::Dialect};
use crate::store::StoreError;

/// Callers whose jobs are thought to take no longer are brief. What a caller's jobs take is thought to be this until one has ended.
pub const BRIEF: Duration = Duration::from_secs(1);

/// No attempt counts for more: a clock that was set forward must not shut a caller out for days.
const LONGEST_MILLISECONDS: u64 = 3_600_000;

/// Which jobs a worker may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// The last lane of them.
    pub last: Lane,
    /// Only those of callers whose jobs are [`BRIEF`].
    pub is_brief: bool,
}

impl From<Lane> for Wanted {
    fn from(last: Lane) -> Self {
        Self { last, is_brief: false }
    }
}

impl Wanted {
    /// The most milliseconds that the jobs of a caller may be thought to take.
    pub(super) const fn max_cost(self) -> i64 {
        if self.is_brief { BRIEF.as_millis() as i64 } else { i64::MAX }
    }
}

/// What a job is charged that is not running any more, or has run for so long: SQL over a row of the table of jobs, in milliseconds.
pub(super) fn used(dialect: Dialect) -> String {
    let now = dialect.now();
    format!(
        "CASE WHEN taken_at IS NULL THEN charged WHEN {now} <= taken_at THEN 1 \
         WHEN {now} - taken_at > {LONGEST_MILLISECONDS} THEN {LONGEST_MILLISECONDS} ELSE {now} - taken_at END"
    )
}

impl Records {
    /// Charges jobs for the time that they have run, which is more than was thought.
    pub(super) async fn charge(&self, jobs: &[&Held]) -> Result<(), StoreError> {
        let query = format!(
            "UPDATE jobs SET charged = {} WHERE id = $1 AND lease = $2 AND state IN ('running', 'canceling')",
            used(self.dialect)
        );
        for job in jobs {
            // One by one: a transaction that charges two callers could wait for another that charges them in another order.
            let mut transaction = self.begin_keeping().await?;
            let query = sqlx::query(ours(query.clone())).bind(job.id.as_str()).bind(job.lease.as_str());
            query.execute(&mut *transaction).await?;
            self.commit(transaction).await?;
        }
        Ok(())
    }
}
