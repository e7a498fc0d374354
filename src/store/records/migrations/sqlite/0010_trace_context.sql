-- The span that asked for a job, so that whoever works on it, wherever and however often, belongs to the same trace.

ALTER TABLE jobs ADD COLUMN trace_context TEXT;
