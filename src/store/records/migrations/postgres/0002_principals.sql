-- Files, rigs and presets belong to a principal, as jobs do. What was there before belongs to everybody who has to say no name.

ALTER TABLE assets ADD COLUMN principal TEXT COLLATE "C" NOT NULL DEFAULT 'anonymous';
ALTER TABLE assets ALTER COLUMN principal DROP DEFAULT;
ALTER TABLE assets DROP CONSTRAINT assets_sha256_format_key;
ALTER TABLE assets ADD UNIQUE (principal, sha256, format);
CREATE INDEX assets_by_principal ON assets (principal, id);
CREATE INDEX assets_by_blob ON assets (sha256);

ALTER TABLE named_documents ADD COLUMN principal TEXT COLLATE "C" NOT NULL DEFAULT 'anonymous';
ALTER TABLE named_documents ALTER COLUMN principal DROP DEFAULT;
ALTER TABLE named_documents DROP CONSTRAINT named_documents_pkey;
ALTER TABLE named_documents ADD PRIMARY KEY (principal, kind, name, version);
DROP INDEX named_documents_current;
CREATE UNIQUE INDEX named_documents_current ON named_documents (principal, kind, name) WHERE superseded_at IS NULL;

-- Who asks twice with the same key has one job.
ALTER TABLE jobs ADD COLUMN idempotency_key TEXT COLLATE "C";
ALTER TABLE jobs ADD COLUMN asked_sha256 TEXT;
CREATE UNIQUE INDEX jobs_by_idempotency_key ON jobs (principal, idempotency_key) WHERE idempotency_key IS NOT NULL;

CREATE INDEX jobs_by_principal ON jobs (principal, id);

-- Keys with which callers say who they are. Only a digest of what is secret is kept.
CREATE TABLE api_keys (
    id         TEXT   COLLATE "C" PRIMARY KEY,
    principal  TEXT   COLLATE "C" NOT NULL,
    sha256     TEXT   NOT NULL,
    scopes     TEXT   NOT NULL,
    created_at BIGINT NOT NULL,
    expires_at BIGINT
);
CREATE INDEX api_keys_by_principal ON api_keys (principal, id);
