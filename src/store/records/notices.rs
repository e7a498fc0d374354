//! Notices: what one process changes, the others hear of at once.
//!
//! Triggers of the layout tell it when a change is committed. Only a hint: who waits for a change also looks by himself from time to time,
//! since a notice can be missed while a connection is down. With SQLite there are no other processes, and nothing is sent.

use sqlx::postgres::PgListener;

use super::{Dialect, JobState, Records};
use crate::store::{JobId, StoreError};

/// The triggers have the same name.
const CHANNEL: &str = "retargetd_jobs";

/// What was heard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Notice {
    /// A job is in that state now.
    Job(JobId, JobState),
    /// The connection was down: anything may have changed.
    Missed,
}

/// Hears what other processes do.
#[derive(Debug)]
pub struct Listener(PgListener);

impl Listener {
    /// Waits for the next notice.
    ///
    /// # Errors
    /// When the connection is down and cannot be made again.
    pub async fn next(&mut self) -> Result<Notice, StoreError> {
        loop {
            let Some(notice) = self.0.try_recv().await? else { return Ok(Notice::Missed) };
            if let Some(notice) = parse(notice.payload()) {
                return Ok(notice);
            }
        }
    }
}

fn parse(payload: &str) -> Option<Notice> {
    let (id, state) = payload.split_once(' ')?;
    Some(Notice::Job(JobId::parse(id).ok()?, JobState::from_name(state)?))
}

impl Records {
    /// Begins to listen to other processes; `None` where there are none.
    ///
    /// # Errors
    /// When the database does not answer.
    pub async fn listen(&self) -> Result<Option<Listener>, StoreError> {
        if self.dialect == Dialect::Sqlite {
            return Ok(None);
        }
        let mut listener = PgListener::connect(self.url()).await?;
        listener.listen(CHANNEL).await?;
        Ok(Some(Listener(listener)))
    }
}
