-- Nothing that a caller asks looks at more rows than it is about, however many there are of others.

-- How many wait, for how long, and when the next is due, without a look at their rows.
DROP INDEX jobs_by_state;
CREATE INDEX jobs_waiting ON jobs (lane, available_at, input_bytes, created_at) WHERE state = 'queued';

-- Lists by what they are filtered by, newest first.
DROP INDEX jobs_by_principal_and_state;
CREATE INDEX jobs_by_principal_and_state ON jobs (principal, state, id);
ALTER TABLE job_labels ADD COLUMN principal TEXT COLLATE "C" NOT NULL DEFAULT '';
UPDATE job_labels SET principal = jobs.principal FROM jobs WHERE jobs.id = job_id;
DROP INDEX job_labels_by_value;
CREATE INDEX job_labels_by_value ON job_labels (principal, name, value, job_id);

-- What the jobs of a batch say of it.
CREATE INDEX jobs_of_batches ON jobs (batch_id, is_superseded, state, started_at, finished_at, expires_at) WHERE batch_id IS NOT NULL;

-- What is stored, without a look at the rows.
DROP INDEX assets_by_principal;
CREATE INDEX assets_by_principal ON assets (principal, id) INCLUDE (bytes);
DROP INDEX assets_by_blob;
CREATE INDEX assets_by_blob ON assets (sha256) INCLUDE (bytes);
DROP INDEX results_by_blob;
CREATE INDEX results_by_blob ON results (sha256) INCLUDE (bytes);
DROP INDEX results_by_job;
CREATE INDEX results_by_job ON results (job_id, position) INCLUDE (bytes);

-- A job that has ended needs its files no more, so whether anybody needs a file is asked of few.
DELETE FROM job_inputs WHERE job_id IN (SELECT id FROM jobs WHERE state IN ('succeeded', 'failed', 'canceled'));
CREATE OR REPLACE FUNCTION put_end_into_outbox() RETURNS trigger LANGUAGE plpgsql AS $$
DECLARE
    now_milliseconds BIGINT := CAST(EXTRACT(EPOCH FROM clock_timestamp()) * 1000 AS BIGINT);
BEGIN
    INSERT INTO deliveries (id, webhook_id, event, job_id, state, created_at, due_at)
        SELECT 'dlv_' || lpad(to_hex(now_milliseconds), 12, '0') || right(replace(CAST(gen_random_uuid() AS TEXT), '-', ''), 14),
               webhooks.id, 'job.' || NEW.state, NEW.id, 'pending', now_milliseconds, now_milliseconds
        FROM webhooks WHERE webhooks.principal = NEW.principal AND disabled_at IS NULL
        AND (webhooks.id = NEW.webhook_id OR ' ' || events || ' ' LIKE '% job.' || NEW.state || ' %');
    DELETE FROM job_inputs WHERE job_id = NEW.id;
    RETURN NULL;
END $$;

-- The few deliveries that are looked for among many that arrived.
CREATE INDEX deliveries_pending ON deliveries (webhook_id, id) WHERE state = 'pending';
CREATE INDEX deliveries_failed ON deliveries (webhook_id, id) WHERE state = 'failed';
CREATE INDEX deliveries_pings ON deliveries (webhook_id, id) WHERE event = 'ping';
DROP INDEX deliveries_due;
CREATE INDEX deliveries_due ON deliveries (due_at, id, webhook_id) WHERE state = 'pending';

CREATE INDEX quarantine_by_expiry ON quarantine (expires_at);
