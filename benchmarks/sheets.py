"""How fast a run sheet of 10,000 rows is checked, all right or all wrong, beside pandas reading it.

Processor time of this process, the quickest of three turns; the logs exist and are empty, so none is read.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "helpers"))

import pandas as pd
from campaigns import Room

from rftfit.campaign.load import check_campaign

ROWS = 10_000
TURNS = 3
RESULT = Path(__file__).parent / "results" / "sheets.md"


def right_rows(folder: Path) -> tuple[Room, Counter[str]]:
    """Make pushes with a tare each; no problem is expected."""
    room = Room(folder)
    for number in range(ROWS // 2):
        room.add(f"big_T{number}", "t1")
        room.add(f"big_P{number}", "p1", tare_run=f"big_T{number}")
    return room, Counter()


def wrong_rows(folder: Path) -> tuple[Room, Counter[str]]:
    """Make rows whose medium, tare and two logs are wrong; four problems each are expected."""
    room = Room(folder)
    for number in range(ROWS):
        name = f"big_P{number}"
        row = {"run_id": name, "medium": f"popy{number}", "tare_run": f"U{number}"}
        logs = {"force_log": f"{name}.f", "motion_log": f"{name}.m"}
        room.rows[name] = {**room.rows["p1"], **row, **logs}
    expected = {
        "sheet.unknown-word": ROWS,
        "sheet.tare-unknown": ROWS,
        "sheet.log-missing": 2 * ROWS,
    }
    return room, Counter(expected)


def main() -> None:
    """Measure, print and write a table."""
    lines = ["| 10,000 rows | s | of pandas' reading |", "|---|---|---|"]
    for words, make in (("right", right_rows), ("wrong: four problems each", wrong_rows)):
        with tempfile.TemporaryDirectory() as place:
            room, expected = make(Path(place))
            room.write()
            checked, read = [], []
            for _ in range(TURNS):
                began = time.process_time()
                problems = check_campaign(room.path)[1]
                ended = time.process_time()
                pd.read_csv(room.folder / "runs.csv")
                read.append(time.process_time() - ended)
                checked.append(ended - began)
            counts = Counter(problem.code for problem in problems)
            if counts != expected:
                sys.exit(f"{words}: {counts}, not {expected}")
        lines.append(f"| {words} | {min(checked):.2f} | {min(checked) / min(read):.0f} times |")
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
