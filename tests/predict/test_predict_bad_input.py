"""A value that is missing in logs or tables stays missing in predicted forces, with its reason."""

import numpy as np
import pytest
import yaml
from campaigns import RigRoom
from paper import few_draws
from result_tables import alpha_frame

from rftfit import reference
from rftfit.measure.flags import flag_table
from rftfit.results import open_results
from rftfit.store import write_csv
from rftfit.workflow.validate import legs_predicted

LEG, AIR = "poppy_LP_c_leg", "air_c_leg"
HOLE = (30.0, 45.0)
"""Direction of the cell that has no alpha."""
WHY_HOLE = "fewer than 30 samples in the window"
"""The reason for it."""


@pytest.fixture
def room(tmp_path):
    """One leg run and the same leg in air."""
    room = RigRoom(tmp_path)
    config = yaml.safe_load(room.config)
    config.pop("robot", None)  # no part of this
    room.config = yaml.safe_dump(config)
    return room.add(LEG)


def on_trial(room, alpha, legs):
    """Predicted curves and errors, from the files of the earlier stages."""
    room.write()
    if alpha is None:
        alpha = alpha_frame("poppy_LP", reference.alpha_grid("poppy_LP"))
    flags = flag_table("poppy_LP", "checks", [])
    for stage, table in (("alpha", alpha), ("legs", legs), ("flags", flags)):
        write_csv(table, room.folder / "results" / stage / "poppy_LP.csv")
    with few_draws():
        return legs_predicted(open_results(room.folder))[:2]


def of_c_leg(table, profile="table"):
    return table[(table["leg"] == "c_leg") & (table["profile"] == profile)]


def stop_at(theta_deg):
    """Let the arm stand still from an angle on: what that makes of a force and a motion log."""
    seconds = np.radians(theta_deg + 135) / 0.2

    def rewritten(text, moving, still):
        lines = text.splitlines()
        data = next(k for k, line in enumerate(lines) if line[:1].isdigit() or line[:1] == "-")
        rows = [line.split(",") for line in lines[data:]]
        end = next(float(row[0]) for row in rows if moving(row)) + seconds
        last = next(row for row in rows if float(row[0]) > end)
        for row in rows:
            if float(row[0]) > end:
                row[still] = ["0"] if still == slice(1, 2) else last[still]
        return "\n".join([*lines[:data], *map(",".join, rows)]) + "\n"

    return (
        lambda text: rewritten(text, lambda row: row[1] == "1", slice(1, 2)),
        lambda text: rewritten(text, lambda row: float(row[3]) > -135 + 0.2, slice(1, 4)),
    )


@pytest.mark.parametrize("run", [LEG, AIR])
def test_leg_that_stops_turning_early(room, run):
    """Of the leg in the sand or of the leg in air, whose curve is then no tare farther on."""
    logs = [name for name in room.logs if run in name]
    for log in logs:
        room.change(log, stop_at(-20.0)["motion" in log])
    results = room.chain()
    results.check_ledger(room.counted)
    theta = results.curves["theta_deg"]
    assert theta.min() <= -133
    assert -24 <= theta.max() <= -18
    predicted, errors = on_trial(room, None, results.curves)
    # the prediction is whole; what it is compared over is said beside every number
    assert of_c_leg(predicted)["force_z_N"].notna().all()
    rows = of_c_leg(errors)
    assert len(rows) == 2
    assert (rows["theta_to_deg"] == theta.max()).all()
    assert dict(zip(rows["component"], rows["reason_code"], strict=True)) == {
        "z": "short-curve",
        "x": "short-at-peak",
    }
    if run == AIR:
        assert (
            results.fates(next(log for log in room.logs if f"{LEG}_force" in log))[
                "dropped", "untared"
            ]
            > 500
        )


@pytest.mark.parametrize(
    ("run", "kinds"), [(LEG, ("force",)), (LEG, ("motion",)), (AIR, ("force", "motion"))]
)
def test_leg_log_that_breaks_off(room, run, kinds):
    """No end of the stroke, so the clocks cannot be matched: no curve, and the ledger says why."""
    for kind in kinds:
        log = next(name for name in room.logs if f"{run}_{kind}" in name)
        room.change(
            log, lambda text: "".join(text.splitlines(keepends=True)[: text.count("\n") // 2])
        )
    results = room.chain()
    results.check_ledger(room.counted)
    assert results.curves.empty
    assert results.run(run)["reason_code"] == "nothing-to-match"
    codes = results.book[results.book["run_id"] == LEG]["reason_code"]
    assert codes.str.contains("nothing-to-match").any()


def test_missing_cell_reaches_the_tables(room):
    whole = alpha_frame("poppy_LP", reference.alpha_grid("poppy_LP"))
    alpha = whole.copy()
    empty = (alpha["beta_deg"] == HOLE[0]) & (alpha["gamma_deg"].round(1) == HOLE[1])
    alpha.loc[empty, [*alpha.filter(like="alpha_")]] = np.nan
    alpha.loc[empty, "reason"] = WHY_HOLE
    legs = room.chain().curves
    before, errors_before = on_trial(room, whole, legs)
    predicted, errors = on_trial(room, alpha, legs)
    curve, full = of_c_leg(predicted), of_c_leg(before)
    unknown = curve["force_z_N"].isna().to_numpy()
    assert 20 < unknown.sum() < 200
    for name in ("force_x_N", "moment_N_cm", "force_z_lo_N", "force_z_hi_N", "force_x_lo_N"):
        np.testing.assert_array_equal(curve[name].isna(), unknown)
    # each draw has its peak at an angle of its own, where it is higher than at that of the best curve
    peaks = of_c_leg(errors_before).set_index("component")
    for component in "zx":
        top = full.loc[full[f"force_{component}_N"].abs().idxmax()]
        assert peaks.loc[component, "peak_predicted_N"] == pytest.approx(
            top[f"force_{component}_N"]
        )
        assert peaks.loc[component, "peak_predicted_hi_N"] > top[f"force_{component}_hi_N"]
    # what does not need the cell is what it was: nothing is put in its place
    known_force = curve["force_z_N"].to_numpy()[~unknown]
    np.testing.assert_array_equal(known_force, full["force_z_N"].to_numpy()[~unknown])
    assert curve[unknown]["reason"].str.contains(f"(30, 45): {WHY_HOLE}", regex=False).all()
    rows = of_c_leg(errors)
    assert rows["reason"].str.contains(WHY_HOLE).all()
    lost = rows[["peak_predicted_N", "peak_error_percent", "rms_error_N", "r2"]]
    assert lost.isna().all(axis=None)
    # the depth-only model needs three other cells only
    assert of_c_leg(predicted, "depth_only")["force_z_N"].notna().all()
    assert of_c_leg(errors, "depth_only")["rms_error_N"].notna().all()
