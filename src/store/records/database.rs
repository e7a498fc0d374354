//! Opening the database, bringing its layout up to date, and every way through which queries reach it.

use std::{path::Path, sync::Arc, time::Duration};

use sqlx::{
    Any, AnyConnection, AnyPool, ConnectOptions as _, Connection as _, Executor as _, SqlSafeStr, Transaction,
    any::{AnyConnectOptions, AnyPoolOptions, AnyQueryResult, AnyRow},
    query::Query,
};

use super::{Dialect, Faults, faults::Moment};
use crate::{
    config::Secret,
    store::{LeaseId, StoreError},
};

/// What sqlx calls the arguments of a query here.
type Arguments = sqlx::any::AnyArguments;

/// What every connection to SQLite is told first. Sorts and statement journals that do not fit its cache stay in memory: where nothing but the
/// data folder can be written to, a temporary file has no place, and the statement that needs one would fail.
const SQLITE_PRAGMAS: &str = "PRAGMA busy_timeout = 10000; PRAGMA auto_vacuum = INCREMENTAL; PRAGMA journal_mode = WAL; PRAGMA foreign_keys = ON; \
                              PRAGMA temp_store = MEMORY";

/// A connection that was used so lately is not tried before it is used again, which costs as much as a query. A database that restarts
/// takes longer.
const MAY_BE_GONE: Duration = Duration::from_millis(500);

/// How long to wait for a connection that others hold while the blob store works for them.
const LONGEST_HOLD: Duration = Duration::from_secs(60);
/// How long leases and probes wait for a connection: shorter than any lease that is not for tests.
const SOON: Duration = Duration::from_secs(2);

/// The records of one database. Cheap to clone; all clones share the connections.
#[derive(Clone, Debug)]
pub struct Records {
    /// For queries that only read.
    readers: AnyPool,
    /// For all that writes. On Postgres the same; on SQLite one connection, since one can write at a time anyway: who comes next waits
    /// in a queue and not by looking again, and what the connection has read stays true.
    writers: AnyPool,
    /// For transactions that only hold locks while others are at work: were they to come from `writers`, they could take the last
    /// connection from those whom they wait for.
    gate_pool: AnyPool,
    /// For leases and probes: what tells others that this process lives must not wait behind callers.
    keepers: AnyPool,
    /// For lists, which callers can make slow. On Postgres they are ended when they take too long; on SQLite the same as `readers`.
    listers: AnyPool,
    pub(super) dialect: Dialect,
    /// May have a password in it.
    url: Secret,
    /// What the database knows this process by.
    pub(super) process: Arc<str>,
    faults: Option<Arc<dyn Faults>>,
}

/// How many connections of a pool there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PoolUse {
    /// What they are for.
    pub pool: &'static str,
    /// Those that somebody holds.
    pub in_use: usize,
    /// Those that wait for somebody.
    pub idle: usize,
}

impl Records {
    /// Opens a database file, makes it where it is not there, and brings it up to date.
    ///
    /// # Errors
    /// When the file cannot be opened, or comes from a newer version.
    pub async fn open(file: &Path) -> Result<Self, StoreError> {
        Self::connect(&format!("sqlite://{}?mode=rwc", escape(&file.display().to_string())), 8).await
    }

    /// Connects to the database of a URL (`sqlite:`, `postgres:`), with up to `most_connections`, and brings it up to date.
    /// Any number of processes may do so at the same time.
    ///
    /// # Errors
    /// When it is no such URL, the database does not answer, or it comes from a newer version.
    pub async fn connect(url: &str, most_connections: u32) -> Result<Self, StoreError> {
        sqlx::any::install_default_drivers();
        let dialect = Dialect::of(url).ok_or_else(|| StoreError::UnknownScheme {
            what: "database",
            known: "postgres://USER:PASSWORD@HOST/DATABASE, or nothing for a file in the data folder",
        })?;
        let options: AnyConnectOptions = url.parse()?;
        let pool_of = |most: u32| {
            let pool = AnyPoolOptions::new().max_connections(most).acquire_timeout(Duration::from_secs(10));
            match dialect {
                Dialect::Postgres => pool.test_before_acquire(false).before_acquire(|connection, known| {
                    Box::pin(async move {
                        if known.idle_for >= MAY_BE_GONE {
                            connection.ping().await?;
                        }
                        Ok(true)
                    })
                }),
                // A file does not hang up, so connections are not tried before they are used, which costs as much as a query. Where the
                // disk fails, SQLite itself takes a transaction back; the driver's own attempt to do so then fails, and it believes for
                // ever that the connection is in the middle of that transaction.
                Dialect::Sqlite => pool
                    .test_before_acquire(false)
                    .after_connect(|connection, _| {
                        Box::pin(async move { connection.execute(SQLITE_PRAGMAS).await.map(|_| ()) })
                    })
                    .before_acquire(|connection, _| Box::pin(async move { Ok(leave_transaction(connection).await) })),
            }
        };
        // While the program is tested, statements can be listened to.
        let options = match ("trace".parse(), "off".parse()) {
            (Ok(level), Ok(off)) if cfg!(debug_assertions) => {
                options.log_statements(level).log_slow_statements(off, Duration::MAX)
            }
            _ => options.disable_statement_logging(),
        };
        let readers = pool_of(most_connections).connect_with(options.clone()).await?;
        dialect.migrator().run(&readers).await?;
        // Who holds one waits for the blob store; those who come next wait with it rather than fail.
        let gate_pool =
            pool_of(most_connections.max(4)).acquire_timeout(LONGEST_HOLD).connect_lazy_with(options.clone());
        let keepers = pool_of(2).acquire_timeout(SOON).connect_lazy_with(options.clone());
        let listers = match dialect {
            Dialect::Postgres => pool_of((most_connections / 2).max(1))
                .after_connect(|connection, _| {
                    Box::pin(async move { connection.execute("SET statement_timeout TO '5s'").await.map(|_| ()) })
                })
                .connect_lazy_with(options.clone()),
            Dialect::Sqlite => readers.clone(),
        };
        let writers = match dialect {
            Dialect::Postgres => readers.clone(),
            Dialect::Sqlite => pool_of(1).connect_lazy_with(options),
        };
        let process = LeaseId::new().as_str().into();
        Ok(Self {
            readers,
            writers,
            gate_pool,
            keepers,
            listers,
            dialect,
            url: Secret(url.to_owned()),
            process,
            faults: None,
        })
    }

    /// The same records, with faults on the way: for tests of what relies on them.
    #[must_use]
    pub fn with_faults(self, faults: Arc<dyn Faults>) -> Self {
        Self { faults: Some(faults), ..self }
    }

    /// The connections that are open, by what they are for. Pools that are one on a database are listed once.
    #[must_use]
    pub fn connections(&self) -> Vec<PoolUse> {
        let of_database = match self.dialect {
            Dialect::Sqlite => [("reads", &self.readers), ("writes", &self.writers)],
            Dialect::Postgres => [("queries", &self.readers), ("lists", &self.listers)],
        };
        let pools = of_database.into_iter().chain([("locks", &self.gate_pool), ("leases", &self.keepers)]);
        let used = |(pool, connections): (&'static str, &AnyPool)| {
            let (open, idle) = (connections.size() as usize, connections.num_idle());
            PoolUse { pool, in_use: open.saturating_sub(idle), idle }
        };
        pools.map(used).collect()
    }

    /// Whether other processes may be at work on the same records.
    #[must_use]
    pub fn are_shared(&self) -> bool {
        self.dialect == Dialect::Postgres
    }

    /// Where the database is.
    pub(super) fn url(&self) -> &str {
        &self.url.0
    }

    async fn fault(&self, moment: Moment) -> Result<(), StoreError> {
        match &self.faults {
            Some(faults) => faults.at(moment).await,
            None => Ok(()),
        }
    }

    /// A transaction that may write.
    pub(super) async fn begin(&self) -> Result<Transaction<'static, Any>, StoreError> {
        self.fault(Moment::Before).await?;
        Ok(self.writers.begin_with(self.dialect.begin()).await?)
    }

    /// A transaction that may write, and that does not wait for the disk: a power cut may take it back, though never without all that
    /// came after it. For what is true only as long as this process lives.
    pub(super) async fn begin_brief(&self) -> Result<Transaction<'static, Any>, StoreError> {
        self.fault(Moment::Before).await?;
        Ok(self.writers.begin_with(self.dialect.begin_brief()).await?)
    }

    /// Ends a transaction. When this fails, the changes may have been made all the same.
    pub(super) async fn commit(&self, transaction: Transaction<'static, Any>) -> Result<(), StoreError> {
        transaction.commit().await?;
        self.fault(Moment::After).await
    }

    /// One statement that writes, in a transaction of its own.
    pub(super) async fn execute(&self, query: Query<'_, Any, Arguments>) -> Result<AnyQueryResult, StoreError> {
        let mut transaction = self.begin().await?;
        let done = query.execute(&mut *transaction).await?;
        self.commit(transaction).await?;
        Ok(done)
    }

    /// The rows of one query.
    pub(super) async fn all(&self, query: Query<'_, Any, Arguments>) -> Result<Vec<AnyRow>, StoreError> {
        self.fault(Moment::Before).await?;
        Ok(query.fetch_all(&self.readers).await?)
    }

    /// The row of a query that has one at most.
    pub(super) async fn optional(&self, query: Query<'_, Any, Arguments>) -> Result<Option<AnyRow>, StoreError> {
        self.fault(Moment::Before).await?;
        Ok(query.fetch_optional(&self.readers).await?)
    }

    /// The row of a query that writes and gives one at most, in a transaction of its own.
    pub(super) async fn optional_written(
        &self,
        query: Query<'_, Any, Arguments>,
    ) -> Result<Option<AnyRow>, StoreError> {
        let mut transaction = self.begin().await?;
        let row = query.fetch_optional(&mut *transaction).await?;
        self.commit(transaction).await?;
        Ok(row)
    }

    /// The row of a query that always has one.
    pub(super) async fn one(&self, query: Query<'_, Any, Arguments>) -> Result<AnyRow, StoreError> {
        self.fault(Moment::Before).await?;
        Ok(query.fetch_one(&self.readers).await?)
    }

    /// Waits until nobody else has that lock among all processes, and keeps it for as long as the transaction lives. On SQLite,
    /// where a writer is alone anyway, there is nothing to wait for.
    pub(super) async fn lock(
        &self,
        transaction: &mut Transaction<'static, Any>,
        name: &str,
        kind: Lock,
    ) -> Result<(), StoreError> {
        if self.dialect == Dialect::Postgres {
            let query = match kind {
                Lock::Shared => "SELECT pg_advisory_xact_lock_shared(hashtextextended($1, 0))",
                Lock::Alone => "SELECT pg_advisory_xact_lock(hashtextextended($1, 0))",
            };
            sqlx::query(query).bind(name).execute(&mut **transaction).await?;
        }
        Ok(())
    }

    /// Locks blobs among all processes; on SQLite there are no others.
    pub(in crate::store) async fn lock_blobs(&self, digests: &[&str], kind: Lock) -> Result<BlobLocks, StoreError> {
        if self.dialect == Dialect::Sqlite {
            return Ok(BlobLocks(None));
        }
        let mut transaction = self.gate_pool.begin().await?;
        for digest in digests {
            self.lock(&mut transaction, digest, kind).await?;
        }
        Ok(BlobLocks(Some(transaction)))
    }

    /// Whether the database answers, asked beside all others.
    ///
    /// # Errors
    /// When it does not.
    pub async fn check(&self) -> Result<(), StoreError> {
        self.fault(Moment::Before).await?;
        sqlx::query("SELECT 1").fetch_one(&self.keepers).await?;
        Ok(())
    }

    /// The same as [`Self::begin_brief`], beside all others: for leases. On SQLite one writes at a time.
    pub(super) async fn begin_keeping(&self) -> Result<Transaction<'static, Any>, StoreError> {
        self.fault(Moment::Before).await?;
        let pool = if self.are_shared() { &self.keepers } else { &self.writers };
        Ok(pool.begin_with(self.dialect.begin_brief()).await?)
    }

    /// The rows of a list: one that takes too long is ended, so that lists alone wait for lists.
    pub(super) async fn listed(&self, query: Query<'_, Any, Arguments>) -> Result<Vec<AnyRow>, StoreError> {
        self.fault(Moment::Before).await?;
        Ok(query.fetch_all(&self.listers).await?)
    }

    /// Gives free pages of a SQLite file back to the disk, where the file was made to do so.
    pub(super) async fn give_pages_back(&self, pragma: &'static str) -> Result<(), StoreError> {
        self.fault(Moment::Before).await?;
        sqlx::query(pragma).fetch_all(&self.writers).await?;
        Ok(())
    }

    /// Closes the database when everything that uses it has ended.
    pub async fn close(&self) {
        self.gate_pool.close().await;
        self.keepers.close().await;
        self.listers.close().await;
        self.writers.close().await;
        self.readers.close().await;
    }
}

/// Lets a connection out of a transaction that SQLite has taken back by itself. Gives whether it can be used.
async fn leave_transaction(connection: &mut AnyConnection) -> bool {
    if !connection.is_in_transaction() {
        return true;
    }
    // The driver refuses to begin another transaction, and takes back the one that it believes in when it has refused: it finds this one,
    // or the one that is still there.
    let _ = connection.execute("BEGIN").await;
    let _ = connection.begin_with("BEGIN").await;
    connection.ping().await.is_ok() && !connection.is_in_transaction()
}

/// Locks on blobs, until it is dropped.
#[derive(Debug)]
pub(in crate::store) struct BlobLocks(
    #[expect(dead_code, reason = "held, never looked at")] Option<Transaction<'static, Any>>,
);

/// Whether a lock goes together with others of its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::store) enum Lock {
    /// Any number of these at the same time.
    Shared,
    /// Nobody else at all.
    Alone,
}

/// A query whose text was put together from texts of this module alone, never from what users sent.
pub(super) fn ours(text: String) -> impl SqlSafeStr {
    sqlx::AssertSqlSafe(text)
}

/// Rows or values of one statement at most: well below what either database takes, and enough that statements do not weigh.
pub(super) const CHUNK: usize = 100;

/// The places of `count` values of a statement, the first of them numbered `first`.
pub(super) fn places(first: usize, count: usize) -> String {
    (first..first + count).map(|place| format!("${place}")).collect::<Vec<_>>().join(", ")
}

/// The places of the values of `rows` rows of `columns` columns.
pub(super) fn rows_of(rows: usize, columns: usize) -> String {
    (0..rows).map(|row| format!("({})", places(row * columns + 1, columns))).collect::<Vec<_>>().join(", ")
}

/// A path as it stands in a URL.
fn escape(path: &str) -> String {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"/-_.~".contains(&byte);
    path.bytes().fold(String::with_capacity(path.len()), |mut text, byte| {
        if is_plain(byte) {
            text.push(char::from(byte));
        } else {
            text.push_str(&format!("%{byte:02X}"));
        }
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As on a disk that is full or fails: SQLite takes the transaction back before anybody asks it to.
    #[tokio::test]
    async fn a_transaction_that_sqlite_took_back_leaves_no_trace() {
        let folder = tempfile::tempdir().expect("a folder");
        let records = Records::open(&folder.path().join("state.db")).await.expect("opens");
        for _ in 0..3 {
            let mut transaction = records.begin().await.expect("begins");
            transaction.execute("ROLLBACK").await.expect("as SQLite does it by itself");
            drop(transaction);
        }
        let mut transaction = records.begin().await.expect("the next one finds a connection that works");
        let insert = "INSERT INTO turns (principal, served, seen_at) VALUES ('ann', 1, 1)";
        transaction.execute(insert).await.expect("writes");
        records.commit(transaction).await.expect("is written");
        let row = records.one(sqlx::query("SELECT served FROM turns WHERE principal = 'ann'")).await;
        row.expect("it is there");
        records.close().await;
    }
}
