from __future__ import annotations

import time
from collections import Counter

from rftfit.campaign.load import check_campaign


def test_ten_thousand_rows_in_seconds(room):
    for number in range(5000):
        room.add(f"big_T{number}", "t1")
        room.add(f"big_P{number}", "p1", tare_run=f"big_T{number}")
    room.write()
    start = time.process_time()
    campaign, problems = check_campaign(room.path)
    took = time.process_time() - start
    assert problems == []
    assert campaign is not None
    assert len(campaign.runs) == 10_006
    assert took < 4


def test_ten_thousand_wrong_rows_are_no_slower_than_a_few_seconds(room):
    for number in range(10_000):
        name = f"big_P{number}"
        row = {"run_id": name, "medium": f"popy{number}", "tare_run": f"U{number}"}
        logs = {"force_log": f"{name}.f", "motion_log": f"{name}.m"}
        room.rows[name] = {**room.rows["p1"], **row, **logs}
    room.write()
    start = time.process_time()
    problems = check_campaign(room.path)[1]
    took = time.process_time() - start
    # medium, tare, two logs
    assert Counter(problem.code for problem in problems) == {
        "sheet.unknown-word": 10_000,
        "sheet.tare-unknown": 10_000,
        "sheet.log-missing": 20_000,
    }
    assert took < 6
