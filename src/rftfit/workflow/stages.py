"""What each rule of the workflow calls, and what its results depend on besides the files it reads.

Which files a rule reads and writes stands in ``workflow/rules``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

ALL = "*"
"""All sections of the configuration."""

OWN, EVERY = "own", "every"
"""Values of `Stage.logs`: the logs of the job's medium (of the runs of no medium, where the job has none), or every log."""

FIGURE_RULES = {"figure": "figures", "quality": "quality"}
"""Rules that draw what `rftfit.figures` declares, and their folders below ``results/``."""

PRINT_RULES = {f"{rule}_pdf": folder for rule, folder in FIGURE_RULES.items()}
"""Rules that draw the same figures as files for a paper, on demand, and their folders."""

FOLDER_BY_RULE = FIGURE_RULES | PRINT_RULES


@dataclass(frozen=True)
class Stage:
    """What a rule calls, and what its results depend on.

    `run`: ``module:function``. The function takes `Results` and the value of the rule's wildcard, where there is one,
        and returns the contents of the files that the rule writes, in their order.
    `wildcard`: Name of the rule's wildcard: ``medium``, ``runs`` (of the robot, by profile), or empty.
    `room`: The highest room of the package whose code the stage uses (`rftfit.store.digests.ROOMS`).
    `settings`: Sections of the configuration; `ALL` for all.
    `rows`: True where the stage reads the run sheet: the rows of its medium where it has one, else all.
    `order`: True where it reads the order of the plate runs of its medium.
    `logs`: `OWN` or `EVERY` where it reads logs.
    `robot`: True where it reads the robot's files.
    `estimated`: True where the stage exists only with ``clock.method: estimate``.
    `on_demand`: True where ``rftfit sweep`` or ``rftfit run --print`` makes the results, and not every ``rftfit run``.
    """

    run: str
    room: str
    settings: tuple[str, ...] = ()
    rows: bool = False
    order: bool = False
    logs: str = ""
    robot: bool = False
    estimated: bool = False
    on_demand: bool = False
    wildcard: str = ""


_NAMES = ("measure", "profiles", "validate", "robot")
_MEASURE, _PROFILES, _VALIDATE, _ROBOT = (f"rftfit.workflow.{name}" for name in _NAMES)


def _robot_stage(name: str, *settings: str, **fields: Any) -> Stage:
    """Declare a stage of the robot: it depends on the robot's files and on the sections ``media`` and ``robot``, too."""
    sections = (*settings, "media", "robot")
    return Stage(f"{_ROBOT}:{name}", "compare", sections, robot=True, **fields)


_OF_LOGS = ("raw", "dialect", "force_log", "motion_log")
"""Sections by which logs are read."""
_OF_FITS = ("force_log", "transducer", "container", "intruders", "fit", "errors", "table", "media")
"""Sections on which the slope of a push depends."""

STAGES = {
    "clocks": Stage(
        f"{_MEASURE}:clocks",
        "measure",
        rows=True,
        logs=OWN,
        settings=(*_OF_LOGS, "transducer", "arm", "clock"),
        estimated=True,
        wildcard="medium",
    ),
    "ingest": Stage(
        f"{_MEASURE}:ingest",
        "measure",
        rows=True,
        logs=OWN,
        settings=(
            *_OF_LOGS,
            "transducer",
            "zero",
            "arm",
            "clock",
            "surface",
            "rigid_contact",
            "intruders",
            "fit",
        ),
        wildcard="medium",
    ),
    "tare": Stage(
        f"{_MEASURE}:tare",
        "measure",
        ("fit", "force_log", "transducer"),
        rows=True,
        wildcard="medium",
    ),
    "slopes": Stage(
        f"{_MEASURE}:slopes", "measure", rows=True, settings=_OF_FITS, wildcard="medium"
    ),
    "checks": Stage(
        f"{_MEASURE}:checks",
        "compare",
        rows=True,
        order=True,
        settings=(*_OF_FITS, "arm", "surface", "grid"),
        wildcard="medium",
    ),
    "legs": Stage(
        f"{_MEASURE}:legs",
        "checks",
        ("force_log", "media", "transducer"),
        rows=True,
        wildcard="medium",
    ),
    "ledger": Stage(
        f"{_MEASURE}:ledger", "measure", rows=True, logs=OWN, settings=(*_OF_LOGS, "media")
    ),
    "symmetry": Stage(f"{_PROFILES}:symmetry", "compare"),
    "fourier": Stage(f"{_PROFILES}:fourier", "compare", ("fit", "fourier", "media")),
    "scaling": Stage(f"{_PROFILES}:scaling", "compare", ("fit", "fourier", "media")),
    "legs_predicted": Stage(
        f"{_VALIDATE}:legs_predicted",
        "compare",
        ("arm", "fit", "errors", "fourier", "intruders", "maps", "media"),
    ),
    "natural_sands": Stage(
        f"{_VALIDATE}:natural_sands",
        "compare",
        rows=True,
        settings=(*_OF_FITS, "surface", "fourier"),
    ),
    "validate": Stage(f"{_VALIDATE}:validate", "compare", ("media",), rows=True),
    "robot_measured": _robot_stage("robot_measured", "raw"),
    "robot_runs": _robot_stage("robot_runs", "fit", "fourier", "maps", wildcard="runs"),
    "robot_full_runs": _robot_stage(
        "robot_full_runs", "fit", "fourier", "maps", wildcard="runs", on_demand=True
    ),
    "robot_intervals": _robot_stage("robot_intervals", "fit", "errors", "fourier", "maps"),
    "robot_speeds": _robot_stage("robot_speeds", "fit"),
    "robot_full_speeds": _robot_stage("robot_full_speeds", "fit", on_demand=True),
    "robot_motion": _robot_stage("robot_motion", "maps"),
    "workbooks": Stage("rftfit.page.workbooks:workbooks", "page", ("fit", "media")),
    "page": Stage("rftfit.page.page:report", "page", (ALL,), rows=True),
    "provenance": Stage(
        "rftfit.workflow.provenance:provenance", "page", (ALL,), rows=True, logs=EVERY, robot=True
    ),
}
"""Stages by rule, in the order of the data's way. Figures are declared beside what draws them."""

RULES = (
    *[rule for rule in STAGES if STAGES[rule].room != "page"],
    *FIGURE_RULES,
    *PRINT_RULES,
    "workbooks",
    "page",
    "provenance",
)
"""All rules, in the order of the data's way."""

RULES_TO_COME = "RFTFIT_RULES"
"""Environment variable with the rules of a batch job of a cluster; where it is not set, any rule may come."""

LAST = "provenance"
"""The rule of the last job, which reads all results."""
