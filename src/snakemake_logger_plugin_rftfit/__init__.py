"""Logger plug-in of Snakemake, ``--logger rftfit``: its events as lines of JSON on standard output.

An event is that a job began, finished or failed, or a message. Snakemake finds its plug-ins by the name of this package.
"""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

from snakemake_interface_logger_plugins.base import LogHandlerBase

if TYPE_CHECKING:
    from logging import LogRecord

KEYS = (
    "event",
    "jobid",
    "job_id",
    "rule_name",
    "rule_msg",
    "wildcards",
    "skipped",
    "log",
    "reason",
    "done",
    "total",
    "stats",
    "indent",
)
"""Attributes of an event that `rftfit.workflow.snakemake.Progress` reads."""


class LogHandler(LogHandlerBase):
    """Writes the attributes `KEYS` of each event, and its message under the key ``snakemake``.

    The properties tell Snakemake what it need not add: a stream or file to write to, a filter, a format, the graph of rules.
    """

    writes_to_stream = property(lambda _: True)
    writes_to_file = property(lambda _: False)
    has_filter = property(lambda _: True)
    has_formatter = property(lambda _: True)
    needs_rulegraph = property(lambda _: False)

    def emit(self, record: LogRecord) -> None:
        """Write one event as a line; a reader that has gone is no reason to stop the workflow."""
        fields = {key: value for key in KEYS if (value := getattr(record, key, None)) is not None}
        line = json.dumps({"snakemake": record.getMessage(), **fields}, default=str)
        try:
            sys.stdout.write(line + "\n")
            sys.stdout.flush()
        except OSError:
            self.handleError(record)
