-- Turns go by the time that workers spend on a caller's jobs (start-time fair queueing; Goyal, Vin and Cheng 1996), in milliseconds. Who is
-- served counts as having used what a job of that caller is thought to take, and what it took when that is known. Who comes anew, or comes
-- back, begins where the caller stood whose job was taken last: time that was not asked for is not saved up.

ALTER TABLE jobs ADD COLUMN taken_at BIGINT;
ALTER TABLE jobs ADD COLUMN charged BIGINT NOT NULL DEFAULT 0;
ALTER TABLE turns ADD COLUMN began BIGINT NOT NULL DEFAULT 0;
ALTER TABLE turns ADD COLUMN cost BIGINT NOT NULL DEFAULT 1000;
UPDATE turns SET served = 0;
CREATE INDEX turns_by_beginning ON turns (began);

CREATE OR REPLACE FUNCTION note_state_of_job() RETURNS trigger LANGUAGE plpgsql AS $$
DECLARE
    next_number BIGINT;
BEGIN
    INSERT INTO event_heads AS heads (principal, last) VALUES (NEW.principal, 1)
        ON CONFLICT (principal) DO UPDATE SET last = heads.last + 1
        RETURNING heads.last INTO next_number;
    INSERT INTO events (principal, number, job_id, state, created_at)
        VALUES (NEW.principal, next_number, NEW.id, NEW.state,
                CAST(EXTRACT(EPOCH FROM clock_timestamp()) * 1000 AS BIGINT));
    IF TG_OP = 'UPDATE' AND NEW.state <> 'running' THEN
        PERFORM pg_notify('retargetd_jobs', NEW.id || ' ' || NEW.state);
    END IF;
    RETURN NULL;
END $$;

CREATE OR REPLACE FUNCTION note_new_jobs() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO turns (principal, served, seen_at)
        SELECT principal, (SELECT COALESCE(MAX(began), 0) FROM turns), MAX(created_at)
        FROM new_jobs WHERE state = 'queued' GROUP BY principal ORDER BY principal
        ON CONFLICT (principal) DO UPDATE SET seen_at = excluded.seen_at, served = GREATEST(turns.served, excluded.served);
    PERFORM pg_notify('retargetd_jobs', MIN(id) || ' queued') FROM new_jobs WHERE state = 'queued' HAVING COUNT(*) > 0;
    RETURN NULL;
END $$;

-- What a job is thought to take rises at once to what one took, and falls by a quarter of the difference with each that took less.
CREATE FUNCTION note_time_used() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    IF OLD.taken_at IS NULL THEN
        UPDATE turns SET began = served, served = served + NEW.charged WHERE principal = NEW.principal;
    ELSE
        UPDATE turns SET served = served + NEW.charged - OLD.charged,
            cost = GREATEST(NEW.charged, CASE WHEN NEW.taken_at IS NULL THEN (3 * cost + NEW.charged) / 4 ELSE cost END)
            WHERE principal = NEW.principal;
    END IF;
    RETURN NULL;
END $$;

-- After 'job_changed', as triggers of one change go by their names: the rows of a principal are locked in one order.
CREATE TRIGGER job_charged AFTER UPDATE OF taken_at, charged ON jobs FOR EACH ROW
    WHEN (OLD.taken_at IS NULL AND NEW.taken_at IS NOT NULL OR OLD.taken_at IS NOT NULL AND NEW.charged <> OLD.charged)
    EXECUTE FUNCTION note_time_used();
