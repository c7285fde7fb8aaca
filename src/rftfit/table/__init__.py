"""From a file to a table, for logs and sheets alike: its text, its cells, and the spellings of numbers, units, times."""
