"""Which runs the re-enacted lab makes: one `Run` for each row of the run sheet."""

from __future__ import annotations

import difflib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rftfit import reference
from rftfit.campaign.config import Config, Leg, Plate
from rftfit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

BETAS_DEG = (-60, -30, 0, 30, 60, 90)
"""The physically different plates: -90 and 90 degrees are one and the same."""

TANGENTS = (1 / 3, 2 / 3, 1.0, 3 / 2, 3.0, np.inf)
"""tan gamma of the paths on the way down."""

AIR = "air"
"""Folder of the legs turned in air, which serve every medium."""

LEG_OF_CURVATURE = {1.0: "c_leg", 0.0: "flat_leg", -1.0: "reversed_c_leg"}

_DAY_STARTS_S = 28800.0
_RUN_EVERY_S = 150.0


@dataclass(frozen=True)
class Run:
    """One run of the campaign; angles and depth as in the run sheet, None where blank there.

    Attributes
    ----------
    run_id : str
    kind : {"plate", "rod", "leg", "leg_air"}
    medium, published : str
        Key of the config's media, and its name in the published tables; empty in air.
    intruder : str
        Key of the config's intruders; of a rod run, that of its plate.
    direction : {"intrusion", "extraction", "horizontal", "rotation"}
    beta_deg : float or None
        Angle at which the plate is held; None for a leg.
    gamma_deg : float or None
        Angle of the path on the way down, also of an extraction; None for a leg.
    depth_cm : float or None
        Of a horizontal run.
    tare_run : str
        run_id of the tare; empty for a run that is a tare itself.
    tare_shared : bool
        Whether other runs use the same tare.
    leg : str
        Name in `reference.LEGS`; empty for plate and rod.
    natural : bool
        Whether the medium is a natural sand.
    note : str
    clock_s : float
        Earliest start on the force log's clock, s since midnight.
    """

    run_id: str
    kind: str
    medium: str
    published: str
    intruder: str
    direction: str
    beta_deg: float | None = None
    gamma_deg: float | None = None
    depth_cm: float | None = None
    tare_run: str = ""
    tare_shared: bool = False
    leg: str = ""
    natural: bool = False
    note: str = ""
    clock_s: float = 0.0

    @property
    def folder(self) -> str:
        """Folder of the run's logs inside raw."""
        return self.medium or AIR

    @property
    def force_log(self) -> str:
        """Path of the force log relative to raw."""
        return f"{self.folder}/{self.run_id}_force.csv"

    @property
    def motion_log(self) -> str:
        """Path of the motion log relative to raw."""
        return f"{self.folder}/{self.run_id}_motion.csv"


def plate_of(config: Config) -> tuple[str, Plate]:
    """Return the name and the size of the campaign's plate (the first of the config).

    Parameters
    ----------
    config : Config

    Returns
    -------
    name : str
    plate : Plate

    Raises
    ------
    InputError
        If the config has no plate.
    """
    for name, intruder in config.intruders.items():
        if isinstance(intruder, Plate):
            return name, intruder
    raise InputError("config: intruders has no entry of shape plate, so there is nothing to push")


def legs_of(config: Config) -> dict[str, str]:
    """Return the config's legs whose forces are published.

    Parameters
    ----------
    config : Config

    Returns
    -------
    dict of str to str
        Key of the config's intruders to the name in `reference.LEGS`; legs of other curvatures
        than R/r = 1, 0, -1 are left out, for there is no measurement of them.
    """
    return {
        name: LEG_OF_CURVATURE[leg.curvature_times_R]
        for name, leg in config.intruders.items()
        if isinstance(leg, Leg) and leg.curvature_times_R in LEG_OF_CURVATURE
    }


def media_of(config: Config, media: Sequence[str] | None = None) -> list[str]:
    """Return the media to re-enact, in the order of the config.

    Parameters
    ----------
    config : Config
    media : sequence of str, optional
        Only these; default: every medium whose measurements are published.

    Returns
    -------
    list of str

    Raises
    ------
    InputError
        If a wanted medium is not in the config or has no published measurements.
    """
    known = [
        name
        for name, medium in config.media.items()
        if medium.published_as
        in (reference.MEDIA if medium.role == "laboratory" else reference.SANDS)
    ]
    for name in media or ():
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise InputError(
                f"medium {name!r} cannot be re-enacted: allowed are those of the config with "
                f"published measurements, {', '.join(known)}{hint}"
            )
    return [name for name in known if media is None or name in media]


def _signed(beta: float) -> str:
    return f"b{'m' if beta < 0 else 'p'}{abs(beta):02.0f}"


def _with_rod(run: Run) -> Iterator[Run]:
    """Name a plate run and yield it with the run of rod and mount alone along the same path."""
    ending = "in" if run.direction == "intrusion" else "ex"
    if run.depth_cm is not None:
        ending = f"h{100 * run.depth_cm:03.0f}"
    run_id = f"{run.medium}_{_signed(run.beta_deg or 0.0)}_g{run.gamma_deg or 0.0:02.0f}_{ending}"
    yield replace(run, run_id=run_id, tare_run=f"{run_id}_rod")
    note = "re-enacted: rod and mount alone"
    yield replace(run, run_id=f"{run_id}_rod", kind="rod", note=note)


def _laboratory(config: Config, medium: str, published: str) -> Iterator[Run]:
    plate, _ = plate_of(config)
    first = Run("", "plate", medium, published, plate, "", note="re-enacted from Table S5")
    for beta in BETAS_DEG:
        held = replace(first, beta_deg=float(beta))
        for tangent in TANGENTS:
            gamma = float(np.degrees(np.arctan(tangent)))
            for way in ("intrusion", "extraction"):
                yield from _with_rod(replace(held, direction=way, gamma_deg=gamma))
        level = replace(held, direction="horizontal", gamma_deg=0.0)
        for depth in config.fit.horizontal_depths_cm:
            yield from _with_rod(replace(level, depth_cm=float(depth)))


def _of_medium(config: Config, medium: str) -> Iterator[Run]:
    published = config.media[medium].published_as or ""
    natural = config.media[medium].role == "natural_sand"
    if natural:
        plate, _ = plate_of(config)
        push = Run("", "plate", medium, published, plate, "intrusion", 0.0, 90.0, natural=True)
        yield from _with_rod(replace(push, note="re-enacted from Fig. S11"))
    else:
        yield from _laboratory(config, medium, published)
    for name, leg in legs_of(config).items():
        yield Run(
            f"{medium}_{name}", "leg", medium, published, name, "rotation", leg=leg,
            tare_run=f"{AIR}_{name}", tare_shared=True, natural=natural,
            note=f"re-enacted from Fig. {'S12' if natural else 'S5'}",
        )  # fmt: skip


def plan_runs(config: Config, media: Sequence[str] | None = None) -> list[Run]:
    """List every run of the campaign, sorted by run_id.

    Parameters
    ----------
    config : Config
    media : sequence of str, optional
        Only these media (and the legs in air that their legs need).

    Returns
    -------
    list of Run
        A run is the same whatever other media are asked for.

    Raises
    ------
    InputError
        If a medium cannot be re-enacted, or the config has no plate.
    """
    chosen = media_of(config, media)
    groups = [list(_of_medium(config, name)) for name in chosen]
    if chosen:
        in_air = "re-enacted: turned in air"
        groups.append(
            [
                Run(f"{AIR}_{name}", "leg_air", "", "", name, "rotation", leg=leg, note=in_air)
                for name, leg in legs_of(config).items()
            ]
        )
    # one day of work a medium: the clock depends on the place in it, not on the other media
    runs = [
        replace(run, clock_s=_DAY_STARTS_S + _RUN_EVERY_S * place)
        for group in groups
        for place, run in enumerate(group)
    ]
    return sorted(runs, key=lambda run: run.run_id)
