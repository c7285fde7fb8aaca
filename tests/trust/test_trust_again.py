"""`rftfit verify --again` finds results that were changed together with their records.

Only making them again can tell.
"""

import hashlib
import json

import pandas as pd
import pytest
from campaigns import make_campaign

pytestmark = pytest.mark.slow

ALPHA = "results/alpha/yuma.csv"
TRACES = "results/tared/yuma.parquet"
LEDGER = "results/ledger.csv"
FIGURE = "results/figures/penetration.png"
PAGE = "results/report.html"


def flip_a_bit(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def double_alpha(path):
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    doubled = 2 * float(table["alpha_z_N_per_cm3"].iloc[0])
    table["alpha_z_N_per_cm3"] = [f"{doubled:.6g}", *table["alpha_z_N_per_cm3"].iloc[1:]]
    table.to_csv(path, index=False, lineterminator="\n")


def drop_the_last_row(path):
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:-1]))


def renew_records(root, changed):
    """Write the sums of changed results into all records that name them, as a forger would."""
    contents = {name: root / name for name in changed if (root / name).exists()}
    sums = {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in contents.items()}
    for path in (root / "results" / "records").rglob("*.json"):
        record = json.loads(path.read_text(encoding="utf-8"))
        for side in ("reads", "writes"):
            record[side] |= {name: sums[name] for name in record[side] if name in sums}
        path.write_text(json.dumps(record, indent=1, sort_keys=True) + "\n", encoding="utf-8")


@pytest.fixture(scope="module")
def forged(tmp_path_factory):
    """A campaign whose results were changed, and records with them."""
    campaign = make_campaign(
        tmp_path_factory.mktemp("forged") / "lab é", ("yuma",), plates_only=True
    )
    root = campaign.root
    assert campaign.rftfit("run").returncode == 0
    double_alpha(root / ALPHA)
    flip_a_bit(root / TRACES)
    drop_the_last_row(root / LEDGER)
    flip_a_bit(root / FIGURE)
    (root / PAGE).unlink()
    renew_records(root, (ALPHA, TRACES, LEDGER, FIGURE))
    plain = json.loads(campaign.rftfit("verify", "--json").stdout)
    mismatched = [name for name, holds in plain["as_recorded"].items() if not holds]
    assert not {ALPHA, TRACES, LEDGER, FIGURE} & {*mismatched}  # the records cannot tell
    return campaign


@pytest.fixture(scope="module")
def differences(forged):
    """What `verify --again` says of the forged campaign, by path."""
    process = forged.rftfit("verify", "--again", "--json")
    assert process.returncode == 5, process.stderr
    return json.loads(process.stdout)


def test_people_read_where_each_file_differs(forged, differences):
    lines = forged.rftfit("verify", "--again", "--all").stdout.splitlines()
    assert {f"{path}: {where}" for path, where in differences["unlike"].items()} <= {*lines}


def test_a_forged_number_is_named_with_its_line_and_size(differences):
    table = differences["unlike"][ALPHA]
    assert table.startswith("line 2, alpha_z_N_per_cm3: ")
    assert table.endswith("(50 %)")


def test_a_flipped_bit_is_named(differences):
    assert differences["unlike"][TRACES].startswith("damaged: ")
    assert differences["unlike"][FIGURE].startswith("1 of ")


def test_lost_rows_and_files_are_named(differences):
    rows = pd.to_numeric(differences["unlike"][LEDGER].split()[0])
    assert differences["unlike"][LEDGER] == f"{rows} rows, {rows + 1} made again"
    assert differences["unlike"][PAGE] == "not there"


def test_all_else_has_the_same_bytes(differences):
    # the last job's record of what was written holds the sums of the others
    assert {*differences["unlike"]} == {ALPHA, TRACES, LEDGER, FIGURE, PAGE}
    assert len(differences["same"]) > 40
    assert differences["not_made_again"] == []
    assert [*differences["unlike"]][:2] == [TRACES, ALPHA]  # in the order in which jobs make them
