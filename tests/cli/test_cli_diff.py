"""`rftfit diff` counts changes of results in half-widths and names only causes that it knows."""

import hashlib
import json

import numpy as np
import pandas as pd
import pytest
from result_tables import alpha_frame, one_cell

from rftfit.outputs.dictionary import describe_file

COEFFICIENTS, ERRORS, ALPHA, SCALING = (
    "coefficients.csv",
    "leg_errors.csv",
    "alpha/sand.csv",
    "penetration.csv",
)
"""Tables of results."""
RUNS = [f"rep{bed}_{run}" for bed in (1, 3) for run in range(20)]
"""Forty runs of two beds."""
JOB, STATE = "checks/sand", {"rows": "of 40 runs", "logs": "of 80", "code": "c"}
"""The only job, and the state of everything that it was made from."""


def filled(name, **columns):
    """A table with all columns that the dictionary demands."""
    output = describe_file(f"results/{name}")
    assert output is not None
    blanks = {change: "" for column in output.columns for change in column.names}
    return pd.DataFrame(blanks | columns, index=[0])


TABLES = {
    COEFFICIENTS: filled(
        COEFFICIENTS,
        method="lsq",
        medium="sand",
        coefficient="B11",
        value_N_per_cm3=0.2,
        lo=0.15,
        hi=0.25,
        relative_to_A00=0.8,
        kept=True,
        published=np.nan,
    ),
    ERRORS: filled(
        ERRORS,
        medium="sand",
        leg="c_leg",
        profile="table",
        component="z",
        peak_predicted_N=5.0,
        peak_predicted_lo_N=4.0,
        peak_predicted_hi_N=6.0,
        peak_error_percent=10.0,
        peak_error_lo_percent=6.0,
        peak_error_hi_percent=14.0,
    ),
    ALPHA: alpha_frame("sand", one_cell(0.5)),
    SCALING: filled(SCALING, method="lsq", medium="sand", zeta=0.4, zeta_lo=0.3, zeta_hi=0.5),
}


def write(folder, runs, tables=None):
    """Results and their record, as `rftfit run` leaves them."""
    (folder / "alpha").mkdir(parents=True)
    (folder / "records" / "checks").mkdir(parents=True)
    for name, table in (TABLES | (tables or {})).items():
        table.to_csv(folder / name, index=False)
    logs = "".join(
        f"{hashlib.sha256(change.encode()).hexdigest()}  raw/{change}.csv\n" for change in runs
    )
    (folder / "manifest.sha256").write_text(logs)
    pd.DataFrame({"run_id": runs, "kind": "plate"}).to_csv(folder / "run_sheet.csv", index=False)
    writes = {
        f"results/{name}": hashlib.sha256((folder / name).read_bytes()).hexdigest()
        for name in TABLES
    }
    job = {"rule": "checks", "key": "sand", "state": STATE, "reads": {}, "writes": writes}
    (folder / "records" / f"{JOB}.json").write_text(json.dumps(job))
    record = {"format": 3, "settings": {}, "modules": {}, "versions": {}, "jobs": {JOB: job}}
    (folder / "provenance.json").write_text(json.dumps(record))
    return folder


def job_done_again(folder):
    """As `rftfit run` of a single result leaves it: another table, its own record, the old record of all."""
    TABLES[SCALING].assign(zeta=0.41).to_csv(folder / SCALING, index=False)
    path = folder / "records" / f"{JOB}.json"
    job = json.loads(path.read_text())
    path.write_text(json.dumps(job | {"state": STATE | {"rows": "of 20 runs", "logs": "of 40"}}))


def edited(folder):
    TABLES[SCALING].assign(zeta=0.41).to_csv(folder / SCALING, index=False)


SAME = "made from is the same"


@pytest.mark.parametrize(
    ("change", "is_same", "sentence"),
    [
        (lambda _: None, True, "What they were made from is the same."),
        (job_done_again, False, "b, with other logs, rows."),
        (edited, False, "Not as recorded"),
    ],
)
def test_what_results_were_made_from_is_said_only_where_it_is_known(
    rftfit, tmp_path, change, is_same, sentence
):
    folders = [write(tmp_path / name, RUNS) for name in "ab"]
    change(folders[1])
    text = rftfit("diff", *folders).out
    assert (SAME in text) == is_same
    assert sentence in text
    assert bool(json.loads(rftfit("diff", *folders, "--json").out)["since_the_record"]) == (
        change is job_done_again
    )


def test_many_changes_of_one_sort_are_one_line(rftfit, tmp_path):
    kept_runs = [run for run in RUNS if run[:4] == "rep1"][:18]
    folders = [write(tmp_path / "a", RUNS), write(tmp_path / "b", kept_runs)]
    lines = rftfit("diff", *folders).out.partition("differs in:")[2].split("\n")
    assert [line.strip() for line in lines if "*" in line or "run rep" in line] == [
        "file raw/rep3_* (20 of them): was there, is not there",
        "run rep1_18: was there, is not there",
        "run rep1_19: was there, is not there",
        "run rep3_* (20 of them): was there, is not there",
    ]
    assert rftfit("diff", *folders, "--all").out.count("run rep3_") == 20


def test_results_of_a_version_with_other_columns(rftfit, refusal, tmp_path):
    """Numbers that both have are compared; a column of one of them is named."""
    older = TABLES[ERRORS].assign(peak_predicted_N=5.5).drop(columns=["model_error"])
    write(tmp_path / "a", RUNS, {ERRORS: older})
    write(tmp_path / "b", RUNS)
    comparison = json.loads(rftfit("diff", tmp_path / "a", tmp_path / "b", "--json").out)
    (change,) = comparison["changed"]
    assert (change["quantity"], change["was"], change["now"]) == ("peak_predicted_N", 5.5, 5.0)
    assert comparison["only_in_one"] == ["leg_errors.csv, column model_error"]
    text = rftfit("diff", tmp_path / "a", tmp_path / "b").out
    assert "Only in one of them: leg_errors.csv, column model_error" in text
    write(tmp_path / "c", RUNS, {SCALING: pd.DataFrame({"zeta": [0.4]})})
    told = refusal("diff", tmp_path / "c", tmp_path / "b")
    assert "penetration.csv: no column method, medium" in told
