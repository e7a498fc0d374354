-- Batches: jobs that were asked for together. A job of a batch (lane 1) waits behind those that its caller asked for one by one (lane 0).
-- An item that is asked for again has a newer job; the older one stays for as long as it is kept, and is superseded.

CREATE TABLE batches (
    id              TEXT    PRIMARY KEY NOT NULL,
    principal       TEXT    NOT NULL,
    created_at      INTEGER NOT NULL,
    on_error        TEXT    NOT NULL,
    items           INTEGER NOT NULL,
    labels          TEXT    NOT NULL,
    idempotency_key TEXT,
    asked_sha256    TEXT
) STRICT;
CREATE INDEX batches_by_principal ON batches (principal, id);
CREATE UNIQUE INDEX batches_by_idempotency_key ON batches (principal, idempotency_key) WHERE idempotency_key IS NOT NULL;

ALTER TABLE jobs ADD COLUMN batch_id TEXT;
ALTER TABLE jobs ADD COLUMN batch_item INTEGER;
ALTER TABLE jobs ADD COLUMN lane INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN is_superseded INTEGER NOT NULL DEFAULT 0;
CREATE INDEX jobs_by_batch ON jobs (batch_id, batch_item, id) WHERE batch_id IS NOT NULL;

DROP INDEX jobs_queued;
CREATE INDEX jobs_queued ON jobs (principal, lane, priority DESC, id) WHERE state = 'queued';

-- An item that cannot be run is a job that has ended when it comes.
CREATE TRIGGER job_came_ended AFTER INSERT ON jobs
WHEN NEW.state IN ('succeeded', 'failed', 'canceled') BEGIN
    INSERT INTO deliveries (id, webhook_id, event, job_id, state, created_at, due_at)
        SELECT 'dlv_' || printf('%012x', CAST(unixepoch('subsec') * 1000 AS INTEGER)) || lower(hex(randomblob(7))),
               webhooks.id, 'job.' || NEW.state, NEW.id, 'pending',
               CAST(unixepoch('subsec') * 1000 AS INTEGER), CAST(unixepoch('subsec') * 1000 AS INTEGER)
        FROM webhooks WHERE webhooks.principal = NEW.principal AND disabled_at IS NULL
        AND (webhooks.id = NEW.webhook_id OR ' ' || events || ' ' LIKE '% job.' || NEW.state || ' %');
END;
