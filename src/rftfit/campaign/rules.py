"""What must hold within one row, beyond each cell on its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.campaign.columns import BY_NAME, DIRECTIONS
from rftfit.campaign.config import PLATE_SHAPES
from rftfit.campaign.problems import listed

if TYPE_CHECKING:
    from rftfit.campaign.cells import Draft, Known
    from rftfit.campaign.files import Folder

DEPTH_TOLERANCE_CM = 0.005
"""Depths closer than this are the same depth: sheets are written to a hundredth of a centimetre."""

_SHAPES_OF = {
    "plate": PLATE_SHAPES, "rod": PLATE_SHAPES, "leg": ("leg",), "leg_air": ("leg",),
}  # fmt: skip


def check_row(draft: Draft, known: Known) -> None:
    """Add the problems of one row to it.

    Parameters
    ----------
    draft : Draft
        As read by `cells.read_row`.
    known : Known
    """
    _check_direction(draft)
    _check_intruder(draft, known)
    _check_gamma(draft)
    _check_depth(draft, known)
    _check_excluded(draft)


def check_logs(draft: Draft, logs: Folder) -> None:
    """Add the problems of a row's two log files on disk to it.

    Parameters
    ----------
    draft : Draft
    logs : Folder
        The raw folder.
    """
    for column in ("force_log", "motion_log"):
        path = draft.text[column]
        if not path:
            continue
        status = logs.status(path)
        if status == "outside":
            allowed = f"{BY_NAME[column].allowed}; a link leads out of it"
            draft.error(column, path, allowed, "sheet.path-outside")
        elif status in ("folder", "other"):
            what = "a folder" if status == "folder" else "no regular file"
            draft.error(column, path, f"a log file; this is {what}", "sheet.log-not-a-file")
        elif status == "missing" and not draft.yes("excluded"):
            allowed = "a file that exists in the raw folder; this run will be dropped"
            draft.warn(column, path, allowed, "sheet.log-missing", logs.nearest(path))


def _check_direction(draft: Draft) -> None:
    kind, direction = draft.text["kind"], draft.text["direction"]
    if kind and direction and direction not in DIRECTIONS[kind]:
        allowed = f"{' or '.join(DIRECTIONS[kind])} for a {kind} run"
        draft.error("direction", direction, allowed, "sheet.direction-kind")


def _check_intruder(draft: Draft, known: Known) -> None:
    kind, intruder = draft.text["kind"], draft.text["intruder"]
    if not kind or not intruder or known.shapes is None:
        return
    shape, wanted = known.shapes[intruder], _SHAPES_OF[kind]
    if shape and shape not in wanted:
        fitting = [name for name, other in known.shapes.items() if other in wanted]
        allowed = f"an intruder with shape {' or '.join(wanted)} for a {kind} run: "
        allowed += listed(fitting) or "the config has none"
        draft.error("intruder", intruder, allowed, "sheet.intruder-kind")


def _check_gamma(draft: Draft) -> None:
    gamma, direction = draft.number.get("gamma_deg"), draft.text["direction"]
    if gamma is None:
        return
    found = draft.text["gamma_deg"]
    if direction == "horizontal" and gamma != 0:
        draft.error("gamma_deg", found, "0 for a horizontal run", "sheet.gamma-not-zero")
    elif direction in ("intrusion", "extraction") and gamma == 0:
        allowed = f"above 0 for an {direction}; a path at gamma 0 is a horizontal run"
        draft.error("gamma_deg", found, allowed, "sheet.gamma-zero")


def _check_depth(draft: Draft, known: Known) -> None:
    depth = draft.number.get("depth_cm")
    if depth is None or known.depths_cm is None:
        return
    if all(abs(depth - other) > DEPTH_TOLERANCE_CM for other in known.depths_cm):
        depths = ", ".join(f"{other:g}" for other in known.depths_cm)
        allowed = f"one of {depths} cm (fit.horizontal_depths_cm in the config)"
        draft.warn("depth_cm", draft.text["depth_cm"], allowed, "sheet.depth-unlisted")


def _check_excluded(draft: Draft) -> None:
    if "excluded" in draft.bad or "reason" in draft.bad:
        return
    excluded, reason = draft.yes("excluded"), draft.text["reason"]
    if excluded and not reason:
        allowed = "an excluded run needs its reason, in words: it goes into the ledger"
        draft.error("reason", None, allowed, "sheet.excluded-without-reason")
    elif reason and not excluded:
        allowed = "a reason only where excluded is yes; this run is used"
        draft.warn("reason", reason, allowed, "sheet.reason-without-excluded")
