"""How far the map can be believed: coverage, scores and errors in directions that were not pushed.

    python studies/grade_map.py [--count 20] [--rows FOLDER]    sets of pushes; four minutes on one core

Media, size free: the published ones without themselves or without their material among the known shapes, slices of
3D-RFT at three frictions, published ones plus a smooth random field of 5 and 10 % of the largest alpha that
takes energy everywhere. Each set has its own pushes in random directions, nested, with errors of 5 % of their alpha and
1 % of the largest, stated as such. Foreign media are not granular; planned pushes are six of `rftfit plan`.
"""

from __future__ import annotations

import sys
import zlib
from functools import cache, partial
from itertools import product
from typing import TYPE_CHECKING

import frame
import numpy as np
import pandas as pd
from exact_laws import MATERIALS
from force_scores import score_alpha
from frame import Part, Row, Tables, Unit

import rftfit
from rftfit import Map, Shapes
from rftfit.conventions import FloatArray, mirror
from rftfit.errors import InputError
from rftfit.forces.planning import prior_map
from rftfit.model.fourier import evaluate, fit_lsq
from rftfit.model.maps import NOT_ALIKE, estimate
from rftfit.model.profiles import TableProfile
from rftfit.model.pushes import Pushes, usual_error
from rftfit.model.rft3d import alpha_3drft
from rftfit.model.shapes import grid, published_shapes
from rftfit.reference import MEDIA

if TYPE_CHECKING:
    from collections.abc import Callable

NODES = grid()
BETA_DEG, GAMMA_DEG = np.degrees(NODES)
COUNTS = (1, 2, 4, 6, 8, 12, 20, 30)
FRICTIONS = ("0.2", "0.4", "0.8")
FOREIGN = ("isotropic", "depth only", "alpha_x doubled")
GRADED = {
    "medium out": MEDIA,
    "material out": MEDIA,
    "3D-RFT": FRICTIONS,
    "rough 5": MEDIA,
    "rough 10": MEDIA,
}
ROUGH_LENGTH = 0.7
"""Of the random field, in chords of the circles of 2 beta and gamma."""


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


def medium(group: str, name: str, random: np.random.Generator) -> tuple[FloatArray, Shapes]:
    """Alpha of a medium at the nodes, shape (2, n), and what is known before it is pushed."""
    if name in FRICTIONS:
        z, x = 0.4 * np.stack(alpha_3drft(*NODES, float(name)))
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


def truth(medium: str) -> FloatArray:
    """Table S5 of a medium at the nodes, shape (2, n)."""
    return np.stack(TableProfile.published(medium).alpha(*NODES))


def planned(shapes: Shapes, count: int) -> list[int]:
    """Nodes of a plan for the whole map that starts from nothing."""
    directions = list(zip(BETA_DEG.round(3), GAMMA_DEG.round(3), strict=True))
    steps = rftfit.plan("map", prior_map(shapes), count=count).steps[1:]
    return [directions.index((round(b, 3), round(g, 3))) for s in steps for b, g in s.directions]


def scores_elsewhere(medium_map: Map, alpha: FloatArray, places: list[int]) -> Row:
    """Scores of alpha where it was not pushed and has freedom."""
    direction = _SAME + 1000 * GAMMA_DEG
    free = _FREE & ~np.isin(direction, direction[places])
    lines = slice(_SAME.size)
    drawn = medium_map.draws[..., lines][:, free]
    return score_alpha(drawn, alpha[free], medium_map.alpha[:, lines][free], np.abs(alpha).max())


def grade_set(group: str, name: str, number: int) -> list[Row]:
    """Rows of one set of pushes."""
    seed = zlib.crc32(f"{group} {name}".encode())
    alpha, shapes = medium(group, name, np.random.default_rng([seed, number, 0]))
    random = np.random.default_rng([seed, number, 1])
    order = [int(node) for node in random.permutation(_SAME.size)]
    error = usual_error(alpha)
    seen = alpha + error * random.standard_normal(alpha.shape)
    if group == "planned":
        order = planned(shapes, 6)
    rows: list[Row] = []
    for count in (6,) if group == "planned" else COUNTS:
        row: Row = {"group": group, "name": name, "count": count, "refused": ""}
        places = order[:count]
        angles = BETA_DEG[places], GAMMA_DEG[places]
        try:
            medium_map = estimate(Pushes.of(*angles, seen[:, places], error[:, places]), shapes)
            row["belongs"] = medium_map.belongs
            if group == "planned":
                nine = np.stack(evaluate(fit_lsq(*NODES, *seen), *NODES))
                for column, alphas in (("rms", medium_map.alpha[:, : _SAME.size]), ("nine", nine)):
                    off = np.sqrt(np.mean((alphas - alpha) ** 2))
                    row[column] = 100 * off / np.abs(alpha).max()
            elif group != "foreign":
                row["not_passive"] = 100 * medium_map.not_passive
                row |= scores_elsewhere(medium_map, alpha, places)
        except (ValueError, InputError) as problem:
            row["refused"] = type(problem).__name__
        rows.append(row)
    return rows


def report_lines(rows: pd.DataFrame) -> Tables:
    """Tables by group of media and number of pushes."""
    cover = rows.pivot_table("inside", ["group", "name"], "count", sort=False)
    cover = pd.concat([cover, cover.agg(["mean", "min"])])
    cover.insert(0, "medium", [" ".join(map(str, np.atleast_1d(key))) for key in cover.index])
    tables = [("Coverage of alpha, %", cover)]
    for title, column in (
        ("Rms error, % of the largest alpha; median", "rms"),
        ("Half width, % of the largest alpha; median", "half"),
        ("Interval score, % of the largest alpha; median", "score"),
        ("Draws left out, %; median", "not_passive"),
    ):
        table = rows.pivot_table(column, "group", "count", aggfunc="median", sort=False)
        tables.append((title, table.reset_index()))
    return [*tables, *report_shape("group", rows)]


def report_shape(column: str, rows: pd.DataFrame) -> Tables:
    """Sets that are told not to be of the known shape, and sets that are not estimated."""
    told = rows.assign(told=100.0 * (rows["belongs"] < NOT_ALIKE))
    table = told.pivot_table("told", column, "count", sort=False).reset_index()
    refused = pd.DataFrame([{"refused": int(rows["refused"].notna().sum()), "of": len(rows)}])
    return [("Told not to be of the known shape, %", table), ("Not estimated", refused)]


def report_planned(rows: pd.DataFrame) -> Tables:
    """Error of six planned pushes beside that of nine terms fitted to all directions."""
    six = rows.groupby("name", sort=False)[["rms", "nine"]].mean().reset_index()
    return [("Six planned pushes, and nine terms of all, rms error, %", six)]


def list_sets(groups: dict[str, tuple[str, ...]], count: int, _seed: int) -> list[Unit]:
    """Sets of each medium."""
    media = [(group, name) for group, names in groups.items() for name in names]
    return [(group, name, number) for number, (group, name) in product(range(count), media)]


PARTS = {
    "lines": Part(partial(list_sets, GRADED), grade_set, report_lines, 20),
    "foreign": Part(
        partial(list_sets, {"foreign": FOREIGN}), grade_set, partial(report_shape, "name"), 20
    ),
    "planned": Part(
        partial(list_sets, {"planned": (*FRICTIONS, *MEDIA)}), grade_set, report_planned, 3
    ),
}

if __name__ == "__main__":
    sys.exit(frame.run_study(__doc__, PARTS))
