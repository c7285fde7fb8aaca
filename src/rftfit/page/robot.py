"""The robot on the page: its tables of speeds, and the curves and moving pictures that the script draws.

`errors`: Rows of ``results/robot/errors.csv``, one for each measured condition (leg curvature R'/r and stride
frequency, Hz) on each profile, the alpha with which the robot was simulated: measured and simulated speed, cm/s, the
latter with its intervals, and ``calibrated``, "yes" where unknown lengths of the robot were fitted to this condition.

`Results` is a campaign with its tables: `results.table(name)` reads a table below ``results/``.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from rftfit.errors import InputError
from rftfit.figures.labels import name_of, percent
from rftfit.figures.style import format_number
from rftfit.page.cells import Cell, PageColumn, PageTable, Row, numbers, records, texts
from rftfit.page.live import as_lists
from rftfit.results import Results
from rftfit.robot.speeds import count_inside, share_within

DIGITS = 5
"""Significant digits of the numbers that the script draws."""

CURVATURE = "R\N{PRIME}/r"
"""Symbol of the leg curvature in headings."""
_PROFILE = texts("Profile", lambda row: name_of(row["profile"]))
"""Column with the name of the profile of a row."""


def robot_tables(results: Results) -> dict[str, PageTable] | None:
    """Make the tables of the section on the robot, by their names in the template; None where the campaign has no robot."""
    if not results.campaign.robot_medium:
        return None
    errors, optimum = (results.table(f"robot/{name}.csv") for name in ("errors", "optimum"))
    return {
        "shares": _tabulate_shares(errors),
        "best": _tabulate_best(optimum),
        "conditions": _tabulate_conditions(errors),
    }


def robot_facts(results: Results) -> dict[str, Any]:
    """Collect the facts from which the template chooses its sentences; empty where the campaign has no robot.

    True or False: ``measured`` (any speed), ``calibrated`` (on any condition), ``intervals`` (of any speed). ``on``:
    name of the profile of the moving pictures.
    """
    if not results.campaign.robot_medium:
        return {}
    errors = results.table("robot/errors.csv")
    return {
        "measured": errors["measured_cm_per_s"].notna().any(),
        "calibrated": (errors["calibrated"] == "yes").any(),
        "intervals": errors["simulated_from_alpha_lo_cm_per_s"].notna().any(),
        "on": name_of(_frames(results).get("profile", "table")),
    }


def _tabulate_shares(errors: pd.DataFrame) -> PageTable:
    """Count, for each profile, the conditions whose simulated speed is near the measured one.

    A second number leaves out the conditions on which the robot was calibrated: the others are predictions.
    """
    errors_by_profile = {str(name): rows for name, rows in errors.groupby("profile", sort=False)}

    def shares(heading: str, count_of: Callable[[pd.DataFrame], tuple[int, int]]) -> PageColumn:
        """Make the column of cells "n of m"; `count_of`: function that returns both numbers of some rows of `errors`."""

        def cell(row: Row) -> Cell:
            rows_of_profile = errors_by_profile[row["profile"]]
            uncalibrated = rows_of_profile[rows_of_profile["calibrated"] == "no"]
            counts = [count_of(rows) for rows in (rows_of_profile, uncalibrated)]
            if not counts[0][1]:
                return Cell("no value")
            share_of_all, share_of_predicted = (f"{count} of {total}" for count, total in counts)
            return Cell(share_of_all, (f"predicted: {share_of_predicted}",))

        return PageColumn(heading, cell, "num")

    columns = [
        _PROFILE,
        shares("speed within 20 %", lambda rows: share_within(rows, 20)),
        shares("within 35 %", lambda rows: share_within(rows, 35)),
        shares(
            "within the errors of \N{GREEK SMALL LETTER ALPHA} alone",
            lambda rows: count_inside(rows, "simulated_from_alpha"),
        ),
        shares("with the model's own error", lambda rows: count_inside(rows, "simulated_model")),
    ]
    return PageTable(
        "Share of the conditions", columns, [{"profile": name} for name in errors_by_profile]
    )


def _tabulate_best(optimum: pd.DataFrame) -> PageTable:
    """Tabulate the fastest curvature of each profile at its highest frequency.

    `optimum`: Rows of ``results/robot/optimum.csv``, one for each frequency on each profile.
    """
    highest = optimum.groupby("profile", sort=False)["frequency_Hz"].idxmax()
    best = "best_curvature_times_R", 2, "best_curvature_from_alpha_{}"
    columns = [
        _PROFILE,
        numbers("Stride frequency, Hz", "frequency_Hz", 1),
        numbers(f"Fastest {CURVATURE}", *best),
        numbers("Its speed, cm/s", "speed_cm_per_s", 1),
        texts("Calibrated", "calibrated"),
    ]
    return PageTable("Best curvature", columns, records(optimum.loc[highest.to_list()]))


def _tabulate_conditions(errors: pd.DataFrame) -> PageTable:
    """Tabulate the measured speed of every condition beside the speeds simulated on each profile, a column a profile.

    In small print the intervals of the simulated speed, its error, and why a number is missing.
    """
    simulated = {(row["condition"], row["profile"]): row for row in records(errors)}
    ordered = errors.sort_values(["curvature_times_R", "frequency_Hz"], kind="stable")

    simulated_speed = numbers(
        "",
        "simulated_cm_per_s",
        1,
        ends="simulated_from_alpha_{}_cm_per_s",
        ends_of_model="simulated_model_{}_cm_per_s",
    )

    def measured(row: Row) -> Cell:
        """Make the cell of the measured speed, with its standard deviation."""
        sd = row["measured_sd_cm_per_s"]
        note = f"s.d. {format_number(sd, 1)}" if np.isfinite(sd) else ""
        return Cell(format_number(row["measured_cm_per_s"], 1), (note,))

    def speed(profile: str) -> PageColumn:
        """Make the column of speeds simulated on one profile."""

        def cell(row: Row) -> Cell:
            simulated_row = simulated.get((row["condition"], profile), {})
            number = simulated_speed.cell(simulated_row)
            notes = percent(simulated_row.get("error_percent")), simulated_row.get("reason", "")
            return Cell(number.text, (*number.notes, "; ".join(filter(None, notes))))

        return PageColumn(f"{name_of(profile)}, cm/s", cell, "num")

    columns = [
        numbers(CURVATURE, "curvature_times_R", 2),
        numbers("Hz", "frequency_Hz", 2),
        PageColumn("Measured, cm/s", measured, "num"),
        *(speed(str(profile)) for profile in errors["profile"].unique()),
        texts("Calibrated", "calibrated"),
    ]
    rows = records(ordered.drop_duplicates("condition"))
    return PageTable("Measured and simulated speeds", columns, rows, tall=True)


def robot_data(results: Results) -> dict[str, Any] | None:
    """Collect the curves and pictures that the script draws; None where the campaign has no robot.

    ``curves``: by profile a list over curvatures, each with frequencies ``f`` (Hz) and mean speeds over starting phases
    ``v`` (cm/s, None if not steady). ``measured``: lists over conditions. ``frames``: moving pictures, of `_frames`.
    """
    if not results.campaign.robot_medium:
        return None
    measured = results.table("robot/errors.csv").drop_duplicates("condition")
    curvatures = sorted(set(measured["curvature_times_R"].tolist()) or {-1.0, 0.0, 1.0})
    curves: dict[str, list[dict[str, Any]]] = {}
    for name, rows_of_profile in results.table("robot/speed.csv").groupby("profile", sort=False):
        curves[str(name)] = []
        for curvature in curvatures:
            is_of_leg = np.isclose(rows_of_profile["curvature_times_R"], curvature)
            mean = rows_of_profile[is_of_leg].groupby("frequency_Hz")["speed_cm_per_s"].mean()
            curve = {
                "curvature": curvature,
                "f": as_lists(mean.index.to_numpy(float), DIGITS),
                "v": as_lists(mean.to_numpy(float), DIGITS),
            }
            curves[str(name)].append(curve)
    names = ("curvature_times_R", "frequency_Hz", "measured_cm_per_s", "measured_sd_cm_per_s")
    points = {name: as_lists(measured[name].to_numpy(float), DIGITS) for name in names}
    points["calibrated"] = (measured["calibrated"] == "yes").tolist()
    return {
        "profiles": {name: name_of(name) for name in curves},
        "curves": curves,
        "measured": points,
        "frames": _frames(results),
    }


def _frames(results: Results) -> Any:
    """Read the geometry and the poses of a few runs, with the forces on their elements rounded, for a smaller page.

    What is in them says `rftfit.robot.motion.frames_of`.
    """
    path = results.path("robot/frames.json")
    try:
        frames = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
    for run in frames.get("runs", []):
        # each arrow is four numbers, the last two its force in mN: a tenth of a mN could not be seen
        run["arrows"] = [
            [round(number) if i % 4 > 1 else number for i, number in enumerate(arrows)]
            for arrows in run["arrows"]
        ]
    return frames
