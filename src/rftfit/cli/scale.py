"""``rftfit scale``: from one penetration test in the field to a whole stress profile."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import rftfit
from rftfit.campaign.problems import choose
from rftfit.cli.output import check_target, say, table, warn
from rftfit.errors import InputError

if TYPE_CHECKING:
    from rftfit.model.scaling import Reference, ScaledMedium

MARK = "# alpha table written by rftfit scale"
"""How the first line of such a file begins: only these are overwritten unasked."""

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
        str | None,
        typer.Option(help="Nine-term fit that chi and M0 belong to: lsq (default) or dft-index."),
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
    from rftfit.model.fourier import TERMS
    from rftfit.model.scaling import scale as scale_medium
    from rftfit.store import write_text

    check_test(alpha, se, confidence)
    reference = reference_in(results, method)
    check_target(output, MARK, "alpha table", force)
    scaled = scale_medium(alpha, se, reference, confidence)
    terms = dict(zip(TERMS, zip(*scaled.coefficients_with_interval(), strict=True), strict=True))
    numbers = {
        "zeta": (scaled.zeta, scaled.zeta_lo, scaled.zeta_hi),
        "chi": (scaled.chi, scaled.chi_lo, scaled.chi_hi),
        **{term: tuple(map(float, values)) for term, values in terms.items()},
    }
    how = f"alpha_z(0, 90 deg) = {alpha:g} N/cm^3 (se {se:g}), scaled from {scaled.reference.name}"
    text = table_text(scaled, how)
    say(_as_json(scaled, numbers, output) if as_json else _as_text(scaled, numbers, how))
    # after the numbers are out: a folder that cannot be written must not hide them
    write_text(output, text)
    if not as_json:
        say(f"Alpha on the published grid of 7 x 13 angles: {output}")


def reference_in(folder: Path | None, method: str | None) -> Reference:
    """Reference media: the published five, or those of a campaign, which must be its own."""
    if folder is None:
        from rftfit.model.fourier import METHODS
        from rftfit.model.scaling import published

        return published(choose("--method", method or METHODS[0], METHODS))
    reference = rftfit.open(folder).reference(method)
    if reference.printed:
        raise InputError(
            f"{folder}: the scatter of chi needs at least two laboratory media with a usable grid; "
            "without --results the published five are used"
        )
    name = reference.name.replace("this campaign", folder.as_posix())
    return replace(reference, name=name)


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


def table_text(scaled: ScaledMedium, how: str) -> str:
    """Alpha on the published grid as csv: three comment lines, a header row, 91 rows.

    `how`: From what it was made, for the second line.
    """
    columns = scaled.columns()
    lines = [
        f"{MARK} (rftfit {rftfit.__version__})",
        f"# {how}",
        f"# _lo and _hi: {100 * scaled.confidence:g} % interval for one further medium",
        ",".join(columns),
    ]
    for beta, gamma, *alphas in zip(*columns.values(), strict=True):
        # + 0.0 so that nothing is called -0
        cells = (f"{round(float(alpha), 6) + 0.0:.6g}" for alpha in alphas)
        lines.append(",".join([f"{beta:.2f}", f"{gamma:.2f}", *cells]))
    return "\n".join(lines) + "\n"


def _as_text(scaled: ScaledMedium, numbers: dict[str, tuple[float, ...]], how: str) -> str:
    rows = [
        [name, *(f"{round(value, 4) + 0.0:.4f}" for value in values)]
        for name, values in numbers.items()
    ]
    test = " and the error of the test" if scaled.alpha_z_se else ""
    return (
        f"From {how}\n\n"
        f"{table(['', 'value', 'lo', 'hi'], rows)}\n\n"
        "zeta and chi without unit, coefficients in N/cm^3.\n"
        f"lo, hi: {100 * scaled.confidence:g} % interval for one further medium, from the scatter "
        f"between\n{', '.join(scaled.reference.media)}{test}.\n"
        "It is for the nine-term profile. Measured alpha departs from that too: at (0, 90 deg) it lies\n"
        "above by the factor chi. chi and the coefficients belong to one fit: least squares by default,\n"
        "the paper's own transform, with its zeta of 0.8 alpha_z, by --method dft-index."
    )


def _as_json(scaled: ScaledMedium, numbers: dict[str, tuple[float, ...]], output: Path) -> str:
    entries = {
        name: dict(zip(("value", "lo", "hi"), values, strict=True))
        for name, values in numbers.items()
    }
    content = {
        "alpha_z_N_per_cm3": scaled.alpha_z,
        "alpha_z_se_N_per_cm3": scaled.alpha_z_se,
        "confidence": scaled.confidence,
        "scaled_from": scaled.reference.name,
        "media": list(scaled.reference.media),
        "zeta": entries.pop("zeta"),
        "chi": entries.pop("chi"),
        "coefficients_N_per_cm3": entries,
        "alpha_table": str(output),
    }
    return json.dumps(content, indent=2)
