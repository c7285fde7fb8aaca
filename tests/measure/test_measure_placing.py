"""A campaign with unknown clocks, surface and machine compliance gives the true alpha.

Unknown: not stated in the config but found from the logs. Compliance: how far the machine bends.
"""

import re
from typing import Any

import numpy as np
import pandas as pd
import pytest
from makers import bench_config, row_of_push, write_campaign
from measured import chain
from pushes import Push, make_push

import rftfit
from rftfit.campaign.load import load_campaign
from rftfit.measure.ledger import RowStatus, check_ledger

YIELD_CM_PER_N = 1e-3
"""How far the machine bends under one newton."""
STIFFNESS = 25.0
"""Force on the plate for each cm of depth, N/cm."""

AXES = {"x": "+F1", "y": "+F2", "z": "-F3"}
CONFIG: dict[str, Any] = bench_config(
    {},
    {},
    transducer={"axes": AXES},
    arm={"drive": "uneven", "speed_cm_per_s": 0.1},
    clock={"method": "estimate"},
    surface={"method": "find"},
    intruders={
        "round": {"shape": "disc", "diameter_cm": 5, "thickness_cm": 0.5},
        "odd": {"shape": "flat", "area_cm2": 10, "length_cm": 4, "thickness_cm": 0.5},
    },
    fit={"missing_tare": "flag", "submergence_cm": 0.5, "max_depth_cm": 3},
)


def write(folder, name, push, yields=0.0, repeats=1):
    """Write a pair of rig-like logs; the arm goes deeper than the plate by what the machine yields."""
    time, force = np.repeat(push.force_time, repeats), np.repeat(push.force, repeats)
    time = time + np.tile(np.arange(repeats) * 0.001, push.force_time.size)
    pd.DataFrame(
        {"time_s": time, "arm_moving": 0, "F1_N": 0.0, "F2_N": 0.0, "F3_N": -force}
    ).to_csv(folder / "raw" / f"{name}_force.csv", index=False, float_format="%.6f")
    lift = np.interp(push.motion_time - push.offset_s, push.force_time, push.force + 1.5)
    depth = push.depth + yields * lift
    pd.DataFrame(
        {"time_s": push.motion_time, "x_mm": 0.0, "z_mm": 80 - 10 * depth, "angle_deg": 0.0}
    ).to_csv(folder / "raw" / f"{name}_motion.csv", index=False, float_format="%.6f")


@pytest.fixture
def folder(tmp_path):
    rows = [
        row_of_push(
            run_id=name,
            intruder=plate,
            force_log=f"{name}_force.csv",
            motion_log=f"{name}_motion.csv",
        )
        for name, plate in (("a", "round"), ("b", "odd"))
    ]
    write_campaign(tmp_path, CONFIG, rows=rows)
    for seed, name in enumerate(("a", "b")):
        write(tmp_path, name, make_push(seed, offset_s=7200.2, stiffness=STIFFNESS))
    return tmp_path


def campaign(folder, **changes):
    return load_campaign(write_campaign(folder, CONFIG | changes))


def edit_sheet(folder, old, new):
    """Put another text in place of one in the run sheet."""
    sheet = folder / "config" / "runs.csv"
    sheet.write_text(sheet.read_text().replace(old, new))


def measured(loaded):
    """What the stages make of the logs, whose ledger adds up."""
    results = chain(loaded, "sand")
    check_ledger(results.book, results.runs)
    return results


def test_repeated_rows_are_left_out_and_counted(folder):
    write(folder, "a", make_push(0, offset_s=7200.2, rate_Hz=25), repeats=4)
    kept = measured(campaign(folder))
    assert kept.flags.runs_with("readings-repeated").keys() == {"a"}
    transducer = CONFIG["transducer"] | {"repeats": "drop"}
    results = measured(campaign(folder, transducer=transducer))
    alpha = results.fit("a")["alpha_z_N_per_cm3"]
    assert alpha == pytest.approx(STIFFNESS / (np.pi * 6.25), rel=0.05)
    assert not results.flags.runs_with("readings-repeated")
    rows = results.book.query("run_id == 'a' and reason_code == 'repeated-rows'")["rows"]
    assert rows.sum() == 3 * 550


def test_without_a_tare_by_default_there_is_no_alpha(folder):
    fit = measured(campaign(folder, fit={"submergence_cm": 0.5, "max_depth_cm": 3})).fit("a")
    assert fit["reason_code"] == "tare-missing tare-not-named"
    assert np.isnan(fit["alpha_z_N_per_cm3"])


def test_a_force_that_never_rises_refuses_the_run(folder):
    push = make_push(3, stiffness=0.0, medium_N=0.0, offset_s=7200.2)
    write(folder, "a", push)
    results = measured(campaign(folder))
    # the clocks are those of the other run of the session
    assert results.fit("a")["reason_code"] == "no-ground"
    assert results.run("a")["status"] == "refused"
    assert results.fit("b")["reason_code"] == ""


def test_runs_with_one_fault_are_one_group_whatever_they_are_called(folder):
    edit_sheet(folder, "\nb,plate,sand,odd,", "\nin,plate,sand,odd,")
    for name in ("a", "b"):
        write(folder, name, make_push(3, stiffness=0.0, medium_N=0.0))
    campaign(folder)
    (problem,) = (problem for problem in rftfit.check(folder) if problem.severity == "error")
    assert problem.code == "logs.refused"
    assert re.fullmatch(r"sand, 2 of 2 .*: a \(row 2\), in \(row 3\)", problem.place.file)


def test_estimate_needs_a_push_and_a_line_is_needed_without(folder):
    edit_sheet(folder, "intrusion", "extraction")
    assert measured(campaign(folder)).fit("b")["reason_code"] == "no-push-aligned"


def test_the_yielding_machine(folder):
    for seed, name in enumerate(("a", "b")):
        push = make_push(seed, offset_s=7200.2, stiffness=STIFFNESS)
        write(folder, name, push, yields=YIELD_CM_PER_N)
    # against something rigid all travel below contact is the machine's own
    rigid = make_push(9, offset_s=7200.2, stiffness=1 / YIELD_CM_PER_N, medium_N=0.0)
    shallow = np.minimum(rigid.depth, rigid.surface_cm + 0.12)
    below = np.maximum(
        np.interp(rigid.force_time + 7200.2, rigid.motion_time, shallow) - rigid.surface_cm, 0
    )
    noise = np.random.default_rng(1).normal(0, 0.05, below.size)
    write(
        folder,
        "rigid",
        Push(
            rigid.force_time,
            below / YIELD_CM_PER_N + noise - 1.5,
            rigid.motion_time,
            shallow,
            7200.2,
            0.0,
            rigid.surface_cm,
        ),
    )
    rigid_contact = {"force_log": "rigid_force.csv", "motion_log": "rigid_motion.csv"}
    uncorrected, corrected = (
        measured(campaign(folder, **sections))
        for sections in ({}, {"rigid_contact": rigid_contact})
    )
    wrong, right = (results.fit("a")["alpha_z_N_per_cm3"] for results in (uncorrected, corrected))
    truth = STIFFNESS / (np.pi * 6.25)
    assert wrong == pytest.approx(truth / (1 + STIFFNESS * YIELD_CM_PER_N), rel=0.01)
    assert right == pytest.approx(truth, rel=0.01)
    # beyond the force of the rigid push the depth is not known
    traces = corrected.traces
    assert not (traces.loc[traces["run_id"] == "a", "why"] == RowStatus.YIELDED).any()


def test_a_rigid_contact_that_is_none(folder):
    def logs_of(name):
        return {"force_log": f"{name}_force.csv", "motion_log": f"{name}_motion.csv"}

    with pytest.raises(rftfit.RftfitError, match=r"rigid_contact.force_log: found 'gone_force"):
        campaign(folder, rigid_contact=logs_of("gone"))
    write(folder, "soft", make_push(3, stiffness=0.0, medium_N=0.0))
    for quantity in ("force", "motion"):
        (folder / "raw" / f"empty_{quantity}.csv").write_text("")
    for name in ("soft", "empty"):
        fits = measured(campaign(folder, rigid_contact=logs_of(name))).fits
        assert set(fits["reason_code"]) == {"rigid-contact"}
        assert fits["reason"].str.contains(name).all()
