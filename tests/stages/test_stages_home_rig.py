"""The home-made rig of the documentation gives the true alpha, beginning with an empty folder.

The page is docs/howto/home-rig.md.
"""

import numpy as np
import pandas as pd
import pytest
from campaigns import lay_out_home_rig
from pages import figure_faults

from rftfit import Results
from rftfit.campaign.load import load_campaign
from rftfit.figures.registry import figures
from rftfit.workflow import measure

NEWTON_PER_GF, AREA_CM2 = 9.80665e-3, 15.0
"""Unit of the load cells; area of the plate."""
LENGTH_CM, THICKNESS_CM, WALL_CM = 5.0, 0.4, 6.0
"""Of the plate, and its distance from the walls."""


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """The campaign of the page in a folder whose name has a space, run up to the ledger."""
    with pytest.MonkeyPatch.context() as patch:
        root, names = lay_out_home_rig(tmp_path_factory.mktemp("an empty folder"), patch)
        yield root, names, measured(root)


def measured(root):
    """Results of a campaign up to alpha, measured from its logs and held in memory."""
    results = Results(load_campaign(root / "config/config.yaml"))
    results.hold("clocks/sand.parquet", measure.clocks(results, "sand"))
    measure.measure_logs(results, "sand")
    results.hold("alpha/sand.csv", measure.checks(results, "sand")[1])
    return results


def read_push(root, row):
    """Depth, cm, and force z and x, N, of a run, with the true clocks and by the page's signs alone."""
    force = np.loadtxt(root / "raw" / row["force_log"], delimiter=",", skiprows=1).T
    stage = np.loadtxt(root / "raw" / row["motion_log"], delimiter=",", skiprows=1).T
    stage_s = stage[0] / 1000
    stage_s = (stage_s - 2.4) / (1 + 8e-6)
    sine = np.sin(np.radians(float(row["gamma_deg"])))
    depth = (np.interp(force[0], stage_s, stage[1]) - 60) / 10 * sine
    at_rest = force[0] < force[0][0] + 1.8
    x, z = (channel - channel[at_rest].mean() for channel in force[1:])
    return depth, NEWTON_PER_GF * np.stack([-z, x])


def fit_by_hand(root, row, rod):
    """Alpha z and x of a push with its rod subtracted: least squares through zero over the page's window."""
    (depth, force), (rod_depth, rod_force) = (read_push(root, run) for run in (row, rod))
    beta = np.radians(float(row["beta_deg"]))
    half_cm = LENGTH_CM / 2 * abs(np.sin(beta)) + THICKNESS_CM / 2 * np.cos(beta)
    moving = np.arange(depth.size) < int(np.argmax(depth > depth.max() - 1e-3))
    inside = moving & (depth > half_cm) & (depth < 20 - WALL_CM - half_cm)
    order = np.argsort(rod_depth, kind="stable")
    bare = [force[c] - np.interp(depth, rod_depth[order], rod_force[c][order]) for c in (0, 1)]
    d = depth[inside]
    return [float(d @ tared_force[inside] / AREA_CM2 / (d @ d)) for tared_force in bare]


def test_all_runs_of_the_home_rig_are_used_and_agree_with_a_fit_by_hand(home):
    root, _, results = home
    fits = results.table("fits/sand.csv").set_index("run_id")
    assert len(fits) == 36
    assert (fits["reason"] == "").all()
    sheet = pd.read_csv(root / "config/runs.csv", dtype=str, keep_default_na=False)
    rows = {row["run_id"]: row for row in sheet.to_dict("records")}
    for name, fit in fits.iterrows():
        row = rows[name]
        by_hand = fit_by_hand(root, row, rows[row["tare_run"]])
        alphas = fit[["alpha_z_N_per_cm3", "alpha_x_N_per_cm3"]].to_list()
        assert alphas == pytest.approx(by_hand, abs=1e-3), name


def test_alpha_of_the_home_rig_is_the_one_that_its_script_knows(home):
    _, names, results = home
    alpha = results.alpha_table("sand")
    assert (alpha["n_runs"] == 3).all()
    for cell in alpha.to_dict("records"):
        truth = names["true_alpha"](cell["beta_deg"], cell["gamma_deg"])
        for c, true in zip("zx", truth, strict=True):
            lo, hi = (cell[f"alpha_{c}_{end}_N_per_cm3"] for end in ("lo", "hi"))
            assert lo <= true <= hi
            assert cell[f"alpha_{c}_N_per_cm3"] == pytest.approx(true, abs=1e-3)


def test_the_figure_of_the_clocks_shows_the_push_that_differs_most(home):
    _, _, results = home
    (declared,) = [figure for figure in figures() if figure.name == "clocks"]
    page = declared.draw(results, "sand")
    assert figure_faults(page) == []
    (overview,) = [axes for axes in page.axes if "number" in axes.get_xlabel()]
    points = {line.get_marker(): line.get_xydata() for line in overview.lines}
    pushes = results.table("clocks/sand.parquet").dropna(subset=["offset_s"])
    assert len(points["o"]) == len(pushes) == 9
    ((number, difference_s),) = points["D"]
    assert abs(difference_s) == np.abs(points["o"][:, 1]).max()
    # all pushes have the same error here
    run_ids = sorted(pushes["run_id"])
    titles = [axes.get_title(loc="left") for axes in page.axes]
    assert run_ids[int(number) - 1] in titles
