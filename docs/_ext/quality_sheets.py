"""A small quality sheet, which ``make gallery`` draws: what good and bad runs look like.

Its runs are simulated ones, one row of them broken on purpose, and go through the stages as any do.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import yaml
from drawings import push, svg

from rftfit.campaign.config import Config
from rftfit.campaign.load import load_campaign
from rftfit.figures.quality import draw_quality
from rftfit.figures.traces import stress_samples
from rftfit.lab.enact import run_logs
from rftfit.lab.plan import plan_runs
from rftfit.lab.write import sheet_text
from rftfit.measure.fits import fit_medium
from rftfit.measure.flags import Flags, flag_table
from rftfit.measure.ingest import ingest_medium
from rftfit.measure.tare import tare_medium

ROOT = Path(__file__).resolve().parents[2]
MEDIUM = "poppy_LP"
GAMMAS = ("18", "34", "45", "56", "72", "90")
BROKEN = {
    "bp00_g18_in": "wrong_unit",
    "bp00_g45_in": "never_touches",
    "bp00_g56_in": "truncated",
    "bp00_g72_in": "gap",
    "bp00_g90_in": "saturated",
}
NO_TARE = f"{MEDIUM}_bp00_g34_in_rod"
NAME = "quality_sheet.png"
PUSHES = {"bp30_g90_in": "90°", "bp30_g45_in": "45°", "bp30_g18_in": "18°"}
"""Runs that ``push.svg`` shows, and their gamma."""


def draw(root: Path, png: Path) -> None:
    """Write the logs, measure them, and draw the sheet and, beside it, three of its runs.

    `root`: Empty folder for the campaign. `png`: Written.
    """
    path = root / "config" / "config.yaml"
    path.parent.mkdir()
    text = (ROOT / "config" / "config.yaml").read_text(encoding="utf-8").partition("\nrobot:")[0]
    path.write_text(text + "\n", encoding="utf-8")
    config = Config(**yaml.safe_load(text))
    planned = {run.run_id.removeprefix(f"{MEDIUM}_"): run for run in plan_runs(config)}
    names = [f"{beta}_g{gamma}_in" for beta in ("bp00", "bp30") for gamma in GAMMAS]
    runs = [planned[f"{name}{rod}"] for rod in ("", "_rod") for name in names]
    raw = root / "raw" / "paper"
    for run in runs:
        faults = [word for name, word in BROKEN.items() if run.run_id == f"{MEDIUM}_{name}"]
        for name, content in run_logs(run, config, 2013, tuple(faults)).items():
            (raw / name).parent.mkdir(parents=True, exist_ok=True)
            if content is not None and run.run_id != NO_TARE:
                (raw / name).write_bytes(content)
    (raw / "runs.csv").write_text(sheet_text(runs, {}), encoding="utf-8")
    campaign = load_campaign(path)
    traces, status, of_ingest = ingest_medium(campaign, MEDIUM)
    tared, tares, of_tare = tare_medium(campaign, MEDIUM, traces, status)
    fits, windows, of_slopes = fit_medium(campaign, MEDIUM, status, tared, tares)
    samples = stress_samples(campaign, tared, windows, fits)
    stages = {"ingest": of_ingest, "tare": of_tare, "slopes": of_slopes}
    flags = Flags(*(flag_table(MEDIUM, stage, book.flags) for stage, book in stages.items()))
    figure = draw_quality(samples, fits, flags, "poppy seeds, loose")[0]
    figure.savefig(png, dpi=110, bbox_inches="tight", metadata={"Software": None})
    shown = {f"{MEDIUM}_{name}": rf"$\gamma$ = {gamma}" for name, gamma in PUSHES.items()}
    png.with_name("push.svg").write_bytes(svg(push(samples, fits, shown)))


def write(folder: Path) -> None:
    """Write the sheet and the three pushes into a folder."""
    with tempfile.TemporaryDirectory() as place:
        draw(Path(place), folder / NAME)
