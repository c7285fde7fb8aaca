"""Campaigns of other labs, and mistakes in sheet, config and logs, with what check and stages say of them."""

import copy
import json
import random
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import yaml
from campaigns import RigRoom, run_rules
from coverage_levels import measured
from makers import answer_of, data_of, read_rows, write_campaign
from paper import NOTHING, disturbed_logs, enact, paper_values

import rftfit
from rftfit.campaign.config import Config
from rftfit.campaign.load import load_campaign
from rftfit.checks.verdict import Verdict, verdict_on
from rftfit.lab.enact import prepare, run_logs
from rftfit.lab.plan import PlannedRun, parse_directions
from rftfit.lab.truth import table_s5
from rftfit.lab.write import format_numbers, sheet_text
from rftfit.measure.alpha import column
from rftfit.measure.flags import Flags
from rftfit.page.outcome import outcome_of_runs
from rftfit.workflow import measure as measure_stages

# --- What `rftfit check` says of a campaign beside what its stages do with it -------------------------------------

REFUSED, NOTHING_LEFT, SOME, ALL = "refused", "nothing left", "some dropped", "all used"


def compare(folder, stages=()):
    """Check and run a campaign, by default all of it, and say in a word how it went.

    Raises
    ------
    AssertionError
        If `check` passes what the stages refuse, or drops what they use, or one of them breaks.
    """
    code, printed, _ = answer_of("check", "--json", folder=folder.root)
    checked = json.loads(printed)
    problems = checked["problems"]
    if checked["campaign"] is None or any(one["code"] == "logs.reader" for one in problems):
        assert code == 2, printed
        return REFUSED
    run_rules(folder.config, *stages)
    results = rftfit.open(folder.root)
    campaign = results.campaign
    rows_of_sheet = {problem["place"]["row"] for problem in problems}
    excluded = [run for run in campaign.runs if run.excluded]
    empty = False
    lost: set[str] = set()
    for medium in campaign.media_with_runs:
        reasons = _reasons(results, medium)
        runs = [run for run in campaign.runs_of(medium) if not run.excluded]
        lost_of_medium = {run.run_id for run in runs if reasons[run.run_id]}
        with_logs = {r.run_id for r in runs if _has_logs(campaign.raw, r)}
        assert _count_dropped(problems, medium) == len(lost_of_medium & with_logs), (
            sorted(lost_of_medium & with_logs),
            printed,
        )
        assert {r.row for r in runs if r.run_id in lost_of_medium - with_logs} <= rows_of_sheet
        plates_and_legs = {run.run_id for run in runs if run.kind in ("plate", "leg")}
        empty |= (
            bool(lost_of_medium & with_logs)
            and (plates_and_legs & with_logs or with_logs) <= lost_of_medium
        )
        lost |= lost_of_medium
    assert code == (2 if empty else 0), printed
    # and the page tells of the same runs
    dropped = {str(row["run_id"]) for row in outcome_of_runs(results).dropped}
    assert lost == dropped - {run.run_id for run in (*campaign.unassigned_air_runs, *excluded)}
    return NOTHING_LEFT if empty else SOME if lost else ALL


def _has_logs(raw, run):
    names = (run.force_log, run.motion_log, run.zero_log)
    return all((raw / name).is_file() for name in names if name)


def _reasons(results, medium):
    """Why each run gave no number, by the tables of the stages; empty where it gave one."""
    reasons: dict[str, str] = {}
    for name in ("runs", "tares", "fits"):
        table = results.table(f"{name}/{medium}.csv")
        reasons |= dict(zip(table["run_id"], table["reason"], strict=True))
    return reasons


def _count_dropped(problems, medium):
    """How many runs of a medium `check` says would be dropped."""
    places = [problem["place"]["file"] for problem in problems if problem["code"] == "logs.refused"]
    counts = (re.match(rf"{medium}, (\d+) ", place) for place in places)
    return sum(int(count[1]) for count in counts if count)


# --- Campaigns of other labs: grids and protocols that are not the paper's, re-enacted ----------------------------

_DATA = data_of("mistakes")
GRIDS = _DATA["grids"]
"""Directions, as `rftfit reenact --grid` takes them."""
SECTIONS = _DATA["sections"]
"""Sections of the config by the protocol that needs them."""
MEDIUM = "poppy_CP"
CELLS_OF_ONE = 0.8
"""Part of the numbers of one small campaign whose 95 % intervals must hold the truth."""


@dataclass(frozen=True)
class Case:
    """One campaign."""

    grid: str
    protocol: str
    tare: bool = True
    legs: bool = False
    dialect: str = "rig"

    def __str__(self):
        suffix = ("" if self.tare else ", no tare") + (", legs" if self.legs else "")
        suffix += "" if self.dialect == "rig" else f", {self.dialect}"
        return f"{self.grid}, {self.protocol}{suffix}"


CASES = [Case(**case) for case in _DATA["cases"]]


def make(folder, case):
    """Write the campaign of a case: configuration, logs and run sheet."""
    values = paper_values("robot")
    values["media"] = {MEDIUM: {"title": "close poppy seeds", "published_as": MEDIUM}}
    values |= SECTIONS[case.protocol]
    values["fit"]["missing_tare"] = "flag"
    if case.dialect == "delimited":
        del values["dialect"]
        values |= {log: {"text": {"delimiter": ","}} for log in ("force_log", "motion_log")}
    else:
        values["dialect"] = case.dialect
    cells = parse_directions(GRIDS[case.grid], 2013)
    enact(folder, values, protocol=case.protocol, directions=cells, tare=case.tare, legs=case.legs)


def judge(folder, case, held):
    """What came out, in words, and what is wrong with it; `held` takes which numbers hold the truth."""
    planned_directions = set(parse_directions(GRIDS[case.grid], 2013))
    table = pd.read_csv(folder / "results" / "alpha" / f"{MEDIUM}.csv")
    measured_directions = set(zip(table["beta_deg"], table["gamma_deg"], strict=True))
    wrong = (
        []
        if measured_directions == planned_directions
        else [f"{len(planned_directions - measured_directions)} directions without a row"]
    )
    if not (folder / "results" / "report.html").is_file():
        wrong.append("no page")
    inside, off = [], []
    for row in table.to_dict("records"):
        for c, true in zip("zx", table_s5(MEDIUM, row["beta_deg"], row["gamma_deg"]), strict=True):
            name = f"alpha_{c}{{}}_N_per_cm3"
            inside.append(row[name.format("_lo")] <= true <= row[name.format("_hi")])
            off.append(abs(row[name.format("")] - true))
    share = float(np.mean(inside))
    held += inside if case.tare else []
    fits, flags = (
        pd.read_csv(folder / "results" / name / f"{MEDIUM}.csv") for name in ("fits", "flags")
    )
    bare = set(flags.loc[flags["code"] == "no-tare", "run_id"])
    if case.tare and share < CELLS_OF_ONE:
        wrong.append("too few cells hold the truth")
    if not case.tare and not bare.issuperset(fits["run_id"]):
        wrong.append("a run without a tare is not flagged")
    if np.isnan(off).any():
        wrong.append(f"{int(np.isnan(off).sum()) // 2} cells without alpha")
    return (
        f"{len(table)} cells, {100 * share:.0f} % hold the truth, worst off {max(off):.4f}",
        wrong,
    )


# --- Campaigns with mistakes in sheet, config and logs, or in a table of stress -----------------------------------

RUNS = (
    "poppy_LP_bp30_g45_in",
    "poppy_LP_bp00_g90_in",
    "poppy_LP_bp00_g45_ex",
    "poppy_LP_bm30_g00_h254",
    "poppy_LP_c_leg",
    "yuma_bp00_g90_in",
)
MEASURED = (
    "ingest",
    "tare",
    "slopes",
    "checks",
    "legs",
    "symmetry",
    "fourier",
    "scaling",
    "ledger",
)
"""Stages of which the short test is made."""

Cells = dict[str, str]


@dataclass
class Written:
    """A campaign as it is on the disk: configuration, rows of the sheet, and logs by their paths.

    A table of stress has no sheet: it counts as a log.
    """

    config: dict[str, Any]
    rows: list[Cells]
    logs: dict[str, bytes]
    mistakes: list[str] = field(default_factory=list)

    @classmethod
    def read(cls, root):
        """Read a campaign that was made in a folder."""
        raw = root / "raw" / "paper"
        config = yaml.safe_load((root / "config" / "config.yaml").read_text(encoding="utf-8"))
        config["fourier"]["draws"] = 200
        rows = read_rows(raw / "runs.csv")
        logs = {
            path.relative_to(raw).as_posix(): path.read_bytes()
            for path in sorted(raw.rglob("*"))
            if path.is_file() and path.name != "runs.csv"
        }
        return cls(config, rows, logs)

    def write(self, root):
        """Write it into a folder."""
        write_campaign(root, self.config, rows=self.rows, logs=self.logs)


@cache
def bases():
    """Small campaigns that are right: the paper's protocol with a leg and a sand, and two others."""
    campaigns = {}
    with TemporaryDirectory() as folder:
        RigRoom(Path(folder)).add(*RUNS).write()
        campaigns["paper"] = Written.read(Path(folder))
    for protocol in ("one-file", "separate-zero"):
        with TemporaryDirectory() as folder:
            make(Path(folder), Case("one-push", protocol))
            campaigns[protocol] = Written.read(Path(folder))
    campaigns["table"] = Written(
        {
            "title": "a table",
            "raw": "raw/paper",
            "run_sheet": "raw/paper/stress.csv",
            "table": {
                "holds": "stress",
                "angle_unit": "deg",
                "depth_unit": "cm",
                "stress_unit": "N/cm^2",
            },
            "media": {
                "sand": {"title": "sand", "role": "laboratory"},
                "dune": {"title": "dune", "role": "natural_sand"},
            },
            "fit": {"submergence_cm": 0.5, "max_depth_cm": 7.0},
            "fourier": {"draws": 200},
        },
        [],
        {"stress.csv": _stress().encode()},
    )
    return campaigns


def _stress():
    """A table of stress of two media: pushes, one with its way back, pulls, a level run, and one left out."""
    lines = [
        "medium,beta_deg,gamma_deg,depth_cm,stress_z_N_per_cm2,stress_x_N_per_cm2,run_id,excluded,reason"
    ]
    cells = [("sand", b, g) for b in (-60, 0, 30, 60) for g in (-90, -45, 45, 90)] + [
        ("dune", 0, 90)
    ]
    for number, (medium, beta, gamma) in enumerate(cells):
        depths_down = [0.5 * step for step in range(1, 17)]
        depths = (
            depths_down + depths_down[::-1]
            if number == 2
            else depths_down[:: 1 if gamma > 0 else -1]
        )
        end = ",yes,a stone" if number == 5 else ",,"
        alpha = table_s5("poppy_LP", beta, gamma)
        for place, depth in enumerate(depths):
            noise = 0.004 * ((7 * place) % 5 - 2)
            stress = ",".join(f"{a * depth + noise:.4f}" for a in alpha)
            lines.append(f"{medium},{beta},{gamma},{depth},{stress},r{number}{end}")
    return "\n".join(lines) + "\n"


def mutated(luck):
    """Make one to three mistakes in one of the campaigns."""
    written = copy.deepcopy(bases()[luck.choice(list(bases()))])
    for _ in range(luck.choice([1, 1, 2, 3])):
        kinds = [_of_log, _of_log, _of_log, _of_cell if written.rows else _of_log, _of_setting]
        written.mistakes.append(luck.choice(kinds)(luck, written))
    return written


def _of_cell(luck, written):
    row = luck.choice(written.rows)
    column = luck.choice(list(row))
    cells_of_column = [sheet_row[column] for sheet_row in written.rows]
    words = [*_DATA["cells"], luck.choice(list(written.logs))]
    row[column] = luck.choice([*cells_of_column, *words])
    return f"{row['run_id']}, {column}: {row[column]!r}"


def _of_setting(luck, written):
    section: Any = written.config
    path = []
    while True:
        keys = range(len(section)) if isinstance(section, list) else sorted(section)
        key = luck.choice([key for key in keys if key not in ("title", "raw", "run_sheet")])
        path.append(str(key))
        if not isinstance(section[key], dict | list) or not section[key]:
            break
        section = section[key]
    value = section[key]
    if isinstance(value, bool) or value is None:
        section[key] = luck.choice([True, False, None, 1.0])
    elif isinstance(value, int | float):
        section[key] = luck.choice([0, 0.1, 10, -1, 1000, 1e-6]) * (value or 1)
    else:
        section[key] = luck.choice(_DATA["settings"])
    return f"{'.'.join(path)}: {section[key]!r}"


def _of_log(luck, written):
    name = luck.choice([name for name in written.logs if not name.endswith("REENACTED.txt")])
    damage = luck.choice([*DAMAGES])
    lines = written.logs[name].decode().splitlines()
    top = next((i + 1 for i, line in enumerate(lines) if line.startswith(("time", "medium"))), 0)
    if len(lines) - top < 10:
        return f"{name}: spoiled already"
    if damage == "another":
        written.logs[name] = written.logs[luck.choice(list(written.logs))]
    else:
        body = DAMAGES[damage](luck, [line.split(",") for line in lines[top:]])
        head = [] if damage == "nothing" else lines[:top]
        if damage == "unit":
            old, new = luck.choice(_DATA["names"])
            head = [line.replace(old, new) for line in head]
        written.logs[name] = "\n".join([*head, *map(",".join, body)]).encode() + b"\n"
    return f"{name}: {damage}"


def _hole(luck, rows):
    index = luck.randrange(len(rows))
    return rows[:index] + rows[index + luck.choice([1, 30, 300]) :]


def _twice(luck, rows):
    index = luck.randrange(len(rows))
    return rows[:index] + [row for row in rows[index:] for _ in range(2)]


def _swapped(luck, rows):
    first, second = luck.sample(range(len(rows[0])), 2)
    for row in rows:
        row[first], row[second] = row[second], row[first]
    return rows


def _scaled(luck, rows):
    column, factor = luck.randrange(len(rows[0])), luck.choice([-1.0, 0.0, 1000.0, 0.001])
    for row in rows:
        with suppress(ValueError):
            row[column] = repr(float(row[column]) * factor)
    return rows


def _spoiled(luck, rows):
    column = luck.randrange(len(rows[0]))
    word = luck.choice(_DATA["words"])
    share = luck.choice([1.0, 0.5, 0.01])
    first = luck.randrange(len(rows))
    for row in rows[first : first + max(1, int(share * len(rows)))]:
        row[column] = word
    return rows


def _shorter(luck, rows):
    column = luck.randrange(len(rows[0]))
    return [row[:column] + row[column + 1 :] for row in rows]


DAMAGES: dict[str, Callable[[random.Random, list[list[str]]], list[list[str]]]] = {
    "cut": lambda luck, rows: rows[: luck.randrange(len(rows))],
    "late": lambda luck, rows: rows[luck.randrange(len(rows)) :],
    "hole": _hole,
    "twice": _twice,
    "swapped": _swapped,
    "scaled": _scaled,
    "spoiled": _spoiled,
    "backwards": lambda _, rows: rows[::-1],
    "shorter": _shorter,
    "nothing": lambda *_: [],
    "header": lambda *_: [],
    "another": lambda _, rows: rows,
    "unit": lambda _, rows: rows,
}
"""What is done to the rows of a log; `another` and `unit` change something else of it."""


# --- Mistakes of a lab in the files of a re-enacted campaign: logs, run sheet, configuration ----------------------

Luck = np.random.Generator

CHANNELS = {"x": 3, "z": 4}
"""Column of the force log that the demonstration's mount has along x and z: F2 and F3, both turned."""
LEAST_OFF = 0.005
"""Of alpha: nearer to the truth than this is not wrong, N/cm^3."""
NARROWER, EQUAL = 1 / 3, 1e-6
"""Shares by which an interval becomes narrower: less than the first comes with alpha itself, since most errors are
relative to it or to its change from cell to cell."""
POUND_N = 4.4482216152605
OTHER = {"poppy_CP": "glass0.3mm_LP"}
"""Another medium of the same lab, by medium; else `poppy_CP`."""


def enacted(
    medium, seed, errors, directions=None, repeats=1, sizes=NOTHING, protocol="paper", tare=True
):
    """Re-enact the plates of a medium in memory, the sheet in the order of time.

    `errors`: the section; None leaves it out. `repeats`: of each plate run, with one rod run for all.
    `sizes`: of disturbances.
    """
    values = paper_values("robot", "errors")
    values["media"] = {medium: values["media"][medium]}
    values["intruders"] = {"plate": values["intruders"]["plate"]}
    values |= {} if errors is None else {"errors": dict(errors)}
    values |= SECTIONS[protocol]
    values["fit"]["missing_tare"] = "refuse" if tare else "flag"
    config = Config.model_validate(values)
    runs = []
    reenactment = prepare(
        config, media=[medium], directions=directions, protocol=protocol, tare=tare, legs=False
    )
    for run in reenactment.runs:
        shared = replace(run, tare_shared=run.kind == "plate" and repeats > 1)
        repeat_numbers = range(2, repeats + 1) if run.kind == "plate" else ()
        runs += [
            shared,
            *(
                replace(
                    shared, run_id=f"{run.run_id}_{number}", clock_s=run.clock_s + 40 * (number - 1)
                )
                for number in repeat_numbers
            ),
        ]
    runs.sort(key=lambda run: run.clock_s)
    logs: dict[str, bytes | None] = {}
    for run in runs:
        logs |= disturbed_logs(run, config, seed, sizes, protocol=protocol)
    lines = [line.split(",") for line in sheet_text(runs, {}).splitlines()]
    rows = [dict(zip(lines[0], line, strict=True)) for line in lines[1:]]
    return Written(values, rows, {name: text for name, text in logs.items() if text is not None})


def stated(sizes=None):
    """Return the section `errors` of the demonstration, all 0 but what is given."""
    return {**paper_values()["errors"], **(sizes or {})}


def some(rows, share, luck, where="random"):
    """Return a share of the rows, anywhere or in a `stretch`."""
    count = round(share * len(rows))
    if where == "stretch":
        first = int(luck.integers(len(rows) - count + 1))
        return rows[first : first + count]
    return [rows[place] for place in sorted(luck.permutation(len(rows))[:count])]


def plates(written):
    """Return the rows of plates."""
    return [row for row in written.rows if row["kind"] == "plate"]


def one_push(written):
    """Return the first row of a level plate that is pushed straight down."""
    return next(
        row
        for row in plates(written)
        if (row["beta_deg"], row["gamma_deg"], row["direction"]) == ("0", "90", "intrusion")
    )


def one_slanted(written, luck):
    """Return a row of a plate that is pushed along a slanted path."""
    rows = [
        row
        for row in plates(written)
        if row["direction"] == "intrusion" and 20 < float(row["gamma_deg"]) < 80
    ]
    return rows[int(luck.integers(len(rows)))]


def change(written, name, transform):
    """Change the columns of a log, in place or by those that `transform` returns."""
    text = written.logs[name].decode()
    start = text.index("\n", text.index("time_s")) + 1
    body = text[start:]
    decimals = [len(cell.partition(".")[2]) for cell in body[: body.index("\n")].split(",")]
    values = np.array(body.replace("\n", ",").split(",")[:-1], float)
    columns = values.reshape(-1, len(decimals)).T.copy()
    changed = transform(columns)
    columns = columns if changed is None else changed
    written.logs[name] = (text[:start] + format_numbers(list(columns), decimals)).encode()


def of_logs(written, rows, transform, log="force_log"):
    """Change one log of each row; the run_ids."""
    for row in rows:
        change(written, row[log], transform)
    return [row["run_id"] for row in rows]


def dead(written, luck, axis, share=1, where="random", noise_N=0.02):
    """Let a channel read 1.2 N and noise."""

    def transform(log):
        log[CHANNELS[axis]] = 1.2 + noise_N * luck.standard_normal(log.shape[1])

    return of_logs(written, some(written.rows, share, luck, where), transform)


def gain(written, luck, axis, factor, share=1, where="random"):
    """Multiply a channel; a factor of -1 is a reversed wire."""

    def transform(log):
        log[CHANNELS[axis]] *= factor

    return of_logs(written, some(written.rows, share, luck, where), transform)


def turned(written, _, degrees):
    """Turn the mount by so much more than the configuration says."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))

    def transform(log):
        x, z = log[CHANNELS["x"]].copy(), log[CHANNELS["z"]].copy()
        log[CHANNELS["x"]], log[CHANNELS["z"]] = c * x - s * z, s * x + c * z

    return of_logs(written, written.rows, transform)


def exchanged_channels(written, _):
    """Exchange the wires of x and z."""

    def transform(log):
        log[[*CHANNELS.values()]] = log[[*CHANNELS.values()][::-1]]

    return of_logs(written, written.rows, transform)


def clipped(written, _, newtons):
    """Cut both channels off."""

    def transform(log):
        channel_rows = [*CHANNELS.values()]
        log[channel_rows] = log[channel_rows].clip(-newtons, newtons)

    return of_logs(written, written.rows, transform)


def drift(written, _, axis, newtons_per_s):
    """Let a channel drift in runs of plates."""

    def transform(log):
        log[CHANNELS[axis]] += newtons_per_s * (log[0] - log[0, 0])

    return of_logs(written, plates(written), transform)


def late(written, luck, seconds, share=1, where="random"):
    """Let the channels lag behind the sync line."""
    count = round(100 * seconds)

    def transform(log):
        log[2:] = np.hstack([np.repeat(log[2:, :1], count, axis=1), log[2:, :-count]])

    return of_logs(written, some(written.rows, share, luck, where), transform)


def surface(written, luck, mm, share=1, where="random"):
    """Let the free surface be lower than the arm's z says, by so much."""

    def transform(log):
        log[2] -= mm

    return of_logs(written, some(written.rows, share, luck, where), transform, "motion_log")


def pounds(written, luck):
    """Write one run in lbf under a heading of newtons."""

    def transform(log):
        log[2:] /= POUND_N

    return of_logs(written, [one_slanted(written, luck)], transform)


def one_off(written, luck, percent):
    """Make the force on one of several repeats larger by so much; its zero stays."""

    def transform(log):
        zero = log[2:, :100].mean(axis=1, keepdims=True)
        log[2:] = zero + (log[2:] - zero) * (1 + percent / 100)

    return of_logs(written, [one_slanted(written, luck)], transform)


LOGS = ("force_log", "motion_log")


def swapped(written, luck, count=None, where="random"):
    """Exchange the logs of some plates with those of their rods; `count`: of how many, default: of all."""
    rods = {row["run_id"]: row for row in written.rows}
    row_of_tare = {row["tare_run"]: row for row in plates(written)}  # one of several repeats
    rows = [*row_of_tare.values()]
    chosen = some(rows, (count or len(rows)) / len(rows), luck, where)
    for row in chosen:
        rod = rods[row["tare_run"]]
        for name in LOGS:
            row[name], rod[name] = rod[name], row[name]
    return [row["run_id"] for row in chosen]


def another_run(written, luck, in_other_medium=False, turn_deg=0):
    """Make one run in another medium, or with the plate at another angle than sheet and arm say."""
    row = one_slanted(written, luck)
    medium = row["medium"]
    beta = float(row["beta_deg"])
    run = PlannedRun(
        row["run_id"],
        "plate",
        medium,
        OTHER.get(medium, "poppy_CP") if in_other_medium else medium,
        "plate",
        row["direction"],
        beta + (turn_deg if beta <= 0 else -turn_deg),
        float(row["gamma_deg"]),
        clock_s=50_000.0,
    )
    logs = run_logs(run, Config.model_validate(written.config), int(luck.integers(1000)))
    for name in LOGS:
        written.logs[row[name]] = logs[getattr(run, name)] or b""

    def transform(log):
        log[3] += beta - (run.beta_deg or 0)

    return of_logs(written, [row], transform, "motion_log")


def copies(written, _, change_of_log=""):
    """File four copies of a straight push as its repeats, each changed by its number."""
    first = one_push(written)
    for number in range(1, 5):
        row = first | {"run_id": f"{first['run_id']}_copy{number}"}
        for name in LOGS:
            row[name] = f"{row['run_id']}_{name}.csv"
            written.logs[row[name]] = written.logs[first[name]]
            if change_of_log:
                change(written, row[name], partial(_changed_copy, change_of_log, number))
        written.rows.append(row)
    for row in written.rows:
        if row["tare_run"] == first["tare_run"]:
            row["tare_shared"] = "yes"
    return [first["run_id"], *(row["run_id"] for row in written.rows[-4:])]


def _changed_copy(change_of_log, number, log):
    if change_of_log == "rows cut":
        return log[:, 5 * number :]
    if change_of_log == "times":
        log[0] *= 1 + 1e-4 * number
    if change_of_log == "last digit":
        is_force = log.shape[0] == len(CHANNELS) + 3
        log[2 if is_force else 1 :] += (1e-5 if is_force else 1e-2) * number
    return log


MISTAKES = _DATA["mistakes"]
"""Function that makes each mistake, with its settings, by name. Of one run, and copies: `repeats` of the sheet matter."""


def copied(base):
    """Copy a campaign, to make mistakes in it."""
    return Written(copy.deepcopy(base.config), copy.deepcopy(base.rows), dict(base.logs))


def with_mistake(base, name, seed):
    """Make a mistake in a copy of a campaign; the run_ids that it is in."""
    written, settings = copied(base), dict(MISTAKES[name])
    make_mistake = globals()[settings.pop("make")]
    return written, make_mistake(written, np.random.default_rng(seed), **settings)


class Judged(NamedTuple):
    """Checks, tables of alpha and of alpha at depths, flags, what runs share, and the verdict, as the stages make them of a medium."""

    checks: pd.DataFrame
    alpha: pd.DataFrame
    at_depth: pd.DataFrame
    cell_flags: Flags
    causes: pd.DataFrame
    verdict: Verdict

    @property
    def failed(self):
        """Sentences of the checks that fail, by check."""
        rows = self.checks[self.checks["verdict"] == "failed"]
        return dict(zip(rows["check"], rows["sentence"], strict=True))

    @property
    def flags(self):
        """Codes of all flags on cells."""
        cells = self.alpha.to_dict("records")
        return {flag.code for cell in cells for flag in self.cell_flags.of_cell(cell)}

    def without_flag(self, cells):
        """Those of some cells that have no flag."""
        return cells[[not self.cell_flags.of_cell(cell) for cell in cells.to_dict("records")]]

    def wrong(self, truth=table_s5):
        """Cells that lie outside their interval and are more than 0.005 N/cm^3 off."""
        return self.alpha[[self._is_wrong(row, truth) for row in self.alpha.to_dict("records")]]

    def narrower(self, than, least=NARROWER):
        """Cells, of alpha and at depths, whose interval is narrower, with the `share` of its width that is left."""
        return pd.concat(
            [
                _narrower(self.alpha, than.alpha, (), least),
                _narrower(self.at_depth, than.at_depth, ("depth_cm",), least),
            ]
        )

    def silently(self, than):
        """Of these, cells without a flag where no check fails that did not fail before."""
        narrower_cells = self.narrower(than)
        return (
            narrower_cells.iloc[:0]
            if self.failed.keys() - than.failed
            else self.without_flag(narrower_cells)
        )

    @staticmethod
    def _is_wrong(row, truth):
        true = truth(row["medium"], row["beta_deg"], row["gamma_deg"])
        return any(
            abs(row[column(c)] - value) > LEAST_OFF
            and not row[column(c, "_lo")] <= value <= row[column(c, "_hi")]
            for c, value in zip("zx", true, strict=True)
        )


def _narrower(after, before, further_keys, least):
    both = after.merge(
        before, on=["beta_deg", "gamma_deg", *further_keys], suffixes=("", "_before")
    )
    width, old = (
        np.stack([both[column(c, "_hi") + end] - both[column(c, "_lo") + end] for c in "zx"])
        for end in ("", "_before")
    )
    left = np.nan_to_num(width / np.maximum(old, 1e-9), nan=1.0).min(axis=0)
    narrower: pd.DataFrame = both.assign(share=left)[left < 1 - least]
    return narrower


def judged(written):
    """Write a campaign into files, measure and check it."""
    with TemporaryDirectory() as folder:
        root = Path(folder) / "lab"
        written.write(root)
        campaign = load_campaign(root / "config" / "config.yaml")
        results = measured(campaign, campaign.config.transducer.slow_noise_N)
        (medium,) = results.media
        verdicts, alpha, _, at_depth, _, causes, flags = measure_stages.checks(results, medium)
        verdict = verdict_on(verdicts, results.table(f"fits/{medium}.csv"), Flags(flags))
        return Judged(verdicts, alpha, at_depth, Flags(flags), causes, verdict)
