"""The robot and the media that its tests share."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from rftfit import reference
from rftfit.model.fourier import as_array
from rftfit.model.profiles import DepthOnlyProfile, FourierProfile, TableProfile
from rftfit.robot.config import paper_robot

if TYPE_CHECKING:
    from rftfit.model.profiles import Profile
    from rftfit.robot.config import Robot


@pytest.fixture(scope="session")
def robot() -> Robot:
    return paper_robot()


@pytest.fixture(scope="session")
def table() -> TableProfile:
    return TableProfile.published("poppy_LP")


@pytest.fixture(scope="session")
def nine() -> FourierProfile:
    return FourierProfile(as_array(reference.coefficients("poppy_LP")))


@pytest.fixture(scope="session", params=["table", "nine terms", "depth-only"])
def profile(request: pytest.FixtureRequest, table: TableProfile, nine: FourierProfile) -> Profile:
    every: dict[str, Profile] = {
        "table": table,
        "nine terms": nine,
        "depth-only": DepthOnlyProfile.of(table),
    }
    return every[str(request.param)]
