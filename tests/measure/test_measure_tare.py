"""A tare knows where it holds, and refuses elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from rftfit.measure.tare import Tare, TareError, subtract

DEPTH = np.linspace(0.5, 8.5, 801)


def rod(depth: np.ndarray) -> np.ndarray:
    return np.stack([0.02 * depth**2, -0.3 * depth])


TARE = Tare.from_samples("rod1", "depth_cm", DEPTH, rod(DEPTH))


def test_between_its_samples() -> None:
    asked = np.array([0.5, 1.234, 5.001, 8.5])
    np.testing.assert_allclose(TARE.at(asked), rod(asked), atol=1e-5)
    assert (TARE.valid_from, TARE.valid_to) == (0.5, 8.5)


@pytest.mark.parametrize("asked", [0.499, 8.501, -1.0, 100.0])
def test_refuses_to_extrapolate(asked: float) -> None:
    assert not TARE.covers(np.array([asked])).any()
    with pytest.raises(TareError, match=r"tare rod1 is known from 0\.500 to 8\.500 depth_cm"):
        TARE.at(np.array([4.0, asked]))


def test_not_a_number_is_not_covered() -> None:
    assert not TARE.covers(np.array([np.nan])).any()


def test_refuses_a_hole_in_its_own_log() -> None:
    keep = (DEPTH < 3) | (DEPTH > 4)
    holed = Tare.from_samples("rod1", "depth_cm", DEPTH[keep], rod(DEPTH)[:, keep])
    covered = holed.covers(np.array([2.9, 3.5, 4.2]))
    assert covered.tolist() == [True, False, True]
    with pytest.raises(TareError, match=r"asked for 3\.500 to 3\.500"):
        holed.at(np.array([2.9, 3.5, 4.2]))


def test_uneven_sampling_is_no_hole() -> None:
    random = np.random.default_rng(1)
    depth = np.sort(random.uniform(0, 8, 800))
    tare = Tare.from_samples("rod1", "depth_cm", depth, rod(depth))
    assert np.mean(tare.covers(np.linspace(depth[0], depth[-1], 5000))) > 0.99


def test_recorded_on_the_way_up_is_the_same_tare() -> None:
    up = Tare.from_samples("rod1", "depth_cm", DEPTH[::-1], rod(DEPTH)[:, ::-1])
    np.testing.assert_array_equal(up.position, TARE.position)
    np.testing.assert_array_equal(up.force, TARE.force)


def test_equal_depth_not_equal_time() -> None:
    """A tare run at half the speed, started elsewhere, takes away exactly the rod's force."""
    slow = np.linspace(0.2, 9.0, 1761)
    tare = Tare.from_samples("rod1", "depth_cm", slow, rod(slow))
    plate = 3.5 * np.stack([DEPTH, -0.2 * DEPTH])
    granular, taken, known = subtract(DEPTH, plate + rod(DEPTH), tare)
    assert known.all()
    np.testing.assert_allclose(granular, plate, atol=1e-5)
    np.testing.assert_allclose(taken, rod(DEPTH), atol=1e-5)


def test_subtract_leaves_nan_where_the_tare_ends() -> None:
    short = Tare.from_samples("rod1", "depth_cm", DEPTH[:400], rod(DEPTH)[:, :400])
    granular, taken, known = subtract(DEPTH, rod(DEPTH), short)
    assert known.sum() == 400
    assert known[:400].all()
    np.testing.assert_allclose(granular[:, known], 0, atol=1e-12)
    assert np.isnan(granular[:, ~known]).all()
    assert np.isnan(taken[:, ~known]).all()


def test_nothing_in_common() -> None:
    granular, taken, known = subtract(DEPTH + 100, rod(DEPTH), TARE)
    assert not known.any()
    assert np.isnan(granular).all()
    assert np.isnan(taken).all()


@pytest.mark.parametrize("samples", [0, 1])
def test_too_few_samples(samples: int) -> None:
    with pytest.raises(TareError, match=f"tare rod1: {samples} samples are no tare"):
        Tare.from_samples("rod1", "depth_cm", DEPTH[:samples], rod(DEPTH)[:, :samples])


def test_only_a_step_wider_than_the_longest_is_a_hole() -> None:
    position = np.array([0.0, 1.0, 3.0, 5.5])
    tare = Tare("rod1", "depth_cm", position, rod(position), longest_step=2.0)
    assert tare.covers(np.array([0.5, 2.0, 4.0])).tolist() == [True, True, False]
