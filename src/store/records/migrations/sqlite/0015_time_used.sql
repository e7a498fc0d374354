-- Turns go by the time that workers spend on a caller's jobs (start-time fair queueing; Goyal, Vin and Cheng 1996), in milliseconds. Who is
-- served counts as having used what a job of that caller is thought to take, and what it took when that is known. Who comes anew, or comes
-- back, begins where the caller stood whose job was taken last: time that was not asked for is not saved up.

ALTER TABLE jobs ADD COLUMN taken_at INTEGER;
ALTER TABLE jobs ADD COLUMN charged INTEGER NOT NULL DEFAULT 0;
ALTER TABLE turns ADD COLUMN began INTEGER NOT NULL DEFAULT 0;
ALTER TABLE turns ADD COLUMN cost INTEGER NOT NULL DEFAULT 1000;
UPDATE turns SET served = 0;
CREATE INDEX turns_by_beginning ON turns (began);

DROP TRIGGER job_waits;
DROP TRIGGER job_taken;

CREATE TRIGGER job_waits AFTER INSERT ON jobs WHEN NEW.state = 'queued' BEGIN
    INSERT INTO turns (principal, served, seen_at)
        VALUES (NEW.principal, (SELECT COALESCE(MAX(began), 0) FROM turns), NEW.created_at)
        ON CONFLICT (principal) DO UPDATE SET seen_at = excluded.seen_at, served = MAX(served, excluded.served);
END;

CREATE TRIGGER job_taken AFTER UPDATE OF taken_at ON jobs WHEN NEW.taken_at IS NOT NULL AND OLD.taken_at IS NULL BEGIN
    UPDATE turns SET began = served, served = served + NEW.charged WHERE principal = NEW.principal;
END;

-- What a job is thought to take rises at once to what one took, and falls by a quarter of the difference with each that took less.
CREATE TRIGGER job_charged AFTER UPDATE OF charged ON jobs
WHEN NEW.charged <> OLD.charged AND OLD.taken_at IS NOT NULL BEGIN
    UPDATE turns SET served = served + NEW.charged - OLD.charged,
        cost = MAX(NEW.charged, CASE WHEN NEW.taken_at IS NULL THEN (3 * cost + NEW.charged) / 4 ELSE cost END)
        WHERE principal = NEW.principal;
END;
