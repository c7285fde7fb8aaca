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
    with the stress of p = 1 at 5 cm. `crust_N_per_cm2`: Stress of a crust from the surface on. `noise_N`: Standard
    deviation of a reading. `zero_N`: Reading of both channels in air. `start_s`: Of the clock. `force_unit`: N, mN, kN or gf.
    `length_unit`: mm, cm or m. `faults`: Reading to the factor or value that replaces the force there, by ``dead``
    (all readings that value), ``lost`` (these readings are missing) or ``spike`` (these readings have that value).
    """

    alpha_z: float = 0.35
    alpha_x: float = 0.0
    gamma_deg: float = 90.0
    area_cm2: float = 15.0
    exponent: float = 1.0
    crust_N_per_cm2: float = 0.0
    noise_N: float = 0.02
    zero_N: float = 0.0
    gain: float = 1.0
    start_s: float = 0.0
    readings_per_s: float = 20.0
    seed: int = 1
    force_unit: str = "N"
    length_unit: str = "mm"
    faults: Mapping[str, object] = field(default_factory=dict)

    @property
    def time_s(self):
        """Time of each reading, of both logs."""
        return self.start_s + np.arange(0, LONGEST_S, 1 / self.readings_per_s)

    @property
    def way_cm(self):
        """Way along the path, from 5 cm before the surface to 10 cm behind it."""
        return np.clip(self.time_s - self.start_s - 2, 0, 15) - 5

    @property
    def depth_cm(self):
        """Depth of the plate's middle below the surface, 0 above it."""
        return np.maximum(self.way_cm * np.sin(np.radians(self.gamma_deg)), 0)

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
        force = self.stress_N_per_cm2 * self.area_cm2
        force = force + self.noise_N * random.standard_normal(force.shape)
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
