-- What a job computes is a function of its files, its config and the program. The key stands for all three; who asks for the same again
-- is given the results that are there.

ALTER TABLE jobs ADD COLUMN cache_key TEXT;
ALTER TABLE jobs ADD COLUMN cached_from TEXT;
CREATE INDEX jobs_by_cache_key ON jobs (principal, cache_key, id) WHERE cache_key IS NOT NULL;
