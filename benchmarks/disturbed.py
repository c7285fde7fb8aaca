"""Coverage and width of 95 % intervals under each disturbance of a real lab, and under all of them.

``python benchmarks/disturbed.py 40`` simulates 40 campaigns, eight of each published medium, for each
disturbance of ``rftfit reenact --disturb`` at its default size, and for all together; fifteen minutes.
``... 40 surface=2 power=1.2`` takes these instead, ``real-lab`` among them if wanted. Three tables: every
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
import time
from pathlib import Path
from typing import TYPE_CHECKING

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests" / "helpers"))

import numpy as np
import pandas as pd
from coverage_levels import QUARTERS, STRESS_DEPTHS_CM, Scenario, as_disturbed, held
from ensembles import EXACT, paper_config, simulate

from rftfit.campaign.config import Errors
from rftfit.lab.disturb import DISTURBANCES, REAL_LAB, described, sizes_of
from rftfit.reference import MEDIA

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rftfit.lab.disturb import Sizes

    Flagged = Callable[[pd.DataFrame], bool]
    """Whether the fits of a campaign carry a flag that says the intervals leave something out."""

CAMPAIGNS, DRAWS, SEED = 40, 500, 2013
LEVELS = {
    **{name.removesuffix(" quarter"): f"alpha, {name}" for name in QUARTERS},
    "M": "M (lsq)", "zeta": "zeta (lsq)", "chi": "chi (lsq)", "leg peak": "leg peak",
    "peak error": "peak error",
}  # fmt: skip
"""Head of a column and its level."""

STRESS = {f"{depth:g} cm": f"stress at {depth:g} cm" for depth in STRESS_DEPTHS_CM}


def any_flag(fits: pd.DataFrame) -> bool:
    """Tell whether any run has a flag."""
    return bool((fits["flags"] != "").any())


TOLD: dict[str, Callable[[Sizes], Errors]] = {
    "stated to be none": lambda _: EXACT,
    "stated at its true size": as_disturbed,
    "defaults": lambda _: Errors(),
}
"""What is stated to the program of the disturbances."""


def scenarios(asked: Sequence[str], told: Callable[[Sizes], Errors]) -> list[Scenario]:
    """The disturbances asked for, each alone; by default all, each alone and together."""
    each = [sizes_of([one]) for one in asked or [*DISTURBANCES, REAL_LAB]]
    names = [described(sizes) if len(sizes) == 1 else REAL_LAB for sizes in each]
    return [
        Scenario(name, errors=told(sizes), sizes=sizes)
        for name, sizes in zip(names, each, strict=True)
    ]


def campaigns_of(scenario: Scenario, campaigns: int, flagged: Flagged = any_flag) -> pd.DataFrame:
    """Share of intervals with the truth in them (`inside`) and median width, by campaign and level.

    Level `flagged` has whether the campaign carries a flag.
    """
    config, rows = paper_config(DRAWS), []
    for place, medium in enumerate(MEDIA):
        ensemble = simulate(medium, max(1, campaigns // len(MEDIA)), SEED + place, scenario.sizes)
        fits = ensemble.fits(SEED + place, scenario.run_to_run, scenario.repeats, scenario.repeated)
        found = held([ensemble], scenario, config, SEED + place)
        for number, (levels, own) in enumerate(zip(found, fits, strict=True)):
            each = {"medium": medium, "campaign": number}
            rows.append(each | {"level": "flagged", "inside": float(flagged(own)), "width": np.nan})
            rows += [
                each | {"level": level, "inside": one.inside.mean(), "width": np.median(one.width)}
                for level, one in levels.items()
            ]
    return pd.DataFrame(rows).set_index(["medium", "campaign", "level"])


def line(name: str, found: pd.DataFrame, plain: pd.DataFrame, levels: Sequence[str]) -> str:
    """Coverage in percent and, in brackets, the median width relative to the undisturbed one."""
    cells = []
    for level in levels:
        part = found.xs(level, level="level")
        cell = f"{100 * part['inside'].mean():.0f}"
        if level in plain.index.get_level_values("level"):
            ratio = (part["width"] / plain.xs(level, level="level")["width"]).median()
            cell += "" if np.isnan(ratio) else f" ({ratio:.1f})"
        cells.append(cell)
    return f"| {name} | " + " | ".join(cells) + " |"


def report(
    asked: Sequence[str], campaigns: int, told: str = "defaults", flagged: Flagged = any_flag
) -> str:
    """Tables of coverage and width; progress goes to standard error."""
    plain = campaigns_of(Scenario("undisturbed"), campaigns, flagged)
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
    ]
    bent = []
    for scenario in [Scenario("none", errors=TOLD[told]({})), *scenarios(asked, TOLD[told])]:
        began = time.perf_counter()
        found = campaigns_of(scenario, campaigns, flagged)
        lines.append(line(scenario.name, found, plain, levels))
        if "power" in scenario.sizes:
            bent.append(line(scenario.name, found, plain, list(STRESS.values())))
        print(f"{scenario.name}: {time.perf_counter() - began:.0f} s", file=sys.stderr, flush=True)
    if bent:
        head = "| coverage of the stress at | " + " | ".join(STRESS) + " |"
        lines += ["", head, "|---|" + "---|" * len(STRESS), *bent]
    return "\n".join(lines)


def main() -> None:
    """Simulate and print."""
    words = sys.argv[1:]
    campaigns = int(words.pop(0)) if words and words[0].isdecimal() else CAMPAIGNS
    for told in TOLD:
        print(report(words, campaigns, told), flush=True)
        print()


if __name__ == "__main__":
    main()
