"""Frame of every study: units are drawn by seed, graded in processes, kept as rows of a csv file, and printed as tables.

    python studies/STUDY.py [PART ...] [--count N] [--seed N] [--processes N]
        [--only WORD ...] [--rows FOLDER] [--tables FOLDER] [--check SHARE]

`--only`: units whose name holds one of the words. `--rows`: FOLDER/PART.csv keeps the rows; units that it holds are not graded again. `--tables`: each table as a csv file, too.
`--check`: a share of the kept units is graded again; exit status 1 where a row differs. Without PART all parts are done.
"""

from __future__ import annotations

import argparse
import io
import os
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import Pool
from pathlib import Path
from typing import Any

for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(threads, "1")
PROJECT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(PROJECT / folder) for folder in ("tests/helpers", "benchmarks")]

import numpy as np
import pandas as pd

Row = dict[str, object]
Unit = tuple[Any, ...]
Tables = list[tuple[str, pd.DataFrame]]


@dataclass(frozen=True)
class Part:
    """What one part of a study grades.

    `units`: arguments of `grade`, by the count and the seed that the user asks for; a list where they are always the same.
    `grade`: the rows of one unit. `report`: titles and tables of all rows. `is_good`: whether the rows keep what is promised.
    """

    units: Sequence[Unit] | Callable[[int, int], Sequence[Unit]]
    grade: Callable[..., list[Row]]
    report: Callable[[pd.DataFrame], Tables]
    count: int = 0
    is_good: Callable[[pd.DataFrame], bool] = lambda _: True

    def list_units(self, count: int | None, seed: int) -> Sequence[Unit]:
        """List the units of a count and a seed."""
        if callable(self.units):
            return self.units(self.count if count is None else count, seed)
        return self.units


def named(names: Sequence[object]) -> list[Unit]:
    """Units of one argument each."""
    return [(name,) for name in names]


def numbered(count: int, seed: int) -> list[Unit]:
    """Units of the seed and a number each."""
    return [(seed, number) for number in range(count)]


def list_rows(title: str) -> Callable[[pd.DataFrame], Tables]:
    """Report of a part whose rows are printed as they are."""
    return lambda rows: [(title, rows.drop(columns="unit"))]


def differing_files(digests: dict[str, str], other_digests: dict[str, str]) -> list[str]:
    """Names of the files, by their digests in two folders, that differ or that one folder lacks."""
    return sorted({name for name, _ in digests.items() ^ other_digests.items()})


def unit_name(unit: Unit) -> str:
    """Name of a unit in the column `unit`."""
    return ", ".join(map(str, unit))


def grade_units(part: Part, units: Sequence[Unit], processes: int) -> Iterator[pd.DataFrame]:
    """Rows of each unit in turn, as a csv file gives them back."""
    jobs = [(part.grade, unit) for unit in units]
    if processes == 1 or len(units) < 2:
        yield from map(_grade_unit, jobs)
        return
    with Pool(processes) as pool:
        yield from pool.imap(_grade_unit, jobs)


def _grade_unit(job: tuple[Callable[..., list[Row]], Unit]) -> pd.DataFrame:
    grade, unit = job
    rows = pd.DataFrame(grade(*unit))
    rows.insert(0, "unit", unit_name(unit))
    return read_rows(io.StringIO(rows.to_csv(index=False, float_format="%.6g")))


def read_rows(file: Path | io.StringIO) -> pd.DataFrame:
    """Rows of a csv file; the unit is a name, whatever it looks like."""
    return pd.read_csv(file, dtype={"unit": str})


def keep_rows(
    part: Part, units: Sequence[Unit], file: Path | None = None, processes: int = 1
) -> pd.DataFrame:
    """Rows of all units; those that the file lacks are graded, and added to it one unit after the other."""
    kept_rows = read_rows(file) if file and file.exists() else pd.DataFrame({"unit": []})
    kept_units = set(kept_rows["unit"])
    missing = [unit for unit in units if unit_name(unit) not in kept_units]
    tables = [kept_rows]
    for number, rows in enumerate(grade_units(part, missing, processes), 1):
        tables.append(rows)
        print(f"\r{number} of {len(missing)}", end="", file=sys.stderr, flush=True)
        if file:
            file.parent.mkdir(parents=True, exist_ok=True)
            pd.concat(tables, ignore_index=True).to_csv(file, index=False)
    print(file=sys.stderr)
    return pd.concat([table for table in tables if len(table)], ignore_index=True)


def differing_units(part: Part, units: Sequence[Unit], file: Path, share: float) -> list[str]:
    """Names of the units, a share of those in the file, whose rows come out otherwise than they are kept."""
    kept_rows = read_rows(file)
    kept_units = [unit for unit in units if unit_name(unit) in set(kept_rows["unit"])]
    random = np.random.default_rng(1)
    chosen = [unit for unit in kept_units if random.random() < share] or kept_units[:1]
    names = []
    for unit in chosen:
        name = unit_name(unit)
        rows = _grade_unit((part.grade, unit))
        of_unit = kept_rows.loc[kept_rows["unit"] == name, rows.columns].reset_index(drop=True)
        # a column of whole numbers may be kept as one of fractions
        if len(of_unit) != len(rows) or not (of_unit.fillna("") == rows.fillna("")).all(axis=None):
            names.append(name)
            print(f"kept:\n{of_unit.to_string()}\ngraded now:\n{rows.to_string()}")
    print(f"{len(chosen)} units graded again, {len(names)} differ")
    return names


def show(title: str, table: pd.DataFrame) -> None:
    """Print a table as markdown."""
    print(f"\n{title}\n\n| {' | '.join(map(str, table.columns))} |")
    print("|" + "---|" * table.shape[1])
    for line in table.to_dict("records"):
        print(f"| {' | '.join(format_cell(value) for value in line.values())} |")


def format_cell(value: object) -> str:
    """A number with three digits, at least one of them behind the point; nothing for what is unknown."""
    if not isinstance(value, float):
        return str(value)
    if np.isnan(value):
        return ""
    return f"{value:.3g}" if abs(value) < 10 else f"{value:.1f}"


def run_study(doc: str | None, parts: dict[str, Part], processes: int | None = None) -> int:
    """Do the parts that the command line names; 1 where rows do not keep what is promised."""
    parser = argparse.ArgumentParser(
        description=doc, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="*", choices=[*parts, []], metavar="PART")
    parser.add_argument("--count", type=int, help="campaigns, media or sets")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=processes or os.cpu_count() or 1)
    parser.add_argument("--only", nargs="+", default=[""], metavar="WORD")
    parser.add_argument("--rows", type=Path, metavar="FOLDER")
    parser.add_argument("--tables", type=Path, metavar="FOLDER")
    parser.add_argument("--check", type=float, metavar="SHARE")
    options = parser.parse_args()
    is_good = True
    for name in options.parts or parts:
        part = parts[name]
        units = [
            unit
            for unit in part.list_units(options.count, options.seed)
            if any(word in unit_name(unit) for word in options.only)
        ]
        file = options.rows / f"{name}.csv" if options.rows else None
        if options.check:
            is_good &= not differing_units(part, units, file or Path(), options.check)
            continue
        rows = keep_rows(part, units, file, options.processes)
        print(f"\n## {name}, {len(units)} units")
        for title, table in part.report(rows):
            show(title, table)
            if options.tables:
                options.tables.mkdir(parents=True, exist_ok=True)
                slug = re.sub(r"\W+", "_", f"{name} {title}").strip("_").lower()
                table.to_csv(options.tables / f"{slug}.csv", index=False, float_format="%.4g")
        is_good &= part.is_good(rows)
    return int(not is_good)
