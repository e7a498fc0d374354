-- What jobs are listed by: their kind, and the labels that their callers gave them.

ALTER TABLE jobs ADD COLUMN kind TEXT NOT NULL DEFAULT 'retarget';
CREATE INDEX jobs_by_principal_and_state ON jobs (principal, state);

CREATE TABLE job_labels (
    job_id TEXT COLLATE "C" NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    name   TEXT COLLATE "C" NOT NULL,
    value  TEXT COLLATE "C" NOT NULL,
    PRIMARY KEY (job_id, name)
);
CREATE INDEX job_labels_by_value ON job_labels (name, value, job_id);
-- A NUL, which no text can hold here, keeps the labels of an old job from being listed by.
INSERT INTO job_labels SELECT jobs.id, label.key, label.value
    FROM jobs, json_each_text(CAST(jobs.request AS JSON) -> 'labels') AS label
    WHERE jobs.request NOT LIKE '%\\u0000%';
