"""Whether a channel shows large forces as it shows small ones: an amplifier near its end compresses them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from rftfit.checks.declared import SOUND_LOGS, Check, MediumMeasurements, Words, declare_check
from rftfit.checks.law import BEFOREHAND_DOF, Estimate
from rftfit.conventions import FloatArray
from rftfit.directions import number_rows
from rftfit.measure.alpha import column
from rftfit.measure.laws import PATCHES
from rftfit.measure.verdict_words import DOUBTFUL

TOLERATED, LIMIT = 0.03, 1.9
"""Change of the exponent up to the largest force that is no fault, and standard errors beyond it that are one: in 20 directions
three times 0.03 is one standard error (`make mixups`, `make sound`, 2026-11-29)."""

MOST_SEEN = 0.15
"""Where only a larger change would be told, nothing was checked: the largest force is about so much too small."""

_WEAKEST = 0.08
"""Share of the largest force below which a push tells nothing: its exponent follows the noise of its zero."""

_ZERO = 0.01
"""Error of the exponent by that of the zero, times the force relative to the largest."""

_FEWEST_DIRECTIONS = 6

_FOUND = "the exponent of stress over depth changes by {change:+.2f} from no force to the largest"
_ALLOWED = "{most:.2f} of either sign"


@declare_check(
    "compression",
    title="large forces",
    effect=DOUBTFUL,
    good="large forces are shown as small ones are",
    fault="large forces are shown otherwise than small ones",
    after=(*SOUND_LOGS, "surface"),
    outcomes={
        "compression": Words(_FOUND, _ALLOWED),
        "compression-told": Words(
            _FOUND,
            _ALLOWED,
            "{found}: the channels show the largest force some {percent:.0f} % too {side}. Look at the range of the "
            "amplifier, and hang known weights up to the largest force on the transducer.",
        ),
        "compression-few": Words(
            "fewer than {fewest} directions of pushes with a force that tells an exponent"
        ),
        "compression-open": Words(
            "a change of the exponent below {most:.2f} up to the largest force would not be told"
        ),
    },
)
def check_compression(measured: MediumMeasurements) -> Check:
    """Whether stress over depth bends the more, the larger the force is."""
    trend = trend_of_both(measured.tables["fits"])
    if trend is None:
        return Check.skip("compression", "compression-few", fewest=_FEWEST_DIRECTIONS)
    values: dict[str, Any] = {"change": trend.value, "most": TOLERATED + LIMIT * trend.se}
    if values["most"] > MOST_SEEN:
        return Check.skip("compression", "compression-open", most=values["most"])
    if abs(trend.value) <= values["most"]:
        return Check.judge("compression", True, **values)
    return Check.judge(
        "compression",
        False,
        code="compression-told",
        percent=100 * abs(trend.value),
        side="small" if trend.value < 0 else "large",
        **values,
    )


def trend_of_both(fits: pd.DataFrame) -> Estimate | None:
    """Change of the exponent up to the largest force of any channel, by the channels along z and x together.

    It takes the channels of a transducer to have amplifiers of one make: a force of so many newtons is bent alike in both.
    """
    largest_N = {
        component: float(np.nanmax(_forces(fits, component), initial=0.0)) for component in "zx"
    }
    changes, errors = [], []
    for component in "zx":
        if (trend := trend_of_exponent(fits, component)) is not None:
            ratio = max(largest_N.values()) / largest_N[component]
            changes.append(trend.value * ratio)
            errors.append(trend.se * ratio)
    if not changes:
        return None
    precision = 1 / np.square(errors)
    return Estimate(float(precision @ changes / precision.sum()), float(precision.sum() ** -0.5))


def _forces(fits: pd.DataFrame, component: str) -> FloatArray:
    """Force of each run at the end of its window, in proportion."""
    return np.asarray(
        np.abs(fits[column(component)].to_numpy(float)) * fits["depth_to_cm"].to_numpy(float)
    )


def trend_of_exponent(fits: pd.DataFrame, component: str) -> Estimate | None:
    """Change of the exponent of stress over depth from no force to the largest; None where too few directions tell it.

    A channel that shows F (1 - e F / F_max) lets stress grow with an exponent that is smaller by about e in the direction of
    the largest force, and less in others. What a medium does is alike in all directions, or differs without regard to the force.
    """
    exponent = fits[f"exponent_{component}"].to_numpy(float)
    force = _forces(fits, component)
    if not np.nanmax(force, initial=0.0) > 0:
        return None
    force = force / np.nanmax(force)
    is_clear = np.isfinite(exponent) & (force > _WEAKEST)
    runs = pd.DataFrame({"exponent": exponent, "force": force})[is_clear]
    directions = runs.groupby(number_rows(fits[is_clear]))
    if len(directions) < _FEWEST_DIRECTIONS:
        return None
    means, counts = directions.mean(), directions.size().to_numpy(float)
    return _fit_trend(means["force"].to_numpy(), means["exponent"].to_numpy(), counts)


def _fit_trend(force: FloatArray, exponent: FloatArray, runs: FloatArray) -> Estimate:
    """Slope of a line by least squares, with the scatter that directions show beside the usual one of `PATCHES`.

    An error of the zero bends a weak push more than a strong one.
    """
    weight = runs / (PATCHES**2 + (_ZERO / force) ** 2)
    terms = np.stack([np.ones(force.size), force])
    inverse = np.linalg.pinv(terms * weight @ terms.T)
    coefficients = inverse @ (terms * weight) @ exponent
    chi_square = float(weight @ (exponent - coefficients @ terms) ** 2)
    factor = (BEFOREHAND_DOF + chi_square) / (BEFOREHAND_DOF + force.size - 2)
    return Estimate(float(coefficients[1]), float(np.sqrt(factor * inverse[1, 1])))
