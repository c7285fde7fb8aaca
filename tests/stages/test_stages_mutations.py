"""No stage refuses a campaign that `rftfit check` has passed, whatever mistakes are in it."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from campaigns import Folder
from hypothesis import given, note, settings
from hypothesis import strategies as st
from mistakes import MEASURED, compare, mutated
from seeds import seeds


@pytest.mark.statistics
@settings(max_examples=seeds(20, 3))
@given(st.randoms(use_true_random=False))
def test_the_stages_refuse_nothing_that_check_passed(luck):
    written = mutated(luck)
    note(", ".join(written.mistakes))
    with TemporaryDirectory() as folder:
        written.write(Path(folder))
        compare(Folder(Path(folder)), MEASURED)
