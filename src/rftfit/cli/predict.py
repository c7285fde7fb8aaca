"""``rftfit predict``: options of the forces on a leg, outline or mesh; what its answer warns of; the table of forces.

A *profile* is a function alpha(beta, gamma) of the medium: stress per depth, N/cm^3. Its *spread* is a stack of draws, alpha
with errors as likely as the measured ones, from which intervals follow. Forces (N) are those of the medium on the body.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import rftfit
from rftfit.cli import options
from rftfit.cli.output import (
    check_picture,
    check_target,
    print_answer,
    print_line,
    warn,
    write_csv,
    write_picture,
)
from rftfit.errors import CollectedErrors, InputError

if TYPE_CHECKING:
    from rftfit.forces.mesh import Mesh
    from rftfit.model.profiles import Profile

MARK = "# forces written by rftfit predict"
"""Beginning of the first line of a table of this command: only tables with it are overwritten unasked."""

_DRAWN = "drawn by rftfit predict"
"""Mark in a figure: only figures with it are overwritten unasked."""


@options.grouped
def predict(
    *,
    body: options.BodyOptions,
    mesh_options: options.MeshOptions,
    medium_options: options.MediumOptions,
    se: options.ErrorOfTest = None,
    confidence: options.Level = 0.95,
    model_error: options.ModelError = None,
    body_of: options.BodyOf = None,
    figure: Annotated[
        Path | None, options.file_option("Also a figure of the forces on a mesh: png, svg or pdf.")
    ] = None,
    output: Annotated[Path, options.file_option("File of the forces.")] = Path("forces.csv"),
    as_json: options.AsJson = False,
    force: options.Overwrite = False,
) -> None:
    """Predict force and moment on a leg, an outline or a mesh that moves through a medium.

    Prints the peaks and writes every pose as csv. Force is that of the medium on the body, z up;
    a leg sweeps from the front (+x, negative theta) down and backward.
    """
    medium_options.check(se)
    from rftfit.forces.bodies import set_in_motion
    from rftfit.forces.fineness import fine_enough
    from rftfit.forces.force_answer import ForceAnswer

    mesh_options.check(body, figure is not None)
    mesh = mesh_options.mesh
    # body, motion and medium are read one after another, and one message names the errors of all
    inputs = CollectedErrors()
    shape: Any = None
    motion: Any = None
    leg: options.MeasuredLeg | None = None
    with inputs.collect():
        if body_of is not None:
            medium_options = _choose_map(medium_options, model_error)
            leg = options.find_measured_leg(body_of, body)
            shape = leg.outline
            if body.path is None:
                body = replace(body, hip=leg.hip_cm)
        elif mesh is not None:
            shape = options.read_mesh(mesh, str(mesh_options.unit), mesh_options.sheet)
        else:
            shape = body.make_outline()
    with inputs.collect():
        if mesh is None:
            motion = body.make_motion()
        # a path can be read without the mesh; pressing and rolling begin at its lowest point
        elif shape is not None or body.path is not None:
            motion = mesh_options.make_motion(shape, body.path)
        # cut so fine that the force on each element is that at its middle
        if shape is not None and motion is not None:
            shape = fine_enough(shape, motion)

    def has_all_directions(table: Profile) -> bool:
        """Return True where a table has a number in every direction of the body, or body or motion could not be read."""
        is_read = shape is not None and motion is not None
        return not is_read or set_in_motion(shape, motion).is_covered_by(table)

    with inputs.collect():
        options.check_confidence(confidence)
        options.check_friction(mesh_options.friction)
        options.check_model_error(model_error)
        source = medium_options.find_profile(se, has_all_directions)
        _refuse_unmeasured_error(source, model_error)
    inputs.check()
    read = (body.outline, body.path, medium_options.profile_file, medium_options.pushes, mesh)
    check_target(output, MARK, "forces", force, read)
    check_picture(figure, _DRAWN, force)
    if mesh is not None:
        _warn_of_time(source, shape, len(motion.frames))
    results = medium_options.results
    folder = f"; folder {results.as_posix()}" if results and medium_options.medium else ""
    answer = ForceAnswer(
        source,
        shape,
        motion,
        confidence,
        friction=mesh_options.friction,
        model_error=model_error,
        body_error=None if leg is None else leg.body_error,
        origin=source.name + folder,
        left_out=_find_left_out(medium_options, source),
    )
    print_answer(answer, as_json, forces=str(output))
    # a table may lack directions of the body, which a map would have
    needs_less = results is not None and medium_options.kind in ("table", "depth_only")
    cure = "; --profile map needs one push in any direction only" if needs_less else ""
    config = rftfit.open(results).config if results else None
    beyond = rftfit.beyond_measured(source, shape, motion, config)
    for doubt in [*answer.list_doubts(cure), *beyond]:
        warn(f"warning: {doubt}")
    # after the numbers are out: a folder that cannot be written must not hide them
    # what is left of sums that cancel, such as the force across the motion of a symmetric mesh, becomes 0
    forces = answer.forces.round(9) if answer.in_space else answer.forces
    write_csv(output, forces.drop(columns="reason"), MARK, answer.notes, digits=12)
    if figure is not None:
        from rftfit.figures.space import draw_forces

        write_picture(figure, draw_forces(answer), _DRAWN)
    if not as_json:
        print_line(
            f"Force and moment in {len(answer.forces)} poses: {output}"
            + (f"; figure: {figure}" if figure else "")
        )


_LEFT_OUT = {
    "table": "how alpha runs between the directions of the table",
    "fourier": "what nine terms miss of alpha",
}
"""Errors of a force that its interval leaves out, by kind of profile."""


def _find_left_out(medium_options: options.MediumOptions, source: Profile) -> str:
    """Name the error that the intervals of a published or campaign's medium leave out by its kind of profile; empty: none."""
    if not medium_options.medium:
        return ""
    form = medium_options.kind or ("table" if source.form == "table" else "")
    return _LEFT_OUT.get(form, "")


def _choose_map(
    medium_options: options.MediumOptions, model_error: float | None
) -> options.MediumOptions:
    """Return the options with the map of the medium, because the error on a leg of --body-of was learned with maps.

    --model-error would state that error a second time, and is refused.
    """
    if model_error is not None:
        raise InputError("found --model-error and --body-of; allowed: one of them")
    if medium_options.profile not in (None, "map"):
        raise InputError(
            f"found --profile {medium_options.profile} with --body-of; allowed: map, beside which the error was learned"
        )
    return replace(medium_options, profile="map" if medium_options.medium else None)


def _refuse_unmeasured_error(profile: Profile, model_error: float | None) -> None:
    """Refuse a --model-error above 0 with a profile for which the error of the force model was never measured."""
    from rftfit.forces.model_error import eps_of

    try:
        eps_of(model_error, profile)
    except ValueError as error:
        raise InputError(f"--model-error: {error}") from error


_TRIANGLE_S = 5e-8
"""Time for the force on one triangle in one pose by one draw, s."""


def _warn_of_time(source: Any, mesh: Mesh, poses: int) -> None:
    """Warn where the forces by all draws of alpha, on all triangles in all poses, take more than a minute.

    `source`: Profile of the medium. `poses`: Number of poses of the motion.
    """
    from rftfit.model.profiles import Profile

    draws = len(source.spread.parameters[0]) if isinstance(source.spread, Profile) else 1
    if (minutes := draws * poses * len(mesh.faces) * _TRIANGLE_S / 60) > 1:
        warn(
            f"warning: {draws} draws of the medium through {poses} poses of {len(mesh.faces)} triangles take about "
            f"{minutes:.0f} minutes"
        )
