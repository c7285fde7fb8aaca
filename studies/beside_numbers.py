"""Tables of two devices told apart by a column, and columns of state: which are refused, which read wrongly: ``make beside``.

Forty tables by default, half with two load cells in one table, half with one cell and a column of state; names in six
languages, turns of 1 to 100 rows, noises of 0.002 to 2 N, pushes as they are and with stick-slip, a crust and stones. Of the
first none may be read, of the second none refused. Then units that stand in each row: they may not be taken for another.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

from pushes import crust, push, stick_slip, stones

from rftfit.campaign.config import TextFormat
from rftfit.logs.base import LogError
from rftfit.logs.delimited import DelimitedReader

NAMES = {
    "English": ("ch", "port", "Sensor#", "Probe No.", "S", "tag"),
    "German": ("Kanal", "Messstelle", "Aufnehmer", "Nr."),
    "French": ("voie", "capteur", "numéro"),
    "Spanish": ("canal", "sonda", "número"),
    "Japanese": ("チャンネル", "番号"),
    "Chinese": ("通道", "编号"),
}
LABELS = ((1, 2), ("A", "B"), ("0x1A", "0x1B"), ("vorne", "hinten"), (0, 7))
STATES = (
    "Status",
    "Zustand",
    "état",
    "estado",
    "状態",
    "状态",
    "heartbeat",
    "contact",
    "temperature",
)
EVENTS = (None, None, stick_slip, crust, stones)
UNITS = {"N": 1.0, "lbF": 4.4482216152605, "kgf": 9.80665, "mN": 1e-3, "kN": 1e3}


def draw_turns(random, size):
    """Number of the label of each row: turns of one length, or of any up to twice that, at most 100 rows."""
    rows = int(random.choice([1, 2, 3, 4, 5, 8, 10, 15, 25, 40, 60, 100]))
    if random.random() < 0.5:
        return np.arange(size) // rows % 2
    return np.repeat(np.arange(size) % 2, random.integers(1, min(2 * rows, 100) + 1, size))[:size]


def draw_force(random):
    """Time, s, and force, N, of a push with what may happen in a bed."""
    time, _, force = push(random)
    happens = EVENTS[random.integers(len(EVENTS))]
    if happens is not None:
        force = force * (1 + happens(random, time))
    return time, force + random.normal(0, random.choice([0.002, 0.02, 0.2, 2.0]), time.size)


def draw_state(random, time, force):
    """A column that one device says of itself."""
    kind = random.integers(5)
    if kind == 0:
        return (np.arange(time.size) // int(random.integers(1, 60))) % 2
    if kind == 1:
        return np.where(
            force + random.normal(0, 0.5, time.size) > random.uniform(1, 50), "on", "off"
        )
    if kind == 2:
        return np.round(20 + np.cumsum(random.normal(0, 0.05, time.size))).astype(int)
    if kind == 3:
        return np.where(random.random(time.size) < 0.1, "warn", "ok")
    return np.arange(time.size) % int(random.integers(2, 300))


def outcome(folder, table):
    """Return the log of a table, or the code by which it is refused."""
    path = folder / "table.csv"
    table.to_csv(path, index=False)
    try:
        return DelimitedReader(TextFormat(delimiter=",")).only({"Time", "Force"}).load(path)
    except LogError as error:
        return error.code


def count_outcomes(folder, tables):
    """Tables of two devices that are read, columns of state that are refused, units that are taken for others."""
    mixed = refused = wrong_units = 0
    names = [name for of_language in NAMES.values() for name in of_language]
    for seed in range(tables // 2):
        random = np.random.default_rng(seed)
        time, force = draw_force(random)
        turns = draw_turns(random, time.size)
        other = force * random.uniform(0, 0.8) + random.choice([0.0, 1.0, -3.0])
        first, second = LABELS[random.integers(len(LABELS))]
        two_devices = pd.DataFrame(
            {
                "Time (s)": time,
                names[random.integers(len(names))]: np.where(turns, str(second), str(first)),
                "Force (N)": np.where(turns, other, force),
            }
        )
        mixed += outcome(folder, two_devices) != "several-sources"
        time, force = draw_force(random)
        state = STATES[random.integers(len(STATES))]
        one_device = pd.DataFrame(
            {"Time (s)": time, state: draw_state(random, time, force), "Force (N)": force}
        )
        refused += isinstance(outcome(folder, one_device), str)
        unit = [*UNITS][random.integers(len(UNITS))]
        in_rows = pd.DataFrame({"Time (s)": time, "Force": force / UNITS[unit], "U": unit})
        log = outcome(folder, in_rows)
        stated = {"lbF": "lbf"}.get(unit, unit)
        wrong_units += isinstance(log, str) or log.units["Force"] != stated
    return mixed, refused, wrong_units


def main():
    """Run it and print a line for each of the three; exit status 1 if one is not 0."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tables", nargs="?", type=int, default=40)
    tables = parser.parse_args().tables
    with tempfile.TemporaryDirectory() as temporary:
        mixed, refused, wrong_units = count_outcomes(Path(temporary), tables)
    print(f"tables of two devices that were read: {mixed} of {tables // 2}")
    print(f"columns of state that were refused: {refused} of {tables // 2}")
    print(f"units in rows that were not taken as they are: {wrong_units} of {tables // 2}")
    return 1 if mixed or refused or wrong_units else 0


if __name__ == "__main__":
    sys.exit(main())
