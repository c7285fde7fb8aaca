"""The stages of the workflow, declared once: rules, records, page and documentation follow from here.

A stage works on one or more tasks: one for each medium, one for each figure, or a single one. A task
reads and writes files below ``results/``; what else its results depend on (code, settings, rows of the
run sheet, logs) is known by digests.
"""

from __future__ import annotations

from dataclasses import dataclass

from rftfit.figures.registry import SWEEP

_MEASURE, _PROFILES, _VALIDATE, _ROBOT = (
    f"rftfit.workflow.{name}" for name in ("measure", "profiles", "validate", "robot")
)
ALL = "*"
"""All sections of the configuration."""


@dataclass(frozen=True)
class Stage:
    """One stage: what it reads and writes, and what it depends on.

    `run`: ``module:function``. It takes `Results` and the name of the medium, where there is one, and
        returns the contents of `writes`, in their order.
    `writes`, `reads`: Below ``results/``. ``{medium}`` is the task's own; ``{media}``,
        ``{laboratory}``, ``{sands}`` stand for all of these, ``{robot}`` for the robot's medium.
        ``*`` stands for all that earlier stages write, ``*.csv`` for all with this ending.
        What no stage of a campaign writes, none of its stages reads.
    `each`: ``media``: a task for each of them; empty: a single task.
    `settings`: Sections of the configuration; `ALL` for all.
    `rows`, `logs`: Whether it reads the run sheet, and logs: of its medium where it has one, else of
        the runs that belong to no medium.
    `robot`: Whether it needs a robot, and reads its files.
    """

    name: str
    run: str
    writes: tuple[str, ...]
    reads: tuple[str, ...] = ()
    each: str = ""
    settings: tuple[str, ...] = ()
    rows: bool = False
    logs: bool = False
    robot: bool = False


STAGES = (
    Stage(
        "ingest", f"{_MEASURE}:ingest", each="media", rows=True, logs=True,
        writes=("traces/{medium}.parquet", "runs/{medium}.csv", "ledger/ingest/{medium}.csv"),
        settings=("raw", "dialect", "force_log", "motion_log", "transducer", "zero", "arm", "clock",
                  "surface", "rigid_contact", "intruders", "fit"),
    ),
    Stage(
        "tare", f"{_MEASURE}:tare", each="media", rows=True, settings=("fit",),
        reads=("traces/{medium}.parquet", "runs/{medium}.csv"),
        writes=("tared/{medium}.parquet", "tares/{medium}.csv", "ledger/tare/{medium}.csv"),
    ),
    Stage(
        "slopes", f"{_MEASURE}:slopes", each="media", rows=True,
        reads=("runs/{medium}.csv", "tared/{medium}.parquet", "tares/{medium}.csv"),
        writes=("fits/{medium}.csv", "windows/{medium}.parquet", "ledger/slopes/{medium}.csv"),
        settings=("force_log", "transducer", "container", "intruders", "fit", "table", "media"),
    ),
    Stage(
        "checks", f"{_MEASURE}:checks", each="media", rows=True,
        reads=("runs/{medium}.csv", "tares/{medium}.csv", "fits/{medium}.csv",
               "tared/{medium}.parquet", "windows/{medium}.parquet"),
        writes=("checks/{medium}.csv", "alpha/{medium}.csv"),
        settings=("force_log", "transducer", "arm", "surface", "fit", "errors", "grid", "table",
                  "media"),
    ),
    Stage(
        "legs", f"{_MEASURE}:legs", each="media", rows=True, settings=("fit", "media"),
        reads=("checks/{medium}.csv", "runs/{medium}.csv", "tared/{medium}.parquet"),
        writes=("legs/{medium}.csv", "ledger/legs/{medium}.csv"),
    ),
    Stage(
        "symmetry", f"{_PROFILES}:symmetry",
        reads=("alpha/{laboratory}.csv",), writes=("alpha_extended.csv",),
    ),
    Stage(
        "maps", f"{_PROFILES}:maps", each="media", settings=("fit", "fourier", "maps", "media"),
        reads=("checks/{media}.csv", "alpha/{laboratory}.csv", "alpha/{sands}.csv"),
        writes=("maps/{medium}.csv",),
    ),
    Stage(
        "fourier", f"{_PROFILES}:fourier", settings=("fit", "fourier", "media"),
        reads=("checks/{media}.csv", "alpha/{laboratory}.csv"),
        writes=("fourier/media.csv", "fourier/terms.csv"),
    ),
    Stage(
        "scaling", f"{_PROFILES}:scaling", settings=("fit", "fourier", "media"),
        reads=("checks/{media}.csv", "alpha/{laboratory}.csv", "alpha/{sands}.csv", "fourier/media.csv"),
        writes=("coefficients.csv", "penetration.csv"),
    ),
    Stage(
        "legs_predicted", f"{_VALIDATE}:legs_predicted",
        settings=("arm", "fit", "errors", "fourier", "intruders", "maps", "media"),
        reads=("checks/{media}.csv", "alpha/{laboratory}.csv", "alpha/{sands}.csv", "legs/{media}.csv"),
        writes=("predicted.csv", "leg_errors.csv", "leg_sensitivity.csv"),
    ),
    Stage(
        "natural_sands", f"{_VALIDATE}:natural_sands", rows=True,
        settings=("force_log", "transducer", "surface", "fit", "errors", "fourier", "intruders",
                  "media", "table"),
        reads=("runs/{sands}.csv", "tares/{sands}.csv", "fits/{sands}.csv", "alpha/{sands}.csv",
               "tared/{sands}.parquet", "penetration.csv", "legs/{sands}.csv", "predicted.csv",
               "checks/{media}.csv"),
        writes=("sands.csv", "sand_correction.csv"),
    ),
    Stage(
        "robot_measured", f"{_ROBOT}:robot_measured", robot=True,
        settings=("raw", "media", "robot"),
        writes=("robot/tracks.csv", "robot/measured.csv", "robot/strides.csv", "ledger/robot.csv"),
    ),
    Stage(
        "robot_sweep", f"{_ROBOT}:robot_sweep", robot=True,
        settings=("fit", "errors", "fourier", "media", "robot"),
        reads=("checks/{media}.csv", "alpha/{laboratory}.csv", "robot/measured.csv"),
        writes=("robot/runs_table.csv", "robot/runs_map.csv", "robot/runs_generic.csv", "robot/runs_depth_only.csv",
                "robot/intervals.csv", "robot/speed.csv", "robot/optimum.csv", "robot/errors.csv"),
    ),
    Stage(
        "robot_full", f"{_ROBOT}:robot_full", robot=True,
        settings=("fit", "fourier", "maps", "media", "robot"),
        reads=("alpha/{laboratory}.csv", "coefficients.csv", "robot/measured.csv",
               "robot/intervals.csv", "checks/{media}.csv"),
        writes=("robot_full/runs_table.csv", "robot_full/runs_map.csv", "robot_full/runs_generic.csv",
                "robot_full/runs_depth_only.csv", "robot_full/speed.csv", "robot_full/optimum.csv",
                "robot_full/errors.csv"),
    ),
    Stage(
        "robot_motion", f"{_ROBOT}:robot_motion", robot=True,
        settings=("maps", "media", "robot"), reads=("alpha/{laboratory}.csv",),
        writes=("robot/motion.csv", "robot/stances.csv", "robot/frames.json"),
    ),
    Stage(
        "ledger", f"{_MEASURE}:ledger", rows=True, logs=True,
        settings=("raw", "dialect", "force_log", "motion_log", "media"),
        reads=("ledger/ingest/{media}.csv", "ledger/tare/{media}.csv", "ledger/slopes/{media}.csv",
               "ledger/legs/{media}.csv", "ledger/robot.csv", "runs/{media}.csv"),
        writes=("ledger.csv",),
    ),
    Stage(
        "validate", f"{_VALIDATE}:validate", settings=("media",), rows=True,
        reads=("alpha/{laboratory}.csv", "coefficients.csv", "penetration.csv", "leg_errors.csv",
               "legs/{media}.csv", "robot/errors.csv", "robot/optimum.csv", "robot/speed.csv",
               "checks/{media}.csv"),
        writes=("reproduction.csv",),
    ),
    Stage(
        "workbooks", "rftfit.page.workbooks:workbooks", settings=("fit", "media"),
        reads=("checks/{media}.csv", "alpha/{media}.csv", "coefficients.csv", "penetration.csv"),
        writes=("alpha_tables.xlsx", "coefficients.xlsx"),
    ),
    Stage(
        "page", "rftfit.page.page:report", settings=(ALL,), rows=True, reads=("*.csv", "*.json", "*.webp"),
        writes=("report.html", "findings.csv"),
    ),
    Stage(
        "provenance", "rftfit.workflow.provenance:provenance", settings=(ALL,), rows=True, logs=True,
        reads=("*",),
        writes=("provenance.json", "manifest.sha256", "run_sheet.csv", "ro-crate-metadata.json"),
    ),
)  # fmt: skip
"""In the order of the data's way. Figures are declared beside what draws them (`rftfit.figures`)."""

ON_DEMAND = ("robot_full", SWEEP)
"""Stages of ``rftfit sweep``, not of ``rftfit run``."""
