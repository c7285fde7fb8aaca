"""From logs to the alpha table: ingest, phases, tare, slopes, intervals."""
