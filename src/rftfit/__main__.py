"""``python -m rftfit STAGE name=value ...``: one step of the workflow.

A list of paths is given by repeating its name. People use the ``rftfit`` command instead.
"""

from __future__ import annotations

import contextlib
import importlib
import inspect
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rftfit.errors import InputError, RftfitError
from rftfit.workflow.processes import end_with_parent

if TYPE_CHECKING:
    from collections.abc import Callable

_FIGURES = "rftfit.workflow.figures"
_LEG_FIGURES = "rftfit.workflow.figures"
_PROTOCOL_FIGURES = "rftfit.workflow.figures"
_ROBOT = "rftfit.workflow.robot"
STAGES = {
    "ingest": "rftfit.workflow.measure:ingest",
    "tare": "rftfit.workflow.measure:tare",
    "slopes": "rftfit.workflow.measure:slopes",
    "legs": "rftfit.workflow.measure:legs",
    "symmetry": "rftfit.workflow.profiles:symmetry",
    "fourier": "rftfit.workflow.profiles:fourier",
    "scaling": "rftfit.workflow.profiles:scaling",
    "trials": "rftfit.workflow.validate:trials",
    "correction": "rftfit.workflow.validate:correction",
    "sands": "rftfit.workflow.validate:sands",
    "ledger": "rftfit.workflow.measure:ledger",
    "reproduction": "rftfit.workflow.validate:reproduction",
    "page": "rftfit.workflow.validate:page",
    "workbooks": "rftfit.workflow.validate:workbooks",
    "quality": f"{_FIGURES}:quality",
    "figure_stress": f"{_FIGURES}:figure_stress",
    "figure_maps": f"{_FIGURES}:figure_maps",
    "figure_fit": f"{_FIGURES}:figure_fit",
    "figure_generic": f"{_FIGURES}:figure_generic",
    "figure_tare": f"{_FIGURES}:figure_tare",
    "figure_protocol": f"{_PROTOCOL_FIGURES}:figure_protocol",
    "figure_linearity": f"{_PROTOCOL_FIGURES}:figure_linearity",
    "figure_clocks": "rftfit.workflow.figures:figure_clocks",
    "figure_legs": f"{_LEG_FIGURES}:figure_legs",
    "figure_leg_media": f"{_LEG_FIGURES}:figure_leg_media",
    "figure_sand_legs": f"{_LEG_FIGURES}:figure_sand_legs",
    "figure_penetration": f"{_LEG_FIGURES}:figure_penetration",
    "figure_generic_forces": f"{_LEG_FIGURES}:figure_generic_forces",
    "figure_peak_errors": f"{_LEG_FIGURES}:figure_peak_errors",
    "robot_measured": f"{_ROBOT}:robot_measured",
    "robot_sweep": f"{_ROBOT}_sweep:robot_sweep",
    "robot_tables": f"{_ROBOT}:robot_tables",
    "robot_intervals": f"{_ROBOT}_intervals:robot_intervals",
    "robot_motion": f"{_ROBOT}_figures:robot_motion",
    "robot_frames": f"{_ROBOT}_frames:robot_frames",
    "figures_robot_speed": f"{_ROBOT}_figures:figures_robot_speed",
    "figures_robot_motion": f"{_ROBOT}_figures:figures_robot_motion",
    "provenance": "rftfit.workflow.provenance:provenance",
}
"""Stage to the module and the function that do the work."""


def stage_function(name: str) -> Callable[..., None]:
    """Return the function of a stage."""
    if name not in STAGES:
        raise InputError(f"no stage {name!r}; allowed: {', '.join(STAGES)}")
    module, _, attribute = STAGES[name].partition(":")
    function: Callable[..., None] = getattr(importlib.import_module(module), attribute)
    return function


def bind(function: Callable[..., None], words: list[str]) -> dict[str, Any]:
    """Turn ``name=value`` words into the arguments of a stage.

    `function`: Its annotations (``Path``, ``str``, ``list[Path]``) say what each argument is.
    """
    kinds = inspect.signature(function).parameters
    found: dict[str, list[str]] = {}
    for word in words:
        name, equals, value = word.partition("=")
        if not equals or name not in kinds:
            raise InputError(f"found {word!r}; allowed: {', '.join(f'{k}=...' for k in kinds)}")
        found.setdefault(name, []).append(value)
    arguments: dict[str, Any] = {}
    for name, kind in kinds.items():
        values = found.get(name, [])
        if str(kind.annotation).startswith("list"):
            arguments[name] = [Path(value) for value in values]
        elif len(values) != 1:
            raise InputError(f"{name}= must be given once, found {len(values)} times")
        else:
            arguments[name] = values[0] if kind.annotation == "str" else Path(values[0])
    return arguments


def main(argv: list[str] | None = None) -> int:
    """Run one stage and return its exit code.

    `argv`: Stage and arguments; default: the command line's. Returns 0, or the exit code of the
    error, whose message goes to standard error.
    """
    end_with_parent()
    words = sys.argv[1:] if argv is None else argv
    try:
        if not words:
            raise InputError(f"which stage? allowed: {', '.join(STAGES)}")
        function = stage_function(words[0])
        function(**bind(function, words[1:]))
    except RftfitError as error:
        _say(f"rftfit {words[0] if words else ''}: {error}\n")
        return error.exit_code
    return 0


def _say(message: str) -> None:
    """Write to standard error; where that is a file on a full disk, to whoever listens."""
    try:
        sys.stderr.write(message)
        sys.stderr.flush()
    except OSError:
        with contextlib.suppress(OSError, ValueError):
            sys.stdout.write(message)
            sys.stdout.flush()
            # what waits in the stream is tried again at the very end, which would change the exit status
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())


if __name__ == "__main__":
    sys.exit(main())
