"""The report page of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.report.page.inputs import read_inputs
from rftfit.report.page.page import write_page

if TYPE_CHECKING:
    from pathlib import Path


def page(
    config: Path, alpha: list[Path], coefficients: Path, penetration: Path, reproduction: Path,
    ledger: Path, runs: list[Path], fits: list[Path], legs: list[Path], predicted: Path,
    leg_errors: Path, sands: Path, sand_correction: Path, code: str, settings: str, rows: str,
    report: Path, robot: list[Path] | None = None,
) -> None:  # fmt: skip
    """Write the report page.

    Parameters
    ----------
    config : Path
    alpha, runs, fits, legs : list of Path
        Read: tables of each medium.
    coefficients, penetration, reproduction, ledger, predicted, leg_errors, sands : Path
        Read: tables of the run.
    sand_correction : Path
        Read.
    code, settings, rows : str
        Digests of the program's source, of the settings and of the run sheet, for the provenance.
    report : Path
        Written (html).
    robot : list of Path, optional
        Read: speeds, errors, optima and pictures of the robot, in this order.

    Raises
    ------
    RftfitError
        If an input is not valid or the page cannot be written.
    """
    inputs = read_inputs(
        config, alpha=alpha, coefficients=coefficients, penetration=penetration,
        reproduction=reproduction, ledger=ledger, runs=runs, fits=fits, legs=legs,
        predicted=[predicted], leg_errors=leg_errors, sands=sands, sand_correction=sand_correction,
        code=code, digests={"the settings": settings, "the run sheet": rows}, robot=robot or [],
    )  # fmt: skip
    write_page(inputs, report)
