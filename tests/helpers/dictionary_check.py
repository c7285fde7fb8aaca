"""The dictionary of outputs held against files that a run has made."""

import json

import pandas as pd

from rftfit.outputs.dictionary import column_of, describe_file, outputs

UNITS = {
    "N2_per_cm6": "N^2/cm^6",
    "N_per_cm3": "N/cm^3",
    "N_per_cm2": "N/cm^2",
    "N_per_cm": "N/cm",
    "per_cm": "1/cm",
    "N_cm": "N cm",
    "cm_per_s": "cm/s",
    "deg_per_s": "degrees/s",
    "percent": "%",
    "turns": "turns",
    "hours": "h",
    "deg": "degrees",
    "Hz": "Hz",
    "N2": "N^2",
    "N": "N",
    "cm": "cm",
    "mm": "mm",
    "s": "s",
}
"""What a name ends with, the longest first, and the unit it stands for."""


def unit_of(name):
    """Unit that a name carries; empty where it carries none."""
    return next((unit for end, unit in UNITS.items() if name.endswith(f"_{end}")), "")


def files_below(results):
    root = results.parent
    return sorted(p.relative_to(root).as_posix() for p in results.rglob("*") if p.is_file())


def undescribed(output, names):
    """What is wrong between the columns of a file and those of the dictionary."""
    names = list(names)
    described_columns = {name: column_of(output, name) for name in names}
    problems = [
        f"{output.file}: {name} is not in the dictionary"
        for name, described in described_columns.items()
        if described is None
    ]
    for column in output.columns:
        names_of_column = [
            name for name, described in described_columns.items() if described == column
        ]
        if not column.when and "<" not in column.name:
            problems += [
                f"{output.file}: {name} is in the dictionary only"
                for name in column.names
                if name not in names_of_column
            ]
    return problems


def wrong_kind(output, table):
    """Columns whose cells are not of the kind that the dictionary tells."""
    problems = []
    for name in table.columns:
        column, cells = column_of(output, str(name)), table[name].dropna()
        if column is None or cells.empty:
            continue
        if not _is_kind(column, cells):
            problems.append(
                f"{output.file}: {name} is called {column.kind}, found {cells.iloc[0]!r}"
            )
    return problems


def _is_kind(column, cells):
    if column.kind == "text":
        # a number may be a text (a run called 007), but not always: that is for the reader's list
        return True
    if column.kind == "yes or no":
        return set(map(str, cells)) <= {"True", "False"}
    if not pd.api.types.is_numeric_dtype(cells) or pd.api.types.is_bool_dtype(cells):
        return False
    return column.kind == "number" or bool((cells == cells.round()).all() and (cells >= 0).all())


def columns_in(path):
    """Columns of a csv or Parquet file, or keys of a json object; with the table, if it is one."""
    if path.suffix == ".json":
        return list(json.loads(path.read_text(encoding="utf-8"))), None
    parquet = path.suffix == ".parquet"
    table = pd.read_parquet(path) if parquet else pd.read_csv(path, comment="#")
    return list(table.columns), table


def check_results(results):
    """Hold every file below results/ against the dictionary, and the dictionary against the files."""
    problems, met = [], set()
    seen: set[tuple[str, tuple[str, ...]]] = set()
    for name in files_below(results):
        output = describe_file(name)
        if output is None:
            problems.append(f"{name} is not in the dictionary")
            continue
        met.add(output.file)
        if not output.columns:
            continue
        names, table = columns_in(results.parent / name)
        if (output.file, tuple(names)) not in seen:
            seen.add((output.file, tuple(names)))
            problems += undescribed(output, names)
        if table is not None:
            problems += wrong_kind(output, table)
    problems += [
        f"{described.file} is in the dictionary, but no such file was made"
        for described in outputs()
        if described.file.startswith("results/")
        and described.file not in met
        and not described.when
    ]
    return problems
