"""The clock of a session is found from its pushes straight down within its error, or refused.

Session: all runs between two settings of the clocks.
"""

import math
import re
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from paper import paper_config

from rftfit.measure.flags import Refused
from rftfit.measure.session_clocks import SessionClocks, flags_of_clock

ESTIMATE = paper_config().clock.model_copy(update={"method": "estimate"})
"""The clocks are to be found from the force."""
START_S = 1.7e9
"""Beginning of the day, s since 1970."""
TIME = np.array([0.0, 30.0])
BUILD_UP_S = 0.02
"""Error of an offset that all pushes have in common, since a force needs some travel to build up."""


def push(name, time_s, offset_s, se_s=0.03, session="", **changes):
    """A push that was aligned by itself; what it says of the drift is the prior."""
    row = {"run_id": name, "medium": "sand", "session": session, "reason": "", "reason_code": ""}
    row |= {"offset_s": offset_s, "reference_s": START_S + time_s, "se_s": se_s, "drift": 0.0}
    row |= {"drift_se": ESTIMATE.max_drift, "offset_hours": 0.0, "explained": 0.999}
    return row | changes


def pushes(count, offset_s=-2.4, drift=8e-6, seed=0, every_s=300.0, se_s=0.03, **changes):
    """Pushes of a day at one offset and drift, each with an error of its own."""
    own_s = math.sqrt(se_s**2 - BUILD_UP_S**2)
    noise = np.random.default_rng(seed).normal(0, own_s, count)
    times = every_s * np.arange(count)
    offsets = offset_s + drift * times + noise
    return [
        push(f"p{place:02d}", time, offset, se_s, **changes)
        for place, (time, offset) in enumerate(zip(times, offsets, strict=True))
    ]


def clocks(rows):
    return SessionClocks.of_pushes([pd.DataFrame(rows)], ESTIMATE)


def row(name, session=""):
    return SimpleNamespace(run_id=name, session=session)


def clock_of(rows):
    """Clock, at the beginning of the day, of a run that shows no offset of its own."""
    return clocks(rows).of_run(row("r"), TIME + START_S, 1.0)


def test_strokes_of_one_log_count_once():
    first_strokes = pushes(6)
    again = [push | {"run_id": f"{push['run_id']}b"} for push in first_strokes]
    assert clock_of([*first_strokes, *again]) == clock_of(first_strokes)


def test_pushes_that_scatter_more_than_their_errors_widen_that_of_the_clock():
    wide = pushes(12)
    for place, push in enumerate(wide):
        push["offset_s"] += 0.06 * (-1) ** place
    # what all pushes have in common is no scatter
    wild_s2, calm_s2 = (clock_of(rows).se_s ** 2 - BUILD_UP_S**2 for rows in (wide, pushes(12)))
    assert wild_s2 > 4 * calm_s2


def refusal(rows, later_s=0.0):
    """The reason for which a run that shows no offset of its own has no clock."""
    with pytest.raises(Refused) as caught:
        clocks(rows).of_run(row("r"), TIME + START_S + later_s, 0.1)
    return caught.value.remark


def test_a_run_far_from_the_pushes_is_refused_with_the_value_that_was_found():
    refused_run = refusal(pushes(2), later_s=20_000)
    assert (refused_run.code, refused_run.values["pushes"]) == ("session-uncertain", 2)
    assert -3 < refused_run.values["offset"] < -2
    assert refused_run.values["seconds"] > refused_run.values["most"] == 0.1


RESTARTED = [
    *pushes(4),
    *[push | {"run_id": f"q{push['run_id']}", "offset_s": push["offset_s"] + 7.5,
             "reference_s": push["reference_s"] + 1200} for push in pushes(5, seed=1)],
]  # fmt: skip


def test_a_clock_that_was_restarted_is_told_with_what_was_found_for_which_runs():
    refused_run = refusal(RESTARTED)
    assert refused_run.code == "clocks-contradict"
    told = refused_run.values["pushes"]
    assert re.findall(r"[pq]+\d+|\d+ more|\+\d", told) == (
        ["p00", "p01", "p02", "1 more", "+5", "qp00", "qp01", "qp02", "2 more"]
    )
    # a push that shows its own offset keeps it, and says so
    session_clocks = clocks(RESTARTED)
    clock = session_clocks.of_run(row("qp02"), TIME + START_S, 0.1)
    assert clock.offset_s == pytest.approx(5.1, abs=0.1)
    assert clock.shared_se_s == BUILD_UP_S < clock.se_s
    flags = flags_of_clock(row("qp02"), session_clocks)
    assert [flag.code for flag in flags] == ["clock-by-itself"]
    # two pushes that need an impossible drift contradict each other, too
    assert refusal([push("a", 0, 0.0), push("b", 100, 3.0)]).code == "clocks-contradict"
