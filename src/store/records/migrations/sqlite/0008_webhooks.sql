-- Webhooks, and the outbox of what they are to be told. A trigger writes the outbox, so that no end of a job can be forgotten and each
-- is in the transaction of its end.

CREATE TABLE webhooks (
    id               TEXT    PRIMARY KEY NOT NULL,
    principal        TEXT    NOT NULL,
    url              TEXT    NOT NULL,
    events           TEXT    NOT NULL,
    description      TEXT    NOT NULL,
    secret           TEXT    NOT NULL,
    old_secret       TEXT,
    old_secret_until INTEGER,
    created_at       INTEGER NOT NULL,
    failing_since    INTEGER,
    disabled_at      INTEGER,
    disabled_reason  TEXT
) STRICT;
CREATE INDEX webhooks_by_principal ON webhooks (principal, id);

-- A delivery that somebody is making is due again when that somebody must be gone.
CREATE TABLE deliveries (
    id           TEXT    PRIMARY KEY NOT NULL,
    webhook_id   TEXT    NOT NULL REFERENCES webhooks (id) ON DELETE CASCADE,
    event        TEXT    NOT NULL,
    job_id       TEXT,
    state        TEXT    NOT NULL,
    attempts     INTEGER NOT NULL DEFAULT 0,
    retries      INTEGER NOT NULL DEFAULT 0,
    created_at   INTEGER NOT NULL,
    due_at       INTEGER NOT NULL,
    attempted_at INTEGER,
    status       INTEGER,
    error        TEXT,
    finished_at  INTEGER
) STRICT;
CREATE INDEX deliveries_by_webhook ON deliveries (webhook_id, id);
CREATE INDEX deliveries_due ON deliveries (due_at) WHERE state = 'pending';
CREATE INDEX deliveries_by_end ON deliveries (finished_at) WHERE finished_at IS NOT NULL;

-- The webhook that is told of a job whatever it listens to.
ALTER TABLE jobs ADD COLUMN webhook_id TEXT;

-- An id is the time and 56 random bits, all in letters that ids have.
CREATE TRIGGER job_ended AFTER UPDATE OF state ON jobs
WHEN NEW.state <> OLD.state AND NEW.state IN ('succeeded', 'failed', 'canceled') BEGIN
    INSERT INTO deliveries (id, webhook_id, event, job_id, state, created_at, due_at)
        SELECT 'dlv_' || printf('%012x', CAST(unixepoch('subsec') * 1000 AS INTEGER)) || lower(hex(randomblob(7))),
               webhooks.id, 'job.' || NEW.state, NEW.id, 'pending',
               CAST(unixepoch('subsec') * 1000 AS INTEGER), CAST(unixepoch('subsec') * 1000 AS INTEGER)
        FROM webhooks WHERE webhooks.principal = NEW.principal AND disabled_at IS NULL
        AND (webhooks.id = NEW.webhook_id OR ' ' || events || ' ' LIKE '% job.' || NEW.state || ' %');
END;
