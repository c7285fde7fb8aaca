"""How often the checks doubt a campaign that has no fault: `make falsealarms`.

Campaigns of other media, grids, protocols and seeds are re-enacted, beds as far apart as the paper states
(0.005 N/cm^3), and checked as `rftfit check --diagnose` does it. A flag is a check that fails. Allowed: 2
campaigns of 200.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
import yaml

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "helpers"))

from campaigns import FEW, PROJECT
from other_labs import CASES, GRIDS, SECTIONS

from rftfit import reference
from rftfit.campaign.config import Config
from rftfit.campaign.load import load_campaign
from rftfit.lab.enact import reenact
from rftfit.lab.plan import directions_of
from rftfit.workflow.measure import check_logs

ALLOWED = 0.01
SPREAD_N_PER_CM3 = 0.005


def one_campaign(folder: Path, seed: int) -> tuple[str, list[str]]:
    """Re-enact and check one campaign: what it is, and what is doubted about it."""
    luck = np.random.default_rng(seed)
    medium = str(luck.choice(reference.MEDIA))
    case = CASES[luck.integers(len(CASES))]
    grid, protocol = ("few", "paper") if luck.random() < 0.25 else (case.grid, case.protocol)
    spread = float(luck.choice([0.0, SPREAD_N_PER_CM3, SPREAD_N_PER_CM3]))
    stated = bool(spread and luck.random() < 0.5)
    values = yaml.safe_load((PROJECT / "config" / "config.yaml").read_text(encoding="utf-8"))
    del values["robot"]
    values["media"] = {medium: {"title": medium, "published_as": medium}}
    values |= SECTIONS[protocol]
    values["fit"]["missing_tare"] = "flag"
    if stated:
        values["errors"]["bed_N_per_cm3"] = spread
    else:
        del values["errors"]  # as a campaign that states none
    (folder / "config").mkdir(parents=True)
    config = folder / "config" / "config.yaml"
    config.write_text(yaml.safe_dump(values, sort_keys=False), encoding="utf-8")
    raw = folder / "raw" / "paper"
    directions = FEW if grid == "few" else directions_of(GRIDS[grid], seed)
    reenact(
        Config.model_validate(values), raw, raw / "runs.csv", seed=seed, protocol=protocol,
        directions=directions, spread=spread, tare=case.tare, legs=False,
    )  # fmt: skip
    rows = check_logs(load_campaign(config)).to_dict("records")
    what = f"{medium}, {grid}, {protocol}, spread {spread:g}{' (stated)' if stated else ''}"
    what += "" if case.tare else ", no tare"
    return what, [
        f"{row['check']}: {row['sentence']}" for row in rows if row["verdict"] == "failed"
    ]


def main() -> int:
    """Count campaigns with a flag; 1 where there are more than allowed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--campaigns", type=int, default=200)
    parser.add_argument("--first", type=int, default=1, help="seed of the first")
    words = parser.parse_args()
    doubted = 0
    for seed in range(words.first, words.first + words.campaigns):
        with tempfile.TemporaryDirectory() as folder:
            what, flags = one_campaign(Path(folder) / "lab", seed)
        doubted += bool(flags)
        for flag in flags:
            print(f"seed {seed}, {what}: {flag}", flush=True)
    print(f"{doubted} of {words.campaigns} campaigns without a fault are doubted")
    return int(doubted > ALLOWED * words.campaigns)


if __name__ == "__main__":
    sys.exit(main())
