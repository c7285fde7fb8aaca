"""What a finished workflow leaves to look at."""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING

from rftfit.cli.output import count

if TYPE_CHECKING:
    from pathlib import Path

FILES = (
    "results/report.html",
    "results/figures",
    "results/quality",
    "results/alpha_tables.xlsx",
    "results/coefficients.csv",
    "results/penetration.csv",
    "results/reproduction.csv",
    "results/ledger.csv",
)
LEDGER = "results/ledger.csv"


def closing_lines(root: Path) -> list[str]:
    """Name the results that are there, and say how many runs they stand on.

    Parameters
    ----------
    root : Path
        Folder of the campaign.

    Returns
    -------
    list of str
        Empty where there is nothing yet.
    """
    lines = [line for name in FILES if (line := _shown(root, name))]
    if lines:
        lines.insert(0, "To look at:")
    fates = ledger_line(root / LEDGER)
    return [*lines, fates] if fates else lines


def _shown(root: Path, name: str) -> str:
    path = root / name
    if not path.is_dir():
        return f"  {name}" if path.is_file() else ""
    found = sum(1 for inside in path.rglob("*") if inside.is_file())
    return f"  {name}/ ({count(found, 'file')})" if found else ""


def ledger_line(path: Path) -> str:
    """Count the runs and rows that were used and dropped.

    Parameters
    ----------
    path : Path
        The ledger.

    Returns
    -------
    str
        Empty if there is no ledger, or it is none.
    """
    runs: dict[str, bool] = {}
    rows = {"used": 0, "dropped": 0}
    try:
        with path.open(encoding="utf-8", newline="") as handle:
            for row in csv.DictReader(handle):
                used = row["fate"] == "used"
                runs[row["run_id"]] = runs.get(row["run_id"], False) or used
                rows["used" if used else "dropped"] += int(row["rows"])
    except (OSError, KeyError, ValueError, TypeError, csv.Error):
        return ""
    if not runs:
        return ""
    good = sum(runs.values())
    return (
        f"Of {count(len(runs), 'run')}, {good} used and {len(runs) - good} dropped; of "
        f"{sum(rows.values())} rows, {rows['used']} used. Every reason is in {LEDGER}."
    )
