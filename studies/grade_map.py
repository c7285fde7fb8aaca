"""How far the map can be believed: coverage, scores and errors in directions that were not pushed.

    python studies/grade_map.py --rows rows.csv                    four minutes on one core; goes on where it stopped
    python studies/grade_map.py --report rows.csv [PARENT_ROWS]    tables, and ratios to those of another version

Media, size free: the published ones without themselves or without their material among the known shapes, slices of
3D-RFT at three frictions, published ones plus a smooth random field of 5 and 10 % of the largest alpha that
takes energy everywhere, and draws of the prior. Each set has its own pushes in random directions, nested, with
errors of 5 % of their alpha and 1 % of the largest, stated as such; the same for every version of the estimate.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
import zlib
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Literal

sys.path.append(str(Path(__file__).parents[1] / "tests" / "helpers"))

import numpy as np
import pandas as pd
from shapes import BETA_DEG, GAMMA_DEG, MATERIALS, NODES, planned, truth
from slices import slice_3drft

import rftfit
from rftfit import Map, Shapes
from rftfit.conventions import FloatArray, mirror
from rftfit.errors import InputError
from rftfit.model import shapes as shapes_module
from rftfit.model.draws import interval
from rftfit.model.forces import force_draws
from rftfit.model.fourier import evaluate, fit_lsq
from rftfit.model.profiles import TableProfile
from rftfit.model.shapes import NOT_ALIKE, Pushes, estimate, published_shapes, root, usual_error
from rftfit.reference import LEGS, MEDIA

if TYPE_CHECKING:
    from collections.abc import Callable

COUNTS = (1, 2, 4, 6, 8, 12, 20, 30)
FRICTIONS = ("0.2", "0.4", "0.8")
FOREIGN = ("isotropic", "depth only", "alpha_x doubled")
GRADED = {
    "medium out": MEDIA,
    "material out": MEDIA,
    "3D-RFT": FRICTIONS,
    "rough 5": MEDIA,
    "rough 10": MEDIA,
    "prior": ("first", "second"),
}
PARTS = GRADED | {"planned": (*FRICTIONS, *MEDIA), "foreign": FOREIGN}
PUBLISHED = ("medium out", "material out")
_LEAST_WORK = shapes_module.LEAST_WORK
ROUGH_LENGTH = 0.7
"""Of the random field, in chords of the circles of 2 beta and gamma."""

PEAKS = {"lift": 0, "thrust": 1}
ENDS = ("", "_lo", "_hi")
KEYS = ["part", "name", "set", "count"]
COLUMNS = [
    *KEYS,
    "raised",
    "coverage",
    "score",
    "rms",
    "half",
    "off_mean",
    "not_passive",
    "belongs",
    "seconds",
    "nine",
    *(
        f"{peak}_{leg}_{way}"
        for peak in PEAKS
        for leg in LEGS
        for way in ("true", *(how + end for how in "ab" for end in ENDS))
    ),
]
"""Alpha in % of its largest; forces in N: a at the pose where the mean is largest, b of the draws' own peaks."""

_ONE_NUMBER = np.abs(GAMMA_DEG).round() == 90
_SAME = np.where(_ONE_NUMBER, np.abs(BETA_DEG), BETA_DEG).round()
_FREE = np.stack([np.full(_SAME.size, fill_value=True), ~(_ONE_NUMBER & (_SAME % 90 == 0))])


def first_that_takes_energy(make: Callable[[], FloatArray]) -> FloatArray:
    """First of many random media, shape (m, 2, n), that gives back at most 2 % of its largest alpha."""
    while True:
        alpha = make()
        work = alpha[:, 0] * np.sin(NODES[1]) + alpha[:, 1] * np.cos(NODES[1])
        takes = work.min(axis=1) >= -0.02 * np.abs(alpha).max(axis=(1, 2))
        if takes.any():
            return np.asarray(alpha[takes.argmax()])


@cache
def bumps() -> FloatArray:
    """Bumps around many points of the torus, at the nodes, shape (2, points, n): even and odd under the mirror."""

    def on_circles(beta: FloatArray, gamma: FloatArray) -> FloatArray:
        return np.stack([np.cos(2 * beta), np.sin(2 * beta), np.cos(gamma), np.sin(gamma)], axis=-1)

    lines = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    two_beta, gamma = (part.ravel() for part in np.meshgrid(lines, lines))
    middles = on_circles(two_beta / 2, gamma)[:, None]
    own, image = (
        np.exp(-((middles - on_circles(*at)) ** 2).sum(axis=-1) / ROUGH_LENGTH**2)
        for at in (NODES, mirror(*NODES))
    )
    return np.stack([own + image, own - image])


def roughened(alpha: FloatArray, share: float, random: np.random.Generator) -> FloatArray:
    """Many times alpha plus a smooth random field whose root mean square is a share of the largest alpha."""
    field = (random.standard_normal((2, 1000, bumps().shape[1])) @ bumps()).swapaxes(0, 1)
    size = np.sqrt((field**2).mean(axis=(1, 2), keepdims=True))
    return np.asarray(alpha + share * np.abs(alpha).max() / size * field)


def from_prior(shapes: Shapes, random: np.random.Generator) -> FloatArray:
    """Many further media, as the shapes expect them."""
    prior, by = shapes.prior(*NODES), shapes.variation
    own = random.uniform(0, by.most_own, (100, 1))
    departure = (by.departure_dof / 2 + 1) / random.gamma(by.departure_dof / 2, size=(100, 1))
    parts = (
        (1.0, prior.between),
        (np.sqrt(1 - own), root(prior.smooth)),
        (np.sqrt(own), root(prior.rough)),
    )
    drawn = sum(part * (random.standard_normal((100, len(rows))) @ rows) for part, rows in parts)
    return np.asarray(0.2 * (prior.mean + np.sqrt(departure) * drawn).reshape(100, 2, -1))


def medium(part: str, name: str, random: np.random.Generator) -> tuple[FloatArray, Shapes]:
    """Alpha of a medium at the nodes, shape (2, n), and what is known before it is pushed."""
    if part == "prior":
        shapes = published_shapes()
        return first_that_takes_energy(lambda: from_prior(shapes, random)), shapes
    if name in FRICTIONS:
        law = partial(slice_3drft, float(name), 0.4, "")
        z, x = np.array([law(*at) for at in zip(BETA_DEG, GAMMA_DEG, strict=True)]).T
        # its symmetry, which the law breaks where a sheet moves along itself
        return np.stack(TableProfile(z, x, *NODES).alpha(*NODES)), published_shapes()
    if part == "foreign":
        published = random.choice(MEDIA)
        alpha = truth(published)
        if name == "isotropic":
            alpha = alpha[0].max() * np.stack([np.sin(NODES[1]), np.cos(NODES[1])])
        elif name == "depth only":
            table = TableProfile.published(published)
            alpha = np.stack(rftfit.DepthOnlyProfile.of(table).alpha(*NODES))
        else:
            alpha[1] *= 2
        return alpha, published_shapes()
    alpha = truth(name)
    if part.startswith("rough"):
        share = float(part.split()[1]) / 100
        alpha = first_that_takes_energy(lambda: roughened(truth(name), share, random))
    return alpha, published_shapes(without=(name,) if part == "medium out" else MATERIALS[name])


@cache
def weights(leg: str) -> FloatArray:
    """Force on a leg over its poses for an alpha of 1 at each node, z and x: shape (2, n, poses)."""
    unit = np.eye(_SAME.size)
    poses = rftfit.rotation().poses
    forces = force_draws(TableProfile(unit, unit, *NODES), rftfit.model_leg(leg), poses)
    return np.stack([forces.force_z_N, forces.force_x_N])


def peaks_of(found: Map, leg: str) -> dict[str, float]:
    """Largest lift and thrust: a, where the mean is largest, as `find_peaks`; b, of the draws' own peaks."""
    result: dict[str, float] = {}
    for peak, component in PEAKS.items():
        at_poses = weights(leg)[component]
        curve = found.alpha[component, : _SAME.size] @ at_poses
        many = found.draws[:, component, : _SAME.size] @ at_poses
        at, tops = int(curve.argmax()), many.max(axis=1)
        ways = {"a": (curve[at], many[:, at]), "b": (tops.mean(), tops)}
        for way, (value, draws) in ways.items():
            names = [f"{peak}_{leg}_{way}{end}" for end in ENDS]
            result |= zip(names, map(float, (value, *interval(draws, 0.95))), strict=True)
    return result


def graded(found: Map, alpha: FloatArray, places: list[int]) -> dict[str, float]:
    """Alpha where it was not pushed and has freedom, and the peaks of the legs."""
    free = _FREE & ~np.isin(_SAME + 1000 * GAMMA_DEG, (_SAME + 1000 * GAMMA_DEG)[places])
    largest = np.abs(alpha).max() / 100
    mean, draws = found.alpha[:, : _SAME.size][free], found.draws[..., : _SAME.size][:, free]
    own = alpha[free]
    lo, hi = interval(draws, 0.95)
    miss = np.maximum(lo - own, 0) + np.maximum(own - hi, 0)
    result = {
        "coverage": 100 * np.mean(miss == 0),
        "score": np.mean(hi - lo + 40 * miss) / largest,
        "rms": np.sqrt(np.mean((mean - own) ** 2)) / largest,
        "half": np.sqrt(np.mean((hi - lo) ** 2)) / 2 / largest,
        "off_mean": np.max(np.abs(mean - draws.mean(axis=0)) / draws.std(axis=0)),
    }
    for leg in LEGS:
        result |= peaks_of(found, leg)
        for peak, component in PEAKS.items():
            result[f"{peak}_{leg}_true"] = (alpha[component] @ weights(leg)[component]).max()
    return result


def rows_of(every: bool, part: str, name: str, number: int) -> list[dict[str, object]]:
    """Rows of one set of pushes; `every`: no draw is left out."""
    shapes_module.LEAST_WORK = np.inf if every else _LEAST_WORK
    seed = zlib.crc32(f"{part} {name}".encode())
    alpha, shapes = medium(part, name, np.random.default_rng([seed, number, 0]))
    random = np.random.default_rng([seed, number, 1])
    order = [int(at) for at in random.permutation(_SAME.size)]
    error = usual_error(alpha)
    seen = alpha + error * random.standard_normal(alpha.shape)
    if part == "planned":
        order = planned(shapes, 6)
    rows = []
    for count in (6,) if part == "planned" else COUNTS:
        row: dict[str, object] = dict(zip(KEYS, (part, name, number, count), strict=True))
        places, start = order[:count], time.perf_counter()
        try:
            angles = BETA_DEG[places], GAMMA_DEG[places]
            found = estimate(Pushes.of(*angles, seen[:, places], error[:, places]), shapes)
            row["belongs"] = found.belongs
            if part == "planned":
                fitted = np.stack(evaluate(fit_lsq(*NODES, *seen), *NODES))
                for column, one in (("rms", found.alpha[:, : _SAME.size]), ("nine", fitted)):
                    row[column] = 100 * np.sqrt(np.mean((one - alpha) ** 2)) / np.abs(alpha).max()
            elif part != "foreign":
                row["not_passive"] = 100 * found.not_passive  # makes the draws
                row["seconds"] = time.perf_counter() - start
                row |= graded(found, alpha, places)
        except (ValueError, InputError) as problem:
            row["raised"] = type(problem).__name__
        rows.append(row)
    return rows


def grade(file: Path, parts: list[str], sets: int, workers: int, *, every: bool) -> None:
    """Append the rows that are not there yet."""
    done = set()
    if file.exists():
        done = {*read(file)[KEYS[:3]].itertuples(index=False, name=None)}
    else:
        pd.DataFrame(columns=COLUMNS).to_csv(file, index=False)
    wanted = [(p, n, s) for s, p in product(range(sets), parts) for n in PARTS[p]]
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        left = [one for one in wanted if one not in done]
        for rows in pool.map(partial(rows_of, every), *zip(*left, strict=True)) if left else ():
            made = pd.DataFrame(rows, columns=COLUMNS)
            made.to_csv(file, mode="a", header=False, index=False, float_format="%.6g")


def read(file: Path) -> pd.DataFrame:
    """Rows of a file; names are text, as 3D-RFT's 0.2."""
    return pd.read_csv(file, dtype={"name": str, "raised": str})


def cells(
    rows: pd.DataFrame, column: str, *by: str, how: Literal["mean", "median"] = "mean"
) -> pd.DataFrame:
    """Mean or median of a column by what `by` names, and by the number of pushes."""
    return rows.pivot_table(column, [*by], "count", aggfunc=how, sort=False)


def table(title: str, found: pd.DataFrame, digits: int = 0) -> None:
    """Print a table as markdown."""
    print(f"\n{title}\n\n| | {' | '.join(map(str, found.columns))} |")
    print("|" + "---|" * (found.shape[1] + 1))
    for name, values in found.iterrows():
        label = " ".join(map(str, name)) if isinstance(name, tuple) else name
        print(f"| {label} | {' | '.join(f'{value:.{digits}f}' for value in values)} |")


def peaks(rows: pd.DataFrame, way: str) -> pd.DataFrame:
    """One row a leg and peak: whether its interval holds the truth, its score, its value over the truth."""
    parts = []
    for peak, leg in product(PEAKS, LEGS):
        ends = (rows[f"{peak}_{leg}_{one}"] for one in ("true", *(way + end for end in ENDS)))
        true, value, lo, hi = ends
        miss = (lo - true).clip(lower=0) + (true - hi).clip(lower=0)
        numbers = {"inside": 100.0 * (miss == 0), "score": (hi - lo + 40 * miss) / true}
        parts.append(rows[KEYS].assign(peak=peak, leg=leg, ratio=value / true, **numbers))
    return pd.concat(parts)


def report(file: Path, parent: Path | None) -> None:
    """Print the tables."""
    rows = read(file)
    own = rows[rows["part"].isin([*GRADED])]
    kept = own[own["raised"].isna()]
    print(
        f"{own['set'].nunique()} sets; not estimated: {own['raised'].notna().sum()} of {len(own)}"
    )
    cover = cells(kept, "coverage", "part", "name")
    lowest = cover.agg(["mean", "min"])
    lowest.loc["min without rough 10"] = cover.drop("rough 10", errors="ignore").min()
    table("Coverage of alpha, %, by pushes", pd.concat([cover, lowest]))
    for title, column, digits in (
        ("Rms error, % of the largest alpha", "rms", 1),
        ("Half width, % of the largest alpha", "half", 1),
        ("Interval score, % of the largest alpha", "score", 1),
        ("Draws left out, %", "not_passive", 0),
        ("Value against the mean of its own draws, largest, s.d.", "off_mean", 2),
        ("Seconds", "seconds", 3),
    ):
        table(f"{title}; median", cells(kept, column, "part", how="median"), digits)
    for way, meaning in (("a", "where the mean is largest"), ("b", "the draws' own peaks")):
        forces = peaks(kept, way)
        table(f"Legs, {meaning}: coverage, %", cells(forces, "inside", "peak", "leg"))
        ratio = cells(forces, "ratio", "peak", "leg", how="median")
        table(f"Legs, {meaning}: value over truth, median", ratio, 2)
    judged = rows[rows["belongs"].notna() & (rows["part"] != "planned")]
    split = judged["part"].where(judged["part"] != "foreign", judged["name"])
    told = judged.assign(told=100.0 * (judged["belongs"] < NOT_ALIKE), part=split)
    table("Told not to belong, %", cells(told, "told", "part"))
    six = rows[rows["part"] == "planned"].groupby("name", sort=False)[["rms", "nine"]].mean()
    table("Six planned pushes and nine terms fitted to all, rms error, %", six, 1)
    if parent:
        against(kept, read(parent))


def against(rows: pd.DataFrame, parent: pd.DataFrame) -> None:
    """Print ratios to another version, of what both could estimate; not of the prior, which is not the same."""
    rows = rows[rows["part"] != "prior"].merge(parent.loc[parent["raised"].isna(), KEYS])
    parent = rows[KEYS].merge(parent)
    each = rows[KEYS].assign(**{c: np.log(rows[c] / parent[c]) for c in ("rms", "score")})
    of_means = cells(rows, "score", *KEYS[:2]) / cells(parent, "score", *KEYS[:2])
    for title, logs in (
        ("Interval score, mean over sets", of_means.map(np.log)),
        ("Interval score, geometric mean over sets", cells(each, "score", *KEYS[:2])),
        ("Rms error, geometric mean over sets", cells(each, "rms", *KEYS[:2])),
    ):
        found = logs.assign(all=logs.mean(axis=1))
        parts = found.groupby("part", sort=False).mean()
        parts.loc["published"] = parts.loc[[*PUBLISHED]].mean()
        parts.loc["every row"], parts.loc["worst row"] = found.mean(), found.max()
        table(f"{title}, over the parent's", pd.concat([found, parts]).map(np.exp), 2)
    ours, theirs = (
        cells(peaks(*one), "score", "peak", "leg") for one in ((rows, "b"), (parent, "a"))
    )
    table("Score of the legs: the draws' own peaks over the parent's at one pose", ours / theirs, 2)


def main() -> int:
    """Make rows, or print their tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rows", type=Path, metavar="FILE")
    parser.add_argument("--sets", type=int, default=20)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--part", action="append", choices=[*PARTS], help="default: all")
    parser.add_argument(
        "--every", action="store_true", help="leave no draw out that gives energy back"
    )
    parser.add_argument("--report", type=Path, nargs="+", metavar="FILE")
    options = parser.parse_args()
    if options.rows:
        grade(
            options.rows,
            options.part or [*PARTS],
            options.sets,
            options.workers,
            every=options.every,
        )
    if options.report:
        report(*[*options.report, None][:2])
    return 0


if __name__ == "__main__":
    sys.exit(main())
