"""A value that is missing in logs or tables stays missing in predicted forces, with its reason."""

import numpy as np
import pytest
import yaml
from campaigns import RigRoom
from paper import few_draws
from result_tables import alpha_frame

import rftfit
from rftfit.measure.flags import flag_table
from rftfit.store import write_csv
from rftfit.workflow.validate import legs_predicted

LEG, AIR = "poppy_LP_c_leg", "air_c_leg"


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
        *_, z, x = rftfit.TableProfile.published("poppy_LP").cells
        alpha = alpha_frame("poppy_LP", (z, x))
    flags = flag_table("poppy_LP", "checks", [])
    for stage, table in (("alpha", alpha), ("legs", legs), ("flags", flags)):
        write_csv(table, room.folder / "results" / stage / "poppy_LP.csv")
    with few_draws():
        return legs_predicted(rftfit.open(room.folder))[:2]


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
