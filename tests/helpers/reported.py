"""The files of `../shared/data/reported`, and a campaign of one push around one of them."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from rigroom import chain
from shared_data import REPORTED

from rftfit.campaign.config import ForceLog, MotionLog
from rftfit.campaign.load import load_campaign
from rftfit.logs.inspect import Survey, config_block, recognised, recording, survey_file, together
from rftfit.logs.registry import source_reader
from rftfit.measure.log_columns import columns_asked, map_columns

UNITS = {
    **dict.fromkeys(("F1", "F2", "F3"), "N"),
    **dict.fromkeys(("T1", "T2", "T3"), "N m"),
    **dict.fromkeys(("x", "z"), "mm"),
    "time": "s",
    "angle": "deg",
    "arm_moving": "",
}
NOBODY = {"constant": 0, "unit": "N"}
SETTINGS = """
title: One push
raw: raw
run_sheet: config/runs.csv
transducer:
  name: a load cell
  range_N: [500, 500, 500]
  axes: {x: "+F1", y: "+F2", z: "+F3"}
arm: {speed_cm_per_s: 0.5, surface_z_mm: 0}
fit: {missing_tare: flag}
container: {length_cm: 30, width_cm: 30, depth_cm: 15}
intruders:
  plate: {shape: disc, diameter_cm: 5, thickness_cm: 0.5}
media:
  sand: {title: a made sand, role: natural_sand, linear_to_cm: 4}
"""


def inspected(path: Path) -> tuple[list[Survey], dict[str, Any]]:
    """Return what `rftfit inspect` finds in a log, and what it proposes for the config, as YAML reads it."""
    log_format = recognised(recording(path))
    surveys, _ = survey_file(log_format.reader, recording(path))
    lines = config_block(
        together(surveys), log_format.reader.name, log_format.text, log_format.options
    )
    return surveys, yaml.load("\n".join(lines), Loader=yaml.CSafeLoader) or {}


def proposal(path: Path) -> dict[str, Any]:
    """Return what `rftfit inspect` proposes for the config."""
    return inspected(path)[1]


def read_by(path: Path, proposed: dict[str, Any]) -> dict[str, Any]:
    """Read a log as `rftfit check` does, by the sections of a config: key to the log."""
    logs = {}
    for key, model in (("force_log", ForceLog), ("motion_log", MotionLog)):
        if key in proposed:
            source: Any = model.model_validate(proposed[key])
            reader = source_reader(source, "rig", key).only(columns_asked(source))
            log = logs[key] = map_columns(reader.load(recording(path)), source, UNITS, key)
            # a time that stays unnamed, since it is too coarse, has none
            names = {name for name in UNITS.keys() & log.columns.keys() if log.units[name]}
            assert {name: log.units[name] for name in names} == {
                name: UNITS[name] for name in names
            }
            assert names >= source.columns.keys() - {"arm_moving"}
    return logs


def alpha_of(folder: Path, path: Path, proposed: dict[str, Any]) -> tuple[float, list[str]]:
    """Return alpha_z of the push, and the codes of the flags of its run; NaN where it is refused."""
    config = yaml.safe_load(SETTINGS) | proposed | {"clock": {"method": "same_clock"}}
    force = config["force_log"].setdefault("columns", {})
    for channel in ("F1", "F2", "F3"):
        force.setdefault(channel, dict(NOBODY))
    (folder / "config").mkdir(parents=True)
    (folder / "raw").mkdir()
    (folder / "raw" / path.name).write_bytes(path.read_bytes())
    (folder / "config" / "config.yaml").write_text(
        yaml.safe_dump(json.loads(json.dumps(config))), encoding="utf-8"
    )
    header = "run_id,kind,medium,intruder,direction,beta_deg,gamma_deg,force_log,motion_log"
    row = f"push,plate,sand,plate,intrusion,0,90,{path.name},{path.name}"
    (folder / "config" / "runs.csv").write_text(f"{header}\n{row}\n", encoding="utf-8")
    results = chain(load_campaign(folder / "config" / "config.yaml"), "sand")
    run = results.run("push")
    assert run["status"] == "read", run["reason"]
    return float(results.fit("push")["alpha_z_N_per_cm3"]), list(results.codes("push"))


def truth() -> dict[str, np.ndarray]:
    """Return the push that the files hold: t in s, z in mm, forces in N."""
    with np.load(REPORTED / "truth.npz") as arrays:
        return {name: arrays[name] for name in arrays}
