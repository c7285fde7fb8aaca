"""What the checks tell and cover, by simulated campaigns, kept as rows: `make reliability`.

`no-fault`: campaigns of other media, grids and protocols, with the errors of an ordinary lab, stated
at their true sizes or not at all, and nothing wrong with them. The other kinds put one mistake of
some size into such a campaign, 20 directions made three times each. All are written as files and
checked as `rftfit check --diagnose` does it. `coverage`: 95 % intervals of campaigns in memory under
all disturbances together, the straight pushes and pulls made three times. `narrow`: all mistakes of
`tests/helpers/mistakes.py` in campaigns of two media; which cells have a narrower interval with it, by what
that is told. A copy must narrow none, and no other mistake any in silence.

A row that is in the file already is not made again, so the program may be stopped at will; delete
rows to have them made anew. `--check 0.05` makes such a share of the rows again and compares.
"""

from __future__ import annotations

import argparse
import csv
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / folder) for folder in ("tests/helpers", "benchmarks")]

from collections.abc import Callable

import numpy as np
import pandas as pd
from campaigns import FEW
from coverage_levels import as_disturbed, slow_noise
from disturbed import LEVELS, campaigns_of
from mistakes import (
    CASES,
    EQUAL,
    GRIDS,
    MISTAKES,
    Case,
    copied,
    dead,
    enacted,
    judged,
    one_off,
    stated,
    surface,
    turned,
    with_mistake,
)
from paper import REAL_LAB, sizes_of
from slices import SLICES, lab_in

from rftfit.lab.plan import parse_directions
from rftfit.reference import MEDIA

Row = dict[str, str]

ORDINARY = ("surface=0.5", "surface-session=0.5", "spread-percent=5", "patches=3", "pink=0.05")
"""Errors of a lab without a fault; bias, drift and noise are in every re-enactment."""
CURVED = "depth^1.1"
BEDS = (*MEDIA, CURVED, *SLICES)
SOUND = "sound"


class Kind(NamedTuple):
    """Campaigns of one kind.

    `sizes`, `campaigns`: of each size so many. `make`: puts the mistake into files. `told`: checks and flags
    that name it. `least`: so many of 50 campaigns of a size, of either sign, must be told.
    """

    what: str
    sizes: tuple[float, ...]
    campaigns: int
    make: Callable[..., list[str]] | None = None
    told: tuple[str, ...] = ()
    least: dict[float, int] = {}  # noqa: RUF012


def _dead(campaign, luck, share):
    return dead(
        campaign, luck, "xz"[luck.integers(2)], share, ("random", "stretch")[luck.integers(2)]
    )


def _step(campaign, luck, mm):
    return surface(campaign, luck, mm, 0.5, "stretch")


NO_FAULT, COVERAGE, NARROW = "no-fault", "coverage", "narrow"
KINDS = {
    NO_FAULT: Kind("nothing wrong", (0,), 200),
    "dead": Kind("dead, noisy channel in a share of logs", (0.3, 0.6, 1), 50, _dead, ("channels",), {1: 48}),
    "turned": Kind("mount turned by deg", (-7, -4, -2, 2, 4, 7), 25, turned, ("symmetry",), {7: 48}),
    "step": Kind(
        "step of the surface by mm", (-5, -3, -2, -1, 1, 2, 3, 5), 25, _step, ("surface",), {3: 45}
    ),
    "repeat": Kind(
        "one of three repeats off by %", (-40, -20, -10, 10, 20, 40), 25, one_off, ("repeats",), {40: 45}
    ),
    COVERAGE: Kind("intervals with so many repeats", (3,), 14),
    NARROW: Kind("mistakes by their places in the list", tuple(range(len(MISTAKES))), 4),
}  # fmt: skip
FALSE_ALARMS = 0.01
COVERAGE_OF_ONE_ROW = 30
RIGHT = {CURVED: {"linearity"}}
"""Checks that rightly doubt a medium."""


class Job(NamedTuple):
    """What makes a row, or the rows of one block of campaigns in memory."""

    kind: str
    size: float
    seed: int


def jobs_of(kinds, campaigns):
    """List all rows of some kinds, or the first campaigns of each size; those of one seed stand together."""
    jobs = [
        Job(name, size, seed)
        for name in kinds
        for size in KINDS[name].sizes
        for seed in range(1, min(KINDS[name].campaigns, campaigns or 1000) + 1)
    ]
    return sorted(jobs, key=lambda job: job.seed)


def rows_of(job):
    """Simulate one campaign, or a block of campaigns for their coverage."""
    if job.kind == NARROW:
        return [narrowed(job)]
    return covered(job) if job.kind == COVERAGE else [checked(job)]


def checked(job):
    """Make a mistake in the files of a campaign, and check it."""
    kind = KINDS[job.kind]
    luck = np.random.default_rng([job.seed, [*KINDS].index(job.kind), round(100 * abs(job.size))])
    case = FEW_THRICE
    if kind.make is None and luck.random() < 0.5:
        case = CASES[luck.integers(len(CASES))] if luck.random() < 0.5 else PAPER_ONCE
    campaign = copied(without_fault(job.seed, case))
    if kind.make is not None:
        kind.make(campaign, luck, job.size)
    judgement = judged(campaign)
    effects = {*judgement.checks["effect"]}
    verdict = next((effect for effect in ("unusable", "doubtful") if effect in effects), SOUND)
    return _row(
        job,
        told="stated" if is_stated(job.seed) else "default",
        bed=bed_of(job.seed),
        design=str(case),
        verdict=verdict,
        failed=" ".join(judgement.failed),
        flags=" ".join(sorted(judgement.flags)),
    )


FEW_THRICE, PAPER_ONCE = Case("few", "paper"), Case("paper", "paper")


def bed_of(seed):
    """Return the medium that a campaign is made in."""
    return BEDS[seed // 2 % len(BEDS)]


def is_stated(seed):
    """Whether the sizes of its errors are stated."""
    return seed % 2 == 1


@lru_cache(maxsize=1)
def without_fault(seed, case):
    """Re-enact a campaign in which nothing is wrong; those of one seed with other mistakes are the same."""
    bed, luck = bed_of(seed), np.random.default_rng(seed)
    directions: list[tuple[float, float]] | None = [*FEW] if case == FEW_THRICE else None
    if case.grid in GRIDS:
        directions = parse_directions(GRIDS[case.grid], seed)
    sizes = sizes_of([*ORDINARY, *(["power=1.1"] if bed == CURVED else [])])
    stated_errors = as_disturbed(sizes).model_dump(exclude_none=True)
    with lab_in(SLICES[bed]) if bed in SLICES else nullcontext():
        campaign = enacted(
            bed if bed in MEDIA else str(luck.choice(MEDIA)),
            seed,
            stated_errors if is_stated(seed) else None,
            directions,
            3 if case == FEW_THRICE else 1,
            sizes,
            case.protocol,
            case.tare,
        )
    if is_stated(seed):
        campaign.config["transducer"]["slow_noise_N"] = slow_noise(sizes)
    return campaign


def covered(job):
    """Intervals of a block of campaigns in memory: a row for what is stated, by level the share that hold."""
    sizes, seed = sizes_of([REAL_LAB]), 1000 * job.seed
    coverage_rows = campaigns_of(sizes, COVERAGE_OF_ONE_ROW, int(job.size), seed).reset_index()
    levels = coverage_rows.pivot_table(index="told", columns="level", values="inside")
    return [
        _row(
            job,
            told=str(told),
            bed=REAL_LAB,
            **{name: f"{shares[level]:.4f}" for name, level in LEVELS.items()},
        )
        for told, shares in levels.iterrows()
    ]


@lru_cache(maxsize=1)
def thrice(seed):
    """Re-enact and judge 20 directions made three times each, as the demonstration does; errors stated as 0 or left out."""
    medium = ("poppy_CP", "glass0.3mm_LP")[seed // 2 % 2]
    campaign = enacted(medium, seed, stated() if is_stated(seed) else None, [*FEW], 3)
    return campaign, judged(campaign)


def narrowed(job):
    """Make a mistake of the list: how many cells are narrower with it, and how many of these in silence."""
    (base, sound), name = thrice(job.seed), [*MISTAKES][int(job.size)]
    judgement = judged(with_mistake(base, name, job.seed)[0])
    cells = (
        judgement.narrower(sound, EQUAL) if name.startswith("copies") else judgement.narrower(sound)
    )
    return _row(
        job,
        told="stated" if is_stated(job.seed) else "default",
        bed=base.rows[0]["medium"],
        mistake=name,
        narrower=str(len(cells)),
        silently=str(len(judgement.silently(sound))),
        least=f"{cells['share'].min():.2f}" if len(cells) else "",
        failed=" ".join(judgement.failed.keys() - sound.failed),
        flags=" ".join(sorted(judgement.flags - sound.flags)),
    )


def _row(job, **cells):
    return {"kind": job.kind, "size": f"{job.size:g}", "seed": str(job.seed)} | cells


# --- Rows in files.

FILES = {COVERAGE: "coverage.csv", NARROW: "narrow.csv"}
"""Rows of other columns are in another file than `reliability.csv`."""


class Rows:
    """The rows that were made, in the files of a folder."""

    def __init__(self, folder):
        self.folder = folder
        self.by_job: dict[Job, list[Row]] = {}
        for name in ("reliability.csv", *FILES.values()):
            if (folder / name).is_file():
                with (folder / name).open(newline="", encoding="utf-8") as file:
                    for row in csv.DictReader(file):
                        job = Job(row["kind"], float(row["size"]), int(row["seed"]))
                        self.by_job.setdefault(job, []).append(row)

    def add(self, job, rows):
        """Append the rows of a job."""
        path = self.folder / FILES.get(job.kind, "reliability.csv")
        new = not path.is_file()
        with path.open("a", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            if new:
                writer.writeheader()
            writer.writerows(rows)
        self.by_job[job] = rows


def simulated(jobs, processes):
    """Do jobs, in their order."""
    if processes == 1:
        yield from ((job, rows_of(job)) for job in jobs)
        return
    with ProcessPoolExecutor(processes) as pool:
        yield from zip(jobs, pool.map(rows_of, jobs), strict=True)


# --- What they say.


def report(rows, kinds):
    """Print what the rows of some kinds say; whether that is as good as it must be."""
    good = True
    for name in kinds:
        rows_of_kind = [
            row
            for job, rows_of_job in rows.by_job.items()
            if job.kind == name
            for row in rows_of_job
        ]
        if not rows_of_kind:
            continue
        table = pd.DataFrame(rows_of_kind)
        if name == COVERAGE:
            table[[*LEVELS]] = table[[*LEVELS]].astype(float)
            shares = table.groupby("told")[[*LEVELS]].mean()
            count = COVERAGE_OF_ONE_ROW * table["seed"].nunique()
            print(f"coverage, percent, {count} campaigns:\n{(100 * shares).round(1).to_string()}")
        elif name == NARROW:
            good &= _narrow(table)
        elif name == NO_FAULT:
            good &= _false_alarms(table)
        else:
            good &= _power(table, KINDS[name])
    return good


def _narrow(table):
    counts = table.assign(**{name: table[name].astype(int) for name in ("narrower", "silently")})
    rows = [
        {
            "mistake": mistake,
            "narrower": rows_of_mistake["narrower"].max(),
            "share left": pd.to_numeric(rows_of_mistake["least"]).min(),
            "silently": rows_of_mistake["silently"].max(),
            "told by": " ".join(
                sorted({*" ".join([*rows_of_mistake["failed"], *rows_of_mistake["flags"]]).split()})
            )
            or "-",
        }
        for mistake, rows_of_mistake in counts.groupby("mistake", sort=False)
    ]
    print(f"cells with a narrower interval, the most of {table['seed'].nunique()} campaigns:")
    print(pd.DataFrame(rows).to_string(index=False, na_rep=""))
    copied_too = counts["mistake"].str.startswith("copies") & (counts["narrower"] > 0)
    return not (copied_too.any() or counts["silently"].any())


def _false_alarms(table):
    wrong = [
        bool({*row["failed"].split()} - RIGHT.get(str(row["bed"]), set()))
        for row in table.to_dict("records")
    ]
    doubted = table[wrong]
    for row in doubted.to_dict("records"):
        print(f"seed {row['seed']}, {row['bed']}, {row['design']}, {row['told']}: {row['failed']}")
    curved = table[table["bed"] == CURVED]
    print(
        f"{len(doubted)} of {len(table)} campaigns without a fault are doubted; "
        f"{(curved['verdict'] != SOUND).sum()} of {len(curved)} with {CURVED} are told to be curved"
    )
    return len(doubted) <= FALSE_ALARMS * len(table)


def _power(table, kind):
    codes = table["failed"] + " " + table["flags"]
    is_told = [not {*kind.told}.isdisjoint(cell.split()) for cell in codes]
    size = table["size"].astype(float)
    table = table.assign(size=size, by=size.abs(), told=is_told, doubted=table["verdict"] != SOUND)
    good = True
    for magnitude, rows_of_size in table.groupby("by"):
        least = kind.least.get(float(str(magnitude)), 0) * len(rows_of_size) / 50
        good &= bool(rows_of_size["told"].sum() >= least)
        print(
            f"{kind.what}, {magnitude:g}: named by {' or '.join(kind.told)} in {rows_of_size['told'].sum()} of {len(rows_of_size)}, "
            f"doubted in {rows_of_size['doubted'].sum()}"
            + (f"; must be {least:g}" if least else "")
        )
    share = 100 * table.pivot_table(index="bed", columns="size", values="told")
    print(f"named, percent, by medium:\n{share.round().to_string()}")
    return good


def compare_again(rows, jobs, share, seed, processes):
    """Make a share of the rows again; whether they come out as they are kept."""
    done_jobs = [job for job in jobs if job in rows.by_job]
    luck = np.random.default_rng(seed)
    chosen = [job for job in done_jobs if luck.random() < share] or done_jobs[:1]
    changed_rows = [
        (old, new)
        for job, new_rows in simulated(chosen, processes)
        for old, new in zip(rows.by_job[job], new_rows, strict=True)
        if old != new
    ]
    for old, new in changed_rows:
        print(f"kept: {old}\nmade: {new}")
    print(f"{len(chosen)} jobs made again, {len(changed_rows)} rows came out otherwise")
    return not changed_rows


def main():
    """Make the rows that are missing and report, or compare; 1 where it is not as it must be."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kinds", nargs="+", choices=[*KINDS], default=[*KINDS])
    parser.add_argument("--campaigns", type=int, help="the first of each size; default: all")
    parser.add_argument("--rows", type=Path, default=HERE, help="folder of the rows")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--check", type=float, metavar="SHARE", help="make a share again")
    parser.add_argument("--seed", type=int, default=1, help="of the share")
    words = parser.parse_args()
    rows, jobs = Rows(words.rows), jobs_of(words.kinds, words.campaigns)
    if words.check:
        return int(not compare_again(rows, jobs, words.check, words.seed, words.jobs))
    missing = [job for job in jobs if job not in rows.by_job]
    began = time.perf_counter()
    for number, (job, new_rows) in enumerate(simulated(missing, words.jobs), 1):
        rows.add(job, new_rows)
        seconds_per_job = (time.perf_counter() - began) / number
        print(
            f"\r{number} of {len(missing)}, {seconds_per_job:.2f} s each",
            end="",
            file=sys.stderr,
            flush=True,
        )
    print(file=sys.stderr)
    return int(not report(rows, words.kinds))


if __name__ == "__main__":
    sys.exit(main())
