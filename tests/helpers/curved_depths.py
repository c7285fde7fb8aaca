"""Force at stated depths where stress goes as a power of depth: how often intervals hold it, and how wide they are."""

import numpy as np
import pandas as pd
from coverage_levels import LEVEL, alpha_cells
from disturbances import power_law
from ensembles import EXACT, simulate

from rftfit.campaign.config import Fit
from rftfit.measure.slopes import GIVEN_DOF, student_quantile

DEPTHS_CM = Fit().depths_cm


def forces_held(medium, campaigns, seed, sizes, errors=EXACT, *, line=False):
    """Coverage and width of the force at each depth, over campaigns and the cells whose windows hold the depth.

    `sizes`: Of the disturbances, ``power`` among them. `line`: Take alpha of the line through zero instead.
    Column ``width``: median over cells of the mean half width over that which the standard deviation of the errors needs.
    """
    rows = {}
    for depth in DEPTHS_CM:
        power = simulate(medium, campaigns, seed, sizes, at_cm=depth, repeats=1)
        tables = power.tables(seed, errors=errors)
        lo, truth, hi = (np.stack(arrays) for arrays in zip(*map(alpha_cells, tables), strict=True))
        is_finite = np.isfinite(lo).all(axis=0)
        if line:
            straight = simulate(medium, campaigns, seed, sizes, repeats=1).tables(
                seed, errors=errors
            )
            lo, _, hi = (
                np.stack(arrays) for arrays in zip(*map(alpha_cells, straight), strict=True)
            )
        lo, hi = lo[:, is_finite], hi[:, is_finite]
        truth = truth[:, is_finite] * power_law(np.array(depth), sizes["power"]) / depth
        inside, half = (lo <= truth) & (truth <= hi), (hi - lo) / 2
        scatter = ((lo + hi) / 2).std(axis=0)
        needed = float(student_quantile(LEVEL, GIVEN_DOF)) * scatter
        rows[depth] = {
            "cells": int(is_finite.sum()),
            "inside": inside.mean(),
            "worst": np.sort(inside.mean(axis=0))[inside.shape[1] // 20],
            "width": np.median(half.mean(axis=0)[needed > 0] / needed[needed > 0]),
        }
    return pd.DataFrame(rows).T
