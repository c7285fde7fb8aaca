"""Table of rules: the function that each rule calls, and what its results depend on besides the files it reads.

A rule (Snakemake) makes some files of ``results/`` from others; which ones stands in ``workflow/rules/*.smk``. Most rules
have a wildcard, such as ``{medium}``, and are carried out once for each of its values: each time is a job. The function
that a rule calls is its stage. A change of code, settings, run sheet or logs must make results again, and Snakemake does
not see it: so the table names for each stage what of these it uses, and `rftfit.workflow.state` watches it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

ALL = "*"
"""Value in `Stage.settings`: all sections of the configuration."""

MEDIUM_LOGS, ALL_LOGS = "medium", "all"
"""Values of `Stage.logs`: the logs of the job's medium (a job without medium: of the runs that belong to none), or every log."""


@dataclass(frozen=True)
class Stage:
    """What a rule calls, and what its results depend on besides input files.

    `run`: ``module:function``. The function takes `Results` and the value of the rule's wildcard, where there is one,
        and returns the contents of the files that the rule writes, in their order.
    `room`: The highest room of the package whose code the stage uses (`rftfit.store.digests.ROOMS`). Rooms import only
        lower ones, so results depend on the code of this room and of all below it.
    `settings`: Names of the sections of the configuration that it reads; `ALL` for all.
    `rows`: True where the stage reads the run sheet: the rows of its medium where it has one, else all.
    `order`: True where it reads the order of the plate runs of its medium, which `rows` leaves out.
    `logs`: `MEDIUM_LOGS` or `ALL_LOGS` where it reads logs; empty where it reads none.
    `robot`: True where it reads the robot's files: its description, its run sheet and its marker tracks.
    `estimated`: True where the stage exists only with ``clock.method: estimate``.
    `on_demand`: True where ``rftfit sweep`` or ``rftfit run --print`` makes the results, and not every ``rftfit run``.
    `wildcard`: Name of the rule's wildcard: ``medium``; ``runs`` (its values are ``runs_`` with the name of a profile that
        the robot runs on, as ``runs_map``); or empty.
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


# sections of the configuration that several stages read

_OF_LOGS = ("raw", "dialect", "force_log", "motion_log")
"""Sections by which logs are read."""
_OF_CLOCKS = (*_OF_LOGS, "transducer", "arm", "clock")
"""Sections on which the clocks of a run's logs depend."""
_OF_FITS = (
    "force_log",
    "transducer",
    "container",
    "intruders",
    "fit",
    "errors",
    "table",
    "media",
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
    """Declare a stage of `rftfit.workflow.measure`: its function has the name of the rule, and it reads the run sheet.

    `settings`: Sections of the configuration. `fields`: Further fields of `Stage`.
    """
    run = f"rftfit.workflow.measure:{rule}"
    return Stage(run, room, settings, rows=True, wildcard=wildcard, **fields)


def _model_stage(module: str, rule: str, *settings: str, **fields: Any) -> Stage:
    """Declare a stage of another module of `rftfit.workflow`, whose function has the name of the rule.

    Their highest room is ``compare``. `settings`, `fields`: As in `_measure_stage`.
    """
    return Stage(f"rftfit.workflow.{module}:{rule}", "compare", settings, **fields)


def _robot_stage(rule: str, *settings: str, **fields: Any) -> Stage:
    """Declare a stage of `rftfit.workflow.robot`: it reads the robot's files, and `_OF_ROBOT` besides its `settings`."""
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
        "arm",
        "fit",
        "errors",
        "fourier",
        "grid",
        "intruders",
        "maps",
        "media",
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
"""Stages by rule, in the order in which data pass through them; without figures, which are declared in `rftfit.figures`."""

FIGURE_RULES = {"figure": "figures", "quality": "quality"}
"""Rules that draw the figures of `rftfit.figures` for the screen (png, webp), with their folders below ``results/``."""

PRINT_RULES = {f"{rule}_pdf": folder for rule, folder in FIGURE_RULES.items()}
"""Rules that draw the same figures as pdf for a paper, on demand, with their folders: ``figure_pdf``, ``quality_pdf``."""

FOLDER_BY_RULE = FIGURE_RULES | PRINT_RULES
"""Folders below ``results/`` by the rules that draw figures."""

RULES = (
    *[rule for rule in STAGES if STAGES[rule].room != "page"],
    *FIGURE_RULES,
    *PRINT_RULES,
    "workbooks",
    "page",
    "provenance",
)
"""All rules with stages, in the order in which data pass through them: whatever reads a result comes behind its maker."""

RULES_TO_COME = "RFTFIT_RULES"
"""Environment variable: names of the rules that one batch job of a cluster runs, with blanks; not set: any rule may come."""

LAST = "provenance"
"""Rule of the last job of a whole run: it reads all results, so that asking for it asks for every job."""
