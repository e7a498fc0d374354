//! What SQLite and Postgres say differently. Everything else is one text for both.

use std::borrow::Cow;

use sqlx::{
    SqlStr,
    migrate::{Migration, MigrationType, Migrator},
};

/// The database at the other end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dialect {
    /// A file of this process alone.
    Sqlite,
    /// A server that many processes share.
    Postgres,
}

type NumberedText = (i64, &'static str, &'static str);

/// Every change of the layout, in order. A released one is never edited; add a new one to both lists.
const SQLITE: [NumberedText; 17] = [
    (1, "first", include_str!("migrations/sqlite/0001_first.sql")),
    (2, "named documents", include_str!("migrations/sqlite/0002_named_documents.sql")),
    (3, "queue", include_str!("migrations/sqlite/0003_queue.sql")),
    (4, "principals", include_str!("migrations/sqlite/0004_principals.sql")),
    (5, "events", include_str!("migrations/sqlite/0005_events.sql")),
    (6, "job lists", include_str!("migrations/sqlite/0006_job_lists.sql")),
    (7, "result cache", include_str!("migrations/sqlite/0007_result_cache.sql")),
    (8, "webhooks", include_str!("migrations/sqlite/0008_webhooks.sql")),
    (9, "batches", include_str!("migrations/sqlite/0009_batches.sql")),
    (10, "trace context", include_str!("migrations/sqlite/0010_trace_context.sql")),
    (11, "turns", include_str!("migrations/sqlite/0011_turns.sql")),
    (12, "bounds", include_str!("migrations/sqlite/0012_bounds.sql")),
    (13, "scale", include_str!("migrations/sqlite/0013_scale.sql")),
    (14, "verdicts", include_str!("migrations/sqlite/0014_verdicts.sql")),
    (15, "time used", include_str!("migrations/sqlite/0015_time_used.sql")),
    (16, "unused index", include_str!("migrations/sqlite/0016_unused_index.sql")),
    (17, "revoked keys", include_str!("migrations/sqlite/0017_revoked_keys.sql")),
];
const POSTGRES: [NumberedText; 15] = [
    (1, "first", include_str!("migrations/postgres/0001_first.sql")),
    (2, "principals", include_str!("migrations/postgres/0002_principals.sql")),
    (3, "events", include_str!("migrations/postgres/0003_events.sql")),
    (4, "job lists", include_str!("migrations/postgres/0004_job_lists.sql")),
    (5, "result cache", include_str!("migrations/postgres/0005_result_cache.sql")),
    (6, "webhooks", include_str!("migrations/postgres/0006_webhooks.sql")),
    (7, "batches", include_str!("migrations/postgres/0007_batches.sql")),
    (8, "trace context", include_str!("migrations/postgres/0008_trace_context.sql")),
    (9, "turns and notices", include_str!("migrations/postgres/0009_turns_and_notices.sql")),
    (10, "bounds", include_str!("migrations/postgres/0010_bounds.sql")),
    (11, "scale", include_str!("migrations/postgres/0011_scale.sql")),
    (12, "verdicts", include_str!("migrations/postgres/0012_verdicts.sql")),
    (13, "time used", include_str!("migrations/postgres/0013_time_used.sql")),
    (14, "unused index", include_str!("migrations/postgres/0014_unused_index.sql")),
    (15, "revoked keys", include_str!("migrations/postgres/0015_revoked_keys.sql")),
];

impl Dialect {
    /// The dialect of a database URL.
    pub(super) fn of(url: &str) -> Option<Self> {
        let (scheme, _) = url.split_once(':')?;
        match scheme {
            "sqlite" => Some(Self::Sqlite),
            "postgres" | "postgresql" => Some(Self::Postgres),
            _ => None,
        }
    }

    /// Begins a transaction that may write. On SQLite it begins as a writer, because one that turns into a writer half way fails at
    /// once when another is writing, whatever the busy timeout. What is committed survives a power cut.
    pub(super) const fn begin(self) -> &'static str {
        match self {
            Self::Sqlite => "PRAGMA synchronous = FULL; BEGIN IMMEDIATE",
            Self::Postgres => "BEGIN",
        }
    }

    /// Begins a transaction of claims and leases, which a power cut may take back. In Postgres they go by their indices whatever the planner
    /// last counted: a queue fills and empties faster than it counts, and it would sort a queue that it takes for empty, or read the
    /// whole table for a caller of whom none waits, to find the one row that an index has first.
    pub(super) const fn begin_brief(self) -> &'static str {
        match self {
            Self::Sqlite => "PRAGMA synchronous = NORMAL; BEGIN IMMEDIATE",
            Self::Postgres => {
                "BEGIN; SET LOCAL synchronous_commit TO off; SET LOCAL enable_sort TO off; SET LOCAL enable_seqscan TO off"
            }
        }
    }

    /// The end of a query whose rows nobody else may change until the transaction is over. On SQLite nobody else can.
    pub(super) const fn lock_rows(self) -> &'static str {
        match self {
            Self::Sqlite => "",
            Self::Postgres => "FOR UPDATE",
        }
    }

    /// The same for rows of files that shall only stay.
    pub(super) const fn keep_files(self) -> &'static str {
        match self {
            Self::Sqlite => "",
            Self::Postgres => "FOR KEY SHARE OF assets",
        }
    }

    /// The same, leaving out what somebody else has.
    pub(super) const fn lock_free_rows(self) -> &'static str {
        match self {
            Self::Sqlite => "",
            Self::Postgres => "FOR UPDATE SKIP LOCKED",
        }
    }

    /// Now, in milliseconds, by the clock of the database: the one clock that all processes share.
    pub(super) const fn now(self) -> &'static str {
        match self {
            Self::Sqlite => "CAST(unixepoch('subsec') * 1000 AS INTEGER)",
            Self::Postgres => "CAST(EXTRACT(EPOCH FROM clock_timestamp()) * 1000 AS BIGINT)",
        }
    }

    /// The letters of a new id that the database makes: the time, then 56 random bits, as the triggers of the layout do.
    pub(super) const fn new_letters(self) -> &'static str {
        match self {
            Self::Sqlite => "printf('%012x', CAST(unixepoch('subsec') * 1000 AS INTEGER)) || lower(hex(randomblob(7)))",
            Self::Postgres => {
                "lpad(to_hex(CAST(EXTRACT(EPOCH FROM clock_timestamp()) * 1000 AS BIGINT)), 12, '0') || \
                 right(replace(CAST(gen_random_uuid() AS TEXT), '-', ''), 14)"
            }
        }
    }

    /// What brings the layout up to date.
    pub(super) fn migrator(self) -> Migrator {
        let texts: &[NumberedText] = match self {
            Self::Sqlite => &SQLITE,
            Self::Postgres => &POSTGRES,
        };
        let migrations = texts.iter().map(|(version, name, text)| {
            Migration::new(*version, Cow::Borrowed(*name), MigrationType::Simple, SqlStr::from_static(text), false)
        });
        Migrator { migrations: migrations.collect(), ..Migrator::DEFAULT }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_of_the_layout_is_in_its_list_in_order() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/store/records/migrations");
        for (name, list) in [("sqlite", &SQLITE[..]), ("postgres", &POSTGRES[..])] {
            let files = std::fs::read_dir(folder.join(name)).expect("the folder").count();
            assert_eq!(files, list.len(), "files of {name}");
            assert!(list.iter().zip(1..).all(|((number, ..), expected)| *number == expected), "numbers of {name}");
        }
    }
}
