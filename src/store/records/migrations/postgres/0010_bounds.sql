-- What each principal's records take up, kept by triggers so that nobody has to count: rows of jobs and of rigs and presets (every version),
-- and the bytes of all their texts. A job counts 1,024 bytes besides for its row, its events and its places in indices. Rows of several
-- principals are always changed in the order of their names, so that nobody waits for one who waits for him.

CREATE TABLE record_counts (
    principal TEXT   COLLATE "C" PRIMARY KEY,
    jobs      BIGINT NOT NULL DEFAULT 0,
    documents BIGINT NOT NULL DEFAULT 0,
    bytes     BIGINT NOT NULL DEFAULT 0
) WITH (fillfactor = 50);

INSERT INTO record_counts (principal, jobs, documents, bytes)
    SELECT principal, SUM(jobs), SUM(documents), SUM(bytes) FROM (
        SELECT principal, 1 AS jobs, 0 AS documents, 1024 + octet_length(request) + COALESCE(octet_length(failure), 0)
               + COALESCE(octet_length(report), 0) + COALESCE(octet_length(resolved_spec), 0) AS bytes FROM jobs
        UNION ALL SELECT principal, 0, 1, octet_length(document) FROM named_documents) AS records
    GROUP BY principal;

CREATE FUNCTION count_jobs() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO record_counts AS counts (principal, jobs, bytes)
        SELECT principal, SUM(sign), SUM(bytes) FROM (
            SELECT changed.principal, CASE TG_OP WHEN 'INSERT' THEN 1 ELSE -1 END AS sign,
                   CASE TG_OP WHEN 'INSERT' THEN 1 ELSE -1 END
                   * (1024 + octet_length(changed.request) + COALESCE(octet_length(changed.failure), 0)
                      + COALESCE(octet_length(changed.report), 0) + COALESCE(octet_length(changed.resolved_spec), 0)) AS bytes
            FROM changed) AS each
        GROUP BY principal ORDER BY principal
        ON CONFLICT (principal) DO UPDATE SET jobs = counts.jobs + excluded.jobs, bytes = counts.bytes + excluded.bytes;
    RETURN NULL;
END $$;
CREATE FUNCTION count_growth() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    UPDATE record_counts SET bytes = bytes
        + COALESCE(octet_length(NEW.failure), 0) + COALESCE(octet_length(NEW.report), 0) + COALESCE(octet_length(NEW.resolved_spec), 0)
        - COALESCE(octet_length(OLD.failure), 0) - COALESCE(octet_length(OLD.report), 0) - COALESCE(octet_length(OLD.resolved_spec), 0)
        WHERE principal = NEW.principal;
    RETURN NULL;
END $$;
CREATE FUNCTION count_documents() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO record_counts AS counts (principal, documents, bytes)
        SELECT principal, SUM(CASE TG_OP WHEN 'INSERT' THEN 1 ELSE -1 END),
               SUM(CASE TG_OP WHEN 'INSERT' THEN 1 ELSE -1 END * octet_length(document))
        FROM changed GROUP BY principal ORDER BY principal
        ON CONFLICT (principal) DO UPDATE
        SET documents = counts.documents + excluded.documents, bytes = counts.bytes + excluded.bytes;
    RETURN NULL;
END $$;
CREATE TRIGGER jobs_counted AFTER INSERT ON jobs REFERENCING NEW TABLE AS changed
    FOR EACH STATEMENT EXECUTE FUNCTION count_jobs();
CREATE TRIGGER jobs_removed AFTER DELETE ON jobs REFERENCING OLD TABLE AS changed
    FOR EACH STATEMENT EXECUTE FUNCTION count_jobs();
CREATE TRIGGER job_grown AFTER UPDATE OF failure, report, resolved_spec ON jobs FOR EACH ROW
    WHEN (NEW.failure IS DISTINCT FROM OLD.failure OR NEW.report IS DISTINCT FROM OLD.report
          OR NEW.resolved_spec IS DISTINCT FROM OLD.resolved_spec) EXECUTE FUNCTION count_growth();
CREATE TRIGGER documents_counted AFTER INSERT ON named_documents REFERENCING NEW TABLE AS changed
    FOR EACH STATEMENT EXECUTE FUNCTION count_documents();
CREATE TRIGGER documents_removed AFTER DELETE ON named_documents REFERENCING OLD TABLE AS changed
    FOR EACH STATEMENT EXECUTE FUNCTION count_documents();

-- The oldest ended jobs of a principal go first, and old versions of documents go when its older jobs are gone.
CREATE INDEX jobs_by_principal_and_end ON jobs (principal, finished_at) WHERE finished_at IS NOT NULL;
CREATE INDEX jobs_by_principal_and_time ON jobs (principal, created_at);
CREATE INDEX documents_superseded ON named_documents (superseded_at) WHERE superseded_at IS NOT NULL;

-- Which process has a job, and whether it may be what brought one down: 0 nobody thinks so, 1 it was there when one went down, 2 it runs
-- alone, so that it is known whose fault the next one is.
ALTER TABLE jobs ADD COLUMN worker TEXT COLLATE "C";
ALTER TABLE jobs ADD COLUMN suspicion BIGINT NOT NULL DEFAULT 0;
CREATE INDEX jobs_by_worker ON jobs (worker) WHERE state IN ('running', 'canceling');

-- When a key was last shown, to within some minutes.
ALTER TABLE api_keys ADD COLUMN last_used_at BIGINT;
