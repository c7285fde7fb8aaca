"""The simulated lab refuses what it cannot write and says what is missing or which file failed."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from rftfit.errors import InputError, OutputError
from rftfit.lab.marker import remove
from rftfit.lab.plan import plan_runs, plate_of
from rftfit.lab.rig import resolve


def test_a_tare_of_another_medium_needs_one(config):
    runs = {run.run_id: run for run in plan_runs(config) if run.medium in ("poppy_LP", "")}
    with pytest.raises(InputError, match="has no tare of another medium among these runs; name a"):
        resolve(["wrong_medium_tare"], runs, "poppy_LP")


def test_a_config_without_a_plate(config):
    legs = {
        name: intruder for name, intruder in config.intruders.items() if intruder.shape == "leg"
    }
    with pytest.raises(InputError, match=r"intruders .* plate"):
        plate_of(legs)


def test_a_log_that_cannot_be_removed(monkeypatch, tmp_path):
    def refuse(*_, **__):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(Path, "unlink", refuse)
    with pytest.raises(OutputError, match=r"a\.csv: .*: Permission denied"):
        remove(tmp_path / "a.csv")
