"""Finished runs of a sweep, kept as they come, so that an interrupted sweep goes on from there."""

from __future__ import annotations

import shutil
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rftfit.errors import InputError
from rftfit.robot.sweep import COLUMNS, run_all, speed_table
from rftfit.store import read_csv, write_csv

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    import pandas as pd

    from rftfit.profile.base import Profile
    from rftfit.robot.config import Robot
    from rftfit.robot.run import Condition, Run

FLUSH_S = 2.0
"""What is finished is written at least this often: a killed sweep loses no more."""

_TEXTS = ("outcome", "reason", "warning")


@dataclass
class Store:
    """A folder with one table for each curvature.

    Attributes
    ----------
    folder : Path
        Its name carries a digest of all that the runs depend on but their conditions.
    rows : dict of (float, float, float) to tuple
        Curvature, frequency (Hz) and phase (turns) of a finished run to its row of the table.
    """

    folder: Path
    rows: dict[tuple[float, float, float], tuple[object, ...]] = field(default_factory=dict)

    @classmethod
    def load(cls, folder: Path) -> Store:
        """Read what is finished.

        Parameters
        ----------
        folder : Path
            It need not exist. A damaged table counts as not finished.

        Returns
        -------
        Store
        """
        store = cls(folder)
        for path in sorted(folder.glob("*.csv")):
            try:
                table = read_csv(path)
            except InputError:
                continue
            if list(table.columns) == list(COLUMNS):
                store.add(table)
        return store

    def add(self, table: pd.DataFrame) -> None:
        """Take in finished runs.

        Parameters
        ----------
        table : pandas.DataFrame
            Columns of `rftfit.robot.sweep.speed_table`.
        """
        table = table.fillna(dict.fromkeys(_TEXTS, ""))
        for row in table.itertuples(index=False, name=None):
            self.rows[key_of(*row[:3])] = row

    def write(self, curvatures: set[float]) -> None:
        """Write the tables of some curvatures.

        Parameters
        ----------
        curvatures : set of float

        Raises
        ------
        OutputError
            If one cannot be written.
        """
        for curvature in sorted(curvatures):
            own = [self.rows[key] for key in sorted(self.rows) if key[0] == curvature]
            write_csv(_frame(own), self.folder / f"curvature_{curvature:+.6g}.csv")

    def table(self, conditions: Sequence[Condition]) -> pd.DataFrame:
        """Table of some runs, all of them finished.

        Parameters
        ----------
        conditions : sequence of Condition

        Returns
        -------
        pandas.DataFrame
        """
        return _frame([self.rows[key(one)] for one in conditions])


def key(condition: Condition) -> tuple[float, float, float]:
    """Name of a run in the store.

    Parameters
    ----------
    condition : Condition

    Returns
    -------
    tuple of float
    """
    return key_of(condition.curvature_times_R, condition.frequency_Hz, condition.phase_turns)


def key_of(*numbers: float) -> tuple[float, float, float]:
    """Round curvature, frequency and phase to what a table keeps.

    Parameters
    ----------
    *numbers : float

    Returns
    -------
    tuple of float
    """
    curvature, frequency, phase = (float(f"{number:.6g}") + 0.0 for number in numbers)
    return curvature, frequency, phase


def fill(
    store: Store,
    robot: Robot,
    profile: Profile,
    conditions: Sequence[Condition],
    threads: int | None = None,
    on_done: Callable[[int, int], None] | None = None,
) -> None:
    """Run what is not finished yet, and keep it as it comes.

    Parameters
    ----------
    store : Store
    robot : Robot
    profile : Profile
    conditions : sequence of Condition
    threads : int, optional
    on_done : callable, optional
        Told how many of how many runs are done, before the first and after each.

    Raises
    ------
    OutputError
        If the store cannot be written.
    """
    waiting = [one for one in conditions if key(one) not in store.rows]
    done, unsaved, saved_at = len(conditions) - len(waiting), set[float](), time.monotonic()
    if on_done is not None:
        on_done(done, len(conditions))

    def keep(_: int, run: Run) -> None:
        nonlocal done, saved_at
        store.add(speed_table([run]))
        unsaved.add(key(run.condition)[0])
        done += 1
        if on_done is not None:
            on_done(done, len(conditions))
        if time.monotonic() - saved_at > FLUSH_S:
            store.write(unsaved)
            unsaved.clear()
            saved_at = time.monotonic()

    try:
        run_all(robot, profile, waiting, threads, keep)
    finally:
        # also where it was interrupted
        store.write(unsaved)


def forget_others(folder: Path) -> None:
    """Remove stores of the same profile that belong to another robot, profile or program.

    Parameters
    ----------
    folder : Path
        The store to keep; its name is ``<profile>-<digest>``.
    """
    stem = folder.name.rpartition("-")[0]
    for other in folder.parent.glob(f"{stem}-*"):
        if other != folder and other.is_dir():
            shutil.rmtree(other, ignore_errors=True)


def _frame(rows: list[tuple[object, ...]]) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame(rows, columns=list(COLUMNS))
