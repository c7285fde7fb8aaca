"""``rftfit predict``: forces on a leg, or on any outline along any path."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rftfit.cli.output import say, warn
from rftfit.cli.scale import check_test, number_of
from rftfit.errors import AllAtOnce, InputError

if TYPE_CHECKING:
    from rftfit.cli.predict_inputs import Motion
    from rftfit.cli.predict_intervals import Prediction
    from rftfit.cli.predict_sources import Source


def predict(
    leg: Annotated[
        str | None, typer.Option(help="Model leg: c_leg, flat_leg or reversed_c_leg.")
    ] = None,
    curvature: Annotated[
        float | None,
        typer.Option(
            parser=number_of,
            metavar="R/r",
            help="Leg of any curvature, 2R = 7.62 cm: 1 is the c-leg, 0 flat, -1 the reversed one.",
        ),
    ] = None,
    outline: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Any outline: csv with x_cm, z_cm, points in order; it turns about (0, 0).",
        ),
    ] = None,
    width: Annotated[
        float | None,
        typer.Option(
            parser=number_of,
            metavar="cm",
            help="Width across the plane; 2.54 with --curvature, needed with --outline.",
        ),
    ] = None,
    hip: Annotated[
        float | None,
        typer.Option(
            parser=number_of,
            metavar="cm",
            help="Turn it about (0, 0) at this height, theta from -135 to 135 deg; default 2.",
        ),
    ] = None,
    path: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Move it along a path instead: csv with t_s, x_cm, z_cm, angle_deg.",
        ),
    ] = None,
    medium: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Published medium, or with --results one of a campaign."),
    ] = None,
    profile: Annotated[
        str | None,
        typer.Option(
            help="table (default: alpha as measured), fourier, generic or depth_only; with --alpha "
            "always generic."
        ),
    ] = None,
    results: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Take the tables of a campaign's results.")
    ] = None,
    method: Annotated[
        str | None, typer.Option(help="Fit in those results: lsq (default) or dft-index.")
    ] = None,
    alpha: Annotated[
        float | None,
        typer.Option(
            parser=number_of,
            metavar="N/cm^3",
            help="A medium known by one vertical penetration test: as for rftfit scale.",
        ),
    ] = None,
    se: Annotated[
        float | None,
        typer.Option(
            parser=number_of, metavar="N/cm^3", help="Standard error of alpha; default 0."
        ),
    ] = None,
    confidence: Annotated[
        float,
        typer.Option(
            parser=number_of,
            metavar="LEVEL",
            help="Level of the intervals; for a medium of a campaign that of its config.",
        ),
    ] = 0.95,
    elements: Annotated[
        int, typer.Option(metavar="N", help="Straight elements that the outline is cut into.")
    ] = 30,
    output: Annotated[Path, typer.Option(metavar="FILE", help="File of the forces.")] = Path(
        "forces.csv"
    ),
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead of a text for people.")
    ] = False,
    force: Annotated[
        bool, typer.Option("--force", help="Overwrite a file that rftfit did not write.")
    ] = False,
) -> None:
    """Predict force and moment on a leg or any outline that moves through a medium.

    Prints the peaks and writes every pose as csv. Force is that of the medium on the body, z up;
    a leg sweeps from the front (+x, negative theta) down and backward.
    """
    from rftfit.cli.predict_inputs import make_motion, make_outline
    from rftfit.cli.predict_intervals import predict_forces
    from rftfit.cli.predict_summary import as_json as json_of
    from rftfit.cli.predict_summary import as_text, find_peaks, shortened
    from rftfit.cli.predict_table import MARK, table_text
    from rftfit.cli.target import check_target
    from rftfit.store import write_text

    _check_together(medium, profile, results, method, alpha, se)
    inputs = AllAtOnce()
    with inputs.part():
        body = make_outline(leg, curvature, outline, width, elements)
    with inputs.part():
        motion = make_motion(hip, path)
    with inputs.part():
        # a value that cannot be wrong where none was given: the level is checked in any case
        check_test(0.9 if alpha is None else alpha, se or 0.0, confidence)
        source = _source(medium, profile, results, method, alpha, se or 0.0, confidence)
    inputs.check()
    check_target(output, MARK, "forces", force, (outline, path))
    prediction = predict_forces(source, body, motion.poses, confidence)
    peaks = find_peaks(motion, prediction)
    names = {
        "outline": f"{body.name}, {body.area_cm2:.4g} cm^2, {len(body.body)} elements",
        "motion": motion.name,
        "profile": source.name,
    }
    level = f"_lo and _hi: {100 * confidence:g} % interval, row by row" if prediction.ends else ""
    why = prediction.reason and f"empty cells: {shortened(prediction.reason)}"
    text = table_text(motion, prediction, [*names.values(), level, why])
    if as_json:
        say(json_of(names, motion, prediction, peaks, confidence, output))
    else:
        say("\n".join(f"{word.capitalize()}: {name}" for word, name in names.items()) + "\n")
        say(as_text(motion, prediction, peaks, confidence))
    needs_less = results is not None and profile in (None, "table", "depth_only")
    _warn_of(
        motion, prediction, "; --profile generic needs the cell (0, 90) only" if needs_less else ""
    )
    # after the numbers are out: a folder that cannot be written must not hide them
    write_text(output, text)
    if not as_json:
        say(f"Force and moment in {len(motion.poses)} poses: {output}")


def _check_together(
    medium: str | None, profile: str | None, results: Path | None, method: str | None,
    alpha: float | None, se: float | None,
) -> None:  # fmt: skip
    from rftfit.cli.predict_sources import PROFILES, choose

    if (medium is None) == (alpha is None):
        found = "no medium" if alpha is None else "--medium and --alpha"
        raise InputError(
            f"found {found}; allowed: one of --medium NAME (published, or with --results DIR of a "
            "campaign) and --alpha N/cm^3 (one penetration test)"
        )
    if profile is not None:
        allowed = PROFILES if alpha is None else ("generic",)
        more = "" if alpha is None else "one penetration test gives no other profile"
        choose("--profile", profile, allowed, more)
    if se is not None and alpha is None:
        raise InputError("--se is the standard error of --alpha, so it needs --alpha")
    if method is not None and results is None:
        raise InputError("--method chooses among the fits of a campaign, so it needs --results DIR")
    if method is not None and alpha is None and profile not in ("fourier", "generic"):
        raise InputError(
            "--method chooses among nine-term fits, so it needs --profile fourier or generic"
        )


def _source(
    medium: str | None, profile: str | None, results: Path | None, method: str | None,
    alpha: float | None, se: float, confidence: float,
) -> Source:  # fmt: skip
    from rftfit.cli.predict_results import from_campaign
    from rftfit.cli.predict_sources import from_print, from_test
    from rftfit.cli.scale_sources import from_results
    from rftfit.profile.reference_media import published

    if alpha is not None:
        reference = published() if results is None else from_results(results, method or "lsq")
        return from_test(reference, alpha, se, confidence)
    assert medium is not None
    if results is None:
        return from_print(medium, profile or "table")
    return from_campaign(results, medium, profile or "table", method or "lsq", confidence)


def _warn_of(motion: Motion, prediction: Prediction, hint: str) -> None:
    import numpy as np

    from rftfit.cli.predict_summary import shortened

    unknown, total = prediction.unknown, len(motion.poses)
    if unknown:
        warn(
            f"warning: no number in {unknown} of {total} poses, which are left out of the peaks: "
            f"{shortened(prediction.reason)}{hint}"
        )
    elif all((values == 0).all() for values in prediction.values.values()):
        warn("warning: no force in any pose: the outline stays above the surface, or does not move")
    lost = [
        np.isnan(end) & ~np.isnan(prediction.values[name])
        for name, ends in prediction.ends.items()
        for end in ends
    ]
    if lost and np.any(lost):
        count = np.count_nonzero(np.any(lost, axis=0))
        warn(f"warning: no interval in {count} of {total} poses: a cell of the table has none")
