"""Columns of MATLAB, HDF5 and NumPy files are read by their paths, and cut files are refused."""

import numpy as np
import pytest
from log_files import refused
from makers import NOT_MEASURED, bench_config, json_of, row_of_push, sentence_of, write_campaign
from numpy.testing import assert_array_equal
from scipy.io import savemat

import rftfit
from rftfit.logs.registry import dialect

h5py = pytest.importorskip("h5py")

ARRAYS = dialect("arrays")
N = 400
"""Rows of the log that each file holds."""
TIME = np.arange(N) / 100
FORCE = np.random.default_rng(5).normal(size=(N, 3)).round(4)
Z = -10 * TIME


def mat5(path):
    run = {"time": TIME, "F": FORCE, "name": "plate", "gain": 2.0}
    run["cells"] = np.array([1, "a"], object)
    savemat(path, {"run": run, "z_mm": Z[None]})


def mat73(path):
    # MATLAB puts its own text in front, and lays tables the other way round
    with h5py.File(path, "w", userblock_size=512) as file:
        file["run/time"], file["run/F"], file["z_mm"] = TIME[None], FORCE.T, Z[:, None]
        file["run/name"] = np.full(N, ord("p"), np.uint16)
        file["run/name"].attrs["MATLAB_class"] = np.bytes_("char")
        file["#refs#/a"] = np.arange(N)
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512))


def hdf5(path):
    with h5py.File(path, "w") as file:
        file["run/time"], file["run/F"], file["z"] = TIME, FORCE.astype(">f4").astype(">f8"), Z
        file["run/F"][...] = FORCE
        file["z"].attrs["unit"] = "mm"
        file["run/camera"] = np.zeros((N, 100, 80), np.uint8)
        file["text"] = "a note"


def npz(path):
    arrays = {"run.time": TIME, "run.F": FORCE, "z [mm]": Z, "settings": np.arange(7)}
    with path.open("wb") as file:
        np.savez(file, **arrays)  # type: ignore[arg-type]


MAKERS = {"a.mat": mat5, "b.mat": mat73, "c.h5": hdf5, "d.npz": npz}


@pytest.mark.parametrize("name", MAKERS)
def test_every_column_by_its_path(name, tmp_path):
    path = tmp_path / name
    MAKERS[name](path)
    log = rftfit.read_log(path)
    forces = [f"run.F column {k}" for k in (1, 2, 3)]
    assert set(log.columns) == {"run.time", *forces, "z"}
    assert_array_equal(log.columns["run.time"], TIME)
    assert_array_equal(np.stack([log.columns[force] for force in forces], axis=1), FORCE)
    assert_array_equal(log.columns["z"], Z)
    assert log.units["z"] == "mm"
    assert log.rows == N
    inspected = json_of("inspect", path)
    assert inspected["dialect"] == "arrays"
    lines = "\n".join(inspected["config"])
    assert all(f"F{k}: {{column: run.F column {k}, unit: N}}" in lines for k in (1, 2, 3))
    assert "time: {column: run.time, unit: s}" in lines
    assert "z: z" in lines


def test_arrays_of_numpy(tmp_path):
    path = tmp_path / "a.npy"
    np.save(path, np.column_stack([TIME, FORCE]))
    log = ARRAYS.load(path)
    assert_array_equal(log.columns["column 3"], FORCE[:, 1])
    record = np.zeros(N, dtype=[("time", "<f8"), ("stamp", "datetime64[ms]"), ("F3", ">f4")])
    record["time"], record["F3"] = TIME, FORCE[:, 2]
    record["stamp"] = np.datetime64("2026-01-02T03:04:05") + np.arange(N).astype("m8[ms]")
    record["F3"][7] = np.nan
    np.save(path, record)
    log = ARRAYS.load(path)
    assert_array_equal(log.columns["F3"], np.delete(FORCE[:, 2], 7).astype(np.float32))
    assert log.columns["stamp"][1] - log.columns["stamp"][0] == pytest.approx(1e-3, abs=1e-6)
    assert log.dropped == {sentence_of("finite"): 1}
    assert log.units["stamp"] == "s"


@pytest.mark.parametrize("rate_Hz", [50.0, 0.5])
def test_a_rate_where_no_time_is(tmp_path, rate_Hz):
    np.save(tmp_path / "a.npy", FORCE)
    log = ARRAYS.with_options({"rate_Hz": rate_Hz}).load(tmp_path / "a.npy")
    assert_array_equal(log.columns["time"], np.arange(N) / rate_Hz)
    assert (log.units["time"], f"{rate_Hz:g} Hz" in log.notes[0]) == ("s", True)


def test_lengths(tmp_path):
    path = tmp_path / "d.npz"
    npz(path)
    assert "settings (7)" in ARRAYS.load(path).notes[0]
    error = refused(ARRAYS.only(["z", "settings"]), path, "lengths", "z", "settings (7)")
    assert error.rows == N
    log = ARRAYS.only(["settings"]).load(path)
    assert_array_equal(log.columns["settings"], np.arange(7))


@pytest.mark.parametrize("name", MAKERS)
def test_a_file_that_was_cut(name, tmp_path):
    path = tmp_path / name
    MAKERS[name](path)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 3])
    with pytest.raises(rftfit.RftfitError, match=name) as error:
        rftfit.read_log(path, "arrays")
    assert getattr(error.value, "code", "") in ("damaged", "header_only")


def test_what_holds_no_plain_numbers(tmp_path):
    path = tmp_path / "a.npy"
    np.save(path, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    refused(ARRAYS, path, "damaged")
    np.savez(tmp_path / "b.npz", a=np.array(["x", "y"]), b=3.0)
    refused(ARRAYS, tmp_path / "b.npz", "header_only", " a (text)")
    (tmp_path / "c.h5").write_text("time,F3\n1,2\n")
    refused(ARRAYS, tmp_path / "c.h5", "header")
    refused(ARRAYS, tmp_path / "none.h5", "missing")


def test_cells_and_struct_arrays_of_matlab(tmp_path):
    """Each cell and each struct by its number, as MATLAB counts; a field of one number each is a column."""

    cells = np.empty((1, 3), dtype=object)
    runs = np.zeros((1, 3), dtype=[("fz", object), ("F", object)])
    for k in range(3):
        runs[0, k] = (k / 2, FORCE[:, k])
    # a single number among arrays is a column of another length
    cells[0, :] = TIME, Z, 3.0
    savemat(tmp_path / "a.mat", {"c": cells, "run": runs, "who": "me"})
    log = ARRAYS.load(tmp_path / "a.mat")
    assert list(log.columns) == ["c{1}", "c{2}", "run(1).F", "run(2).F", "run(3).F"]
    assert_array_equal(log.columns["run(2).F"], FORCE[:, 1])
    assert [note.split(": ")[1] for note in log.notes] == ["who (text)", "run.fz (3)"]
    savemat(tmp_path / "b.mat", {"c": np.full((1, 65), "me", dtype=object), "who": "me"})
    values = " c (", " 65 ", " 64)", "who (text)"
    refused(ARRAYS, tmp_path / "b.mat", "header_only", *values)


def test_a_damaged_file_costs_the_logs_of_others_nothing(tmp_path):
    """Each file holds force and motion of its run; a child process reads them all."""
    contents = {}
    for number, name in enumerate("abc"):
        path = tmp_path / f"{name}.mat"
        savemat(path, {"t": TIME, "F": np.full(N, 1.0 + number), "z": 10 - 5 * TIME})
        contents[path.name] = path.read_bytes()
    contents["b.mat"] = contents["b.mat"][:300]
    source = {"dialect": "arrays"}
    time, z = {"column": "t", "unit": "s"}, {"column": "z", "unit": "mm"}
    force = NOT_MEASURED | {"time": time, "F3": {"column": "F", "unit": "N"}}
    config = bench_config(source | {"columns": force}, source | {"columns": {"time": time, "z": z}})
    rows = [
        row_of_push(run_id=name, force_log=f"{name}.mat", motion_log=f"{name}.mat")
        for name in "abc"
    ]
    write_campaign(tmp_path / "lab", config, rows=rows, logs=contents)
    problems = [str(problem) for problem in rftfit.check(tmp_path / "lab")]
    (damaged,) = (problem for problem in problems if "damaged" in problem)
    assert "1 run would be dropped: b (row 3): b.mat: " in damaged
    # the others were read: their pushes have no rest in air
    assert sum("a (row 2), c (row 4): no zero" in problem for problem in problems) == 1
