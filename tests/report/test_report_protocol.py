"""Figures from recording to slope show a run of each kind with its slope, or say what is missing.

Also tested: the figure of all media at a few angles (linearity).
"""

from collections.abc import Hashable
from typing import Any

import numpy as np
import pandas as pd
import pytest
import result_tables as chain
from pages import words
from result_tables import memory, of_runs

from rftfit.campaign.config import Fit
from rftfit.figures import style
from rftfit.figures.protocol import PanelColumn
from rftfit.figures.registry import figures


def recording(kind):
    time = np.linspace(-4, 10, 800)
    path = np.clip(time, 0, 8)
    force = {"force_z_N": path, "force_x_N": -0.5 * path}
    if kind == "rotation":
        return {"time_s": time, "angle_deg": np.linspace(-135, 135, 800), **force}
    return {"time_s": time, "depth_cm": path, "x_cm": 4 - path, **force}


ENDS = {"": 0.0, "lo_": -0.04, "hi_": 0.04}


def column(kind, tare=True):
    trace, fit = chain.one_run("r", kind, 5.08, 0.35, 0.1, np.random.default_rng(2), 400)
    result = {name: trace[name].to_numpy(float) for name in trace.columns.drop("run_id")}
    if kind == "rotation":
        theta = np.arange(-135.0, 136.0)
        result = {
            "theta_deg": theta,
            "force_z_N": 5 * np.exp(-((theta + 40) ** 2) / 900),
            "force_x_N": -2 * np.exp(-((theta - 9) ** 2) / 900),
        }
        fit = {}
    return PanelColumn(
        kind,
        "held somehow",
        recording(kind),
        recording(kind) if tare else {},
        {"pause": (-2.0, 0.0), "stroke": (0.0, 8.0)},
        result,
        {str(key): cell for key, cell in fit.items()},
        MEAN_OF_3 if kind == "horizontal" else {},
    )


MEAN_OF_3: dict[Hashable, Any] = {
    "n_runs": 3,
    **{f"alpha_{c}_{end}N_per_cm3": 0.3 + half for c in "zx" for end, half in ENDS.items()},
}
"""Row of a table of alpha with several runs in a direction."""


def draw(name, results, *medium):
    return next(figure for figure in figures() if figure.name == name).draw(results, *medium)


def drawn(monkeypatch, *columns):
    monkeypatch.setattr("rftfit.figures.protocol.columns_of", lambda *_: list(columns))
    return draw("protocol", memory({}, fit=Fit(confidence=0.9)), "poppy_LP")


def test_protocol_has_a_column_for_each_kind_with_units(monkeypatch):
    kinds = ["intrusion", "extraction", "horizontal", "rotation"]
    figure = drawn(monkeypatch, *(column(kind) for kind in kinds))
    text = words(figure)
    assert len(figure.axes) == 12
    assert "poppy seeds, loose" in text
    assert {f"{letter}  {kind}" for letter, kind in zip("ABCD", kinds, strict=True)} <= set(text)
    for label in (
        "position (cm)",
        "force on intruder (N)",
        r"stress (N/cm$^2$)",
        "depth (cm)",
        r"$\theta$ (degrees)",
        "force, tare taken off (N)",
        "distance travelled (cm)",
    ):
        assert label in text
    # the line that is drawn is of this run, the interval of the mean
    of_run, of_mean = "= 0.3500 N/cm$^3$", "mean of 3 runs: 0.3000 \u00b1 0.0400 N/cm$^3$"
    assert any(f"{of_run}\n{of_mean}" in line for line in text)
    assert any("peak $F_z$ = 5.00 N at $\\theta$ = \u221240\u00b0" in line for line in text)
    assert any("peak $F_x$ = \u22122.00 N at $\\theta$ = 9\u00b0" in line for line in text)


def test_protocol_draws_slopes_of_depth_and_means_of_horizontal_runs(monkeypatch):
    figure = drawn(monkeypatch, column("intrusion"), column("horizontal"))
    slanted, flat = figure.axes[4:6]  # the last row
    # zero, then for z and x the samples and the fit
    line = slanted.lines[2].get_xydata()
    np.testing.assert_allclose(np.asarray(line)[:, 1], 0.35 * np.asarray(line)[:, 0])
    assert np.asarray(line)[0, 0] == 0
    level = np.asarray(flat.lines[2].get_xydata())
    np.testing.assert_allclose(level[:, 1], 0.35 * 5.08)
    assert level[0, 0] == pytest.approx(2.0, abs=0.1)
    # height is minus depth, and x falls with it
    height, across = (np.asarray(line.get_ydata()) for line in figure.axes[0].lines[1:3])
    assert height.min() == -8.0
    assert across.min() == -4.0


def test_protocol_says_what_is_missing(monkeypatch):
    assert "no tare" in words(drawn(monkeypatch, column("intrusion", tare=False)))
    assert any("no run of which" in line for line in words(drawn(monkeypatch)))
    for module in ("ingest", "session_clocks"):
        monkeypatch.setattr(f"rftfit.measure.{module}.read_logs", lambda *_: iter(()))
    (told,) = words(draw("clocks", memory({}), "poppy_LP"))
    assert told == "poppy seeds, loose: no run whose clocks were estimated"


CELLS = ((0.0, 90.0), (30.0, 45.0), (90.0, 0.0), (-30.0, -45.0), (0.0, -90.0))
"""Directions of the paper's figure, beta and gamma in degrees; gamma 0 is a horizontal run."""


def small(poppy=0.35):
    """Two media at the angles shown; glass has lost its horizontal runs."""
    rng = np.random.default_rng(4)
    traces, fits, cells = [], [], []
    for medium, slope in (("poppy_LP", poppy), ("glass3mm_CP", -0.02)):
        for beta, gamma in CELLS:
            levels = (0.0,) if gamma else (2.54, 5.08, 7.62)[: 3 if medium == "poppy_LP" else 0]
            kind = "horizontal" if not gamma else "intrusion" if gamma > 0 else "extraction"
            ids = [f"{medium}_{beta:g}_{gamma:g}_{level}" for level in levels]
            for name, level in zip(ids, levels, strict=True):
                trace, fit = chain.one_run(name, kind, level, slope, 0.1, rng, 200)
                traces.append(trace)
                fits.append(fit | {"medium": medium})
            row = {"medium": medium, "beta_deg": beta, "gamma_deg": gamma, "run_ids": " ".join(ids)}
            for c, alpha in (("z", slope if ids else np.nan), ("x", 0.1 if ids else np.nan)):
                row |= {
                    f"alpha_{c}_N_per_cm3": alpha,
                    f"alpha_{c}_lo_N_per_cm3": alpha - 0.002,
                    f"alpha_{c}_hi_N_per_cm3": alpha + 0.002,
                }
            cells.append(row)
    results = of_runs(pd.concat(traces, ignore_index=True), pd.DataFrame(fits))
    results.tables["alpha/{medium}.csv"] = pd.DataFrame(cells)
    return results


def test_linearity_draws_slopes_points_and_gaps():
    figure = draw("linearity", small())
    text = words(figure)
    assert "depth (cm)" in text
    assert "vertical stress\n$\\sigma_z$ (N/cm$^2$)" in text
    assert {"poppy seeds, loose", "3 mm glass, close", "95 % interval of alpha"} <= set(text)
    assert sum("no usable run:\n3 mm glass, close" in line for line in text) == 2
    # rows of sketches, of sigma_z and of sigma_x, five cells each; the third is of horizontal runs
    flat = figure.axes[7]
    marker = style.medium_looks(["poppy_LP"])["poppy_LP"][1]
    points = [line for line in flat.lines if line.get_marker() == marker]
    depths = sorted(float(np.asarray(line.get_xdata())[0]) for line in points)
    assert depths == pytest.approx([2.54, 5.08, 7.62])
    for line in points:
        x, y = (float(np.asarray(values)[0]) for values in line.get_data())
        assert y == pytest.approx(0.35 * x)
    slanted = figure.axes[5]
    ends = [
        np.asarray(line.get_ydata())[-1] for line in slanted.lines if line.get_marker() == marker
    ]
    assert ends == pytest.approx([0.35 * 6.5])
