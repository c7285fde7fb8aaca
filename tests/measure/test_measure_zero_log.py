"""A log without load gives the zero of a run with the drift of the time between them, and is told where it is old or loaded."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from makers import MadePush, TextLog, config_of_push, row_of_push, write_campaign
from measured import chain

from rftfit.campaign.load import load_campaign

HOUR_S = 3600.0
DRIFT_N_PER_MIN = 0.02
CONFIG = config_of_push(
    "clock",
    {c: {"column": c, "unit": "mm"} for c in "xz"},
    transducer={"drift_N_per_min": DRIFT_N_PER_MIN},
)


def stamps(form):
    """How a program writes the seconds of a day in September: as a clock time, with the date, or as a number."""
    midnight_s = datetime(2026, 9, 14, tzinfo=UTC).timestamp() if "%d" in form else 0.0

    def write(time_s):
        if not form:
            return [f"{second:.3f}" for second in time_s]
        moments = (datetime.fromtimestamp(midnight_s + second, UTC) for second in time_s)
        return [moment.strftime(form)[:-3] for moment in moments]

    return write


def log(push, form, readings=slice(None)):
    """Both logs of a push, or of some readings of it, as one text."""
    columns = {"clock": push.time_s, **push.log().columns}
    del columns["time"]
    columns = {name: values[readings] for name, values in columns.items()}
    columns["clock"] = stamps(form)(columns["clock"])
    return TextLog(columns, {}, delimiter=",").text()


def measure(folder, zero_log, form, push_at_s):
    """Zero and flags of a run that has this zero log: its row in the table of runs, and flags by code."""
    row = row_of_push(zero_log="zero.csv")
    logs = {"p.csv": log(MadePush(start_s=push_at_s, seed=2), form), "zero.csv": zero_log}
    config = write_campaign(Path(folder), CONFIG, rows=[row], logs=logs)
    results = chain(load_campaign(config), "sand")
    return results.run("p"), {flag.code: flag.values for flag in results.flags.of_run("p")}


REST = slice(0, 35)
"""Readings before the arm moves."""


@pytest.mark.parametrize(
    ("form", "logged_h", "pushed_h", "minutes"),
    [
        ("%H:%M:%S.%f", 11.0, 11.05, 3.0),
        ("%H:%M:%S.%f", 11.0, 12.0, 60.0),
        # recorded after the push, and over midnight
        ("%H:%M:%S.%f", 13.0, 12.0, 60.0),
        ("%H:%M:%S.%f", 23.75, 24.25, 30.0),
        ("%Y-%m-%d %H:%M:%S.%f", 8.0, 38.0, 1800.0),
        # seconds of two loggers that may have been switched on at any time
        ("", 11.0, 12.0, None),
        ("", 0.0, 0.0, None),
    ],
)
def test_the_zero_drifts_for_the_time_between_both_logs(
    tmp_path, form, logged_h, pushed_h, minutes
):
    zero_log = log(MadePush(start_s=logged_h * HOUR_S), form, REST)
    run, flags = measure(tmp_path, zero_log, form, pushed_h * HOUR_S)
    drift_N = DRIFT_N_PER_MIN * (10.0 if minutes is None else minutes) / np.sqrt(3)
    # the middle of the stroke is some seconds from that of the rest
    assert np.sqrt(run["zero_var_z_N2"]) == pytest.approx(drift_N, rel=0.1, abs=0.005)
    assert ("zero-log-old" in flags) == (minutes is not None and minutes > 10)
    if "zero-log-old" in flags:
        told = flags["zero-log-old"]
        assert told["minutes"] == pytest.approx(minutes, abs=0.3)
        assert told["logged"].endswith(f"{int(logged_h % 24):02}:{int(logged_h % 1 * 60):02}")
        assert told["pushed"].endswith(f"{int(pushed_h % 24):02}:{int(pushed_h % 1 * 60):02}")
    assert "zero-log-moves" not in flags


@pytest.mark.parametrize("readings", [slice(None), slice(0, 170), slice(200, None)])
def test_a_zero_log_with_a_push_in_it_is_told(tmp_path, readings):
    form = "%H:%M:%S.%f"
    zero_log = log(MadePush(start_s=11 * HOUR_S), form, readings)
    _, flags = measure(tmp_path, zero_log, form, 11.1 * HOUR_S)
    assert flags["zero-log-moves"]["file"] == "zero.csv"


@pytest.mark.parametrize("noise_N", [0.02, 0.5, 2.0])
@pytest.mark.parametrize("count", [12, 35, 380])
def test_noise_is_no_push(tmp_path, noise_N, count):
    form = "%H:%M:%S.%f"
    for seed in range(5):
        quiet = MadePush(alpha_z=0.0, noise_N=noise_N, start_s=11 * HOUR_S, seed=seed)
        _, flags = measure(tmp_path, log(quiet, form, slice(0, count)), form, 11.1 * HOUR_S)
        assert "zero-log-moves" not in flags
