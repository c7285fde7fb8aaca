"""A quality sheet shows every plate run of a medium and marks each bad run with its fault.

Also tested: the figure of runs beside their repeats.
"""

import numpy as np
import pandas as pd
import pytest
import result_tables as chain
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba
from numpy.testing import assert_allclose, assert_array_equal
from pages import words
from result_tables import memory, of_runs

from rftfit.compare.peers import compare_runs
from rftfit.figures import style
from rftfit.figures.maps import along_motion, edges, pivot, refine
from rftfit.figures.quality import runs_on_pages
from rftfit.figures.registry import figures
from rftfit.figures.traces import panel_limits, round_up_125, stress_of, thin
from rftfit.measure.flags import attach_run, flag_table, remark


@pytest.fixture(scope="module")
def medium():
    return chain.runs("poppy_LP", samples=200)


def draw(name, results, *medium):
    return next(figure for figure in figures() if figure.name == name).draw(results, *medium)


def marked(figure):
    """Count the red frames."""
    frames = [c for c in figure.axes[0].collections if isinstance(c, PolyCollection)]
    red = [c for c in frames if np.array_equal(c.get_edgecolor(), [to_rgba(style.MARK)])]
    return sum(len(c.get_paths()) for c in red)


def sheets(traces, fits, flags=()):
    """Quality sheets of a medium whose runs have these flags."""
    results = of_runs(traces, fits)
    results.tables["flags/{medium}.csv"] = flag_table("poppy_LP", "tare", [*flags])
    return draw("{medium}", chain.Memory(results.campaign, results.tables), "poppy_LP")


def test_without_a_tare_only_runs_with_a_fault_of_their_own_are_red(medium):
    traces, fits = medium
    bare, cut = remark("no-tare"), remark("motion-log-cut")
    flags = [*attach_run(fits.loc[50, "run_id"], [cut])]
    flags += [flag for run_id in fits["run_id"] for flag in attach_run(run_id, [bare])]
    (figure,) = sheets(traces, fits, flags)
    text = words(figure)
    assert any(line.endswith(": 105 plate runs, 1 marked") for line in text)
    assert marked(figure) == 1
    assert str(cut) in " ".join(" ".join(text).split())
    assert sum(str(bare) in line for line in text) == 1


def test_a_run_that_a_check_flags_is_red(medium):
    traces, fits = medium
    beside = remark("apart", beside="repeats", times=8.1)
    (figure,) = sheets(traces, fits, attach_run(fits["run_id"].iloc[50], [beside]))
    assert any(line.endswith(": 105 plate runs, 1 marked") for line in words(figure))
    assert marked(figure) == 1


def test_a_sheet_has_every_run_and_marks_the_bad_ones(medium):
    traces, fits = medium[0], medium[1].copy()
    fits.loc[20, [name for name in fits if name.startswith("alpha_")]] = np.nan
    fits.loc[20, "reason"] = "tare too short"
    cut = remark("motion-log-cut")
    traces = traces[traces["run_id"] != fits.loc[20, "run_id"]]
    (figure,) = sheets(traces, fits, attach_run(fits.loc[50, "run_id"], [cut]))
    text = words(figure)
    assert any(line.endswith(": 105 plate runs, 2 marked") for line in text)
    assert marked(figure) == 2
    assert "tare too short" in text
    assert str(cut) in " ".join(" ".join(text).split())
    for run in fits["run_id"]:
        assert sum(line.startswith(f"{run}\n") for line in text) == 1
    assert "N/cm\u00b2" in " ".join(text)
    assert "not measured" not in text
    width, height = figure.get_size_inches() * 2.54
    assert (width, height) == pytest.approx((42.0, 29.7))


def test_the_sheet_of_a_campaign_is_drawn_from_its_tables(medium):
    traces, fits = medium
    some = fits["run_id"].iloc[:12]
    traces, fits = traces[traces["run_id"].isin(some)], fits[fits["run_id"].isin(some)]
    results = of_runs(traces, fits)
    samples = stress_of(results, "poppy_LP")
    for name in ("stress_z_N_per_cm2", "tare_z_N_per_cm2", "in_window"):
        assert_allclose(samples[name], traces[name])
    (figure,) = draw("{medium}", results, "poppy_LP")
    assert any(line.endswith(": 12 plate runs, 0 marked") for line in words(figure))
    results.tables["fits/{medium}.csv"] = fits.iloc[:0]
    assert words(draw("{medium}", results, "poppy_LP")) == [
        "poppy seeds, loose: no plate run to draw"
    ]


def test_repeats_and_gaps_of_the_grid(medium):
    traces, fits = medium
    again = fits.iloc[[3]].assign(run_id="z_again")
    pages = sheets(traces, pd.concat([fits.drop(index=7), again]))
    assert len(pages) == 2
    assert words(pages[0]).count("not measured") == 1
    assert any(line.startswith("z_again\n") for line in words(pages[1]))
    assert "not measured" not in words(pages[1])


def test_horizontal_runs_stand_by_depth(medium):
    fits = medium[1]
    depth = fits.set_index("run_id")["depth_from_cm"] + 0.02
    (page,) = runs_on_pages(fits, depth)
    assert len(page.column_labels) == 15
    assert page.column_labels[6:9] == [
        f"\u03b3 = 0\u00b0\nhorizontal\n{level:.1f} cm deep" for level in (2.56, 5.10, 7.64)
    ]
    assert page.row_labels[0] == "\u03b2 = \u221290\u00b0"
    flat = fits[(fits["direction"] == "horizontal") & (fits["beta_deg"] == 30)]
    assert [page.places[run] for run in flat["run_id"]] == [(4, 6), (4, 7), (4, 8)]
    # one of unknown depth keeps a place
    depth[flat["run_id"].iloc[0]] = np.nan
    pages = runs_on_pages(fits, depth)
    assert sum(len(page.places) for page in pages) == len(fits)
    assert any("depth not known" in label for page in pages for label in page.column_labels)


def test_thinning_keeps_spikes_ends_and_gaps():
    x = np.linspace(0, 8, 1000)
    y = np.sin(x)
    y[333] = 50.0
    y[600:610] = np.nan
    lines = thin(x, y)
    assert len(lines) == 2
    assert sum(map(len, lines)) <= 90
    assert max(line[:, 1].max() for line in lines) == 50.0
    assert lines[0][0, 0] == x[0]
    assert lines[0][-1, 0] == x[599]
    assert lines[1][0, 0] == x[610]
    assert lines[1][-1, 0] == x[-1]
    assert thin(x, np.full(x.shape, np.nan)) == []
    # no stretch is left out at the end
    line = thin(np.arange(1131.0), np.zeros(1131), 400)[0]
    assert np.diff(line[:, 0]).max() <= 10


def test_panel_scales_are_round_and_hold_the_trace():
    assert [round_up_125(value) for value in (0.9, 1.0, 1.1, 2.5, 7.0, 0.03)] == pytest.approx(
        [1, 1, 2, 5, 10, 0.05]
    )
    trace = {"stress_z_N_per_cm2": np.array([0.0, 1.7, np.nan]), "depth_cm": np.array([90.0])}
    assert panel_limits(trace) == (-0.4, 2.0)
    assert panel_limits({"stress_x_N_per_cm2": np.array([-0.7, 0.4])}) == (-1.0, 0.5)
    assert panel_limits({"stress_x_N_per_cm2": np.full(3, np.nan)}) == pytest.approx((-0.01, 0.05))


def test_grids_of_the_alpha_table():
    table = chain.alpha_table("poppy_LP")
    beta, gamma, values = pivot(table.sample(frac=1, random_state=2), "alpha_z_N_per_cm3")
    assert values.shape == (7, 13)
    assert np.isnan(values).sum() == len(chain.MISSING)
    first = table[(table["beta_deg"] == 30) & (table["gamma_deg"] == 90)]
    assert values[4, 12] == first["alpha_z_N_per_cm3"].iloc[0]
    borders = edges(gamma)
    assert borders[0] == -90
    assert borders[-1] == 90
    assert ((borders[:-1] <= gamma) & (gamma <= borders[1:])).all()
    with pytest.raises(ValueError, match="twice"):
        pivot(pd.concat([table, table.iloc[:1]]), "alpha_z_N_per_cm3")
    fine = refine(beta, gamma, values)
    for i, angle in enumerate(beta):
        row = fine[2][np.isclose(fine[0], angle)][0]
        assert_allclose(row[np.isclose(fine[1], gamma[6])], values[i, 6])


def test_alpha_that_pushes_along_the_motion_is_positive():
    gamma = np.array([-90.0, 0.0, 90.0])
    alpha = np.ones((1, 3))
    # straight up, an upward push helps; straight down it opposes; sideways motion is toward -x
    assert_array_equal(along_motion("z", gamma, alpha), [[1, 0, -1]])
    assert_array_equal(along_motion("x", gamma, alpha), [[0, -1, 0]])


def repeats(count, wrong, per_direction):
    """Runs beside their repeats, `per_direction` of them; the first of each of some directions is half as strong."""
    luck = np.random.default_rng(1)
    direction = np.arange(count) // per_direction
    table = pd.DataFrame(
        {"run_id": [f"run${number}" for number in range(count)], "gamma_deg": 90.0}
    )
    table["beta_deg"] = direction * 2.0 - 80
    for c, alpha in (("z", 0.3), ("x", 0.1 + 0.0 * direction)):
        off = 1 + 0.03 * luck.standard_normal(count)
        off[: wrong * per_direction : per_direction] = 0.5
        table[f"alpha_{c}_N_per_cm3"], table[f"alpha_{c}_se_N_per_cm3"] = alpha * off, 0.001
    return compare_runs(table.assign(depth_from_cm=np.nan), "poppy_LP")


@pytest.mark.parametrize(
    ("count", "wrong", "per_direction", "sentence"),
    [
        (5, 0, 5, "5 runs, 0 of 5 apart"),
        (90, 2, 3, "90 runs, 2 of 90 apart"),
        (1000, 8, 20, "1000 runs, 8 of 1000 apart"),
        (5, 0, 1, "5 runs: too few to estimate how much runs differ"),
    ],
)
def test_runs_side_by_side(count, wrong, per_direction, sentence):
    table = repeats(count, wrong, per_direction)
    results = memory({"peers/{medium}.csv": table}, ["poppy_LP"])
    page = draw("runs_side_by_side", results)
    points, red = [], []
    for axes in page.axes:
        dots = [line for line in axes.lines if line.get_marker() == "o"]
        marked_ones = [line for line in dots if line.get_color() == style.MARK]
        points.append(sum(np.size(line.get_xdata()) for line in dots) - len(marked_ones))
        red.append(len(marked_ones))
    assert (points, red) == ([count] * 2, [wrong] * 2)
    text = "\n".join(words(page))
    assert sentence in text
    # the farthest are named, and their numbers stand once, where they differ most
    far = table[table["apart"]].sort_values("times_spread", ascending=False)["run_id"]
    for number, name in enumerate(far[:6], 1):
        assert f"{number}  {style.plain(name)}: $\\alpha_z$ " in text
        assert words(page).count(f"{number}") == 1
    assert ("and 2 more" in text) == (wrong == 8)
