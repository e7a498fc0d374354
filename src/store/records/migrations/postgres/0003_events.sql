-- Every change of a job's state is an event of the job's principal. Events are numbered without gaps, in the order in which the changes
-- become visible: the row of a principal's head is locked until the change is committed. A trigger writes them, so that none can be
-- forgotten and each is in the transaction of its change.

CREATE TABLE event_heads (
    principal TEXT   COLLATE "C" PRIMARY KEY,
    last      BIGINT NOT NULL,
    removed   BIGINT NOT NULL DEFAULT 0
) WITH (fillfactor = 50);

CREATE TABLE events (
    principal  TEXT   COLLATE "C" NOT NULL,
    number     BIGINT NOT NULL,
    job_id     TEXT   COLLATE "C" NOT NULL,
    state      TEXT   NOT NULL,
    created_at BIGINT NOT NULL,
    PRIMARY KEY (principal, number)
);
CREATE INDEX events_by_job ON events (job_id, number);
CREATE INDEX events_by_age ON events (created_at);

CREATE FUNCTION note_state_of_job() RETURNS trigger LANGUAGE plpgsql AS $$
DECLARE
    next_number BIGINT;
BEGIN
    INSERT INTO event_heads AS heads (principal, last) VALUES (NEW.principal, 1)
        ON CONFLICT (principal) DO UPDATE SET last = heads.last + 1
        RETURNING heads.last INTO next_number;
    INSERT INTO events (principal, number, job_id, state, created_at)
        VALUES (NEW.principal, next_number, NEW.id, NEW.state,
                CAST(EXTRACT(EPOCH FROM clock_timestamp()) * 1000 AS BIGINT));
    RETURN NULL;
END $$;

CREATE TRIGGER job_asked_for AFTER INSERT ON jobs
    FOR EACH ROW EXECUTE FUNCTION note_state_of_job();
CREATE TRIGGER job_changed AFTER UPDATE OF state ON jobs
    FOR EACH ROW WHEN (NEW.state <> OLD.state) EXECUTE FUNCTION note_state_of_job();
