-- No statement looks jobs up by their time: ids are in the order of time. Every new job wrote a place in it.
DROP INDEX jobs_by_principal_and_time;
