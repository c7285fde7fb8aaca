"""Motion and ground reaction forces of a run over time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.conventions import FloatArray


@dataclass(frozen=True)
class Series:
    """Motion and forces, one entry a sample.

    Parameters
    ----------
    groups : tuple of str
        Plates of the body by name, then ``tripod_1``, ``tripod_2``, ...
    time_s : numpy.ndarray, shape (n,)
    x_cm, z_cm : numpy.ndarray, shape (n,)
        Centre of mass; z = 0 is the free surface.
    pitch_deg : numpy.ndarray, shape (n,)
        From z toward x, as every angle: nose down is positive.
    velocity_x_cm_per_s, velocity_z_cm_per_s, pitch_rate_deg_per_s : numpy.ndarray, shape (n,)
    leg_angle_deg : numpy.ndarray, shape (n,)
        theta of the legs of phase 0 relative to the body, growing without end.
    moment_N_cm : numpy.ndarray, shape (n,)
        Of all granular forces about the centre of mass, from z toward x.
    drive_moment_N_cm : numpy.ndarray, shape (n,)
        That the drive of all legs gives: against the granular forces' moment about the hips.
    force_z_N, force_x_N : dict of str to numpy.ndarray, shape (n,)
        By group: the ground's reaction.
    """

    groups: tuple[str, ...]
    time_s: FloatArray
    x_cm: FloatArray
    z_cm: FloatArray
    pitch_deg: FloatArray
    velocity_x_cm_per_s: FloatArray
    velocity_z_cm_per_s: FloatArray
    pitch_rate_deg_per_s: FloatArray
    leg_angle_deg: FloatArray
    moment_N_cm: FloatArray
    drive_moment_N_cm: FloatArray
    force_z_N: dict[str, FloatArray]
    force_x_N: dict[str, FloatArray]

    @classmethod
    def of(
        cls, groups: tuple[str, ...], time: FloatArray, turned: FloatArray, rows: FloatArray
    ) -> Series:
        """Name the columns of the stepper's samples.

        Parameters
        ----------
        groups : tuple of str
        time, turned : numpy.ndarray, shape (n,)
            s, and the angle of the legs of phase 0, rad.
        rows : numpy.ndarray, shape (n, 9 + 2 groups)

        Returns
        -------
        Series
        """
        x, z, pitch, vx, vz, pitch_rate, _, moment, against = rows[:, :9].T
        force_z = {name: rows[:, 9 + 2 * index] for index, name in enumerate(groups)}
        force_x = {name: rows[:, 10 + 2 * index] for index, name in enumerate(groups)}
        degrees = np.degrees
        return cls(
            groups, time, x, z, degrees(pitch), vx, vz, degrees(pitch_rate), degrees(turned),
            moment, -against, force_z, force_x,
        )  # fmt: skip

    @property
    def states(self) -> FloatArray:
        """States (n, 6) for `rftfit.robot.plain.forces`: x, z (cm), pitch (rad), their rates."""
        return np.column_stack(
            [
                self.x_cm, self.z_cm, np.radians(self.pitch_deg), self.velocity_x_cm_per_s,
                self.velocity_z_cm_per_s, np.radians(self.pitch_rate_deg_per_s),
            ]
        )  # fmt: skip

    def table(self) -> pd.DataFrame:
        """All of it as a table, units in the names; forces as ``force_z_tripod_1_N``.

        Returns
        -------
        pandas.DataFrame
        """
        import pandas as pd

        columns = {
            name: getattr(self, name)
            for name in self.__dataclass_fields__
            if name not in ("groups", "force_z_N", "force_x_N")
        }
        for name in self.groups:
            columns[f"force_z_{name}_N"] = self.force_z_N[name]
            columns[f"force_x_{name}_N"] = self.force_x_N[name]
        return pd.DataFrame(columns)
