-- The queue lies in the table of jobs: who has a job, until when, and in whose turn it comes. A lease is a token that the one who has
-- the job alone knows; it stays when the job has ended, and says whose end it was.

ALTER TABLE jobs ADD COLUMN principal TEXT NOT NULL DEFAULT 'anonymous';
ALTER TABLE jobs ADD COLUMN priority INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN inputs_sha256 TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN memory_bytes INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN crashes INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN retries INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN available_at INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN lease TEXT;
ALTER TABLE jobs ADD COLUMN lease_expires_at INTEGER;
ALTER TABLE jobs ADD COLUMN progress TEXT;
CREATE INDEX jobs_queued ON jobs (principal, priority DESC, id) WHERE state = 'queued';
CREATE INDEX jobs_leased ON jobs (lease_expires_at) WHERE state IN ('running', 'canceling');

-- Whose turn it is: the caller who was served longest ago.
CREATE TABLE turns (
    principal TEXT    PRIMARY KEY NOT NULL,
    served    INTEGER NOT NULL,
    seen_at   INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
CREATE INDEX turns_by_served ON turns (served);
INSERT INTO turns (principal, served, seen_at) VALUES ('anonymous', 0, 0);

-- Inputs under which workers died again and again.
CREATE TABLE quarantine (
    inputs_sha256 TEXT    PRIMARY KEY NOT NULL,
    job_id        TEXT    NOT NULL,
    expires_at    INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
