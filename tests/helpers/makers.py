"""Makers of logs, of pushes and of campaigns as a user writes them, and the command that runs there.

Nothing here imports an inner name of the program.
"""

import contextlib
import csv
import io
import json
import os
import shutil
import subprocess
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

import numpy as np
import yaml
from forked import snakemake_forked

import rftfit

# --- The one maker of text logs: columns of numbers written as programs write them, then damaged ------------------


@dataclass(frozen=True)
class TextLog:
    """Cells of a log, and how they are written.

    `columns`: Name to the cells of all data lines, numbers or texts. `units`: Of each column, by name.
    `unit_style`: ``brackets`` behind the name, ``row`` below the names, or ``none``. `decimals`: Digits of a number.
    `preamble`: Lines above the names.
    """

    columns: Mapping[str, Sequence[object]]
    units: Mapping[str, str]
    unit_style: str = "brackets"
    delimiter: str = ","
    decimal: str = "."
    decimals: int = 4
    preamble: Sequence[str] = ()
    end: str = "\n"

    def _cell(self, content):
        if isinstance(content, str):
            return content
        return f"{content:.{self.decimals}f}".replace(".", self.decimal)

    @property
    def header(self):
        """Lines above the data."""
        names = [
            f"{name} [{self.units[name]}]"
            if self.unit_style == "brackets" and self.units.get(name)
            else name
            for name in self.columns
        ]
        lines = [*self.preamble, self.delimiter.join(names)]
        if self.unit_style == "row":
            lines.append(self.delimiter.join(self.units.get(name, "") for name in self.columns))
        return lines

    @property
    def rows(self):
        """Data lines without their ends."""
        return [
            self.delimiter.join(map(self._cell, cells))
            for cells in zip(*self.columns.values(), strict=True)
        ]

    def text(self, rows=None):
        """The whole file; `rows`: data lines in place of its own, damaged ones for example."""
        lines = [*self.header, *(self.rows if rows is None else rows)]
        return "".join(f"{line}{self.end}" for line in lines)

    def write(self, path, rows=None, encoding="utf-8"):
        """Write the file and return its path."""
        path.write_bytes(self.text(rows).encode(encoding))
        return path


def replace_cell(row, delimiter, column, cell):
    """Put another cell into a data line."""
    cells = row.split(delimiter)
    cells[column] = cell
    return delimiter.join(cells)


# --- The one maker of pushes: readings of one push of a plate with known alpha, noise, law and faults -------------

LONGEST_S = 19.0
"""From the first to the last reading: rest, 15 cm of way at 1 cm/s, rest."""


@dataclass(frozen=True)
class MadePush:
    """One push of a plate on a straight path, and how its two logs are recorded.

    `alpha_z`, `alpha_x`: N/cm^3. `gamma_deg`: Of the path, 90 straight down. `exponent`: p of stress = alpha depth^p,
    with the stress of p = 1 at 5 cm. `crust_N_per_cm2`: Stress of a crust from the surface on. `rod_N_per_cm`: Force on
    the rod per depth along its path. `surface_mm`: True height of the free surface above 0 of the stage. `noise_N`:
    Standard deviation of a reading. `zero_N`: Reading of both channels in air. `start_s`: Of the clock. `seed`: Of the
    noise, or the generator that goes on from one push to the next. `force_unit`: N, mN, kN or gf. `length_unit`: mm, cm
    or m. `faults`: Reading to the factor or value that replaces the force there, by ``dead`` (all readings that value),
    ``lost`` (these readings are missing) or ``spike`` (these readings have that value).
    """

    alpha_z: float = 0.35
    alpha_x: float = 0.0
    gamma_deg: float = 90.0
    area_cm2: float = 15.0
    exponent: float = 1.0
    crust_N_per_cm2: float = 0.0
    rod_N_per_cm: float = 0.0
    surface_mm: float = 0.0
    noise_N: float = 0.02
    zero_N: float = 0.0
    gain: float = 1.0
    start_s: float = 0.0
    readings_per_s: float = 20.0
    seed: int | np.random.Generator = 1
    force_unit: str = "N"
    length_unit: str = "mm"
    faults: Mapping[str, object] = field(default_factory=dict)

    @property
    def time_s(self):
        """Time of each reading, of both logs."""
        return self.start_s + np.arange(0, LONGEST_S, 1 / self.readings_per_s)

    @property
    def way_cm(self):
        """Way along the path at each reading."""
        return self.way_at(self.time_s)

    def way_at(self, time_s):
        """Way along the path: 2 s of rest, 15 cm at 1 cm/s from 5 cm before 0 of the stage, rest."""
        return np.clip(time_s - self.start_s - 2, 0, 15) - 5

    @property
    def depth_cm(self):
        """Depth of the plate's middle below the surface, 0 above it."""
        below_stage_cm = self.way_cm * np.sin(np.radians(self.gamma_deg))
        return np.maximum(below_stage_cm + self.surface_mm / 10, 0)

    @property
    def stress_N_per_cm2(self):
        """Stress z and x without noise, shape (2, n)."""
        shape = 5.0 * (self.depth_cm / 5.0) ** self.exponent
        crust = self.crust_N_per_cm2 * (self.depth_cm > 0)
        return np.stack([self.alpha_z * shape + crust, self.alpha_x * shape])

    @property
    def forces_N(self):
        """Readings z and x, shape (2, n)."""
        random = np.random.default_rng(self.seed)
        gamma = np.radians(self.gamma_deg)
        rod = self.rod_N_per_cm * np.outer([np.sin(gamma), np.cos(gamma)], self.depth_cm)
        force = self.stress_N_per_cm2 * self.area_cm2 + rod
        noise_x_N, noise_z_N = self.noise_N * random.standard_normal(force.shape)
        force = force + np.stack([noise_z_N, noise_x_N])
        force = self.gain * force + self.zero_N
        if "dead" in self.faults:
            force = np.full_like(force, float(str(self.faults["dead"])))
        spikes = self.faults.get("spike")
        if isinstance(spikes, Mapping):
            force[0, [*spikes]] = [*spikes.values()]
        return force

    def log(self, **layout):
        """Both logs as one text: time in s, forces and positions in the units of the push."""
        gamma = np.radians(self.gamma_deg)
        newton, cm = NEWTONS[self.force_unit], CENTIMETRES[self.length_unit]
        columns = {
            "time": self.time_s,
            "Fx": self.forces_N[1] / newton,
            "Fz": self.forces_N[0] / newton,
            "x": -self.way_cm * np.cos(gamma) / cm,
            "z": -self.way_cm * np.sin(gamma) / cm,
        }
        lost = self.faults.get("lost", ())
        kept = np.setdiff1d(np.arange(self.time_s.size), np.asarray(lost, dtype=int))
        units = {"time": "s", "Fx": self.force_unit, "Fz": self.force_unit}
        units |= dict.fromkeys("xz", self.length_unit)
        return TextLog(
            {name: values[kept] for name, values in columns.items()},
            units,
            **({"decimals": 9} | layout),
        )


NOT_MEASURED = {name: {"constant": 0, "unit": "N"} for name in ("F1", "F2")}
"""Channels of a load cell that feels F3 alone."""


BENCH = """\
title: one cell, one stage
raw: raw
run_sheet: config/runs.csv
clock: {method: same_clock}
transducer: {name: cell, range_N: [500, 500, 500], axes: {x: +F1, y: +F2, z: +F3}}
container: {length_cm: 60, width_cm: 60, depth_cm: 40}
intruders: {plate: {shape: plate, length_cm: 5, width_cm: 3, thickness_cm: 0.4}}
media: {sand: {title: sand}}
fit: {missing_tare: flag}
"""
"""Config of a bench without its logs."""


def bench_config(force_log, motion_log, *, transducer=None, **sections):
    """Config of a bench with one clock, a plate and a bed of sand, whose channels lie along the axes.

    `transducer`: Settings of it beside those that are here, or in their place. `sections`: In place of those that are here.
    """
    config = yaml.safe_load(BENCH) | {"force_log": force_log, "motion_log": motion_log}
    config["transducer"] |= transducer or {}
    return config | sections


def comma_log(**columns):
    """Section of a log with commas between its cells."""
    return {"text": {"delimiter": ","}, "columns": columns}


def config_of_push(time, motion, *, force_unit="N", **sections):
    """Config of a campaign of pushes whose logs `MadePush.log` made, both in one file.

    `time`: Column of the time. `motion`: Columns of the position. `sections`: As of `bench_config`.
    """
    time = {"column": time, "unit": "s"}
    force = {
        "F1": {"column": "Fx", "unit": force_unit},
        "F2": {"constant": 0, "unit": "N"},
        "F3": {"column": "Fz", "unit": force_unit},
    }
    sections = {"fit": {"missing_tare": "none"}} | sections
    return bench_config(comma_log(time=time, **force), comma_log(time=time, **motion), **sections)


def row_of_push(gamma_deg=90, run_id="p", **cells):
    """Row of the run sheet of a push of a level plate, both of whose logs are in one file."""
    row = {"run_id": run_id, "kind": "plate", "medium": "sand", "intruder": "plate"}
    row |= {"direction": "intrusion", "beta_deg": "0", "gamma_deg": str(gamma_deg)}
    return row | {"force_log": f"{run_id}.csv", "motion_log": f"{run_id}.csv"} | cells


NEWTONS = {"N": 1.0, "mN": 1e-3, "kN": 1e3, "gf": 9.80665e-3}
CENTIMETRES = {"mm": 0.1, "cm": 1.0, "m": 100.0}


# --- The maker of campaigns: a folder with config, run sheet and logs, written as a user writes it ----------------
# It uses commands and files alone, so that no change inside the program can break it.


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
        words = [f"--seed={self.seed}", f"--protocol={self.protocol}"]
        words += [f"--media={medium}" for medium in self.media]
        words += [f"--fault={fault}" for fault in self.faults]
        words += [f"--grid={self.grid}"] if self.grid else []
        words += [] if self.tare else ["--no-tare"]
        words += [] if self.legs else ["--no-legs"]
        return words


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
    write_yaml(path, config)
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


class PlainDumper(yaml.SafeDumper):
    """Writes what stands in two places twice, as a user does."""

    def ignore_aliases(self, data):  # noqa: ARG002
        """Name no value to refer to it."""
        return True


def write_yaml(path, values):
    """Write values into a file, whose folder is made, too."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = yaml.dump(values, Dumper=PlainDumper, sort_keys=False, allow_unicode=True)
    path.write_text(text, encoding="utf-8")


def read_rows(sheet):
    """Read the rows of a run sheet, as dicts of text."""
    with sheet.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def write_rows(sheet, rows, names=()):
    """Write a run sheet; its columns are `names` and those of all rows together, in their first order."""
    names = list(dict.fromkeys([*names, *(name for row in rows for name in row)]))
    sheet.parent.mkdir(parents=True, exist_ok=True)
    with sheet.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, names, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def run_targets(folder, targets):
    """Make targets of a campaign by `rftfit.run`, whose processes are forks."""
    with snakemake_forked():
        return rftfit.run(folder, targets, cores=1)


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
        with (
            snakemake_forked(),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(errors),
        ):
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


# --- The command `rftfit` in this process, as the installed program declares it -----------------------------------


def answer_of(*words, folder=None):
    """Run a command; its exit code, standard output and standard error. It never prints a traceback."""
    completed = run_command(folder or Path.cwd(), *map(str, words))
    return completed.returncode, completed.stdout, completed.stderr


def json_of(*words, folder=None):
    """Run a command with ``--json`` that has to end with 0; what it prints, which must be JSON proper."""
    code, out, error = answer_of(*words, "--json", folder=folder)
    assert code == 0, error
    return json.loads(out, parse_constant=_refuse)


def refused(*words, folder=None):
    """Run a command whose input is refused: exit code 2, nothing on standard output; its message."""
    code, out, error = answer_of(*words, folder=folder)
    assert (code, out) == (2, ""), (code, out, error)
    assert error
    return error


def _refuse(constant):
    raise ValueError(f"{constant} is no JSON")


# --- Tables of `tests/helpers/data` and the small logs of `tests/logs/data` ------------------------------------------------------------------------


def data_of(name):
    """Return the content of a table of `tests/helpers/data`."""
    path = Path(__file__).parent / "data" / f"{name}.toml"
    return tomllib.loads(path.read_text("utf-8"))


LOGS = Path(__file__).parents[1] / "logs" / "data"
"""Small logs beside `expected.toml`, which says what each holds."""


@cache
def expected_logs():
    """Return the entries of `expected.toml`, one for each way to read a log."""
    return tomllib.loads((LOGS / "expected.toml").read_text("utf-8"))["log"]


def read_expected(entry):
    """Read a log as its entry of `expected.toml` says."""
    settings = (entry.get(key) for key in ("read_as", "text", "options"))
    return rftfit.read_log(LOGS / entry["file"], *settings)


@cache
def sentence_of(reason):
    """Return the sentence that counts rows left out for a reason, which `expected.toml` names in a word."""
    entry = next(entry for entry in expected_logs() if [*entry.get("dropped", {})] == [reason])
    (sentence,) = read_expected(entry).dropped
    return sentence


# --- The campaigns of `tests/golden`, made by commands ------------------------------------------------------------

GOLDEN = Path(__file__).parents[1] / "golden"
KNOWN_WRONG = GOLDEN / "known_wrong.toml"
SMALL = "poppy-and-sand"
"""Campaign that the fixture `small_made` makes for many tests, with its page."""

TARGETS = (
    "results/alpha_extended.csv",
    "results/ledger.csv",
    "results/reproduction.csv",
    "results/sand_correction.csv",
)
"""Results from which all tables of measurement and model follow, without figures."""
TABLES = "TABLES"
"""Word of a command that stands for `TARGETS`."""


@dataclass(frozen=True)
class GoldenCampaign:
    """A folder of `tests/golden`: config, run sheet, raw files, and what makes the rest."""

    name: str

    @property
    def folder(self):
        """Return the tracked folder."""
        return GOLDEN / self.name

    @property
    def expected(self):
        """Return the tracked folder of expected tables."""
        return self.folder / "expected"

    @property
    def settings(self):
        """Return what `campaign.toml` says."""
        return tomllib.loads((self.folder / "campaign.toml").read_text(encoding="utf-8"))

    def write(self, folder):
        """Write the campaign into a new folder."""
        files = self.folder / "files"
        if files.is_dir():
            shutil.copytree(files, folder, dirs_exist_ok=True)
        config = yaml.safe_load((self.folder / "config.yaml").read_text(encoding="utf-8"))
        sheet, raw, settings = self.folder / "runs.csv", self.folder / "raw", self.settings
        lab, pushes = settings.get("lab"), settings.get("pushes")
        write_campaign(
            folder,
            config,
            rows=read_rows(sheet) if sheet.is_file() else (),
            logs={path.relative_to(raw).as_posix(): path.read_bytes() for path in raw.rglob("*.*")},
            lab=SimulatedLab(**lab) if lab else None,
            pushes=MadePushes(**pushes) if pushes else None,
            edit_rows=self._without_pushes if "without" in settings else None,
        )

    def _without_pushes(self, rows):
        """Leave out the plates at (beta, gamma), or (beta, gamma, depth), that `campaign.toml` lists."""
        left_out = {tuple(push) for push in self.settings["without"]}
        return [row for row in rows if left_out.isdisjoint(_angles_and_depth(row))]

    def make(self, folder):
        """Write the campaign and run its commands; their exit codes and problems are a result, too."""
        self.write(folder)
        self.run_commands(folder)

    def run_commands(self, folder):
        """Run the commands that `campaign.toml` names, else ``rftfit run TABLES``, in a campaign's folder."""
        commands = self.settings.get("commands", [{"words": ["run", TABLES]}])
        (folder / "commands").mkdir()
        endings = []
        for command in commands:
            words = [*_with_targets(command["words"])]
            completed = run_command(folder, *words)
            problems = _problems(completed.stdout) if "--json" in words else []
            ending = {"command": " ".join(words), "exit_code": completed.returncode}
            endings.append(ending | {"problems": problems})
            unexpected = completed.returncode != command.get("exit_code", 0)
            assert not unexpected, completed.stdout + completed.stderr
        (folder / "commands" / "endings.json").write_text(json.dumps(endings), encoding="utf-8")


def golden_campaigns():
    """Return all campaigns of `tests/golden`, in the order of their names."""
    return [GoldenCampaign(path.parent.name) for path in sorted(GOLDEN.glob("*/campaign.toml"))]


def _with_targets(words):
    for word in words:
        yield from TARGETS if word == TABLES else (word,)


def _angles_and_depth(row):
    """Return (beta, gamma) of a plate, and (beta, gamma, depth) of one that moved level."""
    if row["kind"] != "plate":
        return ()
    angles = float(row["beta_deg"]), float(row["gamma_deg"])
    return (angles, (*angles, float(row["depth_cm"]))) if row["depth_cm"] else (angles,)


def _problems(printed):
    """Return code, severity and place of each problem that `check --json` printed, without its sentences."""
    names = ("code", "severity", "place")
    return [{name: problem[name] for name in names} for problem in json.loads(printed)["problems"]]
