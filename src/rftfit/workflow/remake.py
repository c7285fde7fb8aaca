"""`rftfit verify --again`: make results again in a folder of their own, and say which files come out otherwise.

The same logs, settings and code give the same bytes, so a file that differs was forged, damaged, or made by other code;
records cannot tell, since whoever changes a result can renew its record.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd

from rftfit.campaign.problems import join_words
from rftfit.errors import InputError, RftfitError
from rftfit.store import copy_file
from rftfit.store.links import RESULTS, link_folder
from rftfit.store.tables import read_cells, read_parquet
from rftfit.store.text import count, first_of
from rftfit.workflow.changed_cells import find_changed_cells
from rftfit.workflow.closing import MOST_NAMED, list_others
from rftfit.workflow.records import Recorded
from rftfit.workflow.run import Workflow
from rftfit.workflow.snakemake import Job, Progress
from rftfit.workflow.state import States
from rftfit.workflow.verify import list_reasons


@dataclass(frozen=True)
class Remade:
    """Results that were made again, compared with the recorded ones.

    Paths are from the campaign's folder. `same`: Paths of files with equal bytes. `unlike`: Sentence on the difference, by
    path of the file, in the order in which jobs make the files. `not_made`: Paths of recorded files that `rftfit run` does
    not make, such as the whole sweep of the robot. `recorded`: Records of the campaign, with its files as they are.
    """

    same: list[str]
    unlike: dict[str, str]
    not_made: list[str]
    recorded: Recorded

    @property
    def is_as_recorded(self) -> bool:
        """True where all results that were made again have the same bytes."""
        return not self.unlike

    def summary(self, most: int | None = None) -> str:
        """Format the comparison for people: files that differ and where, why results are out of date, a count.

        `most`: Most lines of each list; None: all.
        """
        unlike = [f"{path}: {difference}" for path, difference in self.unlike.items()]
        lines = first_of(unlike, most, "more that differ")
        if self.unlike:
            lines += first_of(list_reasons(self.recorded), most, "more reasons")
        results = count(len(self.same) + len(self.unlike), "result")
        lines.append(
            f"{results} made again: {len(self.same)} with the same bytes, {len(self.unlike)} otherwise."
        )
        if self.not_made:
            paths = join_words(self.not_made, MOST_NAMED)
            lines.append(f"Not made again, since rftfit run does not make them: {paths}.")
        return "\n".join([*lines, *list_others(self.recorded)])

    def as_dict(self) -> dict[str, Any]:
        """Return the comparison as plain words and lists, for ``--json``."""
        return {
            "same": self.same,
            "unlike": self.unlike,
            "not_made_again": self.not_made,
            "others": self.recorded.list_foreign_files(),
        }


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
        Function that gets the progress after each line of Snakemake, and the job that has finished by this line, or None.

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
        same = []
        unlike: dict[str, str] = {}
        not_made = []
        # by path, those of both folders, in the order of the jobs that made them
        for path in recorded.maker | recorded_again.maker:
            if path not in recorded_again.maker:
                not_made.append(path)
            elif recorded.digests([path]) == recorded_again.digests([path]):
                same.append(path)
            else:
                unlike[path] = _describe_difference(recorded.root / path, root / path)
    return Remade(same, unlike, not_made, recorded)


def _copy_settings(states: States, root: Path) -> Path:
    """Make a campaign in the folder `root`: copies of all its settings, a link to its logs, no results.

    Settings are all files beside the config, the run sheet and the files of the robot. Returns the path of the new config.
    """
    campaign = states.campaign
    config = campaign.root / next(iter(campaign.read_from))
    raw = campaign.raw.relative_to(campaign.root)
    # a config may lie at the top of the campaign, whose other folders are no settings
    is_at_top = config.parent == campaign.root
    paths = config.parent.iterdir() if is_at_top else config.parent.rglob("*")
    settings = [path for path in paths if path.is_file()]
    named_paths = [campaign.sheet, *(campaign.root / name for name in states.robot_digests)]
    for path in dict.fromkeys([*settings, *named_paths]):
        name = path.relative_to(campaign.root)
        if not name.is_relative_to(raw) and not name.is_relative_to(RESULTS):
            copy_file(path, root / name)
    link_folder(root / raw, campaign.raw.resolve())
    return root / config.relative_to(campaign.root)


# --- Where two files differ.


def _describe_difference(original: Path, remade: Path) -> str:
    """Say where a result differs from the same file that was made again, and by how much: of a table by cells, else by bytes."""
    if not original.is_file():
        return "not there"
    try:
        if original.suffix in (".csv", ".parquet"):
            tables = _read_text_rows(original), _read_text_rows(remade)
            if difference := _describe_table_difference(*tables):
                return difference
    except RftfitError as error:
        return f"damaged: {error}".replace(f"{original}: ", "")
    return _describe_byte_difference(original, remade)


TextRows = list[list[str]]
"""Rows of a table, each cell as text; the first row holds the names of the columns."""


def _read_text_rows(path: Path) -> TextRows:
    """Read a table, csv or Parquet, as texts: so a cell that was damaged and is no number any more can be compared, too."""
    if path.suffix == ".parquet":
        table = read_parquet(path)
        rows = table.astype(object).to_numpy().tolist()
        return [[*map(str, table.columns)], *([*map(str, row)] for row in rows)]
    try:
        return read_cells(path)
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: no UTF-8 text: byte {error.start}") from error


def _describe_table_difference(original: TextRows, remade: TextRows) -> str:
    """Say which cell of a table differs first, in reading order, how many do, and by how much; empty where all are equal.

    Lines are counted from 1, the header, as an editor does.
    """
    names = remade[0] if remade else []
    if original[:1] != remade[:1]:
        unshared_columns = sorted(set(names).symmetric_difference(original[0] if original else []))
        return f"other columns: {', '.join(unshared_columns) or 'in another order'}"
    # a damaged row may be shorter or longer than the others
    before, after = (pd.DataFrame(rows).fillna("") for rows in (original, remade))
    common_rows = before.index.intersection(after.index)
    # their first field is the row
    cells = sorted(find_changed_cells(before.loc[common_rows], after.loc[common_rows]))
    row_counts = f"{len(original) - 1} rows, {len(remade) - 1} made again"
    if not cells:
        return row_counts if len(original) != len(remade) else ""
    first = cells[0]
    column = names[first.column] if first.column < len(names) else f"column {first.column + 1}"
    sentence = f"line {first.row + 1}, {column}: {first.was!r}, made again {first.now!r}"
    if math.isfinite(first.share):
        sentence += f" ({100 * first.share:.2g} %)"
    if len(cells) > 1:
        sentence += f"; {len(cells)} cells differ"
        if shares := [cell.share for cell in cells if math.isfinite(cell.share)]:
            sentence += f", by {100 * max(shares):.2g} % at most"
    return f"{sentence}; {row_counts}" if len(original) != len(remade) else sentence


def _describe_byte_difference(original: Path, remade: Path) -> str:
    """Say which byte of a file differs first, counted from 1, and how many do; where lengths differ, both lengths."""
    was, now = (np.fromfile(path, np.uint8) for path in (original, remade))
    common_length = min(was.size, now.size)
    differing = np.flatnonzero(was[:common_length] != now[:common_length])
    first = 1 + (differing[0] if differing.size else common_length)
    if was.size != now.size:
        return f"{was.size} bytes, made again {now.size}; the first that differs is byte {first}"
    return f"{differing.size} of {now.size} bytes differ, the first is byte {first}"
