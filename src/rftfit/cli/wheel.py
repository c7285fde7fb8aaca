"""``rftfit wheel``: options of drawbar, torque and sinkage of a rolling wheel at its load; its table and figure.

Drawbar is the force (N) that the wheel can pull with, sinkage the depth (cm) of the lowest point of its rim, slip the share
by which it turns faster than it moves.
"""

from __future__ import annotations

import warnings
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import rftfit
from rftfit.cli import options
from rftfit.cli.output import (
    check_picture,
    check_target,
    print_answer,
    print_line,
    write_csv,
    write_picture,
)
from rftfit.errors import CollectedErrors, InputError, LimitWarning

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.forces.mesh import Mesh
    from rftfit.model.profiles import Profile

MARK = "# wheel written by rftfit wheel"
"""Beginning of the first line of a table of this command: only tables with it are overwritten unasked."""

_DRAWN = "drawn by rftfit wheel"
"""Mark in a figure: only figures with it are overwritten unasked."""


@options.grouped
def wheel(
    *,
    mesh: Annotated[
        Path | None,
        options.file_option("The wheel: stl, obj or ply; its axle lies along y through (0, 0, 0)."),
    ] = None,
    unit: options.MeshUnit = None,
    drawing: Annotated[
        str | None,
        options.word_option(
            "RADIUS,WIDTH[,LUG,LUGS[,THICKNESS]]",
            "Instead of --mesh: radius and width of the rim, height, number and thickness (0.5) of straight lugs, in cm.",
        ),
    ] = None,
    slip: Annotated[
        str,
        options.word_option(
            "SLIP[,SLIP...]",
            "Slip of the rim, 0.2 for 20 % (below 0: it brakes), or several: a row each.",
        ),
    ],
    load: Annotated[
        str | None,
        options.word_option(
            "N[,N...]",
            "What the wheel carries, one number or one for each slip. Alone: its sinkage is solved. With "
            "--sinkage: the medium is taken as strong as it must be to carry the load there.",
        ),
    ] = None,
    sinkage: Annotated[
        str | None,
        options.word_option(
            "CM[,CM...]",
            "Depth of the lowest point of the rim, one number or one for each slip. Alone: the load is predicted.",
        ),
    ] = None,
    rim: options.RimRadius = None,
    friction: options.FrictionOfMesh = None,
    no_track: options.NoTrack = False,
    medium_options: options.MediumOptions,
    se: options.ErrorOfTest = None,
    confidence: options.Level = 0.95,
    model_error: Annotated[
        float | None,
        options.number_option(
            "EPS",
            "Error of the model on wheels: of the drawbar over the load, and of the torque over load times radius; default: "
            "as on measured rigs; 0: none.",
        ),
    ] = None,
    left_out: Annotated[
        str | None,
        options.word_option(
            "LABORATORY",
            "Leave a laboratory out of that default, for a wheel that is one of its rigs: Ding, KLS-1, Rashid-1, Kyoto, CMU.",
        ),
    ] = None,
    measured: Annotated[
        Path | None,
        options.file_option(
            "Measured points for the figure: a table with slip and any of drawbar_N, torque_N_cm, sinkage_cm, load_N."
        ),
    ] = None,
    figure: Annotated[
        Path | None,
        options.file_option(
            "Also a figure of drawbar, torque and sinkage over slip: png, svg or pdf."
        ),
    ] = None,
    output: Annotated[Path, options.file_option("File of the table, one row a slip.")] = Path(
        "wheel.csv"
    ),
    as_json: options.AsJson = False,
    force: options.Overwrite = False,
) -> None:
    """Predict drawbar, torque and sinkage of a wheel that rolls under a load, with intervals.

    Prints one row a slip and writes it as csv. Which faces count (rule) and the friction are named in every output.
    """
    from rftfit.forces.wheel import read_measured_runs

    medium_options.check(se)
    if measured is not None and figure is None:
        raise InputError("found --measured without --figure FILE, to which it belongs")
    # wheel, numbers and medium are read one after another, and one message names the errors of all
    inputs = CollectedErrors()
    shape: Mesh | None = None
    points: pd.DataFrame | None = None
    numbers: dict[str, list[float]] = {}
    with inputs.collect():
        shape = _read_wheel(mesh, unit, drawing)
    with inputs.collect():
        given = {"--slip": slip, "--load": load, "--sinkage": sinkage}
        numbers = {
            option: options.parse_numbers(option, value)
            for option, value in given.items()
            if value is not None
        }
        if load is None and sinkage is None:
            raise InputError(
                "found neither --load nor --sinkage; allowed: --load N, --sinkage CM, or both"
            )
    with inputs.collect():
        options.check_confidence(confidence)
        options.check_friction(friction)
        options.check_model_error(model_error)
    with inputs.collect():
        source = medium_options.find_profile(se, partial(_has_numbers, shape, friction))
    with inputs.collect():
        if measured is not None:
            points = read_measured_runs(measured)
    inputs.check()
    if drawing is not None and rim is None:
        rim = options.parse_numbers("--drawing", drawing)[0]
    read = (mesh, measured, medium_options.profile_file, medium_options.pushes)
    check_target(output, MARK, "table", force, read)
    check_picture(figure, _DRAWN, force)
    assert shape is not None
    try:
        with warnings.catch_warnings():
            # the answer has these sentences among its notes, which are printed
            warnings.simplefilter("ignore", LimitWarning)
            answer = rftfit.wheel(
                source,
                shape,
                numbers["--slip"],
                sinkage_cm=_one_or_all(numbers.get("--sinkage")),
                load_N=_one_or_all(numbers.get("--load")),
                friction=friction,
                track=not no_track,
                rim_cm=rim,
                confidence=confidence,
                model_error=model_error,
                left_out=left_out,
            )
    except ValueError as error:
        raise InputError(str(error)) from error
    files = {"table": str(output)} | ({"figure": str(figure)} if figure else {})
    print_answer(answer, as_json, **files)
    # after the numbers are out: a folder that cannot be written must not hide them
    write_csv(output, answer.table, MARK, [*answer.lines, *answer.notes], digits=9)
    if figure is not None:
        write_picture(figure, rftfit.draw_wheel(answer, points), _DRAWN)
    if not as_json:
        print_line(f"\nTable: {output}" + (f"; figure: {figure}" if figure else ""))


_WITHOUT_LUGS = (0.0, 0.0, 0.5)
"""Height (cm), number and thickness (cm) of lugs where the drawing states none."""


def _read_wheel(mesh: Path | None, unit: str | None, drawing: str | None) -> Mesh:
    """Read the wheel from its mesh, or make it from its drawing; `unit`: of the mesh. None: the option was not given."""
    if (mesh is None) == (drawing is None):
        raise InputError("allowed: either --mesh FILE --unit UNIT or --drawing RADIUS,WIDTH,...")
    if drawing is not None:
        if unit is not None:
            raise InputError("found --unit without --mesh FILE, to which it belongs")
        sizes = options.parse_numbers("--drawing", drawing)
        # radius and width are needed; what the drawing lacks of the three numbers behind them comes from the end of the defaults
        numbers = [*sizes, *_WITHOUT_LUGS[len(sizes) - 2 :]]
        if len(sizes) not in (2, 4, 5) or numbers[3] != int(numbers[3]):
            raise InputError(
                f"--drawing: found '{drawing}'; allowed: RADIUS,WIDTH or RADIUS,WIDTH,LUG,LUGS or "
                "RADIUS,WIDTH,LUG,LUGS,THICKNESS, in cm, LUGS a whole number"
            )
        radius, width, lug, lugs, thickness = numbers
        try:
            return rftfit.Mesh.wheel(radius, width, lug, int(lugs), thickness)
        except ValueError as error:
            raise InputError(f"--drawing: {error}") from error
    assert mesh is not None
    if unit is None:
        raise InputError("--unit: of the mesh; allowed: mm, cm, m, in")
    return options.read_mesh(mesh, unit)


def _has_numbers(shape: Mesh | None, friction: float | None, table: Profile) -> bool:
    """Return True where a table has alpha in every direction of the wheel, so that no map is needed.

    True also where the wheel could not be read (`shape` is None), whose error is reported anyway.
    """
    from rftfit.forces.wheel import has_number

    return shape is None or has_number(table, shape, friction)


def _one_or_all(numbers: list[float] | None) -> Any:
    """Return numbers of an option as `rftfit.wheel` takes them: a single one is for all slips, several are one for each.

    None: the option was not given.
    """
    return numbers[0] if numbers is not None and len(numbers) == 1 else numbers
