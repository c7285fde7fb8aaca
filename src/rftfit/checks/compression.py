"""Check that channels show large forces as they show small ones: an amplifier near its end compresses large forces.

A compressed force makes the exponent p of stress = k depth^p smaller, and the more so the larger the force.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.checks.declared import SOUND_LOGS, Check, MediumMeasurements, Sentences, declare_check
from rftfit.checks.law import BEFOREHAND_DOF
from rftfit.conventions import FloatArray
from rftfit.directions import number_rows
from rftfit.measure.alpha import alpha_columns
from rftfit.measure.laws import PATCHES
from rftfit.measure.slopes import student_limit
from rftfit.measure.verdict_words import DOUBTFUL
from rftfit.store.chosen import chosen

_CHOSEN = chosen("checks", "compression")

TOLERATED: float = _CHOSEN.tolerated
"""Change of the exponent up to the largest force that is no fault."""


_FOUND = "the exponent of stress over depth changes by {change:+.2f} from no force to the largest"
_ALLOWED = "{least:+.2f} to {most:+.2f}"


@declare_check(
    "compression",
    title="large forces",
    effect=DOUBTFUL,
    good="large forces are shown as small ones are",
    fault="large forces are shown otherwise than small ones",
    after=(*SOUND_LOGS, "surface"),
    outcomes={
        "compression": Sentences(_FOUND, _ALLOWED),
        "compression-told": Sentences(
            _FOUND,
            _ALLOWED,
            "{found}: the channels show the largest force some {percent:.0f} % too {side}. Look at the range of the "
            "amplifier, and hang known weights up to the largest force on the transducer.",
        ),
        "compression-few": Sentences(
            "fewer than {fewest} directions of pushes with a force that tells an exponent"
        ),
        "compression-open": Sentences(
            "a change of the exponent below {most:.2f} up to the largest force would not be told"
        ),
    },
)
def check_compression(measured: MediumMeasurements) -> Check:
    """Check that the exponent of stress over depth does not change with the size of the force.

    The limit of a smaller exponent is the narrower one, as this is what an amplifier does.
    """
    trend = fit_exponent_trend(measured.tables["fits"], measured.tolerance_deg)
    if trend is None:
        return Check.skip("compression", "compression-few", fewest=_CHOSEN.fewest_directions)
    # least and largest change of the exponent that passes
    least, most = (
        sign * (TOLERATED + student_limit(sure, trend.dof) * trend.se)
        for sign, sure in ((-1, _CHOSEN.sure), (1, _CHOSEN.sure_of_larger))
    )
    if -least > _CHOSEN.most_seen:
        return Check.skip("compression", "compression-open", most=-least)
    values: dict[str, Any] = {"change": trend.value, "least": least, "most": most}
    if least <= trend.value <= most:
        return Check.judge("compression", True, **values)
    return Check.judge(
        "compression",
        False,
        code="compression-told",
        percent=100 * abs(trend.value),
        side="small" if trend.value < 0 else "large",
        **values,
    )


class Trend(NamedTuple):
    """Change of the exponent from no force to the largest: `value`, its standard error, and the degrees of freedom of it."""

    value: float
    se: float
    dof: float


def fit_exponent_trend(fits: pd.DataFrame, tolerance_deg: float) -> Trend | None:
    """Fit the change of the exponent of stress over depth up to the largest force; None for too few directions.

    A channel that shows F (1 - e F / F_max) makes the exponent smaller by about e in the direction of the largest
    force, and by less in others. The exponent of a medium is the same in all directions, or differs independently of
    the force. Patches of a bed change both components of a push alike, so the difference between the channels along z
    and x in the same run shows most. Channels of one transducer have the same amplifiers, so the change depends on the
    force alone. `fits`: Table of fits. `tolerance_deg`: As in `MediumMeasurements`.
    """
    # force at the end of the window, for each cm^2 of plate: alpha times depth, z and x, shape (2, runs)
    force = np.abs(alpha_columns(fits)) * fits["depth_to_cm"].to_numpy(float)
    largest = float(np.nanmax(force, initial=0.0))
    if not largest > 0:
        return None
    force = force / largest
    # of stress over depth, (2, runs); NaN where no power fits
    exponent = np.stack([fits[f"exponent_{c}"].to_numpy(float) for c in "zx"])
    is_clear = np.isfinite(exponent) & (force > _CHOSEN.weakest)
    number = number_rows(fits, tolerance_deg)
    directions = [
        (is_clear[:, number == first], force[:, number == first], exponent[:, number == first])
        for first in np.unique(number[is_clear.any(axis=0)])
    ]
    if len(directions) < _CHOSEN.fewest_directions:
        return None
    return _fit_trend([_Direction.of_runs(*arrays) for arrays in directions])


class _Direction(NamedTuple):
    """Exponents of the k channels (z, x, or both) of a direction, means over its runs.

    `exponent`: shape (k,).
    `terms`: Terms of the linear model of an exponent, shape (k, 3): 1, for the exponent of the medium; +1/2 for z and
    -1/2 for x, for a difference between them; force relative to the largest, for the change that is looked for.
    `precision`: Inverse of the covariance of the exponents, shape (k, k).
    """

    exponent: FloatArray
    terms: FloatArray
    precision: FloatArray

    @classmethod
    def of_runs(
        cls, is_clear: npt.NDArray[np.bool_], force: FloatArray, exponent: FloatArray
    ) -> _Direction:
        """Average the runs of a direction; arrays of z and x, shape (2, n), `force` relative to the largest.

        `is_clear`: Numbers that count. Errors by patches of the bed are common to both channels, errors of the zero are
        not, and are larger where the force is weak.
        """
        counts = is_clear.sum(axis=1)
        has_runs = counts > 0
        mean_force, mean_exponent = (
            np.where(is_clear, values, 0.0).sum(axis=1)[has_runs] / counts[has_runs]
            for values in (force, exponent)
        )
        sides = np.array([0.5, -0.5])[has_runs]
        terms = np.stack([np.ones(sides.size), sides, mean_force], axis=1)
        zero_variance = np.diag((_CHOSEN.zero / mean_force) ** 2 / counts[has_runs])
        covariance = zero_variance + PATCHES**2 / is_clear.any(axis=0).sum()
        return cls(mean_exponent, terms, np.linalg.inv(covariance))


def _fit_trend(directions: list[_Direction]) -> Trend:
    """Fit the terms of `_Direction` by least squares, and return the last, the change with force.

    Its error combines the known errors, which count as `BEFOREHAND_DOF` degrees of freedom, and the scatter of the
    directions. The prior difference of the exponents of z and x is 0, with the standard deviation `_CHOSEN.unlike`.
    """
    from scipy.linalg import block_diag

    exponent = np.concatenate([direction.exponent for direction in directions])
    terms = np.concatenate([direction.terms for direction in directions])
    precision = block_diag(*(direction.precision for direction in directions))
    weighted = terms.T @ precision
    inverse = np.linalg.pinv(weighted @ terms + np.diag([0.0, _CHOSEN.unlike**-2, 0.0]))
    coefficients = inverse @ weighted @ exponent
    residual = exponent - terms @ coefficients
    # three terms, of which the prior knows one
    dof = BEFOREHAND_DOF + max(exponent.size - 2, 0)
    factor = (BEFOREHAND_DOF + float(residual @ precision @ residual)) / dof
    return Trend(float(coefficients[2]), math.sqrt(factor * inverse[2, 2]), dof)
