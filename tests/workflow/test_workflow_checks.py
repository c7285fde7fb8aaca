"""A medium that fails a check is marked in every result and left out of M0 and chi.

M0: the mean profile of all media; chi: measured over fitted alpha_z(0, 90 deg).
"""

import html
import re

import numpy as np
import openpyxl  # type: ignore[import-untyped]
import pandas as pd
import pytest
import yaml
from campaigns import FEW, make_campaign

import rftfit
from rftfit.checks.declared import CHECKS
from rftfit.measure.flags import remark

pytestmark = pytest.mark.slow

GOOD, BAD, TAKEN = "poppy_CP", "glass3mm_CP", "glass0.3mm_CP"
"""Media: one that passes, one that fails, one that fails and is accepted."""
WHY = "weighed in 1998 with another scale"
"""Reason for which it is accepted."""
MARK = str(remark("unusable", faults=CHECKS["size"].fault))
ACCEPTED = str(remark("accepted", fault=CHECKS["size"].fault, why=WHY))


@pytest.fixture(scope="module")
def whole_campaign(tmp_path_factory):
    folder = make_campaign(
        tmp_path_factory.mktemp("checks") / "lab", (GOOD, BAD, TAKEN, "yuma"), directions=FEW
    )
    values = yaml.safe_load(folder.config.read_text("utf-8"))
    values["media"][BAD]["expected_alpha"] = [2, 3]
    values["media"][TAKEN] |= {"expected_alpha": [2, 3], "accept": {"size": WHY}}
    values["media"][GOOD]["expected_alpha"] = [0.4, 0.8]
    folder.config.write_text(yaml.safe_dump(values, sort_keys=False), "utf-8")
    folder.run_here(drawn=("generic_profile", GOOD, BAD))
    return folder


def test_verdicts(whole_campaign):
    verdicts = pd.concat(
        whole_campaign.table(f"checks/{name}.csv") for name in (GOOD, BAD, TAKEN, "yuma")
    )
    table = verdicts.query("check == 'size'").set_index("medium")["verdict"]
    assert table.to_dict() == {
        GOOD: "passed",
        BAD: "failed",
        TAKEN: "accepted",
        "yuma": "not checked",
    }


def test_every_table_is_marked(whole_campaign):
    for medium, mark in ((GOOD, ""), (BAD, MARK), (TAKEN, ACCEPTED)):
        table = whole_campaign.table(f"alpha/{medium}.csv")
        assert set(table["checks"].astype(object).fillna("")) == {mark}
        assert table["alpha_z_N_per_cm3"].notna().all()
        legs = whole_campaign.table(f"legs/{medium}.csv")
        assert set(legs["checks"].astype(object).fillna("")) == {mark}
    for name in (
        "fourier/media.csv",
        "coefficients.csv",
        "penetration.csv",
        "leg_errors.csv",
        "predicted.csv",
    ):
        table = whole_campaign.table(name)
        reasons = table["reason"].astype(object).fillna("")
        for medium, mark in ((BAD, MARK), (TAKEN, ACCEPTED)):
            is_medium = table["medium"] == medium
            assert is_medium.any(), name
            assert reasons[is_medium].str.contains(mark, regex=False).all(), name
        assert not reasons[table["medium"] == GOOD].str.contains("fails").any(), name
    extended = whole_campaign.table("alpha_extended.csv")
    assert set(extended.loc[extended["medium"] == BAD, "checks"]) == {MARK}
    claims = whole_campaign.table("reproduction.csv")
    is_medium = claims[claims["item"].str.contains(BAD)]
    assert len(is_medium)
    assert is_medium["why"].str.contains(MARK, regex=False).all()


def test_it_enters_neither_m0_nor_chi(whole_campaign):
    table = whole_campaign.table("coefficients.csv").query("method == 'lsq'")
    values = table.assign(used=table["value_N_per_cm3"].where(table["kept"], 0)).pivot_table(
        index="medium", columns="coefficient", values="used", sort=False
    )
    order = list(table[table["medium"] == GOOD]["coefficient"])
    penetration = whole_campaign.table("penetration.csv").set_index(["method", "medium"])
    relative = values.loc[[GOOD, TAKEN, BAD], order].div(penetration["zeta"]["lsq"], axis="index")
    m0 = relative.loc[[GOOD, TAKEN]].mean()
    np.testing.assert_allclose(values.loc["generic", order], m0, atol=1e-5)
    assert np.abs(relative.mean() - m0).max() > 1e-3
    chi = penetration["chi"]
    sand = chi["scaling routine (lsq)", "yuma"]
    assert sand == pytest.approx(chi["lsq"][[GOOD, TAKEN]].mean(), rel=1e-4)
    assert rftfit.open(whole_campaign.root).reference().media == (GOOD, TAKEN)


def test_figures_say_it(whole_campaign):
    for medium, marked in ((BAD, True), (GOOD, False)):
        drawn = (whole_campaign.root / f"results/quality/{medium}.png").read_text("utf-8")
        assert drawn.count(MARK) == marked
    drawn = (whole_campaign.root / "results/figures/generic_profile.png").read_text("utf-8")
    assert drawn.count(MARK) == drawn.count(ACCEPTED) == 1


def test_page_workbook_and_closing_lines(whole_campaign):
    text = html.unescape((whole_campaign.root / "results/report.html").read_text("utf-8"))
    section = re.sub(r"\s+", " ", text.split('<section id="believed"')[1].split("</section>")[0])
    sentences = whole_campaign.table(f"checks/{BAD}.csv").set_index("check")["sentence"]
    cause = sentences["size"].partition(":")[0]
    assert f"<strong>3 mm glass, close: unusable.</strong> {cause}" in section
    assert WHY in section
    # what is good in all media, and then what was not checked
    size = CHECKS["size"].good.removeprefix("alpha")
    assert re.search(
        f"{CHECKS['work'].good}.*whether.*{size}.*<code>expected_alpha</code>", section
    )
    assert "3 mm glass, close (unusable)" in text
    assert "0.3 mm glass, close (accepted)" in text
    book = openpyxl.load_workbook(whole_campaign.root / "results/alpha_tables.xlsx")
    assert book[BAD]["A2"].value == MARK
    lines = re.findall(
        r"^(\S+, (?:unusable|doubtful|accepted)):",
        whole_campaign.rftfit("run").stdout,
        re.MULTILINE,
    )
    assert {*lines} == {f"{BAD}, unusable", f"{TAKEN}, accepted"}


def test_results_give_the_checks(whole_campaign):
    results = rftfit.open(whole_campaign.root)
    marks = {name: [*map(str, marks)] for name, marks in results.marks.items()}
    assert marks == {BAD: [MARK], TAKEN: [ACCEPTED]}
    assert results[BAD].title == "3 mm glass, close (unusable)"
