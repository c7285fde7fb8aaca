"""The robot and the media that its tests share."""

import pytest

from rftfit import DepthOnlyProfile, FourierProfile, Profile, TableProfile, reference
from rftfit.model.fourier import as_array
from rftfit.robot.config import paper_robot


@pytest.fixture(scope="session")
def robot():
    return paper_robot()


@pytest.fixture(scope="session")
def table():
    return TableProfile.published("poppy_LP")


@pytest.fixture(scope="session")
def nine():
    return FourierProfile(as_array(reference.coefficients("poppy_LP")))


@pytest.fixture(scope="session", params=["table", "nine terms", "depth-only"])
def profile(request, table, nine):
    every: dict[str, Profile] = {
        "table": table,
        "nine terms": nine,
        "depth-only": DepthOnlyProfile.of(table),
    }
    return every[str(request.param)]
