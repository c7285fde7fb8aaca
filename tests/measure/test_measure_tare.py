"""A tare knows where it holds, and is NaN elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from rftfit.campaign.sheet import Run
from rftfit.measure.ledger import DROPPED, Ledger, RowStatus
from rftfit.measure.strokes import Samples
from rftfit.measure.tare import Tare, _tare_of

DEPTH = np.linspace(0.5, 8.5, 801)


def rod(depth: np.ndarray) -> np.ndarray:
    return np.stack([0.02 * depth**2, -0.3 * depth])


TARE = Tare.from_samples("depth_cm", DEPTH, rod(DEPTH))


def test_between_its_samples() -> None:
    asked = np.array([0.5, 1.234, 5.001, 8.5])
    np.testing.assert_allclose(TARE.at(asked), rod(asked), atol=1e-5)
    assert TARE.covers(np.array([0.5, 8.5])).all()


@pytest.mark.parametrize("asked", [0.499, 8.501, -1.0, 100.0])
def test_refuses_to_extrapolate(asked: float) -> None:
    assert TARE.covers(np.array([4.0, asked])).tolist() == [True, False]
    np.testing.assert_array_equal(np.isnan(TARE.at(np.array([4.0, asked]))), [[False, True]] * 2)


def test_not_a_number_is_not_covered() -> None:
    assert np.isnan(TARE.at(np.array([np.nan]))).all()


def test_refuses_a_hole_in_its_own_log() -> None:
    keep = (DEPTH < 3) | (DEPTH > 4)
    holed = Tare.from_samples("depth_cm", DEPTH[keep], rod(DEPTH)[:, keep])
    asked = np.array([2.9, 3.5, 4.2])
    assert holed.covers(asked).tolist() == [True, False, True]
    assert np.isfinite(holed.at(asked)).tolist() == [[True, False, True]] * 2


def test_uneven_sampling_is_no_hole() -> None:
    random = np.random.default_rng(1)
    depth = np.sort(random.uniform(0, 8, 800))
    tare = Tare.from_samples("depth_cm", depth, rod(depth))
    assert np.mean(tare.covers(np.linspace(depth[0], depth[-1], 5000))) > 0.99


def test_recorded_on_the_way_up_is_the_same_tare() -> None:
    up = Tare.from_samples("depth_cm", DEPTH[::-1], rod(DEPTH)[:, ::-1])
    np.testing.assert_array_equal(up.position, TARE.position)
    np.testing.assert_array_equal(up.force, TARE.force)


def test_equal_depth_not_equal_time() -> None:
    """A tare run at half the speed, started elsewhere, takes away exactly the rod's force."""
    slow = np.linspace(0.2, 9.0, 1761)
    tare = Tare.from_samples("depth_cm", slow, rod(slow))
    plate = 3.5 * np.stack([DEPTH, -0.2 * DEPTH])
    np.testing.assert_allclose(plate + rod(DEPTH) - tare.at(DEPTH), plate, atol=1e-5)


def test_nan_where_the_tare_ends() -> None:
    short = Tare.from_samples("depth_cm", DEPTH[:400], rod(DEPTH)[:, :400])
    taken = short.at(DEPTH)
    np.testing.assert_allclose(taken[:, :400], rod(DEPTH)[:, :400], atol=1e-12)
    assert np.isnan(taken[:, 400:]).all()


def test_nothing_in_common() -> None:
    assert np.isnan(TARE.at(DEPTH + 100)).all()


@pytest.mark.parametrize("samples", [0, 1])
def test_too_few_samples(samples: int) -> None:
    why = np.full(3, RowStatus.SATURATED)
    why[:samples] = RowStatus.GOOD
    rod1 = Run(
        "rod1", "rod", "sand", "plate", "intrusion", 0.0, 90.0, np.nan, "a.csv", "b.csv",
        "", False, None, False, "", "", 2,
    )  # fmt: skip
    ledger, reason, place = Ledger(), f"tare rod1: {samples} samples are no tare", np.arange(3.0)
    stroke = Samples(place, place, place, place, np.zeros((2, 3)), why)
    assert _tare_of(rod1, stroke, ledger) == reason
    counted = ledger.table()[["fate", "reason", "rows"]]
    assert counted.to_numpy().tolist() == [[DROPPED, reason, samples]]


def test_only_a_step_wider_than_the_longest_is_a_hole() -> None:
    position = np.array([0.0, 1.0, 3.0, 5.5])
    tare = Tare("depth_cm", position, rod(position), longest_step=2.0)
    assert tare.covers(np.array([0.5, 2.0, 4.0])).tolist() == [True, True, False]
