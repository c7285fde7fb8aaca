"""Files of measured forces on a leg or body by pose: their columns, their poses, errors that a file does not state.

A contact is one turn or one path of a body with the forces measured along it. Forces are those of the medium on the
body, N, up and toward +x positive.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from rftfit.campaign.problems import CampaignError, in_lines
from rftfit.campaign.rows import Schema, TableColumn, read_rows
from rftfit.errors import InputError
from rftfit.forces.body_error import BodyError
from rftfit.forces.contacts import Contact
from rftfit.forces.mesh import PATH as PATH_IN_SPACE
from rftfit.forces.mesh import Mesh, Motion3D
from rftfit.forces.motion import HIP_HEIGHT_CM, Motion, path, rotation
from rftfit.forces.motion import SCHEMA as PATH_IN_PLANE
from rftfit.forces.outlines import Outline
from rftfit.forces.plane import OutlineInMotion
from rftfit.forces.space import MeshInMotion
from rftfit.model.pushes import USUAL_PERCENT

_TURNS_BACK_DEG = 2.0
"""Turn of theta against its way, degrees, that is more than the noise of an encoder."""

_TURN = ("theta_deg",)
"""Columns of the poses of a leg that turns on its axle."""

_PATH = tuple(column.name for column in PATH_IN_PLANE.columns)
"""Columns of the poses of an outline on a path: ``t_s, x_cm, z_cm, angle_deg``."""

_SPACE = tuple(column.name for column in PATH_IN_SPACE.columns)
"""Columns of the poses of a mesh: ``t_s, x_cm, y_cm, z_cm, turn_x_deg, turn_y_deg, turn_z_deg``."""

_NUMBERS = (
    TableColumn(
        "theta_deg", meaning="angle of a leg from straight down, negative in front", unit="degrees"
    ),
    TableColumn("hip_cm", meaning="height of its axle above the surface", unit="cm"),
    *PATH_IN_SPACE.columns[:4],
    PATH_IN_PLANE.columns[3],
    *PATH_IN_SPACE.columns[4:],
    *(
        TableColumn(
            f"force_{axis}_N", meaning=f"force of the medium on the body along {axis}", unit="N"
        )
        for axis in "xyz"
    ),
    TableColumn(
        "error_N", meaning="standard error of each force, from bed to bed", unit="N", above=0.0
    ),
)
SCHEMA = Schema(
    "contacts",
    (
        TableColumn("contact", "name", "rows of one turn or one path", needed=False),
        *(replace(column, needed=False) for column in _NUMBERS),
    ),
    comments=True,
    others="warned",
)
"""Columns of a file of contacts, none of which each file needs: which poses it needs depends on the body."""


def read_contacts(
    file: Path,
    body: Outline | Mesh,
    hip_cm: float | None = None,
    body_error: BodyError | None = None,
) -> tuple[list[Contact], list[str]]:
    """Read measured forces on a body by pose, as contacts, and sentences to warn of.

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
        One for each name in the column ``contact``, in their order; a single one without that column.
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
    names = [column.name for column in _NUMBERS]
    columns = pd.DataFrame([row.number for row in rows], columns=names).dropna(axis=1, how="all")
    pose_columns = _choose_pose_columns(columns, body, file)
    forces = (MeshInMotion if isinstance(body, Mesh) else OutlineInMotion).force_names
    measured = columns.filter(forces)
    if measured.empty:
        raise InputError(f"{file}: no column {' or '.join(forces)}; no force was measured")
    if missing := [name for name in pose_columns if columns[name].isna().any()]:
        raise InputError(f"{file}: {missing[0]} is blank in some rows; each row needs its pose")
    # NaN in all rows where the file has no such column
    errors = columns.reindex(columns=["error_N"]).to_numpy(float)[:, 0]
    if np.isnan(errors).any():
        usual = USUAL_PERCENT / 100 * float(np.nanmax(measured.abs().to_numpy(float)))
        errors = np.where(np.isnan(errors), usual, errors)
        warnings.append(
            f"{file}: no error_N; each force is taken to be known to {usual:.3g} N, {USUAL_PERCENT:g} % of the largest"
        )
    labels = np.array([row.text.get("contact", "") for row in rows])
    contacts = []
    for label, of_contact in columns.groupby(labels, sort=False):
        name = f"{file.name}, contact {label}" if label else file.name
        try:
            motion = _motion_of_contact(of_contact, pose_columns, hip_cm)
            errors_of_contact = dict.fromkeys(forces, errors[of_contact.index])
            contact = Contact(
                body, motion, of_contact, errors_of_contact, body_error or BodyError(), name
            )
        except ValueError as error:
            message = str(error)
            raise InputError(
                message if message.startswith(name) else f"{name}: {message}"
            ) from error
        contacts.append(contact)
    return contacts, warnings


def _choose_pose_columns(
    columns: pd.DataFrame, body: Outline | Mesh, file: Path
) -> tuple[str, ...]:
    """Return the columns of the poses: `_SPACE` for a mesh; `_TURN` if the file has it, else `_PATH` for an outline.

    Raises InputError where the file has not all of them. `file`: for the message.
    """
    choices = (_SPACE,) if isinstance(body, Mesh) else (_TURN, _PATH)
    for names in choices:
        if set(names) <= set(columns):
            return names
    allowed = ", or ".join(", ".join(names) for names in choices)
    raise InputError(f"{file}: no pose of {body.name}; allowed: the columns {allowed}")


def _motion_of_contact(
    columns: pd.DataFrame, pose_columns: tuple[str, ...], hip_cm: float | None
) -> Motion | Motion3D:
    """Make the motion of a contact from its columns, one row a pose; raises ValueError where theta turns back.

    `pose_columns`: `_TURN`, `_PATH` or `_SPACE`. `hip_cm`: height of the axle where the file has none; None: that of
    the paper. All poses of a leg get one direction of turning: that of a leg that turns back would be wrong.
    """
    if pose_columns == _SPACE:
        return Motion3D.path(columns["t_s"], columns[[*_SPACE[1:4]]], columns[[*_SPACE[4:]]])
    if pose_columns == _PATH:
        return path(*(columns[name] for name in _PATH))
    theta = columns["theta_deg"].to_numpy()
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
