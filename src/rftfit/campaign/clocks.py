"""How force and motion are brought together: clocks, free surface, and the yielding of the machine."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from rftfit.campaign.model import Model, Positive


class Clock(Model):
    """How the clocks of the force log and of the motion log are brought together."""

    method: Literal["sync_line", "same_clock", "estimate"] = Field(
        default="sync_line",
        description="sync_line: the force log records when the arm moves; same_clock: one clock; "
        "estimate: from the force, which grows only where the intruder goes deeper",
    )
    max_residual_s: Positive = Field(
        default=0.05, description="a run whose edges agree no better than this is refused, s"
    )
    max_gap_s: Positive = Field(
        default=0.1, description="a longer step between samples is a gap, s"
    )
    max_se_s: Positive = Field(
        default=0.1,
        description="a run whose estimated offset has a larger standard error is refused, s",
    )
    max_drift: Positive = Field(
        default=1e-3,
        description="how much the rates of the clocks may differ, as a standard deviation, relative; "
        "for estimate",
    )


class FreeSurface(Model):
    """Where the free surface lies."""

    method: Literal["given", "find"] = Field(
        default="given",
        description="given: surface_z_mm of the sheet or the arm; find: where the force begins to "
        "grow, in each push straight down whose row of the sheet gives no surface_z_mm",
    )
    window_cm: Positive = Field(
        default=1.5, description="how far above and below the surface the force is looked at, cm"
    )
    max_se_cm: Positive = Field(
        default=0.1, description="a run whose surface has a larger standard error is refused, cm"
    )


class RigidContact(Model):
    """A push of the bare machine against something rigid: how far it yields under load."""

    force_log: str = Field(description="force log, relative to the raw folder")
    motion_log: str = Field(description="motion log, relative to the raw folder")
