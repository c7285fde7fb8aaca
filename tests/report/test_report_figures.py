"""Figures draw the values of the tables, say what is missing, and always have the same bytes."""

import subprocess
import sys
from tempfile import TemporaryDirectory

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
import result_tables as chain
from matplotlib.collections import QuadMesh
from matplotlib.contour import QuadContourSet
from matplotlib.patches import PathPatch
from numpy.testing import assert_allclose
from pages import words
from paper import paper_config
from result_tables import memory, of_runs, run

from rftfit import FourierProfile, reference
from rftfit.errors import InputError, OutputError
from rftfit.figures import style
from rftfit.figures.plates import stress_runs
from rftfit.figures.registry import figures
from rftfit.measure.flags import attach_run, flag_table, remark
from rftfit.model.fourier import TERMS


def declared(name):
    return next(figure for figure in figures() if figure.name == name)


def draw(name, results, *medium):
    return declared(name).draw(results, *medium)


def section(name, **values):
    """A section of the demonstration's config with other values."""
    return {name: getattr(paper_config(), name).model_copy(update=values)}


def hatched(figure):
    """Count hatched cells of maps; those of the legend are not in any axes."""
    patches = [patch for axes in figure.axes for patch in axes.patches if patch.get_hatch()]
    cells = [patch.get_path() for patch in patches if isinstance(patch, PathPatch)]
    return sum(len(path.to_polygons()) for path in cells)


def two_runs():
    rng = np.random.default_rng(1)
    parts = [
        chain.one_run("down", "intrusion", np.nan, 0.35, 0.16, rng, 200),
        chain.one_run("up", "extraction", np.nan, -0.013, 0.05, rng, 200),
        chain.one_run("flat", "horizontal", 5.08, 0.02, 0.09, rng, 200),
    ]
    angles = [(30.0, 45.0), (-30.0, -45.0), (0.0, 0.0)]
    fits = pd.DataFrame([fit for _, fit in parts])
    fits[["beta_deg", "gamma_deg"]] = angles
    return pd.concat([trace for trace, _ in parts], ignore_index=True), fits


def maps_of(table, confidence=0.95):
    changed = section("fit", confidence=confidence)
    return draw("alpha_maps", memory({"alpha/{medium}.csv": table}, ["poppy_LP"], **changed))


def stress_figure():
    traces, fits = two_runs()
    shown = section("figures", stress_runs=("down", "up"))
    return draw("stress_of_runs", of_runs(traces, fits.assign(medium="poppy_LP"), **shown))


def test_the_same_figure_gives_the_same_bytes_in_any_folder(tmp_path):
    before = dict(mpl.rcParams)
    small_map = maps_of(chain.alpha_table("poppy_LP"))
    assert dict(mpl.rcParams) == before
    endings = (*style.PRINTED, "webp")
    folder, other_folder = tmp_path / "one", tmp_path / "an other, \u00e9"
    names = style.save_pages(small_map, folder, "glass0.3mm_LP", endings=endings)
    assert names == [f"glass0.3mm_LP.{ending}" for ending in endings]
    assert style.save_pages(small_map, other_folder, "glass0.3mm_LP", endings=endings) == names
    assert sorted(path.name for path in folder.iterdir()) == sorted(names)
    bytes_of = {
        ending: (folder / name).read_bytes() for ending, name in zip(endings, names, strict=True)
    }
    assert [*bytes_of.values()] == [(other_folder / name).read_bytes() for name in names]
    # no date, and letters that need no font
    assert bytes_of["webp"][8:12] == b"WEBP"
    assert len(bytes_of["webp"]) < len(bytes_of["png"])
    for ending, word in (
        ("png", b"Software"),
        ("pdf", b"CreationDate"),
        ("pdf", b"/Producer"),
        ("svg", b"<dc:date>"),
        ("svg", b"<text"),
    ):
        assert word not in bytes_of[ending]
    assert b"/FontFile2" in bytes_of["pdf"]


def test_a_folder_that_cannot_be_made_is_an_output_error(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OutputError, match="cannot write"):
        style.save_pages(style.missing("nothing"), tmp_path / "file", "map")


def every_alpha():
    return pd.concat([chain.alpha_table(medium) for medium in reference.MEDIA], ignore_index=True)


def test_maps_show_media_and_missing_cells():
    results = memory({"alpha/{medium}.csv": every_alpha()})
    figure = draw("alpha_maps", results)
    text = words(figure)
    titles = [results.campaign.titles[medium] for medium in reference.MEDIA]
    assert {r"$\gamma$ (degrees)", r"$\beta$ (degrees)", "no usable run", *titles} <= set(text)
    assert sum("(N/cm$^3$)" in line for line in text) == 2
    assert sum("half width of" in line for line in text) == 2
    assert hatched(figure) == 5 * 4 * len(chain.MISSING)
    # a level close to one is not written as 100 %
    text = words(maps_of(chain.alpha_table("poppy_LP", {}), 0.99999))
    assert "no usable run" not in text
    assert any("99.999 % interval" in line for line in text)
    nothing = chain.alpha_table("poppy_LP")
    nothing[[name for name in nothing.columns if name.startswith("alpha_")]] = np.nan
    assert hatched(maps_of(nothing)) == 4 * 91


def test_where_alpha_pushes_along_the_motion_is_shaded():
    """Straight up, an upward push helps; straight down it opposes; sideways motion is toward -x."""

    def shaded_gammas(axes):
        contours = [c for c in axes.collections if isinstance(c, QuadContourSet) and c.filled]
        return [
            np.asarray(path.vertices)[:, 0] for contour in contours for path in contour.get_paths()
        ]

    table = chain.alpha_table("poppy_LP", {}).assign(alpha_z_N_per_cm3=1.0, alpha_x_N_per_cm3=1.0)
    of_z, _, of_x, _, *_ = maps_of(table).axes
    (gammas,) = shaded_gammas(of_z)
    assert (gammas.min(), gammas.max()) == pytest.approx((-90, 0), abs=0.1)
    assert shaded_gammas(of_x) == []
    (gammas,) = shaded_gammas(maps_of(table.assign(alpha_x_N_per_cm3=-1.0)).axes[2])
    assert (gammas.min(), gammas.max()) == pytest.approx((-90, 90), abs=0.1)


def test_the_first_map_names_its_medium_and_where_it_is_from(monkeypatch):
    results = memory({"alpha/{medium}.csv": every_alpha()})
    monkeypatch.setattr(results, "marks", {})
    named = "poppy seeds, loose: measured"
    assert any(text.startswith(named) for text in words(draw("first_map", results)))


def fitted(method="lsq", **tables):
    every = {
        "alpha/{medium}.csv": every_alpha(),
        "coefficients.csv": chain.coefficient_table(),
        "penetration.csv": chain.penetration_table(),
    }
    changed = {f"{name}.csv": table for name, table in tables.items()}
    return memory(every | changed, **section("fourier", method=method))


def test_fit_maps_show_measured_minus_fit():
    results = fitted("dft-index")
    figure = draw("fit_maps", results)
    text = words(figure)
    assert "nine-term fit (dft-index)\n$\\alpha_z$ (N/cm$^3$)" in text
    assert "measured minus fit\n$\\alpha_x$ (N/cm$^3$)" in text
    # the first axes are the maps, a row a medium: fit and residual of alpha_z, then of alpha_x
    mesh = figure.axes[4 * 4 + 3].collections[0]
    assert isinstance(mesh, QuadMesh)
    corners = np.asarray(mesh.get_coordinates())
    assert corners[[0, -1], [0, -1]].tolist() == [[-90, -90], [90, 90]]
    residual = mesh.get_array()
    terms = chain.coefficient_table().query("method == 'dft-index' and medium == 'glass3mm_CP'")
    kept = terms.set_index("coefficient").query("kept")["value_N_per_cm3"]
    assert "Cm1" not in kept
    coefficients = kept.reindex(list(TERMS), fill_value=0.0).to_numpy(float)
    grid = np.meshgrid(
        np.radians(reference.BETA_DEG), np.radians(reference.GAMMA_DEG), indexing="ij"
    )
    expected = reference.alpha_grid("glass3mm_CP")[1] - FourierProfile(coefficients).alpha(*grid)[1]
    assert residual is not None
    good = ~np.ma.getmaskarray(residual)
    assert np.count_nonzero(~good) == len(chain.MISSING)
    # the table's angles are rounded to a hundredth of a degree when cells are sorted
    assert_allclose(residual[good], expected[good], atol=1e-4)


def test_depth_only_maps_are_made_from_three_measured_values():
    table = chain.alpha_table("poppy_LP", {})
    results = memory({"alpha/{medium}.csv": table}, ["poppy_LP"])
    figure = draw("depth_only_maps", results, "poppy_LP")
    images = [figure.axes[i].images[0] for i in (0, 2)]
    z, x = (np.asarray(image.get_array()) for image in images)
    # the first row is beta -90 deg, at the bottom; the first column gamma -90 deg, at the left
    assert {image.origin for image in images} == {"lower"}
    assert [image.get_extent() for image in images] == [[-90, 90, -90, 90]] * 2
    assert images[0].get_clim() == pytest.approx((-z.max(), z.max()))
    indexed = table.set_index(["beta_deg", "gamma_deg"])
    down = indexed.loc[(0.0, 90.0), "alpha_z_N_per_cm3"]
    left = indexed.loc[(90.0, 0.0), "alpha_x_N_per_cm3"]
    # at the middles of cells of one degree; each component opposes its own velocity component
    cos = np.cos(np.radians(0.5))
    assert z[90, 179] == pytest.approx(down * cos)
    assert z[90, 100] == z[90, 179]
    assert x[179, 90] == pytest.approx(left * cos, rel=0.05)  # +-90 degrees are one plate
    residual = figure.axes[1].collections[0].get_array()
    assert residual is not None
    assert residual.reshape(7, 13)[3, 12] == pytest.approx(0, abs=1e-9)
    lost = chain.alpha_table("poppy_LP", {(0.0, 90.0): "no tare"})
    text = words(draw("depth_only_maps", memory({"alpha/{medium}.csv": lost}), "poppy_LP"))
    assert any("no depth-only model" in line for line in text)


def test_generic_figure_scales_by_zeta():
    results = fitted()
    figure = draw("generic_profile", results)
    text = words(figure)
    assert r"coefficient / $\zeta$ (dimensionless)" in text
    assert {results.campaign.titles[medium] for medium in reference.MEDIA} <= set(text)
    line = next(line for line in figure.axes[0].lines if line.get_label() == "poppy seeds, loose")
    coefficients, penetration = (results.table(f"{n}.csv") for n in ("coefficients", "penetration"))
    rows = coefficients.query("method == 'lsq' and medium == 'poppy_LP' and kept")
    zeta = penetration.query("method == 'lsq' and medium == 'poppy_LP'")["zeta"].iloc[0]
    assert_allclose(np.asarray(line.get_ydata(), float), rows["value_N_per_cm3"] / zeta)


def test_without_any_fit_the_reasons_are_drawn():
    why = "1 of 91 cells have no alpha"
    coefficients = chain.coefficient_table().assign(value_N_per_cm3=np.nan, reason=why)
    penetration = chain.penetration_table().assign(zeta=np.nan, reason=why)
    results = fitted(coefficients=coefficients, penetration=penetration)
    results.tables["predicted.csv"] = results.tables["legs/{medium}.csv"] = pd.DataFrame()
    for name in ("fit_maps", "generic_profile", "forces_over_zeta"):
        assert f"poppy seeds, loose: {why}" in words(draw(name, results))


def test_without_a_usable_medium_there_is_no_generic_profile():
    """Each has its fit and its zeta; the mean of none is in no table."""
    why = "unusable: plates on vertical paths are pushed to one side"
    coefficients = chain.coefficient_table()
    results = fitted(
        coefficients=coefficients[coefficients["medium"] != "generic"],
        penetration=chain.penetration_table().assign(reason=why),
    )
    assert f"poppy seeds, loose: {why}" in words(draw("generic_profile", results))
    # the picture says why it is empty
    assert declared("generic_profile").caption_of(results) == ""


def test_stress_figure_turns_extractions_and_draws_the_fit():
    figure = stress_figure()
    text = words(figure)
    assert "stress (N/cm$^2$)" in text
    assert text.count("depth (cm)") == 2
    assert "fit window" in text
    assert any("up\nextraction, $\\beta$ = \u221230\u00b0" in line for line in text)
    # the interval is that of the tables, which one log alone does not show
    assert any("0.3500 \u00b1 0.0550 N/cm$^3$" in line for line in text)
    # lines of a panel: zero, then for z and x the samples and the fit
    lines = figure.axes[1].lines
    samples, fit = lines[3], lines[4]
    assert np.asarray(fit.get_ydata())[-1] == pytest.approx(0.05 * 8)
    end = np.argmax(np.asarray(samples.get_xdata()))
    assert np.asarray(samples.get_ydata())[end] == pytest.approx(0.4, abs=0.05)


def test_which_runs_the_stress_figure_shows():
    traces, fits = two_runs()
    fits = fits.assign(medium="poppy_LP")
    campaign = of_runs(traces, fits).campaign
    assert stress_runs(campaign) == ["down", "up"]
    for run_id, message in (("moon", "figures.stress_runs: found moon"), ("flat", "horizontal")):
        with pytest.raises(InputError, match=message):
            stress_runs(of_runs(traces, fits, **section("figures", stress_runs=(run_id,))).campaign)
    flat = fits[fits["run_id"] == "flat"]
    results = of_runs(traces[traces["run_id"] == "flat"], flat)
    assert stress_runs(results.campaign) == []
    # by default the pair nearest to (30, 45) degrees, a push alone only where there is no pair
    runs = [
        run(
            f"{beta:g} {gamma:g} {direction}",
            "poppy_LP",
            direction=direction,
            beta_deg=beta,
            gamma_deg=gamma,
        )
        for beta, gamma, direction in (
            (0.0, 90.0, "intrusion"),
            (0.0, 90.0, "extraction"),
            (30.0, 45.0, "intrusion"),
            (30.0, 60.0, "extraction"),
            (30.0, 60.0, "intrusion"),
            (30.0, 0.0, "horizontal"),
        )
    ]
    assert stress_runs(memory({}, ["poppy_LP"], runs).campaign) == [
        "30 60 intrusion",
        "30 60 extraction",
    ]
    assert stress_runs(memory({}, ["poppy_LP"], runs[2:3]).campaign) == ["30 45 intrusion"]
    assert declared("stress_of_runs").media(results.campaign) == ()
    # a run that was refused has no samples: another one is shown
    other_traces = traces[traces["run_id"] != "down"]
    results = of_runs(traces, fits)
    results.tables |= of_runs(other_traces, fits[fits["run_id"] != "down"]).tables
    assert any("up\nextraction" in line for line in words(draw("stress_of_runs", results)))


def test_tare_figure_shades_the_valid_range():
    depth = np.linspace(-1, 8, 50)
    good = (depth > 0) & (depth < 7)
    force = pd.Series(depth).where(good)
    tared = pd.DataFrame({"run_id": "a", "depth_cm": depth, "tare_z_N": force, "tare_x_N": -force})
    tares = pd.DataFrame(
        {
            "run_id": ["a"],
            "abscissa": ["depth_cm"],
            "valid_to": [7.0],
            "tare_run": ["$run_3"],
            "reason": [""],
        }
    )
    names = "tares/poppy_LP.csv", "tared/poppy_LP.parquet"
    figure = draw("tare", memory(dict(zip(names, (tares, tared), strict=True))), "poppy_LP")
    text = words(figure)
    assert {"depth (cm)", "force on rod and mount (N)", "valid range"} <= set(text)
    box = figure.axes[0].patches[0].get_extents().transformed(figure.axes[0].transData.inverted())
    assert_allclose([box.x0, box.x1], [depth[good][0], depth[good][-1]])
    for column, value, message in (
        ("tare_z_N", np.nan, "valid nowhere"),
        ("valid_to", np.nan, "no plate run has a tare"),
    ):
        tables = (t.assign(**{column: value}) if column in t else t for t in (tares, tared))
        lost = draw("tare", memory(dict(zip(names, tables, strict=True))), "poppy_LP")
        assert any(message in line for line in words(lost))


def test_a_marked_run_has_its_reason_beside_the_picture():
    traces, fits = two_runs()
    results = of_runs(traces, fits.assign(medium="poppy_LP"))
    sheet = declared("{medium}")
    assert sheet.caption_of(results, "poppy_LP").endswith("3 runs, 0 marked")
    bent = remark("not-linear", component="z", percent=11.0)
    flags = flag_table("poppy_LP", "slopes", attach_run("down", [bent]))
    results.tables["flags/{medium}.csv"] = flags
    check = {"medium": "poppy_LP", "check": "linearity", "verdict": "not checked", "found": "few"}
    results.tables["checks/{medium}.csv"] = pd.DataFrame([check])
    results = chain.Memory(results.campaign, results.tables)
    results.campaign.titles["poppy_LP"] = "poppy"
    assert sheet.caption_of(results, "poppy_LP").endswith(f"1 marked: {bent}")
    caption = declared("first_lines").caption_of(results)
    assert f"down, {bent}; no check judges it (few)" in caption


def test_braces_in_the_title_of_a_medium_are_text():
    results = memory({}, ["poppy_LP"])
    results.campaign.titles["poppy_LP"] = "sand {wet}"
    caption = declared("depth_only_maps").caption_of(results, "poppy_LP")
    assert " in sand {wet}, made from" in caption


def test_a_sand_alone_has_no_figure_of_laboratory_media():
    campaign = memory({}, ["yuma"]).campaign
    files = {figure.file(medium) for figure in figures() for medium in figure.media(campaign)}
    names = (
        "first_map",
        "first_peaks",
        "stress_of_runs",
        "estimated_maps",
        "legs_in_sands",
        "peak_errors",
        "penetration",
    )
    assert files == {"quality/yuma", *(f"figures/{name}" for name in names)}


@pytest.mark.parametrize("ending", style.PRINTED)
def test_a_remark_stands_in_every_format(ending):
    figure = style.missing("nothing")
    assert b"a remark" in style.content(figure, ending, "a remark")
    assert b"a remark" not in style.content(figure, ending)


def test_pages_are_written_beside_one_another(tmp_path):
    figure = style.missing("nothing")
    names = style.save_pages([figure, figure], tmp_path, "results/quality/glass0.3mm_LP")
    stems = ("glass0.3mm_LP", "glass0.3mm_LP_page2")
    assert names == [
        f"results/quality/{stem}.{ending}" for stem in stems for ending in style.SCREEN
    ]
    assert all((tmp_path / name).is_file() for name in names)
    assert style.save_pages(figure, tmp_path, "a", endings=style.PAPER) == ["a.pdf"]


def test_numbers_are_written_with_a_true_minus():
    assert style.format_number(-0.0123) == "\u22120.012"
    assert style.format_number(-0.0001) == "0.000"
    assert style.format_number(float("nan")) == "no value"
    assert style.degrees(-18.4349) == "\u221218.4\u00b0"
    assert style.degrees(90.0) == "90\u00b0"


def test_declarations_load_no_matplotlib():
    script = (
        "import sys; from rftfit.figures.registry import figures; figures();"
        "bad = {'matplotlib', 'scipy', 'numba'} & set(sys.modules); assert not bad, bad;"
        "from pathlib import Path; from rftfit.figures.style import missing, save_pages;"
        "save_pages(missing('x'), Path(sys.argv[1]), 'x');"
        "bad = {'matplotlib.pyplot', 'scipy'} & set(sys.modules); assert not bad, bad"
    )
    with TemporaryDirectory() as folder:
        subprocess.run([sys.executable, "-c", script, folder], check=True)
