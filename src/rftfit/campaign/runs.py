"""One run: a row of the run sheet after it has been checked."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Run:
    """One run of the campaign.

    Attributes
    ----------
    run_id : str
        Unique name.
    kind : str
        ``plate``, ``rod``, ``leg`` or ``leg_air``.
    medium : str
        Key of the configuration's ``media``; empty for ``leg_air``.
    intruder : str
        Key of the configuration's ``intruders``.
    direction : str
        ``intrusion``, ``extraction``, ``horizontal`` or ``rotation``.
    beta_deg, gamma_deg : float
        Angle of the plate, and of the path on the way down, degrees; NaN for legs.
    depth_cm : float
        Depth of a horizontal run, cm; NaN for all others.
    force_log, motion_log : str
        Paths relative to the raw folder, with ``/`` and without ``.`` or ``..``.
    tare_run : str
        run_id of the run to subtract; empty if there is none.
    tare_shared : bool
        Whether that tare is meant to serve several runs.
    surface_z_mm : float or None
        Arm z of the free surface, mm; None means the configuration's.
    excluded : bool
        Whether the run is left out.
    reason : str
        Why it is left out.
    note : str
        Free text.
    row : int
        Row as a spreadsheet numbers it; the header is row 1.
    """

    run_id: str
    kind: str
    medium: str
    intruder: str
    direction: str
    beta_deg: float
    gamma_deg: float
    depth_cm: float
    force_log: str
    motion_log: str
    tare_run: str
    tare_shared: bool
    surface_z_mm: float | None
    excluded: bool
    reason: str
    note: str
    row: int
