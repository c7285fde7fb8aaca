"""A number of the paper is compared by its tolerance and by its own rules."""

import pytest

from rftfit import published_table
from rftfit.compare.published import Tolerance, compare_coefficients, compare_numbers


@pytest.mark.parametrize(("relative", "verdict"), [(0.04, "same"), (0.06, "paper inconsistent")])
def test_a_printed_zero_is_judged_by_the_rule_of_the_paper(relative, verdict):
    """Terms above 0.05 A00 are kept, so that 0.06 A00 printed as zero contradicts the rule."""
    values = published_table("table_s2").query("medium == 'poppy_LP'").assign(medium="m")
    values = values.rename(columns={"value": "value_N_per_cm3"}).assign(
        method="dft-index, printed terms", lo=0.0, hi=0.0, kept=True, relative_to_A00=relative
    )
    items = compare_coefficients(values, {"m": "poppy_LP"})
    (item,) = [item for item in items if item.item.startswith("m: Cm1")]
    assert (item.verdict, item.tolerance.value) == (verdict, 0.05)


@pytest.mark.parametrize(
    ("ours", "ends", "verdict"),
    [
        (1.05, (1.04, 1.06), "same"),
        (1.2, (0.9, 1.5), "same"),
        (1.2, (1.1, 1.3), "differs"),
        (float("nan"), (0.9, 1.1), "not measured"),
    ],
)
def test_a_tolerance_is_not_stretched_by_an_interval_that_misses(ours, ends, verdict):
    item = compare_numbers("", "", 1.0, ours, Tolerance(0.1, "rounded"), "measured", ends)
    assert item.verdict == verdict
