"""Make the golden campaigns anew, print what changed, and write what is expected: ``make golden``."""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

import pandas as pd

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "helpers"))

from golden_tables import (
    Difference,
    compare_tables,
    is_allowed,
    is_same_machine,
    listed_columns,
    read_expected,
    short_tables,
    write_expected,
    write_machine,
)
from makers import KNOWN_WRONG, GoldenCampaign, golden_campaigns


def main(arguments: list[str] | None = None) -> int:
    """Run the command; 1 if a column changed that is not listed, or with ``--check`` any."""
    parser = argparse.ArgumentParser(prog="make golden", description=__doc__)
    parser.add_argument("--check", action="store_true", help="print what changed, write nothing")
    parser.add_argument(
        "--also",
        metavar="TABLE:COLUMN",
        action="append",
        default=[],
        help="rewrite this column, too; TABLE as printed or as in the dictionary, * for all columns",
    )
    parser.add_argument("--only", metavar="CAMPAIGN", action="append", help="this campaign alone")
    options = parser.parse_args(arguments)
    allowed = listed_columns(KNOWN_WRONG) | {tuple(word.rsplit(":", 1)) for word in options.also}
    chosen = [
        campaign
        for campaign in golden_campaigns()
        if not options.only or campaign.name in options.only
    ]
    changes = 0
    refused: list[Difference] = []
    tables_to_write = {}
    with tempfile.TemporaryDirectory() as temporary:
        for campaign in chosen:
            tables = make_tables(campaign, Path(temporary) / campaign.name)
            differences = compare_with_expected(campaign, tables)
            if differences:
                tables_to_write[campaign] = tables
            changes += len(differences)
            if not campaign.expected.is_dir():
                print(f"{campaign.name}: new, {len(tables)} tables")
                continue
            for difference in differences:
                is_refused = not is_allowed(difference, allowed)
                print(f"{campaign.name}: {difference}{' (not listed)' if is_refused else ''}")
                refused += [difference] if is_refused else []
    print(f"{changes} changes, {len(refused)} of columns that are not listed.")
    if options.check:
        return 1 if changes else 0
    if refused:
        words = " ".join(sorted({f"--also '{one.table}:{one.column}'" for one in refused}))
        print(f'Nothing was written. If each of these is meant: make golden ARGS="{words}"')
        return 1
    for campaign, tables in tables_to_write.items():
        shutil.rmtree(campaign.expected, ignore_errors=True)
        write_expected(tables, campaign.expected)
        write_machine(campaign.expected)
    return 0


def make_tables(campaign: GoldenCampaign, folder: Path) -> dict[str, pd.DataFrame]:
    """Make a campaign in a folder and return its tables in their short form."""
    campaign.make(folder)
    return short_tables(folder)


def compare_with_expected(
    campaign: GoldenCampaign, tables: dict[str, pd.DataFrame]
) -> list[Difference]:
    """Compare the tables of a campaign with the expected ones; all are new where there are none."""
    expected = read_expected(campaign.expected)
    return compare_tables(expected, tables, is_here=is_same_machine(campaign.expected))


if __name__ == "__main__":
    sys.exit(main())
