"""The watch: from files that are still to the verdict of each push, the map of its medium and the next push."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rftfit.bench.files import Files, Stamp, Tree, stamp_of
from rftfit.bench.medium import Medium, hold, measure
from rftfit.campaign.files import BAG
from rftfit.campaign.load import REENACTED, check_campaign, root_of
from rftfit.campaign.problems import CampaignError
from rftfit.errors import InputError
from rftfit.logs.inspect import kinds, recognised, survey_file, together
from rftfit.measure.alpha import column
from rftfit.measure.flags import flags_of
from rftfit.measure.verdicts import FAILED
from rftfit.model.planning import Rig, Target, blank, plan, push_rows
from rftfit.model.shapes import estimate, grid, pushes_of
from rftfit.results import Results
from rftfit.workflow.measure import checks
from rftfit.workflow.state import cells

if TYPE_CHECKING:
    from collections.abc import Collection, Generator, Iterator, Mapping, Sequence

    from rftfit.campaign.load import Campaign
    from rftfit.campaign.problems import Problem
    from rftfit.campaign.sheet import Run

MEASURED, WAITING, GROWING, BARE, REFUSED, EXCLUDED, READ = (
    "measured", "waiting", "growing", "not tared yet", "no alpha", "excluded", "read",
)  # fmt: skip
"""States of a run."""

_NEXT = 3
_MOST_UNNAMED = 20
"""Files that no row names: so many are looked into."""

_PASSING = ("sheet.log-missing", "sheet.tare-unused", "sheet.no-plate", "sheet.only-straight-down")
"""Warnings of the run sheet that hold until the last run is made."""


@dataclass(frozen=True)
class Event:
    """Something to be told: ``problem``, ``file``, ``push``, ``withdrawn`` or ``medium``, and its facts."""

    kind: str
    facts: Mapping[str, Any]


def _problem(text: str, one: Problem | None = None, *, solved: bool = False) -> Event:
    row, code, severity = (
        (one.place.row, one.code, one.severity) if one else (None, "logs", "error")
    )
    facts = {"row": row, "code": code, "severity": severity, "text": text, "solved": solved}
    return Event("problem", facts)


class _Row(NamedTuple):
    """A run of the sheet, what counts of its row, and its files."""

    run: Run
    cells: tuple[str, ...]
    files: tuple[str, ...]


class Watch:
    """A campaign that is watched; `step` is one look at its files.

    `wait_s`: A file counts when it has not changed for so long. `target`: What the next pushes are to tell.
    `rows`: Of the run sheet, by medium and run_id. `unnamed`: What is known of each file that no row names.
    """

    def __init__(self, config: Path, wait_s: float = 1.0, target: Target | str = "map") -> None:
        self.config, self.target = config.absolute(), target
        self.campaign: Campaign | None = None
        self.media: dict[str, Medium] = {}
        self.rows: dict[str, dict[str, _Row]] = {}
        self.problems: dict[str, Problem] = {}
        self.unnamed: dict[str, dict[str, Any]] = {}
        self._settings, self._logs = Files(wait_s), Files(wait_s)
        self._read_from: object = None
        self._shared: object = None
        self._loose: list[str] = []
        self._sheet_moves = False
        self._paths: list[str] = []
        self._tree = Tree(root_of(config))

    def step(self, now: float | None = None) -> Iterator[Event]:
        """Look at all files once; tell what is new, the push's own verdict first, then map and plan."""
        now = time.monotonic() if now is None else now
        again = yield from self._reread(now)
        if self.campaign is None:
            return
        if self._tree.changed() or again:
            self._list()
        if not self._logs.look(self._paths, now) and not again:
            return
        for name in {*self.media} - {*self.rows}:
            yield from self._withdraw(self.media.pop(name), ())
        changed = []
        for name in self.rows:
            medium = self.media.setdefault(name, Medium(name))
            before = dict(medium.keys)
            try:
                yield from self._measure(self.campaign, medium)
            except InputError as error:  # no log of the campaign can be read so
                yield _problem(str(error))
            changed += [medium] if medium.keys != before else []
        yield from self._tell_media(self.campaign, changed)
        yield from self._look_into(self.campaign)

    # --- config and run sheet

    def _reread(self, now: float) -> Generator[Event, None, bool]:
        """Read config and run sheet again where they changed; whether they did."""
        files = [str(self.config)]
        if (old := self.campaign) is not None:
            contact, calibration = old.config.rigid_contact, old.config.force_log.calibration
            shared = [contact.force_log, contact.motion_log] if contact else []
            files += [
                str(old.sheet),
                *(str(old.raw / name) for name in (*shared, calibration) if name),
            ]
        self._settings.look(files, now)
        stamps = self._settings.stamps(files)
        self._sheet_moves = stamps is None
        if stamps is None or stamps == self._read_from:
            return False
        campaign, problems = check_campaign(self.config, good_rows=True)
        told = {str(one): one for one in problems if one.code not in _PASSING}
        for text in [*self.problems, *told]:
            if (text in self.problems) != (text in told):
                one = told.get(text) or self.problems[text]
                yield _problem(text, one, solved=text not in told)
        self.problems, self._read_from = told, stamps
        if campaign is None:
            if self.campaign is None:
                raise CampaignError(problems)
            return False
        if campaign.numbers:
            raise InputError(
                f"{campaign.sheet}: the campaign is a table, so there is no log to wait for"
            )
        everything = campaign.config.model_dump(mode="json"), stamps[2:]
        if self._shared != everything:  # nothing that was measured with other settings holds
            self.media = {}
        self.campaign, self._shared = campaign, everything
        self._tree.base = campaign.raw
        return True

    def _list(self) -> None:
        """List the files of each run, and those that no row names."""
        assert self.campaign is not None
        self.rows = {name: self._rows_of(name) for name in self.campaign.media_with_runs}
        named = {file for rows in self.rows.values() for row in rows.values() for file in row.files}
        self._loose = [
            name for name in self._tree.names if name not in named and self._may_be_log(name)
        ]
        self._paths = [f"{self.campaign.raw}/{name}" for name in (*sorted(named), *self._loose)]

    def _rows_of(self, medium: str) -> dict[str, _Row]:
        assert self.campaign is not None
        found = {}
        for run in self.campaign.runs_of(medium):
            logs = {run.force_log, run.motion_log, run.zero_log} - {""}
            bags = tuple(name.removesuffix(BAG) for name in logs if name.endswith(f"/{BAG}"))
            parts = {name for name in self._tree.names if name.startswith(bags)} if bags else set()
            found[run.run_id] = _Row(run, tuple(cells(run).values()), tuple(sorted(logs | parts)))
        return found

    # --- runs

    def stamps(self, row: _Row) -> tuple[Stamp, ...] | None:
        """Stamps of the files of a run; None while one of them moves."""
        assert self.campaign is not None
        return self._logs.stamps(f"{self.campaign.raw}/{name}" for name in row.files)

    def _measure(self, campaign: Campaign, medium: Medium) -> Iterator[Event]:
        """Measure the runs whose files are still and not those that were measured; tell each."""
        rows = self.rows[medium.name]
        yield from self._withdraw(medium, rows)
        stamps = {name: self.stamps(row) for name, row in rows.items()}
        plates = len({row.run.intruder for row in rows.values() if row.run.kind == "plate"})
        wanted = {}
        for name, row in rows.items():
            tare = rows.get(row.run.tare_run)
            by = tare and stamps[tare.run.run_id]
            waits = tare and by is None and (row.run.kind == "leg" or name in medium.runs)
            key = row.cells, stamps[name], tare and (tare.cells, by), plates
            if stamps[name] is not None and not waits and medium.keys.get(name) != key:
                wanted[name] = key
        moving = [name for name, stamp in stamps.items() if stamp is None]
        first = medium.alpha.empty
        for part in measure(campaign, medium.name, wanted, moving):
            for name, one in part.items():
                tares = {rows[name].run.tare_run} & {*rows}
                read = [rows[key] for key in (name, *tares)]
                if any(stamps[row.run.run_id] not in (None, self._now(row)) for row in read):
                    continue  # written while it was read: it is measured when it is still
                was = medium.runs.get(name)
                medium.runs[name], medium.keys[name] = one, wanted[name]
                facts = self.facts(medium, name)
                if facts["state"] == WAITING and was and was.is_read:
                    facts = {"medium": medium.name, "run_id": name, "why": "its log is gone"}
                    yield Event("withdrawn", facts)
                    continue
                if facts["kind"] == "plate" and facts["state"] != WAITING:
                    medium.last, medium.heard = name, time.time()
                    medium.seconds = np.nan if first else facts["seconds_since_change"]
                yield Event("push", facts | {"first": first})

    def _now(self, row: _Row) -> tuple[Stamp, ...]:
        assert self.campaign is not None
        return tuple(stamp_of(self.campaign.raw / name) for name in row.files)

    def _withdraw(self, medium: Medium, rows: Collection[str]) -> Iterator[Event]:
        for name in [name for name in medium.runs if name not in rows]:
            del medium.runs[name], medium.keys[name]
            facts = {"medium": medium.name, "run_id": name, "why": "no row names it any more"}
            yield Event("withdrawn", facts)

    def state(self, medium: str, name: str) -> str:
        """State of a run by now."""
        row, one = self.rows[medium][name], self.media[medium].runs.get(name)
        if row.run.excluded:
            return EXCLUDED
        stamps = self.stamps(row)
        if one is None or stamps is None:
            return GROWING
        if None in stamps:
            return WAITING
        if not one.is_read:
            return REFUSED
        tare = self.rows[medium].get(row.run.tare_run)
        if tare and one.why and self.state(medium, tare.run.run_id) in (WAITING, GROWING):
            return BARE
        return REFUSED if one.why else MEASURED if row.run.kind == "plate" else READ

    def facts(self, medium: Medium, name: str) -> dict[str, Any]:
        """What is told of a run: its state, alpha with its interval, flags, or why there is no number."""
        run, one = self.rows[medium.name][name].run, medium.runs[name]
        fit, stamps = one.rows.get("fits", {}), self._now(self.rows[medium.name][name])
        numbers = (
            "beta_deg",
            "gamma_deg",
            *(column(c, end) for c in "zx" for end in ("", "_lo", "_hi")),
        )
        changed = max((stamp[1] / 1e9 for stamp in stamps if stamp), default=np.nan)
        return {
            "medium": medium.name, "run_id": name, "row": run.row, "kind": run.kind,
            "state": self.state(medium.name, name), "direction": run.direction,
            **{number: fit.get(number, np.nan) for number in numbers},
            "flags": [{"code": one.code, "text": str(one)} for one in flags_of(fit or one.rows["runs"])],
            "reason": one.why, "seconds_since_change": round(time.time() - changed, 3),
        }  # fmt: skip

    # --- media

    def _tell_media(self, campaign: Campaign, changed: Sequence[Medium]) -> Iterator[Event]:
        """Check the media with new runs, then estimate their maps and plan the next pushes."""
        if not changed:
            return
        kept = {name for medium in self.media.values() for name in medium.runs}
        legless = (run for run in campaign.runs if run.kind != "leg" or run.tare_run in {"", *kept})
        view = replace(campaign, runs=tuple(run for run in legless if run.run_id in kept))
        results = Results(view)
        for medium in self.media.values():
            if medium.name not in view.media_with_runs:
                continue
            if medium in changed:
                hold(results, medium, view.runs_of(medium.name))
                medium.checks, medium.alpha, *_ = checks(results, medium.name)
            for name in ("checks", "alpha"):
                results.hold_as_csv(f"{name}/{medium.name}.csv", getattr(medium, name))
                setattr(medium, name, results.table(f"{name}/{medium.name}.csv"))
        for name in view.media_with_runs:
            medium = self.media[name]
            if medium in changed or campaign.config.maps.own_media:
                self._plan(results, medium)
                yield Event("medium", self.summary(medium))

    def _plan(self, results: Results, medium: Medium) -> None:
        """Estimate the map of a medium, and choose the pushes that tell most of what it does not tell yet."""
        config, planned = results.config, results.config.grid.planned
        nodes = grid(*zip(*planned, strict=True)) if planned else None
        shapes = results.shapes(medium.name)
        try:
            known = medium.map = results[medium.name].map()
            if planned:
                known = estimate(
                    pushes_of(medium.alpha, config), shapes, nodes, confidence=known.confidence
                )
        except InputError:
            medium.map, known = None, blank(shapes, nodes)
        rig = Rig(tuple(planned), depths=len(config.fit.horizontal_depths_cm))
        medium.plan = plan(self.target, known, rig, _NEXT, config.fit.confidence)
        medium.before, medium.width = medium.width, 100 * medium.plan.steps[0].typical

    def summary(self, medium: Medium) -> dict[str, Any]:
        """What is told of a medium: its failed checks, how well its target is known, the next pushes as rows."""
        failed = medium.checks[medium.checks["verdict"] == FAILED]
        states = Counter(self.state(medium.name, name) for name in self.rows[medium.name])
        return {
            "medium": medium.name, "states": dict(states),
            "checks": failed[["check", "effect", "sentence"]].to_dict("records"),
            "target": medium.plan.target if medium.plan else "", "half_width_percent": medium.width,
            "before_percent": medium.before, "next": self.next_rows(medium),
        }  # fmt: skip

    def next_rows(self, medium: Medium) -> list[dict[str, str]]:
        """Rows of the run sheet for the next pushes, like that of the last one, its tare with them."""
        assert self.campaign is not None
        like = next(
            (
                run
                for run in reversed(self.campaign.runs)
                if (run.medium, run.kind) == (medium.name, "plate")
            ),
            None,
        )
        if like is None or medium.plan is None:
            return []
        number, found = len(self.rows[medium.name]), []
        pushes = [
            row
            for step in medium.plan.steps[1:]
            for row in push_rows(step, self.campaign.config.fit.horizontal_depths_cm)
        ]
        for push in pushes:
            number += 1
            while (name := f"{medium.name}_{number:03d}") in self.campaign.by_id:
                number += 1
            tare = f"{name}_rod" if like.tare_run and not like.tare_shared else ""
            for run_id, kind in ((name, "plate"), *([(tare, "rod")] if tare else [])):
                logs = {
                    log: getattr(like, log).replace(like.run_id, run_id)
                    for log in ("force_log", "motion_log")
                }
                found.append({"run_id": run_id, "kind": kind, "medium": medium.name, "intruder": like.intruder} | push
                             | logs | {"tare_run": tare if kind == "plate" else ""})  # fmt: skip
        return found

    # --- files that no row names

    def _may_be_log(self, name: str) -> bool:
        assert self.campaign is not None
        robot, path = self.campaign.config.robot, self.campaign.raw / name
        of_robot = (
            robot is not None and robot.runs and name.startswith(f"{Path(robot.runs).parent}/")
        )
        return not (
            of_robot or path == self.campaign.sheet or path.name in (REENACTED, "README.md")
        )

    def _look_into(self, campaign: Campaign) -> Iterator[Event]:
        """Tell what the files are that no row names, and the row that would name each."""
        self.unnamed = {name: self.unnamed[name] for name in self.unnamed if name in self._loose}
        if self._sheet_moves:  # a row for them may be there
            return
        for name in self._loose:
            path = campaign.raw / name
            if (
                name in self.unnamed
                or len(self.unnamed) >= _MOST_UNNAMED
                or not self._logs.stamps([str(path)])
            ):
                continue
            try:
                surveys, refused = survey_file(recognised(path).reader, path)
                found = {"kinds": kinds(together(surveys)), "refused": str(refused or "")}
            except (InputError, OSError) as error:
                found = {"kinds": [], "refused": str(error)}
            logs = {f"{kind}_log": name for kind in ("force", "motion") if kind in found["kinds"]}
            self.unnamed[name] = {"file": name, **found, "row": {"run_id": path.stem, **logs}}
            yield Event("file", self.unnamed[name])
