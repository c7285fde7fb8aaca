"""Why the scaled generic profile misses speeds that the measured table meets: one ingredient at a time.

``python studies/ingredients.py`` prints it for the paper's robot on loosely packed poppy seeds.

From the measured table to the generic coefficients there are four steps: nine terms are fitted to it,
terms below the threshold are dropped, the shape becomes the mean over five media, and its size becomes
zeta, which the fit has at (0, 90 deg) instead of what was measured. Each is taken alone. Then the nine
terms stand in for the table in one component or in some of its cells only, which says where it is that
they err.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.model.fourier import as_array, fit_lsq, kept_terms
from rftfit.model.profiles import FourierProfile, TableProfile
from rftfit.model.scaling import generic, vertical_penetration
from rftfit.reference import BETA_DEG, GAMMA_DEG, MEDIA, alpha_grid
from rftfit.reference import coefficients as printed
from rftfit.robot.run import Condition
from rftfit.robot.speeds import published_speeds, share_within, speed_errors
from rftfit.robot.sweep import mean_speed, optimum, run_all, speed_table

if TYPE_CHECKING:
    import numpy.typing as npt
    import pandas as pd

    from rftfit.conventions import FloatArray
    from rftfit.model.profiles import Profile
    from rftfit.robot.config import Robot

    Mask = npt.NDArray[np.bool_]

THRESHOLD = 0.05
"""Of the paper: a term is kept above so much of A00."""

_BETA, _GAMMA = np.meshgrid(np.radians(BETA_DEG), np.radians(GAMMA_DEG), indexing="ij")


def ingredients(medium: str) -> dict[str, Profile]:
    """Make the profiles of one published medium, each with one ingredient changed."""
    alpha = alpha_grid(medium)
    fits = {name: _fit(alpha_grid(name)) for name in MEDIA}
    trimmed_fits = {
        name: _fit(alpha_grid(name), kept_terms(fit, THRESHOLD)) for name, fit in fits.items()
    }
    full, trimmed = fits[medium], trimmed_fits[medium]
    zeta = float(vertical_penetration(trimmed))
    chi = float(alpha[0][3, -1]) / zeta
    # the mean of the tables themselves, as M0 is the mean of the coefficients
    sizes = {name: float(vertical_penetration(fit)) for name, fit in trimmed_fits.items()}
    shape = [
        np.mean([alpha_grid(name)[c] / sizes[name] for name in MEDIA], axis=0) for c in range(2)
    ]
    m0 = generic(np.stack([trimmed_fits[name] for name in MEDIA]))
    nine = FourierProfile(full).alpha(_BETA, _GAMMA)
    down, up = _GAMMA > 1e-9, _GAMMA < -1e-9
    level, flat = ~down & ~up, np.abs(_BETA) < 1e-9
    inclined = np.abs(np.abs(_BETA) - np.pi / 4) < np.pi / 4 - 1e-9
    negative, positive = inclined & (_BETA * _GAMMA < 0), inclined & (_BETA * _GAMMA > 0)

    def mixed(z: Mask | bool, x: Mask | bool) -> Profile:
        return TableProfile(np.where(z, nine[0], alpha[0]), np.where(x, nine[1], alpha[1]))

    def both(where: Mask) -> Profile:
        return mixed(where, where)

    return {
        "measured table": TableProfile(*alpha),
        "nine terms of it, at the cells of the table": TableProfile(*nine),
        "nine terms of it": FourierProfile(full),
        "the same, small terms dropped": FourierProfile(trimmed),
        "the same, times chi (measured size)": FourierProfile(chi * trimmed),
        "nine terms of Table S2": FourierProfile(as_array(printed(medium))),
        "mean table of five media, times zeta": TableProfile(zeta * shape[0], zeta * shape[1]),
        "measured table, over chi (size of zeta)": TableProfile(alpha[0] / chi, alpha[1] / chi),
        "printed M0 times printed zeta": FourierProfile(
            printed(medium)["zeta"] * as_array(printed("generic"))
        ),
        "generic M0 times zeta": FourierProfile(zeta * m0),
        "generic M0 times zeta and chi": FourierProfile(chi * zeta * m0),
        "table, nine terms in alpha_z alone": mixed(True, False),
        "table, nine terms in alpha_x alone": mixed(False, True),
        "table, nine terms where it moves down": both(down),
        "table, nine terms where it moves up": both(up),
        "table, nine terms where it moves level": both(level),
        "table, nine terms in alpha_z at (0, 0) alone": mixed(level & flat, False),
        "table, nine terms in alpha_z at level, but not (0, 0)": mixed(level & ~flat, False),
        "table, nine terms everywhere but at (0, 0)": both(~(level & flat)),
        "table, nine terms at beta gamma < 0": both(negative),
        "table, nine terms at beta gamma > 0": both(positive),
        "table, nine terms at beta = 0 and 90": both(~inclined),
    }


def _fit(alpha: tuple[FloatArray, FloatArray], keep: Mask | None = None) -> FloatArray:
    return fit_lsq(_BETA.ravel(), _GAMMA.ravel(), alpha[0].ravel(), alpha[1].ravel(), keep)


def compared(
    robot: Robot, profile: Profile, measured: pd.DataFrame, threads: int | None = None
) -> pd.DataFrame:
    """Run every measured condition, from one starting phase: a table as of `speed_errors`."""
    places = zip(measured["frequency_Hz"], measured["curvature_times_R"], strict=True)
    runs = run_all(robot, profile, [Condition(*place) for place in places], threads)
    return speed_errors(measured, mean_speed(speed_table(runs)).assign(profile="one"))


def summary(errors: pd.DataFrame) -> tuple[int, int, float, float, float]:
    """Sum up how near one profile comes, from the errors of `compared`.

    Returns the numbers of conditions within 20 and 35 %, and the mean error (%) of reversed legs
    (R'/r < 0) above 3 Hz, of nearly flat ones (|R'/r| < 0.5) below 2 Hz, and of all others.
    """
    curvature, frequency, error = (
        errors[name].to_numpy(float)
        for name in ("curvature_times_R", "frequency_Hz", "error_percent")
    )
    fast = (curvature < 0) & (frequency > 3)
    slow = (np.abs(curvature) < 0.5) & (frequency < 2)
    groups = (fast, slow, ~fast & ~slow)
    group_errors = [error[group & np.isfinite(error)] for group in groups]
    means = [float(values.mean()) if values.size else float("nan") for values in group_errors]
    return share_within(errors, 20)[0], share_within(errors, 35)[0], means[0], means[1], means[2]


def main() -> None:
    """Print a row for each ingredient."""
    from rftfit.robot.config import paper_robot

    medium = "poppy_LP"
    measured, robot = published_speeds(medium), paper_robot()
    print(
        f"| profile | within 20 % of {len(measured)} | within 35 % | reversed, above 3 Hz | "
        "nearly flat, below 2 Hz | others | best R'/r at 5 Hz |\n|---|---|---|---|---|---|---|"
    )
    for name, profile in ingredients(medium).items():
        near, far, *means = summary(compared(robot, profile, measured))
        best = optimum(robot, profile)[0]
        cells = " | ".join(f"{mean:+.0f} %" for mean in means)
        print(f"| {name} | {near} | {far} | {cells} | {best:.2f} |", flush=True)


if __name__ == "__main__":
    main()
