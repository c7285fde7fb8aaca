"""The simulated campaign has every run of the paper, each with its tare and a usable fit window."""

from __future__ import annotations

import numpy as np
import pytest

from rftfit import reference
from rftfit.campaign.config import Container
from rftfit.errors import InputError
from rftfit.lab.plan import parse_directions, plan_runs, segments


def test_every_cell_of_table_s5_is_measured(runs):
    cells = set()
    for run in runs.values():
        if run.kind == "plate" and run.medium == "poppy_LP":
            assert run.beta_deg is not None
            assert run.gamma_deg is not None
            sign = -1 if run.direction == "extraction" else 1
            # one plate for -90 and 90 degrees
            for beta in {run.beta_deg, -run.beta_deg if run.beta_deg == 90 else run.beta_deg}:
                cells.add((sign * beta, round(sign * run.gamma_deg, 2)))
    assert cells == {
        (beta, round(gamma, 2)) for beta in reference.BETA_DEG for gamma in reference.GAMMA_DEG
    }


def test_unknown_medium(config):
    with pytest.raises(InputError, match="did you mean 'poppy_LP'"):
        plan_runs(config, ["popy_LP"])


def test_too_small_a_container(config):
    small = config.model_copy(
        update={"container": Container(length_cm=17, width_cm=22, depth_cm=15)}
    )
    with pytest.raises(InputError, match="no fit window"):
        segments(plan_runs(small, ["poppy_LP"])[20], small)


@pytest.mark.parametrize(("count", "apart_deg"), [(40, 6.0), (250, 6.0), (500, 3.0)])
def test_scattered_directions_are_apart(count, apart_deg):
    """No two are taken for one, and straight down is among them."""
    beta, gamma = np.array(parse_directions(f"scattered:{count}", 7)).T
    assert (beta[0], gamma[0]) == (0, 90)
    beta_apart = np.abs((beta - beta[:, None] + 90) % 180 - 90)
    apart = np.maximum(beta_apart, np.abs(gamma - gamma[:, None]))
    assert apart[~np.eye(count, dtype=bool)].min() >= apart_deg


def test_more_directions_than_there_is_room_for_are_refused():
    with pytest.raises(InputError, match="scattered"):
        parse_directions("scattered:501", 7)
