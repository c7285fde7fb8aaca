"""Which chi: both methods of the nine-term fit on media that they did not see.

Every published medium in turn is scaled from its vertical push with the other four, and compared with its own Table S5.
"""

from __future__ import annotations

import numpy as np

from rftfit.model.fourier import METHODS, evaluate
from rftfit.model.scaling import Reference, published, scale_by_paper
from rftfit.reference import BETA_DEG, GAMMA_DEG, MEDIA, alpha_grid


def left_out(method: str) -> None:
    """Print how the scaled profile fits the table of a medium that it was not made from."""
    full_reference = published(method)
    grid = np.meshgrid(np.radians(BETA_DEG), np.radians(GAMMA_DEG), indexing="ij")
    misfits = []
    for i, medium in enumerate(MEDIA):
        included = [j for j in range(len(MEDIA)) if j != i]
        scaled = full_reference.scaled[included]
        four = Reference(
            "",
            tuple(MEDIA[j] for j in included),
            full_reference.chi[included],
            scaled.mean(0),
            scaled,
        )
        measured = np.stack(alpha_grid(medium)).ravel()
        alpha = alpha_grid(medium)[0][3, -1]
        predicted = np.stack(evaluate(scale_by_paper(alpha, 0.0, four).coefficients, *grid)).ravel()
        rms = float(np.sqrt(np.mean((predicted - measured) ** 2))) / alpha
        best = float(predicted @ measured / (predicted @ predicted))
        misfits.append((rms, best))
        print(f"| {method} | {medium} | {100 * rms:.1f} % | {best:.2f} |")
    rms, best = np.mean(misfits, axis=0)
    print(f"| {method} | mean | {100 * rms:.1f} % | {best:.2f} |")


if __name__ == "__main__":
    print(
        "| method | medium left out | rms error over alpha_z(0, 90 deg) | factor that fits best |"
    )
    print("|---|---|---|---|")
    for method_name in METHODS:
        left_out(method_name)
