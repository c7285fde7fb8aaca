"""A channel that shows large forces too small bends the stress of strong directions more than that of weak ones."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from rftfit.checks.declared import CHECKS, MediumMeasurements


def pushes(bend_of_medium=0.0, compression=0.0, directions=20, repeats=3, seed=3):
    """Fits of pushes whose exponent is that of the medium less the compression of their force, z and x."""
    random = np.random.default_rng(seed)
    alpha = np.repeat(np.linspace(0.1, 1.0, directions), repeats)
    fits = pd.DataFrame(
        {
            "beta_deg": np.repeat(np.arange(directions), repeats) * 1.0,
            "gamma_deg": 90.0,
            "depth_to_cm": 8.0,
        }
    )
    exponent = 1 + bend_of_medium + random.normal(0, 0.04, alpha.size)
    for component, factor in (("z", 1.0), ("x", 0.3)):
        fits[f"alpha_{component}_N_per_cm3"] = factor * alpha
        bent = exponent - compression * factor * alpha
        fits[f"exponent_{component}"] = bent + random.normal(0, 0.01, alpha.size) / alpha
    return fits


TOLERATED = 0.03
"""Change of the exponent up to the largest force that is no fault."""


def error_of_trend(check):
    """Error of the change of the exponent, times a factor that depends on the number of directions alone."""
    return -check.values["least"] - TOLERATED


def judged(fits):
    config: Any = SimpleNamespace(grid=SimpleNamespace(angle_tolerance_deg=0.5))
    medium: Any = SimpleNamespace()
    return CHECKS["compression"].check(MediumMeasurements(config, medium, {}, {"fits": fits}, {}))


@pytest.mark.parametrize("bend_of_medium", [-0.2, 0.0, 0.3])
def test_a_medium_whose_stress_is_no_line_is_not_told(bend_of_medium):
    check = judged(pushes(bend_of_medium))
    assert check.verdict == "passed"
    assert error_of_trend(check) > 0


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("compression", "side"), [(0.15, "small"), (-0.15, "large")])
def test_compressed_forces_are_told_with_their_size(compression, side, seed):
    check = judged(pushes(0.1, compression, seed=seed))
    assert (check.verdict, check.code, check.values["side"]) == ("failed", "compression-told", side)
    assert check.values["change"] == pytest.approx(-compression, abs=0.05)


def test_few_directions_or_noise_do_not_tell():
    assert judged(pushes(directions=5)).code == "compression-few"
    few_runs = pushes(directions=6, repeats=1)
    noise = 0.3 * np.random.default_rng(1).standard_normal(len(few_runs))
    noisy = few_runs.assign(exponent_z=1 + noise, exponent_x=1 - noise)
    check = judged(noisy)
    assert (check.verdict, check.code) == ("not checked", "compression-open")
    without_exponents = pushes().assign(exponent_z=np.nan, exponent_x=np.nan)
    assert judged(without_exponents).code == "compression-few"


def test_patches_that_both_channels_feel_hide_less_than_those_of_one():
    fits = pushes()
    patches = np.random.default_rng(4).normal(0, 0.08, len(fits))
    common = fits.assign(
        exponent_z=fits["exponent_z"] + patches, exponent_x=fits["exponent_x"] + patches
    )
    of_both, of_z = judged(common), judged(common.assign(exponent_x=np.nan))
    assert error_of_trend(of_both) < 0.7 * error_of_trend(of_z)


def test_repeats_make_the_trend_better_known():
    once, four_times = (error_of_trend(judged(pushes(repeats=repeats))) for repeats in (1, 4))
    # what a medium may have of its own does not become smaller
    assert 0.4 * once < four_times < 0.75 * once
