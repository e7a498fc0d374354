-- Triggers keep whose turn it is, and tell other processes what happened to a job: each in the transaction of the change, without a
-- question of its own that somebody would wait for.

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
    IF TG_OP = 'UPDATE' THEN
        IF NEW.state = 'running' THEN
            UPDATE turns SET served = (SELECT MAX(served) + 1 FROM turns) WHERE principal = NEW.principal;
        ELSE
            PERFORM pg_notify('retargetd_jobs', NEW.id || ' ' || NEW.state);
        END IF;
    END IF;
    RETURN NULL;
END $$;

-- The row of a caller's turn goes when nobody has seen the caller for long, and never under a job that is being added. Nobody waits yet
-- for the end of a job that is not known yet, so one notice does for all that come together: it wakes who takes jobs up.
CREATE FUNCTION note_new_jobs() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO turns (principal, served, seen_at)
        SELECT principal, 0, MAX(created_at) FROM new_jobs WHERE state = 'queued' GROUP BY principal ORDER BY principal
        ON CONFLICT (principal) DO UPDATE SET seen_at = excluded.seen_at;
    PERFORM pg_notify('retargetd_jobs', MIN(id) || ' queued') FROM new_jobs WHERE state = 'queued' HAVING COUNT(*) > 0;
    RETURN NULL;
END $$;

CREATE TRIGGER jobs_came AFTER INSERT ON jobs REFERENCING NEW TABLE AS new_jobs
    FOR EACH STATEMENT EXECUTE FUNCTION note_new_jobs();
