"""A tare gives its force where it was measured and is NaN elsewhere.

Tare: the force of the rod alone, or of the leg in air, which is subtracted from a run.
"""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pushes import plate_run

from rftfit.measure.flags import attach_run, remark
from rftfit.measure.lab_frame import is_symmetric
from rftfit.measure.ledger import Ledger, RowStatus
from rftfit.measure.samples import PHASES, SAMPLE_COLUMNS, samples_table
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


def test_what_becomes_of_each_run_of_a_medium():
    """Tared, without a tare in the sheet, with one that is none, that was refused, that was never read."""
    runs = [
        row("rod", "rod"),
        row("short", "rod"),
        row("gone", "rod"),
        row("torn", "rod"),
        row("air", "leg_air", direction="rotation"),
        row("tared", "plate", "rod"),
        row("bare", "plate"),
        row("on_short", "plate", "short"),
        row("on_gone", "plate", "gone"),
        row("on_torn", "plate", "torn"),
        row("leg", "leg", "air", "rotation"),
        row("far", "leg", "air", "rotation"),
    ]
    place = np.linspace(1.0, 3.0, 21)
    stroke = np.full(21, PHASES.index("stroke"))

    def samples(force_z, angle=0.0, why=int(RowStatus.GOOD)):
        values = {
            "depth_cm": place,
            "angle_deg": place + angle,
            "force_z_N": force_z * place,
            "force_x_N": -force_z * place,
            "phase": stroke,
            "why": np.full(21, why, dtype=np.int8),
        }
        return tuple(values.get(name, np.zeros(21)) for name in SAMPLE_COLUMNS)

    logs = {
        name: samples(5.0) for name in ("tared", "bare", "on_short", "on_gone", "on_torn", "leg")
    }
    logs |= {"rod": samples(2.0), "air": samples(1.0), "far": samples(5.0, angle=100.0)}
    logs["short"] = samples(2.0, why=RowStatus.SATURATED)
    read = samples_table({run.run_id: logs[run.run_id] for run in runs if run.run_id in logs})
    why = {"gone": "", "torn": "its log is empty"}
    status = pd.DataFrame(
        [(run.run_id, why.get(run.run_id, ""), "empty") for run in runs],
        columns=["run_id", "reason", "reason_code"],
    )
    fit = SimpleNamespace(missing_tare="flag")
    columns: dict[str, Any] = {}
    transducer = SimpleNamespace(axes=SimpleNamespace(x="+F2"))
    by_id = {run.run_id: run for run in runs}
    campaign: Any = SimpleNamespace(
        runs_of=lambda _: runs,
        numbers={},
        config=SimpleNamespace(
            fit=fit, transducer=transducer, force_log=SimpleNamespace(columns=columns)
        ),
        holds_tare=lambda run: run.run_id == "bare",
    )
    tared, tares, ledger = tare_medium(campaign, "sand", read, status)
    assert ledger.flags == attach_run("bare", [remark("no-tare")])
    tares_by_run: Any = tares.set_index("run_id")
    assert dict(tares_by_run["reason_code"]) == {
        "short": "tare-empty",
        "tared": "",
        "bare": "",
        "leg": "",
        "on_short": "tare-missing tare-empty",
        "on_gone": "tare-missing tare-unusable no-stroke",
        "on_torn": "tare-missing tare-unusable empty",
        "far": "no-sample untared",
    }
    unusable = remark("tare-unusable", tare="torn", why="its log is empty")
    assert tares_by_run.loc["on_torn", "reason"] == str(remark("tare-missing", why=unusable))
    assert tares_by_run.loc["tared", ["abscissa", "valid_from", "valid_to"]].tolist() == [
        "depth_cm",
        1,
        3,
    ]
    assert tares_by_run.loc["leg", "abscissa"] == "angle_deg"
    assert tares_by_run.loc["short"].isna().sum() == 4
    square = float(np.sqrt(np.mean(place**2)))
    assert tares_by_run.loc["tared", ["force_rms_N", "tare_rms_N"]].tolist() == pytest.approx(
        [5 * square, 2 * square]
    )
    rows_by_run = {str(name): rows for name, rows in tared.groupby("run_id", observed=True)}
    assert sorted(rows_by_run) == ["bare", "far", "leg", "tared"]
    for name, left, taken in (("tared", 3.0, 2.0), ("bare", 5.0, 0.0), ("leg", 4.0, 1.0)):
        for c, sign in (("z", 1), ("x", -1)):
            np.testing.assert_allclose(rows_by_run[name][f"force_{c}_N"], sign * left * place)
            np.testing.assert_allclose(rows_by_run[name][f"tare_{c}_N"], sign * taken * place)
    assert (rows_by_run["far"]["why"] == RowStatus.UNTARED).all()
    counted = ledger.table().groupby(["file", "fate"])["rows"].sum()
    assert dict(counted) == {
        ("rod.csv", "used"): 21,
        ("air.csv", "used"): 21,
        ("short.csv", "dropped"): 0,
        ("on_short.csv", "dropped"): 21,
        ("on_gone.csv", "dropped"): 21,
        ("on_torn.csv", "dropped"): 21,
        ("far.csv", "dropped"): 21,
    }
    # a channel that nobody measured is said of each run with samples that would show it
    columns["F2"] = SimpleNamespace(constant=0.0)
    flags = tare_medium(campaign, "sand", read, status)[2].flags
    unmeasured = {flag.run_id for flag in flags if flag.code == "no-force-x"}
    assert unmeasured == {name for name in rows_by_run if not is_symmetric(by_id[name])}
    # a campaign that refuses runs without a tare
    fit.missing_tare = "refuse"
    refused: Any = tare_medium(campaign, "sand", read, status)[1].set_index("run_id")
    assert refused.loc["bare", "reason_code"] == "tare-missing tare-not-named"
    assert refused.loc["tared", "reason_code"] == ""


def test_only_a_step_wider_than_the_longest_is_a_hole():
    position = np.array([0.0, 1.0, 3.0, 5.5])
    tare = Tare("depth_cm", position, rod(position), longest_step=2.0)
    assert tare.covers(np.array([0.5, 2.0, 4.0])).tolist() == [True, True, False]
