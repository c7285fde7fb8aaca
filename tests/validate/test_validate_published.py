"""A campaign is compared with the paper only in media and values that it has measured."""

import numpy as np
import pandas as pd
import pytest

from rftfit.compare.published import Tolerance, compare_alpha, compare_coefficients, compare_numbers
from rftfit.directions import TOLERANCE_DEG
from rftfit.measure.alpha import column
from rftfit.model.fourier import TERMS
from rftfit.reference import load


def terms_of(values, method):
    return pd.DataFrame(
        [
            {"medium": "m", "coefficient": term, "method": method, "value_N_per_cm3": value}
            for term, value in values.items()
        ]
    )


@pytest.mark.parametrize(("relative", "verdict"), [(0.04, "same"), (0.06, "paper inconsistent")])
def test_a_printed_zero_is_judged_by_the_rule_of_the_paper(relative, verdict):
    """Terms above 0.05 A00 are kept, so that 0.06 A00 printed as zero contradicts the rule."""
    printed = load("table_s2").query("medium == 'poppy_LP'").set_index("coefficient")["value"]
    values = terms_of(printed.astype(float)[[*TERMS]], "dft-index, printed terms")
    values = values.assign(lo=0.0, hi=0.0, kept=True, relative_to_A00=relative)
    items = compare_coefficients(values, {"m": "poppy_LP"})
    (item,) = [item for item in items if item.item.startswith("m: Cm1")]
    assert (item.verdict, item.tolerance) == (verdict, 0.05)


def test_a_tolerance_is_not_stretched_by_an_interval_that_misses():
    def verdict(ours, ends):
        return compare_numbers(
            "", "", 1.0, ours, Tolerance(0.1, "rounded"), "measured", ends
        ).verdict

    assert verdict(1.05, (1.04, 1.06)) == "same"
    assert verdict(1.2, (0.9, 1.5)) == "same"
    assert verdict(1.2, (1.1, 1.3)) == "differs"
    assert verdict(float("nan"), (0.9, 1.1)) == "not measured"


def test_what_was_not_measured_neither_differs_nor_agrees():
    paper = load("table_s5").query("medium == 'poppy_CP'")
    once = (paper["beta_deg"] == 0) & (paper["gamma_deg"] == 90)
    names = [column(c) for c in "zx"]
    share, worst = compare_alpha(
        {"m": paper.assign(**paper[names].where(once))}, {"m": "poppy_CP"}, TOLERANCE_DEG
    )
    assert (share.ours, share.verdict, worst.verdict) == (100.0, "same", "same")
    assert "% of 2 measured" in share.item
    assert share.why.endswith("180 of 182 not measured")
    empty = pd.DataFrame(
        dict.fromkeys(["value_N_per_cm3", "lo", "hi", "relative_to_A00"], np.nan), index=range(9)
    )
    empty = empty.assign(
        medium="m", method="dft-index, printed terms", coefficient=TERMS, kept=True
    )
    assert {item.verdict for item in compare_coefficients(empty, {"m": "poppy_LP"})} == {
        "not measured"
    }
