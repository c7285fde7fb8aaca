"""What one weight for each measured direction changes in the nine terms.

``python studies/weights.py results`` prints it for the media of a folder of results. Before, the fit went over
all directions that the symmetry completes: those straight up and down, whose mirror images are measured
or are themselves, had half the weight of the others.
"""

from __future__ import annotations

import sys

import numpy as np

import rftfit
from rftfit.measure.alpha import alpha_columns, cell_at, column, directions
from rftfit.model.fourier import TERMS, fit_lsq, kept_terms
from rftfit.model.scaling import PAPER_RULE, vertical_penetration
from rftfit.model.symmetry import torus


def main(folder: str) -> None:
    """Print coefficients, zeta and chi of every medium, before and after."""
    print(f"| medium | weights | {' | '.join(TERMS)} | zeta | chi |")
    print("|---|---" + "|---" * (len(TERMS) + 2) + "|")
    results = rftfit.open(folder)
    for name in results.laboratory:
        table = results[name].alpha
        directions_of_grid = torus(*directions(table))
        completed = (
            directions_of_grid.beta,
            directions_of_grid.gamma,
            *directions_of_grid.complete(*alpha_columns(table)),
        )
        down = cell_at(table, 0, 90)
        for weights, cells in (
            ("before", completed),
            ("one each", (*directions(table), *alpha_columns(table))),
        ):
            fit = fit_lsq(*cells, kept_terms(fit_lsq(*cells), PAPER_RULE))
            zeta = float(vertical_penetration(fit))
            chi = np.nan if down is None else down[column("z")] / zeta
            terms = " | ".join(f"{value:.4f}" for value in fit)
            print(f"| {name} | {weights} | {terms} | {zeta:.4f} | {chi:.4f} |")


if __name__ == "__main__":
    main(sys.argv[1])
