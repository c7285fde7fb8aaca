"""Pictures of the live page, as svg that takes its colours from the page."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.alpha import column
from rftfit.measure.ledger import RowStatus

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.bench.medium import Measured
    from rftfit.conventions import FloatArray
    from rftfit.model.planning import Plan

_MOST_DOTS = 250
_WIDE, _HIGH, _LEFT, _LOW = 420, 240, 46, 34


def stress(one: Measured, area_cm2: float, others: pd.DataFrame, sign_x: float) -> str:
    """Stress of a run over its depth (horizontal: over its path), its fits, and those of its repeats, dashed."""
    fit, tared = one.rows["fits"], one.tared
    level = fit["direction"] == "horizontal"
    along = tared["path_cm" if level else "depth_cm"]
    if not along.size:
        return ""
    signs = {"z": 1.0, "x": sign_x}
    curves = {c: signs[c] * tared[f"force_{c}_N"] / area_cm2 for c in "zx"}
    window = along[tared["window"] == RowStatus.GOOD]
    known = np.concatenate([part[np.isfinite(part)] for part in curves.values()])
    low, high = min(0.0, float(known.min(initial=0))), max(1e-9, float(known.max(initial=0)))
    first, last = float(along.min()), float(along.max())

    def at(x: FloatArray, y: FloatArray) -> str:
        right = _LEFT + (x - first) / ((last - first) or 1) * (_WIDE - _LEFT - 8)
        down = _HIGH - _LOW - (y - low) / (high - low) * (_HIGH - _LOW - 10)
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(right, down, strict=True))

    parts = []
    step = 1 + along.size // _MOST_DOTS
    for c, values in curves.items():
        use = np.isfinite(values)
        dots = at(along[use][::step], values[use][::step]).split()
        parts.append(f'<path class="dots {c}" d="{"".join(f"M{dot}h0" for dot in dots)}"/>')
        slopes = [("", fit[column(c)]), *((" other", slope) for slope in others[column(c)])]
        ends = np.array([window.min(), window.max()]) if window.size else np.zeros(0)
        depth = np.full(ends.size, float(np.mean(tared["depth_cm"]))) if level else ends
        parts += [
            f'<polyline class="law {c}{kind}" points="{at(ends, slope * depth)}"/>'
            for kind, slope in slopes if np.isfinite(slope)
        ]  # fmt: skip
    bottom = _HIGH - _LOW
    words = "path, cm" if level else "depth, cm"
    parts += [
        f'<path class="axis" d="M{_LEFT},4V{bottom}H{_WIDE - 4}"/>',
        *(f'<text x="{_LEFT - 4}" y="{at(np.array([first]), np.array([y])).split(",")[1]}" text-anchor="end">{y:.2g}</text>'
          for y in (low, high)),
        f'<text x="{_LEFT}" y="{bottom + 14}">{first:.1f}</text>',
        f'<text x="{_WIDE - 6}" y="{bottom + 14}" text-anchor="end">{last:.1f}</text>',
        f'<text x="{_WIDE / 2}" y="{bottom + 28}" text-anchor="middle">{words}</text>',
        '<text x="4" y="120" transform="rotate(-90 12,120)" text-anchor="middle">stress, N/cm²</text>',
    ]  # fmt: skip
    label = f"Stress of the last push over {words}, vertical and horizontal"
    return (
        f'<svg viewBox="0 0 {_WIDE} {_HIGH}" role="img" aria-label="{label}">{"".join(parts)}</svg>'
    )


def heat(table: pd.DataFrame, component: str, plan: Plan | None, *, error: bool) -> str:
    """One component of a map over gamma and beta, or half its interval: the fuller, the larger.

    Directions that were pushed have a frame; the next pushes have their number.
    """
    betas, gammas = (np.sort(table[f"{one}_deg"].unique()) for one in ("beta", "gamma"))
    value = table[column(component)].to_numpy(float)
    largest = float(table[[column(c) for c in "zx"]].abs().to_numpy().max()) or 1.0
    half = (table[column(component, "_hi")] - table[column(component, "_lo")]).to_numpy(float) / 2
    size = 16
    cells = []
    for row, off, alpha in zip(table.to_dict("records"), half, value, strict=True):
        x = 34 + size * int(np.searchsorted(gammas, row["gamma_deg"]))
        y = 4 + size * int(betas.size - 1 - np.searchsorted(betas, row["beta_deg"]))
        share = min(1.0, 4 * off / largest if error else abs(alpha) / largest)
        colour = "loose" if error else "up" if alpha >= 0 else "down"
        frame = " pushed" if row["source"] == "measured" else ""
        told = f"({row['beta_deg']:.4g}, {row['gamma_deg']:.4g}): {alpha:.3g} ± {off:.2g}"
        box = f'x="{x}" y="{y}" width="{size - 2}" height="{size - 2}"'
        cells.append(
            f'<rect class="{colour}" fill-opacity="{share:.2f}" {box}><title>{told}</title></rect>'
        )
        cells += [f'<rect class="{frame.strip()}" {box}/>'] if frame else []
    for number, step in enumerate(plan.steps[1:] if plan else (), start=1):
        x = 34 + size * int(np.argmin(np.abs(gammas - step.directions[0][1])))
        y = 4 + size * int(betas.size - 1 - np.argmin(np.abs(betas - step.directions[0][0])))
        cells.append(f'<text x="{x + 4}" y="{y + 11}">{number}</text>')
    wide, high = 40 + size * gammas.size, 20 + size * betas.size
    cells += [
        f'<text x="30" y="{16 + size * place}" text-anchor="end">{betas[betas.size - 1 - place]:.3g}</text>'
        for place in (0, betas.size - 1)
    ]
    cells += [
        f'<text x="34" y="{high}">{gammas[0]:.3g}</text>',
        f'<text x="{wide - 6}" y="{high}" text-anchor="end">{gammas[-1]:.3g}</text>',
        f'<text x="{wide / 2}" y="{high}" text-anchor="middle">gamma, deg</text>',
    ]
    what = f"{'half interval of ' if error else ''}alpha_{component}"
    label = f"Map of {what} over beta (upward) and gamma"
    return (
        f'<figure><figcaption>{what}</figcaption><svg viewBox="0 0 {wide} {high + 4}" role="img" '
        f'aria-label="{label}">{"".join(cells)}</svg></figure>'
    )
