"""`rftfit verify` notices every change of the logs, rows, settings, code and results.

Also tested: what the record holds, and `rftfit diff` of two folders of results.
"""

import hashlib
import json
import os
import re

import pytest
from campaigns import planned_jobs
from makers import read_rows, write_rows

from rftfit import RftfitError
from rftfit.workflow.job import do_job
from rftfit.workflow.state import read_states

pytestmark = pytest.mark.slow

LOG = "raw/paper/yuma/yuma_bp00_g90_in_force.csv"
FIGURE = "results/figures/fit_maps.png"
CODE = "results/records/fourier.json"
"""The record of a job, in which the digest of its code stands."""
OF_THE_RECORD = ("provenance.json", "manifest.sha256", "run_sheet.csv", "datapackage.json")
"""Files of the record itself, which it does not list."""


def sha256(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.fixture
def checked(small):
    names = (
        LOG,
        "raw/paper/runs.csv",
        "config/config.yaml",
        "results/alpha/poppy_LP.csv",
        "results/provenance.json",
        "results/manifest.sha256",
        FIGURE,
        CODE,
    )
    contents = {name: (small.root / name).read_bytes() for name in names}
    states = {name: (small.root / name).stat() for name in names}
    yield small
    for name, content in contents.items():
        path = small.root / name
        if not path.exists() or path.read_bytes() != content:
            path.write_bytes(content)
            os.utime(path, ns=(states[name].st_atime_ns, states[name].st_mtime_ns))


def change_log_behind_the_date(root):
    """Another last digit, the same size and the same date."""
    path = root / LOG
    state, content = path.stat(), bytearray(path.read_bytes())
    place = content.rfind(b"5")
    content[place : place + 1] = b"6"
    path.write_bytes(content)
    os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))


def replace(path, old, new):
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def test_the_record_names_every_result_and_its_content(checked):
    results = checked.root / "results"
    digests_there = {
        f"results/{path.relative_to(results).as_posix()}": sha256(path)
        for path in results.rglob("*")
        if path.is_file() and not {"logs", "records", "state"} & {*path.parts}
    }
    recorded = {
        path: digest
        for file in (results / "records").rglob("*.json")
        for path, digest in json.loads(file.read_text(encoding="utf-8"))["writes"].items()
    }
    assert recorded == digests_there
    jobs = json.loads((checked.root / "results" / "provenance.json").read_text(encoding="utf-8"))[
        "jobs"
    ]
    assert {path for job in jobs.values() for path in job["writes"]} == {
        path for path in digests_there if path.rsplit("/", 1)[1] not in OF_THE_RECORD
    }


def test_sums_of_all_logs_are_right(checked):
    lines = (checked.root / "results" / "manifest.sha256").read_text(encoding="utf-8").splitlines()
    listed = {name: digest for digest, name in (line.split("  ", 1) for line in lines)}
    sheet = checked.root / "raw" / "paper" / "runs.csv"
    logs = [path for path in sheet.parent.rglob("*.csv") if path != sheet]
    logs += [checked.root / "config" / "robot.yaml", sheet.parent / "REENACTED.txt"]
    assert listed == {path.relative_to(checked.root).as_posix(): sha256(path) for path in logs}


def test_the_record_holds_no_machine_and_no_time(checked):
    for name in OF_THE_RECORD:
        text = (checked.root / "results" / name).read_text(encoding="utf-8")
        assert str(checked.root) not in text
        assert str(checked.root.parent) not in text
        dates = set(re.findall(r"\b(?:19|20)\d\d-\d\d-\d\d", text))
        assert dates == set(), name


def test_a_chain_is_told(checked):
    process = checked.rftfit("verify", "results/coefficients.csv")
    assert process.returncode == 0
    for phrase in (
        "ingest of poppy_LP, yuma",
        "slopes of poppy_LP, yuma",
        "fourier",
        "scaling",
        "134 logs: air/air_c_leg_force.csv",
        "67 rows of the run sheet",
        "depends on: ",
    ):
        assert phrase in process.stdout
    text_of_alpha = checked.rftfit("verify", "results/alpha/yuma.csv").stdout
    assert "poppy_LP_" not in text_of_alpha
    assert "scaling" not in text_of_alpha


def change_row(root):
    sheet = root / "raw" / "paper" / "runs.csv"
    rows = read_rows(sheet)
    (row,) = (row for row in rows if row["run_id"] == "poppy_LP_bp30_g45_in")
    row["surface_z_mm"] = "149.5"
    write_rows(sheet, rows)


def change_setting(root):
    replace(root / "config" / "config.yaml", "threshold: 0.05", "threshold: 0.06")


def change_result(root):
    replace(root / "results" / "alpha" / "poppy_LP.csv", "poppy_LP", "poppy_XP")


def change_code(root):
    path = root / CODE
    data = json.loads(path.read_text(encoding="utf-8"))
    data["state"]["code"] = "0" * 16
    path.write_text(json.dumps(data), encoding="utf-8")


CHANGES = {
    "log": (
        change_log_behind_the_date,
        [f"file {LOG}: was sha256"],
        "alpha/yuma.csv",
        "alpha/poppy_LP.csv",
    ),
    "no log": (
        lambda root: (root / LOG).unlink(),
        [f"file {LOG}: was sha256", "is not there"],
        "alpha/yuma.csv",
        "alpha/poppy_LP.csv",
    ),
    "row": (
        change_row,
        ["run poppy_LP_bp30_g45_in: was surface_z_mm '", "is surface_z_mm '149.5'"],
        "alpha/poppy_LP.csv",
        "alpha/yuma.csv",
    ),
    "setting": (
        change_setting,
        ["config key fourier.threshold: was 0.05, is 0.06"],
        "coefficients.csv",
        "alpha/poppy_LP.csv",
    ),
    "code": (change_code, ["fourier: made with other code"], "coefficients.csv", "tares/yuma.csv"),
    "result": (
        change_result,
        ["result results/alpha/poppy_LP.csv: edited or damaged"],
        "coefficients.csv",
        "tares/poppy_LP.csv",
    ),
    "no result": (
        lambda root: (root / FIGURE).unlink(),
        [f"{FIGURE}: not as recorded", "not there"],
        "figures",
        "coefficients.csv",
    ),
}
"""What changes it, what `verify` says, and a result that rests on it and one that does not."""


@pytest.mark.parametrize("kind", CHANGES)
def test_a_change_is_noticed(checked, kind):
    change, messages, stale, right = CHANGES[kind]
    change(checked.root)
    process = checked.rftfit("verify", f"results/{stale}")
    assert process.returncode == 5
    assert all(words in process.stdout for words in messages)
    assert ("No result was edited" in process.stdout) == (not kind.endswith("result"))
    assert checked.rftfit("verify", f"results/{right}").returncode == 0
    if kind == "log":
        report = json.loads(checked.rftfit("verify", "--json").stdout)
        assert not report["as_recorded"]["results/alpha/yuma.csv"]
        assert report["as_recorded"]["results/alpha/poppy_LP.csv"]
        assert any(LOG in changed_file for changed_file in report["changed"])
        error_text = checked.rftfit("run", "--dry-run").stderr
        assert re.search("^logs .*: ingest yuma,", error_text)


def test_line_ends_of_the_sheet_and_the_order_of_its_tares_do_not_count(checked):
    """The order of plate runs does: a drift over a campaign is looked for by it."""
    sheet = checked.root / "raw" / "paper" / "runs.csv"
    header, *rows = sheet.read_text(encoding="utf-8").splitlines()
    plates = [row for row in rows if row.split(",")[1] == "plate"]
    other_rows = [row for row in rows if row not in plates]
    sheet.write_bytes(("\r\n".join([header, *plates, *reversed(other_rows)]) + "\r\n").encode())
    assert checked.rftfit("verify").returncode == 0
    sheet.write_text("\n".join([header, *reversed(plates), *other_rows]) + "\n", encoding="utf-8")
    process = checked.rftfit("verify")
    assert process.returncode == 5
    assert "checks" in process.stdout
    sheet.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")


def test_edits_and_damage_are_made_again(checked):
    """An edit, a spreadsheet's save, one flipped bit in each kind of intermediate, a deleted one."""
    results = checked.root / "results"
    digests_before = {path: sha256(path) for path in results.rglob("*") if path.is_file()}
    digests_before = {
        path: digest
        for path, digest in digests_before.items()
        if not {"logs", "state"} & {*path.parts}
    }
    replace(results / "alpha" / "poppy_LP.csv", "0.", "9.")
    saved = (results / "coefficients.csv").read_text(encoding="utf-8").replace("\n", "\r\n")
    (results / "coefficients.csv").write_bytes(b"\xef\xbb\xbf" + saved.encode())
    flipped = (
        "traces/yuma.parquet",
        "tared/poppy_LP.parquet",
        "windows/yuma.parquet",
        "fits/yuma.csv",
        "ledger/tare/poppy_LP.csv",
        "fourier/media.csv",
        "report.html",
        "quality/yuma.png",
        "alpha_tables.xlsx",
        "provenance.json",
        "state/scaling.json",
        "state/page.json",
        "records/legs/yuma.json",
    )
    for name in flipped:
        path = results / name
        content = bytearray(path.read_bytes())
        # states and records are text: a byte that is none
        content[len(content) // 2] ^= 1 if "." + name.rpartition(".")[2] != ".json" else 128
        path.write_bytes(content)
    (results / "runs" / "yuma.csv").unlink()
    assert checked.rftfit("verify", "results/report.html").returncode != 0
    process = checked.rftfit("run")
    assert process.returncode == 0, process.stderr
    assert "made again" in process.stderr
    assert "results/fits/yuma.csv" in process.stderr
    assert "not there, made again: results/runs/yuma.csv" in process.stderr
    assert {path: sha256(path) for path in digests_before} == digests_before
    assert checked.rftfit("verify").returncode == 0
    assert "Nothing to do" in checked.rftfit("run").stdout


@pytest.mark.parametrize(
    ("name", "text"),
    [
        *(("provenance.json", text) for text in (None, "", "{}", "[]", '{"format": 1}')),
        ("provenance.json", '{"format": 99}'),
        ("manifest.sha256", "nothing"),
    ],
)
def test_a_record_that_is_absent_or_damaged_is_told(checked, name, text):
    path = checked.root / "results" / name
    if text is None:
        path.unlink()
    else:
        path.write_text(text, encoding="utf-8")
    process = checked.rftfit("verify")
    assert process.returncode == 2
    assert name in process.stderr
    assert "rftfit run" in process.stderr


@pytest.mark.parametrize("kind", ["log", "row", "setting", "result"])
def test_a_change_while_the_workflow_runs_is_an_error(checked, kind):
    """The record is not written when it would not be true."""
    job = planned_jobs(checked.config)[-1]
    CHANGES[kind][0](checked.root)
    digests_before = sha256(checked.root / "results" / "provenance.json")
    with pytest.raises(RftfitError):
        do_job(read_states(checked.config), job.reads, job.writes)
    assert sha256(checked.root / "results" / "provenance.json") == digests_before
