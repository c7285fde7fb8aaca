"""``rftfit predict``: forces on a leg or any outline in the plane, or on a mesh in space."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import rftfit
from rftfit.cli import options
from rftfit.cli.output import (
    check_picture,
    check_target,
    comments,
    count,
    json_text,
    print_line,
    warn,
)
from rftfit.errors import CollectedErrors, InputError
from rftfit.store.text import table

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.forces.mesh import Mesh, Motion3D
    from rftfit.forces.motion import Motion
    from rftfit.forces.outlines import Outline
    from rftfit.forces.peaks import Peak
    from rftfit.model.profiles import Profile

MARK = "# forces written by rftfit predict"
"""How the first line of such a file begins: only these are overwritten unasked."""

_DRAWN = "drawn by rftfit predict"
_LEFT_OUT = {
    "table": "how alpha runs between the directions of the table",
    "fourier": "what nine terms miss of alpha",
}
"""What the errors of alpha do not say of a force, by profile."""

_LONGEST_REASON = 300
_TRIANGLE_S = 5e-8

_IN_WORDS = {
    "lift": "peak lift (up)",
    "suction": "peak suction (down)",
    "thrust": "peak thrust (toward +x)",
    "drag": "peak drag (toward -x)",
    "moment": "peak moment (z toward x)",
    "moment_negative": "peak moment (x toward z)",
}
_IN_SPACE = {
    f"{what}_{axis}": f"largest {what} {axis}" for what in ("force", "moment") for axis in "xyz"
}


@options.grouped
def predict(
    *,
    body: options.BodyOptions,
    mesh: Annotated[
        Path | None,
        options.file(
            "Any body in space instead: stl, obj or ply, moved by --press, --roll or along --path."
        ),
    ] = None,
    press: Annotated[
        float | None,
        options.number_option(
            "cm", "Press the mesh straight down until its lowest point is so deep."
        ),
    ] = None,
    roll: Annotated[
        str | None,
        typer.Option(
            metavar="SINKAGE,SLIP",
            help="Roll a wheel, whose axle lies along y of the mesh, for one turn toward +x: depth of the lowest point of "
            "its rim in cm, and slip, 0.2 for 20 % (below 0: it brakes).",
        ),
    ] = None,
    rim: options.RimRadius = None,
    no_track: options.NoTrack = False,
    unit: Annotated[
        str | None, typer.Option(metavar="UNIT", help="Of the mesh: mm, cm, m or in.")
    ] = None,
    sheet: Annotated[
        bool, typer.Option("--sheet", help="The mesh is a thin sheet and need not be closed.")
    ] = False,
    friction: options.FrictionOfMesh = None,
    medium_options: options.MediumOptions,
    se: options.ErrorOfTest = None,
    confidence: options.Level = 0.95,
    model_error: options.ModelError = None,
    body_of: options.BodyOf = None,
    figure: Annotated[
        Path | None, options.file("Also a figure of the forces on a mesh: png, svg or pdf.")
    ] = None,
    output: Annotated[Path, options.file("File of the forces.")] = Path("forces.csv"),
    as_json: options.AsJson = False,
    force: options.Overwrite = False,
) -> None:
    """Predict force and moment on a leg, an outline or a mesh that moves through a medium.

    Prints the peaks and writes every pose as csv. Force is that of the medium on the body, z up;
    a leg sweeps from the front (+x, negative theta) down and backward.
    """
    medium_options.check(se)
    from rftfit.forces.model_error import eps_of, has_model_error
    from rftfit.forces.peaks import unknown_peaks
    from rftfit.forces.plane import PEAKS, QUANTITIES
    from rftfit.forces.prediction import predict_with_peaks
    from rftfit.forces.rolling import RULES, describe_friction
    from rftfit.forces.space import IN_SPACE, extremes_in_space
    from rftfit.store import write_bytes, write_text

    of_mesh = {
        "--unit": unit is not None,
        "--sheet": sheet,
        "--friction": friction is not None,
        "--figure": figure is not None,
        "--press": press is not None,
        "--roll": roll is not None,
        "--rim": rim is not None,
        "--no-track": no_track,
    }
    _check_words(body, mesh, unit, of_mesh, press, roll)
    if roll is None and (rim is not None or no_track):
        raise InputError(
            f"found {'--no-track' if no_track else '--rim'} without --roll SINKAGE,SLIP, to which it belongs"
        )
    inputs = CollectedErrors()
    shape: Any = None
    motion: Any = None
    leg: options.MeasuredLeg | None = None
    with inputs.collect():
        if body_of is not None:
            if model_error is not None:
                raise InputError("found --model-error and --body-of; allowed: one of them")
            if medium_options.profile not in (None, "map"):
                raise InputError(
                    f"found --profile {medium_options.profile} with --body-of; allowed: map, beside which the error was learned"
                )
            medium_options = replace(
                medium_options, profile="map" if medium_options.medium else None
            )
            leg = options.find_measured_leg(body_of, body)
            if body.path is None:
                body = replace(body, hip=leg.hip_cm)
        if leg is not None:
            shape = leg.outline
        else:
            shape = (
                body.make_outline() if mesh is None else options.read_mesh(mesh, str(unit), sheet)
            )
    with inputs.collect():
        if mesh is None:
            motion = body.make_motion()
        elif body.path is not None:
            motion = rftfit.Motion3D.read(body.path)
        elif shape is not None:
            motion = _make_motion(shape, press, roll, not no_track, rim)
    with inputs.collect():
        options.check_confidence(confidence)
        options.check_friction(friction)
        options.check_model_error(model_error)
        source = medium_options.find(se, partial(_is_whole, shape, motion))
        _check_error_of(source, model_error)
    inputs.check()
    body_error = None if leg is None else leg.body_error
    read = (body.outline, body.path, medium_options.profile_file, medium_options.pushes, mesh)
    check_target(output, MARK, "forces", force, read)
    ending = check_picture(figure, "--figure", _DRAWN, force) if figure is not None else ""
    if mesh is not None:
        _warn_of_time(source, shape, len(motion.frames))
    forces, peaks = predict_with_peaks(
        source,
        shape,
        motion,
        confidence,
        friction=friction,
        model_error=model_error,
        body_error=body_error,
    )
    key, quantities = next(iter(motion.columns)), QUANTITIES if mesh is None else IN_SPACE
    best = {name: forces[name].to_numpy(float) for name in quantities}
    looked_for = PEAKS if mesh is None else extremes_in_space(best)
    not_stated = unknown_peaks(best, looked_for, peaks)
    unknown = int(forces[list(quantities)].isna().any(axis=1).sum())
    reason = next((text for text in forces["reason"] if text), "")
    results = medium_options.results
    if mesh is None:
        what, elements = "outline", f"{len(shape.body)} elements"
    else:
        what, elements = "mesh", f"{len(shape.faces)} triangles"
    names = {what: f"{shape.name}, {shape.area_cm2:.4g} cm^2, {elements}", "motion": motion.name}
    names["profile"] = source.name + (
        f", {results.as_posix()}" if results and medium_options.medium else ""
    )
    eps = eps_of(model_error, source, shape)
    beside = None if source.beside is None else source.beside()
    if beside is not None:
        names["beside"] = beside.name
    rule = motion.rule if roll is not None else None
    if rule is not None:
        names["rule"] = f"{rule}: {RULES[rule]}"
    if rule is not None or friction is not None:
        names["friction"] = describe_friction(friction)
    percent = f"{100 * confidence:g} % interval"
    level = f"{percent} of alpha" if source.spread is not None else ""
    level_of_model = f"{percent} with the model's own error (eps {eps:g})" if eps else ""
    if body_error is not None:
        level_of_model = (
            f"{percent} with the model's own error on this body (eps {body_error.per_medium:.2g})"
        )
        names["body"] = body_error.words
    of_bed = f"{percent} of the next bed ({100 * source.bed_spread:.3g} % from bed to bed)"
    level_of_bed = of_bed if eps or body_error or (level and has_model_error(source)) else ""
    notes = [
        *names.values(),
        level and f"_lo and _hi: {level}, row by row",
        level_of_model and f"_model_lo and _model_hi: {level_of_model}, row by row",
        level_of_bed and f"_next_lo and _next_hi: {level_of_bed}, row by row",
        ""
        if beside is None
        else f"_beside: by {beside.name}; where it lies outside of _lo and _hi, these are empty",
        reason and f"empty cells: {_shortened(reason)}",
    ]
    if as_json:
        facts = {
            "confidence": confidence if level or eps else None,
            "model_error": eps,
            "rows": len(forces),
            "rows_unknown": unknown,
            "reason": reason,
            "peaks_complete": not not_stated,
            "peaks": _peaks_as_json(peaks, key, _IN_WORDS if mesh is None else _IN_SPACE),
            "model_error_known": has_model_error(source),
            "forces": str(output),
        }
        if "friction" in names:
            facts |= {"friction": friction}
        if rule is not None:
            facts |= {"rule": rule, "mean_of_turn": _means_of_turn(forces)}
        print_line(json_text(names | facts))
    else:
        print_line("\n".join(f"{word.capitalize()}: {name}" for word, name in names.items()) + "\n")
        print_line(_peaks_as_text(peaks, key, level, level_of_model, level_of_bed))
        for line in _limits_of_peaks(peaks, source, beside, level_of_model):
            print_line(line)
        if not_stated:
            # the greatest of a curve with gaps need not be its peak, and must not pass for it
            words = ", ".join((_IN_WORDS | _IN_SPACE)[name] for name in not_stated)
            print_line(
                f"Not stated, as it may lie in one of the {count(unknown, 'pose')} without a number: {words}."
            )
        kind = medium_options.kind or (
            "table" if medium_options.medium and source.form == "table" else ""
        )
        if level and medium_options.medium and (left_out := _LEFT_OUT.get(kind)):
            print_line(f"Not in the intervals: {left_out}.")
        if mesh is not None:
            if roll is not None:
                print_line(_format_means(_means_of_turn(forces)))
            print_line(
                f"\nNot in the intervals: the law in space may err by up to {forces['closure_N'].max():.3g} N "
                "(closure_N), in the worst case."
            )
    if unknown:
        needs_less = results is not None and medium_options.kind in ("table", "depth_only")
        warn(
            f"warning: no number in {unknown} of {len(forces)} poses: {_shortened(reason)}"
            + ("; --profile map needs one push in any direction only" if needs_less else "")
        )
    _warn_of(forces, quantities, unknown, beside)
    config = rftfit.open(results).config if results else None
    for limit in rftfit.beyond_measured(source, shape, motion, config):
        warn(f"warning: {limit}")
    # after the numbers are out: a folder that cannot be written must not hide them
    write_text(output, _table_text(forces if mesh is None else forces.round(9), notes))
    if figure is not None:
        from rftfit.figures.space import draw_forces
        from rftfit.figures.style import content

        drawn = draw_forces(forces, source, shape, motion, level)
        write_bytes(figure, content(drawn, ending, _DRAWN))
    if not as_json:
        print_line(
            f"Force and moment in {len(forces)} poses: {output}"
            + (f"; figure: {figure}" if figure else "")
        )


def _check_words(
    body: options.BodyOptions,
    mesh: Path | None,
    unit: str | None,
    of_mesh: dict[str, bool],
    press: float | None,
    roll: str | None,
) -> None:
    """Refuse options of a mesh without one, and those of an outline with one."""
    if mesh is None:
        if options_given := [option for option, is_given in of_mesh.items() if is_given]:
            raise InputError(f"found {options_given[0]} without --mesh FILE, to which it belongs")
        return
    given = {"--width": body.width is not None, "--hip": body.hip is not None}
    if options_given := [*body.named, *(option for option, is_given in given.items() if is_given)]:
        raise InputError(f"found {' and '.join(options_given)} with --mesh; allowed: a mesh alone")
    motions = {"--press": press, "--roll": roll, "--path": body.path}
    motions_given = [option for option, value in motions.items() if value is not None]
    if len(motions_given) > 1:
        raise InputError(f"found {' and '.join(motions_given)}; allowed: one of them")
    missing = []
    if unit is None:
        missing.append("--unit, the unit of its coordinates: mm, cm, m or in")
    if not motions_given:
        missing.append(
            "one of --press DEPTH (cm), --roll SINKAGE,SLIP (cm and a share) and --path FILE (csv with t_s, x_cm, y_cm, "
            "z_cm, turn_x_deg, turn_y_deg, turn_z_deg)"
        )
    if missing:
        raise InputError(f"--mesh needs {'; and '.join(missing)}")


def _make_motion(
    mesh: Mesh, press: float | None, roll: str | None, track: bool, rim: float | None
) -> Motion3D:
    """Press a mesh straight down, or roll it for one turn."""
    try:
        if press is not None:
            return rftfit.Motion3D.press(mesh, press)
        words = str(roll).split(",")
        if len(words) != 2:
            raise ValueError("two numbers wanted, sinkage in cm and slip, as 2,0.2")
        sinkage, slip = map(float, words)
        return rftfit.Motion3D.roll(mesh, sinkage, slip, track=track, rim_cm=rim)
    except ValueError as error:
        option = f"--press {press:g}" if press is not None else f"--roll {roll}"
        raise InputError(f"{option}: {error}") from error


def _means_of_turn(forces: pd.DataFrame) -> dict[str, float]:
    """Mean forces of a wheel over its turn."""
    drawbar, load, moment = (
        float(forces[name].mean(skipna=False))
        for name in ("force_x_N", "force_z_N", "moment_y_N_cm")
    )
    # the medium turns the wheel back: the drive gives the opposite moment
    return {"drawbar_N": drawbar, "load_N": load, "torque_N_cm": -moment}


def _format_means(means: dict[str, float]) -> str:
    return (
        f"\nMean over the turn: drawbar (toward +x) {means['drawbar_N']:.4g} N, load (up) {means['load_N']:.4g} N, "
        f"torque of the drive {means['torque_N_cm']:.4g} N cm."
    )


def _is_whole(
    body: Outline | Mesh | None, motion: Motion | Motion3D | None, table: Profile
) -> bool:
    """Tell whether a table has a number in every direction of a body that moves."""
    from rftfit.forces.bodies import set_in_motion

    return body is None or motion is None or set_in_motion(body, motion).knows(table)


def _check_error_of(profile: Profile, model_error: float | None) -> None:
    """Refuse an error of the model for a profile of which none is known."""
    from rftfit.forces.model_error import eps_of

    try:
        eps_of(model_error, profile)
    except ValueError as error:
        raise InputError(f"--model-error: {error}") from error


def _warn_of_time(source: Any, mesh: Mesh, poses: int) -> None:
    """Say beforehand that all draws through a fine mesh on a long path take minutes."""
    from rftfit.model.profiles import Profile

    draws = len(source.spread.parameters[0]) if isinstance(source.spread, Profile) else 1
    if (minutes := draws * poses * len(mesh.faces) * _TRIANGLE_S / 60) > 1:
        warn(
            f"warning: {draws} draws of the medium through {poses} poses of {len(mesh.faces)} triangles take about "
            f"{minutes:.0f} minutes; a mesh of 2000 triangles is within 1 % of a fine one"
        )


def _shortened(reason: str) -> str:
    """Cut a reason that names dozens of cells."""
    return reason if len(reason) <= _LONGEST_REASON else f"{reason[:_LONGEST_REASON]} ..."


def _peaks_as_text(
    peaks: list[Peak], key: str, level: str, level_of_model: str, level_of_bed: str
) -> str:
    ends = {
        ("lo", "hi"): level and f"{level}, of the mean over beds",
        ("model lo", "model hi"): level_of_model and f"{level_of_model}, of the mean over beds",
        ("next lo", "next hi"): level_of_bed,
    }
    header = ["", "value", *(name for names, words in ends.items() if words for name in names)]
    rows = []
    for peak in peaks:
        numbers = [peak.value]
        numbers += [peak.lo, peak.hi] if level else []
        numbers += [peak.model_lo, peak.model_hi] if level_of_model else []
        numbers += [peak.next_lo, peak.next_hi] if level_of_bed else []
        unit = "N cm" if peak.quantity.endswith("cm") else "N"
        words = (_IN_WORDS | _IN_SPACE)[peak.name]
        rows.append([words, *(_cell(number) for number in numbers), unit, f"{peak.position:g}"])
    if not rows:
        return "  no force in these poses that can be stated"
    intervals_text = [f"{', '.join(names)}: {words}" for names, words in ends.items() if words]
    if not level:
        intervals_text.insert(0, "No interval of alpha: the errors of this profile are not known")
    text = ".\n".join(intervals_text)
    return (
        f"{table([*header, 'unit', key], rows)}\n\n{text}."
        if intervals_text
        else table([*header, "unit", key], rows)
    )


def _cell(number: float) -> str:
    """Format a number; one that is not known is empty, and nothing is called -0."""
    return "" if math.isnan(number) else f"{number + 0.0:.4g}"


def _peaks_as_json(
    peaks: list[Peak], key: str, names: dict[str, str]
) -> dict[str, dict[str, float | str] | None]:
    """Peaks by name; what is not there is None."""
    peak_by_name: dict[str, dict[str, float | str] | None] = dict.fromkeys(names)
    for peak in peaks:
        peak_by_name[peak.name] = {
            peak.quantity: peak.value,
            "lo": peak.lo,
            "hi": peak.hi,
            "model_lo": peak.model_lo,
            "model_hi": peak.model_hi,
            "next_lo": peak.next_lo,
            "next_hi": peak.next_hi,
            "beside": peak.beside,
            "withheld": peak.withheld,
            key: peak.position,
        }
    return peak_by_name


def _table_text(forces: pd.DataFrame, notes: list[str]) -> str:
    """Forces by pose as csv below notes on what was predicted from what; an empty cell is NaN."""
    # + 0.0 so that nothing is called -0; whoever takes the numbers further loses nothing
    numbers = forces.drop(columns="reason") + 0.0
    text: Any = numbers.to_csv(index=False, float_format="%.12g", lineterminator="\n")
    return comments(MARK, notes) + str(text)


def _limits_of_peaks(
    peaks: list[Peak], source: Profile, beside: Profile | None, level_of_model: str
) -> list[str]:
    """Write what stands in the place of intervals that are not there, and why."""
    from rftfit.forces.model_error import has_model_error
    from rftfit.forces.peaks import STEEP, STEEP_DEG, describe_beside

    names = _IN_WORDS | _IN_SPACE
    lines = []
    if not has_model_error(source):
        lines.append(
            f"No interval with the model's own error: it was measured by tables and maps, and is not that of {source.form}."
        )
    if beside is not None:
        lines += [
            f"{names[peak.name]}: {describe_beside(peak, source.form, beside.form)}."
            for peak in peaks
        ]
    instead = "; the interval with the model's own error includes that" if level_of_model else ""
    lines += [
        f"{names[peak.name]}: no interval of alpha: {STEEP_DEG:g} degrees of the attack angle change it by "
        f"{100 * peak.steepness:.0f} %, and pushes around do not tell where alpha is so steep{instead}."
        for peak in peaks
        if peak.withheld == STEEP
    ]
    return lines


def _warn_of(
    forces: pd.DataFrame, quantities: tuple[str, ...], unknown: int, beside: Profile | None
) -> None:
    from rftfit.model.draws import end_names

    if not unknown and (forces[list(quantities)] == 0).all(axis=None):
        warn("warning: no force in any pose: the body stays above the surface, or does not move")
    ends = [(name, end) for name in quantities for end in end_names(name) if end in forces]
    lost = [forces[end].isna() & forces[name].notna() for name, end in ends]
    # beside the table of the same medium the head of the file says it
    if beside is None and (poses := sum(map(any, zip(*lost, strict=True)))):
        warn(
            f"warning: no interval in {poses} of {len(forces)} poses: no error of alpha is known there"
        )
