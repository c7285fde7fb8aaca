"""``rftfit predict``: forces on a leg, or on any outline along any path."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import rftfit
from rftfit.campaign.problems import choose
from rftfit.cli import options
from rftfit.cli.output import check_target, comments, count, json_text, say, table, warn
from rftfit.cli.scale import check_test, reference_in
from rftfit.errors import AllAtOnce, InputError

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.model.motion import Motion
    from rftfit.model.outlines import Outline
    from rftfit.model.prediction import Peak
    from rftfit.model.profiles import Profile

MARK = "# forces written by rftfit predict"
"""How the first line of such a file begins: only these are overwritten unasked."""

_MOST_ELEMENTS = 10_000
_WIDTH_CM = 2.54
_MOST_CM = 1000.0
_LONGEST_REASON = 300

_IN_WORDS = {
    "lift": "peak lift (up)",
    "suction": "peak suction (down)",
    "thrust": "peak thrust (toward +x)",
    "drag": "peak drag (toward -x)",
    "moment": "peak moment (z toward x)",
    "moment_negative": "peak moment (x toward z)",
}


def predict(
    leg: options.LegName = None,
    curvature: Annotated[
        float | None,
        options.number(
            "R/r",
            "Leg of any curvature, 2R = 7.62 cm: 1 is the c-leg, 0 flat, -1 the reversed one.",
        ),
    ] = None,
    outline: Annotated[
        Path | None,
        options.file("Any outline: csv with x_cm, z_cm, points in order; it turns about (0, 0)."),
    ] = None,
    width: Annotated[
        float | None,
        options.number(
            "cm", "Width across the plane; 2.54 with --curvature, needed with --outline."
        ),
    ] = None,
    hip: Annotated[
        float | None,
        options.number(
            "cm", "Turn it about (0, 0) at this height, theta from -135 to 135 deg; default 2."
        ),
    ] = None,
    path: Annotated[
        Path | None,
        options.file("Move it along a path instead: csv with t_s, x_cm, z_cm, angle_deg."),
    ] = None,
    medium: options.MediumName = None,
    profile: options.ProfileKind = None,
    results: options.ResultsFolder = None,
    method: options.MethodName = None,
    alpha: options.AlphaOfTest = None,
    se: options.ErrorOfTest = None,
    confidence: options.Level = 0.95,
    profile_file: options.ProfileFile = None,
    elements: Annotated[
        int, typer.Option(metavar="N", help="Straight elements that the outline is cut into.")
    ] = 30,
    output: Annotated[Path, options.file("File of the forces.")] = Path("forces.csv"),
    as_json: options.AsJson = False,
    force: options.Overwrite = False,
) -> None:
    """Predict force and moment on a leg or any outline that moves through a medium.

    Prints the peaks and writes every pose as csv. Force is that of the medium on the body, z up;
    a leg sweeps from the front (+x, negative theta) down and backward.
    """
    from rftfit.model.prediction import QUANTITIES, find_peaks
    from rftfit.store import write_text

    check_choice(medium, profile, results, method, alpha, se, profile_file)
    inputs = AllAtOnce()
    with inputs.part():
        body = make_outline(leg, curvature, outline, width, elements)
    with inputs.part():
        motion = make_motion(hip, path)
    with inputs.part():
        check_test(alpha, se or 0.0, confidence)
        source = make_profile(medium, profile, results, method, alpha, se or 0.0, profile_file)
    inputs.check()
    check_target(output, MARK, "forces", force, (outline, path, profile_file))
    forces = rftfit.predict(source, body, motion, confidence)
    peaks = find_peaks(source, body, motion, confidence)
    unknown = int(forces[list(QUANTITIES)].isna().any(axis=1).sum())
    reason = next((text for text in forces["reason"] if text), "")
    names = {
        "outline": f"{body.name}, {body.area_cm2:.4g} cm^2, {len(body.body)} elements",
        "motion": motion.name,
        "profile": source.name + (f", {results.as_posix()}" if results and medium else ""),
    }
    level = f"{100 * confidence:g} % interval" if source.spread is not None else ""
    notes = [*names.values(), level and f"_lo and _hi: {level}, row by row",
             reason and f"empty cells: {shortened(reason)}"]  # fmt: skip
    if as_json:
        facts = {
            "confidence": confidence if level else None,
            "rows": len(forces),
            "rows_unknown": unknown,
            "reason": reason,
            "peaks_complete": unknown == 0,
            "peaks": _peaks_as_json(peaks, motion.key),
            "forces": str(output),
        }
        say(json_text(names | facts))
    else:
        say("\n".join(f"{word.capitalize()}: {name}" for word, name in names.items()) + "\n")
        if unknown:
            # the greatest of a curve with gaps need not be its peak, and must not pass for it
            say(f"Of the {count(len(forces) - unknown, 'pose')} with a number only:\n")
        say(_peaks_as_text(peaks, motion.key, level))
    if unknown:
        needs_less = results is not None and profile in (None, "table", "depth_only")
        warn(
            f"warning: no number in {unknown} of {len(forces)} poses, which are left out of the "
            f"peaks: {shortened(reason)}"
            + ("; --profile map and generic need the cell (0, 90) only" if needs_less else "")
        )
    _warn_of(forces, unknown)
    config = rftfit.open(results).config if results else None
    for limit in rftfit.beyond_measured(source, body, motion, config):
        warn(f"warning: {limit}")
    # after the numbers are out: a folder that cannot be written must not hide them
    write_text(output, table_text(forces, notes))
    if not as_json:
        say(f"Force and moment in {len(forces)} poses: {output}")


def check_choice(
    medium: str | None, profile: str | None, results: Path | None, method: str | None,
    alpha: float | None, se: float | None, file: Path | None = None,
) -> None:  # fmt: skip
    """Refuse words that do not go together; a medium is published, a campaign's, a test, or a file."""
    from rftfit.model.profiles import KINDS

    given = {"--medium": medium, "--alpha": alpha, "--profile-file": file}
    named = [option for option, value in given.items() if value is not None]
    if len(named) != 1:
        raise InputError(
            f"found {' and '.join(named) or 'no medium'}; allowed: one of --medium NAME (published, or "
            "with --results DIR of a campaign), --alpha N/cm^3 (one penetration test) and "
            "--profile-file FILE (written by rftfit export)"
        )
    others = {"--profile": profile, "--results": results, "--method": method}
    if file is not None and (
        found := [name for name, value in others.items() if value is not None]
    ):
        raise InputError(f"found {found[0]} with --profile-file; allowed: that file alone")
    if profile is not None:
        allowed = KINDS if alpha is None else ("generic",)
        more = "" if alpha is None else "one penetration test gives no other profile"
        choose("--profile", profile, allowed, more)
    if se is not None and alpha is None:
        raise InputError("--se is the standard error of --alpha, so it needs --alpha")
    if method is not None and results is None and alpha is None:
        raise InputError(
            "--method chooses among fits, so it needs --results DIR or --alpha; the published media "
            "have those of Table S2"
        )
    if method is not None and alpha is None and profile not in ("fourier", "generic"):
        raise InputError(
            "--method chooses among nine-term fits, so it needs --profile fourier or generic"
        )


def make_profile(
    medium: str | None, kind: str | None, results: Path | None, method: str | None,
    alpha: float | None, se: float = 0.0, file: Path | None = None,
) -> Profile:  # fmt: skip
    """Find the profile that was asked for, in words that `check_choice` has seen."""
    from rftfit.reference import MEDIA

    if file is not None:
        return rftfit.read_profile(file)
    if alpha is not None:
        return rftfit.scale(alpha, se, reference_in(results, method)).profile
    assert medium is not None
    if results is None:
        more = "published media; --results DIR for those of a campaign, --alpha for one penetration test"
        return rftfit.published_medium(choose("--medium", medium, MEDIA, more), kind or "table")
    campaign = rftfit.open(results)
    choose("--medium", medium, campaign.media, f"in {results}")
    return campaign[medium].profile(kind or "table", method)


def make_outline(
    leg: str | None, curvature: float | None, points: Path | None, width_cm: float | None,
    elements: int,
) -> Outline:  # fmt: skip
    """Make the outline that was asked for: a model leg, one of a curvature R/r, or a csv of points."""
    from rftfit.model.outlines import CURVATURES, arc, model_leg, read_outline

    given = {"--leg": leg, "--curvature": curvature, "--outline": points}
    named = [option for option, value in given.items() if value is not None]
    if len(named) != 1:
        raise InputError(
            f"found {' and '.join(named) or 'no outline'}; allowed: one of --leg "
            f"({', '.join(CURVATURES)}), --curvature R/r, --outline FILE with --width"
        )
    if not 1 <= elements <= _MOST_ELEMENTS:
        raise InputError(f"--elements: found {elements}; allowed: 1 to {_MOST_ELEMENTS}")
    if width_cm is not None and not 0 < width_cm <= _MOST_CM:
        raise InputError(f"--width: found {width_cm:g}; allowed: above 0, up to {_MOST_CM:g} cm")
    if leg is not None:
        choose("--leg", leg, tuple(CURVATURES))
        if width_cm is not None:
            raise InputError(
                f"--width: the model legs are {_WIDTH_CM:g} cm wide; allowed with --curvature "
                f"(c_leg is --curvature {CURVATURES['c_leg']:g}) and --outline"
            )
        return model_leg(leg, elements)
    if curvature is not None:
        if not -1 <= curvature <= 1:
            raise InputError(
                f"--curvature: found {curvature:g}; allowed: R/r from -1 (reversed c-leg) over 0 "
                "(flat) to 1 (c-leg)"
            )
        name = f"leg of curvature R/r = {curvature:g}"
        return arc(curvature, width_cm=width_cm or _WIDTH_CM, elements=elements, name=name)
    assert points is not None
    if width_cm is None:
        raise InputError("--outline needs --width, in cm: how wide the body is across the plane")
    return read_outline(points, width_cm, elements)


def make_motion(hip_cm: float | None, path: Path | None) -> Motion:
    """Make the motion that was asked for: a rotation about an axle, or a free path."""
    from rftfit.model.motion import HIP_HEIGHT_CM, read_path

    if path is None:
        height = HIP_HEIGHT_CM if hip_cm is None else hip_cm
        if not abs(height) <= _MOST_CM:
            raise InputError(f"--hip: found {height:g}; allowed: -{_MOST_CM:g} to {_MOST_CM:g} cm")
        return rftfit.rotation(None, height)
    if hip_cm is not None:
        raise InputError("--hip is for a rotation; with --path the height is in the file's z_cm")
    return read_path(path)


def shortened(reason: str) -> str:
    """Cut a reason that names dozens of cells."""
    return reason if len(reason) <= _LONGEST_REASON else f"{reason[:_LONGEST_REASON]} ..."


def _peaks_as_text(peaks: list[Peak], key: str, level: str) -> str:
    header = ["", "value", *(["lo", "hi"] if level else []), "unit", key]
    rows = []
    for peak in peaks:
        numbers = [peak.value, *([peak.lo, peak.hi] if level else [])]
        unit = "N cm" if peak.quantity.endswith("cm") else "N"
        rows.append(
            [_IN_WORDS[peak.name], *(f"{number:.4g}" for number in numbers), unit, f"{peak.at:g}"]
        )
    if not rows:
        return "  no force"
    said = f"lo, hi: {level}, pose by pose." if level else "No intervals: the errors of this profile are not known."  # fmt: skip
    return f"{table(header, rows)}\n\n{said}"


def _peaks_as_json(peaks: list[Peak], key: str) -> dict[str, dict[str, float] | None]:
    """Peaks by name; what is not there is None."""
    found: dict[str, dict[str, float] | None] = dict.fromkeys(_IN_WORDS)
    for peak in peaks:
        found[peak.name] = {
            peak.quantity: peak.value, "lo": peak.lo, "hi": peak.hi, key: peak.at
        }  # fmt: skip
    return found


def table_text(forces: pd.DataFrame, notes: list[str]) -> str:
    """Forces by pose as csv below notes on what was predicted from what; an empty cell is NaN."""
    # + 0.0 so that nothing is called -0; whoever takes the numbers further loses nothing
    numbers = forces.drop(columns="reason") + 0.0
    text: Any = numbers.to_csv(index=False, float_format="%.12g", lineterminator="\n")
    return comments(MARK, notes) + str(text)


def _warn_of(forces: pd.DataFrame, unknown: int) -> None:
    from rftfit.model.prediction import QUANTITIES, end_names

    if not unknown and (forces[list(QUANTITIES)] == 0).all(axis=None):
        warn("warning: no force in any pose: the outline stays above the surface, or does not move")
    lost = [
        forces[end].isna() & forces[name].notna()
        for name in QUANTITIES
        for end in end_names(name)
        if end in forces
    ]
    poses = sum(any(row) for row in zip(*lost, strict=True))
    if poses:
        warn(
            f"warning: no interval in {poses} of {len(forces)} poses: no error of alpha is known there"
        )
