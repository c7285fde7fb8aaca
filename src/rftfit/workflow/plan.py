"""What the Snakefile asks: which media, which logs, and digests of what Snakemake does not see."""

from __future__ import annotations

import atexit
import json
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rftfit.__main__ import STAGES
from rftfit.campaign.load import Campaign, load_campaign
from rftfit.store.digests import closure, code_digest, digest_of
from rftfit.workflow.figures import stress_runs
from rftfit.workflow.provenance import (
    digests_of_logs,
    foreign_dialects,
    graph_of,
    log_names,
    logs_seen,
    raw_digest,
    rows_digest,
    settings_digest,
)
from rftfit.workflow.robot import trials_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rftfit.logs.registry import Origin
    from rftfit.store.digests import Seen


_READS_LOGS = "rftfit.logs.registry"
"""Whoever imports it reads logs, with the dialects of other packages too."""


class Plan:
    """One campaign as the workflow sees it.

    `config`: The campaign's configuration.
    """

    def __init__(self, config: str | Path) -> None:
        self.config = Path(config)
        self.campaign: Campaign = load_campaign(self.config)
        self._meanings: dict[tuple[str, str], tuple[str, ...]] = {}
        self._digests: dict[str, str] = {}

    @cached_property
    def media(self) -> list[str]:
        """Media of the config that have runs, in the config's order."""
        there = set(self.campaign.media_with_runs)
        return [name for name in self.campaign.config.media if name in there]

    @cached_property
    def laboratory(self) -> list[str]:
        """Those measured over the grid."""
        return self._of_role("laboratory")

    @cached_property
    def sands(self) -> list[str]:
        """Those with one penetration test."""
        return self._of_role("natural_sand")

    @cached_property
    def legged(self) -> list[str]:
        """Laboratory media in which legs were turned."""
        return [name for name in self.laboratory if self._has_legs(name)]

    @cached_property
    def legged_sands(self) -> list[str]:
        """Natural sands in which legs were turned."""
        return [name for name in self.sands if self._has_legs(name)]

    def _has_legs(self, medium: str) -> bool:
        return any(run.kind == "leg" for run in self.campaign.runs_of(medium))

    def _of_role(self, role: str) -> list[str]:
        media = self.campaign.config.media
        return [name for name in self.media if media[name].role == role]

    @cached_property
    def stress_media(self) -> list[str]:
        """Media of the runs in the stress figure."""
        runs = self.campaign.by_id
        wanted = {runs[name].medium for name in stress_runs(self.campaign)}
        return [name for name in self.media if name in wanted]

    @cached_property
    def robot_medium(self) -> str:
        """Medium that the campaign's robot runs on; empty where there is none or no run on it."""
        robot = self.campaign.config.robot
        return robot.medium if robot is not None and robot.medium in self.laboratory else ""

    @cached_property
    def robot_file(self) -> list[str]:
        """The robot's own file, from the campaign's folder; none where it is the program's."""
        robot = self.campaign.config.robot
        return [robot.file] if self.robot_medium and robot is not None and robot.file else []

    @cached_property
    def robot_files(self) -> list[str]:
        """What its measured speeds are made from: its file, sheet and tracks that exist."""
        robot = self.campaign.config.robot
        if not self.robot_medium or robot is None or robot.runs is None:
            return self.robot_file
        sheet = self.campaign.raw / robot.runs
        paths = [sheet, *(sheet.parent / trial.track for trial in trials_of(self.campaign))]
        root = self.campaign.root.resolve()
        there = [path.resolve().relative_to(root).as_posix() for path in paths if path.is_file()]
        return [*self.robot_file, *there]

    def logs(self, medium: str) -> list[str]:
        """Log files of a medium that exist, as paths from the campaign's folder.

        A missing one is not an error of the workflow: its run is dropped with that reason.
        """
        raw = self.campaign.raw
        names = log_names(self.campaign, medium)
        # Snakemake takes braces for wildcards; such a log is watched by its content alone
        plain = [name for name in names if "{" not in name and "}" not in name]
        there = [raw / name for name in plain if (raw / name).is_file()]
        root = self.campaign.root.resolve()
        return [path.resolve().relative_to(root).as_posix() for path in there]

    def raw(self, *media: str) -> str:
        """Digest of the content of some media's logs: a date put back does not hide a change.

        `*media`: All logs when none is named; an empty name stands for runs that belong to no
        medium.
        """
        chosen = media or (*self.media, "")
        names = [name for medium in chosen for name in log_names(self.campaign, medium)]
        new = [name for name in names if name not in self._digests]
        self._digests |= digests_of_logs(self.campaign, new, self._seen)
        return self._told(
            "raw", chosen, raw_digest(media, {name: self._digests[name] for name in names})
        )

    def content(self, files: Sequence[str]) -> str:
        """Digest of the content of files that are no logs of runs.

        `files`: From the campaign's folder.
        """
        paths = {f"{self.campaign.root}/{file}": file for file in files}
        return digest_of(
            sorted((paths[path], found) for path, found in self._seen.digests(paths).items())
        )

    @cached_property
    def _seen(self) -> Seen:
        seen = logs_seen(self.campaign)
        # when Snakemake ends, not after each medium
        atexit.register(seen.save)
        return seen

    def rows(self, *media: str) -> str:
        """Digest of some media's rows of the run sheet; their order and numbers do not count.

        `*media`: All rows when none is named.
        """
        return self._told("rows", media or (*self.media, ""), rows_digest(self.campaign, media))

    def settings(self, *sections: str) -> str:
        """Digest of sections of the configuration.

        `*sections`: Names of top-level keys; all when none is named.
        """
        whole = tuple(type(self.campaign.config).model_fields)
        digest = settings_digest(self.campaign.config, sections)
        return self._told("settings", sections or whole, digest)

    def code(self, *stages: str) -> str:
        """Digest of the code of stages.

        `*stages`: As in ``python -m rftfit STAGE``; all there are when none is named.
        """
        names = dict.fromkeys(STAGES[name].partition(":")[0] for name in stages or STAGES)
        if self._dialects and _READS_LOGS in closure(*names):
            names |= dict.fromkeys(origin.module for origin in self._dialects.values())
        return self._told("code", tuple(names), code_digest(*names))

    def dialects(self) -> str:
        """Name the packages whose dialects the logs are read with; empty where there are none.

        Their code is part of `code`; this is for changes of version alone.
        """
        return "; ".join(
            f"{name}: {origin.package} {origin.version}" for name, origin in self._dialects.items()
        )

    @cached_property
    def _dialects(self) -> dict[str, Origin]:
        return foreign_dialects(self.campaign.config)

    def _told(self, what: str, names: Sequence[str], digest: str) -> str:
        self._meanings[what, digest] = tuple(names)
        return digest

    def steps(self, rules: Iterable[Any], targets: Iterable[str]) -> str:
        """Describe which rule makes which result from what.

        `rules`: The workflow's. `targets`: Results. Returns JSON of
        `rftfit.workflow.provenance.Graph.packed`.
        """
        graph = graph_of(
            rules, sorted(targets), self.media, lambda what, digest: self._meanings[what, digest]
        )
        return json.dumps(graph.packed(), sort_keys=True, separators=(",", ":"))
