"""The readers of text logs read or refuse random bytes within limits of time and memory.

`make fuzz` takes longer.
"""

import pytest
from log_files import TEXTS, fuzz
from seeds import seeds

INPUTS = seeds(150, 50)


@pytest.mark.statistics
@pytest.mark.parametrize("name", sorted(TEXTS))
def test_fuzz(name, tmp_path):
    score = fuzz(name, 60, 2013, tmp_path / "input.txt", INPUTS)
    assert score.inputs == INPUTS
    assert score.read > 0.2 * INPUTS
    assert score.refused > 0.06 * INPUTS
