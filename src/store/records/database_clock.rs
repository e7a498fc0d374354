//! The clock of the database, which all processes share, and what becomes of leases when somebody sets it.

use std::time::Duration;

use jiff::Timestamp;

use super::{Records, database::ours, milliseconds, time};
use crate::store::StoreError;

impl Records {
    /// What time it is by the clock that leases go by.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn database_time(&self) -> Result<Timestamp, StoreError> {
        let query = ours(format!("SELECT {} AS database_time", self.dialect.now()));
        time(&self.one(sqlx::query(query)).await?, "database_time")
    }

    /// Makes leases that far shorter that were given out before the clock was set back by `jump`, so that what workers had who are gone is
    /// not theirs until the clock has caught up. They are known by running for more than half of it, so `jump` must be much longer than a
    /// lease; whoever else does the same changes nothing any more. Gives how many there were.
    ///
    /// # Errors
    /// When the database fails. The change may have been made all the same.
    pub async fn set_leases_back(&self, jump: Duration) -> Result<u64, StoreError> {
        let query = ours(format!(
            "UPDATE jobs SET lease_expires_at = lease_expires_at - $1 \
             WHERE state IN ('running', 'canceling') AND lease_expires_at > {} + $2",
            self.dialect.now()
        ));
        let query = sqlx::query(query).bind(milliseconds(jump)).bind(milliseconds(jump / 2));
        Ok(self.execute(query).await?.rows_affected())
    }
}
