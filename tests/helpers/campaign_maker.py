"""The maker of campaigns: a folder with config, run sheet and logs, written as a user writes it.

It uses commands and files alone, so that no change inside the program can break it.
"""

import contextlib
import csv
import io
import os
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

import numpy as np
import yaml
from log_maker import TextLog
from push_maker import LONGEST_S, NEWTONS, MadePush


@dataclass(frozen=True)
class SimulatedLab:
    """Options of `rftfit reenact`, which writes logs and run sheet from published measurements.

    Attributes
    ----------
    seed : int
        Same seed, same bytes.
    media : tuple of str
        Media of the config; none: all that are published.
    grid : str
        Directions of the plates, as for ``--grid``; empty: those of the config or the paper.
    protocol : str
        How a run is recorded, as for ``--protocol``.
    faults : tuple of str
        ``NAME`` or ``NAME:RUN_ID``, as for ``--fault``.
    tare, legs : bool
        With runs of the rod alone and of legs in air; with legs.
    """

    seed: int = 2013
    media: tuple[str, ...] = ()
    grid: str = ""
    protocol: str = "paper"
    faults: tuple[str, ...] = ()
    tare: bool = True
    legs: bool = True

    def words(self):
        """Return the words of the command."""
        chosen = ["--seed", str(self.seed), "--protocol", self.protocol]
        chosen += [word for medium in self.media for word in ("--media", medium)]
        chosen += [word for fault in self.faults for word in ("--fault", fault)]
        # one word, since a grid may begin with a minus sign
        chosen += [f"--grid={self.grid}"] if self.grid else []
        chosen += [] if self.tare else ["--no-tare"]
        chosen += [] if self.legs else ["--no-legs"]
        return chosen


@dataclass(frozen=True)
class MadePushes:
    """Pushes of a plate on a rod along straight paths, whose alpha is known.

    Alpha is a part of the published generic profile. Each row of the run sheet gives one force log
    (time in s, forces) and one stage log (time in ms, positions in mm); rods feel no sand.

    Attributes
    ----------
    seed : int
        Same seed, same bytes.
    alpha_scale : float
        Size of alpha, N/cm^3 for 1 of the generic profile.
    area_cm2 : float
        Area of the plate.
    exponent : float
        p of stress = alpha depth^p, with the stress of p = 1 at a depth of 5 cm.
    bed_percent : float
        Standard deviation of the force from one prepared bed to the next.
    noise_N : float
        Standard deviation of a reading.
    rod_N_per_cm : float
        Force on the rod per depth along its path.
    clock_offset_s : dict of float
        Stage clock less force clock at time 0, s, by label of the column `session`; none: one clock.
    gain : dict of float
        Factor of all readings by label of the column `operator`; none: 1.
    clock_drift : float
        Relative difference of the clocks' rates.
    surface_mm : float
        True height of the free surface above 0 of the stage.
    force_unit : str
        Unit of the force log: N or gf.
    """

    seed: int = 5
    alpha_scale: float = 0.4
    area_cm2: float = 15.0
    exponent: float = 1.0
    bed_percent: float = 3.0
    noise_N: float = 0.02
    rod_N_per_cm: float = 0.06
    clock_offset_s: Mapping[str, float] = field(default_factory=dict)
    gain: Mapping[str, float] = field(default_factory=dict)
    clock_drift: float = 0.0
    surface_mm: float = 0.0
    force_unit: str = "N"

    def logs(self, rows):
        """Make the logs of the rows of a run sheet, as bytes by file name."""
        random = np.random.default_rng(self.seed)
        content = {}
        for place, row in enumerate(rows):
            push = self._push(row, 600.0 + 150.0 * place, random)
            content[row["force_log"]] = self._force_log(push).text().encode()
            content[row["motion_log"]] = self._stage_log(push, row).text().encode()
        return content

    def _push(self, row, start_s, random):
        bed = 1 + self.bed_percent / 100 * random.standard_normal()
        scale = self.alpha_scale * bed if row["kind"] == "plate" else 0.0
        alpha_z, alpha_x = generic_alpha(float(row["beta_deg"] or 0), float(row["gamma_deg"]))
        return MadePush(
            alpha_z=scale * alpha_z,
            alpha_x=scale * alpha_x,
            gamma_deg=float(row["gamma_deg"]),
            area_cm2=self.area_cm2,
            exponent=self.exponent,
            rod_N_per_cm=self.rod_N_per_cm,
            surface_mm=self.surface_mm,
            noise_N=self.noise_N,
            gain=self.gain.get(row.get("operator", ""), 1.0),
            start_s=start_s,
            seed=random,
        )

    def _force_log(self, push):
        force_z_N, force_x_N = push.forces_N
        newton = NEWTONS[self.force_unit]
        columns = {
            "time_s": push.time_s,
            "force_x": force_x_N / newton,
            "force_z": force_z_N / newton,
        }
        return TextLog(columns, {})

    def _stage_log(self, push, row):
        """Begin a second before the force log and end a second after it, by another clock."""
        time_s = push.start_s + np.arange(-1, LONGEST_S + 1, 1 / push.readings_per_s)
        offset_s = self.clock_offset_s.get(row.get("session", ""), 0.0)
        along_mm = 10 * push.way_at(time_s)
        gamma = np.radians(push.gamma_deg)
        columns = {
            "millis": 1000 * (time_s * (1 + self.clock_drift) + offset_s),
            "x_mm": -along_mm * np.cos(gamma),
            "z_mm": -along_mm * np.sin(gamma),
            "along_mm": along_mm,
        }
        return TextLog(columns, {}, decimals=3)


def generic_alpha(beta_deg, gamma_deg):
    """Return alpha_z and alpha_x of the published generic profile (nine terms)."""
    b, g = np.radians(beta_deg), np.radians(gamma_deg)
    alpha_z = 0.206 + 0.169 * np.cos(2 * b) + 0.212 * np.sin(2 * b + g)
    alpha_z += 0.358 * np.sin(g) + 0.055 * np.sin(g - 2 * b)
    alpha_x = 0.253 * np.cos(g) - 0.124 * np.cos(2 * b + g) + 0.007 * np.cos(g - 2 * b)
    return alpha_z, alpha_x + 0.088 * np.sin(2 * b)


def write_campaign(folder, config, *, rows=(), logs=None, lab=None, pushes=None, edit_rows=None):
    """Write a campaign into a folder, by files and commands.

    Parameters
    ----------
    folder : Path
        Made if need be.
    config : dict
        Values of ``config/config.yaml``.
    rows : sequence of dict, optional
        Rows of the run sheet, which goes where the config says.
    logs : dict, optional
        Bytes or text of files by their path below the raw folder.
    lab : SimulatedLab, optional
        Writes logs and run sheet by ``rftfit reenact``.
    pushes : MadePushes, optional
        Makes the logs of `rows`.
    edit_rows : callable, optional
        Gets the rows of the run sheet as it was written, and returns those that replace them.

    Returns
    -------
    Path
        The config.
    """
    folder = Path(folder)
    path = folder / "config" / "config.yaml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump(config, sort_keys=False, allow_unicode=True), encoding="utf-8")
    raw = folder / config["raw"]
    raw.mkdir(parents=True, exist_ok=True)
    sheet = folder / config["run_sheet"]
    if lab is not None:
        run_command(folder, "reenact", *lab.words(), expected_code=0)
    if rows:
        write_rows(sheet, rows)
    contents = (pushes.logs(rows) if pushes else {}) | (logs or {})
    for name, content in contents.items():
        target = raw / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content.encode() if isinstance(content, str) else content)
    if edit_rows is not None:
        write_rows(sheet, edit_rows(read_rows(sheet)))
    return path


def read_rows(sheet):
    """Read the rows of a run sheet, as dicts of text."""
    with sheet.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def write_rows(sheet, rows):
    """Write a run sheet; its columns are those of all rows together, in their first order."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    sheet.parent.mkdir(parents=True, exist_ok=True)
    with sheet.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, names, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def run_command(folder, *words, expected_code=None):
    """Run ``rftfit`` with these words in this process, from a campaign's folder.

    Returns
    -------
    subprocess.CompletedProcess
        With exit code, output and errors as text.
    """
    out, errors, before = io.StringIO(), io.StringIO(), Path.cwd()
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
            code = _command()([*words])
    finally:
        os.chdir(before)
    completed = subprocess.CompletedProcess(words, code, out.getvalue(), errors.getvalue())
    printed = completed.stdout + completed.stderr
    assert "Traceback" not in printed, printed
    assert expected_code in (None, code), f"exit code {code}: rftfit {' '.join(words)}\n{printed}"
    return completed


@cache
def _command():
    """Return the function behind the command ``rftfit``, as the installed package declares it."""
    (script,) = entry_points(group="console_scripts", name="rftfit")
    return script.load()
