"""A campaign is compared with the paper only in media and values that it has measured."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from result_tables import page_results, sand_results, write

from rftfit.campaign.load import REENACTED
from rftfit.compare.published import (
    BY_CONSTRUCTION,
    DIFFERS,
    EVIDENCE,
    INCONSISTENT,
    MEASURED,
    NOT_MEASURED,
    SAME,
    VERDICTS,
    Tolerance,
    compare_alpha,
    compare_coefficients,
    compare_numbers,
    compare_penetration,
    discrepancies,
)
from rftfit.measure.alpha import column
from rftfit.measure.flags import Remark
from rftfit.model.fourier import TERMS
from rftfit.model.scaling import AS_PRINTED
from rftfit.reference import MEDIA, load
from rftfit.results import Results
from rftfit.workflow.validate import validate


def as_printed(results, name):
    return results.table(name).assign(method=AS_PRINTED)


def test_means_of_the_paper_stand_beside_its_five_media_only(tmp_path):
    results = page_results(tmp_path)
    terms, tests = (as_printed(results, f"{name}.csv") for name in ("coefficients", "penetration"))
    for media, is_there in ((MEDIA, True), (MEDIA[:4], False)):
        published = {name: name for name in media}
        items = compare_coefficients(terms, published)
        assert any(item.item.startswith("generic") for item in items) == is_there
        tests_of_media = tests[tests["medium"].isin(media)]
        items = compare_penetration(tests_of_media, published)
        assert any(item.item.startswith("chi, mean") for item in items) == is_there
        assert any(item.item.startswith(f"{media[0]}: chi") for item in items)


def test_generic_terms_have_no_unit_and_no_zeta(tmp_path):
    """They are shares of zeta, whose own value is 1."""
    terms = as_printed(page_results(tmp_path), "coefficients.csv")
    items = compare_coefficients(terms, {name: name for name in MEDIA})
    generic = [item.item for item in items if item.item.startswith("generic")]
    assert generic == [f"generic: {term}" for term in TERMS]


def terms_of(values, method):
    return pd.DataFrame(
        [
            {"medium": "m", "coefficient": term, "method": method, "value_N_per_cm3": value}
            for term, value in values.items()
        ]
    )


def test_uneven_steps_tell_the_largest_change_in_percent():
    """From 0.20 to 0.22 are 10 %, from 0.40 to 0.38 are -5 %."""
    by_index = terms_of({"A00": 0.20, "B01": 0.40}, "dft-index")
    by_angle = terms_of({"A00": 0.22, "B01": 0.38}, "lsq")
    (item,) = compare_coefficients(pd.concat([by_index, by_angle]), {})
    assert item.ours == pytest.approx(10)
    assert (item.verdict, item.media) == (INCONSISTENT, ("m",))


@pytest.mark.parametrize(("relative", "verdict"), [(0.04, SAME), (0.06, INCONSISTENT)])
def test_a_printed_zero_is_judged_by_the_rule_of_the_paper(relative, verdict):
    """Terms above 0.05 A00 are kept, so that 0.06 A00 printed as zero contradicts the rule."""
    printed = load("table_s2").query("medium == 'poppy_LP'").set_index("coefficient")["value"]
    values = terms_of(printed.astype(float)[[*TERMS]], AS_PRINTED)
    values = values.assign(lo=0.0, hi=0.0, kept=True, relative_to_A00=relative)
    items = compare_coefficients(values, {"m": "poppy_LP"})
    (item,) = [item for item in items if item.item.startswith("m: Cm1")]
    assert (item.verdict, item.tolerance) == (verdict, 0.05)


def test_a_doubt_about_a_medium_stands_in_every_row_that_has_its_numbers(tmp_path, monkeypatch):
    """Also in rows that do not name it, as the mean of chi; not in the rows of other media."""
    written = page_results(tmp_path)
    tests = as_printed(written, "penetration.csv")
    write(written, "penetration.csv", tests[tests["medium"].isin(MEDIA)])
    sound = validate(Results(written.campaign)).set_index("item")["why"]
    results = Results(written.campaign)
    monkeypatch.setattr(results, "marks", {MEDIA[0]: (Remark("no-tare"),)})
    doubted = validate(results).set_index("item")["why"]
    changed = set(doubted.index[doubted != sound[doubted.index]])
    assert all(doubted[name].endswith(f"; {sound[name]}") for name in changed)
    assert {f"{MEDIA[0]}: chi", "chi, mean over the media"} <= changed
    assert not [name for name in changed if name.startswith(tuple(MEDIA[1:]))]
    assert not changed & {item.item for item in discrepancies()}


def test_evidence_follows_from_the_campaign(tmp_path):
    """What logs were made from is no confirmation: a re-enactment says so, recordings do not."""
    written = page_results(tmp_path)
    for name in ("coefficients.csv", "penetration.csv"):
        printed = as_printed(written, name)
        every = pd.concat([written.table(name), printed[printed["medium"].isin(MEDIA)]])
        write(written, name, every)
    recorded = validate(Results(written.campaign))
    assert set(recorded["evidence"]) <= set(EVIDENCE)
    assert BY_CONSTRUCTION not in set(recorded["evidence"])
    written.campaign.raw.mkdir()
    (written.campaign.raw / REENACTED).write_text("from published results")
    fresh = dataclasses.replace(written.campaign)
    reenacted = validate(Results(fresh))
    # the same items, in the order of what they rest on
    recorded = recorded.set_index("item").loc[reenacted["item"]].reset_index()
    pd.testing.assert_frame_equal(
        reenacted.drop(columns="evidence"), recorded[reenacted.columns].drop(columns="evidence")
    )
    tables = reenacted["where"].isin(["Table S2", "Table S3", "Table S5"])
    assert tables.sum() > 60
    assert set(reenacted.loc[tables, "evidence"]) == {BY_CONSTRUCTION}
    # a prediction beside another measurement may come out otherwise whoever made the logs
    within = reenacted["item"].str.contains("within 33 %")
    assert list(reenacted.loc[within, "evidence"]) == [MEASURED]
    changed = reenacted["evidence"] != recorded["evidence"]
    assert set(recorded.loc[changed, "evidence"]) == {MEASURED}
    # what differs stands first
    places = [
        (VERDICTS.index(verdict), EVIDENCE.index(evidence))
        for verdict, evidence in zip(reenacted["verdict"], reenacted["evidence"], strict=True)
    ]
    assert places == sorted(places)
    assert reenacted["verdict"].iloc[0] == DIFFERS
    judged = reenacted["verdict"].isin([SAME, DIFFERS]) & reenacted["paper"].map(
        lambda x: isinstance(x, float)
    )
    assert reenacted.loc[judged, "tolerance"].notna().all()
    assert reenacted["tolerance_reason"].str.len().min() > 5


def test_a_tolerance_is_not_stretched_by_an_interval_that_misses():
    def verdict(ours, ends):
        return compare_numbers("", "", 1.0, ours, Tolerance(0.1, "rounded"), MEASURED, ends).verdict

    assert verdict(1.05, (1.04, 1.06)) == SAME
    assert verdict(1.2, (0.9, 1.5)) == SAME
    assert verdict(1.2, (1.1, 1.3)) == DIFFERS
    assert verdict(float("nan"), (0.9, 1.1)) == NOT_MEASURED


def test_what_was_not_measured_neither_differs_nor_agrees():
    paper = load("table_s5").query("medium == 'poppy_CP'")
    once = (paper["beta_deg"] == 0) & (paper["gamma_deg"] == 90)
    names = [column(c) for c in "zx"]
    share, worst = compare_alpha({"m": paper.assign(**paper[names].where(once))}, {"m": "poppy_CP"})
    assert (share.ours, share.verdict, worst.verdict) == (100.0, SAME, SAME)
    assert "% of 2 measured" in share.item
    assert share.why.endswith(f"180 of 182 {NOT_MEASURED}")
    empty = pd.DataFrame(
        dict.fromkeys(["value_N_per_cm3", "lo", "hi", "relative_to_A00"], np.nan), index=range(9)
    )
    empty = empty.assign(medium="m", method=AS_PRINTED, coefficient=TERMS, kept=True)
    assert {item.verdict for item in compare_coefficients(empty, {"m": "poppy_LP"})} == {
        NOT_MEASURED
    }


def test_misprints_stand_beside_media_of_the_paper_only(tmp_path):
    results = sand_results(tmp_path)
    printed = {item.item for item in discrepancies()}
    table = validate(results)
    assert printed <= set(table["item"])
    assert INCONSISTENT in set(table["verdict"])
    media = {"yuma": results.config.media["yuma"].model_copy(update={"published_as": None})}
    config = results.config.model_copy(update={"media": media})
    unpublished = validate(Results(dataclasses.replace(results.campaign, config=config)))
    assert unpublished.empty
    assert list(unpublished.columns) == list(table.columns)
