"""Atomic, deterministic reading and writing of results."""

from rftfit.store.files import atomic_path, copy_file, open_growing, write_bytes, write_text
from rftfit.store.tables import (
    csv_bytes,
    read_cells,
    read_csv,
    read_parquet,
    write_csv,
    write_parquet,
)

__all__ = [
    "atomic_path",
    "copy_file",
    "csv_bytes",
    "open_growing",
    "read_cells",
    "read_csv",
    "read_parquet",
    "write_bytes",
    "write_csv",
    "write_parquet",
    "write_text",
]
