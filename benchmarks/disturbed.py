"""Coverage and width of 95 % intervals under each disturbance of a real lab, and under all of them.

``python benchmarks/disturbed.py 40`` simulates 40 campaigns, eight of each published medium, for each
disturbance of ``tests/helpers/paper.py`` at its default size, and for all together; five minutes.
``... 40 surface=2 power=1.2`` takes these instead, ``real-lab`` among them if wanted; ``repeats=3`` makes the
straight pushes and pulls three times each, from which the spread is found. ``files`` writes each
campaign's logs and reads them, with everything the measuring does. Three tables: every
error stated to be none, each disturbance stated at its true size where the config has a key for it, and
nothing stated, so that the defaults hold.

Quarters are those of all alpha (z and x) of a medium by size. A width is the median over cells and
campaigns of the width beside that of the same campaign undisturbed. Flagged: campaigns of which a run
has a flag. With ``power`` the truth of alpha is the stress at 5 cm over 5 cm; the stress at other depths
has a table of its own.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests" / "helpers"))

import numpy as np
import pandas as pd
from coverage_levels import (
    EXACT,
    QUARTERS,
    STRESS_DEPTHS_CM,
    Scenario,
    as_disturbed,
    held,
    held_in_files,
    measured,
    paper_config,
    simulate,
    slow_noise,
    written,
)
from paper import DISTURBANCES, REAL_LAB, described, sizes_of

from rftfit.campaign.config import ErrorSettings
from rftfit.campaign.load import load_campaign
from rftfit.reference import MEDIA
from rftfit.workflow.measure import FLAGGING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from coverage_levels import Ensemble, Inside
    from paper import Sizes

    from rftfit.results import Results

CAMPAIGNS, DRAWS, SEED = 40, 500, 2013
INDEX = ["told", "medium", "campaign", "level"]
LEVELS = {
    **{name.removesuffix(" quarter"): f"alpha, {name}" for name in QUARTERS},
    "M": "M (lsq)",
    "zeta": "zeta (lsq)",
    "chi": "chi (lsq)",
    "leg peak": "leg peak",
    "peak error": "peak error",
}
"""Head of a column and its level."""

STRESS = {f"{depth:g} cm": f"stress at {depth:g} cm" for depth in STRESS_DEPTHS_CM}


NOTHING_LEFT = "stated to be none"
TOLD: dict[str, Callable[[Sizes], tuple[ErrorSettings, float]]] = {
    NOTHING_LEFT: lambda _: (EXACT, 0.0),
    "stated at its true size": lambda sizes: (as_disturbed(sizes), slow_noise(sizes)),
    "defaults": lambda _: (ErrorSettings(), 0.0),
}
"""What is stated to the program of the disturbances: section `errors`, and `slow_noise_N`."""


def disturbances(names: Sequence[str]) -> dict[str, Sizes]:
    """The disturbances asked for, by name, each alone; by default all, each alone and together."""
    size_sets = [sizes_of([name]) for name in names or [*DISTURBANCES, REAL_LAB]]
    return {described(sizes) if len(sizes) == 1 else REAL_LAB: sizes for sizes in size_sets}


def campaigns_of(sizes: Sizes, campaigns: int, repeats: int, seed: int = SEED) -> pd.DataFrame:
    """Share of intervals with the truth in them (`inside`) and median width, by told, campaign, level.

    Level `flagged` has whether the campaign carries a flag.
    """
    config, rows = paper_config(DRAWS), []
    for place, medium in enumerate(MEDIA):
        count = max(1, campaigns // len(MEDIA))
        ensembles: dict[float, Ensemble] = {}
        for what, stated in TOLD.items():
            errors, slow = stated(sizes)
            if slow not in ensembles:
                ensembles[slow] = simulate(medium, count, seed + place, sizes, slow)
            scenario = Scenario(
                what, errors=errors, sizes=sizes, repeats=repeats, slow_noise_N=slow
            )
            fits = ensembles[slow].fits(seed + place, repeats=repeats)
            campaign_levels = held(
                [ensembles[slow]], scenario, config, seed + place, methods=("lsq",)
            )
            for number, (levels, fits_of_campaign) in enumerate(
                zip(campaign_levels, fits, strict=True)
            ):
                rows += rows_of(
                    {"told": what, "medium": medium, "campaign": number},
                    levels,
                    fits_of_campaign["bent"].any(),
                )
    return pd.DataFrame(rows).set_index(INDEX)


def campaign_in_files(sizes: Sizes, number: int) -> pd.DataFrame:
    """The same of one campaign whose logs are written and read; each number has a medium of its own."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        campaign = load_campaign(written(Path(folder) / "lab", sizes, number, SEED, DRAWS))
        every: dict[float, Results] = {}
        for what, stated in TOLD.items():
            errors, slow = stated(sizes)
            if slow not in every:
                every[slow] = measured(campaign, slow)
            (medium,) = every[slow].media
            levels = held_in_files(every[slow], errors, sizes, number)
            flags = (every[slow].table(f"flags/{stage}/{medium}.csv") for stage in FLAGGING)
            flagged = any(map(len, flags))
            rows += rows_of({"told": what, "medium": medium, "campaign": number}, levels, flagged)
    return pd.DataFrame(rows).set_index(INDEX)


def rows_of(
    campaign_keys: dict[str, object], levels: Inside, flagged: bool
) -> list[dict[str, object]]:
    """Rows of one campaign."""
    of_flags = {"level": "flagged", "inside": float(flagged), "width": np.nan}
    level_rows = [
        {"level": level, "inside": intervals.inside.mean(), "width": np.median(intervals.width)}
        for level, intervals in levels.items()
    ]
    return [campaign_keys | row for row in (of_flags, *level_rows)]


def line(name: str, rows: pd.DataFrame, plain: pd.DataFrame, levels: Sequence[str]) -> str:
    """Coverage in percent and, in brackets, the median width relative to the undisturbed one."""
    cells = []
    for level in levels:
        rows_of_level = rows.xs(level, level="level")
        cell = f"{100 * rows_of_level['inside'].mean():.0f}"
        if level in plain.index.get_level_values("level"):
            ratio = (rows_of_level["width"] / plain.xs(level, level="level")["width"]).median()
            cell += "" if np.isnan(ratio) else f" ({ratio:.1f})"
        cells.append(cell)
    return f"| {name} | " + " | ".join(cells) + " |"


def of_told(rows: pd.DataFrame, told: str) -> pd.DataFrame:
    """Rows of the intervals of which so much was told."""
    told_rows = rows.xs(told, level="told")
    assert isinstance(told_rows, pd.DataFrame)
    return told_rows


def report(rows_by_name: dict[str, pd.DataFrame], told: str, campaigns: int) -> str:
    """Table of coverage and width. `rows_by_name`: By disturbance, of "none" too."""
    plain = of_told(rows_by_name["none"], NOTHING_LEFT)
    heads, levels = [*LEVELS, "flagged"], [*LEVELS.values(), "flagged"]
    head = (
        f"Errors {told}. Coverage of 95 % intervals, percent, and median width relative to undisturbed "
        f"with all errors stated to be none; {campaigns} campaigns a row."
    )
    lines = [
        head,
        "",
        "| disturbance | " + " | ".join(heads) + " |",
        "|---|" + "---|" * len(heads),
        line("none, all stated", plain, plain, levels),
        *(line(name, of_told(rows, told), plain, levels) for name, rows in rows_by_name.items()),
    ]
    stress_level = next(iter(STRESS.values()))
    bent = {
        name: of_told(rows, told)
        for name, rows in rows_by_name.items()
        if stress_level in rows.index.get_level_values("level")
    }
    if bent:
        head = "| coverage of the stress at | " + " | ".join(STRESS) + " |"
        lines += ["", head, "|---|" + "---|" * len(STRESS)]
        lines += [line(name, rows, plain, list(STRESS.values())) for name, rows in bent.items()]
    return "\n".join(lines)


def simulated(
    names: Sequence[str], campaigns: int, repeats: int, *, files: bool
) -> dict[str, pd.DataFrame]:
    """Campaigns of every disturbance, and of none, on all cores; progress goes to standard error."""
    sizes_by_name: dict[str, Sizes] = {"none": {}, **disturbances(names)}
    began, rows_by_name = time.perf_counter(), {}
    with ProcessPoolExecutor() as pool:
        waiting = {
            name: [pool.submit(campaign_in_files, sizes, number) for number in range(campaigns)]
            if files
            else [pool.submit(campaigns_of, sizes, campaigns, repeats)]
            for name, sizes in sizes_by_name.items()
        }
        for name, parts in waiting.items():
            rows_by_name[name] = pd.concat([future.result() for future in parts]).sort_index()
            passed = time.perf_counter() - began
            print(f"{name}: after {passed:.0f} s", file=sys.stderr, flush=True)
    return rows_by_name


def main() -> None:
    """Simulate and print."""
    words = sys.argv[1:]
    campaigns = int(words.pop(0)) if words and words[0].isdecimal() else CAMPAIGNS
    many = [word for word in words if word.startswith("repeats=")]
    repeats = int(many[-1].partition("=")[2]) if many else 1
    names = [word for word in words if word not in (*many, "files")]
    rows_by_name = simulated(names, campaigns, repeats, files="files" in words)
    for told in TOLD:
        print(report(rows_by_name, told, campaigns), flush=True)
        print()


if __name__ == "__main__":
    main()
