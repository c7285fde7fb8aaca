"""A tare gives its force where it was measured and is NaN elsewhere.

Tare: the force of the rod alone, or of the leg in air, which is subtracted from a run.
"""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pushes import plate_run

from rftfit.measure.flags import remark
from rftfit.measure.ledger import Ledger, RowStatus
from rftfit.measure.tare import Tare, _tare_of, tare_medium

DEPTH = np.linspace(0.5, 8.5, 801)


def rod(depth):
    return np.stack([0.02 * depth**2, -0.3 * depth])


TARE = Tare.from_samples("depth_cm", DEPTH, rod(DEPTH))
"""Made from samples of the force on a rod."""


def test_between_its_samples():
    asked = np.array([0.5, 1.234, 5.001, 8.5])
    np.testing.assert_allclose(TARE.force_at(asked), rod(asked), atol=1e-5)
    assert TARE.covers(np.array([0.5, 8.5])).all()


@pytest.mark.parametrize("asked", [0.499, 8.501, -1.0, 100.0, np.nan])
def test_refuses_to_extrapolate(asked):
    assert TARE.covers(np.array([4.0, asked])).tolist() == [True, False]
    np.testing.assert_array_equal(
        np.isnan(TARE.force_at(np.array([4.0, asked]))), [[False, True]] * 2
    )


def test_refuses_a_hole_in_its_own_log():
    keep = (DEPTH < 3) | (DEPTH > 4)
    holed = Tare.from_samples("depth_cm", DEPTH[keep], rod(DEPTH)[:, keep])
    asked = np.array([2.9, 3.5, 4.2])
    assert holed.covers(asked).tolist() == [True, False, True]
    assert np.isfinite(holed.force_at(asked)).tolist() == [[True, False, True]] * 2


def test_uneven_sampling_is_no_hole():
    random = np.random.default_rng(1)
    depth = np.sort(random.uniform(0, 8, 800))
    tare = Tare.from_samples("depth_cm", depth, rod(depth))
    assert np.mean(tare.covers(np.linspace(depth[0], depth[-1], 5000))) > 0.99


@pytest.mark.parametrize("samples", [0, 1])
def test_too_few_samples(samples):
    why = np.full(3, RowStatus.SATURATED)
    why[:samples] = RowStatus.GOOD
    ledger, place = Ledger(), np.arange(3.0)
    stroke = dict.fromkeys(("depth_cm", "force_z_N", "force_x_N"), place) | {"why": why}
    assert _tare_of(row("rod1", "rod"), stroke, ledger) == remark(
        "tare-empty", tare="rod1", count=samples
    )
    counted = ledger.table()[["file", "fate", "reason_code", "rows"]]
    assert counted.to_numpy().tolist() == [["rod1.csv", "dropped", "tare-empty", samples]]


def test_two_samples_on_the_way_up_are_a_tare():
    tare = Tare.from_samples("depth_cm", np.array([2.0, 1.0]), np.array([[4.0, 3.0], [0.0, 1.0]]))
    np.testing.assert_allclose(tare.force_at(np.array([1.5])), [[3.5], [0.5]])
    # ten ordinary steps
    assert tare.longest_step == 10
    assert Tare.from_samples("depth_cm", DEPTH, rod(DEPTH)).longest_step == pytest.approx(0.1)


def row(run_id, kind, tare_run="", direction="intrusion"):
    return plate_run(run_id, kind=kind, tare_run=tare_run, direction=direction, medium="sand")


def test_a_leg_at_other_angles_than_its_tare_has_no_number(paper_config):
    air = row("air", "leg_air", direction="rotation")
    leg = row("leg", "leg", "air", "rotation")
    angle_deg = np.linspace(0.0, 20.0, 21)
    samples = pd.DataFrame(
        {
            "run_id": pd.Categorical(np.repeat(["air", "leg"], 21)),
            "phase": "stroke",
            "x_cm": 0.0,
            "depth_cm": 1.0,
            "angle_deg": np.append(angle_deg, angle_deg + 100),
            "force_z_N": 1.0,
            "force_x_N": 1.0,
            "why": int(RowStatus.GOOD),
        }
    )
    campaign: Any = SimpleNamespace(
        runs_of=lambda _: [air, leg], numbers={}, config=paper_config, holds_tare=lambda _: False
    )
    tared, tares, _ = tare_medium(campaign, "sand", samples, pd.DataFrame())
    assert list(tares["reason_code"]) == ["no-sample untared"]
    assert (tared["why"] == RowStatus.UNTARED).all()


def test_only_a_step_wider_than_the_longest_is_a_hole():
    position = np.array([0.0, 1.0, 3.0, 5.5])
    tare = Tare("depth_cm", position, rod(position), longest_step=2.0)
    assert tare.covers(np.array([0.5, 2.0, 4.0])).tolist() == [True, True, False]
