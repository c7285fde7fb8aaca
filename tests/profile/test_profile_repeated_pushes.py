"""Several pushes of one direction, as a field user makes them: their scatter is in the intervals."""

import json

import numpy as np
import pandas as pd
import pytest
from makers import MadePush, config_of_push, row_of_push, run_command, write_campaign
from paper import few_draws
from scipy.stats import binom
from seeds import seeds

import rftfit

EXACT_RIG = config_of_push(
    "time",
    {c: {"column": c, "unit": "mm"} for c in "xz"},
    errors=dict.fromkeys(("surface_run_mm", "surface_session_mm", "angle_deg", "turn_deg"), 0),
    fit={"missing_tare": "flag"},
)
"""A campaign whose pushes differ by their beds alone."""


def map_of(*alpha, **errors):
    pushes = pd.DataFrame(
        {"beta_deg": 0.0, "gamma_deg": 90.0, "alpha_z_N_per_cm3": alpha, **errors}
    )
    return rftfit.estimate_map(pushes)


def straight_down(sand):
    """Mean of the draws of alpha_z(0, 90 deg) and their standard deviation."""
    node = np.flatnonzero(np.isclose(sand.beta, 0) & np.isclose(sand.gamma, np.pi / 2))[0]
    return sand.alpha[0, node], sand.draws[:, 0, node].std()


def test_pushes_that_differ_by_more_than_their_errors_have_the_error_of_their_scatter():
    mean, error = straight_down(map_of(0.35, 0.55, 0.63))
    assert mean == pytest.approx(0.51, rel=0.02)
    # Student's quantile for two degrees of freedom, as a normal error
    sd = np.std([0.35, 0.55, 0.63], ddof=1) / np.sqrt(3) * 4.302653 / 1.959964
    assert error == pytest.approx(sd, rel=0.1)
    assert straight_down(map_of(0.35, 0.55, 0.63, se_z=0.02))[1] == pytest.approx(sd, rel=0.1)


def test_pushes_that_agree_are_no_better_than_their_errors():
    _, error = straight_down(map_of(0.51, 0.51, 0.51, se_z=0.03))
    assert error == pytest.approx(0.03 / np.sqrt(3), rel=0.1)


@few_draws()
def test_the_next_bed_differs_as_the_pushes_do():
    assert map_of(0.5).bed_spread == 0.05
    assert map_of(0.5, 0.5).bed_spread == pytest.approx(0.05, rel=1e-4)
    assert map_of(0.35, 0.55, 0.63).bed_spread == pytest.approx(
        0.28 * 4.302653 / 1.959964, rel=0.02
    )


@pytest.mark.statistics
@few_draws()
def test_means_of_pushes_hold_the_medium():
    """Beds of 15 %, three pushes each: the medium lies inside about as often as stated."""
    random = np.random.default_rng(11)
    media = seeds(40, 10)
    beds = 0.5 * np.exp(0.15 * random.standard_normal((media, 3)))
    centres, errors = np.transpose([straight_down(map_of(*alpha)) for alpha in beds])
    # two more than a binomial of 95 % misses once in a hundred times
    most_outside = binom.ppf(0.99, media, 0.05) + 2
    assert np.count_nonzero(np.abs(centres - 0.5) > 1.96 * errors) <= most_outside


@pytest.mark.parametrize("order", [(0.35, 0.55, 0.63), (0.63, 0.35, 0.55)])
def test_the_papers_routine_takes_their_mean(order, tmp_path):
    rows = "\n".join(f"0,90,{alpha}" for alpha in order)
    (tmp_path / "pushes.csv").write_text(f"beta_deg,gamma_deg,alpha_z_N_per_cm3\n{rows}\n")
    printed = json.loads(run_command(tmp_path, "scale", "--pushes", "pushes.csv", "--json").stdout)
    expected = rftfit.scale_by_paper(0.51)
    assert printed["zeta_of_the_papers_routine"]["value"] == pytest.approx(expected.zeta)


@pytest.mark.statistics
@pytest.mark.parametrize(
    "alpha", seeds([(0.84, 0.95, 0.90), (0.5, 0.51, 0.49), (0.5, 0.52)], [(0.84, 0.95, 0.90)])
)
def test_a_table_of_pushes_has_the_interval_of_a_campaign(alpha, tmp_path):
    """What `rftfit run` makes of logs of the same pushes, to the errors that only a campaign knows."""
    pushes = {
        f"p{number}": MadePush(alpha_z=value, noise_N=0.01, seed=number)
        for number, value in enumerate(alpha)
    }
    logs = {f"{name}.csv": push.log().text() for name, push in pushes.items()}
    rows = [row_of_push(run_id=name) for name in pushes]
    write_campaign(tmp_path, EXACT_RIG, rows=rows, logs=logs)
    result = "results/alpha/sand.csv"
    assert run_command(tmp_path, "run", result).returncode == 0
    [row] = pd.read_csv(tmp_path / result).to_dict("records")
    mean, error = straight_down(map_of(*alpha))
    assert row["alpha_z_N_per_cm3"] == pytest.approx(mean, rel=2e-3)
    half = (row["alpha_z_hi_N_per_cm3"] - row["alpha_z_lo_N_per_cm3"]) / 2
    assert 1.96 * error == pytest.approx(half, rel=0.05)
