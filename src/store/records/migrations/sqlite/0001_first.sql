-- Times are milliseconds since 1970-01-01 UTC. Ids are in the order of their making, so lists page by id.

CREATE TABLE assets (
    id          TEXT    PRIMARY KEY NOT NULL,
    sha256      TEXT    NOT NULL,
    bytes       INTEGER NOT NULL,
    format      TEXT    NOT NULL,
    file_name   TEXT    NOT NULL,
    created_at  INTEGER NOT NULL,
    expires_at  INTEGER NOT NULL,
    UNIQUE (sha256, format)
) STRICT;
CREATE INDEX assets_by_expiry ON assets (expires_at);

CREATE TABLE jobs (
    id            TEXT    PRIMARY KEY NOT NULL,
    state         TEXT    NOT NULL,
    request       TEXT    NOT NULL,
    input_bytes   INTEGER NOT NULL,
    attempt       INTEGER NOT NULL,
    retry_of      TEXT,
    created_at    INTEGER NOT NULL,
    started_at    INTEGER,
    finished_at   INTEGER,
    expires_at    INTEGER,
    warnings      INTEGER NOT NULL DEFAULT 0,
    failure       TEXT,
    report        TEXT,
    resolved_spec TEXT
) STRICT;
CREATE INDEX jobs_by_state ON jobs (state, id);
CREATE INDEX jobs_by_expiry ON jobs (expires_at) WHERE expires_at IS NOT NULL;

CREATE TABLE job_inputs (
    job_id   TEXT NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    asset_id TEXT NOT NULL,
    PRIMARY KEY (job_id, asset_id)
) STRICT, WITHOUT ROWID;
CREATE INDEX job_inputs_by_asset ON job_inputs (asset_id);

CREATE TABLE results (
    id          TEXT    PRIMARY KEY NOT NULL,
    job_id      TEXT    NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    position    INTEGER NOT NULL,
    format      TEXT    NOT NULL,
    file_name   TEXT    NOT NULL,
    sha256      TEXT    NOT NULL,
    bytes       INTEGER NOT NULL,
    created_at  INTEGER NOT NULL,
    expires_at  INTEGER NOT NULL
) STRICT;
CREATE INDEX results_by_job ON results (job_id, position);
CREATE INDEX results_by_expiry ON results (expires_at);
CREATE INDEX results_by_blob ON results (sha256);

-- What a file holds is a function of its bytes, its format and the version that looked.
CREATE TABLE inspections (
    sha256   TEXT NOT NULL,
    format   TEXT NOT NULL,
    version  TEXT NOT NULL,
    document TEXT NOT NULL,
    PRIMARY KEY (sha256, format, version)
) STRICT, WITHOUT ROWID;
