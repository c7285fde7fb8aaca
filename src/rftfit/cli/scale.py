"""``rftfit scale``: from one penetration test in the field to a whole stress profile."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

import rftfit
from rftfit.cli.output import say, table, warn
from rftfit.errors import InputError
from rftfit.model.fourier import TERMS, evaluate
from rftfit.model.scaling import (
    GENERIC,
    Interval,
    reference_from,
    routine,
    scale_new_medium,
    table_rows,
    with_interval,
)
from rftfit.reference import BETA_DEG, GAMMA_DEG

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray
    from rftfit.model.scaling import Reference, Scaled


# --- The scaling routine's chi and generic coefficients from a campaign's results.


def from_results(folder: Path, method: str) -> Reference:
    """Chi and coefficients of a campaign.

    `folder`: Its results, with ``penetration.csv`` and ``coefficients.csv``. `method`: Of the fit,
    as in these tables.
    """
    penetration, coefficients = folder / "penetration.csv", folder / "coefficients.csv"
    rows = _of_method(penetration, method, ("method", "medium", "chi"))
    chi = {row["medium"]: _number(penetration, row, "chi") for row in rows}
    chi = {medium: value for medium, value in chi.items() if math.isfinite(value)}
    if len(chi) < 2:
        raise InputError(
            f"{penetration}: the scatter of chi needs at least two media with a chi by {method!r}, "
            f"found {len(chi)}; without --results the published five are used"
        )
    needed = ("method", "medium", "coefficient", "value_N_per_cm3")
    fitted: dict[str, dict[str, float]] = {}
    for row in _of_method(coefficients, method, needed):
        # a term that was dropped keeps its value in the table, and counts as nothing
        kept = row.get("kept", "True").strip().lower() != "false"
        value = _number(coefficients, row, "value_N_per_cm3") if kept else 0.0
        fitted.setdefault(row["medium"], {})[row["coefficient"]] = value
    for medium in (GENERIC, *chi):
        lacking = [
            term for term in TERMS if not math.isfinite(fitted.get(medium, {}).get(term, math.nan))
        ]
        if lacking:
            raise InputError(
                f"{coefficients}: no value by {method!r} for {medium}: {', '.join(lacking)}; make "
                "these tables again with `rftfit run`"
            )
    values = {
        medium: np.array([terms[term] for term in TERMS])
        for medium, terms in fitted.items()
        if medium in (GENERIC, *chi)
    }
    return reference_from(f"{folder.as_posix()}, method {method}", chi, values)


def _of_method(path: Path, method: str, needed: tuple[str, ...]) -> list[dict[str, str]]:
    try:
        rows = table_rows(path)
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such table; `rftfit run` makes it") from None
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read as a table: {error}") from error
    lacking = [name for name in needed if not rows or rows[0].get(name) is None]
    if lacking:
        raise InputError(f"{path}: no column {', '.join(lacking)}, or no rows")
    chosen = [row for row in rows if row["method"] == method]
    if not chosen:
        if any(row["method"] == routine(method, printed=True) for row in rows):
            raise InputError(
                f"{path}: this campaign has no medium fitted by {method!r}, its sands are scaled "
                "with the published five; without --results these are used here too"
            )
        known = ", ".join(dict.fromkeys(row["method"] for row in rows))
        raise InputError(f"{path}: no rows of the method {method!r}; allowed: {known}")
    return chosen


def _number(path: Path, row: dict[str, str], column: str) -> float:
    text = row[column] or "nan"
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{path}: found {text!r} in column {column}; allowed: a number") from None


# --- Coefficients and alpha of a medium scaled from one penetration test, with their intervals.


def scale_from(reference: Reference, alpha: float, alpha_se: float, confidence: float) -> Scaled:
    """Run the scaling routine.

    `alpha`, `alpha_se`: alpha_z(0, 90 deg) of the new medium and its standard error, N/cm^3.
    """
    return scale_new_medium(alpha, alpha_se, reference.chi, reference.m0, confidence)


def coefficients_with_interval(scaled: Scaled, reference: Reference, confidence: float) -> Interval:
    """Nine coefficients of the new medium.

    Returns `value`, `lo`, `hi` of shape (9,): N/cm^3.
    """
    return with_interval(scaled, reference.m0, reference.scaled, confidence)


def alpha_with_interval(
    scaled: Scaled, reference: Reference, beta: FloatArray, gamma: FloatArray, confidence: float
) -> tuple[Interval, Interval]:
    """Alpha of the new medium.

    `beta`, `gamma`: rad; shapes broadcast to (...). Returns `alpha_z`, `alpha_x`: Value, lower and
    upper end, each of shape (...), N/cm^3.
    """
    generic = evaluate(reference.m0, beta, gamma)
    each = [evaluate(own, beta, gamma) for own in reference.scaled]
    return (
        with_interval(scaled, generic[0], np.stack([z for z, _ in each]), confidence),
        with_interval(scaled, generic[1], np.stack([x for _, x in each]), confidence),
    )


# --- The alpha table of a scaled medium as a file, never over a file of somebody else's.


MARK = "# alpha table written by rftfit scale"
"""How the first line of such a file begins: only these are overwritten unasked."""

COLUMNS = (
    "beta_deg",
    "gamma_deg",
    "alpha_z_N_per_cm3",
    "alpha_z_lo_N_per_cm3",
    "alpha_z_hi_N_per_cm3",
    "alpha_x_N_per_cm3",
    "alpha_x_lo_N_per_cm3",
    "alpha_x_hi_N_per_cm3",
)


def table_text(scaled: Scaled, reference: Reference, confidence: float, how: str) -> str:
    """Alpha on the published grid of 7 x 13 angles as csv.

    `confidence`: Level of the intervals. `how`: From what the table was made, for its second line.
    Returns three comment lines, a header row, and 91 rows with beta and gamma ascending.
    """
    beta, gamma = (grid.ravel() for grid in np.meshgrid(BETA_DEG, GAMMA_DEG, indexing="ij"))
    z, x = alpha_with_interval(scaled, reference, np.radians(beta), np.radians(gamma), confidence)
    lines = [
        f"{MARK} (rftfit {rftfit.__version__})",
        f"# {how}",
        f"# _lo and _hi: {100 * confidence:g} % interval for one further medium",
        ",".join(COLUMNS),
    ]
    for row in zip(beta, gamma, *z, *x, strict=True):
        angles, alphas = row[:2], np.round(row[2:], 6) + 0.0
        lines.append(",".join([*(f"{v:.2f}" for v in angles), *(f"{v:.6g}" for v in alphas)]))
    return "\n".join(lines) + "\n"


# --- ``rftfit scale``: from one penetration test in the field to a whole stress profile.


_PLAUSIBLE_N_PER_CM3 = (0.05, 5.0)


def number_of(text: str) -> float:
    """Read a number of the command line; a decimal comma is named as what it is."""
    try:
        return float(text)
    except ValueError:
        comma = text.replace(",", ".", 1)
        hint = f"; write a decimal point: {comma}" if text.count(",") == 1 else ""
        raise typer.BadParameter(f"found '{text}'; allowed: a number{hint}") from None


def scale(
    alpha: Annotated[
        float,
        typer.Option(
            parser=number_of,
            metavar="N/cm^3",
            help="Slope of stress over depth of a horizontal plate pushed straight down: "
            "alpha_z(0, 90 deg), in N/cm^3.",
        ),
    ],
    se: Annotated[
        float,
        typer.Option(parser=number_of, metavar="N/cm^3", help="Standard error of alpha, N/cm^3."),
    ] = 0.0,
    confidence: Annotated[
        float, typer.Option(parser=number_of, metavar="LEVEL", help="Level of the intervals.")
    ] = 0.95,
    results: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Take chi and generic coefficients from a campaign's results, not from the "
            "published tables.",
        ),
    ] = None,
    method: Annotated[
        str | None, typer.Option(help="Fit in those results: lsq (default) or dft-index.")
    ] = None,
    output: Annotated[Path, typer.Option(metavar="FILE", help="File of the alpha table.")] = Path(
        "alpha.csv"
    ),
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead of a text for people.")
    ] = False,
    force: Annotated[
        bool, typer.Option("--force", help="Overwrite a file that rftfit did not write.")
    ] = False,
) -> None:
    """Turn one vertical penetration test into a whole stress profile, with intervals.

    Prints zeta, chi and the nine coefficients M = zeta M0, and writes alpha(beta, gamma) on the
    published grid as csv.
    """
    from rftfit.cli.output import check_target
    from rftfit.model.scaling import published
    from rftfit.store import write_text

    check_test(alpha, se, confidence)
    if method is not None and results is None:
        raise InputError("--method chooses among the fits of a campaign, so it needs --results DIR")
    reference = published() if results is None else from_results(results, method or "lsq")
    check_target(output, MARK, "alpha table", force)
    scaled = scale_from(reference, alpha, se, confidence)
    coefficients = coefficients_with_interval(scaled, reference, confidence)
    how = f"alpha_z(0, 90 deg) = {alpha:g} N/cm^3 (se {se:g}), scaled from {reference.name}"
    text = table_text(scaled, reference, confidence, how)
    if as_json:
        say(_as_json(alpha, se, confidence, reference, scaled, coefficients, output))
    else:
        say(_as_text(how, confidence, reference, scaled, coefficients))
    # after the numbers are out: a folder that cannot be written must not hide them
    write_text(output, text)
    if not as_json:
        say(f"Alpha on the published grid of 7 x 13 angles: {output}")


def check_test(alpha: float, se: float, confidence: float) -> None:
    """Refuse a penetration test that cannot be; warn of one in another unit, as it seems.

    `alpha`, `se`: alpha_z(0, 90 deg) and its standard error, N/cm^3. `confidence`: Level of the
    intervals.
    """
    if not (math.isfinite(alpha) and alpha > 0):
        raise InputError(f"--alpha: found {alpha:g}; allowed: a positive number, in N/cm^3")
    if not (math.isfinite(se) and se >= 0):
        raise InputError(f"--se: found {se:g}; allowed: 0 or a positive number, in N/cm^3")
    if not 0.5 < confidence < 1:
        raise InputError(
            f"--confidence: found {confidence:g}; allowed: above 0.5 and below 1, such as 0.95"
        )
    lowest, highest = _PLAUSIBLE_N_PER_CM3
    if not lowest <= alpha <= highest:
        warn(
            f"warning: {alpha:g} N/cm^3 is outside {lowest:g} to {highest:g} N/cm^3, where dry "
            "granular media lie; is it in another unit? 1 N/cm^3 = 1000 kN/m^3 = 1e6 N/m^3"
        )


def _as_text(
    how: str, confidence: float, reference: Reference, scaled: Scaled, coefficients: Interval
) -> str:
    from rftfit.model.fourier import TERMS

    level = f"{100 * confidence:g} %"
    rows = [
        ["zeta", f"{scaled.zeta:.4f}", f"{scaled.zeta_lo:.4f}", f"{scaled.zeta_hi:.4f}"],
        ["chi", f"{scaled.chi:.4f}", f"{scaled.chi_lo:.4f}", f"{scaled.chi_hi:.4f}"],
        *(
            # + 0.0 so that nothing is called -0
            [term, *(f"{round(float(number), 4) + 0.0:.4f}" for number in numbers)]
            for term, *numbers in zip(TERMS, *coefficients, strict=True)
        ),
    ]
    media = ", ".join(reference.media)
    return (
        f"From {how}\n\n"
        f"{table(['', 'value', 'lo', 'hi'], rows)}\n\n"
        "zeta and chi without unit, coefficients in N/cm^3.\n"
        f"lo, hi: {level} interval for one further medium, from the scatter between\n"
        f"{media}{' and the error of the test' if '(se 0)' not in how else ''}.\n"
        "It is for the nine-term profile. Measured alpha departs from that too: at (0, 90 deg) it lies\n"
        "above by the factor chi."
    )


def _as_json(
    alpha: float, se: float, confidence: float, reference: Reference, scaled: Scaled,
    coefficients: Interval, output: Path,
) -> str:  # fmt: skip
    from rftfit.model.fourier import TERMS

    def entry(value: float, lo: float, hi: float) -> dict[str, float]:
        return {"value": float(value), "lo": float(lo), "hi": float(hi)}

    content: dict[str, Any] = {
        "alpha_z_N_per_cm3": alpha,
        "alpha_z_se_N_per_cm3": se,
        "confidence": confidence,
        "scaled_from": reference.name,
        "media": list(reference.media),
        "zeta": entry(scaled.zeta, scaled.zeta_lo, scaled.zeta_hi),
        "chi": entry(scaled.chi, scaled.chi_lo, scaled.chi_hi),
        "coefficients_N_per_cm3": {
            term: entry(*numbers) for term, *numbers in zip(TERMS, *coefficients, strict=True)
        },
        "alpha_table": str(output),
    }
    return json.dumps(content, indent=2)
