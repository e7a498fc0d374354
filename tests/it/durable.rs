//! Nothing acknowledged is ever lost: records on both databases, processes that die, stores that fail, many workers.
//!
//! Postgres and an S3 server are started here, each on a free port and in a folder of its own; `tests/run` installs both.

/// Each promise on an empty database of its own.
macro_rules! suite {
    ($sqlite:ident, $postgres:ident: $($promise:ident),+ $(,)?) => {
        #[tokio::test(flavor = "multi_thread")]
        async fn $sqlite() {
            on_sqlite().await;
        }

        #[tokio::test(flavor = "multi_thread")]
        async fn $postgres() {
            let Some(server) = crate::durable::support::Postgres::start() else { return };
            on_postgres(&server).await;
        }

        pub(super) async fn on_sqlite() {
            $( {
                let folder = tempfile::tempdir().expect("a temporary folder");
                let records = Records::open(&folder.path().join("a state?.db")).await.expect("opens");
                $promise(&records).await;
                records.close().await;
            } )+
        }

        pub(super) async fn on_postgres(server: &crate::durable::support::Postgres) {
            $( {
                let records = server.records().await;
                $promise(&records).await;
                records.close().await;
                server.empty().await;
            } )+
        }
    };
}

mod alerts;
mod backups;
mod batch_records;
mod batches;
mod clocks;
mod collector;
mod couriers;
mod crashes;
mod dice;
mod full_disk;
mod kills;
mod model;
mod named_records;
mod outbox;
mod plans;
mod queue_cost;
mod read_only_root;
mod record_bounds;
mod record_room;
mod records;
mod scale;
mod scale_out;
mod scaling;
mod shared_database;
mod stalls;
mod studio;
mod support;
mod traces;
mod turns;
mod upgrades;

pub(crate) use studio::CLIP;
