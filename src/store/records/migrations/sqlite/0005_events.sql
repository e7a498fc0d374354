-- Every change of a job's state is an event of the job's principal. Events are numbered without gaps, in the order in which the changes
-- become visible: the row of a principal's head is locked until the change is committed. Triggers write them, so that none can be
-- forgotten and each is in the transaction of its change.

CREATE TABLE event_heads (
    principal TEXT    PRIMARY KEY NOT NULL,
    last      INTEGER NOT NULL,
    removed   INTEGER NOT NULL DEFAULT 0
) STRICT, WITHOUT ROWID;

CREATE TABLE events (
    principal  TEXT    NOT NULL,
    number     INTEGER NOT NULL,
    job_id     TEXT    NOT NULL,
    state      TEXT    NOT NULL,
    created_at INTEGER NOT NULL,
    PRIMARY KEY (principal, number)
) STRICT, WITHOUT ROWID;
CREATE INDEX events_by_job ON events (job_id, number);
CREATE INDEX events_by_age ON events (created_at);

CREATE TRIGGER job_asked_for AFTER INSERT ON jobs BEGIN
    INSERT INTO event_heads (principal, last) VALUES (NEW.principal, 1)
        ON CONFLICT (principal) DO UPDATE SET last = last + 1;
    INSERT INTO events (principal, number, job_id, state, created_at)
        SELECT principal, last, NEW.id, NEW.state, CAST(unixepoch('subsec') * 1000 AS INTEGER)
        FROM event_heads WHERE principal = NEW.principal;
END;

CREATE TRIGGER job_changed AFTER UPDATE OF state ON jobs WHEN NEW.state <> OLD.state BEGIN
    INSERT INTO event_heads (principal, last) VALUES (NEW.principal, 1)
        ON CONFLICT (principal) DO UPDATE SET last = last + 1;
    INSERT INTO events (principal, number, job_id, state, created_at)
        SELECT principal, last, NEW.id, NEW.state, CAST(unixepoch('subsec') * 1000 AS INTEGER)
        FROM event_heads WHERE principal = NEW.principal;
END;
