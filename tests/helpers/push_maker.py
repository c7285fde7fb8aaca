"""The one maker of pushes: readings of one push of a plate with known alpha, noise, law and faults."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from log_maker import TextLog

LONGEST_S = 19.0
"""From the first to the last reading: rest, 15 cm of way at 1 cm/s, rest."""


@dataclass(frozen=True)
class MadePush:
    """One push of a plate on a straight path, and how its two logs are recorded.

    `alpha_z`, `alpha_x`: N/cm^3. `gamma_deg`: Of the path, 90 straight down. `exponent`: p of stress = alpha depth^p,
    with the stress of p = 1 at 5 cm. `crust_N_per_cm2`: Stress of a crust from the surface on. `rod_N_per_cm`: Force on
    the rod per depth along its path. `surface_mm`: True height of the free surface above 0 of the stage. `noise_N`:
    Standard deviation of a reading. `zero_N`: Reading of both channels in air. `start_s`: Of the clock. `seed`: Of the
    noise, or the generator that goes on from one push to the next. `force_unit`: N, mN, kN or gf. `length_unit`: mm, cm
    or m. `faults`: Reading to the factor or value that replaces the force there, by ``dead`` (all readings that value),
    ``lost`` (these readings are missing) or ``spike`` (these readings have that value).
    """

    alpha_z: float = 0.35
    alpha_x: float = 0.0
    gamma_deg: float = 90.0
    area_cm2: float = 15.0
    exponent: float = 1.0
    crust_N_per_cm2: float = 0.0
    rod_N_per_cm: float = 0.0
    surface_mm: float = 0.0
    noise_N: float = 0.02
    zero_N: float = 0.0
    gain: float = 1.0
    start_s: float = 0.0
    readings_per_s: float = 20.0
    seed: int | np.random.Generator = 1
    force_unit: str = "N"
    length_unit: str = "mm"
    faults: Mapping[str, object] = field(default_factory=dict)

    @property
    def time_s(self):
        """Time of each reading, of both logs."""
        return self.start_s + np.arange(0, LONGEST_S, 1 / self.readings_per_s)

    @property
    def way_cm(self):
        """Way along the path at each reading."""
        return self.way_at(self.time_s)

    def way_at(self, time_s):
        """Way along the path: 2 s of rest, 15 cm at 1 cm/s from 5 cm before 0 of the stage, rest."""
        return np.clip(time_s - self.start_s - 2, 0, 15) - 5

    @property
    def depth_cm(self):
        """Depth of the plate's middle below the surface, 0 above it."""
        below_stage_cm = self.way_cm * np.sin(np.radians(self.gamma_deg))
        return np.maximum(below_stage_cm + self.surface_mm / 10, 0)

    @property
    def stress_N_per_cm2(self):
        """Stress z and x without noise, shape (2, n)."""
        shape = 5.0 * (self.depth_cm / 5.0) ** self.exponent
        crust = self.crust_N_per_cm2 * (self.depth_cm > 0)
        return np.stack([self.alpha_z * shape + crust, self.alpha_x * shape])

    @property
    def forces_N(self):
        """Readings z and x, shape (2, n)."""
        random = np.random.default_rng(self.seed)
        gamma = np.radians(self.gamma_deg)
        rod = self.rod_N_per_cm * np.outer([np.sin(gamma), np.cos(gamma)], self.depth_cm)
        force = self.stress_N_per_cm2 * self.area_cm2 + rod
        noise_x_N, noise_z_N = self.noise_N * random.standard_normal(force.shape)
        force = force + np.stack([noise_z_N, noise_x_N])
        force = self.gain * force + self.zero_N
        if "dead" in self.faults:
            force = np.full_like(force, float(str(self.faults["dead"])))
        spikes = self.faults.get("spike")
        if isinstance(spikes, Mapping):
            force[0, [*spikes]] = [*spikes.values()]
        return force

    def log(self, **layout):
        """Both logs as one text: time in s, forces and positions in the units of the push."""
        gamma = np.radians(self.gamma_deg)
        newton, cm = NEWTONS[self.force_unit], CENTIMETRES[self.length_unit]
        columns = {
            "time": self.time_s,
            "Fx": self.forces_N[1] / newton,
            "Fz": self.forces_N[0] / newton,
            "x": -self.way_cm * np.cos(gamma) / cm,
            "z": -self.way_cm * np.sin(gamma) / cm,
        }
        lost = self.faults.get("lost", ())
        kept = np.setdiff1d(np.arange(self.time_s.size), np.asarray(lost, dtype=int))
        units = {"time": "s", "Fx": self.force_unit, "Fz": self.force_unit}
        units |= dict.fromkeys("xz", self.length_unit)
        return TextLog(
            {name: values[kept] for name, values in columns.items()},
            units,
            **({"decimals": 9} | layout),
        )


NEWTONS = {"N": 1.0, "mN": 1e-3, "kN": 1e3, "gf": 9.80665e-3}
CENTIMETRES = {"mm": 0.1, "cm": 1.0, "m": 100.0}
