"""Check of the axes of the force, and of the sign of beta, by the shape of known media: axes exchanged or reversed.

The evidence is the table ``axes`` (`rftfit.compare.axes`): a row for each mistake in the axes or in the sign of beta,
with its name in `axes` (``as-given``, ``x-reversed``, ``exchanged``, `BETA_REVERSED`, `PULLS` and so on) and in
`log_bayes_factor` the logarithm of how many times better it explains alpha than the given axes do.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rftfit.checks.declared import SOUND_ALPHA, Check, MediumMeasurements, Sentences, declare_check
from rftfit.measure.flags import Remark, format_remarks, remark
from rftfit.measure.verdict_words import BETA_AND_X_REVERSED, BETA_REVERSED, PULLS, UNUSABLE
from rftfit.store.chosen import chosen

CLEAR: float = chosen("checks", "evidence").axes
"""Log of the Bayes factor above which one choice of axes is clearly better than another."""

_CLEARLY = f"{math.exp(CLEAR):.0f} times"
"""Bayes factor of `CLEAR`, in words."""

_GIVEN_FIT_BEST = f"at least {_CLEARLY} better than any others"


class LikelierAxes(NamedTuple):
    """Axes, or a sign of beta, that explain alpha better than the given ones.

    `mistake`: What is wrong with the given ones. `stated_in`: Where a user mends it, such as ``transducer.axes``.
    """

    mistake: Remark
    stated_in: str


_STATED_IN = {
    BETA_REVERSED: "the sign of beta_deg, which is that of the left edge",
    BETA_AND_X_REVERSED: "both transducer.axes and the sign of beta_deg",
}
"""Where a wrong sign of beta in all runs is mended, by its name; wrong axes are in `transducer.axes`."""


def find_likelier_axes(measured: MediumMeasurements) -> LikelierAxes | None:
    """Find other axes, of all runs, that explain alpha clearly better than the given ones; None where there are none.

    Other checks also use this: with wrong axes, forces look reversed or missing, and the medium seems to give energy.
    """
    axes = measured.tables["axes"]
    other_axes = axes[~axes["axes"].isin(["as-given", PULLS])].sort_values(
        "log_bayes_factor", ascending=False, kind="stable"
    )
    evidence = other_axes["log_bayes_factor"]
    if other_axes.empty or not evidence.iloc[0] > CLEAR:
        return None
    # several may be as likely: on vertical paths alone, another sign of beta does what x reversed does
    is_likely = (evidence > CLEAR) & (evidence >= evidence.iloc[0] - CLEAR)
    first, *others = other_axes["axes"][is_likely]
    mistake = remark(f"axes-{first}")
    if others:
        others_text = ", ".join(str(remark(f"axes-{name}")) for name in others)
        mistake = remark("axes-or", axes=mistake, others=others_text)
    of_axes = axes_are_stated_in(measured)
    if measured.config.table:
        return LikelierAxes(mistake, of_axes)
    stated_in = dict.fromkeys(_STATED_IN.get(name, of_axes) for name in (first, *others))
    return LikelierAxes(mistake, " and ".join(stated_in))


def axes_are_stated_in(measured: MediumMeasurements) -> str:
    """Say where axes of forces are stated: in the config, or by the columns of a table if the campaign is one."""
    return "the columns of the table" if measured.config.table else "transducer.axes"


@declare_check(
    "axes",
    title="axes of the force",
    effect=UNUSABLE,
    good="the axes of the force fit the shape of known media",
    fault="other axes or signs than the given ones fit the shape of known media",
    after=SOUND_ALPHA,
    needed=True,
    outcomes={
        "axes": Sentences(
            "the given axes explain alpha at least 10^{power:.0f} times better than any others",
            _GIVEN_FIT_BEST,
        ),
        "axes-others": Sentences(
            "with {axes} alpha is explained 10^{power:.0f} times better than as given, by the shape of known media",
            f"no axes explain alpha {_CLEARLY} better than the given ones",
            "axes or signs look wrong in all runs ({found}): look at {where}.",
        ),
        "axes-pulls": Sentences(
            "beta of pulls with the other sign explains alpha 10^{power:.0f} times better than the given one, by the shape of "
            "known media",
            "beta as given explains alpha of pulls at least as well",
            "beta of pulls has the wrong sign ({found}): look at beta_deg of runs with a negative gamma_deg.",
            "beta of pulls has the wrong sign",
        ),
        "axes-pulls-open": Sentences(
            "the given axes explain alpha at least 10^{power:.0f} times better than any others; these directions do not tell "
            "whether beta of pulls has the right sign",
            _GIVEN_FIT_BEST,
        ),
        "axes-beta-open": Sentences(
            "the given axes explain alpha at least 10^{power:.0f} times better than any others; these directions do not tell "
            "whether beta has the right sign",
            _GIVEN_FIT_BEST,
        ),
        "axes-open": Sentences("these directions do not tell the given axes from others: {axes}"),
        "axes-no-runs": Sentences("no run has both components of alpha"),
    },
)
def check_axes(measured: MediumMeasurements) -> Check:
    """Check that the given axes fit the shape of known media better than axes that a config may name by mistake.

    Other axes that fit clearly better fail the medium. Where some other axes fit nearly as well, nothing was checked;
    where only the sign of beta is open, the medium passes with an open question.
    """
    axes = measured.tables["axes"]
    evidence = dict(zip(axes["axes"], axes["log_bayes_factor"].astype(float), strict=True))
    # evidence: by the name of a mistake that concerns all runs
    for_pulls = evidence.pop(PULLS, -math.inf)
    evidence.pop("as-given", None)
    if not evidence:
        return Check.skip("axes", "axes-no-runs")
    if likelier_axes := find_likelier_axes(measured):
        power = max(evidence.values()) / math.log(10)
        mistake, stated_in = likelier_axes
        return Check.judge(
            "axes", False, code="axes-others", axes=mistake, power=power, where=stated_in
        )
    if for_pulls > CLEAR:
        return Check.judge("axes", False, code="axes-pulls", power=for_pulls / math.log(10))
    # the sign of beta is no question of the axes of the force
    for_beta = max(evidence.pop(name, -math.inf) for name in _STATED_IN)
    open_axes = [remark(f"axes-{name}") for name in evidence if evidence[name] > -CLEAR]
    if open_axes:
        return Check.skip("axes", "axes-open", axes=format_remarks(open_axes))
    power = -max(evidence.values()) / math.log(10)
    # neither for nor against is clear: the medium passes, with an open question
    code = "axes-pulls-open" if for_pulls > -CLEAR else "axes"
    if for_beta > -CLEAR:
        code = "axes-beta-open"
    return Check.judge("axes", True, code=code, power=power)
