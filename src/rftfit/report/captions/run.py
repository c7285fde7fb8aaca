"""The one object that the templates in ``workflow/report`` see, as ``snakemake.config["captions"]``.

It reads nothing until a template asks: planning and running a workflow do not pay for it, and no
result gets among the parameters of a rule, where it would make jobs run again.
"""

from __future__ import annotations

from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rftfit.report.captions import measured, modelled, robot
from rftfit.report.captions.words import rst

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import pandas as pd

    from rftfit.page.page import PageInputs

NUMBERS: dict[str, Callable[..., Any]] = {
    "summary": measured.summary,
    "fates": measured.fates,
    "slopes": measured.slopes,
    "slopes_of": measured.slopes_of,
    "cells": measured.cells,
    "fit": modelled.fit,
    "generic": modelled.generic,
    "peaks": modelled.peaks,
    "sands": modelled.sands,
    "correction": modelled.correction,
    "reproduction": modelled.reproduction,
    "speeds": robot.speeds,
    "best_legs": robot.best_legs,
}
"""What a template may ask for, beside `Captions`' own; the inputs are filled in."""

_SINGLE = ("coefficients", "penetration", "reproduction", "ledger", "leg_errors", "sands",
           "sand_correction")  # fmt: skip
_ROBOT = ("speed.csv", "errors.csv", "optimum.csv", "frames.json")
_BY_MEDIUM = ("alpha", "runs", "fits", "legs")


class Captions:
    """Numbers of a finished run, by name.

    `config`: The campaign's configuration.
    `media`: Those that have runs.
    `shown`: Runs of the figure of stress against depth.
    `results`: Folder of the results.
    """

    def __init__(
        self,
        config: str | Path,
        media: Sequence[str],
        shown: Sequence[str] = (),
        results: str | Path = "results",
    ) -> None:
        self.shown = list(shown)
        self._config, self._media, self._results = Path(config), list(media), Path(results)

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if name not in NUMBERS:
            raise AttributeError(f"no {name!r} of a run; allowed: {', '.join(NUMBERS)}")
        return partial(NUMBERS[name], self.inputs)

    @cached_property
    def inputs(self) -> PageInputs:
        """The tables of the run, as the report page has them."""
        from rftfit.page.page import read_inputs

        one: dict[str, Any] = {name: self._results / f"{name}.csv" for name in _SINGLE}
        each: dict[str, Any] = {
            name: [self._results / name / f"{medium}.csv" for medium in self._media]
            for name in _BY_MEDIUM
        }
        predicted = [self._results / "predicted.csv"]
        paths = [self._results / "robot" / name for name in _ROBOT]
        run = paths if all(path.is_file() for path in paths) else []
        return read_inputs(
            self._config, **one, **each, predicted=predicted, code="", digests={}, robot=run
        )

    @cached_property
    def motion(self) -> pd.DataFrame:
        """Motion of the robot over two strides, where the campaign has one."""
        from rftfit.store import read_csv

        return read_csv(self._results / "robot" / "motion.csv")

    def strides(self, profile: str = "") -> list[dict[str, Any]]:
        """Sum up that motion (`rftfit.report.captions.robot.strides`).

        `profile`: Only this one.
        """
        return robot.strides(self.motion, profile)

    @property
    def level(self) -> str:
        """Level of all intervals."""
        return f"{100 * self.inputs.config.fit.confidence:.4g} %"

    @property
    def method(self) -> str:
        """The Fourier method that the configuration names."""
        return self.inputs.config.fourier.method

    def title(self, medium: str) -> str:
        """Name of a medium."""
        return rst(self.inputs.titles[medium])
