"""How often mistakes with cables, rows of the run sheet and rods are told by their cause, through whole files.

    make mixups                      10 campaigns of each mistake
    make mixups ARGS="30 --seed 5"   others

20 directions three times in random order, in five published media, with ordinary errors. Where the angle of the plate is
not measured, the motion log shows the path alone, and rods have no angle of their own.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

import numpy as np
import pandas as pd
from mistakes import CHANNELS, change, judged, of_logs, plates, some
from mutations import Written
from shared_causes import enact_in_random_order

from rftfit.errors import InputError
from rftfit.reference import MEDIA

Luck = np.random.Generator


def exchange_cables(campaign: Written, luck: Luck, where: str) -> None:
    """Exchange the cables of F2 and F3 in 30 % of the plate runs."""
    both = [*CHANNELS.values()]

    def exchange(log: np.ndarray) -> None:
        log[both] = log[both[::-1]]

    of_logs(campaign, some(plates(campaign), 0.3, luck, where), exchange)


def shift_columns(campaign: Written, _: Luck, columns: tuple[str, ...], first: float = 0.0) -> None:
    """Move cells of plate rows down by one row, in the last part of the sheet from a share `first` on."""
    rows = plates(campaign)
    rows = rows[round(first * len(rows)) :]
    cells = [{column: row[column] for column in columns} for row in rows]
    for row, moved in zip(rows, [cells[-1], *cells[:-1]], strict=True):
        row.update(moved)


def take_other_rods(campaign: Written, _: Luck, factor: float) -> None:
    """Let the rods of the rod runs bear so many times the force."""

    def enlarge(log: np.ndarray) -> None:
        zero = log[2:, :100].mean(axis=1, keepdims=True)
        log[2:] = zero + (log[2:] - zero) * factor

    for row in campaign.rows:
        if row["kind"] == "rod":
            change(campaign, row["force_log"], enlarge)


class Mixup(NamedTuple):
    """A mistake, whether the angle of the plate is measured, and codes of check or problem that name its cause."""

    make: Callable[[Written, Luck], None]
    has_angle: bool
    named_by: tuple[str, ...]


LOGS = ("force_log", "motion_log")
MIXUPS = {
    "F2 and F3 exchanged in 30 %, scattered": Mixup(
        partial(exchange_cables, where="random"), True, ("cause-axes",)
    ),
    "F2 and F3 exchanged in 30 %, in a row": Mixup(
        partial(exchange_cables, where="stretch"), True, ("cause-axes",)
    ),
    "logs shifted by a row": Mixup(partial(shift_columns, columns=LOGS), True, ("sheet-logs",)),
    "logs shifted by a row in the last half": Mixup(
        partial(shift_columns, columns=LOGS, first=0.5), True, ("sheet-logs",)
    ),
    "logs shifted by a row, no angle": Mixup(
        partial(shift_columns, columns=LOGS), False, ("sheet-logs", "sheet-rows")
    ),
    "beta shifted by a row": Mixup(
        partial(shift_columns, columns=("beta_deg",)), True, ("sheet.column-shifted", "sheet-logs")
    ),
    "beta shifted by a row, no angle": Mixup(
        partial(shift_columns, columns=("beta_deg",)), False, ("sheet-beta",)
    ),
    "rods of 2.5 times the force": Mixup(
        partial(take_other_rods, factor=2.5), True, ("rods-other",)
    ),
    "rods of 0.4 times the force": Mixup(
        partial(take_other_rods, factor=0.4), True, ("rods-other-small",)
    ),
}


def judge(job: tuple[int, int, str]) -> dict[str, object]:
    """Whether a mistake is told, by its cause, and what else fails."""
    seed, number, name = job
    mixup = MIXUPS[name]
    campaign = enact_in_random_order(MEDIA[number % len(MEDIA)], 1000 * seed + number)
    if not mixup.has_angle:
        campaign.config["arm"]["angle_tolerance_deg"] = 90
        for row in campaign.rows:
            if row["kind"] == "rod":
                row["beta_deg"] = ""
    mixup.make(campaign, np.random.default_rng([seed, number]))
    try:
        checks = judged(campaign).checks
    except InputError as error:
        codes = {problem.code for problem in getattr(error, "problems", ())}
        return {
            "mistake": name,
            "told": True,
            "by its cause": bool(codes & {*mixup.named_by}),
            "failed": "refused",
        }
    failed = checks[checks["verdict"] == "failed"]
    named = {*failed["code"]}
    # a cause of the check of channels is named in its words alone
    if "cause-axes" in mixup.named_by and "exchanged" in " ".join(
        failed.loc[failed["check"] == "channels", "found"]
    ):
        named.add("cause-axes")
    return {
        "mistake": name,
        "told": len(failed) > 0,
        "by its cause": bool(named & {*mixup.named_by}),
        "failed": " ".join(failed["code"]),
    }


def main() -> int:
    """Print a row of each mistake."""
    parser = argparse.ArgumentParser(prog="make mixups", description=__doc__)
    parser.add_argument("campaigns", type=int, nargs="?", default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    jobs = [(options.seed, number, name) for name in MIXUPS for number in range(options.campaigns)]
    with Pool(options.processes) as pool:
        rows = pd.DataFrame(pool.map(judge, jobs, chunksize=1))
    for name, of_mistake in rows.groupby("mistake", sort=False):
        codes = of_mistake["failed"].value_counts()
        print(
            f"{name:45} told {of_mistake['told'].sum():3} by its cause {of_mistake['by its cause'].sum():3} of {len(of_mistake)}   "
            + ", ".join(f"{code or 'nothing'} {count}" for code, count in codes.items())
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
