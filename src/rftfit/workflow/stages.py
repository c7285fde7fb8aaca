"""What each rule of the workflow calls, and what its results depend on besides the files it reads.

Which files a rule reads and writes stands in ``workflow/rules``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

ALL = "*"
"""All sections of the configuration."""

MEDIUM_LOGS, ALL_LOGS = "medium", "all"
"""Values of `Stage.logs`: the logs of the job's medium (a job without medium: of the runs that belong to none), or every log."""

FIGURE_RULES = {"figure": "figures", "quality": "quality"}
"""Rules that draw what `rftfit.figures` declares, and their folders below ``results/``."""

PRINT_RULES = {f"{rule}_pdf": folder for rule, folder in FIGURE_RULES.items()}
"""Rules that draw the same figures as files for a paper, on demand, and their folders."""

FOLDER_BY_RULE = FIGURE_RULES | PRINT_RULES
"""Folders below ``results/`` by the rules that draw figures."""


@dataclass(frozen=True)
class Stage:
    """What a rule calls, and what its results depend on besides input files.

    `run`: ``module:function``. The function takes `Results` and the value of the rule's wildcard, where there is one,
        and returns the contents of the files that the rule writes, in their order.
    `wildcard`: Name of the rule's wildcard: ``medium``, ``runs`` (of the robot, by profile), or empty.
    `room`: The highest room of the package whose code the stage uses (`rftfit.store.digests.ROOMS`).
    `settings`: Sections of the configuration; `ALL` for all.
    `rows`: True where the stage reads the run sheet: the rows of its medium where it has one, else all.
    `order`: True where it reads the order of the plate runs of its medium.
    `logs`: `MEDIUM_LOGS` or `ALL_LOGS` where it reads logs.
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


_OF_LOGS = ("raw", "dialect", "force_log", "motion_log")
"""Sections by which logs are read."""
_OF_CLOCKS = (*_OF_LOGS, "transducer", "arm", "clock")
"""Sections on which the clocks of a run's logs depend."""
_OF_FITS = (
    *("force_log", "transducer", "container", "intruders", "fit", "errors", "table", "media"),
    "grid",
)
"""Sections on which the slope of a push depends."""
_OF_ROBOT = ("media", "robot")
"""Sections that every stage of the robot reads."""
_OF_ROBOT_RUNS = ("fit", "fourier", "grid", "maps")
"""Sections on which the alpha of a robot's run depends."""


def _measure_stage(
    rule: str, *settings: str, room: str = "measure", wildcard: str = "medium", **fields: Any
) -> Stage:
    """Declare a stage of `rftfit.workflow.measure`, whose function has the name of the rule: all read the run sheet."""
    run = f"rftfit.workflow.measure:{rule}"
    return Stage(run, room, settings, rows=True, wildcard=wildcard, **fields)


def _model_stage(module: str, rule: str, *settings: str, **fields: Any) -> Stage:
    """Declare a stage of another module of `rftfit.workflow` with the highest room ``compare``."""
    return Stage(f"rftfit.workflow.{module}:{rule}", "compare", settings, **fields)


def _robot_stage(rule: str, *settings: str, **fields: Any) -> Stage:
    """Declare a stage of `rftfit.workflow.robot`: all depend on the robot's files."""
    return _model_stage("robot", rule, *settings, *_OF_ROBOT, robot=True, **fields)


STAGES = {
    "clocks": _measure_stage("clocks", *_OF_CLOCKS, logs=MEDIUM_LOGS, estimated=True),
    "ingest": _measure_stage(
        "ingest",
        *_OF_CLOCKS,
        "zero",
        "surface",
        "rigid_contact",
        "intruders",
        "fit",
        logs=MEDIUM_LOGS,
    ),
    "tare": _measure_stage("tare", "fit", "force_log", "transducer"),
    "slopes": _measure_stage("slopes", *_OF_FITS),
    "checks": _measure_stage("checks", *_OF_FITS, "arm", "surface", room="compare", order=True),
    "legs": _measure_stage("legs", "force_log", "media", "transducer", room="checks"),
    "ledger": _measure_stage("ledger", *_OF_LOGS, "media", wildcard="", logs=MEDIUM_LOGS),
    "symmetry": _model_stage("profiles", "symmetry"),
    "fourier": _model_stage("profiles", "fourier", "fit", "fourier", "grid", "media"),
    "scaling": _model_stage("profiles", "scaling", "fit", "fourier", "grid", "media"),
    "legs_predicted": _model_stage(
        "validate",
        "legs_predicted",
        *("arm", "fit", "errors", "fourier", "grid", "intruders", "maps", "media"),
    ),
    "natural_sands": _model_stage(
        "validate", "natural_sands", *_OF_FITS, "surface", "fourier", rows=True
    ),
    "validate": _model_stage("validate", "validate", "grid", "media", rows=True),
    "robot_measured": _robot_stage("robot_measured", "raw"),
    "robot_runs": _robot_stage("robot_runs", *_OF_ROBOT_RUNS, wildcard="runs"),
    "robot_full_runs": _robot_stage(
        "robot_full_runs", *_OF_ROBOT_RUNS, wildcard="runs", on_demand=True
    ),
    "robot_intervals": _robot_stage("robot_intervals", *_OF_ROBOT_RUNS, "errors"),
    "robot_speeds": _robot_stage("robot_speeds", "fit"),
    "robot_full_speeds": _robot_stage("robot_full_speeds", "fit", on_demand=True),
    "robot_motion": _robot_stage("robot_motion", "fit", "grid", "maps"),
    "workbooks": Stage("rftfit.page.workbooks:workbooks", "page", ("fit", "media")),
    "page": Stage("rftfit.page.page:report", "page", (ALL,), rows=True),
    "provenance": Stage(
        "rftfit.workflow.provenance:provenance",
        "page",
        (ALL,),
        rows=True,
        logs=ALL_LOGS,
        robot=True,
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
"""Environment variable: names of the rules that one batch job of a cluster runs; where it is not set, any rule may come."""

LAST = "provenance"
"""The rule of the last job, which reads all results."""
