"""The stages write what their functions give, whatever the form of logs, sheet and folder."""

from __future__ import annotations

import io
import re
import shutil
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from campaigns import RigRoom, digests, planned, planned_jobs, run_rules
from result_tables import read_result

import rftfit
from rftfit.errors import InputError, OutputError
from rftfit.workflow.job import do_job
from rftfit.workflow.measure import ledger
from rftfit.workflow.records import Recorded
from rftfit.workflow.state import read_states

RUNS = (
    "poppy_LP_bp30_g45_in",
    "poppy_LP_bp30_g45_ex",
    "poppy_LP_bp00_g90_in",
    "poppy_LP_bp30_g00_h254",
    "poppy_LP_bp30_g00_h508",
    "poppy_LP_bp30_g00_h762",
    "poppy_LP_c_leg",
)
STAGES = ("ingest", "tare", "slopes", "checks", "legs", "ledger")
LEDGERS = ("ingest", "tare", "slopes", "legs")


def through_files(room, out, config):
    """Run the stages of the measurement in the campaign's folder; a copy of what they wrote."""
    results = config.parents[1] / "results"
    shutil.rmtree(results, ignore_errors=True)
    run_rules(config, *STAGES)
    shutil.copytree(results, out)
    files = {path.parent.name: path for path in out.rglob("poppy_LP.*")}
    files |= {f"ledger_{stage}": out / "ledger" / stage / "poppy_LP.csv" for stage in LEDGERS}
    files |= {name: out / name / "poppy_LP.csv" for name in ("tares", "legs", "runs")}
    files["ledger"] = out / "ledger.csv"
    counted = read_result(files["ledger"]).groupby("file")["rows"].sum().to_dict()
    assert counted == room.counted
    return files


@pytest.fixture
def some(room):
    return room.add(*RUNS)


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """What the functions give of these runs."""
    return RigRoom(tmp_path_factory.mktemp("plain")).add(*RUNS).chain()


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A campaign whose stages have run, which nobody changes: its config, a copy of its results, and their paths."""
    folder = tmp_path_factory.mktemp("made")
    room = RigRoom(folder).add(*RUNS)
    config, out = room.write(), folder / "out"
    before = digests(folder / "raw")
    files = through_files(room, out, config)
    assert digests(folder / "raw") == before
    return SimpleNamespace(config=config, out=out, files=files)


def test_surface_of_the_sheet_counts(some, plain):
    """A bed 10 mm higher, said in the sheet, is the same run; not said, it is another."""
    name = "poppy_LP_bp00_g90_in"
    for run in (name, f"{name}_rod"):
        file = f"poppy_LP/{run}_motion.csv"
        log = pd.read_csv(io.BytesIO(some.logs[file]), comment="#")
        log["z_mm"] += 10
        some.logs[file] = log.to_csv(index=False).encode()
        some.set(run, surface_z_mm="160")
    fit = some.chain().fit(name)
    assert fit["alpha_z_N_per_cm3"] == pytest.approx(plain.fit(name)["alpha_z_N_per_cm3"], abs=2e-5)
    for run in (name, f"{name}_rod"):
        some.set(run, surface_z_mm="")
    assert some.chain().fit(name)["alpha_z_N_per_cm3"] > 0.36


@pytest.mark.parametrize("name", ["{:03d}", "nan", "1e{}"])
def test_names_that_look_like_numbers(some, plain, tmp_path, name):
    """Each run is called 001 and so on, or one of them nan, in every file that a later stage reads."""
    names = {run.run_id: name.format(place) for place, run in enumerate(some.runs, 1)}
    if name == "nan":
        names = {run: run for run in names} | {RUNS[0]: "nan", f"{RUNS[0]}_rod": "NA"}
    for run in some.runs:
        some.set(run.run_id, run_id=names[run.run_id], tare_run=names.get(run.tare_run, ""))
    p = through_files(some, tmp_path / "out", some.write())
    fits = pd.read_csv(p["fits"], dtype=str, keep_default_na=False).set_index("run_id")
    for _, row in plain.fits.iterrows():
        fit = fits.loc[names[row["run_id"]]]
        assert fit["tare_run"] == names[row["tare_run"]]
        alpha = float(fit["alpha_z_N_per_cm3"])
        assert alpha == pytest.approx(row["alpha_z_N_per_cm3"], rel=1e-5)


def test_air_run_that_no_leg_names_is_in_the_ledger(some, tmp_path):
    some.runs.append(planned()["air_flat_leg"])
    some.logs |= {
        file: content
        for file, content in RigRoom(tmp_path).add("poppy_LP_flat_leg").logs.items()
        if file.startswith("air/")
    }
    some.logs["air/air_flat_leg_motion.csv"] = None
    p = through_files(some, tmp_path / "out", some.write())
    book = read_result(p["ledger"])
    rows = book[book["run_id"] == "air_flat_leg"]
    assert set(rows["fate"]) == {"dropped"}
    assert (rows["reason_code"] == "unclaimed").all()


@pytest.mark.parametrize("rows", ["none", "one more"])
def test_a_ledger_that_does_not_add_up_stops_the_workflow(measured, rows):
    results = rftfit.open(measured.config.parents[1])
    for stage in LEDGERS:
        name = f"ledger/{stage}/poppy_LP.csv"
        book = results.table(name)
        is_leg = book["run_id"] == "poppy_LP_c_leg"
        book["rows"] += is_leg & (stage == "ingest") & ~is_leg.duplicated()
        results.hold(name, book[~is_leg] if rows == "none" else book)
    with pytest.raises(rftfit.RftfitError, match=r"\b1 .* poppy_LP_c_leg: "):
        ledger(results)


def test_disk_that_refuses(some):
    config = some.write()
    states = read_states(config)
    job = next(job for job in planned_jobs(config) if job.rule == "ingest")
    for name in ("traces", "records"):
        blocked = some.folder / "results" / name
        blocked.write_text("no folder", encoding="utf-8")
        with pytest.raises(OutputError, match=f"results/{name}/.*: cannot write"):
            do_job(states, job.reads, job.writes)
        blocked.unlink()
    with pytest.raises(InputError, match=re.escape("results/runs/poppy_LP.csv")):
        run_rules(config, "legs")


def test_a_stage_reads_what_it_declares_and_nothing_else(measured):
    """Legs, which ran from what they declare, do not ask for slopes."""
    (job,) = [job for job in planned_jobs(measured.config) if job.rule == "legs"]
    results = rftfit.open(measured.config.parents[1]).only(job.reads)
    assert len(rftfit.open(measured.config.parents[1]).table("legs/poppy_LP.csv")) > 0
    with pytest.raises(AssertionError, match="fits/poppy_LP"):
        results.table("fits/poppy_LP.csv")


def test_what_a_stage_did_not_write_is_not_read(some, tmp_path):
    """An edit or one flipped bit of an intermediate is refused by name, and made again by its stage."""
    config = some.write()
    files = through_files(some, tmp_path / "out", config)
    for name in ("runs", "tared", "tares", "traces"):
        path = some.folder / "results" / files[name].relative_to(tmp_path / "out")
        content = path.read_bytes()
        place = len(content) // 2
        path.write_bytes(content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :])
        reader, maker = {"runs": ("tare", "ingest"), "traces": ("tare", "ingest")}.get(
            name, ("slopes", "tare")
        )
        findings = Recorded(read_states(config)).findings_of_job(f"{maker}/poppy_LP")
        assert [(finding.sort, finding.what) for finding in findings] == [
            ("edited", path.relative_to(some.folder).as_posix())
        ]
        if path.suffix == ".parquet":
            path.write_text("no table")
            with pytest.raises(rftfit.RftfitError, match=rf"{path.name}: .*Parquet: "):
                rftfit.open(some.folder).table(f"{name}/{path.name}")
        if name in ("tared", "tares"):
            with pytest.raises(InputError, match=f"{path.name}: .*`rftfit run`"):
                run_rules(config, reader)
        assert run_rules(config, maker) == 1
        assert path.read_bytes() == content
        assert run_rules(config, maker) == 0


def test_mounting_of_the_sensor_does_not_matter(some, plain):
    """Channels swapped and turned about in logs and config alike."""
    for name, content in list(some.logs.items()):
        if name.endswith("_force.csv") and content is not None:
            lines = content.decode().splitlines()
            head = [line for line in lines if line.startswith(("#", "time"))]
            rows = [line.split(",") for line in lines[len(head) :]]
            swapped = [[t, m, f3, str(-float(f1)), f2] for t, m, f1, f2, f3 in rows]
            some.logs[name] = "\n".join([*head, *map(",".join, swapped), ""]).encode()
    some.config = some.config.replace(
        '{x: "-F2", y: "+F1", z: "-F3"}', '{x: "-F3", y: "-F2", z: "-F1"}'
    )
    some.config = some.config.replace("range_N: [65, 65, 200]", "range_N: [200, 65, 65]")
    remounted = some.chain()
    for name in [str(name) for name in plain.fits if str(name).startswith("alpha")]:
        np.testing.assert_allclose(remounted.fits[name], plain.fits[name], rtol=1e-9, err_msg=name)
