"""The robot on the page: its tables, and the curves and pictures for the script."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pandas as pd

from rftfit.errors import InputError
from rftfit.figures.labels import name_of, percent, span
from rftfit.figures.style import number
from rftfit.page.cells import Cell, Column, Row, Table, number_column, records, text_column
from rftfit.page.live import as_lists
from rftfit.results import Results
from rftfit.robot.speeds import count_within_alpha_error, share_within

DIGITS = 5
CURVATURE = "R\N{PRIME}/r"
_PROFILE = text_column("Profile", lambda row: name_of(row["profile"]))


def robot_tables(results: Results) -> dict[str, Table] | None:
    """Make the tables of the section by their names; None where the campaign has no robot."""
    if not results.campaign.robot_medium:
        return None
    errors, optimum = (results.table(f"robot/{name}.csv") for name in ("errors", "optimum"))
    return {"shares": _shares(errors), "best": _best(optimum), "conditions": _conditions(errors)}


def robot_facts(results: Results) -> dict[str, Any]:
    """What the sentences of the section rest on; nothing where the campaign has no robot."""
    if not results.campaign.robot_medium:
        return {}
    errors = results.table("robot/errors.csv")
    return {
        "measured": errors["measured_cm_per_s"].notna().any(),
        "calibrated": (errors["calibrated"] == "yes").any(),
        "intervals": errors["simulated_from_alpha_lo_cm_per_s"].notna().any(),
        "on": name_of(_frames(results).get("profile", "table")),
    }


def _shares(errors: pd.DataFrame) -> Table:
    """How many conditions come near, of all and of those that the robot was not calibrated on."""
    parts = {str(name): part for name, part in errors.groupby("profile", sort=False)}

    def within(heading: str, percents: float) -> Column:
        def cell(row: Row) -> Cell:
            part = parts[row["profile"]]
            new = part[part["calibrated"] == "no"]
            found, others = (
                "{} of {}".format(*share_within(some, percents)) for some in (part, new)
            )
            return Cell(found, (f"predicted: {others}",))

        return Column(heading, cell, "num")

    def held(row: Row) -> Cell:
        found, known = count_within_alpha_error(parts[row["profile"]])
        return Cell(f"{found} of {known}" if known else "no value")

    return Table(
        "Share of the conditions",
        [
            _PROFILE,
            within("speed within 20 %", 20),
            within("within 35 %", 35),
            Column("within the errors of \N{GREEK SMALL LETTER ALPHA} alone", held, "num"),
        ],
        [{"profile": name} for name in parts],
    )


def _best(optimum: pd.DataFrame) -> Table:
    highest = optimum.groupby("profile", sort=False)["frequency_Hz"].idxmax()
    return Table(
        "Best curvature",
        [
            _PROFILE,
            number_column("Stride frequency, Hz", "frequency_Hz", 1),
            number_column(
                f"Fastest {CURVATURE}",
                "best_curvature_times_R",
                2,
                ends="best_curvature_from_alpha_{}",
            ),
            number_column("Its speed, cm/s", "speed_cm_per_s", 1),
            text_column("Calibrated", "calibrated"),
        ],
        records(optimum.loc[highest.to_list()]),
    )


def _conditions(errors: pd.DataFrame) -> Table:
    """Measured speed of every condition beside those simulated on each profile."""
    simulated = {(row["condition"], row["profile"]): row for row in records(errors)}
    ordered = errors.sort_values(["curvature_times_R", "frequency_Hz"], kind="stable")

    def measured(row: Row) -> Cell:
        sd = row["measured_sd_cm_per_s"]
        return Cell(
            number(row["measured_cm_per_s"], 1),
            (f"s.d. {number(sd, 1)}" if np.isfinite(sd) else "",),
        )

    def speed(profile: str) -> Column:
        def cell(row: Row) -> Cell:
            one = simulated.get((row["condition"], profile), {})
            lo, hi = (one.get(f"simulated_from_alpha_{end}_cm_per_s") for end in ("lo", "hi"))
            note = "; ".join(
                filter(None, (percent(one.get("error_percent")), one.get("reason", "")))
            )
            return Cell(number(one.get("simulated_cm_per_s"), 1), (span(lo, hi, 1), note))

        return Column(f"{name_of(profile)}, cm/s", cell, "num")

    return Table(
        "Measured and simulated speeds",
        [
            number_column(CURVATURE, "curvature_times_R", 2),
            number_column("Hz", "frequency_Hz", 2),
            Column("Measured, cm/s", measured, "num"),
            *(speed(str(profile)) for profile in errors["profile"].unique()),
            text_column("Calibrated", "calibrated"),
        ],
        records(ordered.drop_duplicates("condition")),
        tall=True,
    )


def robot_data(results: Results) -> dict[str, Any] | None:
    """Collect the curves and pictures that the script draws; None where there is no robot."""
    if not results.campaign.robot_medium:
        return None
    measured = results.table("robot/errors.csv").drop_duplicates("condition")
    curvatures = sorted(set(measured["curvature_times_R"].tolist()) or {-1.0, 0.0, 1.0})
    curves: dict[str, list[dict[str, Any]]] = {}
    for name, part in results.table("robot/speed.csv").groupby("profile", sort=False):
        curves[str(name)] = []
        for curvature in curvatures:
            own = part[np.isclose(part["curvature_times_R"], curvature)]
            mean = own.groupby("frequency_Hz")["speed_cm_per_s"].mean()
            f, v = mean.index.to_numpy(float), mean.to_numpy(float)
            curves[str(name)].append(
                {"curvature": curvature, "f": as_lists(f, DIGITS), "v": as_lists(v, DIGITS)}
            )
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
    """Geometry and poses of a few runs."""
    path = results.path("robot/frames.json")
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
