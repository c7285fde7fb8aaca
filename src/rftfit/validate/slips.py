"""The paper's own slips: listed, not copied (each checked against its tables and equations)."""

from __future__ import annotations

import math

from rftfit.validate.comparison import INCONSISTENT, Item

_SLIPS = (
    (
        "unit of the number zeta",
        "supplement, scaling",
        "number of alpha_z fit in N/m^3",
        "in N/cm^3",
        "only N/cm^3 gives the zeta of Table S2",
    ),
    (
        "what zeta equals",
        "supplement, scaling",
        "alpha_z,x fit(beta, gamma)",
        "alpha_z fit(0, 90 deg)",
        "one number per medium; only this makes the generic alpha_z(0, 90 deg) equal to 1",
    ),
    (
        "second projected area of an element",
        "supplement, depth-only model",
        "printed as the first one again",
        "dA_xs, the vertical projection",
        "the horizontal force needs the area seen along x",
    ),
    (
        "diameter of the large glass spheres",
        "text",
        "3 m",
        "3 mm",
        "Table S1 gives 3.2 mm",
    ),
    (
        "sign of the vertical velocity",
        "supplement, depth-only model",
        "counts downward as positive",
        "upward as positive, as everywhere else",
        "one frame for all equations: z up, z = 0 at the surface",
    ),
)


def slips() -> list[Item]:
    """Slips of the paper that no measurement can settle.

    Returns
    -------
    list of Item
        All with the verdict that the paper is inconsistent.
    """
    return [
        Item(item, where, paper, ours, math.nan, math.nan, INCONSISTENT, why)
        for item, where, paper, ours, why in _SLIPS
    ]
