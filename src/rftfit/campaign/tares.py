"""What must hold between a run and its tare."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING

from rftfit.campaign.problems import did_you_mean
from rftfit.campaign.rules import DEPTH_TOLERANCE_CM

if TYPE_CHECKING:
    from rftfit.campaign.cells import Draft, Known

ANGLE_TOLERANCE_DEG = 0.05
"""Angles closer than this are the same in a sheet, where 18.43 and 18.435 both stand for atan 1/3."""

_TARE_OF = {"plate": "rod", "leg": "leg_air"}
_WORDS = {"rod": "a rod run", "leg_air": "a leg_air run"}
_SEARCHES = 20
_WITHOUT = {
    "refuse": "as NaN, with that as its reason",
    "flag": "with the force on rod and mount in it, flagged",
}


def check_tares(drafts: list[Draft], known: Known) -> None:
    """Add to each row the problems of its tare.

    Parameters
    ----------
    drafts : list of Draft
        All rows of the sheet, in its order.
    known : Known
    """
    by_id: dict[str, Draft] = {}
    for draft in drafts:
        by_id.setdefault(draft.text["run_id"], draft)
    by_id.pop("", None)
    ids_of = {
        kind: tuple(sorted(name for name, one in by_id.items() if one.text["kind"] == kind))
        for kind in _WORDS
    }
    users: defaultdict[str, list[Draft]] = defaultdict(list)
    named: set[str] = set()
    searches = 0
    for draft in drafts:
        kind, name = draft.text["kind"], draft.text["tare_run"]
        named.add(name)
        if kind not in _TARE_OF or "tare_run" in draft.bad:
            continue
        excluded = draft.yes("excluded")
        if not name:
            if not excluded:
                allowed = "no tare: this run will come out "
                allowed += _WITHOUT[known.missing_tare] + "; name "
                allowed += f"{_WORDS[_TARE_OF[kind]]} to subtract"
                draft.warn("tare_run", None, allowed, "sheet.tare-missing")
            continue
        if name not in by_id:
            # a search looks at every id, so not for each of thousands of rows
            searches += 1
            nearest = did_you_mean(name, ids_of[_TARE_OF[kind]]) if searches <= _SEARCHES else None
            allowed = f"the run_id of {_WORDS[_TARE_OF[kind]]} in this sheet"
            draft.error("tare_run", name, allowed, "sheet.tare-unknown", nearest)
            continue
        if not excluded and by_id[name].text["kind"] == _TARE_OF[kind]:
            users[name].append(draft)
        _match(draft, by_id[name])
    for name, several in users.items():
        _check_shared(name, several)
    for name, tare in by_id.items():
        if tare.text["kind"] in _WORDS and name not in named and not tare.yes("excluded"):
            allowed = f"a tare that some run names; no run names {name}"
            tare.warn("run_id", name, allowed, "sheet.tare-unused")


def _check_shared(name: str, several: list[Draft]) -> None:
    if len(several) < 2:
        return
    rows = ", ".join(str(draft.row) for draft in several[:5]) + (", ..." if several[5:] else "")
    for draft in several:
        if not draft.yes("tare_shared") and "tare_shared" not in draft.bad:
            allowed = (
                f"this must be yes on each run that uses {name} (rows {rows}); or give each run a "
            )
            allowed += "tare of its own"
            draft.error("tare_shared", None, allowed, "sheet.tare-shared")


def _match(draft: Draft, tare: Draft) -> None:
    """Compare a run with its tare, one message for each difference."""
    kind, name = draft.text["kind"], draft.text["tare_run"]
    where = f"{name} (row {tare.row})"
    if not tare.text["kind"]:
        return
    if tare.text["kind"] != _TARE_OF[kind]:
        allowed = f"{_WORDS[_TARE_OF[kind]]} for a {kind} run; {where} is a {tare.text['kind']} run"
        draft.error("tare_run", name, allowed, "sheet.tare-kind")
        return
    for column in ("medium", "intruder", "direction", "beta_deg", "gamma_deg", "depth_cm"):
        own, other = draft.text[column], tare.text[column]
        if not own or not other or column in draft.bad or column in tare.bad:
            continue
        if not _same(column, draft, tare):
            allowed = f"the tare must match: {column} is {own} here and {other} in {where}"
            code = f"sheet.tare-{column.split('_', maxsplit=1)[0]}"
            draft.error("tare_run", name, allowed, code)
    if tare.yes("excluded") and not draft.yes("excluded"):
        allowed = f"a tare that is used; {where} is excluded, so this run will have none"
        draft.warn("tare_run", name, allowed, "sheet.tare-excluded")


def _same(column: str, draft: Draft, tare: Draft) -> bool:
    if column not in draft.number:
        return draft.text[column] == tare.text[column]
    difference = abs(draft.number[column] - tare.number[column])
    if column == "beta_deg":
        # -90 and 90 are one and the same plate
        difference = min(difference, 180 - difference)
    return difference <= (DEPTH_TOLERANCE_CM if column == "depth_cm" else ANGLE_TOLERANCE_DEG)
