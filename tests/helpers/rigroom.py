"""Small campaigns of the re-enacted lab in a folder, and the chain of stages over them."""

import csv
import hashlib
import io
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import pandas as pd
import yaml

from rftfit.campaign.config import Config
from rftfit.campaign.load import load_campaign
from rftfit.lab.enact import run_logs
from rftfit.lab.plan import PlannedRun, plan_runs
from rftfit.lab.write import sheet_text
from rftfit.measure.alpha import alpha_table, with_flagged
from rftfit.measure.fits import fit_medium
from rftfit.measure.flags import Flags, flag_table
from rftfit.measure.ingest import ingest_medium
from rftfit.measure.ledger import check_ledger, join
from rftfit.measure.leg_curves import leg_curves
from rftfit.measure.tare import tare_medium

CONFIG = Path(__file__).parents[2] / "config" / "config.yaml"
# the demonstration's, without its robot: these rooms have no marker tracks
CONFIG_TEXT, _, _ = CONFIG.read_text(encoding="utf-8").partition("\nrobot:")
CONFIG_TEXT += "\n"
SEED = 2013


@cache
def paper():
    return Config(**yaml.safe_load(CONFIG_TEXT))


@cache
def planned():
    return {run.run_id: run for run in plan_runs(paper())}


def data_lines(content):
    """Data lines of a log: counted here, without the program."""
    if content is None:
        return 0
    lines = [line.strip() for line in content.removeprefix(b"\xef\xbb\xbf").splitlines()]
    return max(sum(bool(line) and not line.startswith(b"#") for line in lines) - 1, 0)


@dataclass
class RigRoom:
    """A campaign's folder with some of the paper's runs; `logs` may be changed before `write`."""

    folder: Path
    logs: dict[str, bytes | None] = field(default_factory=dict)
    runs: list[PlannedRun] = field(default_factory=list)
    cells: dict[str, dict[str, str]] = field(default_factory=dict)
    config: str = CONFIG_TEXT

    def add(self, *names, **faults):
        """Add runs with their tares; `faults` by run_id."""
        run_ids = dict.fromkeys(names)
        run_ids |= dict.fromkeys(planned()[name].tare_run for name in names)
        for name in run_ids:
            if not name or name in {run.run_id for run in self.runs}:
                continue
            run = planned()[name]
            self.runs.append(run)
            self.logs |= run_logs(run, paper(), SEED, faults.get(name, ()))
        return self

    def change(self, log, transform):
        content = self.logs[log]
        assert content is not None
        self.logs[log] = transform(content.decode()).encode()

    def set(self, run, **cells):
        """Change cells of one row of the sheet, named by the plan's run_id."""
        self.cells.setdefault(run, {}).update(cells)

    def rows(self):
        sheet = csv.DictReader(io.StringIO(sheet_text(self.runs, {})))
        return [{**row, **self.cells.get(row["run_id"], {})} for row in sheet]

    def write(self, order=list):
        """Write config, sheet and logs; the path of the config."""
        path = self.folder / "config" / "config.yaml"
        raw = self.folder / "raw" / "paper"
        for folder in (path.parent, raw):
            folder.mkdir(parents=True, exist_ok=True)
        path.write_text(self.config, encoding="utf-8")
        for name, content in self.logs.items():
            target = raw / name
            target.parent.mkdir(exist_ok=True)
            if content is not None:
                target.write_bytes(content)
        rows = self.rows()
        out = io.StringIO()
        writer = csv.DictWriter(out, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(order(rows))
        (raw / "runs.csv").write_text(out.getvalue(), encoding="utf-8")
        return path

    def chain(self, medium="poppy_LP"):
        return chain(load_campaign(self.write()), medium)

    @property
    def names(self):
        return [run.run_id for run in self.runs]

    @property
    def counted(self):
        """Data lines of every log the sheet names."""
        return {name: data_lines(content) for name, content in self.logs.items()}


def row_of_run(table, run_id):
    """Return the only row of a run."""
    rows = table[table["run_id"] == run_id]
    assert len(rows) == 1
    return rows.iloc[0]


@dataclass(frozen=True)
class Results:
    """What the stages made of one medium."""

    traces: pd.DataFrame
    runs: pd.DataFrame
    tared: pd.DataFrame
    tares: pd.DataFrame
    fits: pd.DataFrame
    alpha: pd.DataFrame
    curves: pd.DataFrame
    book: pd.DataFrame
    flags: Flags

    def fit(self, run_id):
        return row_of_run(self.fits, run_id)

    def run(self, run_id):
        return row_of_run(self.runs, run_id)

    def codes(self, run_id):
        """Codes of the flags of a run."""
        return [flag.code for flag in self.flags.of_run(run_id)]

    def cell(self, beta_deg, gamma_deg):
        is_cell = (self.alpha["beta_deg"] == beta_deg) & (
            (self.alpha["gamma_deg"] - gamma_deg).abs() < 0.1
        )
        assert is_cell.sum() == 1
        return self.alpha[is_cell].iloc[0]

    def fates(self, file):
        rows = self.book[self.book["file"] == file]
        return dict(
            zip(zip(rows["fate"], rows["reason_code"], strict=True), rows["rows"], strict=True)
        )

    def check_ledger(self, counted, one_file=()):
        """Every line of every file is in the ledger, once; `one_file`: runs with a single log."""
        check_ledger(self.book, self.runs, list(one_file))
        assert self.book.groupby("file")["rows"].sum().to_dict() == counted
        dropped = self.book[self.book["fate"] == "dropped"]
        assert (dropped["reason"] != "").all()
        assert set(self.book["fate"]) <= {"used", "dropped"}


def chain(campaign, medium):
    """Ingest, tare, slopes, alpha table, legs and ledger of one medium."""
    traces, runs, *_, book1 = ingest_medium(campaign, medium)
    tared, tares, *_, book2 = tare_medium(campaign, medium, traces, runs)
    fits, *_, book3 = fit_medium(campaign, medium, runs, tared, tares)
    curves, *_, book4 = leg_curves(campaign, medium, runs, tared)
    fit = campaign.config.fit
    alpha = alpha_table(fits, medium, fit.confidence, len(fit.horizontal_depths_cm))
    books = (book1, book2, book3, book4)
    book = join([ledger.table() for ledger in books])
    flags = Flags(*(flag_table(medium, "", ledger.flags) for ledger in books))
    alpha = with_flagged(alpha, flags)
    return Results(traces, runs, tared, tares, fits, alpha, curves, book, flags)


def digests(folder):
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in files
    }
