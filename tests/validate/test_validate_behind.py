"""Errors and flagged cells have the right shares in the predicted peaks of forces on legs."""

import numpy as np
import pytest
from result_tables import alpha_frame, results_of

from rftfit.compare.legs import errors_of_peaks
from rftfit.reference import LEGS, alpha_grid

MEDIUM = "poppy_LP"


@pytest.fixture(scope="module")
def table():
    return alpha_frame(MEDIUM, alpha_grid(MEDIUM))


def with_errors(config, **errors):
    return config.model_copy(update={"errors": config.errors.model_copy(update=errors)})


def medium_of(table, config):
    return results_of([table], config)[str(table["medium"].iloc[0])]


def alphas(table, end=""):
    """Columns of alpha and its errors."""
    names = [str(name) for name in table]
    return [name for name in names if name.startswith("alpha_") and name.endswith(end)]


def test_noise_is_all_there_is_where_the_legs_are_exact(table, paper_config):
    peak_errors = errors_of_peaks(
        medium_of(table, with_errors(paper_config, hip_cm=0, arc_percent=0))
    )
    assert set(peak_errors) == {(leg, c) for leg in LEGS for c in "zx"}
    assert {share for share, _ in peak_errors.values()} == {"noise 100 %"}
    assert [percent for _, percent in peak_errors.values()] == pytest.approx([0.0] * 6)


def test_a_table_without_errors_and_a_sand_tell_nothing(table, paper_config):
    silent, nothing = table.copy(), table.copy()
    silent[alphas(table, "_hi_N_per_cm3")] = np.nan
    nothing[alphas(table)] = np.nan
    for table_of_medium in (silent, nothing, table.assign(medium="yuma")):
        assert errors_of_peaks(medium_of(table_of_medium, paper_config)) == {}
