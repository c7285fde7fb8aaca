"""A run is planned whatever order its jobs are looked at in, which a hash seed decides."""

import pytest
from makers import TARGETS, GoldenCampaign, run_command


@pytest.mark.parametrize("seed", ["1", "2"])
def test_state_files_that_are_written_while_planning_are_there(tmp_path, monkeypatch, seed):
    monkeypatch.setenv("PYTHONHASHSEED", seed)
    GoldenCampaign("sand-box").write(tmp_path)
    run_command(tmp_path, "run", "--dry-run", *TARGETS, expected_code=0)
