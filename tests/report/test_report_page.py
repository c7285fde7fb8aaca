"""The report page is well formed and small, shows the numbers of the tables and escapes all text.

No browser is used here.
"""

import dataclasses
import json
import re
from functools import partial
from html.parser import HTMLParser
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pages import untrue
from paper import PROJECT, paper_values
from result_tables import (
    NASTY,
    SAND_ALPHA,
    alpha_frame,
    empty_grid_results,
    page_results,
    results_of,
    sand_results,
    write,
)

import rftfit
from rftfit import Results
from rftfit.campaign.config import Config
from rftfit.compare.coefficients import penetration_row
from rftfit.model.fourier import fit_lsq
from rftfit.model.scaling import fit_terms, vertical_penetration
from rftfit.page.page import page as make_page
from rftfit.page.tables import tabulate_media
from rftfit.reference import BETA_DEG, GAMMA_DEG

VOID = {"meta", "link", "input", "br", "img"}
"""Tags of HTML that have no end."""
SECTIONS = [
    "summary",
    "believed",
    "maps",
    "coefficients",
    "scaling",
    "viewer",
    "calculator",
    "legs",
    "sands",
    "robot",
    "reproduction",
    "dropped",
    "methods",
    "provenance",
]
"""Sections of the page in their order."""


class PageParser(HTMLParser):
    """Checks that tags are closed in order; collects text and tables by section, and scripts.

    A table is a list of rows, a row a list of cells, each with its small print after a bar.
    """

    def __init__(self, page):
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text: dict[str, str] = {}
        self.tables: dict[str, list[list[list[str]]]] = {}
        self.section = ""
        self.scripts: list[str] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.tags.append((tag, attributes))
        if tag == "section":
            self.section = attributes["id"] or ""
            self.tables[self.section] = []
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables[self.section].append([])
        elif tag == "tr":
            self.tables[self.section][-1].append([])
        elif tag in {"td", "th"}:
            self.tables[self.section][-1][-1].append("")
        elif tag == "small":
            self.tables[self.section][-1][-1][-1] += "|"

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] == "script":
            self.scripts.append(data)
            return
        self.text[self.section] = self.text.get(self.section, "") + data
        if {"td", "th"} & set(self.open):
            self.tables[self.section][-1][-1][-1] += data

    def rows(self, section, table=0):
        """Rows of a table by their first cell."""
        return {row[0]: row[1:] for row in self.tables[section][table]}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return page_results(tmp_path_factory.mktemp("campaign"), robot=True)


@pytest.fixture(scope="module")
def page(results):
    return make_page(results)


@pytest.fixture(scope="module")
def read(page):
    return PageParser(page)


def live(page):
    match = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert match is not None
    data: dict[str, Any] = json.loads(match[1])
    return data


def test_text_of_the_user_is_escaped(tmp_path):
    page = make_page(page_results(tmp_path, nasty=True))
    assert NASTY not in page
    assert "<b>" not in page
    read = PageParser(page)
    assert len(read.scripts) == 2
    assert live(page)["media"][0]["title"] == NASTY
    for section in ("summary", "coefficients", "legs", "dropped", "reproduction"):
        assert NASTY in read.text[section]


def methods_of(results):
    return " ".join(PageParser(make_page(results)).text["methods"].split())


def test_methods_are_built_from_this_campaign(results, read):
    text = " ".join(read.text["methods"].split())
    assert "4 runs" in text
    assert re.search(r"\b6 cm", text)
    assert {*re.findall(r"ref\. (\d)", text)} >= {*"123456"}
    assert np.__version__ in read.text["provenance"]
    fit = results.config.fit.model_copy(update={"wall_clearance_cm": 4.5, "confidence": 0.9})
    text = methods_of(with_config(results, fit=fit))
    assert re.search(r"\b4\.5 cm", text)
    assert re.search(r"\b90 %", text)
    assert re.search("in a container of 24 . 22 cm", text)
    assert re.search("cm from walls", text)
    flat = {"shape": "flat", "area_cm2": 20, "length_cm": 5, "thickness_cm": 0.4}
    box = {"length_cm": 1000, "width_cm": 1000, "depth_cm": 15}
    legs = {name: leg for name, leg in paper_values()["intruders"].items() if name != "plate"}
    changed = {"intruders": {"plate": flat} | legs, "container": box}
    config = Config.model_validate(paper_values() | changed)
    text = methods_of(with_config(results, intruders=config.intruders, container=config.container))
    assert re.search(r"\(20 cm\S*, 5 cm in the plane of the motion, 0\.4 cm thick\)", text)
    assert "in open ground" in text
    assert not re.search(r"\b1000\b", text)
    assert "walls" not in text


@pytest.mark.parametrize(
    "make", [partial(page_results, robot=True), sand_results, empty_grid_results]
)
def test_every_sentence_rests_on_records(make, tmp_path):
    """With a robot that was calibrated, and where most is absent; `Folder.run_here` asks whole campaigns."""
    assert untrue(make(tmp_path)) == []


def test_a_campaign_without_legs_has_no_place_for_them(tmp_path):
    results = sand_results(tmp_path)
    plates = {
        name: intruder
        for name, intruder in results.config.intruders.items()
        if intruder.shape != "leg"
    }
    media = {"yuma": results.config.media["yuma"].model_copy(update={"published_as": None})}
    write(results, "reproduction.csv", pd.DataFrame())
    page = make_page(with_config(results, title="sand", intruders=plates, media=media))
    assert PageParser(page).open == []
    links = set(re.findall(r'href="#([\w-]+)"', page))
    assert links == set(re.findall(r'<section id="([\w-]+)"', page))
    assert links.isdisjoint({"viewer", "legs", "robot", "reproduction"})
    body = page.partition('<script type="application/json"')[0].partition("<body>")[2]
    assert not re.search(r"\blegs?\b", body.partition('<section id="methods"')[0])
    assert "calc-leg" not in body


@pytest.mark.parametrize(
    ("make", "medium"), [(sand_results, "yuma"), (empty_grid_results, "poppy_LP")]
)
def test_page_of_a_campaign_that_lacks_most(make, medium, tmp_path):
    results = make(tmp_path)
    page = make_page(results)
    read, data = PageParser(page), live(page)
    assert read.open == []
    assert [entry["key"] for entry in data["media"]] == [medium]
    assert [entry["media"] for entry in data["references"]] == [
        len(rftfit.published_reference().media)
    ]
    assert read.tables["coefficients"] == []
    # nothing that is lacking is put into a sentence
    assert not re.search(r"\b(None|nan)\b", read.text["methods"])
    assert "no Fourier series was fitted" in read.text["methods"] or make is sand_results
    if make is sand_results:
        assert set(data["profiles"]["yuma"]) == {"generic"}
        (row,) = (cells for name, cells in read.rows("summary").items() if "Yuma sand" in name)
        zeta = float(row[-2].partition("|")[0])
        assert zeta == pytest.approx(SAND_ALPHA / rftfit.published_reference().chi.mean(), abs=1e-4)
    else:
        assert set(data["profiles"]["poppy_LP"]) == {"table"}
        assert (
            read.rows("summary")["poppy seeds, loose|0 runs"][0] == "no result|no run gave a slope"
        )


def with_config(results, **changes):
    """The same results, with some sections of the config changed."""
    config = results.config.model_copy(update=changes)
    return Results(dataclasses.replace(results.campaign, config=config))


def test_page_is_well_formed_small_and_needs_no_network(results, page, read):
    assert make_page(Results(results.campaign)) == page
    assert read.open == []
    assert len(page.encode()) < 10_000_000
    ids = [attributes["id"] for _, attributes in read.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert not {"iframe", "object"} & {tag for tag, _ in read.tags}
    links = [given.get(name) or "#" for _, given in read.tags for name in ("src", "href")]
    assert all(link.startswith(("#", "data:")) for link in links)
    policy = next(g["content"] for t, g in read.tags if t == "meta" and "http-equiv" in g)
    assert policy.startswith("default-src 'none'")
    assert "unsafe" not in policy


def test_sections_controls_and_tables_are_whole(page, read):
    assert [attributes["id"] for tag, attributes in read.tags if tag == "section"] == SECTIONS
    links = [attributes["href"] for tag, attributes in read.tags if tag == "a"][
        1 : len(SECTIONS) + 1
    ]
    assert links == [f"#{name}" for name in SECTIONS]
    labelled = {attributes["aria-labelledby"] for tag, attributes in read.tags if tag == "section"}
    assert labelled <= {attributes.get("id") for tag, attributes in read.tags if tag == "h2"}
    controls = re.findall(r"<(?:select|input)\b", page.split("<script", maxsplit=1)[0])
    inside = re.findall(r"<label\b.*?</label>", page, re.DOTALL)
    assert len(controls) == len(inside) == 15
    assert all(re.search(r"<(?:select|input)\b", label) for label in inside)
    widths = [{len(row) for row in table} for tables in read.tables.values() for table in tables]
    assert [len(lengths) for lengths in widths] == [1] * 24
    shares, best, conditions = (table[1:] for table in read.tables["robot"])
    assert shares[0][1] == "42 of 42|predicted: 39 of 39"
    assert [row[2] for row in best] == ["0.40", "0.40"]
    assert len(conditions) == 42


def test_the_documentation_lists_the_constants_of_the_code(small_made):
    """In the order of the page: the model's own error, its floor and length, nodes, course, frictions and tilt."""
    text = (PROJECT / "docs" / "theory" / "comparison.md").read_text("utf-8")
    rows = text.partition("| constant | value |")[2].split("\n\n")[0].splitlines()[2:]
    documented = [row.split("|")[2].strip().rstrip("\N{DEGREE SIGN}") for row in rows]
    page = PageParser((small_made.root / "results" / "report.html").read_text("utf-8"))
    (listed,) = [table for table in page.tables["methods"] if table[0][:2] == ["Constant", "Value"]]
    values_of_code = [row[1] for row in listed[1:] if row[1] != "see its table"]
    assert len(values_of_code) == 7
    # this campaign estimates the model's own error from its legs
    values_of_code[0] = f"{rftfit.published_medium('poppy_LP').model_error:g}"
    assert documented[:7] == values_of_code


@pytest.mark.parametrize(("detected", "is_told"), [(1.01, False), (1.2, True), (0.8, True)])
def test_a_window_that_moves_alpha_out_of_its_interval_is_told_beside_it(
    detected, is_told, tmp_path
):
    results = sand_results(tmp_path)
    ends = {"alpha_z_lo_N_per_cm3": 0.95 * SAND_ALPHA, "alpha_z_hi_N_per_cm3": 1.05 * SAND_ALPHA}
    write(results, "alpha/yuma.csv", results["yuma"].alpha.assign(**ends, run_ids="y1 y2"))
    rows = [
        {
            "medium": "yuma",
            "run_id": run_id,
            "window": window,
            "linear_to_cm": to_cm,
            "alpha_z_N_per_cm3": share * factor * SAND_ALPHA,
        }
        for window, share, to_cm in (("stated", 1.0, 3.0), ("detected", detected, 6.0))
        for run_id, factor in (("y1", 0.9), ("y2", 1.1), ("other", 7.0))
        if run_id != "other" or window == "stated"
    ]
    write(results, "sands.csv", pd.DataFrame(rows))
    (row,) = PageParser(make_page(Results(results.campaign))).tables["summary"][0][1:]
    told = f"by the detected window {detected * SAND_ALPHA:.4f} down to 6.0 cm: no interval holds"
    assert (told in "".join(row)) is is_told


@pytest.mark.parametrize(("end_cm", "at_cm"), [(7.0, 5.6), (4.0, 4.0)])
def test_stress_of_a_sand_where_its_legs_go_stands_beside_alpha(end_cm, at_cm, tmp_path):
    results = sand_results(tmp_path)
    run = results.campaign.runs[0]
    window = {"depth_from_cm": 0.0, "depth_to_cm": 2.0, "run_ids": run.run_id}
    write(results, "alpha/yuma.csv", results["yuma"].alpha.assign(**window))
    row = {"medium": "yuma", "run_id": run.run_id, "window": "stated", "linear_to_cm": 2.0}
    write(results, "sands.csv", pd.DataFrame([row | {"alpha_z_N_per_cm3": SAND_ALPHA}]))
    depth_cm = np.arange(0.1, end_cm + 0.01, 0.1)
    # stress over depth grows from alpha at the end of the window to twice that at 4 cm
    stress = SAND_ALPHA * depth_cm * (1 + 0.5 * np.clip(depth_cm - 2, 0, 2))
    area_cm2 = results.config.intruders[run.intruder].area_cm2
    samples = {"depth_cm": depth_cm, "force_z_N": stress * area_cm2}
    (results.root / "results" / "tared").mkdir()
    tared = pd.DataFrame(samples).assign(run_id=pd.Categorical([run.run_id] * len(depth_cm)))
    tared.to_parquet(results.root / "results" / "tared" / "yuma.parquet")
    page = make_page(Results(results.campaign))
    text = " ".join(re.sub(r"<[^>]+>", "", page.partition('id="sands"')[2]).split())
    told = f"where the legs go: {2 * SAND_ALPHA:.2f} N/cm\u00b3 at {at_cm:.1f} cm, 2.0 times \u03b1, in Yuma sand."
    assert told in text
    assert "no test of \u03b1 at that depth" in text


def test_level_runs_at_several_depths_are_not_called_repeats(tmp_path):
    results = page_results(tmp_path)
    for medium in results.media:
        alpha = results[medium].alpha
        is_level = alpha["gamma_deg"] == 0
        counts = {"n_runs": np.where(is_level, 3, 1), "n_depths": np.where(is_level, 3, 0)}
        write(results, f"alpha/{medium}.csv", alpha.assign(**counts))
    text = methods_of(Results(results.campaign))
    assert "with 1 run in each direction, of level motion at each of 3 depths." in text


TWELVE = [(0, 90), (-30, 90), (30, 90), (60, 90), (-60, 45), (-30, 45)]
TWELVE += [(0, 45), (30, 45), (60, 45), (30, 34), (60, 0), (90, 0)]
"""Directions of a rig that pushes downward and level, deg."""


def sand_of_no_nine_terms(beta, gamma):
    """Return alpha of a published medium, bent by factors that it does not share with any other."""
    alpha_z, alpha_x = rftfit.published_medium("glass0.3mm_LP").alpha(beta, gamma)
    across = np.sin(2 * beta) * np.cos(gamma)
    bent_z = 1 + 0.07 * np.cos(2 * beta) + 0.05 * across - 0.03 * np.cos(2 * gamma)
    bent_x = 1 - 0.06 * np.cos(2 * beta) + 0.06 * across + 0.03 * np.cos(2 * gamma)
    return 1.35 * alpha_z * bent_z, 1.35 * alpha_x * bent_x


def scaled_media_of_page(directions):
    """Return the page's zeta and chi of that sand, of which some directions were pushed, and the truth of all."""
    beta, gamma = np.radians(np.meshgrid(BETA_DEG, GAMMA_DEG, indexing="ij"))
    values = sand_of_no_nine_terms(beta, gamma)
    zeta = vertical_penetration(fit_lsq(beta.ravel(), gamma.ravel(), *(v.ravel() for v in values)))
    table = alpha_frame("sand", values)
    places = zip(table["beta_deg"], table["gamma_deg"].round(), strict=True)
    table = table[[directions is None or place in directions for place in places]]
    table = table.reset_index(drop=True)
    values = paper_values() | {"media": {"sand": {"title": "sand"}}, "robot": None}
    config = Config.model_validate(values)
    results = results_of([table], config)
    rows = [penetration_row(fit_terms(table, config, "lsq"))]
    map_table = results["sand"].map().table().assign(reason="", chance_if_it_belongs=1.0)
    results._tables |= {"penetration.csv": pd.DataFrame(rows), "maps/sand.csv": map_table}
    outcome: Any = SimpleNamespace(dropped=())
    (row,) = tabulate_media(results, outcome).rows
    true_alpha = float(sand_of_no_nine_terms(0.0, np.pi / 2)[0])
    return row, rows[0], float(zeta), true_alpha / float(zeta)


def test_zeta_beside_the_papers_is_of_all_directions_though_twelve_were_pushed():
    row, fit, zeta, chi = scaled_media_of_page(TWELVE)
    assert row["zeta_lo"] < zeta < row["zeta_hi"]
    assert row["chi_lo"] < chi < row["chi_hi"]
    # nine terms of the pushed directions are far from both, and the cell says so
    assert fit["zeta_lo"] > zeta
    assert fit["chi_hi"] < chi
    assert f"of the map, to quote; pushes alone: {fit['zeta']:.4f} (" in row["zeta_note"]


def test_zeta_of_a_whole_grid_is_that_of_its_nine_terms():
    row, fit, zeta, chi = scaled_media_of_page(None)
    for name, truth in (("zeta", zeta), ("chi", chi)):
        for end in ("", "_lo", "_hi"):
            assert row[f"{name}{end}"] == fit[f"{name}{end}"]
        assert row[name] == pytest.approx(truth, rel=1e-3)
        assert "map" not in row.get(f"{name}_note", "")


def test_the_zeta_of_a_sand_by_its_map_stands_beside_that_by_the_papers_routine(small_made):
    page = PageParser((small_made.root / "results" / "report.html").read_text("utf-8"))
    (media,) = (
        table for tables in page.tables.values() for table in tables if "next bed" in str(table[0])
    )
    of_map, _, _ = rftfit.open(small_made.root)["yuma"].map().zeta
    (sand,) = (row for row in media if row[0].startswith("Yuma"))
    assert f"map: {of_map:.4f}" in "|".join(sand)
