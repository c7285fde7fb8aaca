"""How often 95 % intervals contain the truth, at every level from alpha to the peak error.

``python benchmarks/intervals.py`` takes 100 campaigns of five media for each way that beds may
differ, a minute or two; the figures of docs/reliability.md come from ``... intervals.py 2000``, the
better part of an hour and a half. ``--robot`` takes the robot's levels alone. Campaigns, levels and
scenarios are those of the tests (tests/helpers).
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests" / "helpers"))

import numpy as np
from coverage_levels import (
    BEST_IN,
    SCENARIOS,
    Ensemble,
    Scenario,
    cover,
    cover_robot,
    paper_config,
    simulate,
)

from rftfit.reference import MEDIA

CAMPAIGNS, CHUNK, DRAWS, SEED = 100, 100, 500, 2013
ROBOTS, BESTS, ROBOT_DRAWS = 10, 80, 40
"""One campaign in so many has the robot's speed (two conditions), and its best curvature; it needs few
draws."""

RESULT = HERE / "results" / "intervals.md"
Shares = dict[str, np.ndarray]


def five_media(first: str, campaigns: int, seed: int) -> list[Ensemble]:
    """Campaigns of all media; samples are simulated for one, whose errors the others take over."""
    chain = [simulate(first, campaigns, seed)]
    for medium in MEDIA:
        if medium != first:
            chain.append(chain[-1].as_medium(medium))
    return sorted(chain, key=lambda ensemble: MEDIA.index(ensemble.medium))


def scenario_shares(scenario: Scenario, campaigns: int) -> Shares:
    """Share of intervals with the truth in them, by level, shape (campaigns,)."""
    config = paper_config(DRAWS)
    parts = []
    for chunk, start in enumerate(range(0, campaigns, CHUNK)):
        size = min(CHUNK, campaigns - start)
        media = five_media(MEDIA[chunk % len(MEDIA)], size, SEED + chunk)
        parts.append(cover(media, scenario, config, SEED + chunk))
    return {
        level: np.concatenate([chunk_shares[level] for chunk_shares in parts]) for level in parts[0]
    }


def robot_shares(scenario: Scenario, campaigns: int) -> Shares:
    """Take the same of the robot, in one medium after the other."""
    config = paper_config(ROBOT_DRAWS)
    medium_campaigns = campaigns // ROBOTS // len(MEDIA)
    bests = campaigns // BESTS
    parts = [
        cover_robot(
            simulate(
                medium, max(medium_campaigns, bests if medium == BEST_IN else 0), SEED + place
            ),
            scenario,
            config,
            SEED + place,
            bests,
        )
        for place, medium in enumerate(MEDIA)
    ]
    names = dict.fromkeys(name for medium_shares in parts for name in medium_shares)
    return {
        name: np.concatenate(
            [medium_shares[name] for medium_shares in parts if name in medium_shares]
        )
        for name in names
    }


def rows(shares: dict[str, Shares]) -> list[str]:
    """Lines of the table: percent, with the standard error of the simulation."""
    head = ["| interval of | " + " | ".join(shares) + " |", "|---|" + "---|" * len(shares)]
    levels = next(iter(shares.values()))
    return head + [
        f"| {level} | "
        + " | ".join(
            f"{100 * level_shares[level].mean():.1f} ± {100 * level_shares[level].std() / level_shares[level].size ** 0.5:.1f}"
            for level_shares in shares.values()
        )
        + " |"
        for level in levels
    ]


def main() -> None:
    """Simulate every scenario and write the table."""
    words = [word for word in sys.argv[1:] if word != "--robot"]
    only_robot = len(words) < len(sys.argv) - 1
    campaigns = int(words[0]) if words else CAMPAIGNS
    shares: dict[str, Shares] = {}
    for scenario in SCENARIOS:
        start = time.perf_counter()
        interval_shares = {} if only_robot else scenario_shares(scenario, campaigns)
        shares[scenario.name] = interval_shares | robot_shares(scenario, campaigns)
        print(f"{scenario.name}: {time.perf_counter() - start:.0f} s", flush=True)
    robot = next(iter(shares.values()))
    head = (
        f"Coverage of 95 % intervals, percent; {campaigns} campaigns a column, "
        f"{robot['robot speed'].size} for the robot's speed (two conditions each) and "
        f"{robot['best curvature'].size} for its best curvature."
    )
    text = "\n".join([head, "", *rows(shares)])
    print(text)
    if campaigns >= 2000 and not only_robot:
        RESULT.write_text(f"{text}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
