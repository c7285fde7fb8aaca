"""Make a campaign's results again in a folder of their own, and say which files come out otherwise.

The same logs, settings and code give the same bytes, so a file that differs was forged, damaged, or made by other code;
records cannot tell, since whoever changes a result can renew its record.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from rftfit.errors import InputError, RftfitError
from rftfit.results import FOLDER
from rftfit.store import copy_file
from rftfit.store.links import link_folder
from rftfit.store.tables import read_cells, read_parquet
from rftfit.workflow.records import Record, Recorded
from rftfit.workflow.run import Workflow
from rftfit.workflow.snakemake import Job, Progress
from rftfit.workflow.state import States

TextRows = list[list[str]]
"""Rows of a table as texts, its names first."""


@dataclass(frozen=True)
class Unlike:
    """A result that comes out otherwise: where it differs first, and by how much."""

    path: str
    difference: str

    def __str__(self) -> str:
        return f"{self.path}: {self.difference}"


@dataclass(frozen=True)
class Remade:
    """What came of making results again.

    `same`: Files with equal bytes. `unlike`: Files that differ, in the order in which jobs make them.
    `not_made`: Recorded files that `rftfit run` does not make, as the whole sweep of the robot.
    """

    same: tuple[str, ...]
    unlike: tuple[Unlike, ...]
    not_made: tuple[str, ...]


def remake(
    recorded: Recorded,
    cores: int | None = None,
    on_job: Callable[[Progress, Job | None], None] = lambda *_: None,
) -> Remade:
    """Make the results of a campaign again, beside those that are there, and compare them byte by byte.

    Parameters
    ----------
    recorded : Recorded
        Records and files of the campaign as they are.
    cores : int, optional
        Jobs at once; default: all cores.
    on_job : callable, optional
        Told the state of the run whenever a job has finished.

    Returns
    -------
    Remade

    Raises
    ------
    RftfitError
        If a job fails, so that nothing can be compared.
    """
    with TemporaryDirectory(prefix="rftfit-again-") as folder:
        root = Path(folder).resolve() / "campaign"
        config = _copy_settings(recorded.states, root)
        workflow = Workflow(config, cores=cores, on_job=on_job)
        workflow.run()
        recorded_again = workflow.recorded
        same: list[str] = []
        unlike: list[Unlike] = []
        not_made: list[str] = []
        for path in _in_order([*recorded.all.values(), *recorded_again.all.values()]):
            original, remade = recorded.root / path, root / path
            if path not in recorded_again.maker:
                not_made.append(path)
            elif recorded.digests([path]) == recorded_again.digests([path]):
                same.append(path)
            else:
                unlike.append(Unlike(path, _difference(original, remade)))
    return Remade(tuple(same), tuple(unlike), tuple(not_made))


def _copy_settings(states: States, root: Path) -> Path:
    """Lay out a campaign with copies of its settings and a link to its logs; returns the path of its config."""
    campaign = states.campaign
    config = campaign.root / next(iter(campaign.read_from))
    raw = campaign.raw.relative_to(campaign.root)
    settings = [path for path in config.parent.rglob("*") if path.is_file()]
    if config.parent == campaign.root:
        settings = [path for path in config.parent.iterdir() if path.is_file()]
    named_paths = [campaign.sheet, *(campaign.root / name for name in states.robot_files)]
    for path in dict.fromkeys([*settings, *named_paths]):
        name = path.relative_to(campaign.root)
        if not name.is_relative_to(raw) and not name.is_relative_to(FOLDER):
            copy_file(path, root / name)
    link_folder(root / raw, campaign.raw.resolve())
    return root / config.relative_to(campaign.root)


def _in_order(records: Sequence[Record | None]) -> list[str]:
    """Results in the order in which jobs make them, each once."""
    return list(dict.fromkeys(path for record in records if record for path in record.writes))


# --- Where two files differ.


def _difference(original: Path, remade: Path) -> str:
    """Say where a file differs from the one that was made again, and by how much."""
    if not original.is_file():
        return "not there"
    try:
        if original.suffix in (".csv", ".parquet"):
            return _difference_of_tables(_cells(original), _cells(remade)) or _of_bytes(
                original, remade
            )
    except RftfitError as error:
        return f"damaged: {error}".replace(f"{original}: ", "")
    return _of_bytes(original, remade)


def _cells(path: Path) -> TextRows:
    if path.suffix == ".parquet":
        table = read_parquet(path)
        rows = table.astype(object).to_numpy().tolist()
        return [[*map(str, table.columns)], *([*map(str, row)] for row in rows)]
    try:
        return read_cells(path)
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: no UTF-8 text: byte {error.start}") from error


def _difference_of_tables(original: TextRows, remade: TextRows) -> str:
    """Say which cell of a table differs first and by how much; empty where all cells are equal."""
    names = remade[0] if remade else []
    if original[:1] != remade[:1]:
        unshared_columns = sorted(set(names).symmetric_difference(original[0] if original else []))
        return f"other columns: {', '.join(unshared_columns) or 'in another order'}"
    cells = list(_unequal_cells(original, remade))
    count = f"{len(original) - 1} rows, {len(remade) - 1} made again"
    if not cells:
        return count if len(original) != len(remade) else ""
    line, column, was, now = cells[0]
    size = _size(was, now)
    largest = max((_relative(was, now) for _, _, was, now in cells), default=math.nan)
    cells_text = f"; {len(cells)} cells differ" if len(cells) > 1 else ""
    if len(cells) > 1 and math.isfinite(largest):
        cells_text += f", by {100 * largest:.2g} % at most"
    rows_text = f"; {count}" if len(original) != len(remade) else ""
    return f"line {line}, {names[column]}: {was!r}, made again {now!r}{size}{cells_text}{rows_text}"


def _unequal_cells(original: TextRows, remade: TextRows) -> Iterator[tuple[int, int, str, str]]:
    """Line, column, text and text made again of each cell that differs, in rows that both tables have."""
    for line, (row, row_again) in enumerate(zip(original, remade, strict=False), 1):
        if row != row_again:
            for column, (was, now) in enumerate(zip(row, row_again, strict=False)):
                if was != now:
                    yield line, column, was, now


def _relative(was: str, now: str) -> float:
    """Change of a number against the one made again; -inf where one is no number."""
    try:
        return abs(float(was) - float(now)) / max(abs(float(now)), 1e-300)
    except ValueError:
        return -math.inf


def _size(was: str, now: str) -> str:
    change = _relative(was, now)
    return f" ({100 * change:.2g} %)" if math.isfinite(change) else ""


def _of_bytes(original: Path, remade: Path) -> str:
    was, now = original.read_bytes(), remade.read_bytes()
    first = next(
        (place for place, pair in enumerate(zip(was, now, strict=False)) if pair[0] != pair[1]),
        min(len(was), len(now)),
    )
    if len(was) != len(now):
        return (
            f"{len(was)} bytes, made again {len(now)}; the first that differs is byte {first + 1}"
        )
    differ = sum(old != new for old, new in zip(was, now, strict=True))
    return f"{differ} of {len(now)} bytes differ, the first is byte {first + 1}"
