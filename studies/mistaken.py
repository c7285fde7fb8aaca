"""Campaigns with mistakes in sheet, config and logs or in a table: the stages refuse nothing that `check` passed.

    make mutations                              200 campaigns, measured
    python studies/mistaken.py whole --count 50    with figures and pages

The first campaign for which it does not hold is kept and ends the run.
"""

from __future__ import annotations

import random
import shutil
import sys
import tempfile
from functools import partial
from pathlib import Path

import frame
import pandas as pd
from campaigns import Folder
from frame import Part, Row, Tables, Unit
from mistakes import MEASURED, compare, mutated

FIRST_SEED = 2012


def grade_campaign(stages: tuple[str, ...], number: int) -> list[Row]:
    """Which way a campaign with mistakes goes through the stages, all where none is named."""
    campaign = mutated(random.Random(FIRST_SEED + number))
    folder = Folder(Path(tempfile.mkdtemp(prefix="rftfit_mutation_")))
    try:
        campaign.write(folder.root)
        way = compare(folder, stages)
    except BaseException:
        print(f"{number}: {campaign.mistakes}; kept in {folder.root}", file=sys.stderr)
        raise
    shutil.rmtree(folder.root)
    return [{"way": way}]


def report(rows: pd.DataFrame) -> Tables:
    """How many went which way."""
    return [("Ways", rows["way"].value_counts().reset_index())]


def list_numbers(count: int, seed: int) -> list[Unit]:
    """Numbers of the campaigns."""
    return [(number,) for number in range(seed, seed + count)]


PARTS = {
    "measured": Part(list_numbers, partial(grade_campaign, MEASURED), report, 200),
    "whole": Part(list_numbers, partial(grade_campaign, ()), report, 200),
}

if __name__ == "__main__":
    sys.exit(frame.run_study(__doc__, PARTS))
