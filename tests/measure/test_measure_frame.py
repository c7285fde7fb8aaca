"""The sensor's frame, against a rotation written here from the definition."""

import itertools
import math

import numpy as np
import pytest

from rftfit.campaign.config import Axes, Transducer
from rftfit.measure.lab_frame import sensor_to_lab


def transducer(x, y, z, turn_deg):
    return Transducer(
        name="t", range_N=(1.0, 1.0, 1.0), axes=Axes(x=x, y=y, z=z), turn_deg=turn_deg
    )


def to_channels(force, axes, turn_deg):
    """Channels that a sensor reads under a lab force: unit vectors of the turned mount, dotted."""
    t = math.radians(turn_deg)
    # turned from z toward x: at 90 degrees the mount's z axis lies along lab x
    along = {
        "x": np.array([math.cos(t), 0, -math.sin(t)]),
        "y": np.array([0, 1, 0]),
        "z": np.array([math.sin(t), 0, math.cos(t)]),
    }
    channels = np.zeros((3, force.shape[1]))
    for name, axis in zip("xyz", axes, strict=True):
        sign = -1 if axis[0] == "-" else 1
        channels[int(axis[2]) - 1] = sign * (along[name] @ force)
    return channels


@pytest.mark.parametrize("turn_deg", [-180.0, -37.5, 0, 4, 90, 133])
def test_round_trip_for_every_mounting(turn_deg):
    force = np.random.default_rng(5).normal(size=(3, 20))
    for order in itertools.permutations("123"):
        for signs in itertools.product("+-", repeat=3):
            axes = tuple(f"{sign}F{number}" for sign, number in zip(signs, order, strict=True))
            x, y, z = axes
            lab = sensor_to_lab(transducer(x, y, z, turn_deg)) @ to_channels(
                force, (x, y, z), turn_deg
            )
            np.testing.assert_allclose(lab, force[[0, 2]], atol=1e-12)


def test_a_push_from_below_on_the_papers_rig():
    # -F3 is up: F3 = -5 N is a push of 5 N from below, turned 90 degrees it is one toward +x
    channels = np.array([0.0, 0.0, -5.0])
    up = sensor_to_lab(transducer("-F2", "+F1", "-F3", 0)) @ channels
    np.testing.assert_allclose(up, [0, 5], atol=1e-12)
    turned = sensor_to_lab(transducer("-F2", "+F1", "-F3", 90)) @ channels
    np.testing.assert_allclose(turned, [5, 0], atol=1e-12)
