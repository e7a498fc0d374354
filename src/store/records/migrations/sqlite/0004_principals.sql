-- Files, rigs and presets belong to a principal, as jobs do. What was there before belongs to everybody who has to say no name. SQLite
-- changes no constraint in place, so both tables are made anew.

CREATE TABLE assets_owned (
    id          TEXT    PRIMARY KEY NOT NULL,
    principal   TEXT    NOT NULL,
    sha256      TEXT    NOT NULL,
    bytes       INTEGER NOT NULL,
    format      TEXT    NOT NULL,
    file_name   TEXT    NOT NULL,
    created_at  INTEGER NOT NULL,
    expires_at  INTEGER NOT NULL,
    UNIQUE (principal, sha256, format)
) STRICT;
INSERT INTO assets_owned SELECT id, 'anonymous', sha256, bytes, format, file_name, created_at, expires_at FROM assets;
DROP TABLE assets;
ALTER TABLE assets_owned RENAME TO assets;
CREATE INDEX assets_by_expiry ON assets (expires_at);
CREATE INDEX assets_by_principal ON assets (principal, id);
CREATE INDEX assets_by_blob ON assets (sha256);

CREATE TABLE documents_owned (
    principal     TEXT    NOT NULL,
    kind          TEXT    NOT NULL,
    name          TEXT    NOT NULL,
    version       INTEGER NOT NULL,
    sha256        TEXT    NOT NULL,
    document      TEXT    NOT NULL,
    created_at    INTEGER NOT NULL,
    superseded_at INTEGER,
    PRIMARY KEY (principal, kind, name, version)
) STRICT, WITHOUT ROWID;
INSERT INTO documents_owned
    SELECT 'anonymous', kind, name, version, sha256, document, created_at, superseded_at FROM named_documents;
DROP TABLE named_documents;
ALTER TABLE documents_owned RENAME TO named_documents;
CREATE UNIQUE INDEX named_documents_current ON named_documents (principal, kind, name) WHERE superseded_at IS NULL;

-- Who asks twice with the same key has one job.
ALTER TABLE jobs ADD COLUMN idempotency_key TEXT;
ALTER TABLE jobs ADD COLUMN asked_sha256 TEXT;
CREATE UNIQUE INDEX jobs_by_idempotency_key ON jobs (principal, idempotency_key) WHERE idempotency_key IS NOT NULL;

CREATE INDEX jobs_by_principal ON jobs (principal, id);

-- Keys with which callers say who they are. Only a digest of what is secret is kept.
CREATE TABLE api_keys (
    id         TEXT    PRIMARY KEY NOT NULL,
    principal  TEXT    NOT NULL,
    sha256     TEXT    NOT NULL,
    scopes     TEXT    NOT NULL,
    created_at INTEGER NOT NULL,
    expires_at INTEGER
) STRICT;
CREATE INDEX api_keys_by_principal ON api_keys (principal, id);
