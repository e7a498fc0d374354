-- Batches: jobs that were asked for together. A job of a batch (lane 1) waits behind those that its caller asked for one by one (lane 0).
-- An item that is asked for again has a newer job; the older one stays for as long as it is kept, and is superseded.

CREATE TABLE batches (
    id              TEXT   COLLATE "C" PRIMARY KEY,
    principal       TEXT   COLLATE "C" NOT NULL,
    created_at      BIGINT NOT NULL,
    on_error        TEXT   NOT NULL,
    items           BIGINT NOT NULL,
    labels          TEXT   NOT NULL,
    idempotency_key TEXT   COLLATE "C",
    asked_sha256    TEXT
);
CREATE INDEX batches_by_principal ON batches (principal, id);
CREATE UNIQUE INDEX batches_by_idempotency_key ON batches (principal, idempotency_key) WHERE idempotency_key IS NOT NULL;

ALTER TABLE jobs ADD COLUMN batch_id TEXT COLLATE "C";
ALTER TABLE jobs ADD COLUMN batch_item BIGINT;
ALTER TABLE jobs ADD COLUMN lane BIGINT NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN is_superseded BIGINT NOT NULL DEFAULT 0;
CREATE INDEX jobs_by_batch ON jobs (batch_id, batch_item, id) WHERE batch_id IS NOT NULL;

DROP INDEX jobs_queued;
CREATE INDEX jobs_queued ON jobs (principal, lane, priority DESC, id) WHERE state = 'queued';

-- An item that cannot be run is a job that has ended when it comes.
CREATE TRIGGER job_came_ended AFTER INSERT ON jobs
    FOR EACH ROW WHEN (NEW.state IN ('succeeded', 'failed', 'canceled'))
    EXECUTE FUNCTION put_end_into_outbox();
