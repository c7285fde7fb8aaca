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
from rftfit.forces.plane import force_draws
from rftfit.model import shapes as shapes_module
from rftfit.model.draws import interval
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
        for way in ("true", *(letter + end for letter in "ab" for end in ENDS))
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
    two_beta, gamma = (angle.ravel() for angle in np.meshgrid(lines, lines))
    middles = on_circles(two_beta / 2, gamma)[:, None]
    at_nodes, image = (
        np.exp(-((middles - on_circles(*angles)) ** 2).sum(axis=-1) / ROUGH_LENGTH**2)
        for angles in (NODES, mirror(*NODES))
    )
    return np.stack([at_nodes + image, at_nodes - image])


def roughened(alpha: FloatArray, share: float, random: np.random.Generator) -> FloatArray:
    """Many times alpha plus a smooth random field whose root mean square is a share of the largest alpha."""
    field = (random.standard_normal((2, 1000, bumps().shape[1])) @ bumps()).swapaxes(0, 1)
    size = np.sqrt((field**2).mean(axis=(1, 2), keepdims=True))
    return np.asarray(alpha + share * np.abs(alpha).max() / size * field)


def from_prior(shapes: Shapes, random: np.random.Generator) -> FloatArray:
    """Many further media, as the shapes expect them."""
    prior, variation = shapes.prior(*NODES), shapes.variation
    rough_share = random.uniform(0, variation.most_own, (100, 1))
    departure = (variation.departure_dof / 2 + 1) / random.gamma(
        variation.departure_dof / 2, size=(100, 1)
    )
    parts = (
        (1.0, prior.between),
        (np.sqrt(1 - rough_share), root(prior.smooth)),
        (np.sqrt(rough_share), root(prior.rough)),
    )
    drawn = sum(
        factor * (random.standard_normal((100, len(rows))) @ rows) for factor, rows in parts
    )
    return np.asarray(0.2 * (prior.mean + np.sqrt(departure) * drawn).reshape(100, 2, -1))


def medium(group: str, name: str, random: np.random.Generator) -> tuple[FloatArray, Shapes]:
    """Alpha of a medium at the nodes, shape (2, n), and what is known before it is pushed."""
    if group == "prior":
        shapes = published_shapes()
        return first_that_takes_energy(lambda: from_prior(shapes, random)), shapes
    if name in FRICTIONS:
        law = partial(slice_3drft, float(name), 0.4, "")
        z, x = np.array(
            [law(*angles_deg) for angles_deg in zip(BETA_DEG, GAMMA_DEG, strict=True)]
        ).T
        # its symmetry, which the law breaks where a sheet moves along itself
        return np.stack(TableProfile(z, x, *NODES).alpha(*NODES)), published_shapes()
    if group == "foreign":
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
    if group.startswith("rough"):
        share = float(group.split()[1]) / 100
        alpha = first_that_takes_energy(lambda: roughened(truth(name), share, random))
    return alpha, published_shapes(without=(name,) if group == "medium out" else MATERIALS[name])


@cache
def weights(leg: str) -> FloatArray:
    """Force on a leg over its poses for an alpha of 1 at each node, z and x: shape (2, n, poses)."""
    unit = np.eye(_SAME.size)
    poses = rftfit.rotation().poses
    forces = force_draws(TableProfile(unit, unit, *NODES), rftfit.model_leg(leg), poses)
    return np.stack([forces.force_z_N, forces.force_x_N])


def peaks_of(medium_map: Map, leg: str) -> dict[str, float]:
    """Largest lift and thrust: a, where the mean is largest, as `find_peaks`; b, of the draws' own peaks."""
    numbers: dict[str, float] = {}
    for peak, component in PEAKS.items():
        at_poses = weights(leg)[component]
        curve = medium_map.alpha[component, : _SAME.size] @ at_poses
        many = medium_map.draws[:, component, : _SAME.size] @ at_poses
        pose, tops = int(curve.argmax()), many.max(axis=1)
        ways = {"a": (curve[pose], many[:, pose]), "b": (tops.mean(), tops)}
        for way, (value, draws) in ways.items():
            names = [f"{peak}_{leg}_{way}{end}" for end in ENDS]
            numbers |= zip(names, map(float, (value, *interval(draws, 0.95))), strict=True)
    return numbers


def graded(medium_map: Map, alpha: FloatArray, places: list[int]) -> dict[str, float]:
    """Alpha where it was not pushed and has freedom, and the peaks of the legs."""
    free = _FREE & ~np.isin(_SAME + 1000 * GAMMA_DEG, (_SAME + 1000 * GAMMA_DEG)[places])
    largest = np.abs(alpha).max() / 100
    mean, draws = (
        medium_map.alpha[:, : _SAME.size][free],
        medium_map.draws[..., : _SAME.size][:, free],
    )
    true_alpha = alpha[free]
    lo, hi = interval(draws, 0.95)
    miss = np.maximum(lo - true_alpha, 0) + np.maximum(true_alpha - hi, 0)
    numbers = {
        "coverage": 100 * np.mean(miss == 0),
        "score": np.mean(hi - lo + 40 * miss) / largest,
        "rms": np.sqrt(np.mean((mean - true_alpha) ** 2)) / largest,
        "half": np.sqrt(np.mean((hi - lo) ** 2)) / 2 / largest,
        "off_mean": np.max(np.abs(mean - draws.mean(axis=0)) / draws.std(axis=0)),
    }
    for leg in LEGS:
        numbers |= peaks_of(medium_map, leg)
        for peak, component in PEAKS.items():
            numbers[f"{peak}_{leg}_true"] = (alpha[component] @ weights(leg)[component]).max()
    return numbers


def rows_of(every: bool, group: str, name: str, number: int) -> list[dict[str, object]]:
    """Rows of one set of pushes; `every`: no draw is left out."""
    shapes_module.LEAST_WORK = np.inf if every else _LEAST_WORK
    seed = zlib.crc32(f"{group} {name}".encode())
    alpha, shapes = medium(group, name, np.random.default_rng([seed, number, 0]))
    random = np.random.default_rng([seed, number, 1])
    order = [int(node) for node in random.permutation(_SAME.size)]
    error = usual_error(alpha)
    seen = alpha + error * random.standard_normal(alpha.shape)
    if group == "planned":
        order = planned(shapes, 6)
    rows = []
    for count in (6,) if group == "planned" else COUNTS:
        row: dict[str, object] = dict(zip(KEYS, (group, name, number, count), strict=True))
        places, start = order[:count], time.perf_counter()
        try:
            angles = BETA_DEG[places], GAMMA_DEG[places]
            medium_map = estimate(Pushes.of(*angles, seen[:, places], error[:, places]), shapes)
            row["belongs"] = medium_map.belongs
            if group == "planned":
                fitted = np.stack(evaluate(fit_lsq(*NODES, *seen), *NODES))
                for column, estimated in (
                    ("rms", medium_map.alpha[:, : _SAME.size]),
                    ("nine", fitted),
                ):
                    row[column] = (
                        100 * np.sqrt(np.mean((estimated - alpha) ** 2)) / np.abs(alpha).max()
                    )
            elif group != "foreign":
                row["not_passive"] = 100 * medium_map.not_passive  # makes the draws
                row["seconds"] = time.perf_counter() - start
                row |= graded(medium_map, alpha, places)
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
    requested_sets = [(p, n, s) for s, p in product(range(sets), parts) for n in PARTS[p]]
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        missing_sets = [requested for requested in requested_sets if requested not in done]
        for rows in (
            pool.map(partial(rows_of, every), *zip(*missing_sets, strict=True))
            if missing_sets
            else ()
        ):
            new_rows = pd.DataFrame(rows, columns=COLUMNS)
            new_rows.to_csv(file, mode="a", header=False, index=False, float_format="%.6g")


def read(file: Path) -> pd.DataFrame:
    """Rows of a file; names are text, as 3D-RFT's 0.2."""
    return pd.read_csv(file, dtype={"name": str, "raised": str})


def cells(
    rows: pd.DataFrame, column: str, *keys: str, statistic: Literal["mean", "median"] = "mean"
) -> pd.DataFrame:
    """Mean or median of a column by the columns `keys`, and by the number of pushes."""
    return rows.pivot_table(column, [*keys], "count", aggfunc=statistic, sort=False)


def table(title: str, frame: pd.DataFrame, digits: int = 0) -> None:
    """Print a table as markdown."""
    print(f"\n{title}\n\n| | {' | '.join(map(str, frame.columns))} |")
    print("|" + "---|" * (frame.shape[1] + 1))
    for name, values in frame.iterrows():
        label = " ".join(map(str, name)) if isinstance(name, tuple) else name
        print(f"| {label} | {' | '.join(f'{value:.{digits}f}' for value in values)} |")


def peaks(rows: pd.DataFrame, way: str) -> pd.DataFrame:
    """One row a leg and peak: whether its interval holds the truth, its score, its value over the truth."""
    parts = []
    for peak, leg in product(PEAKS, LEGS):
        ends = (rows[f"{peak}_{leg}_{suffix}"] for suffix in ("true", *(way + end for end in ENDS)))
        true, value, lo, hi = ends
        miss = (lo - true).clip(lower=0) + (true - hi).clip(lower=0)
        numbers = {"inside": 100.0 * (miss == 0), "score": (hi - lo + 40 * miss) / true}
        parts.append(rows[KEYS].assign(peak=peak, leg=leg, ratio=value / true, **numbers))
    return pd.concat(parts)


def report(file: Path, parent: Path | None) -> None:
    """Print the tables."""
    rows = read(file)
    graded_rows = rows[rows["part"].isin([*GRADED])]
    estimated_rows = graded_rows[graded_rows["raised"].isna()]
    print(
        f"{graded_rows['set'].nunique()} sets; not estimated: {graded_rows['raised'].notna().sum()} of {len(graded_rows)}"
    )
    cover = cells(estimated_rows, "coverage", "part", "name")
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
        table(f"{title}; median", cells(estimated_rows, column, "part", statistic="median"), digits)
    for way, meaning in (("a", "where the mean is largest"), ("b", "the draws' own peaks")):
        forces = peaks(estimated_rows, way)
        table(f"Legs, {meaning}: coverage, %", cells(forces, "inside", "peak", "leg"))
        ratio = cells(forces, "ratio", "peak", "leg", statistic="median")
        table(f"Legs, {meaning}: value over truth, median", ratio, 2)
    judged = rows[rows["belongs"].notna() & (rows["part"] != "planned")]
    split = judged["part"].where(judged["part"] != "foreign", judged["name"])
    told_rows = judged.assign(told=100.0 * (judged["belongs"] < NOT_ALIKE), part=split)
    table("Told not to belong, %", cells(told_rows, "told", "part"))
    six = rows[rows["part"] == "planned"].groupby("name", sort=False)[["rms", "nine"]].mean()
    table("Six planned pushes and nine terms fitted to all, rms error, %", six, 1)
    if parent:
        against(estimated_rows, read(parent))


def against(rows: pd.DataFrame, parent: pd.DataFrame) -> None:
    """Print ratios to another version, of what both could estimate; not of the prior, which is not the same."""
    rows = rows[rows["part"] != "prior"].merge(parent.loc[parent["raised"].isna(), KEYS])
    parent = rows[KEYS].merge(parent)
    log_ratios = rows[KEYS].assign(**{c: np.log(rows[c] / parent[c]) for c in ("rms", "score")})
    of_means = cells(rows, "score", *KEYS[:2]) / cells(parent, "score", *KEYS[:2])
    for title, logs in (
        ("Interval score, mean over sets", of_means.map(np.log)),
        ("Interval score, geometric mean over sets", cells(log_ratios, "score", *KEYS[:2])),
        ("Rms error, geometric mean over sets", cells(log_ratios, "rms", *KEYS[:2])),
    ):
        with_mean = logs.assign(all=logs.mean(axis=1))
        parts = with_mean.groupby("part", sort=False).mean()
        parts.loc["published"] = parts.loc[[*PUBLISHED]].mean()
        parts.loc["every row"], parts.loc["worst row"] = with_mean.mean(), with_mean.max()
        table(f"{title}, over the parent's", pd.concat([with_mean, parts]).map(np.exp), 2)
    current_scores, parent_scores = (
        cells(peaks(*rows_and_way), "score", "peak", "leg")
        for rows_and_way in ((rows, "b"), (parent, "a"))
    )
    table(
        "Score of the legs: the draws' own peaks over the parent's at one pose",
        current_scores / parent_scores,
        2,
    )


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
