"""Each disturbance changes the simulated logs by as much as was asked and changes nothing else.

Disturbance: an error of a real lab, such as a wrong surface, a lag or slow noise.
"""

from __future__ import annotations

import io

import numpy as np
import pandas as pd
import pytest
from campaigns import planned
from paper import DISTURBANCES, disturbed_logs, pink

from rftfit.lab.enact import run_logs

PUSH, ROD, LEG, AIR = (
    "poppy_CP_bp00_g90_in",
    "poppy_CP_bp00_g90_in_rod",
    "poppy_CP_c_leg",
    "air_c_leg",
)
"""Runs of one direction: a push, its rod; and a leg in the medium and in air."""
SEED = 5


def read(content):
    assert content is not None
    return pd.read_csv(io.BytesIO(content), comment="#")


CHANGED = {
    "surface": {PUSH, ROD, LEG},
    "surface-session": {PUSH, ROD, LEG},
    "lag": {PUSH, ROD, LEG, AIR},
    "spread-percent": {PUSH, LEG},
    "pink": {PUSH, ROD, LEG, AIR},
    "patches": {PUSH, LEG},
    "deep-noise": {PUSH, LEG},
    "power": {PUSH},
    "tare-bed": {ROD},
    "turn": {PUSH, ROD, LEG, AIR},
}


@pytest.mark.parametrize("name", DISTURBANCES)
def test_what_is_changed(paper_config, name):
    disturbance = DISTURBANCES[name]
    changed_runs = set()
    for run in (planned()[run_id] for run_id in (PUSH, ROD, LEG, AIR)):
        plain = run_logs(run, paper_config, SEED)
        disturbed = disturbed_logs(run, paper_config, SEED, {name: disturbance.size})
        assert disturbed == disturbed_logs(run, paper_config, SEED, {name: disturbance.size})
        assert disturbed_logs(run, paper_config, SEED, {name: disturbance.nothing}) == plain
        assert disturbed[run.motion_log] == plain[run.motion_log]
        log_before, log_after = read(plain[run.force_log]), read(disturbed[run.force_log])
        for column in ("time_s", "arm_moving"):
            np.testing.assert_array_equal(log_after[column], log_before[column])
        if disturbed[run.force_log] != plain[run.force_log]:
            changed_runs.add(run.run_id)
    assert changed_runs == CHANGED[name]


def test_pink_noise_falls_as_one_over_f():
    noise = pink(np.random.default_rng(1), 300, 4096)
    power = (np.abs(np.fft.rfft(noise, axis=1)) ** 2).mean(axis=0)[1:-1]
    number = np.arange(1, power.size + 1)
    assert np.polyfit(np.log(number), np.log(power), 1)[0] == pytest.approx(-1, abs=0.02)
    assert power[:4] * number[:4] == pytest.approx(power[-400:] @ number[-400:] / 400, rel=0.25)
