"""Third-party files in `../shared/data`, which developers have beside their clone and a stranger has not."""

from pathlib import Path

import pytest

SHARED_DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
CMU_SAND = SHARED_DATA / "cmu-sand"
LOGS = SHARED_DATA / "logs"
EDGES = SHARED_DATA / "edges"
REPORTED = SHARED_DATA / "reported"
YADE_WHEEL = SHARED_DATA / "yade-wheel"
ROBOT_LEG = SHARED_DATA / "robot-leg"
WHEELS_MEASURED = SHARED_DATA / "wheels-measured"


def needs(path):
    """Mark tests that are skipped where a file or folder of `../shared/data` is absent."""
    return pytest.mark.skipif(not path.exists(), reason=reason_absent(path))


def reason_absent(path):
    """Reason by which skipped tests are counted: the folder that is absent."""
    return f"../shared/data/{path.relative_to(SHARED_DATA).parts[0]} is absent"
