-- What each principal's records take up, kept by triggers so that nobody has to count: rows of jobs and of rigs and presets (every version),
-- and the bytes of all their texts. A job counts 1,024 bytes besides for its row, its events and its places in indices.

CREATE TABLE record_counts (
    principal TEXT    PRIMARY KEY NOT NULL,
    jobs      INTEGER NOT NULL DEFAULT 0,
    documents INTEGER NOT NULL DEFAULT 0,
    bytes     INTEGER NOT NULL DEFAULT 0
) STRICT, WITHOUT ROWID;

INSERT INTO record_counts (principal, jobs, documents, bytes)
    SELECT principal, SUM(jobs), SUM(documents), SUM(bytes) FROM (
        SELECT principal, 1 AS jobs, 0 AS documents,
               1024 + length(request) + COALESCE(length(failure), 0) + COALESCE(length(report), 0)
               + COALESCE(length(resolved_spec), 0) AS bytes FROM jobs
        UNION ALL SELECT principal, 0, 1, length(document) FROM named_documents) AS records
    GROUP BY principal;

CREATE TRIGGER job_counted AFTER INSERT ON jobs BEGIN
    INSERT INTO record_counts (principal, jobs, bytes)
        VALUES (NEW.principal, 1, 1024 + length(NEW.request) + COALESCE(length(NEW.failure), 0))
        ON CONFLICT (principal) DO UPDATE SET jobs = jobs + 1, bytes = bytes + excluded.bytes;
END;
CREATE TRIGGER job_grown AFTER UPDATE OF failure, report, resolved_spec ON jobs
WHEN NEW.failure IS NOT OLD.failure OR NEW.report IS NOT OLD.report OR NEW.resolved_spec IS NOT OLD.resolved_spec BEGIN
    UPDATE record_counts SET bytes = bytes
        + COALESCE(length(NEW.failure), 0) + COALESCE(length(NEW.report), 0) + COALESCE(length(NEW.resolved_spec), 0)
        - COALESCE(length(OLD.failure), 0) - COALESCE(length(OLD.report), 0) - COALESCE(length(OLD.resolved_spec), 0)
        WHERE principal = NEW.principal;
END;
CREATE TRIGGER job_removed AFTER DELETE ON jobs BEGIN
    UPDATE record_counts SET jobs = jobs - 1, bytes = bytes - 1024 - length(OLD.request) - COALESCE(length(OLD.failure), 0)
        - COALESCE(length(OLD.report), 0) - COALESCE(length(OLD.resolved_spec), 0) WHERE principal = OLD.principal;
END;
CREATE TRIGGER document_counted AFTER INSERT ON named_documents BEGIN
    INSERT INTO record_counts (principal, documents, bytes) VALUES (NEW.principal, 1, length(NEW.document))
        ON CONFLICT (principal) DO UPDATE SET documents = documents + 1, bytes = bytes + excluded.bytes;
END;
CREATE TRIGGER document_removed AFTER DELETE ON named_documents BEGIN
    UPDATE record_counts SET documents = documents - 1, bytes = bytes - length(OLD.document)
        WHERE principal = OLD.principal;
END;

-- The oldest ended jobs of a principal go first, and old versions of documents go when its older jobs are gone.
CREATE INDEX jobs_by_principal_and_end ON jobs (principal, finished_at) WHERE finished_at IS NOT NULL;
CREATE INDEX jobs_by_principal_and_time ON jobs (principal, created_at);
CREATE INDEX documents_superseded ON named_documents (superseded_at) WHERE superseded_at IS NOT NULL;

-- Which process has a job, and whether it may be what brought one down: 0 nobody thinks so, 1 it was there when one went down, 2 it runs
-- alone, so that it is known whose fault the next one is.
ALTER TABLE jobs ADD COLUMN worker TEXT;
ALTER TABLE jobs ADD COLUMN suspicion INTEGER NOT NULL DEFAULT 0;
CREATE INDEX jobs_by_worker ON jobs (worker) WHERE state IN ('running', 'canceling');

-- When a key was last shown, to within some minutes.
ALTER TABLE api_keys ADD COLUMN last_used_at INTEGER;
