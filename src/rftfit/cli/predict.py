"""``rftfit predict``: forces on a leg or any outline in the plane, or on a mesh in space."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import rftfit
from rftfit.cli import options
from rftfit.cli.output import check_picture, check_target, comments, count, json_text, say, warn
from rftfit.errors import CollectedErrors, InputError
from rftfit.store.text import table

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.model.mesh import Mesh
    from rftfit.model.prediction import Peak

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
_IN_SPACE = {f"{what}_{axis}": f"largest {what} {axis}" for what in ("force", "moment") for axis in "xyz"}  # fmt: skip


@options.grouped
def predict(
    *,
    body: options.Body,
    mesh: Annotated[
        Path | None, options.file("Any body in space instead: stl, obj or ply, moved along --path.")
    ] = None,
    unit: Annotated[
        str | None, typer.Option(metavar="UNIT", help="Of the mesh: mm, cm, m or in.")
    ] = None,
    sheet: Annotated[
        bool, typer.Option("--sheet", help="The mesh is a thin sheet and need not be closed.")
    ] = False,
    known: options.Medium,
    se: options.ErrorOfTest = None,
    confidence: options.Level = 0.95,
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
    from rftfit.model.mesh_prediction import IN_SPACE
    from rftfit.model.prediction import QUANTITIES, find_peaks, largest_in_space
    from rftfit.store import write_bytes, write_text

    known.check(se)
    _check_words(body, mesh, unit, sheet, figure)
    inputs = CollectedErrors()
    shape: Any = None
    motion: Any = None
    with inputs.collect():
        shape = body.make_outline() if mesh is None else _read_mesh(mesh, str(unit), sheet)
    with inputs.collect():
        motion = body.make_motion() if mesh is None else rftfit.Motion3D.read(str(body.path))
    with inputs.collect():
        options.check_confidence(confidence)
        source = known.find(se or 0.0)
    inputs.check()
    read = (body.outline, body.path, known.profile_file, mesh)
    check_target(output, MARK, "forces", force, read)
    ending = check_picture(figure, "--figure", _DRAWN, force) if figure is not None else ""
    if mesh is not None:
        _warn_of_time(source, shape, len(motion.frames))
    forces = rftfit.predict(source, shape, motion, confidence)
    key, quantities = next(iter(motion.columns)), QUANTITIES if mesh is None else IN_SPACE
    if mesh is None:
        peaks = find_peaks(source, shape, motion, confidence)
    else:
        peaks = largest_in_space(forces, key)
    unknown = int(forces[list(quantities)].isna().any(axis=1).sum())
    reason = next((text for text in forces["reason"] if text), "")
    results = known.results
    if mesh is None:
        what, elements = "outline", f"{len(shape.body)} elements"
    else:
        what, elements = "mesh", f"{len(shape.faces)} triangles"
    names = {what: f"{shape.name}, {shape.area_cm2:.4g} cm^2, {elements}", "motion": motion.name}
    names["profile"] = source.name + (f", {results.as_posix()}" if results and known.medium else "")
    level = f"{100 * confidence:g} % interval" if source.spread is not None else ""
    notes = [*names.values(), level and f"_lo and _hi: {level}, row by row",
             reason and f"empty cells: {_shortened(reason)}"]  # fmt: skip
    if as_json:
        facts = {
            "confidence": confidence if level else None,
            "rows": len(forces),
            "rows_unknown": unknown,
            "reason": reason,
            "peaks_complete": unknown == 0,
            "peaks": _peaks_as_json(peaks, key, _IN_WORDS if mesh is None else _IN_SPACE),
            "forces": str(output),
        }
        say(json_text(names | facts))
    else:
        say("\n".join(f"{word.capitalize()}: {name}" for word, name in names.items()) + "\n")
        if unknown:
            # the greatest of a curve with gaps need not be its peak, and must not pass for it
            say(
                f"Not of the whole motion, but of the {count(len(forces) - unknown, 'pose')} with a number:\n"
            )
        say(_peaks_as_text(peaks, key, level))
        if level and known.medium and (left_out := _LEFT_OUT.get(known.profile or "table")):
            say(f"Not in the intervals: {left_out}.")
        if mesh is not None:
            say(f"\nNot in the intervals: the law in space may err by up to {forces['closure_N'].max():.3g} N "
                "(closure_N), if it errs alike on all faces.")  # fmt: skip
    if unknown:
        needs_less = results is not None and known.profile in (None, "table", "depth_only")
        warn(
            f"warning: no number in {unknown} of {len(forces)} poses, which are left out of the "
            f"peaks: {_shortened(reason)}"
            + ("; --profile map needs one push in any direction only" if needs_less else "")
        )
    _warn_of(forces, quantities, unknown)
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
        say(f"Force and moment in {len(forces)} poses: {output}"
            + (f"; figure: {figure}" if figure else ""))  # fmt: skip


def _check_words(
    body: options.Body, mesh: Path | None, unit: str | None, sheet: bool, figure: Path | None
) -> None:
    """Refuse options of a mesh without one, and those of an outline with one."""
    if mesh is None:
        given = {"--unit": unit is not None, "--sheet": sheet, "--figure": figure is not None}
        if found := [option for option, there in given.items() if there]:
            raise InputError(f"found {found[0]} without --mesh FILE, to which it belongs")
        return
    given = {"--width": body.width is not None, "--hip": body.hip is not None}
    if found := [*body.named, *(option for option, there in given.items() if there)]:
        raise InputError(f"found {' and '.join(found)} with --mesh; allowed: a mesh alone")
    needed = {
        "--unit, the unit of its coordinates: mm, cm, m or in": unit,
        "--path FILE, csv with t_s, x_cm, y_cm, z_cm, turn_x_deg, turn_y_deg, turn_z_deg": body.path,
    }
    if missing := [words for words, there in needed.items() if there is None]:
        raise InputError(f"--mesh needs {'; and '.join(missing)}")


def _read_mesh(file: Path, unit: str, sheet: bool) -> Mesh:
    """The mesh; what was mended in it is printed."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mesh = rftfit.Mesh.read(file, unit, sheet)
    for note in mesh.notes:
        warn(f"warning: {file}: {note}")
    return mesh


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


def _peaks_as_text(peaks: list[Peak], key: str, level: str) -> str:
    header = ["", "value", *(["lo", "hi"] if level else []), "unit", key]
    rows = []
    for peak in peaks:
        numbers = [f"{one:.4g}" for one in (peak.value, *([peak.lo, peak.hi] if level else []))]
        unit = "N cm" if peak.quantity.endswith("cm") else "N"
        rows.append([(_IN_WORDS | _IN_SPACE)[peak.name], *numbers, unit, f"{peak.at:g}"])
    if not rows:
        return "  no force in these poses"
    said = f"lo, hi: {level}, pose by pose." if level else "No intervals: the errors of this profile are not known."  # fmt: skip
    return f"{table(header, rows)}\n\n{said}"


def _peaks_as_json(
    peaks: list[Peak], key: str, names: dict[str, str]
) -> dict[str, dict[str, float] | None]:
    """Peaks by name; what is not there is None."""
    found: dict[str, dict[str, float] | None] = dict.fromkeys(names)
    for one in peaks:
        found[one.name] = {one.quantity: one.value, "lo": one.lo, "hi": one.hi, key: one.at}
    return found


def _table_text(forces: pd.DataFrame, notes: list[str]) -> str:
    """Forces by pose as csv below notes on what was predicted from what; an empty cell is NaN."""
    # + 0.0 so that nothing is called -0; whoever takes the numbers further loses nothing
    numbers = forces.drop(columns="reason") + 0.0
    text: Any = numbers.to_csv(index=False, float_format="%.12g", lineterminator="\n")
    return comments(MARK, notes) + str(text)


def _warn_of(forces: pd.DataFrame, quantities: tuple[str, ...], unknown: int) -> None:
    from rftfit.model.draws import end_names

    if not unknown and (forces[list(quantities)] == 0).all(axis=None):
        warn("warning: no force in any pose: the body stays above the surface, or does not move")
    ends = [(name, end) for name in quantities for end in end_names(name) if end in forces]
    lost = [forces[end].isna() & forces[name].notna() for name, end in ends]
    if poses := sum(map(any, zip(*lost, strict=True))):
        warn(
            f"warning: no interval in {poses} of {len(forces)} poses: no error of alpha is known there"
        )
