"""What each task wrote and what from: SHA-256 of every file, and digests of everything else.

The records of a stage are one small file, ``results/records/STAGE.json``. It is written anew after each
task, so that a killed stage goes on from what it has finished.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING

from rftfit.store import write_text

if TYPE_CHECKING:
    from pathlib import Path

FOLDER = "results/records"


@dataclass(frozen=True)
class Record:
    """One finished task.

    `depends`: Digests of code, settings, rows, logs.
    `reads`, `writes`: SHA-256 by path from the campaign's folder.
    """

    depends: dict[str, str]
    reads: dict[str, str]
    writes: dict[str, str]


@dataclass(frozen=True)
class Finding:
    """One thing about a task that is not as recorded.

    `sort`: ``new``, ``edited`` or ``missing`` (a result), ``input`` (a result it read) or ``changed``.
    `what`: The path, or what its results depend on.
    `was`: The recorded digest.
    """

    stage: str
    key: str
    sort: str
    what: str
    was: str


@dataclass
class Records:
    """Records of the finished tasks of one stage, by their key."""

    path: Path
    tasks: dict[str, Record] = field(default_factory=dict)

    @classmethod
    def load(cls, root: Path, stage: str) -> Records:
        """Read the records of a stage; one that is damaged counts as not there."""
        path = root / FOLDER / f"{stage}.json"
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
            tasks = {key: Record(**record) for key, record in data.items()}
            for record in tasks.values():
                for part in (record.depends, record.reads, record.writes):
                    if not all(isinstance(word, str) for pair in part.items() for word in pair):
                        raise TypeError
        except (OSError, ValueError, TypeError, AttributeError):
            tasks = {}
        return cls(path, tasks)

    def save(self) -> None:
        """Write the records of the tasks there are."""
        data = {key: asdict(self.tasks[key]) for key in sorted(self.tasks)}
        write_text(self.path, json.dumps(data, indent=1, sort_keys=True) + "\n")
