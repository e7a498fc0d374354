-- A key that was revoked opens nothing and stays in the list, so that it can be told later who had which key until when. A note says what
-- a key was made for.
ALTER TABLE api_keys ADD COLUMN note TEXT NOT NULL DEFAULT '';
ALTER TABLE api_keys ADD COLUMN revoked_at BIGINT;
