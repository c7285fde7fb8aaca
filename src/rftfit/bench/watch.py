"""The watch: from files that no longer change to the result of each push, the map of its medium and the next push."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import chain, count
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from rftfit.bench.events import Event
from rftfit.bench.files import Files, Stamp, stamp_of
from rftfit.bench.medium import LiveMedium, hold, measure
from rftfit.campaign.files import BAG
from rftfit.campaign.load import REENACTED, Campaign, check_campaign
from rftfit.campaign.problems import CampaignError, Problem
from rftfit.campaign.sheet import Run
from rftfit.checks.verdict import verdict_on
from rftfit.errors import InputError
from rftfit.forces.planning import Rig, Target, plan, prior_map, push_rows
from rftfit.measure.alpha import column
from rftfit.measure.flags import Flags
from rftfit.measure.session_clocks import SessionClocks, align_medium, goes_straight_down
from rftfit.measure.verdict_words import FAILED
from rftfit.model.maps import estimate, map_nodes
from rftfit.model.pushes import pushes_of
from rftfit.results import Results
from rftfit.workflow.measure import checks
from rftfit.workflow.state import cells_of_run

MEASURED, WAITING, GROWING, BARE, REFUSED, EXCLUDED, READ = (
    "measured",
    "waiting",
    "growing",
    "not tared yet",
    "no alpha",
    "excluded",
    "read",
)
"""States of a run."""

_TEMPORARY = (
    "sheet.log-missing",
    "sheet.tare-unused",
    "sheet.no-plate",
    "sheet.only-straight-down",
)
"""Codes of warnings about the run sheet that are usual until the last run is made, and not reported."""


class _Row(NamedTuple):
    """A run of the sheet, the cells of its row that matter for results, and its files."""

    run: Run
    cells: tuple[str, ...]
    files: tuple[str, ...]


class Watch:
    """A campaign that is watched; each call of `step` looks once at its files.

    `wait_s`: Time after which a file without changes is read, s.
    `target`: Quantity that the next pushes shall determine.
    `media`: Results by medium.
    `rows`: Rows of the run sheet by medium and run_id.
    `problems`: Problems of config and run sheet by their text.
    `unnamed`: Facts about each file that no row names, by path.
    """

    def __init__(self, config: Path, wait_s: float = 1.0, target: Target | str = "map") -> None:
        self.config, self.target = config.absolute(), target
        self.media: dict[str, LiveMedium] = {}
        self.rows: dict[str, dict[str, _Row]] = {}
        self.problems: dict[str, Problem] = {}
        self.unnamed: dict[str, dict[str, Any]] = {}
        self._files = Files(wait_s)
        self._read_from: tuple[Stamp, ...] | None = None
        campaign, problems = check_campaign(self.config, good_rows=True)
        if campaign is None:
            raise CampaignError(problems)
        if campaign.numbers:
            raise InputError(f"{campaign.sheet}: a table has no logs, so there is none to wait for")
        self.campaign: Campaign = campaign
        self._must_look_again = False
        self._aligned: dict[str, tuple[Any, pd.DataFrame]] = {}

    def step(self, now: float | None = None) -> Iterator[Event]:
        """Look at all files once; yield events for all that is new: first for pushes, then for media.

        `now`: Time by a monotonic clock, s.
        """
        below = self._files.below(self.campaign.raw.as_posix())
        now = time.monotonic() if now is None else now
        is_new = self._files.check_changes(dict.fromkeys([*self._settings(), *below]), now)
        if not (is_new or self._must_look_again):
            return
        self._must_look_again = False
        yield from self._reread()
        self.rows = {name: self._make_rows(name, below) for name in self.campaign.media_with_runs}
        for medium in list(self.media.values()):
            yield from self._withdraw_runs(medium, self.rows.get(medium.name, ()))
        self.media = {name: self.media.get(name) or LiveMedium(name) for name in self.rows}
        before = {name: dict(medium.keys) for name, medium in self.media.items()}
        clocks = self._session_clocks()
        for medium in self.media.values():
            yield from self._measure_runs(medium, clocks)
        changed = [name for name, medium in self.media.items() if medium.keys != before[name]]
        if changed:
            yield from self._report_media(changed)
        yield from self._report_unnamed(below)

    # --- config and run sheet

    def _settings(self) -> list[str]:
        """List the files on which all runs depend: config, run sheet, calibration, logs of the rigid contact."""
        config, raw = self.campaign.config, self.campaign.raw.as_posix()
        names, contact = [config.force_log.calibration], config.rigid_contact
        names += [contact.force_log, contact.motion_log] if contact else []
        config_and_sheet = [self.config.as_posix(), self.campaign.sheet.as_posix()]
        return config_and_sheet + [f"{raw}/{name}" for name in names if name]

    def _reread(self) -> Iterator[Event]:
        """Read config and run sheet again if they changed and are still; report new and solved problems."""
        stamps, before = self._files.stamps(self._settings()), self.campaign
        if stamps is None or stamps == self._read_from:
            return
        campaign, problems = check_campaign(self.config, good_rows=True)
        old_problems = self.problems
        self.problems = {
            str(problem): problem for problem in problems if problem.code not in _TEMPORARY
        }
        for text, problem in (old_problems | self.problems).items():
            if (text in old_problems) != (text in self.problems):
                facts = {
                    "row": problem.place.row,
                    "code": problem.code,
                    "severity": problem.severity,
                }
                yield Event("problem", facts | {"text": text, "solved": text in old_problems})
        if campaign is not None:
            self.campaign = campaign
            if campaign.config != before.config or stamps[2:] != (self._read_from or stamps)[2:]:
                self.media = {}  # results by other settings are not valid any more
        self._read_from = stamps

    def _make_rows(self, medium: str, below: list[str]) -> dict[str, _Row]:
        """Make the rows of a medium by run_id; `below`: files in the raw folder, among them those of bags."""
        rows, raw = {}, self.campaign.raw.as_posix()
        for run in self.campaign.runs_of(medium):
            names = (run.force_log, run.motion_log, run.zero_log)
            logs = {f"{raw}/{name}" for name in names if name}
            if bags := tuple(name.removesuffix(BAG) for name in logs if name.endswith(f"/{BAG}")):
                logs.update(name for name in below if name.startswith(bags))
            rows[run.run_id] = _Row(run, tuple(cells_of_run(run).values()), tuple(sorted(logs)))
        return rows

    # --- runs

    def _session_clocks(self) -> SessionClocks | None:
        """Estimate the clocks of sessions from pushes straight down whose files are still; None without estimate."""
        settings = self.campaign.config.clock
        if settings.method != "estimate":
            return None
        aligned = {}
        for medium, rows in self.rows.items():
            for name, row in rows.items():
                stamps = self._files.stamps(row.files)
                if (
                    row.run.excluded
                    or not goes_straight_down(row.run)
                    or None in (stamps or [None])
                ):
                    continue
                key = settings, row.cells, stamps
                before = self._aligned.get(name)
                if before is None or before[0] != key:
                    campaign_of_run = replace(self.campaign, runs=(row.run,))
                    before = key, align_medium(campaign_of_run, medium)
                aligned[name] = before
        self._aligned = aligned
        return SessionClocks.of_pushes([table for _, table in aligned.values()], settings)

    def _measure_runs(self, medium: LiveMedium, clocks: SessionClocks | None) -> Iterator[Event]:
        """Measure the runs whose files are still and whose inputs changed; yield an event for each.

        The fact "first" of an event is True for runs that are there at the first look at a medium.
        """
        rows, first = self.rows[medium.name], medium.alpha.empty
        stamps = {name: self._files.stamps(row.files) for name, row in rows.items()}
        plates = len({row.run.intruder for row in rows.values() if row.run.kind == "plate"})
        keys_to_measure = {}
        for name, row in rows.items():
            tare = rows.get(row.run.tare_run)
            tare_stamps = tare and stamps[tare.run.run_id]
            # a leg needs its tare, and a run that was already measured keeps its result until the tare is still
            waits = tare and tare_stamps is None and (row.run.kind == "leg" or name in medium.runs)
            sessions = {sheet_row.run.session for sheet_row in (row, tare) if sheet_row}
            session_clocks = clocks and tuple(
                clocks.of_session(label) for label in sorted(sessions)
            )
            key = (
                row.cells,
                stamps[name],
                tare and (tare.cells, tare_stamps),
                plates,
                session_clocks,
            )
            if stamps[name] is not None and not waits and medium.keys.get(name) != key:
                keys_to_measure[name] = key
        moving = [name for name, stamp in stamps.items() if stamp is None]
        for name, measured in measure(self.campaign, medium.name, keys_to_measure, moving, clocks):
            read = [rows[key] for key in (name, rows[name].run.tare_run) if key in rows]
            if any(stamps[row.run.run_id] not in (None, _stamps_now(row)) for row in read):
                continue  # its files changed while they were read: a later step measures it
            if not measured.is_of_the_log:
                self._must_look_again = True
                continue
            previous = medium.runs.get(name)
            medium.runs[name], medium.keys[name] = measured, keys_to_measure[name]
            facts = self.facts(medium, name)
            if facts["state"] == WAITING and previous and previous.is_read:
                yield _withdrawn_event(medium, name, "its log is gone")
                continue
            if facts["kind"] == "plate" and facts["state"] != WAITING:
                medium.last, medium.measured_at = name, time.time()
                medium.seconds = np.nan if first else facts["seconds_since_change"]
            yield Event("push", facts | {"first": first})

    def _withdraw_runs(self, medium: LiveMedium, rows: Collection[str]) -> Iterator[Event]:
        """Forget measured runs without a valid row, and yield an event for each."""
        for name in [name for name in medium.runs if name not in rows]:
            del medium.runs[name], medium.keys[name]
            yield _withdrawn_event(medium, name, "no row without an error names it")

    def state(self, medium: str, name: str) -> str:
        """Return the state of a run at this moment."""
        row, measured = self.rows[medium][name], self.media[medium].runs.get(name)
        stamps = self._files.stamps(row.files)
        if row.run.excluded:
            return EXCLUDED
        if measured is None or stamps is None:
            return GROWING
        if None in stamps:
            return WAITING
        tare = row.run.tare_run
        lacks_tare = tare in self.rows[medium] and self.state(medium, tare) in (WAITING, GROWING)
        if measured.is_read and measured.why and lacks_tare:
            return BARE
        return REFUSED if measured.why else MEASURED if row.run.kind == "plate" else READ

    def facts(self, medium: LiveMedium, name: str) -> dict[str, Any]:
        """Return the facts of an event about a run: state, alpha with its interval, flags, or why it has no number."""
        row, measured = self.rows[medium.name][name], medium.runs[name]
        run, fit = row.run, measured.rows.get("fits", {})
        numbers = [f"{angle}_deg" for angle in ("beta", "gamma")]
        numbers += [column(c, end) for c in "zx" for end in ("", "_lo", "_hi")]
        changed = max((stamp[1] / 1e9 for stamp in _stamps_now(row) if stamp), default=np.nan)
        return {
            "medium": medium.name,
            "run_id": name,
            "row": run.row,
            "kind": run.kind,
            "state": self.state(medium.name, name),
            "direction": run.direction,
            **{number: fit.get(number, np.nan) for number in numbers},
            "flags": [
                {"code": flag.code, "text": str(flag)}
                for flags in measured.flags.values()
                for flag in flags
            ],
            "reason": measured.why,
            "seconds_since_change": round(time.time() - changed, 3),
        }

    # --- media

    def _report_media(self, changed: Collection[str]) -> Iterator[Event]:
        """Check the media with new runs, estimate their maps, plan the next pushes; yield an event for each medium."""
        kept = {name for medium in self.media.values() for name in medium.runs}
        runs = [run for run in self.campaign.runs if run.run_id in kept]
        runs = [run for run in runs if run.kind != "leg" or run.tare_run in {"", *kept}]
        view = replace(self.campaign, runs=tuple(runs))
        results = Results(view)
        for medium in (self.media[name] for name in view.media_with_runs):
            if medium.name in changed:
                hold(results, medium, view.runs_of(medium.name))
                medium.checks, medium.alpha, *_, flags = checks(results, medium.name)
                fits = results.table(f"fits/{medium.name}.csv")
                medium.verdict = verdict_on(medium.checks, fits, Flags(flags))
            medium.checks = results.hold_as_csv(f"checks/{medium.name}.csv", medium.checks)
            medium.alpha = results.hold_as_csv(f"alpha/{medium.name}.csv", medium.alpha)
        for name in view.media_with_runs:
            if name in changed or view.config.maps.own_media:
                self._plan_pushes(results, self.media[name])
                yield Event("medium", self.summary(self.media[name]))

    def _plan_pushes(self, results: Results, medium: LiveMedium) -> None:
        """Estimate the map of a medium, and choose the next pushes, which determine the target best."""
        config, planned = results.config, results.config.grid.planned
        nodes = map_nodes(*zip(*planned, strict=True)) if planned else None
        shapes = results.shapes(medium.name)
        try:
            known_map = medium.map = results[medium.name].map()
            if planned:
                pushes = pushes_of(medium.alpha, config)
                known_map = estimate(pushes, shapes, nodes, confidence=known_map.confidence)
        except InputError:
            medium.map, known_map = None, prior_map(shapes, nodes)
        rig = Rig(tuple(planned), depths=len(config.fit.horizontal_depths_cm))
        medium.before, medium.width, medium.plan = medium.width, np.nan, None
        with suppress(ValueError):  # the target may have no number in this medium
            medium.plan = plan(
                self.target, known_map, rig, count=3, confidence=config.fit.confidence
            )
            medium.width = 100 * medium.plan.steps[0].typical

    def summary(self, medium: LiveMedium) -> dict[str, Any]:
        """Return the facts of an event about a medium: states of runs, verdict, failed checks, target, next pushes."""
        failed = medium.checks[medium.checks["verdict"] == FAILED]
        states = Counter(self.state(medium.name, name) for name in self.rows[medium.name])
        return {
            "medium": medium.name,
            "states": dict(states),
            "verdict": f"{medium.verdict.on(medium.name)}." if medium.verdict else "",
            "checks": failed[["check", "effect", "sentence"]].to_dict("records"),
            "target": medium.plan.target if medium.plan else "",
            "half_width_percent": medium.width,
            "before_percent": medium.before,
            "next": self.next_rows(medium),
        }

    def next_rows(self, medium: LiveMedium) -> list[dict[str, str]]:
        """Make rows of the run sheet for the next pushes and their tares, in the form of the last plate run."""
        runs = [run for run in self.campaign.runs if run.medium == medium.name]
        plate_runs = [run for run in runs if run.kind == "plate"]
        depths, rows = self.campaign.config.fit.horizontal_depths_cm, []
        names = (f"{medium.name}_{number:03d}" for number in count(1 + len(runs)))
        steps = medium.plan.steps[1:] if medium.plan and plate_runs else ()
        for push in chain.from_iterable(push_rows(step, depths) for step in steps):
            name, last_run = (
                next(name for name in names if name not in self.campaign.by_id),
                plate_runs[-1],
            )
            tare = f"{name}_rod" if last_run.tare_run and not last_run.tare_shared else ""
            for run_id, kind in ((name, "plate"), (tare, "rod"))[: 2 if tare else 1]:
                row = {"run_id": run_id, "kind": kind, "medium": medium.name} | push
                row |= {"intruder": last_run.intruder, "tare_run": tare if kind == "plate" else ""}
                for log in ("force_log", "motion_log"):
                    row[log] = getattr(last_run, log).replace(last_run.run_id, run_id)
                rows.append(row)
        return rows

    # --- files that no row names

    def _report_unnamed(self, below: list[str]) -> Iterator[Event]:
        """Report files that no row names, each with a row that would name it; these files are not opened."""
        if self._files.stamps(self._settings()) is None:
            return  # the run sheet is just being changed, and may soon name them
        raw, robot = self.campaign.raw.as_posix(), self.campaign.config.robot
        named_files = {
            file for rows in self.rows.values() for row in rows.values() for file in row.files
        }
        named_files |= {*self._settings(), f"{raw}/{REENACTED}", f"{raw}/README.md"}
        tracks = f"{raw}/{Path(robot.runs).parent}/" if robot and robot.runs else "\0"
        loose = [path for path in below if path not in named_files and not path.startswith(tracks)]
        most_reported = 20
        self.unnamed = {path: self.unnamed.get(path, {}) for path in loose[:most_reported]}
        for path, facts in self.unnamed.items():
            if facts or not self._files.stamps([path]):
                continue
            name = Path(path).relative_to(raw).as_posix()
            self.unnamed[path] = {"file": name, "row": self._guess_row(name)}
            yield Event("file", self.unnamed[path])

    def _guess_row(self, file: str) -> dict[str, str]:
        """Guess the cells of a row that would name a file, by the logs in other rows; empty if none is similar."""
        for run in self.campaign.runs:
            for key in ("force_log", "motion_log"):
                before, run_id, after = getattr(run, key).rpartition(run.run_id)
                named_alike = file.startswith(before) and file.endswith(after)
                name = file[len(before) : len(file) - len(after)]
                if run_id and named_alike and name and "/" not in name:
                    return {"run_id": name, key: file}
        return {}


def _stamps_now(row: _Row) -> tuple[Stamp, ...]:
    """Read the stamps of the files of a row."""
    return tuple(map(stamp_of, row.files))


def _withdrawn_event(medium: LiveMedium, name: str, why: str) -> Event:
    """Make the event of a run whose result is no longer valid."""
    return Event("withdrawn", {"medium": medium.name, "run_id": name, "why": why})
