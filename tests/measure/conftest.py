"""What several tests of this room share."""

import pytest
from makers import config_of_push, row_of_push, write_campaign
from measured import chain

from rftfit.campaign.load import load_campaign


@pytest.fixture
def measure_push(tmp_path):
    """What the stages make of a campaign of one push, whose logs of force and motion hold the same columns."""

    def measure(push, motion_log="p.csv", force_columns=None, **sections):
        text = push.log().text()
        motion = {c: {"column": c, "unit": "mm"} for c in "xz"}
        config = config_of_push("time", motion, **sections)
        config["force_log"]["columns"] |= force_columns or {}
        path = write_campaign(
            tmp_path,
            config,
            rows=[row_of_push(push.gamma_deg, motion_log=motion_log)],
            logs={"p.csv": text, motion_log: text},
        )
        return chain(load_campaign(path), "sand")

    return measure
