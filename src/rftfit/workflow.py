"""What the Snakefile asks: which media, which logs, and digests of what Snakemake does not see."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from rftfit.__main__ import STAGES
from rftfit.campaign.load import Campaign, load_campaign
from rftfit.stages.chosen import stress_runs
from rftfit.store.digest import code_digest, digest_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rftfit.campaign.runs import Run


class Plan:
    """One campaign as the workflow sees it.

    Parameters
    ----------
    config : str or Path
        The campaign's configuration.

    Raises
    ------
    CampaignError
        If configuration or run sheet are not valid.
    """

    def __init__(self, config: str | Path) -> None:
        self.config = Path(config)
        self.campaign: Campaign = load_campaign(self.config)

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

    def logs(self, medium: str) -> list[str]:
        """Log files of a medium that exist, as paths from the campaign's folder.

        A missing one is not an error of the workflow: its run is dropped with that reason.

        Parameters
        ----------
        medium : str

        Returns
        -------
        list of str
        """
        raw = self.campaign.raw
        files = [
            file
            for run in self.campaign.runs_of(medium)
            for file in (run.force_log, run.motion_log)
        ]
        there = [raw / file for file in sorted(set(files)) if (raw / file).is_file()]
        root = self.campaign.root.resolve()
        return [path.resolve().relative_to(root).as_posix() for path in there]

    def rows(self, *media: str) -> str:
        """Digest of some media's rows of the run sheet; their order and numbers do not count.

        Parameters
        ----------
        *media : str
            All rows when none is named.

        Returns
        -------
        str
        """
        kept = [
            [
                str(getattr(run, name))
                for name in run.__dataclass_fields__
                if name not in ("row", "note")
            ]
            for run in self._runs(media)
        ]
        return digest_of(sorted(kept))

    def _runs(self, media: tuple[str, ...]) -> Iterable[Run]:
        if not media:
            return self.campaign.runs
        return [run for medium in media for run in self.campaign.runs_of(medium)]

    def settings(self, *sections: str) -> str:
        """Digest of sections of the configuration.

        Parameters
        ----------
        *sections : str
            Names of top-level keys; all when none is named.

        Returns
        -------
        str
        """
        whole = self.campaign.config.model_dump(mode="json")
        return digest_of({name: whole[name] for name in sections or whole})

    def code(self, *stages: str) -> str:
        """Digest of the code of stages.

        Parameters
        ----------
        *stages : str
            As in ``python -m rftfit STAGE``; all there are when none is named.

        Returns
        -------
        str
        """
        return code_digest(*(STAGES[name].partition(":")[0] for name in stages or STAGES))
