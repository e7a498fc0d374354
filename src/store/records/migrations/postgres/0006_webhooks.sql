-- Webhooks, and the outbox of what they are to be told. A trigger writes the outbox, so that no end of a job can be forgotten and each
-- is in the transaction of its end.

CREATE TABLE webhooks (
    id               TEXT   COLLATE "C" PRIMARY KEY,
    principal        TEXT   COLLATE "C" NOT NULL,
    url              TEXT   NOT NULL,
    events           TEXT   NOT NULL,
    description      TEXT   NOT NULL,
    secret           TEXT   NOT NULL,
    old_secret       TEXT,
    old_secret_until BIGINT,
    created_at       BIGINT NOT NULL,
    failing_since    BIGINT,
    disabled_at      BIGINT,
    disabled_reason  TEXT
);
CREATE INDEX webhooks_by_principal ON webhooks (principal, id);

-- A delivery that somebody is making is due again when that somebody must be gone.
CREATE TABLE deliveries (
    id           TEXT   COLLATE "C" PRIMARY KEY,
    webhook_id   TEXT   COLLATE "C" NOT NULL REFERENCES webhooks (id) ON DELETE CASCADE,
    event        TEXT   NOT NULL,
    job_id       TEXT   COLLATE "C",
    state        TEXT   NOT NULL,
    attempts     BIGINT NOT NULL DEFAULT 0,
    retries      BIGINT NOT NULL DEFAULT 0,
    created_at   BIGINT NOT NULL,
    due_at       BIGINT NOT NULL,
    attempted_at BIGINT,
    status       BIGINT,
    error        TEXT,
    finished_at  BIGINT
);
CREATE INDEX deliveries_by_webhook ON deliveries (webhook_id, id);
CREATE INDEX deliveries_due ON deliveries (due_at) WHERE state = 'pending';
CREATE INDEX deliveries_by_end ON deliveries (finished_at) WHERE finished_at IS NOT NULL;

-- The webhook that is told of a job whatever it listens to.
ALTER TABLE jobs ADD COLUMN webhook_id TEXT COLLATE "C";

-- An id is the time and 56 random bits, all in letters that ids have.
CREATE FUNCTION put_end_into_outbox() RETURNS trigger LANGUAGE plpgsql AS $$
DECLARE
    now_milliseconds BIGINT := CAST(EXTRACT(EPOCH FROM clock_timestamp()) * 1000 AS BIGINT);
BEGIN
    INSERT INTO deliveries (id, webhook_id, event, job_id, state, created_at, due_at)
        SELECT 'dlv_' || lpad(to_hex(now_milliseconds), 12, '0') || right(replace(CAST(gen_random_uuid() AS TEXT), '-', ''), 14),
               webhooks.id, 'job.' || NEW.state, NEW.id, 'pending', now_milliseconds, now_milliseconds
        FROM webhooks WHERE webhooks.principal = NEW.principal AND disabled_at IS NULL
        AND (webhooks.id = NEW.webhook_id OR ' ' || events || ' ' LIKE '% job.' || NEW.state || ' %');
    RETURN NULL;
END $$;

CREATE TRIGGER job_ended AFTER UPDATE OF state ON jobs
    FOR EACH ROW WHEN (NEW.state <> OLD.state AND NEW.state IN ('succeeded', 'failed', 'canceled'))
    EXECUTE FUNCTION put_end_into_outbox();
