"""A tare gives its force where it was measured and is NaN elsewhere.

Tare: the force of the rod alone, or of the leg in air, which is subtracted from a run.
"""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pushes import plate_run

from rftfit.measure.ledger import RowStatus
from rftfit.measure.tare import Tare, tare_medium

DEPTH = np.linspace(0.5, 8.5, 801)


def rod(depth):
    return np.stack([0.02 * depth**2, -0.3 * depth])


TARE = Tare.from_samples("depth_cm", DEPTH, rod(DEPTH))
"""Made from samples of the force on a rod."""


def test_uneven_sampling_is_no_hole():
    random = np.random.default_rng(1)
    depth = np.sort(random.uniform(0, 8, 800))
    tare = Tare.from_samples("depth_cm", depth, rod(depth))
    assert np.mean(tare.covers(np.linspace(depth[0], depth[-1], 5000))) > 0.99


def test_a_tare_is_known_between_its_samples_and_in_no_hole():
    np.testing.assert_allclose(
        TARE.force_at(np.array([1.234, 5.001])), rod(np.array([1.234, 5.001])), atol=1e-5
    )
    keep = (DEPTH < 3) | (DEPTH > 4)
    holed = Tare.from_samples("depth_cm", DEPTH[keep], rod(DEPTH)[:, keep])
    asked = np.array([0.5, 2.9, 4.2, 8.5, 3.5, 0.499, 8.501, np.nan])
    is_known = [True] * 4 + [False] * 4
    assert holed.covers(asked).tolist() == is_known
    assert np.isfinite(holed.force_at(asked)).tolist() == [is_known] * 2


def test_two_samples_on_the_way_up_are_a_tare():
    tare = Tare.from_samples("depth_cm", np.array([2.0, 1.0]), np.array([[4.0, 3.0], [0.0, 1.0]]))
    np.testing.assert_allclose(tare.force_at(np.array([1.5])), [[3.5], [0.5]])
    # ten ordinary steps
    assert tare.longest_step == 10


def row(run_id, kind, tare_run="", direction="intrusion"):
    return plate_run(run_id, kind=kind, tare_run=tare_run, direction=direction, medium="sand")


@pytest.mark.parametrize("good_samples", [0, 1])
def test_what_becomes_of_each_leg(good_samples, paper_config):
    """One at the angles of its leg in air, one at others, and one whose leg in air has too few samples."""
    runs = [
        row("air", "leg_air", direction="rotation"),
        row("far", "leg", "air", "rotation"),
        row("near", "leg", "air", "rotation"),
        row("on_short", "leg", "short", "rotation"),
        row("short", "leg_air", direction="rotation"),
    ]
    position = np.linspace(1.0, 3.0, 21)
    why = np.full((5, 21), int(RowStatus.GOOD))
    why[4, good_samples:] = RowStatus.SATURATED
    columns = {"phase": "stroke", "x_cm": 0.0, "depth_cm": 1.0, "force_x_N": 0.0}
    samples = pd.DataFrame(
        {
            "run_id": pd.Categorical(np.repeat([run.run_id for run in runs], 21)),
            "angle_deg": np.concatenate([position, position + 100, *[position] * 3]),
            "force_z_N": np.concatenate([position, *[5 * position] * 3, position]),
            "why": why.ravel(),
        }
        | columns
    )
    campaign: Any = SimpleNamespace(
        runs_of=lambda _: runs, numbers={}, config=paper_config, holds_tare=lambda _: False
    )
    tared, tares, ledger = tare_medium(campaign, "sand", samples, pd.DataFrame())
    assert dict(zip(tares["run_id"], tares["reason_code"], strict=True)) == {
        "near": "",
        "far": "no-sample untared",
        "on_short": "tare-missing tare-empty",
        "short": "tare-empty",
    }
    counted = ledger.table().groupby(["file", "fate"])["rows"].sum()
    assert dict(counted) == {
        ("air.csv", "used"): 21,
        ("far.csv", "dropped"): 21,
        ("on_short.csv", "dropped"): 21,
        ("short.csv", "dropped"): good_samples,
    }
    assert (tared.loc[tared["run_id"] == "far", "why"] == RowStatus.UNTARED).all()
    of_near = tared[tared["run_id"] == "near"]
    np.testing.assert_allclose(of_near[["force_z_N", "tare_z_N"]], np.outer(position, [4, 1]))
