"""Rows of several sensors in one log are never mixed: one sensor is read, or the log is refused."""

import numpy as np
import pandas as pd
import pytest
from log_files import refused, text_reader

import rftfit
from rftfit.logs.registry import dialect

ROWS = 300


def table_of(seed, ratio, column, names):
    """Readings of two sensors in the order of time, each row with the name of its sensor."""
    random = np.random.default_rng(seed)
    is_other = random.random(ROWS) < ratio
    is_other[[40, 120, 200]], is_other[[41, 121, 201]] = True, False
    force = np.where(is_other, 3.0, 20.0) * np.arange(ROWS) / ROWS
    return pd.DataFrame(
        {"time": np.arange(ROWS) / 50, column: np.where(is_other, *names[::-1]), "Fz_N": force}
    ), is_other


WRITERS = {
    "csv": lambda table, path: table.to_csv(path, index=False),
    "parquet": lambda table, path: table.to_parquet(path, index=False),
    "xlsx": lambda table, path: table.to_excel(path, index=False),
}
READERS = {
    "csv": text_reader(delimiter=","),
    "parquet": dialect("parquet"),
    "xlsx": dialect("xlsx"),
}


@pytest.mark.parametrize("kind", sorted(WRITERS))
@pytest.mark.parametrize("share_of_other", [0.02, 0.5])
@pytest.mark.parametrize(
    ("column", "names"),
    [
        ("sensor", ("ft_plate", "ft_other")),
        ("frame", ("tool 0", "tool 1")),
        # no name tells a column of sources
        *((name, (1, 2)) for name in ("ch", "Kanal", "mux", "Sensor#", "S", "\u901a\u9053")),
    ],
)
def test_two_sources_are_refused_or_one_of_them_is_read(
    tmp_path, kind, share_of_other, column, names
):
    table, is_other = table_of(2, share_of_other, column, names)
    path = tmp_path / f"log.{kind}"
    WRITERS[kind](table, path)
    reader = READERS[kind].only({"time", "Fz"})
    labels = ", ".join(repr(str(name)) for name in sorted(names))
    refused(reader, path, "several-sources", f" {column} ", labels)
    refused(reader.of_source({"no such": ("1",)}), path, "where", "'no such'")
    for name, is_chosen in zip(names, (~is_other, is_other), strict=True):
        log = reader.of_source({column: (str(name),)}).load(path)
        np.testing.assert_allclose(log.columns["Fz"], table["Fz_N"][is_chosen], rtol=1e-12)
        assert [*log.dropped.values()] == [ROWS - is_chosen.sum()]


def test_the_rate_counts_rows_of_one_source_in_blocks_of_any_size(tmp_path, monkeypatch):
    path = tmp_path / "log.csv"
    path.write_text("sensor,Fz_N\n" + "".join(f"{'ab'[n % 2]},{n}\n" for n in range(400)))
    reader = text_reader(delimiter=",", rate_Hz=100).of_source({"sensor": ("b",)})
    monkeypatch.setattr("rftfit.logs.text.BLOCK_BYTES", 500)
    log = reader.load(path)
    np.testing.assert_allclose(log.columns["time"], np.arange(200) / 100)
    assert (log.rows, [*log.dropped.values()]) == (400, [200])


def ramp(seed=1, rows=ROWS):
    """Readings of one source that grow."""
    return 20.0 * np.arange(rows) / rows + np.random.default_rng(seed).normal(0, 0.05, rows)


def log_of_labels(folder, labels, force):
    """A text log of such readings, each row with its label."""
    path = folder / "log.csv"
    time = np.arange(len(labels)) / 50
    WRITERS["csv"](pd.DataFrame({"time": time, "label": labels, "Fz_N": force}), path)
    return path


@pytest.mark.parametrize(
    "labels",
    [
        ["air"] * 50 + ["stroke"] * 200 + ["air"] * 50,
        (["down"] * 60 + ["up"] * 60) * 10,
        [f"note {place}" for place in range(300)],
        ["tool0"] * 300,
        ["a"] * 100 + ["b"] + ["a"] * 100,
        [str(place % 7) for place in range(300)],
    ],
    ids=["a state", "a cycle", "all different", "all alike", "once", "a counter"],
)
def test_what_one_source_says_of_itself_is_no_second_source(tmp_path, labels):
    path = log_of_labels(tmp_path, labels, ramp(rows=len(labels)))
    assert READERS["csv"].only({"time", "Fz"}).load(path).size == len(labels)


@pytest.mark.parametrize("rows", [1, 2, 4, 5, 10, 25, 50, 100])
@pytest.mark.parametrize("noise_N", [0.005, 0.5])
def test_sources_are_told_whatever_the_length_of_their_turns(tmp_path, rows, noise_N):
    random = np.random.default_rng(rows)
    labels = np.arange(7 * 100) // rows % 2
    force = np.clip(np.arange(labels.size) - 150, 0, None) * 0.2
    readings = np.where(labels, 0.3 * force, force) + random.normal(0, noise_N, labels.size)
    reader = READERS["csv"].only({"time", "Fz"})
    refused(reader, log_of_labels(tmp_path, labels, readings), "several-sources", "'0', '1'")
    assert reader.load(log_of_labels(tmp_path, labels, force)).size == labels.size


@pytest.mark.parametrize(
    ("numbers", "are_labels"),
    [([1, 2], True), ([0.5, 1.5], False), ([3, 3], False), (range(40), False)],
)
def test_labels_are_a_few_whole_numbers(tmp_path, numbers, are_labels):
    labels = np.tile(numbers, 40 // len(numbers))
    readings = np.where(np.arange(40) % 2, 3.0, 20.0) * np.arange(40)
    path, reader = log_of_labels(tmp_path, labels, readings), READERS["csv"].only({"time", "Fz"})
    if are_labels:
        refused(reader, path, "several-sources", "'1', '2'")
    else:
        assert reader.load(path).size == 40


@pytest.mark.parametrize("often", [0.05, 0.3])
def test_a_state_that_comes_and_goes_is_no_second_source(tmp_path, often):
    """Its readings go on as before."""
    table, _ = table_of(3, often, "status", ("ok", "warn"))
    table["Fz_N"] = ramp()
    for kind, writer in WRITERS.items():
        path = tmp_path / f"log.{kind}"
        writer(table, path)
        assert READERS[kind].only({"time", "Fz"}).load(path).size == ROWS


@pytest.mark.parametrize(
    ("cells", "word", "rows"),
    [([1, 2.0, "1.0", "x", None], "1", [0, 2]), ([" ft ", "other"], "ft", [0])],
)
def test_numbers_are_compared_as_numbers(tmp_path, cells, word, rows):
    places = range(len(cells))
    table = pd.DataFrame({"time": places, "label": cells, "Fz_N": places})
    WRITERS["xlsx"](table, tmp_path / "log.xlsx")
    reader = READERS["xlsx"].only({"time", "Fz"}).of_source({"label": (word,)})
    assert reader.load(tmp_path / "log.xlsx").columns["Fz"].tolist() == rows
    with pytest.raises(rftfit.RftfitError, match=r"'lable'.*did you mean 'label'"):
        READERS["xlsx"].of_source({"lable": (word,)}).load(tmp_path / "log.xlsx")
