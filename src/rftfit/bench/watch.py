"""The watch of a campaign: which runs are measured when; states of runs; map, next pushes, events.

`Watch.step` looks at all files once and yields events (`rftfit.bench.events`) on what is new. A file is *still* when its
stamp (size and time of change) has been the same for some time: only then a log is complete and may be read. A run is
measured when its files and those of its tare (the run of the rod alone that is subtracted) are still, and again when
one of its inputs changes. Nothing is written below ``results/``, but tables have the numbers that `rftfit run` would write.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
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

# states of a run, as `Watch.state` returns them
MEASURED = "measured"  # a push with alpha
WAITING = "waiting"  # a file is not there yet
GROWING = "growing"  # files still change, or the run is not measured yet
UNTARED = "not tared yet"  # its logs are read, and files of its tare are absent or still change
REFUSED = "no alpha"  # measured, with a reason why it has no number
EXCLUDED = "excluded"  # the run sheet leaves it out
READ = "read"  # a rod or leg whose logs were read

_TEMPORARY = (
    "sheet.log-missing",
    "sheet.tare-unused",
    "sheet.no-plate",
    "sheet.only-straight-down",
)
"""Codes of warnings about the run sheet that are usual until the last run is made, and not reported."""


class _Row(NamedTuple):
    """A run of the run sheet, the cells of its row that results depend on, and the paths of its files (with the raw folder)."""

    run: Run
    cells: tuple[str, ...]
    files: tuple[str, ...]

    def stamps_now(self) -> tuple[Stamp, ...]:
        """Read the stamps of the files from the disk, at this moment."""
        return tuple(map(stamp_of, self.files))


class Watch:
    """A campaign that is watched; each call of `step` looks once at its files.

    `config`: Path of the config.
    `wait_s`: Time after which a file without changes is read, s.
    `target`: What the next pushes shall tell: a quantity, or the name of one (`rftfit.forces.planning.plan`).
    `campaign`: Config and run sheet, as last read without an error.
    `media`: Results by medium.
    `rows`: Rows of the run sheet by medium and run_id.
    `problems`: Problems of config and run sheet by their text.
    `unnamed`: Facts about each file that no row names, by path; empty facts while the file still changes.
    """

    def __init__(self, config: Path, wait_s: float = 1.0, target: Target | str = "map") -> None:
        self.config, self.target = config.absolute(), target
        self.media: dict[str, LiveMedium] = {}
        self.rows: dict[str, dict[str, _Row]] = {}
        self.problems: dict[str, Problem] = {}
        self.unnamed: dict[str, dict[str, Any]] = {}
        self._files = Files(wait_s)
        # stamps of config, run sheet and the other settings when they were read
        self._read_from: tuple[Stamp, ...] | None = None
        campaign, problems = check_campaign(self.config, good_rows=True)
        if campaign is None:
            raise CampaignError(problems)
        if campaign.numbers:
            raise InputError(f"{campaign.sheet}: a table has no logs, so there is none to wait for")
        self.campaign: Campaign = campaign
        # True where the next step has work although no file has changed
        self._must_look_again = False
        # run_id of each push straight down, to what its clocks were estimated from, and the estimate
        self._aligned: dict[str, tuple[Any, pd.DataFrame]] = {}

    def step(self, now: float | None = None) -> Iterator[Event]:
        """Look at all files once; yield events on all that is new: problems, then pushes, media, files that no row names.

        `now`: Time by a monotonic clock, s; None: that of this moment.
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
        keys_before = {name: dict(medium.keys) for name, medium in self.media.items()}
        clocks = self._session_clocks()
        for medium in self.media.values():
            yield from self._measure_runs(medium, clocks)
        changed = [name for name, medium in self.media.items() if medium.keys != keys_before[name]]
        if changed:
            yield from self._report_media(changed)
        yield from self._report_unnamed(below)

    # --- config and run sheet

    def _settings(self) -> list[str]:
        """List the files on which all runs depend, config and run sheet first.

        The others are the calibration of the transducer and the logs of a push against a rigid block, where the config
        names them.
        """
        config, raw = self.campaign.config, self.campaign.raw.as_posix()
        in_raw, contact = [config.force_log.calibration], config.rigid_contact
        in_raw += [contact.force_log, contact.motion_log] if contact else []
        config_and_sheet = [self.config.as_posix(), self.campaign.sheet.as_posix()]
        return config_and_sheet + [f"{raw}/{name}" for name in in_raw if name]

    def _reread(self) -> Iterator[Event]:
        """Read config and run sheet again if they changed and are still; yield an event for each new or solved problem.

        Results by other settings are forgotten, so that all runs are measured again.
        """
        stamps, before = self._files.stamps(self._settings()), self.campaign
        if stamps is None or stamps == self._read_from:
            return
        campaign, problems = check_campaign(self.config, good_rows=True)
        old_problems = self.problems
        self.problems = {
            str(problem): problem for problem in problems if problem.code not in _TEMPORARY
        }
        for text, problem in (old_problems | self.problems).items():
            # a problem of both times is no news
            if (text in old_problems) != (text in self.problems):
                facts = {"row": problem.place.row, "code": problem.code}
                facts |= {"severity": problem.severity, "text": text}
                yield Event("problem", facts | {"solved": text in old_problems})
        if campaign is not None:
            self.campaign = campaign
            # stamps behind those of config and run sheet, whose content was compared, are of calibration and contact
            if campaign.config != before.config or stamps[2:] != (self._read_from or stamps)[2:]:
                self.media = {}  # results by other settings are not valid any more
        self._read_from = stamps

    def _make_rows(self, medium: str, below: list[str]) -> dict[str, _Row]:
        """Make the rows of a medium by run_id; `below`: paths of all files in the raw folder and below.

        A ROS bag is a folder of files, one of which the run sheet names: the others are found in `below`.
        """
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
        """Estimate the clocks of sessions from pushes straight down whose files are still.

        Force log and motion log have clocks of their own; pushes straight down show the offset, which a session shares. Each
        push is aligned once and kept until its inputs change. None where the config asks for no estimate.
        """
        settings = self.campaign.config.clock
        if settings.method != "estimate":
            return None
        # by run_id: settings, cells and stamps that a push was aligned by, and its row of the table of clocks
        aligned: dict[str, tuple[Any, pd.DataFrame]] = {}
        for medium, rows in self.rows.items():
            for run_id, row in rows.items():
                stamps = self._files.stamps(row.files)
                are_still = stamps is not None and None not in stamps
                if not are_still or row.run.excluded or not goes_straight_down(row.run):
                    continue
                inputs = settings, row.cells, stamps
                if run_id in self._aligned and self._aligned[run_id][0] == inputs:
                    aligned[run_id] = self._aligned[run_id]
                else:
                    campaign_of_run = replace(self.campaign, runs=(row.run,))
                    aligned[run_id] = inputs, align_medium(campaign_of_run, medium)
        self._aligned = aligned
        return SessionClocks.of_pushes([table for _, table in aligned.values()], settings)

    def _measure_runs(self, medium: LiveMedium, clocks: SessionClocks | None) -> Iterator[Event]:
        """Measure the runs whose files are still and whose inputs changed; yield an event for each; results go into `medium`.

        The fact "first" of an event is True for runs that are there at the first look at a medium: they are no news.
        `clocks`: Clocks of the sessions; None: none are estimated.
        """
        rows, first = self.rows[medium.name], medium.alpha.empty
        # None for a run with a file that still changes
        stamps = {run_id: self._files.stamps(row.files) for run_id, row in rows.items()}
        keys_to_measure = self._changed_keys(medium, stamps, clocks)
        moving = [run_id for run_id, stamps_of_run in stamps.items() if stamps_of_run is None]
        for run_id, measured in measure(
            self.campaign, medium.name, keys_to_measure, moving, clocks
        ):
            run_and_tare = {run_id, rows[run_id].run.tare_run} & rows.keys()
            # files of the run, or of a tare that was still, changed while they were read: a later step measures it
            if any(stamps[key] not in (None, rows[key].stamps_now()) for key in run_and_tare):
                continue
            if measured.lacked_handle:
                self._must_look_again = True
                continue
            previous = medium.runs.get(run_id)
            medium.runs[run_id], medium.keys[run_id] = measured, keys_to_measure[run_id]
            facts = self.facts(medium, run_id)
            # it was read before, and now a file is absent
            if facts["state"] == WAITING and previous and previous.is_read:
                yield _withdrawn_event(medium, run_id, "its log is gone")
                continue
            if facts["kind"] == "plate" and facts["state"] != WAITING:
                medium.last, medium.measured_at = run_id, time.time()
                medium.seconds = np.nan if first else facts["seconds_since_change"]
            yield Event("push", facts | {"first": first})

    def _changed_keys(
        self,
        medium: LiveMedium,
        stamps: Mapping[str, tuple[Stamp, ...] | None],
        clocks: SessionClocks | None,
    ) -> dict[str, Any]:
        """Return by run_id the inputs (`LiveMedium.keys`) of the runs to be measured now: still, and other than before.

        `stamps`: Stamps of the files of each run of the medium; None while one of them still changes.
        """
        rows = self.rows[medium.name]
        # runs of a medium with several plates are flagged, with their number
        plates = len({row.run.intruder for row in rows.values() if row.run.kind == "plate"})
        changed_keys = {}
        for run_id, row in rows.items():
            # the row of its tare; None without one, and then `tare and ...` is None, too
            tare = rows.get(row.run.tare_run)
            tare_stamps = tare and stamps[tare.run.run_id]
            # a leg needs its tare, and a run that was already measured keeps its result until the tare is still
            waits = (
                tare and tare_stamps is None and (row.run.kind == "leg" or run_id in medium.runs)
            )
            # the runs may be of two sessions, each with clocks of its own
            sessions = sorted({row.run.session, tare.run.session if tare else row.run.session})
            session_clocks = clocks and [clocks.of_session(label) for label in sessions]
            tare_key = tare and (tare.cells, tare_stamps)
            key = row.cells, stamps[run_id], tare_key, plates, session_clocks
            if stamps[run_id] is not None and not waits and medium.keys.get(run_id) != key:
                changed_keys[run_id] = key
        return changed_keys

    def _withdraw_runs(self, medium: LiveMedium, rows: Collection[str]) -> Iterator[Event]:
        """Forget measured runs without a valid row in the run sheet, and yield an event for each.

        `rows`: run_ids of the medium with a valid row.
        """
        for run_id in [run_id for run_id in medium.runs if run_id not in rows]:
            del medium.runs[run_id], medium.keys[run_id]
            yield _withdrawn_event(medium, run_id, "no row without an error names it")

    def state(self, medium: str, run_id: str) -> str:
        """Return the state of a run at this moment, one of the constants at the top."""
        row, measured = self.rows[medium][run_id], self.media[medium].runs.get(run_id)
        stamps = self._files.stamps(row.files)
        if row.run.excluded:
            return EXCLUDED
        if measured is None or stamps is None:
            return GROWING
        if None in stamps:
            return WAITING
        if not measured.why:
            return MEASURED if row.run.kind == "plate" else READ
        tare = row.run.tare_run
        lacks_tare = tare in self.rows[medium] and self.state(medium, tare) in (WAITING, GROWING)
        return UNTARED if measured.is_read and lacks_tare else REFUSED

    def facts(self, medium: LiveMedium, run_id: str) -> dict[str, Any]:
        """Return the facts of an event about a run: state, alpha with its interval, flags, or why it has no number.

        Alpha (``alpha_z_N_per_cm3``, with ``_lo`` and ``_hi``) is NaN without a number. ``seconds_since_change`` is the time
        since its newest file changed. `run_id`: Of a measured run.
        """
        row, measured = self.rows[medium.name][run_id], medium.runs[run_id]
        run, fit = row.run, measured.rows.get("fits", {})
        columns_of_fit = ["beta_deg", "gamma_deg"]
        columns_of_fit += [column(c, end) for c in "zx" for end in ("", "_lo", "_hi")]
        # a stamp is the size of a file and the time of its last change, ns
        change_times_s = (stamp[1] / 1e9 for stamp in row.stamps_now() if stamp)
        changed_s = max(change_times_s, default=np.nan)
        return {
            "medium": medium.name,
            "run_id": run_id,
            "row": run.row,
            "kind": run.kind,
            "state": self.state(medium.name, run_id),
            "direction": run.direction,
            **{name: fit.get(name, np.nan) for name in columns_of_fit},
            "flags": [
                {"code": flag.code, "text": str(flag)}
                for flag in chain.from_iterable(measured.flags.values())
            ],
            "reason": measured.why,
            "seconds_since_change": round(time.time() - changed_s, 3),
        }

    # --- media

    def _report_media(self, changed: Collection[str]) -> Iterator[Event]:
        """Check the media with new runs, estimate their maps, plan the next pushes; yield an event for each medium.

        `changed`: Names of these media. Where maps learn from the campaign's own media, all maps are estimated anew.
        """
        measured = {run_id for medium in self.media.values() for run_id in medium.runs}
        runs = [run for run in self.campaign.runs if run.run_id in measured]
        # a view of the campaign with the measured runs alone; a leg without its tare has no force
        runs = [run for run in runs if run.kind != "leg" or run.tare_run in {"", *measured}]
        view = replace(self.campaign, runs=tuple(runs))
        results = Results(view)
        # tables of all media first, since a map may need those of the others
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
        """Estimate the map of a medium, and choose the next three pushes, after which the target is known best.

        They go into `medium`: `map`, `plan`, `width` and `before`. Without a push the map is what known media let expect.
        """
        config, planned = results.config, results.config.grid.planned
        confidence = config.fit.confidence
        # nodes are the directions of a map: the next push is one of those that the config plans, so the map for it has these
        nodes = map_nodes(*zip(*planned, strict=True)) if planned else None
        shapes = results.shapes(medium.name)
        try:
            current_map = medium.map = results[medium.name].map()
            if planned:
                pushes = pushes_of(medium.alpha, config)
                current_map = estimate(pushes, shapes, nodes, confidence=confidence)
        except InputError:
            medium.map, current_map = None, prior_map(shapes, nodes)
        rig = Rig(planned, depths=len(config.fit.horizontal_depths_cm))
        medium.before, medium.width, medium.plan = medium.width, np.nan, None
        with suppress(ValueError):  # the target may have no number in this medium
            medium.plan = plan(self.target, current_map, rig, count=3, confidence=confidence)
            medium.width = 100 * medium.plan.steps[0].overall

    def summary(self, medium: LiveMedium) -> dict[str, Any]:
        """Return the facts of an event about a medium: states of runs, verdict, failed checks, target, next pushes.

        ``half_width_percent`` is that of the target now, ``before_percent`` before the last push.
        """
        failed = medium.checks[medium.checks["verdict"] == FAILED]
        states = Counter(self.state(medium.name, run_id) for run_id in self.rows[medium.name])
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
        """Make rows of the run sheet, a dict of cells each, for the next pushes and their tares, like that of the last push.

        Their run_ids are new, and names of logs are those of the last plate run with the new run_id in them.
        """
        runs = [run for run in self.campaign.runs if run.medium == medium.name]
        plate_runs = [run for run in runs if run.kind == "plate"]
        if not medium.plan or not plate_runs:
            return []
        last_run, depths = plate_runs[-1], self.campaign.config.fit.horizontal_depths_cm
        new_ids = (f"{medium.name}_{number:03d}" for number in count(1 + len(runs)))
        free_ids = (new_id for new_id in new_ids if new_id not in self.campaign.by_id)
        # the first step is the state before any of the next pushes
        pushes = chain.from_iterable(push_rows(step, depths) for step in medium.plan.steps[1:])
        rows = []
        # free run_ids never end
        for push, push_id in zip(pushes, free_ids, strict=False):
            tare = f"{push_id}_rod" if last_run.tare_run and not last_run.tare_shared else ""
            # without a tare the second row has no run_id, and is left out
            for run_id, kind, tare_run in ((push_id, "plate", tare), (tare, "rod", "")):
                row = {"run_id": run_id, "kind": kind, "medium": medium.name} | push
                row |= {"intruder": last_run.intruder, "tare_run": tare_run}
                for log in ("force_log", "motion_log"):
                    row[log] = getattr(last_run, log).replace(last_run.run_id, run_id)
                if run_id:
                    rows.append(row)
        return rows

    # --- files that no row names

    def _report_unnamed(self, below: list[str]) -> Iterator[Event]:
        """Report files that no row names, each once, with a row that would name it; these files are not opened.

        `below`: Paths of all files in the raw folder and below.
        """
        if self._files.stamps(self._settings()) is None:
            return  # the run sheet is just being changed, and may soon name them
        raw, robot = self.campaign.raw.as_posix(), self.campaign.config.robot
        named_files = {
            file for rows in self.rows.values() for row in rows.values() for file in row.files
        }
        named_files |= {*self._settings(), f"{raw}/{REENACTED}", f"{raw}/README.md"}
        # tracks of the robot are named by their own sheet; no path starts with \0, the text for "no tracks"
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
        """Guess the cells of a row that would name a file, by the logs in other rows; empty if none is similar.

        Next to ``force/p01_f.csv`` of run ``p01`` the file ``force/p02_f.csv`` is the force log of a run ``p02``.
        """
        for run in self.campaign.runs:
            for key in ("force_log", "motion_log"):
                # logs of other runs differ from this one in the run_id within their names
                before, run_id, after = getattr(run, key).rpartition(run.run_id)
                is_alike = run_id and file.startswith(before) and file.endswith(after)
                new_id = file[len(before) : len(file) - len(after)]
                if is_alike and new_id and "/" not in new_id:
                    return {"run_id": new_id, key: file}
        return {}


def _withdrawn_event(medium: LiveMedium, run_id: str, why: str) -> Event:
    """Make the event of a run whose result is no longer valid; `why`: the reason."""
    return Event("withdrawn", {"medium": medium.name, "run_id": run_id, "why": why})
