"""A small campaign on disk that is right, to be put wrong in one place."""

import csv
import io
import math
from typing import Any

from rftfit.campaign.columns import COLUMNS
from rftfit.campaign.load import check_campaign
from rftfit.campaign.sheet import Run

CONFIG = """\
title: Test
raw: raw
run_sheet: runs.csv
transducer:
  name: sensor
  range_N: [65, 65, 200]
  axes: {x: "-F2", y: "+F1", z: "-F3"}
container: {length_cm: 24, width_cm: 22, depth_cm: 15}
intruders:
  plate: {shape: plate, length_cm: 3.81, width_cm: 2.54, thickness_cm: 0.64}
  disc: {shape: plate, length_cm: 2, width_cm: 2, thickness_cm: 0.64}
  c_leg: {shape: leg, curvature_times_R: 1, max_length_cm: 7.62, width_cm: 2.54, thickness_cm: 0.64, hip_height_cm: 2}
  flat_leg: {shape: leg, curvature_times_R: 0, max_length_cm: 7.62, width_cm: 2.54, thickness_cm: 0.64, hip_height_cm: 2}
media:
  poppy_LP: {title: "poppy seeds, loose"}
  poppy_CP: {title: "poppy seeds, close"}
"""


SHEET = """\
run_id,kind,medium,intruder,direction,beta_deg,gamma_deg,depth_cm,tare_run
p1,plate,poppy_LP,plate,intrusion,30,45,,t1
t1,rod,poppy_LP,plate,intrusion,30,45,,
h1,plate,poppy_LP,plate,horizontal,30,0,2.54,th
th,rod,poppy_LP,plate,horizontal,30,0,2.54,
c1,leg,poppy_LP,c_leg,rotation,,,,a1
a1,leg_air,,c_leg,rotation,,,,
"""


class Room:
    """A campaign's folder; `rows` and `columns` can be changed before `check`."""

    def __init__(self, folder):
        self.folder = folder
        self.config = CONFIG
        self.columns = [column.name for column in COLUMNS]
        self.rows = {}
        for row in csv.DictReader(io.StringIO(SHEET)):
            self.rows["new"] = row
            self.add(row["run_id"], "new")
            del self.rows["new"]

    @property
    def path(self):
        return self.folder / "config" / "config.yaml"

    def touch(self, log):
        path = self.folder / "raw" / log
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("", encoding="utf-8")

    def add(self, name, like, **cells):
        """Add a run like another one, with log files of its own."""
        logs = {
            f"{quantity}_log": f"logs/{name}_{quantity}.csv" for quantity in ("force", "motion")
        }
        self.rows[name] = {**self.rows[like], "run_id": name, **logs, **cells}
        for log in logs.values():
            self.touch(log)

    def put(self, change):
        """Change cells of rows by name; ``new<old``: of a new row like an old one; None: without the row."""
        for name, cells in change.items():
            run_id, _, like = name.partition("<")
            if like:
                self.add(run_id, like)
            if cells is None:
                del self.rows[run_id]
            else:
                self.rows[run_id] |= cells

    def list_problems(self):
        """Code, row and column of every problem, and the problems."""
        problems = self.check()
        return [
            (problem.code, problem.place.row, problem.place.column) for problem in problems
        ], problems

    def text(self, delimiter=","):
        out = io.StringIO()
        writer = csv.writer(out, delimiter=delimiter, lineterminator="\n")
        writer.writerow(self.columns)
        for row in self.rows.values():
            writer.writerow([row.get(name, "") for name in self.columns])
        return out.getvalue()

    def write(self, sheet=None, name="runs.csv"):
        self.path.parent.mkdir(exist_ok=True)
        self.path.write_text(self.config.replace("runs.csv", name), encoding="utf-8")
        (self.folder / name).write_bytes(self.text().encode() if sheet is None else sheet)

    def check(self, sheet=None, name="runs.csv"):
        self.write(sheet, name)
        return check_campaign(self.path)[1]

    def only(self, code, sheet=None, name="runs.csv"):
        """The only problem, which must be of this code."""
        problems = self.check(sheet, name)
        assert [problem.code for problem in problems] == [code], "\n".join(map(str, problems))
        return problems[0]

    def campaign(self, sheet=None, name="runs.csv"):
        self.write(sheet, name)
        campaign, problems = check_campaign(self.path)
        assert campaign is not None, "\n".join(map(str, problems))
        return campaign


def plate_run(run_id="r1", **cells):
    """A plate of the paper that is pushed straight down, with nothing else said, but for some cells."""
    values: dict[str, Any] = {
        "run_id": run_id,
        "kind": "plate",
        "medium": "poppy_LP",
        "intruder": "plate",
        "direction": "intrusion",
        "beta_deg": 0.0,
        "gamma_deg": 90.0,
        "depth_cm": math.nan,
        "force_log": f"{run_id}.csv",
        "motion_log": "b.csv",
        "tare_run": "",
        "tare_shared": False,
        "surface_z_mm": None,
        "excluded": False,
        "reason": "",
        "note": "",
        "row": 2,
    }
    return Run(**values | cells)
