"""What measuring costs beside merely reading: all logs to alpha, against pandas reading the files.

Both are done in this one process, in turns, medium by medium; the median of the turns counts.
"""

from __future__ import annotations

import statistics
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from rftfit.campaign.load import load_campaign
from rftfit.measure.alpha import alpha_table
from rftfit.measure.fits import fit_medium
from rftfit.measure.ingest import ingest_medium
from rftfit.measure.tare import tare_medium

if TYPE_CHECKING:
    from collections.abc import Callable

    from rftfit.campaign.load import Campaign

TURNS = 7
RESULT = Path(__file__).parent / "results" / "measure.md"


def read_with_pandas(campaign: Campaign) -> None:
    """Read every log of the campaign and do nothing with it."""
    for file in sorted({f for run in campaign.runs for f in (run.force_log, run.motion_log)}):
        pd.read_csv(campaign.raw / file, comment="#")


def measure(campaign: Campaign) -> None:
    """Go from logs to alpha tables: reading, clocks, frame, zero, phases, tare, slopes, intervals."""
    for medium in campaign.media_with_runs:
        samples, runs, _ = ingest_medium(campaign, medium)
        tared, tares, _ = tare_medium(campaign, medium, samples, runs)
        fits, _, _ = fit_medium(campaign, medium, runs, tared, tares)
        alpha_table(fits, medium, campaign.config.fit.confidence, 3)


def seconds(function: Callable[[Campaign], None], campaign: Campaign) -> float:
    start = time.perf_counter()
    function(campaign)
    return time.perf_counter() - start


def main() -> None:
    config = Path("config/config.yaml")
    if not Path("raw/paper/runs.csv").is_file():
        sys.exit("first write the demonstration campaign: rftfit reenact")
    campaign = load_campaign(config)
    measure(campaign)  # imports and file cache out of the way
    read_with_pandas(campaign)
    pairs = [
        (seconds(read_with_pandas, campaign), seconds(measure, campaign)) for _ in range(TURNS)
    ]
    pandas_s = statistics.median(pair[0] for pair in pairs)
    ours_s = statistics.median(pair[1] for pair in pairs)
    ratio = statistics.median(ours / theirs for theirs, ours in pairs)
    runs = len(campaign.runs)
    lines = [
        f"| {runs} runs ({2 * runs} files), one process | seconds | ms a run |",
        "|---|---|---|",
        f"| pandas reads the files | {pandas_s:.2f} | {1e3 * pandas_s / runs:.2f} |",
        f"| rftfit reads and measures them | {ours_s:.2f} | {1e3 * ours_s / runs:.2f} |",
        f"| ratio (median of {TURNS} turns) | {ratio:.2f} | |",
    ]
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
