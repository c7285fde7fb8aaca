"""The watch: from files that are still to the verdict of each push, the map of its medium and the next push."""

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
from rftfit.model.shapes import estimate, map_nodes, pushes_of
from rftfit.results import Results
from rftfit.workflow.measure import checks
from rftfit.workflow.state import cells

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

_NEXT = 3
_MOST_UNNAMED = 20
"""Files that no row names: so many are told."""

_PASSING = ("sheet.log-missing", "sheet.tare-unused", "sheet.no-plate", "sheet.only-straight-down")
"""Warnings of the run sheet that hold until the last run is made."""


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
        self._has_to_look_again = False
        self._aligned: dict[str, tuple[Any, pd.DataFrame]] = {}

    def step(self, now: float | None = None) -> Iterator[Event]:
        """Look at all files once; tell what is new, the push's own verdict first, then map and plan."""
        below = self._files.below(self.campaign.raw.as_posix())
        now = time.monotonic() if now is None else now
        is_new = self._files.check_changes(dict.fromkeys([*self._settings(), *below]), now)
        if not (is_new or self._has_to_look_again):
            return
        self._has_to_look_again = False
        yield from self._reread()
        self.rows = {name: self._rows_of(name, below) for name in self.campaign.media_with_runs}
        for medium in list(self.media.values()):
            yield from self._withdraw(medium, self.rows.get(medium.name, ()))
        self.media = {name: self.media.get(name) or LiveMedium(name) for name in self.rows}
        before = {name: dict(medium.keys) for name, medium in self.media.items()}
        clocks = self._session_clocks()
        for medium in self.media.values():
            yield from self._measure(medium, clocks)
        changed = [name for name, medium in self.media.items() if medium.keys != before[name]]
        if changed:
            yield from self._tell_media(changed)
        yield from self._tell_unnamed(below)

    # --- config and run sheet

    def _settings(self) -> list[str]:
        """Files that all runs depend on: config and run sheet first."""
        config, raw = self.campaign.config, self.campaign.raw.as_posix()
        names, contact = [config.force_log.calibration], config.rigid_contact
        names += [contact.force_log, contact.motion_log] if contact else []
        config_and_sheet = [self.config.as_posix(), self.campaign.sheet.as_posix()]
        return config_and_sheet + [f"{raw}/{name}" for name in names if name]

    def _reread(self) -> Iterator[Event]:
        """Read config and run sheet again where they changed and are still."""
        stamps, before = self._files.stamps(self._settings()), self.campaign
        if stamps is None or stamps == self._read_from:
            return
        campaign, problems = check_campaign(self.config, good_rows=True)
        old_problems = self.problems
        self.problems = {
            str(problem): problem for problem in problems if problem.code not in _PASSING
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
                self.media = {}  # nothing that was measured with other settings holds
        self._read_from = stamps

    def _rows_of(self, medium: str, below: list[str]) -> dict[str, _Row]:
        rows, raw = {}, self.campaign.raw.as_posix()
        for run in self.campaign.runs_of(medium):
            names = (run.force_log, run.motion_log, run.zero_log)
            logs = {f"{raw}/{name}" for name in names if name}
            if bags := tuple(name.removesuffix(BAG) for name in logs if name.endswith(f"/{BAG}")):
                logs.update(name for name in below if name.startswith(bags))
            rows[run.run_id] = _Row(run, tuple(cells(run).values()), tuple(sorted(logs)))
        return rows

    # --- runs

    def _session_clocks(self) -> SessionClocks | None:
        """Clocks of the sessions by the pushes straight down whose files are still; None where they are not estimated."""
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

    def _measure(self, medium: LiveMedium, clocks: SessionClocks | None) -> Iterator[Event]:
        """Measure the runs whose files are still and not those that were measured; tell each."""
        rows, first = self.rows[medium.name], medium.alpha.empty
        stamps = {name: self._files.stamps(row.files) for name, row in rows.items()}
        plates = len({row.run.intruder for row in rows.values() if row.run.kind == "plate"})
        keys_to_measure = {}
        for name, row in rows.items():
            tare = rows.get(row.run.tare_run)
            tare_stamps = tare and stamps[tare.run.run_id]
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
                continue  # written while it was read: it is measured when it is still
            if not measured.is_of_the_log:
                self._has_to_look_again = True
                continue
            previous = medium.runs.get(name)
            medium.runs[name], medium.keys[name] = measured, keys_to_measure[name]
            facts = self.facts(medium, name)
            if facts["state"] == WAITING and previous and previous.is_read:
                yield _withdrawn(medium, name, "its log is gone")
                continue
            if facts["kind"] == "plate" and facts["state"] != WAITING:
                medium.last, medium.measured_at = name, time.time()
                medium.seconds = np.nan if first else facts["seconds_since_change"]
            yield Event("push", facts | {"first": first})

    def _withdraw(self, medium: LiveMedium, rows: Collection[str]) -> Iterator[Event]:
        for name in [name for name in medium.runs if name not in rows]:
            del medium.runs[name], medium.keys[name]
            yield _withdrawn(medium, name, "no row without an error names it")

    def state(self, medium: str, name: str) -> str:
        """State of a run by now."""
        row, measured = self.rows[medium][name], self.media[medium].runs.get(name)
        stamps = self._files.stamps(row.files)
        if row.run.excluded:
            return EXCLUDED
        if measured is None or stamps is None:
            return GROWING
        if None in stamps:
            return WAITING
        tare = row.run.tare_run
        bare = tare in self.rows[medium] and self.state(medium, tare) in (WAITING, GROWING)
        if measured.is_read and measured.why and bare:
            return BARE
        return REFUSED if measured.why else MEASURED if row.run.kind == "plate" else READ

    def facts(self, medium: LiveMedium, name: str) -> dict[str, Any]:
        """What is told of a run: its state, alpha with its interval, flags, or why there is no number."""
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

    def _tell_media(self, changed: Collection[str]) -> Iterator[Event]:
        """Check the media with new runs, then estimate their maps and plan the next pushes."""
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
                self._plan(results, self.media[name])
                yield Event("medium", self.summary(self.media[name]))

    def _plan(self, results: Results, medium: LiveMedium) -> None:
        """Estimate the map of a medium, and choose the pushes that tell most of what it does not tell yet."""
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
        with suppress(ValueError):  # of a target that has no number in this medium
            medium.plan = plan(self.target, known_map, rig, _NEXT, config.fit.confidence)
            medium.width = 100 * medium.plan.steps[0].typical

    def summary(self, medium: LiveMedium) -> dict[str, Any]:
        """What is told of a medium: the verdict on its data, its failed checks, how well its target is known, the next pushes as rows."""
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
        """Rows of the run sheet for the next pushes, like that of the last one, its tare with them."""
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

    def _tell_unnamed(self, below: list[str]) -> Iterator[Event]:
        """Report the files that no row names, none of which is opened, and a row that would name each."""
        if self._files.stamps(self._settings()) is None:
            return  # a row for them may be in the sheet that is being written
        raw, robot = self.campaign.raw.as_posix(), self.campaign.config.robot
        named_files = {
            file for rows in self.rows.values() for row in rows.values() for file in row.files
        }
        named_files |= {*self._settings(), f"{raw}/{REENACTED}", f"{raw}/README.md"}
        tracks = f"{raw}/{Path(robot.runs).parent}/" if robot and robot.runs else "\0"
        loose = [path for path in below if path not in named_files and not path.startswith(tracks)]
        self.unnamed = {path: self.unnamed.get(path, {}) for path in loose[:_MOST_UNNAMED]}
        for path, facts in self.unnamed.items():
            if facts or not self._files.stamps([path]):
                continue
            name = Path(path).relative_to(raw).as_posix()
            self.unnamed[path] = {"file": name, "row": self._row_by_name(name)}
            yield Event("file", self.unnamed[path])

    def _row_by_name(self, file: str) -> dict[str, str]:
        """Cells of a row that would name a file, as rows of the sheet name theirs; empty where none is alike."""
        for run in self.campaign.runs:
            for key in ("force_log", "motion_log"):
                before, run_id, after = getattr(run, key).rpartition(run.run_id)
                named_alike = file.startswith(before) and file.endswith(after)
                name = file[len(before) : len(file) - len(after)]
                if run_id and named_alike and name and "/" not in name:
                    return {"run_id": name, key: file}
        return {}


def _stamps_now(row: _Row) -> tuple[Stamp, ...]:
    return tuple(map(stamp_of, row.files))


def _withdrawn(medium: LiveMedium, name: str, why: str) -> Event:
    return Event("withdrawn", {"medium": medium.name, "run_id": name, "why": why})
