"""The robot's sweep: one profile over all its conditions, whole or as batches."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.load import load_campaign
from rftfit.errors import InputError
from rftfit.robot.run import Condition
from rftfit.robot.sensitivity import BEST_AT_HZ
from rftfit.robot.sweep import COLUMNS, PHASES_TURNS, paper_conditions, share
from rftfit.stages.robot import robot_of
from rftfit.stages.robot_profiles import robot_profile
from rftfit.stages.robot_store import Store, fill, forget_others
from rftfit.store import read_csv, write_csv
from rftfit.store.digest import code_digest, digest_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    import pandas as pd

SWEEPS = ("robot", "robot_full")
"""Folders of results: the reduced sweep of every run of the workflow, and the paper's own."""

EVERY = 4
"""The reduced sweep takes every fourth curvature and frequency."""

WHOLE = "1-of-1"
"""The batch that is the whole sweep."""

_FINE_FROM = 0.4


def conditions_of(sweep: str, measured: pd.DataFrame) -> list[Condition]:
    """Conditions of a sweep: its grid, and every measured condition.

    The full sweep has three starting phases. The reduced one has one (on the published measured
    table the others change the speed of no measured condition by 1 %), every fourth curvature and
    frequency, and at 5 Hz every curvature above 0.4, where the paper's best one lies.

    Parameters
    ----------
    sweep : str
        One of `SWEEPS`.
    measured : pandas.DataFrame
        Measured conditions.

    Returns
    -------
    list of Condition
        Each once, by curvature, frequency and phase.
    """
    if sweep not in SWEEPS:
        raise InputError(f"sweep: found {sweep!r}; allowed: {', '.join(SWEEPS)}")
    grid = paper_conditions(1)
    phases: tuple[float, ...] = PHASES_TURNS
    if sweep == SWEEPS[0]:
        phases = PHASES_TURNS[:1]
        fine = [
            c for c in grid if c.frequency_Hz == BEST_AT_HZ and c.curvature_times_R > _FINE_FROM
        ]
        grid = [c for c in [*paper_conditions(EVERY), *fine] if c.phase_turns in phases]
    known = measured[np.isfinite(measured["frequency_Hz"].to_numpy(float))]
    grid += [
        Condition(frequency, curvature, phase)
        for curvature, frequency in zip(
            known["curvature_times_R"], known["frequency_Hz"], strict=True
        )
        for phase in phases
    ]
    order = {(c.curvature_times_R, c.frequency_Hz, c.phase_turns): c for c in grid}
    return [order[place] for place in sorted(order)]


def robot_sweep(
    config: Path, profile: str, sweep: str, batch: str, threads: str, alpha: Path,
    coefficients: Path, measured: Path, parts: list[Path], runs: Path,
) -> None:  # fmt: skip
    """Run the robot at every condition of a sweep, or of a batch of it, on one profile.

    Finished runs are kept in ``results/robot/parts``, so that an interrupted sweep goes on.

    Parameters
    ----------
    config : Path
    profile, sweep : str
        One of `rftfit.stages.robot_profiles.PROFILES` and of `SWEEPS`.
    batch : str
        ``3-of-17``: only this share of the conditions; ``1-of-1``: all of them.
    threads : str
        Runs at once.
    alpha, coefficients, measured : Path
        Read: alpha table of the robot's medium, coefficients of all, measured conditions.
    parts : list of Path
        Read: tables of batches that are done, whose runs are not made again.
    runs : Path
        Written: a row for each run.

    Raises
    ------
    RftfitError
        If an input is not valid or the result cannot be written.
    """
    # into the log of the job: how far it is
    shown = -1

    def say(done: int, total: int) -> None:
        nonlocal shown
        if total and 10 * done // total > shown:
            shown = 10 * done // total
            sys.stderr.write(f"{profile}: {done} of {total} runs\n")
            sys.stderr.flush()

    if not (threads.isdecimal() and int(threads)):
        raise InputError(f"threads: found {threads!r}; allowed: 1, 2, 3 ...")
    made = swept(
        config, profile, sweep, alpha, coefficients, measured, say, int(threads), batch, parts
    )
    write_csv(made, runs)


def swept(
    config: Path, profile: str, sweep: str, alpha: Path, coefficients: Path, measured: Path,
    on_done: Callable[[int, int], None] | None = None, threads: int | None = None,
    batch: str = WHOLE, parts: Sequence[Path] = (),
) -> pd.DataFrame:  # fmt: skip
    """Do the work of `robot_sweep`; for whoever wants to see how far it is.

    Parameters
    ----------
    config : Path
    profile, sweep : str
    alpha, coefficients, measured : Path
        As for `robot_sweep`.
    on_done : callable, optional
        Told how many of how many runs are done.
    threads : int, optional
        Default: one for each core.
    batch : str, optional
    parts : sequence of Path, optional
        As for `robot_sweep`.

    Returns
    -------
    pandas.DataFrame
        `profile, medium`, then the columns of `rftfit.robot.sweep.speed_table`.
    """
    campaign = load_campaign(config)
    section, robot = robot_of(campaign)
    method = campaign.config.fourier.method
    made = robot_profile(profile, section.medium, read_csv(alpha), read_csv(coefficients), method)
    conditions = share(conditions_of(sweep, read_csv(measured)), batch)
    digest = digest_of(
        robot.model_dump(mode="json"),
        [part.tobytes().hex() for part in made.parameters],
        code_digest("rftfit.robot.sweep"),
    )
    store = Store.load(campaign.root / "results" / "robot" / "parts" / f"{profile}-{digest}")
    for path in parts:
        store.add(read_csv(path)[list(COLUMNS)])
    fill(store, robot, made, conditions, threads, on_done)
    forget_others(store.folder)
    table = store.table(conditions)
    table.insert(0, "profile", profile)
    table.insert(1, "medium", section.medium)
    return table
