"""A quality sheet shows every plate run of a medium and marks each bad run with its fault.

Also tested: the figure of runs beside their repeats.
"""

import numpy as np
import pandas as pd
import pytest
import result_tables as chain
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba
from numpy.testing import assert_allclose
from pages import words
from result_tables import memory, of_runs

from rftfit.compare.peers import compare_runs
from rftfit.figures import style
from rftfit.figures.registry import figures
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
    traces, fits = medium
    (figure,) = sheets(traces, fits)
    text = words(figure)
    levels = (2.5, 5.1, 7.6)
    heads = [f"\u03b3 = 0\u00b0\nhorizontal\n{level:.1f} cm deep" for level in levels]
    assert [line for line in text if "cm deep" in line] == heads
    assert "\u03b2 = \u221290\u00b0" in text
    # one of unknown depth keeps a place
    (lost, *_) = fits.loc[fits["direction"] == "horizontal", "run_id"]
    fits = fits.assign(depth_from_cm=fits["depth_from_cm"].where(fits["run_id"] != lost))
    text = [
        line
        for page in np.ravel(sheets(traces[traces["run_id"] != lost], fits))
        for line in words(page)
    ]
    assert any("depth not known" in line for line in text)
    assert sum(line.startswith(f"{lost}\n") for line in text) == 1


def test_a_scale_is_round_and_holds_its_trace(medium):
    traces, fits = (table[table["run_id"] == medium[1]["run_id"][0]] for table in medium)
    stress = np.linspace(0, 1.7, len(traces))
    others = [name for name in traces if name.endswith("_N_per_cm2")]
    traces = traces.assign(**dict.fromkeys(others, 0.0)).assign(stress_z_N_per_cm2=stress)
    (figure,) = sheets(traces, fits)
    assert "stress \u22120.4 to 2 N/cm\u00b2" in words(figure)


def test_a_spike_and_a_gap_of_a_long_run_are_drawn():
    trace, fit = chain.one_run(
        "down", "intrusion", np.nan, 0.35, 0.0, np.random.default_rng(1), 9000
    )
    stress = trace["stress_z_N_per_cm2"].to_numpy(copy=True)
    stress[[3333, 8999]] = 50.0, 7.0
    stress[6000:6010] = np.nan
    fits = pd.DataFrame([fit | {"medium": "poppy_LP", "beta_deg": 30.0, "gamma_deg": 45.0}])
    figure = draw("stress_of_runs", of_runs(trace.assign(stress_z_N_per_cm2=stress), fits))
    colour = style.COMPONENT_COLOURS["z"]
    before, after = (
        line.get_xydata() for line in figure.axes[0].lines if line.get_color() == colour
    )
    depth = trace["depth_cm"].to_numpy()
    assert len(before) + len(after) < 500
    assert_allclose([before[0, 0], before[-1, 0]], depth[[0, 5999]])
    assert_allclose([after[0, 0], after[-1, 0]], depth[[6010, 8999]])
    assert (before[:, 1].max(), after[-1, 1]) == pytest.approx((50, 7))


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
