"""Every number in the findings of the report page equals the one in the tables.

Findings: the sentences at the top of the page and its sections. Also tested: the first figures.
"""

import html
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from result_tables import page_results, write

from rftfit import Results
from rftfit.campaign.config import ErrorSettings
from rftfit.checks.declared import CHECKS
from rftfit.figures import style
from rftfit.figures.labels import explanation_of
from rftfit.measure.flags import attach_run, flag_table, remark
from rftfit.page.page import page as make_page
from rftfit.workflow.validate import estimated_map_rows

FAILED = {"check": "work", "verdict": "failed", "effect": "unusable"}
NUMBER = re.compile(r"(?<![\w.])[\u2212+]?\d+(?:\.\d+)?")


def numbers(text):
    """Numbers of a sentence, without those of its directions and units."""
    plain = re.sub(r"\(0, 90 deg\)|N/cm\u00b3|\d+(?:\.\d+)? mm glass", "", text)
    return [float(number.replace("\u2212", "-")) for number in NUMBER.findall(plain)]


def sentences(page):
    """Text and section of each sentence, as a reader sees it."""
    match = re.search(r'<ul class="findings">(.*?)</ul>', page, re.DOTALL)
    assert match is not None
    items = re.findall(r'<li>(.*?) <a href="#(\w+)".*?</li>', match[1], re.DOTALL)
    return [(html.unescape(re.sub(r"</?sub>", "", text)), section) for text, section in items]


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    written = page_results(tmp_path_factory.mktemp("found"), robot=True)
    errors = written.table("leg_errors.csv")
    sand = errors["medium"] == "yuma"
    errors.loc[sand, ["peak_measured_N", "peak_error_percent"]] = [2.0, 12.0]
    # made different from leg to leg, with intervals
    off = errors["leg"].map({"c_leg": 3.0, "flat_leg": -40.0}).fillna(25.0)
    errors["peak_error_percent"] += off
    errors["peak_error_lo_percent"] = errors["peak_error_percent"] - 5
    errors["peak_error_hi_percent"] = errors["peak_error_percent"] + 7
    write(written, "leg_errors.csv", errors)
    passed = {"medium": "yuma", "verdict": "passed"}
    return with_checks(written, [passed | {"check": name} for name in ("work", "rods")])


@pytest.fixture(scope="module")
def page(results):
    return make_page(results)


def text_of(page):
    """The page without tags, as a reader sees it."""
    plain = html.unescape(re.sub(r"<[^>]+>", "", page.partition("<body>")[2]))
    return " ".join(plain.replace("\N{GREEK SMALL LETTER ALPHA}", "alpha").split())


def with_checks(results, rows):
    """Write tables of checks: each row a medium, a check, its verdict, and further cells."""
    table = pd.DataFrame([{"code": row["check"]} | row for row in rows])
    for medium, of_medium in table.groupby("medium"):
        write(results, f"checks/{medium}.csv", of_medium)
    return Results(results.campaign)


def test_the_first_screen_has_two_sentences_and_sections_the_rest(page):
    assert [section for _, section in sentences(page)] == ["believed", "legs"]
    # in the section, in the methods and in their table of constants
    assert page.count("chosen with all these speeds in view") == 3


def test_intervals_of_zeta_of_a_sand_are_told_apart_above_the_first_table(page):
    line = re.search(r'<p class="note of-what">(.*?)</p>', page, re.DOTALL)
    assert line is not None
    assert "(\u03b6, \u03c7 of sands: of one further medium)" in line[1]


def test_generic_terms_have_the_scatter_of_their_media_beside_them(results, page):
    table = results.table("coefficients.csv").query("method == 'lsq' and coefficient == 'B01'")
    zeta = results.table("penetration.csv").query("method == 'lsq'").set_index("medium")["zeta"]
    terms = table[table["medium"] != "generic"].set_index("medium")["value_N_per_cm3"]
    deviation = (terms / zeta).std(ddof=1)
    assert 0.02 < deviation < 0.04
    assert f"s.d. of media {deviation:.4f}" in page
    assert page.count("s.d. of media") == 9 * table["method"].nunique()


def test_an_error_has_one_verdict():
    """By the interval of alpha and, where there is one, that with the model's own error."""

    def row(of_alpha, of_model):
        ends = zip(("lo", "hi", "model_lo", "model_hi"), (*of_alpha, *of_model), strict=True)
        return {f"peak_error_{end}_percent": percent for end, percent in ends}

    unknown, holds, does_not = (np.nan, np.nan), (-5.0, 9.0), (4.0, 9.0)
    of_same_legs = explanation_of(row((4.0, 9.0), (-5.0, 9.0)), chosen_on_these_legs=True)
    assert of_same_legs != explanation_of(row((4.0, 9.0), (-5.0, 9.0)))
    verdicts = {
        (alpha, model): explanation_of(row(alpha, model))
        for alpha in (unknown, holds, does_not)
        for model in (unknown, holds, does_not)
    }
    assert verdicts[unknown, unknown] == ""
    # an error of alpha that explains it is enough
    assert len({verdicts[holds, model] for model in (unknown, holds, does_not)}) == 1
    assert len({verdicts[does_not, model] for model in (unknown, holds, does_not)}) == 3
    assert not any("chance" in verdict for verdict in verdicts.values())


def test_the_least_difference_between_runs_and_titles_with_commas(tmp_path):
    results = page_results(tmp_path)
    rows = []
    for medium, verdict, seen_from in (
        ("poppy_LP", "passed", [0.1, 0.2, 0.9]),
        ("poppy_CP", "passed", [0.3, 0.3, 0.3]),
        ("yuma", "not checked", [0.7, 0.7, 0.7]),
    ):
        rows.append({"medium": medium, "check": "repeats", "verdict": verdict})
        peers = {"seen_from_ratio": seen_from, "times_spread": [1.0, 2.0, np.nan]}
        write(results, f"peers/{medium}.csv", pd.DataFrame(peers))
    failed = FAILED | {"sentence": "Z looks reversed."}
    rows += [failed | {"medium": medium} for medium in ("poppy_LP", "poppy_CP")]
    text = sentences(make_page(with_checks(results, rows)))[0][0]
    assert re.search("less than 15 to 30.% of the largest", text)
    assert "Poppy seeds, loose; and poppy seeds, close are unusable" in text


def test_intervals_in_brackets_are_named(page):
    """Those of an error of a peak are no percentages of alpha."""
    begin = "largest error|peak lift is off"
    named = "In brackets: its 95 % interval with the errors of alpha, axle and arc"
    pattern = rf"((?:{begin})(?:(?!{begin}).)*?{named})(, after \"model\")?"
    of_peaks = re.findall(pattern, text_of(page))
    assert len(of_peaks) >= 2
    for sentences_of_peak, model in of_peaks:
        assert bool(re.search(r"[(,] ?model ", sentences_of_peak)) == bool(model)
        assert "% of alpha" not in sentences_of_peak


def test_an_error_beside_the_limit_has_its_side_and_a_peak_without_interval_its_reason(
    results, tmp_path
):
    errors = results.table("leg_errors.csv")
    errors.loc[errors["leg"] == "c_leg", "peak_error_percent"] = 33.148
    is_peak = (errors["medium"] == "yuma") & (errors["component"] == "z")
    ends = [f"peak_{what}_{end}" for what in ("error", "predicted") for end in ("lo", "hi")]
    ends = [f"{name}_{'percent' if 'error' in name else 'N'}" for name in ends]
    errors.loc[is_peak, ends] = np.nan
    why = remark("steep", degrees=5, percent=30)
    errors.loc[is_peak, ["reason", "reason_code"]] = [str(why), "steep"]
    results = page_results(tmp_path)
    write(results, "leg_errors.csv", errors)
    page = make_page(Results(results.campaign))
    text = text_of(page)
    assert re.search(r"not within 33 % on the .{0,400}c-leg \(worst \+33\.1 %\)", text)
    assert "None of alpha on the" in text
    assert str(why) in text


def test_a_check_passed_only_where_it_was_made(tmp_path):
    results = page_results(tmp_path)
    first, *others = results.media
    passed_in = {"work": results.media, "rods": (first,), "size": (), "repeats": ()}
    codes = {"repeats": "waits"}
    rows = [
        {"medium": medium, "check": check, "code": codes.get(check, check), "sentence": ""}
        | {"verdict": "passed" if medium in media else "not checked"}
        for check, media in passed_in.items()
        for medium in results.media
    ]
    results = with_checks(results, rows)
    page = make_page(results)
    section = text_of(
        "<body>" + page.partition('<section id="believed"')[2].partition("</section>")[0]
    )
    good = {check: re.escape(CHECKS[check].good) for check in passed_in}
    unchecked = ", ".join(map(re.escape, (results.titles[medium] for medium in others)))
    partly = (
        f"Passed in 1 of {len(results.media)} media, not checked in {unchecked}: {good['rods']}"
    )
    assert re.search(f"{good['work']}.*{partly}.*Not checked: whether .*{good['size']}", section)
    headline = sentences(page)[0][0].split(". ", 1)[0]
    assert numbers(headline) == [2, 1, 1, 1]
    assert re.search(
        f"while another fails: {CHECKS['repeats'].title}, .*: {CHECKS['size'].title}", headline
    )


def test_errors_stated_as_zero_are_named(tmp_path):
    """Those of the config that are 0 since it states them; none by default, none of a scatter of beds."""
    results = page_results(tmp_path)
    names = ("surface from run to run", "angles", "turn of the mount", "force on the rod")

    def counts(**errors):
        config = results.config.model_copy(update={"errors": ErrorSettings(**errors)})
        page = make_page(Results(replace(results.campaign, config=config)))
        return np.array([text_of(page).count(name) for name in names])

    stated = counts(angle_deg=0, surface_run_mm=0, turn_deg=0.2, bed_percent=0) - counts()
    # in caption and methods
    assert (stated[:2] >= 2).all()
    assert stated[2:].tolist() == [0, 0]


def test_what_must_be_known_stands_first_and_in_the_verdict(tmp_path, page):
    def media_of_nine_terms(page):
        """Return y of the sentence "in x of y media the nine terms put ..."."""
        return int(re.findall(r"In \d+ of (\d+) media the nine terms", text_of(page))[0])

    results = page_results(tmp_path)
    flags = [flag for run_id in "ab" for flag in attach_run(run_id, [remark("no-tare")])]
    fits = pd.DataFrame({"run_id": list("abc"), "alpha_z_N_per_cm3": 0.3, "reason": ""})
    write(results, "fits/poppy_LP.csv", fits)
    write(results, "flags/poppy_LP.csv", flag_table("poppy_LP", "tare", flags))
    failed = FAILED | {"medium": "poppy_CP", "sentence": "Z looks reversed."}
    marked = make_page(with_checks(results, [failed]))
    first, second = sentences(marked)[:2]
    assert first[0].startswith(
        f"No checks passed, 1 failed: energy. Poppy seeds, loose is doubtful: in 2 of 3 runs {remark('no-tare')}. "
        "Poppy seeds, close is unusable: the medium seems to give energy to the plates"
    )
    # what is unusable is in no sentence on what was found
    assert "Errors of these 10 peak lifts" in second[0]
    assert media_of_nine_terms(marked) == media_of_nine_terms(page) - 1
    for text in (
        '<a href="#checks-poppy_CP">unusable</a>',
        'id="checks-poppy_CP"',
        ">doubtful</a>",
    ):
        assert text in marked


def test_figures_are_previewed_with_captions_and_links(tmp_path):
    from matplotlib.figure import Figure

    results = page_results(tmp_path)
    names = ("figures/alpha_maps_poppy_LP", "figures/first_map", "quality/poppy_CP")
    for name in names:
        style.save_pages(Figure(figsize=(7.2, 3), dpi=300), results.root, f"results/{name}")
    page = make_page(results)
    assert re.findall(r'id="figure-(\w+)"', page) == [
        "first_map",
        "poppy_CP",
        "alpha_maps_poppy_LP",
    ]
    # a figure that has nothing to show is a sentence
    sizes = re.findall(r'<img [^>]*width="(\d+)" height="(\d+)"', page)
    assert sizes == [("900", "375")] * page.count("<img ") == [("900", "375")] * 2
    assert "Poppy seeds, close" in page.partition('id="figure-poppy_CP"')[2].partition("</p>")[0]
    for name in names[:1]:
        assert page.count(f'href="{name}.png"') == 2
    assert not re.search(r'href="[^"]*\.(pdf|svg)"', page)
    assert "rftfit run --print" in page
    assert page.index('id="figure-first_map"') < page.index('id="believed"')
    assert page.index('id="figure-poppy_CP"') < page.index('<section id="maps"')
    assert page.index('id="figure-alpha_maps_poppy_LP"') > page.index('<section id="maps"')


def test_medium_without_a_map_says_why_on_the_page(tmp_path):
    """A push of the wrong sign gives energy back, so no map belongs to it: neither a silence nor a number."""
    results = page_results(tmp_path)
    assert results.map_reason("yuma") == ""
    table = results.table("alpha/yuma.csv")
    pushed = table["alpha_z_N_per_cm3"].notna()
    table.loc[pushed, "alpha_z_N_per_cm3"] *= -1
    write(results, "alpha/yuma.csv", table)
    results = Results(results.campaign)
    (without_map,) = estimated_map_rows(results, "yuma").to_dict("records")
    assert np.isnan(without_map["alpha_z_N_per_cm3"])
    assert without_map["reason_code"] == "no-map"
    write(results, "maps/yuma.csv", estimated_map_rows(results, "yuma"))
    assert results.map_table("yuma").empty
    reason = results.map_reason("yuma")
    assert reason.startswith("yuma: the pushes meet no resistance")
    told = (
        "could not be estimated in directions without a push: yuma: the pushes meet no resistance"
    )
    assert told in make_page(results)


def test_medium_of_another_kind_is_named_on_the_first_screen(tmp_path):
    """No check sees the sign of an angle that is wrong in all runs of a direction: only the shape of the map does."""
    results = page_results(tmp_path)
    words = "only one in 100,000 media of the known kind"
    assert words not in make_page(results)
    table = results.table("maps/yuma.csv")
    write(results, "maps/yuma.csv", table.assign(chance_if_it_belongs=1e-5))
    first_screen = make_page(Results(results.campaign)).partition('id="believed"')[0]
    assert words in first_screen
    assert "of another kind, or a wrong angle" in first_screen
