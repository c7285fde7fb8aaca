"""What is in the files that a run writes: every column with its quantity, unit and meaning."""
