"""Each real log, in a campaign of its own, gives the expected outcome in check, stages and page."""

from __future__ import annotations

import pytest
from mistakes import MEASURED, compare
from seeds import seeds
from third_party import LOGS, REAL_LOGS, campaign_around_log, judge, needs

from rftfit.workflow.stages import FIGURE_RULES, RULES

pytestmark = needs(LOGS)

WITH_PAGE = ("Thrust_Acro", "manual01", "z factor -1")
"""Ends of the names of logs for which a page is made."""
SOME_LOGS = [
    log for place, log in enumerate(REAL_LOGS) if place % 3 == 0 or str(log).endswith(WITH_PAGE)
]
"""Logs of `make test`; `make statistics` takes all."""


def test_every_log_has_a_campaign():
    files = {p.relative_to(LOGS).as_posix() for p in LOGS.rglob("*") if p.is_file()}
    assert files - {log.file for log in REAL_LOGS} == {"README.md"}


@pytest.mark.statistics
@pytest.mark.parametrize("log", seeds(REAL_LOGS, SOME_LOGS), ids=str)
def test_a_campaign_around_a_real_log(log, tmp_path, monkeypatch):
    """Figures are left out, and most pages."""
    # a page without figures
    monkeypatch.setattr("rftfit.workflow.job._refuse_edited_inputs", lambda *_: {})
    folder = campaign_around_log(log, tmp_path)
    page = str(log).endswith(WITH_PAGE)
    whole = [rule for rule in RULES if rule not in (*FIGURE_RULES, "provenance")]
    assert compare(folder, whole if page else MEASURED) == log.outcome
    assert judge(log, folder, page=page) == []
