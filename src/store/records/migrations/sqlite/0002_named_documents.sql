-- What users keep under a name (rig templates, presets). Every version is a row of its own, since jobs name the version that they
-- were asked for with; the current one is not superseded.
CREATE TABLE named_documents (
    kind          TEXT    NOT NULL,
    name          TEXT    NOT NULL,
    version       INTEGER NOT NULL,
    sha256        TEXT    NOT NULL,
    document      TEXT    NOT NULL,
    created_at    INTEGER NOT NULL,
    superseded_at INTEGER,
    PRIMARY KEY (kind, name, version)
) STRICT, WITHOUT ROWID;
CREATE UNIQUE INDEX named_documents_current ON named_documents (kind, name) WHERE superseded_at IS NULL;

-- What a file holds depends on the program that looks and on the users' templates, so it is remembered in memory only.
DROP TABLE inspections;
