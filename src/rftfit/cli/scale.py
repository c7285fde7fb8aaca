"""``rftfit scale``: from one penetration test in the field to a whole stress profile."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import rftfit
from rftfit.campaign.problems import choose
from rftfit.cli import options
from rftfit.cli.output import check_target, comments, json_text, say, table, warn
from rftfit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    import pandas as pd

    from rftfit.model.scaling import Reference, ScaledMedium
    from rftfit.model.shapes import Map

MARK = "# alpha table written by rftfit scale"
"""How the first line of such a file begins: only these are overwritten unasked."""

_PLAUSIBLE_N_PER_CM3 = (0.05, 5.0)


def scale(
    alpha: Annotated[
        float | None,
        options.number(
            "N/cm^3",
            "Slope of stress over depth of a horizontal plate pushed straight down: "
            "alpha_z(0, 90 deg), in N/cm^3.",
        ),
    ] = None,
    se: options.ErrorOfTest = None,
    pushes: Annotated[
        Path | None,
        options.file(
            "Any number of pushes instead: a table with beta_deg, gamma_deg, "
            "alpha_z_N_per_cm3 and, where measured, alpha_x_N_per_cm3, se_z, se_x."
        ),
    ] = None,
    profile_file: Annotated[
        Path | None,
        options.file(
            "The pushes behind a profile of rftfit export, alone or with those of --pushes."
        ),
    ] = None,
    confidence: options.Level = 0.95,
    results: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Take chi and generic coefficients from a campaign's results, not from the "
            "published tables.",
        ),
    ] = None,
    method: options.MethodName = None,
    output: Annotated[Path, options.file("File of the alpha table.")] = Path("alpha.csv"),
    as_json: options.AsJson = False,
    force: options.Overwrite = False,
) -> None:
    """Turn one vertical penetration test, or a few pushes, into a whole stress profile, with intervals.

    From --alpha by the paper's scaling routine: prints zeta, chi and the nine coefficients M = zeta M0.
    From --pushes by the shape that known media share: prints the map, and how far the pushes agree with
    that shape. Both write alpha(beta, gamma) on the published grid as csv.
    """
    from rftfit.store import write_text

    many = pushes is not None or profile_file is not None
    if (alpha is None) != many:
        found = "neither" if alpha is None else "both"
        raise InputError(
            f"found {found} of --alpha and --pushes; allowed: --alpha N/cm^3 (one vertical push) or "
            "--pushes FILE (a table of pushes; or --profile-file, or both)"
        )
    check_target(output, MARK, "alpha table", force, (pushes, profile_file))
    if many:
        if se is not None:
            raise InputError(
                "--se is the standard error of --alpha; a table has columns se_z, se_x"
            )
        check_test(None, 0.0, confidence)
        told = told_by(pushes, profile_file)
        answer = _scale_pushes(*told, confidence, reference_in(results, method))
    else:
        assert alpha is not None
        answer = _scale_test(alpha, se or 0.0, confidence, reference_in(results, method))
    say(json_text(answer.facts | {"alpha_table": str(output)}) if as_json else answer.text)
    if answer.doubt:
        warn(f"warning: {answer.doubt}")
    # after the numbers are out: a folder that cannot be written must not hide them
    write_text(output, answer.table)
    if not as_json:
        say(f"Alpha {answer.where}: {output}")


@dataclass(frozen=True)
class _Answer:
    """What is shown, to people as text or to scripts as facts, and what is written."""

    text: str
    facts: dict[str, Any]
    table: str
    where: str
    doubt: str = ""


def _scale_test(alpha: float, se: float, confidence: float, reference: Reference) -> _Answer:
    """One penetration test by the paper's routine."""
    from rftfit.model.fourier import TERMS
    from rftfit.model.scaling import scale as scale_medium

    check_test(alpha, se, confidence)
    scaled = scale_medium(alpha, se, reference, confidence)
    terms = dict(zip(TERMS, zip(*scaled.coefficients_with_interval(), strict=True), strict=True))
    zeta, chi = (
        tuple(getattr(scaled, f"{name}{end}") for end in ("", "_lo", "_hi"))
        for name in ("zeta", "chi")
    )
    numbers = {"zeta": zeta, "chi": chi} | terms
    how = f"alpha_z(0, 90 deg) = {alpha:g} N/cm^3 (se {se:g}), scaled from {scaled.reference.name}"
    rows = [
        [name, *(f"{round(value, 4) + 0.0:.4f}" for value in values)]
        for name, values in numbers.items()
    ]
    test = " and the error of the test" if se else ""
    text = (
        f"From {how}\n\n"
        f"{table(['', 'value', 'lo', 'hi'], rows)}\n\n"
        "zeta and chi without unit, coefficients in N/cm^3.\n"
        f"lo, hi: {100 * confidence:g} % interval for one further medium, from the scatter "
        f"between\n{', '.join(scaled.reference.media)}{test}.\n"
        "It is for the nine-term profile. Measured alpha departs from that too: at (0, 90 deg) it lies\n"
        "above by the factor chi. chi and the coefficients belong to one fit: least squares by default,\n"
        "the paper's own transform, with its zeta of 0.8 alpha_z, by --method dft-index."
    )
    facts = {
        "alpha_z_N_per_cm3": alpha,
        "alpha_z_se_N_per_cm3": se,
        "confidence": confidence,
        "scaled_from": scaled.reference.name,
        "media": list(scaled.reference.media),
        "zeta": _with_ends(zeta),
        "chi": _with_ends(chi),
        "coefficients_N_per_cm3": {term: _with_ends(values) for term, values in terms.items()},
    }
    level = f"{100 * confidence:g} % interval for one further medium"
    where = "on the published grid of 7 x 13 angles"
    return _Answer(text, facts, table_text(scaled.columns(), how, level), where)


def _with_ends(numbers: Iterable[float]) -> dict[str, float]:
    return dict(zip(("value", "lo", "hi"), map(float, numbers), strict=True))


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


def check_test(alpha: float | None, se: float, confidence: float) -> None:
    """Refuse a penetration test or a level that cannot be; warn of a test in another unit, as it seems."""
    if alpha is not None and not (math.isfinite(alpha) and alpha > 0):
        raise InputError(f"--alpha: found {alpha:g}; allowed: a positive number, in N/cm^3")
    if not (math.isfinite(se) and se >= 0):
        raise InputError(f"--se: found {se:g}; allowed: 0 or a positive number, in N/cm^3")
    if not 0.5 < confidence < 1:
        raise InputError(
            f"--confidence: found {confidence:g}; allowed: above 0.5 and below 1, such as 0.95"
        )
    lowest, highest = _PLAUSIBLE_N_PER_CM3
    if alpha is not None and not lowest <= alpha <= highest:
        warn(
            f"warning: {alpha:g} N/cm^3 is outside {lowest:g} to {highest:g} N/cm^3, where dry "
            "granular media lie; is it in another unit? 1 N/cm^3 = 1000 kN/m^3 = 1e6 N/m^3"
        )


def table_text(columns: Mapping[str, Iterable[object]], how: str, level: str) -> str:
    """Alpha by direction as csv: how it was made, the level of the intervals, a header row, the rows."""
    lines = [",".join(columns)]
    for row in zip(*columns.values(), strict=True):
        beta, gamma, *rest = row
        # + 0.0 so that nothing is called -0
        cells = [c if isinstance(c, str) else f"{round(float(c), 6) + 0.0:.6g}" for c in rest]
        lines.append(",".join([f"{beta:.2f}", f"{gamma:.2f}", *cells]))
    return comments(MARK, [how, f"_lo and _hi: {level}"]) + "\n".join(lines) + "\n"


# --- a few pushes


def told_by(*files: Path | None) -> tuple[str, pd.DataFrame]:
    """Pushes of a table and of a profile file, and the names of these files."""
    import pandas as pd

    from rftfit.model.profile_file import pushes_in_profile

    readers = zip(files, (pushes_of_table, pushes_in_profile), strict=True)
    tables = [read(path) for path, read in readers if path is not None]
    names = [path.name for path in files if path is not None]
    return " and ".join(names), pd.concat(tables, ignore_index=True)


def pushes_of_table(path: Path) -> pd.DataFrame:
    """Pushes of a table; what is doubtful in it is printed."""
    from rftfit.campaign.tables import pushes_in

    pushes, warnings = pushes_in(path)
    for one in warnings:
        warn(f"warning: {one}")
    return pushes


def _scale_pushes(
    name: str, pushes: pd.DataFrame, confidence: float, reference: Reference
) -> _Answer:
    """Any number of pushes by the shape of known media, beside the paper's routine."""
    from rftfit.measure.alpha import cell_at, column
    from rftfit.model.scaling import scale as scale_medium
    from rftfit.model.shapes import NOT_ALIKE

    try:
        found = rftfit.estimate_map(pushes, confidence=confidence, name=Path(name).stem)
    except ValueError as error:
        raise InputError(f"{name}: {error}") from error
    down = cell_at(pushes, 0, 90)
    routine = None
    if down is not None and down[column("z")] > 0:
        se = float(down[column("z", "_se")])
        routine = scale_medium(
            float(down[column("z")]), 0.0 if math.isnan(se) else se, reference, confidence
        )
    level = f"{100 * confidence:g} % interval"
    how = f"{found.pushes} {'push' if found.pushes == 1 else 'pushes'} of {name}, with the shape of {found.known}"
    facts = {
        "pushes": found.pushes,
        "known_media": found.known.split(", "),
        "confidence": confidence,
        "zeta": _with_ends(found.zeta),
        "zeta_of_the_papers_routine": routine
        and _with_ends((routine.zeta, routine.zeta_lo, routine.zeta_hi)),
        "chi_squared": found.distance,
        "degrees_of_freedom": found.dof,
        "probability_if_it_belongs": found.belongs if found.dof > 0 else None,
        "draws_not_passive": found.not_passive,
    }
    doubt = ""
    if (worst := found.farthest) and found.belongs < NOT_ALIKE:
        doubt = (
            "this medium does not belong to those whose shape is known: pushes lie so far from "
            f"it once in {1 / max(found.belongs, 1e-9):.3g} media that do. alpha_x is {found.horizontal:.2g} "
            f"times as strong beside alpha_z as in the known media. Farthest from the shape is (beta, gamma) = "
            f"({worst.beta_deg:g}, {worst.gamma_deg:g}) deg, alpha_{worst.component}: found "
            f"{worst.found:.3g}, expected by the other pushes {worst.expected:.3g} +- {worst.error:.2g} "
            "N/cm^3. A wet, cohesive or angular medium, a wrong sign or angle; estimated alpha is not "
            "to be trusted."
        )
    return _Answer(
        _map_as_text(found, routine, how, level),
        facts,
        table_text(found.columns(), f"from {how}", level),
        f"in {found.beta.size} directions",
        doubt,
    )


def _map_as_text(found: Map, routine: ScaledMedium | None, how: str, level: str) -> str:
    from rftfit.measure.alpha import column

    whole = found.table()
    gammas = (-90, -45, 0, 45, 90)
    blocks = []
    for component in "zx":
        rows = []
        for beta in (-60, -30, 0, 30, 60, 90):
            cells = []
            for gamma in gammas:
                near = whole[
                    (whole["beta_deg"] - beta).abs() + (whole["gamma_deg"] - gamma).abs() < 0.5
                ]
                lo, hi = (float(near[column(component, end)].iloc[0]) for end in ("_lo", "_hi"))
                mark = "*" if near["source"].iloc[0] == "measured" else ""
                value = float(near[column(component)].iloc[0])
                # + 0.0 so that nothing is called -0
                value = round(value, 3) + 0.0
                ends = f"{lo:.3f} to {hi:.3f}" if hi > lo else "by symmetry"
                cells.append(f"{value:.3f} ({ends}){mark}")
            rows.append([f"{beta}", *cells])
        head = [f"alpha_{component}", *(f"gamma {gamma}" for gamma in gammas)]
        blocks.append(table(head, rows))
    zeta = "zeta {:.4f} ({:.4f} to {:.4f}) of nine terms fitted to the map".format(*found.zeta)
    if routine is not None:
        zeta += (
            f"\nzeta {routine.zeta:.4f} ({routine.zeta_lo:.4f} to {routine.zeta_hi:.4f}) by the paper's "
            f"routine from (0, 90) deg alone, with {routine.reference.name}"
        )
    if found.dof > 0:
        agree = (
            f"Agreement with the shape of the known media: chi^2 = {found.distance:.3g} for {found.dof}, alpha_x "
            f"{found.horizontal:.2g} times as strong beside alpha_z; as far or farther in "
            f"{100 * found.belongs:.3g} % of media that belong."
        )
    else:
        agree = "One number tells how strong the medium is, not whether it has the shape of the known media."
    return (
        f"From {how}\n\n"
        + "\n\n".join(blocks)
        + f"\n\nN/cm^3; beta and gamma in degrees; {level}; "
        f"* measured.\n{zeta}\n{agree}\n"
        f"{100 * found.not_passive:.0f} % of the draws behind the intervals gave energy back somewhere and were "
        "left out."
    )
