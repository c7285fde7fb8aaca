"""The robot and the media that its tests share."""

import pytest

import rftfit
from rftfit.robot.config import paper_robot


@pytest.fixture(scope="session")
def robot():
    return paper_robot()


@pytest.fixture(scope="session")
def table():
    return rftfit.TableProfile.published("poppy_LP")


@pytest.fixture(scope="session")
def nine():
    return rftfit.published_medium("poppy_LP", "fourier")


@pytest.fixture(scope="session", params=["table", "fourier", "depth_only"])
def profile(request):
    return rftfit.published_medium("poppy_LP", request.param)
