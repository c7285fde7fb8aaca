"""``rftfit scale``: from one penetration test in the field to a whole stress profile."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rftfit.cli.output import say, table, warn
from rftfit.errors import InputError

if TYPE_CHECKING:
    from rftfit.profile.new_medium import Interval
    from rftfit.profile.reference_media import Reference
    from rftfit.profile.scaling import Scaled

_PLAUSIBLE_N_PER_CM3 = (0.05, 5.0)


def number_of(text: str) -> float:
    """Read a number of the command line; a decimal comma is named as what it is.

    Parameters
    ----------
    text : str

    Returns
    -------
    float

    Raises
    ------
    typer.BadParameter
        If it is no number.
    """
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
    from rftfit.cli.scale_intervals import coefficients_with_interval, scale_from
    from rftfit.cli.scale_sources import from_results
    from rftfit.cli.scale_table import MARK, table_text
    from rftfit.cli.target import check_target
    from rftfit.profile.reference_media import published
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

    Parameters
    ----------
    alpha, se : float
        alpha_z(0, 90 deg) and its standard error, N/cm^3.
    confidence : float
        Level of the intervals.

    Raises
    ------
    InputError
        If any of them is outside what is allowed.
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
    from rftfit.profile.fourier import TERMS

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
    from rftfit.profile.fourier import TERMS

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
