"""The paper's 7 x 13 directions: as a planned grid, as a list of cells, and tables laid out on them."""

import numpy as np

from rftfit import reference
from rftfit.campaign.config import Grid
from rftfit.measure.alpha import rows_at

PAPER = Grid(beta_deg=tuple(reference.BETA_DEG), gamma_deg=tuple(reference.GAMMA_DEG))
BETA, GAMMA = (
    angle.ravel()
    for angle in np.meshgrid(
        np.radians(reference.BETA_DEG), np.radians(reference.GAMMA_DEG), indexing="ij"
    )
)
"""Every cell, by beta, then gamma, rad, shape (91,)."""

GAMMA_OF_FILE = np.radians(np.round(np.degrees(GAMMA), 4))
"""Gamma with the six digits of a table in a file."""


def grid(table, name):
    """One column of an alpha table over the directions, shape (7, 13); NaN where it has no row."""
    place = rows_at(table, np.degrees(BETA), np.degrees(GAMMA))
    values = table[name].to_numpy(float)[place]
    return np.where(place < 0, np.nan, values).reshape(7, 13)


def flat(alpha):
    """alpha_z and alpha_x of shape (..., 7, 13) as cells, shape (..., 91)."""
    z, x = (np.asarray(component).reshape(*np.shape(component)[:-2], 91) for component in alpha)
    return z, x


def by_hand(beta, gamma, alpha_z, alpha_x):
    """Unweighted least squares of the nine terms, written out: one row a direction that was measured."""
    coefficients = []
    for alpha, terms in ((alpha_z, _lift), (alpha_x, _drag)):
        rows: dict[tuple[float, float], tuple[list[float], list[float]]] = {}
        for b, g, value in zip(beta, gamma, alpha, strict=True):
            place = round(np.degrees(b), 6) % 180, round(np.degrees(g), 6) % 360
            if np.isfinite(value):
                rows.setdefault((round(place[0], 6), round(place[1], 6)), (terms(b, g), []))[
                    1
                ].append(value)
        design, values = zip(*rows.values(), strict=True)
        means = [np.mean(cells) for cells in values]
        coefficients.append(np.linalg.lstsq(np.array(design), np.array(means), rcond=None)[0])
    return np.concatenate(coefficients)


def _lift(b, g):
    return [1, np.cos(2 * b), np.sin(2 * b + g), np.sin(g), np.sin(-2 * b + g)]


def _drag(b, g):
    return [np.cos(2 * b + g), np.cos(g), np.cos(-2 * b + g), np.sin(2 * b)]
