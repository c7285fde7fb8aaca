"""Tables of measured forces on a leg or a body by pose: one contact or several."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from rftfit.campaign.problems import CampaignError, in_lines
from rftfit.campaign.rows import DraftRow, Schema, TableColumn, read_rows
from rftfit.conventions import FloatArray
from rftfit.errors import InputError
from rftfit.forces.body_error import BodyError
from rftfit.forces.contacts import Contact
from rftfit.forces.mesh import Mesh, Motion3D
from rftfit.forces.motion import HIP_HEIGHT_CM, Motion, path, rotation
from rftfit.forces.outlines import Outline
from rftfit.forces.plane import OutlineInMotion
from rftfit.forces.space import MeshInMotion
from rftfit.model.pushes import USUAL_PERCENT

_TURNS_BACK_DEG = 2.0
"""Turn of theta against its way, degrees, that is more than the noise of an encoder."""

_TURN = ("theta_deg",)
_PATH = ("t_s", "x_cm", "z_cm", "angle_deg")
_SPACE = ("t_s", "x_cm", "y_cm", "z_cm", "turn_x_deg", "turn_y_deg", "turn_z_deg")
"""Columns of the poses of a leg on its axle, of a body on a path, of a mesh."""


def _number_column(name: str, meaning: str, unit: str, above: float | None = None) -> TableColumn:
    """Declare a column of numbers that a file may lack."""
    return TableColumn(name, "number", meaning, needed=False, unit=unit, above=above)


SCHEMA = Schema(
    "contacts",
    (
        TableColumn("contact", "name", "rows of one turn or one path", needed=False),
        _number_column(
            "theta_deg", "angle of a leg from straight down, negative in front", "degrees"
        ),
        _number_column("hip_cm", "height of its axle above the surface", "cm"),
        _number_column("t_s", "time", "s"),
        *(_number_column(f"{axis}_cm", f"{axis} of the reference point", "cm") for axis in "xyz"),
        _number_column("angle_deg", "angle from z toward x", "degrees"),
        *(
            _number_column(f"turn_{axis}_deg", f"{axis} of the vector of rotation", "degrees")
            for axis in "xyz"
        ),
        *(
            _number_column(f"force_{axis}_N", f"force of the medium on the body along {axis}", "N")
            for axis in "xyz"
        ),
        _number_column("error_N", "standard error of each force, from bed to bed", "N", above=0.0),
    ),
    comments=True,
    others="warned",
)


def read_contacts(
    file: Path,
    body: Outline | Mesh,
    hip_cm: float | None = None,
    body_error: BodyError | None = None,
) -> tuple[list[Contact], list[str]]:
    """Read measured forces on a body by pose; returned with sentences to warn of.

    Parameters
    ----------
    file : Path
        csv, tsv or xlsx with columns of `SCHEMA`. A leg that turns about its axle has ``theta_deg``; a body on a path
        ``t_s, x_cm, z_cm, angle_deg``; a mesh ``t_s, x_cm, y_cm, z_cm, turn_x_deg, turn_y_deg, turn_z_deg``.
    body : Outline or Mesh
    hip_cm : float, optional
        Height of the axle where the file has no ``hip_cm``; default 2.
    body_error : BodyError, optional
        What the model gets wrong on this body, see `Contact`.

    Returns
    -------
    contacts : list of Contact
    warnings : list of str

    Raises
    ------
    InputError
        With every cell that is wrong, or with the column that is missing, or where a contact says nothing about the
        medium.
    """
    rows, problems = read_rows(file, SCHEMA)
    if any(problem.severity == "error" for problem in problems):
        raise CampaignError(problems)
    warnings = in_lines(problems)
    columns = {
        name: values
        for name in (column.name for column in SCHEMA.columns if column.form == "number")
        if np.isfinite(values := _numbers_of_column(rows, name)).any()
    }
    pose_columns = _choose_pose_columns(columns, body, file)
    labels = np.array([row.text.get("contact", "") for row in rows])
    forces = (MeshInMotion if isinstance(body, Mesh) else OutlineInMotion).force_names
    measured = [np.abs(columns[name]) for name in forces if name in columns]
    if not measured:
        raise InputError(f"{file}: no column {' or '.join(forces)}; no force was measured")
    if missing := [name for name in pose_columns if not np.isfinite(columns[name]).all()]:
        raise InputError(f"{file}: {missing[0]} is blank in some rows; each row needs its pose")
    errors = columns.get("error_N", np.full(len(rows), np.nan))
    if np.isnan(errors).any():
        usual = USUAL_PERCENT / 100 * max(float(np.nanmax(values)) for values in measured)
        errors = np.where(np.isnan(errors), usual, errors)
        warnings.append(
            f"{file}: no error_N; each force is taken to be known to {usual:.3g} N, {USUAL_PERCENT:g} % of the largest"
        )
    contacts = []
    for label in dict.fromkeys(labels.tolist()):
        rows_of_contact = labels == label
        of_contact = {name: values[rows_of_contact] for name, values in columns.items()}
        name = f"{file.name}, contact {label}" if label else file.name
        try:
            motion = _motion_of_contact(of_contact, pose_columns, hip_cm)
            contact = Contact(
                body,
                motion,
                {force: of_contact[force] for force in forces if force in of_contact},
                dict.fromkeys(forces, errors[rows_of_contact]),
                body_error or BodyError(),
                name,
            )
        except ValueError as error:
            message = str(error)
            raise InputError(
                message if message.startswith(name) else f"{name}: {message}"
            ) from error
        contacts.append(contact)
    return contacts, warnings


def _numbers_of_column(rows: list[DraftRow], name: str) -> FloatArray:
    """Return the numbers of a column; NaN where a cell is blank."""
    return np.array([row.number.get(name, np.nan) for row in rows])


def _choose_pose_columns(
    columns: dict[str, FloatArray], body: Outline | Mesh, file: Path
) -> tuple[str, ...]:
    """Choose the columns of the poses: `_TURN`, `_PATH` or `_SPACE`."""
    choices = (_SPACE,) if isinstance(body, Mesh) else (_TURN, _PATH)
    for names in choices:
        if set(names) <= set(columns):
            return names
    allowed = ", or ".join(", ".join(names) for names in choices)
    raise InputError(f"{file}: no pose of {body.name}; allowed: the columns {allowed}")


def _motion_of_contact(
    columns: dict[str, FloatArray], pose_columns: tuple[str, ...], hip_cm: float | None
) -> Motion | Motion3D:
    """Make the motion of a contact from its columns; raises ValueError where theta turns back.

    `hip_cm`: height of the axle where the file has none.
    """
    if pose_columns == _SPACE:
        return Motion3D.path(
            columns["t_s"],
            np.stack([columns[name] for name in _SPACE[1:4]], axis=1),
            np.stack([columns[name] for name in _SPACE[4:]], axis=1),
        )
    if pose_columns == _PATH:
        return path(*(columns[name] for name in _PATH))
    theta = columns["theta_deg"]
    direction = np.sign(theta[-1] - theta[0])
    # how far theta lies behind the farthest angle so far
    back = np.maximum.accumulate(direction * theta) - direction * theta
    if direction and float(back.max()) > _TURNS_BACK_DEG:
        raise ValueError(
            f"theta turns back by {back.max():.3g} degrees; rows of each way are a contact of their own (column contact)"
        )
    height = HIP_HEIGHT_CM if hip_cm is None else hip_cm
    motion = rotation(theta, height, float(direction))
    if "hip_cm" in columns:
        poses = motion.poses.copy()
        poses[:, 1] = columns["hip_cm"]
        motion = replace(motion, name="turned about its axle", poses=poses)
    return motion
