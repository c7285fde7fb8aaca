from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import chain_tables as chain
import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from matplotlib.patches import Rectangle

from rftfit import reference
from rftfit.errors import InputError, OutputError
from rftfit.figures import style
from rftfit.figures.generic import draw_generic
from rftfit.figures.maps import draw_fit_maps, draw_maps, kept_coefficients
from rftfit.figures.plates import draw_stress
from rftfit.figures.protocol import draw_tare
from rftfit.figures.style import FORMATS, save

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def words(figure: Figure) -> list[str]:
    from matplotlib.text import Text

    return [text.get_text() for text in figure.findobj(Text)]


def hatched(figure: Figure) -> list[Rectangle]:
    """Hatched cells of maps; those of the legend are not in any axes."""
    patches = [patch for axes in figure.axes for patch in axes.patches if patch.get_hatch()]
    return [patch for patch in patches if isinstance(patch, Rectangle)]


def two_runs() -> tuple[pd.DataFrame, pd.DataFrame]:
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


def small_map() -> Figure:
    return draw_maps(chain.alpha_table("poppy_LP"), chain.TITLES)


def test_the_same_figure_gives_the_same_bytes_in_any_folder(tmp_path: Path) -> None:
    one = save(small_map(), tmp_path / "one" / "glass0.3mm_LP")
    other = save(small_map(), tmp_path / "an other, \u00e9" / "glass0.3mm_LP")
    assert [path.name for path in one] == [f"glass0.3mm_LP.{ending}" for ending in FORMATS]
    for first, second in zip(one, other, strict=True):
        assert first.read_bytes() == second.read_bytes(), first.suffix
    assert sorted(path.name for path in (tmp_path / "one").iterdir()) == sorted(
        path.name for path in one
    )


def test_bytes_do_not_depend_on_hashing_or_on_the_users_settings(tmp_path: Path) -> None:
    traces, fits = two_runs()
    here = save(draw_stress(traces, fits, ["down", "up"]), tmp_path / "here")
    script = (
        "import sys, matplotlib; matplotlib.rcParams['font.size'] = 20;"
        "matplotlib.rcParams['svg.hashsalt'] = 'x';"
        "from test_report_figures import two_runs, draw_stress, save;"
        "save(draw_stress(*two_runs(), ['down', 'up']), sys.argv[1])"
    )
    path = os.pathsep.join([str(Path(__file__).parent), *filter(None, sys.path)])
    subprocess.run(
        [sys.executable, "-c", script, str(tmp_path / "there")],
        env=os.environ | {"PYTHONHASHSEED": "7", "PYTHONPATH": path},
        check=True,
    )
    for path_here in here:
        there = tmp_path / f"there{path_here.suffix}"
        assert path_here.read_bytes() == there.read_bytes(), path_here.suffix


def test_files_carry_no_date_and_embed_their_letters(tmp_path: Path) -> None:
    png, pdf, svg = (path.read_bytes() for path in save(small_map(), tmp_path / "map"))
    assert b"Software" not in png
    assert b"CreationDate" not in pdf
    assert b"/Producer" not in pdf
    assert b"/FontFile2" in pdf
    assert b"<dc:date>" not in svg
    assert b"<text" not in svg


def test_drawing_leaves_the_users_settings_alone() -> None:
    before = dict(mpl.rcParams)
    small_map()
    assert dict(mpl.rcParams) == before


def test_a_folder_that_cannot_be_made_is_an_output_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OutputError, match="cannot write"):
        save(small_map(), tmp_path / "file" / "map")


def test_maps_name_units_and_media_and_show_missing_cells() -> None:
    figure = draw_maps(chain.alpha_tables(), chain.TITLES)
    text = words(figure)
    for wanted in (
        r"$\gamma$ (degrees)",
        r"$\beta$ (degrees)",
        "no usable run",
        *chain.TITLES.values(),
    ):
        assert wanted in text
    assert sum("(N/cm$^3$)" in line for line in text) == 2
    assert sum("half width of the 95 % interval" in line for line in text) == 2
    assert len(hatched(figure)) == 5 * 4 * len(chain.MISSING)


def test_complete_maps_have_no_word_of_missing_runs() -> None:
    figure = draw_maps(chain.alpha_table("poppy_LP", {}), confidence=0.9)
    assert "no usable run" not in words(figure)
    assert any("90 % interval" in line for line in words(figure))
    assert "poppy_LP" in words(figure)


def test_memory_grows_with_the_media_and_not_with_their_square() -> None:
    """What is drawn by way of an image of the whole figure stays in memory until a pdf is closed."""
    assert not [one for one in small_map().findobj() if one.get_rasterized()]


def test_bars_show_the_colours_of_their_maps() -> None:
    figure = small_map()
    (strip,) = figure.axes[1].images
    mesh = figure.axes[0].collections[0]
    assert strip.get_clim() == mesh.get_clim()
    assert strip.get_cmap() == mesh.get_cmap()
    assert tuple(strip.get_extent()[2:]) == figure.axes[1].get_ylim() == mesh.get_clim()


def test_colours_are_symmetric_about_zero() -> None:
    figure = small_map()
    mesh = figure.axes[0].collections[0]
    low, high = mesh.get_clim()
    assert low == -high
    assert high == pytest.approx(np.nanmax(np.abs(reference.alpha_grid("poppy_LP")[0])))


def test_a_medium_without_any_value_is_drawn_hatched() -> None:
    table = chain.alpha_table("poppy_LP")
    table[[name for name in table.columns if name.startswith("alpha_")]] = np.nan
    figure = draw_maps(table)
    assert len(hatched(figure)) == 4 * 91


def test_an_empty_table_is_refused() -> None:
    with pytest.raises(ValueError, match="nothing to draw"):
        draw_maps(chain.alpha_table("poppy_LP").iloc[:0])


def test_fit_maps_show_measured_minus_fit() -> None:
    table, coefficients = chain.alpha_table("glass3mm_CP"), chain.coefficient_table()
    figure = draw_fit_maps(table, coefficients, chain.nine_terms, "dft-index", chain.TITLES)
    text = words(figure)
    assert "nine-term fit (dft-index)\n$\\alpha_z$ (N/cm$^3$)" in text
    assert "measured minus fit\n$\\alpha_x$ (N/cm$^3$)" in text
    # the axes come in order of drawing: map, its colour bar, residual, its colour bar, ...
    residual = figure.axes[6].collections[0].get_array()
    fit = kept_coefficients(coefficients, "dft-index", "glass3mm_CP")
    assert fit["Cm1"] == 0.0
    grid = np.meshgrid(
        np.radians(reference.BETA_DEG), np.radians(reference.GAMMA_DEG), indexing="ij"
    )
    wanted = reference.alpha_grid("glass3mm_CP")[1] - chain.nine_terms(fit, *grid)[1]
    assert residual is not None
    good = ~np.ma.getmaskarray(residual)
    assert np.count_nonzero(~good) == len(chain.MISSING)
    # the table's angles are rounded to a hundredth of a degree when cells are sorted
    np.testing.assert_allclose(residual[good], wanted[good], atol=1e-4)


def test_a_medium_without_a_fit_is_named() -> None:
    with pytest.raises(ValueError, match="no fit 'lsq' of medium 'moon'"):
        kept_coefficients(chain.coefficient_table(), "lsq", "moon")


def test_generic_figure_scales_by_zeta() -> None:
    coefficients, penetration = chain.coefficient_table(), chain.penetration_table()
    figure = draw_generic(
        coefficients, penetration, chain.alpha_tables(), chain.nine_terms, titles=chain.TITLES
    )
    text = words(figure)
    assert r"coefficient / $\zeta$ (dimensionless)" in text
    assert set(chain.TITLES.values()) <= set(text)
    line = next(line for line in figure.axes[0].lines if line.get_label() == "poppy seeds, loose")
    rows = coefficients.query("method == 'lsq' and medium == 'poppy_LP' and kept")
    zeta = penetration.query("method == 'lsq' and medium == 'poppy_LP'")["zeta"].iloc[0]
    np.testing.assert_allclose(np.asarray(line.get_ydata(), float), rows["value_N_per_cm3"] / zeta)
    with pytest.raises(ValueError, match="no zeta of method 'lsq' for glass3mm_CP"):
        draw_generic(
            coefficients,
            penetration[penetration["medium"] != "glass3mm_CP"],
            chain.alpha_tables(),
            chain.nine_terms,
        )


def test_stress_figure_turns_extractions_and_draws_the_fit() -> None:
    traces, fits = two_runs()
    figure = draw_stress(traces, fits, ["down", "up"])
    text = words(figure)
    assert "stress (N/cm$^2$)" in text
    assert text.count("depth (cm)") == 2
    assert "fit window" in text
    assert any(line.startswith("extraction, $\\beta$ = \u221230\u00b0") for line in text)
    # lines of a panel: zero, then for z and x the samples and the fit
    lines = figure.axes[1].lines
    samples, fit = lines[3], lines[4]
    assert np.asarray(fit.get_ydata())[-1] == pytest.approx(0.05 * 8)
    end = np.argmax(np.asarray(samples.get_xdata()))
    assert np.asarray(samples.get_ydata())[end] == pytest.approx(0.4, abs=0.05)


@pytest.mark.parametrize(
    ("run", "message"),
    [("moon", "not in the fit table"), ("flat", "it is horizontal"), ("lost", "has no samples")],
)
def test_stress_figure_says_why_a_run_cannot_be_drawn(run: str, message: str) -> None:
    traces, fits = two_runs()
    fits = pd.concat([fits, fits.iloc[:1].assign(run_id="lost")])
    with pytest.raises(InputError, match=message):
        draw_stress(traces, fits, [run])
    with pytest.raises(InputError, match="no run was chosen"):
        draw_stress(traces, fits, [])


def test_tare_figure_shades_the_valid_range() -> None:
    depth = np.linspace(-1, 8, 50)
    valid = (depth > 0) & (depth < 7)
    tare = pd.DataFrame(
        {"depth_cm": depth, "force_z_N": depth, "force_x_N": -depth, "valid": valid}
    )
    figure = draw_tare(tare, "rod of $run_3")
    text = words(figure)
    assert {"depth (cm)", "force on rod and mount (N)", "valid range"} <= set(text)
    box = figure.axes[0].patches[0].get_extents().transformed(figure.axes[0].transData.inverted())
    np.testing.assert_allclose([box.x0, box.x1], [depth[valid][0], depth[valid][-1]])
    assert "valid nowhere" in words(draw_tare(tare.assign(valid=False), "rod"))
    with pytest.raises(ValueError, match="angle_deg"):
        draw_tare(tare.drop(columns="depth_cm"), "rod")


def test_every_medium_has_its_own_look() -> None:
    media = [*reference.MEDIA, *reference.SANDS]
    assert len(set(style.medium_looks(media).values())) == len(media)
    looks = style.medium_looks(["moon", "poppy_LP"])
    assert looks["poppy_LP"] == style.MEDIUM_LOOKS["poppy_LP"] != looks["moon"]


def test_numbers_are_written_with_a_true_minus() -> None:
    assert style.number(-0.0123) == "\u22120.012"
    assert style.number(-0.0001) == "0.000"
    assert style.number(float("nan")) == "no value"
    assert style.degrees(-18.4349) == "\u221218.4\u00b0"
    assert style.degrees(90.0) == "90\u00b0"


def test_figures_need_neither_pyplot_nor_scipy() -> None:
    script = (
        "import sys, rftfit, rftfit.report;"
        "assert 'matplotlib' not in sys.modules;"
        "import rftfit.figures.quality, rftfit.figures.generic, rftfit.figures.plates;"
        "import rftfit.figures.style, rftfit.page.workbooks, rftfit.figures.protocol;"
        "bad = {'matplotlib.pyplot', 'scipy', 'xlsxwriter'} & set(sys.modules);"
        "assert not bad, bad"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
