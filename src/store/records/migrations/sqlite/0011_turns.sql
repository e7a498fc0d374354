-- Triggers keep whose turn it is, in the transaction of the change and without a statement of its own. The row of a caller's turn goes when
-- nobody has seen the caller for long, and never under a job that is being added.

CREATE TRIGGER job_waits AFTER INSERT ON jobs WHEN NEW.state = 'queued' BEGIN
    INSERT INTO turns (principal, served, seen_at) VALUES (NEW.principal, 0, NEW.created_at)
        ON CONFLICT (principal) DO UPDATE SET seen_at = excluded.seen_at;
END;

CREATE TRIGGER job_taken AFTER UPDATE OF state ON jobs WHEN NEW.state = 'running' AND OLD.state = 'queued' BEGIN
    UPDATE turns SET served = (SELECT MAX(served) + 1 FROM turns) WHERE principal = NEW.principal;
END;
