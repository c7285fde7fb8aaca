"""Make the golden campaigns anew, print what changed, and write what is expected: ``make golden``."""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "helpers"))

from golden_campaigns import KNOWN_WRONG, GoldenCampaign, golden_campaigns
from golden_machine import is_same_machine, write_machine
from golden_tables import (
    Difference,
    compare_tables,
    is_allowed,
    listed_columns,
    read_expected,
    short_tables,
    write_expected,
)


def compare_campaign(campaign: GoldenCampaign, folder: Path) -> list[Difference]:
    """Make a campaign in a folder and compare its tables with the expected ones; write nothing."""
    campaign.make(folder)
    return compare_tables(
        read_expected(campaign.expected), short_tables(folder), is_here=is_same_machine()
    )


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
    changes, refused = 0, []
    with tempfile.TemporaryDirectory() as temporary:
        made = []
        for campaign in golden_campaigns():
            if options.only and campaign.name not in options.only:
                continue
            folder = Path(temporary) / campaign.name
            is_new = not campaign.expected.is_dir()
            differences = compare_campaign(campaign, folder)
            made.append((campaign, folder))
            if is_new:
                print(f"{campaign.name}: new")
                changes += 1
                continue
            changes += len(differences)
            for difference in differences:
                is_refused = not is_allowed(difference, allowed)
                print(f"{campaign.name}: {difference}{' (not listed)' if is_refused else ''}")
                if is_refused:
                    refused.append(difference)
        if options.check:
            print(f"{changes} changes, {len(refused)} of columns that are not listed.")
            return 1 if changes else 0
        if refused:
            words = " ".join(sorted({f"--also '{one.table}:{one.column}'" for one in refused}))
            print(f'Nothing was written. If each of these is meant: make golden ARGS="{words}"')
            return 1
        for campaign, folder in made:
            shutil.rmtree(campaign.expected, ignore_errors=True)
            write_expected(short_tables(folder), campaign.expected)
        write_machine()
        print(f"{changes} changes written.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
