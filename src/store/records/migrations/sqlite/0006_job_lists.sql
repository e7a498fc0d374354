-- What jobs are listed by: their kind, and the labels that their callers gave them.

ALTER TABLE jobs ADD COLUMN kind TEXT NOT NULL DEFAULT 'retarget';
CREATE INDEX jobs_by_principal_and_state ON jobs (principal, state);

CREATE TABLE job_labels (
    job_id TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    name   TEXT NOT NULL,
    value  TEXT NOT NULL,
    PRIMARY KEY (job_id, name)
) STRICT, WITHOUT ROWID;
CREATE INDEX job_labels_by_value ON job_labels (name, value, job_id);
INSERT INTO job_labels SELECT jobs.id, label.key, label.value FROM jobs, json_each(jobs.request, '$.labels') AS label;
