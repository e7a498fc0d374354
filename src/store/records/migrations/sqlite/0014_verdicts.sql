-- What the report of a job says of its result as a whole.
ALTER TABLE jobs ADD COLUMN verdict TEXT;
ALTER TABLE jobs ADD COLUMN verdict_reason TEXT;
ALTER TABLE jobs ADD COLUMN coverage REAL;
-- The few with one verdict among many.
CREATE INDEX jobs_by_verdict ON jobs (principal, verdict, id) WHERE verdict IS NOT NULL;
