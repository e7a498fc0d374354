-- The layout of the SQLite migrations 1 to 3, in one. Times are milliseconds since 1970-01-01 UTC. Ids are in the order of their making,
-- so lists page by id; texts are compared by their bytes, as SQLite does.

CREATE TABLE assets (
    id          TEXT   COLLATE "C" PRIMARY KEY,
    sha256      TEXT   COLLATE "C" NOT NULL,
    bytes       BIGINT NOT NULL,
    format      TEXT   NOT NULL,
    file_name   TEXT   NOT NULL,
    created_at  BIGINT NOT NULL,
    expires_at  BIGINT NOT NULL,
    UNIQUE (sha256, format)
);
CREATE INDEX assets_by_expiry ON assets (expires_at);

-- A lease is a token that the one who has the job alone knows; it stays when the job has ended, and says whose end it was.
CREATE TABLE jobs (
    id               TEXT   COLLATE "C" PRIMARY KEY,
    state            TEXT   NOT NULL,
    request          TEXT   NOT NULL,
    input_bytes      BIGINT NOT NULL,
    attempt          BIGINT NOT NULL,
    retry_of         TEXT,
    created_at       BIGINT NOT NULL,
    started_at       BIGINT,
    finished_at      BIGINT,
    expires_at       BIGINT,
    warnings         BIGINT NOT NULL DEFAULT 0,
    failure          TEXT,
    report           TEXT,
    resolved_spec    TEXT,
    principal        TEXT   COLLATE "C" NOT NULL,
    priority         BIGINT NOT NULL,
    inputs_sha256    TEXT   NOT NULL,
    memory_bytes     BIGINT NOT NULL,
    crashes          BIGINT NOT NULL DEFAULT 0,
    retries          BIGINT NOT NULL DEFAULT 0,
    available_at     BIGINT NOT NULL DEFAULT 0,
    lease            TEXT   COLLATE "C",
    lease_expires_at BIGINT,
    progress         TEXT
);
CREATE INDEX jobs_by_state ON jobs (state, id);
CREATE INDEX jobs_by_expiry ON jobs (expires_at) WHERE expires_at IS NOT NULL;
CREATE INDEX jobs_queued ON jobs (principal, priority DESC, id) WHERE state = 'queued';
CREATE INDEX jobs_leased ON jobs (lease_expires_at) WHERE state IN ('running', 'canceling');

CREATE TABLE job_inputs (
    job_id   TEXT COLLATE "C" NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    asset_id TEXT COLLATE "C" NOT NULL,
    PRIMARY KEY (job_id, asset_id)
);
CREATE INDEX job_inputs_by_asset ON job_inputs (asset_id);

CREATE TABLE results (
    id          TEXT   COLLATE "C" PRIMARY KEY,
    job_id      TEXT   COLLATE "C" NOT NULL REFERENCES jobs (id) ON DELETE CASCADE,
    position    BIGINT NOT NULL,
    format      TEXT   NOT NULL,
    file_name   TEXT   NOT NULL,
    sha256      TEXT   COLLATE "C" NOT NULL,
    bytes       BIGINT NOT NULL,
    created_at  BIGINT NOT NULL,
    expires_at  BIGINT NOT NULL
);
CREATE INDEX results_by_job ON results (job_id, position);
CREATE INDEX results_by_expiry ON results (expires_at);
CREATE INDEX results_by_blob ON results (sha256);

CREATE TABLE named_documents (
    kind          TEXT   COLLATE "C" NOT NULL,
    name          TEXT   COLLATE "C" NOT NULL,
    version       BIGINT NOT NULL,
    sha256        TEXT   NOT NULL,
    document      TEXT   NOT NULL,
    created_at    BIGINT NOT NULL,
    superseded_at BIGINT,
    PRIMARY KEY (kind, name, version)
);
CREATE UNIQUE INDEX named_documents_current ON named_documents (kind, name) WHERE superseded_at IS NULL;

-- Whose turn it is: the caller who was served longest ago.
CREATE TABLE turns (
    principal TEXT   COLLATE "C" PRIMARY KEY,
    served    BIGINT NOT NULL,
    seen_at   BIGINT NOT NULL
);
CREATE INDEX turns_by_served ON turns (served);

-- Inputs under which workers died again and again.
CREATE TABLE quarantine (
    inputs_sha256 TEXT   COLLATE "C" PRIMARY KEY,
    job_id        TEXT   NOT NULL,
    expires_at    BIGINT NOT NULL
);
