"""From a file to a table: its text, its cells, and what numbers and units are written as."""
