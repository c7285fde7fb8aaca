"""Tables of golden campaigns in a short form that is tracked, their comparison, and the machine that wrote them."""

import hashlib
import json
import math
import platform
import re
import tomllib
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from rftfit.outputs.dictionary import alternatives, column_of, describe_file, outputs

# --- Whether this is the machine, and these the numerical libraries, that wrote the expected tables ---------------

FILE = "machine.sha256"
"""Name of the file beside the expected tables."""
LIBRARIES = ("numba", "numpy", "pandas", "scipy")


def fingerprint():
    """Return a digest of processor, system and versions of the numerical libraries."""
    facts = [platform.system(), platform.machine(), platform.python_version(), _processor()]
    facts += [f"{name} {version(name)}" for name in LIBRARIES]
    return hashlib.sha256("\n".join(facts).encode()).hexdigest()


def _processor():
    """Return model and abilities of the processor, on which the order of sums depends."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    wanted = ("model name", "flags", "Features")
    return "\n".join(sorted({line for line in lines if line.startswith(wanted)}))


def is_same_machine(expected):
    """Return whether the tables in this folder were written here."""
    path = expected / FILE
    return path.is_file() and path.read_text(encoding="utf-8").strip() == fingerprint()


def write_machine(expected):
    """Store the fingerprint beside expected tables."""
    (expected / FILE).write_text(f"{fingerprint()}\n", encoding="utf-8")


# --- Tables of a campaign in a short form that is tracked, and their comparison column by column ------------------
# A table of many rows is kept as every k-th row, beside count, mean and largest size of each column over all rows.

MOST_ROWS = 40
"""Rows of a table that are kept as they are."""
DIGITS = 11
"""Digits of the largest number of a column that are kept."""
HERE, ELSEWHERE, OF_ROBOT = 1e-9, 1e-6, 1e-3
"""Largest difference relative to the largest number of a column: on the machine that wrote it, on others, of the robot."""
OF_ROBOT_ELSEWHERE, OF_STRIDES_ELSEWHERE, OF_COUNTS_ELSEWHERE = 0.05, 0.25, 0.01
"""The same of the robot on other machines, of how many strides it needs, and of how many numbers a path of json holds.

A contact that begins one step later by the last digits of another processor changes which strides are alike: 0.006 of the
speeds, 0.024 of the largest arrow, 0.12 of the strides and 0.0001 of the number of arrows between two processors.
"""
STRIDES = ("strides", "averaged")

SENTENCES = frozenset(
    {"cause", "doubt", "doubts", "finding", "limit", "reason", "remark", "warning"}
)
"""Quantities of the dictionary whose cells are sentences: only whether there is one is compared."""
SENTENCE_COLUMNS = frozenset({"finding", "peak_errors", "zeta_errors"})
"""Further columns of sentences, which the dictionary calls words."""
TOLD = "..."
"""Stands for a sentence."""
SUMMARIES = ("count", "mean", "largest")
"""First cells of the rows below a table: of text the count, and a digest in place of the mean."""

UNSTABLE_PATHS = {
    "results/provenance.json": {
        ".modules": "digests of the program's files",
        ".versions": "of the packages that are installed",
        ".commit": "of the clone",
        ".jobs": "digests of code and of files with versions in them",
    },
    "results/datapackage.json": {
        ".resources[].bytes": "sizes of files",
        ".resources[].hash": "digests of files",
    },
}
"""Paths in json files below which values change with the program's files or the machine, and why: only that they are there is compared."""

_PAGE_DATA = re.compile(r'<script type="application/json" id="data">(.*?)</script>', re.DOTALL)
_NOT_RESULTS = ("logs", "records", "state")


@dataclass(frozen=True)
class Difference:
    """A column that is not as expected.

    `rows`: Number of them. `largest`: Relative to the column's largest; NaN where text differs, or the column is new or gone.
    """

    table: str
    column: str
    rows: int
    largest: float = math.nan
    remark: str = ""

    def __str__(self):
        size = "" if math.isnan(self.largest) else f", largest {self.largest:.2g} of the column's"
        return f"{self.table}: {self.column}: {self.remark or f'{self.rows} rows{size}'}"


def short_tables(folder):
    """Read all tables of a campaign's folder and of its commands, in their short form, by path.

    The list of all files is a table, too, and so are the data of the page.
    """
    tables = {}
    files = [path for path in _files(folder / "results") if path.is_file()]
    names = [path.relative_to(folder).as_posix() for path in files]
    tables["files"] = pd.DataFrame({"file": names}, dtype=str)
    for path in [*files, *sorted((folder / "commands").rglob("*.*"))]:
        name = path.relative_to(folder).as_posix()
        if name == "results/report.html":
            found = _PAGE_DATA.search(path.read_text(encoding="utf-8"))
            assert found is not None, "the page holds no data"
            tables[name] = short_object(json.loads(found[1]), {})
        elif path.suffix == ".json":
            content = json.loads(path.read_text(encoding="utf-8"))
            tables[name] = short_object(content, UNSTABLE_PATHS.get(name, {}))
        elif path.suffix in (".csv", ".parquet"):
            tables[name] = short_table(_read(path), output_of(name))
    return tables


def _files(results):
    paths = results.rglob("*.*")
    return sorted(path for path in paths if path.relative_to(results).parts[0] not in _NOT_RESULTS)


def _read(path):
    if path.suffix == ".parquet":
        return pd.read_parquet(path)
    return pd.read_csv(path, comment="#", dtype=str, keep_default_na=False)


def output_of(name):
    """Return the dictionary's entry of a table: a result, or a file that a command of the campaign writes."""
    described = describe_file(name)
    if described is None:
        command = next(word for word in _COMMANDS if Path(name).stem.startswith(word))
        stage = _COMMANDS[command]
        (described,) = (output for output in outputs() if output.stage == stage and output.row)
    return described


_COMMANDS = {
    "scale": "rftfit scale",
    "predict": "rftfit predict",
    "mesh": "rftfit predict --mesh",
    "wheel": "rftfit wheel",
    "motion": "rftfit simulate",
}
"""Command by what the name of its file begins with."""


def short_table(table, described):
    """Make the short form of a table: text cells, a column `row` with place or name of a summary in front."""
    step = max(1, math.ceil(len(table) / MOST_ROWS))
    places = [*range(0, len(table), step)]
    summaries = SUMMARIES if step > 1 else ()
    columns = {"row": [*map(str, places), *summaries]}
    for name in map(str, table.columns):
        cells = _cells(table[name], name, described)
        summary = (
            _summary(cells, has_digest=not _holds_numbers(described, name)) if summaries else ()
        )
        columns[name] = [*_texts(cells[places], _largest(cells)), *summary]
    return pd.DataFrame(columns, dtype=str)


def short_object(content, unstable):
    """Make the short form of a json object: a row for all values at one path, whatever their place in a list."""
    values_by_path: dict[str, list[Any]] = {}
    for path, value in _leaves(content, ""):
        starts = (start for start in unstable if f"{path}.".startswith((f"{start}.", f"{start}[")))
        if (start := next(starts, None)) is not None:
            values_by_path[start] = [TOLD]
        else:
            values_by_path.setdefault(path, []).append(value)
    rows = []
    for path, values in values_by_path.items():
        if all(map(_is_number, values)):
            cells = np.array([math.nan if value is None else value for value in values], float)
        else:
            cells = np.array([*map(_told, values)], object)
        step = max(1, math.ceil(len(cells) / MOST_ROWS))
        count, mean, largest = _summary(cells)
        kept = json.dumps(_texts(cells[::step], _largest(cells)), ensure_ascii=False)
        rows.append({"row": path, "count": count, "mean": mean, "largest": largest, "values": kept})
    return pd.DataFrame(rows, dtype=str)


def _is_number(value):
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _leaves(content, path):
    if isinstance(content, dict):
        for key, value in content.items():
            yield from _leaves(value, f"{path}.{key}")
    elif isinstance(content, list):
        if not content:
            yield f"{path}[]", None
        for value in content:
            yield from _leaves(value, f"{path}[]")
    else:
        yield path, content


def _told(value):
    """Return a word as it is, a sentence as a sign that there is one."""
    words = str("" if value is None else value)
    return TOLD if words.count(" ") > 2 or "<" in words else words


def _cells(column, name, described):
    """Return the cells of a column as numbers or as text, sentences as a sign that there is one."""
    entry = column_of(described, name)
    kind = "text" if entry is None else entry.kind
    if kind in ("number", "count"):
        return pd.to_numeric(column.replace("", np.nan)).to_numpy(float)
    texts = column.astype(object).where(column.notna(), "").astype(str).to_numpy(object)
    if entry is not None and is_sentence(name, entry.quantity):
        return np.array([TOLD if text else "" for text in texts], object)
    if entry is not None and entry.quantity == "value":
        return np.array([_told(text) for text in texts], object)
    return texts


def is_sentence(name, quantity):
    """Tell whether the cells of a column are sentences, by its quantity in the dictionary."""
    return quantity in SENTENCES or name in SENTENCE_COLUMNS


def _largest(cells):
    if cells.dtype == object:
        return math.nan
    finite = np.abs(cells[np.isfinite(cells)])
    return float(finite.max()) if finite.size else 0.0


def _texts(cells, largest):
    """Write numbers with as many places as `DIGITS` of the largest one have."""
    if cells.dtype == object:
        return [str(cell) for cell in cells]
    places = DIGITS - (math.floor(math.log10(largest)) + 1 if largest else 1)
    return ["" if math.isnan(cell) else f"{round(cell, places) + 0.0:.{DIGITS}g}" for cell in cells]


def _holds_numbers(described, name):
    """Tell whether the cells of a column are numbers written as text, or hold some."""
    entry = column_of(described, name)
    if entry is None:
        return False
    return entry.kind in ("number", "count") or entry.quantity in ("object", "value")


def _summary(cells, *, has_digest=True):
    """Return count of filled cells, mean and largest size; of text a digest in place of the mean."""
    if cells.dtype == object:
        joined = "\n".join(map(str, cells)).encode()
        digest = hashlib.sha256(joined).hexdigest()[:16] if has_digest else ""
        return str(sum(bool(cell) for cell in cells)), digest, ""
    finite = cells[np.isfinite(cells)]
    if not finite.size:
        return "0", "", ""
    return str(finite.size), f"{finite.mean():.{DIGITS}g}", f"{np.abs(finite).max():.{DIGITS}g}"


def _is_of_robot(name, path=""):
    in_page = name == "results/report.html" and path.startswith(".robot")
    return in_page or name.startswith("results/robot/") or "walk/" in name


def tolerance_of(name, column, *, is_here):
    """Return the tolerance of a column of a table, or of a path of json, relative to its largest number."""
    if _is_of_robot(name, column):
        if is_here:
            return OF_ROBOT if _is_of_robot(name) else HERE
        is_count = column.rpartition(".")[2] in STRIDES
        return OF_STRIDES_ELSEWHERE if is_count else OF_ROBOT_ELSEWHERE
    if is_here:
        return HERE
    # both hold numbers of the robot
    return OF_ROBOT if name in ("results/report.html", "results/reproduction.csv") else ELSEWHERE


def compare_tables(expected, actual, *, is_here):
    """Compare the short tables of a campaign, column by column."""
    differences = [
        Difference(name, "*", 0, remark=word)
        for one, other, word in ((expected, actual, "gone"), (actual, expected, "new"))
        for name in one
        if name not in other
    ]
    for name in expected.keys() & actual.keys():
        if name == "files":
            differences += _compare_files(
                *(set(tables[name]["file"]) for tables in (expected, actual))
            )
            continue
        by_path = name.endswith((".json", ".html"))
        compare = _compare_objects if by_path else _compare_columns
        differences += compare(name, expected[name], actual[name], is_here=is_here)
    return sorted(differences, key=lambda difference: (difference.table, difference.column))


def _compare_files(expected, actual):
    for path in expected ^ actual:
        yield Difference("files", path, 1, remark="gone" if path in expected else "new")


def _compare_columns(name, expected, actual, *, is_here):
    for column in dict.fromkeys([*expected.columns, *actual.columns]):
        if column not in actual or column not in expected:
            word = "gone" if column in expected else "new"
            yield Difference(name, column, len(expected), remark=word)
    if [*expected["row"]] != [*actual["row"]]:
        yield Difference(name, "*", 0, remark=f"{len(expected)} rows became {len(actual)}")
        return
    described = output_of(name)
    is_count = expected["row"] == "count"
    for column in expected.columns.intersection(actual.columns):
        before, after = expected[column], actual[column]
        if _holds_numbers(described, column):
            cells = expected.loc[~is_count, _column_of_size(name, column, expected)]
            tolerance = tolerance_of(name, column, is_here=is_here)
            rows, largest = _changes(
                [*before[~is_count]], [*after[~is_count]], tolerance, _largest_of(cells)
            )
            rows += int((before[is_count] != after[is_count]).sum())
        else:
            rows, largest = int((before != after).sum()), math.nan
        if rows:
            yield Difference(name, column, rows, largest)


def _column_of_size(name, column, table):
    """Name the column whose largest number differences are compared with: of a spread of the robot, what it is the spread of.

    Strides of a steady robot differ by what its contact makes of the last digits, which are those of the machine.
    """
    spread_of = column.replace("_sd_", "_")
    return spread_of if _is_of_robot(name) and spread_of in table else column


def _compare_objects(name, expected, actual, *, is_here):
    before_by_path, after_by_path = (
        {row["row"]: row for row in table.to_dict("records")} for table in (expected, actual)
    )
    for path in dict.fromkeys([*before_by_path, *after_by_path]):
        if path not in after_by_path or path not in before_by_path:
            yield Difference(name, path, 1, remark="gone" if path in before_by_path else "new")
            continue
        before, after = before_by_path[path], after_by_path[path]
        cells_before, cells_after = (
            [*json.loads(row["values"]), row["mean"], row["largest"]] for row in (before, after)
        )
        if not is_here and _is_of_robot(name, path) and _counts_agree(before, after):
            cells_before, cells_after = cells_before[-2:], cells_after[-2:]
        elif before["count"] != after["count"] or len(cells_before) != len(cells_after):
            remark = f"{before['count']} values became {after['count']}"
            yield Difference(name, path, 1, remark=remark)
            continue
        tolerance = tolerance_of(name, path, is_here=is_here)
        rows, largest = _changes(cells_before, cells_after, tolerance, _largest_of(cells_before))
        if rows:
            yield Difference(name, path, rows, largest)


def _counts_agree(before, after):
    """Tell whether two paths hold nearly as many numbers; then mean and largest are compared, not number by number."""
    counts = int(before["count"]), int(after["count"])
    return 0 < abs(counts[0] - counts[1]) <= OF_COUNTS_ELSEWHERE * counts[0]


def _largest_of(cells):
    """Return the largest size of the cells that are numbers."""
    sizes = [abs(number) for cell in cells if (number := _number(cell)) is not None]
    return max(sizes, default=0.0)


def _changes(expected, actual, tolerance, size):
    """Count the cells that differ; the largest difference relative to a size, NaN of text."""
    if expected == actual:
        return 0, math.nan
    rows, largest = 0, math.nan
    for before, after in zip(expected, actual, strict=True):
        change = 0.0 if before == after else _distance(before, after, size)
        if not change <= tolerance:
            rows += 1
            largest = change if math.isnan(largest) else max(largest, change)
    return rows, largest


def _distance(before, after, size):
    """Return the difference of two cells relative to a size; NaN if they differ as text."""
    numbers = _number(before), _number(after)
    if numbers[0] is not None and numbers[1] is not None:
        return abs(numbers[1] - numbers[0]) / (size or 1.0)
    if before.startswith("{") and after.startswith("{"):
        return _distance_of_objects(json.loads(before), json.loads(after))
    return math.nan


def _distance_of_objects(before, after):
    """Return the largest relative difference of the numbers of two flags; NaN if their words differ."""
    leaves_before, leaves_after = [*_leaves(before, "")], [*_leaves(after, "")]
    if [path for path, _ in leaves_before] != [path for path, _ in leaves_after]:
        return math.nan
    largest = 0.0
    for (_, one), (_, other) in zip(leaves_before, leaves_after, strict=True):
        if one == other or TOLD == _told(one) == _told(other):
            continue
        numbers = _number(str(one)), _number(str(other))
        if numbers[0] is None or numbers[1] is None:
            return math.nan
        largest = max(largest, abs(numbers[1] - numbers[0]) / (abs(numbers[0]) or 1.0))
    return largest


def _number(cell):
    try:
        number = float(cell)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def listed_columns(path):
    """Return table, as the dictionary names it, and column of all that a `known_wrong.toml` lists."""
    entries = tomllib.loads(path.read_text(encoding="utf-8"))["wrong"]
    return {
        (table, name)
        for entry in entries
        for table in entry["tables"]
        for column in entry["columns"]
        for name in alternatives(column)
    }


def is_allowed(difference, allowed):
    """Whether a column may be rewritten: it is listed, or was named on the command line."""
    tables = {difference.table}
    names = {difference.column, "*"}
    if difference.table.endswith((".csv", ".parquet")):
        described = output_of(difference.table)
        tables.add(described.file)
        if column := column_of(described, difference.column):
            names.add(column.name)
    return any((table, name) in allowed for table in tables for name in names)


def read_expected(folder):
    """Read the tracked tables below a folder, by the path that they were made from."""
    return {
        path.relative_to(folder).as_posix().removesuffix(".csv"): pd.read_csv(
            path, dtype=str, keep_default_na=False
        )
        for path in sorted(folder.rglob("*.csv"))
    }


def write_expected(tables, folder):
    """Write short tables below a folder; the name of each file is that of the result, and ``.csv``."""
    for name, table in tables.items():
        path = folder / f"{name}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        table.to_csv(path, index=False, lineterminator="\n")
