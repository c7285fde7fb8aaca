"""Which runs were used and which were dropped, and why; and the doubts about those in use."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rftfit.measure.ledger import DROPPED, USED
from rftfit.measure.rows import Why

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.report.page.inputs import PageInputs

_USED_AS = {
    "plate": "slope",
    "leg": "leg curve",
    "rod": "tare",
    "leg_air": "tare",
    "robot": "mean speed",
}
_ROUTINE = {
    why.text
    for why in Why
    if why not in (Why.GOOD, Why.SATURATED, Why.MOTION_GAP)
}  # fmt: skip
# what is worst first; each is a part of the text that the ingest and slope stages write
_SEVERITY = (
    "saturated",
    "motion log begins or ends",
    "lacks",
    "cut in mid-row",
    "gap",
    "time runs backwards",
    "NaN or infinite",
    "duplicated",
    " depths",
    "not linear",
    "zero drifted",
)


@dataclass(frozen=True)
class Dropped:
    """A run that gave no result.

    Parameters
    ----------
    run_id, medium, kind : str
    reasons : str
        All that the ledger says, joined.
    rows : int
        Rows of its logs.
    """

    run_id: str
    medium: str
    kind: str
    reasons: str
    rows: int


def run_fates(ledger: pd.DataFrame) -> tuple[dict[str, int], list[Dropped]]:
    """Tell used runs from dropped ones.

    A run is used when at least one row of it went into what runs of its kind are for: a slope, a
    leg curve, a tare.

    Parameters
    ----------
    ledger : pandas.DataFrame

    Returns
    -------
    used : dict of str to int
        Number of used runs by medium ("" for those in air, which serve all media).
    dropped : list of Dropped
        In the order of their names.
    """
    used: dict[str, int] = {}
    dropped: list[Dropped] = []
    if ledger.empty:
        return used, dropped
    wanted = ledger["kind"].map(_USED_AS)
    good = ledger[(ledger["fate"] == USED) & (ledger["reason"] == wanted) & (ledger["rows"] > 0)]
    good_runs = set(good["run_id"])
    for run_id, rows in ledger.groupby("run_id", sort=True):
        medium, kind = _text(rows["medium"].iloc[0]), str(rows["kind"].iloc[0])
        if run_id in good_runs:
            used[medium] = used.get(medium, 0) + 1
            continue
        reasons = list(dict.fromkeys(rows.loc[rows["fate"] == DROPPED, "reason"].map(str)))
        special = [reason for reason in reasons if reason not in _ROUTINE]
        why = "; ".join(special or reasons) or "no row was used; the ledger gives no reason"
        dropped.append(Dropped(str(run_id), medium, kind, why, int(rows["rows"].sum())))
    return used, dropped


def row_fates(ledger: pd.DataFrame) -> list[dict[str, object]]:
    """Add up the rows of all logs by fate and reason; reasons that name one run are put together.

    Parameters
    ----------
    ledger : pandas.DataFrame

    Returns
    -------
    list of dict
        ``fate, reason, runs, rows``, the largest number of rows first within each fate.
    """
    if ledger.empty:
        return []
    known = _ROUTINE | {Why.SATURATED.text, Why.MOTION_GAP.text}
    rest = (ledger["fate"] == DROPPED) & ~ledger["reason"].isin(known)
    # a note about the clocks may follow what the rows were used for
    short = ledger["reason"].str.split(";").str[0].mask(rest, "the whole run, or damaged rows")
    table = ledger.assign(reason=short).groupby(["fate", "reason"])
    sums = table.agg(runs=("run_id", "nunique"), rows=("rows", "sum")).reset_index()
    sums = sums.sort_values(["fate", "rows"], ascending=[False, False])
    return [{str(key): cell for key, cell in row.items()} for row in sums.to_dict("records")]


def worst_flag(inputs: PageInputs, medium: str) -> tuple[str, int]:
    """Find the gravest doubt about what is in use of one medium.

    Parameters
    ----------
    inputs : PageInputs
    medium : str

    Returns
    -------
    flag : str
        Empty if there is none.
    count : int
        How many runs and cells have a flag.
    """
    flags: list[str] = []
    for table in (inputs.runs, inputs.fits):
        if not table.empty:
            own = table[table["medium"] == medium]
            flags += [
                f"{r}: {f}" for r, f in zip(own["run_id"], own["flags"], strict=True) if _text(f)
            ]
    alpha = inputs.alpha[medium]
    flags += [flag for flag in alpha["flags"].map(_text) if flag and ":" not in flag]
    if inputs.config.media[medium].role == "laboratory":
        empty = int(alpha["alpha_z_N_per_cm3"].isna().sum())
        if empty:
            return f"{empty} of {len(alpha)} cells have no alpha", len(flags) + empty
    if not flags:
        return "", 0
    return min(flags, key=_rank), len({flag.split(":")[0] for flag in flags})


def _rank(flag: str) -> int:
    return next((i for i, part in enumerate(_SEVERITY) if part in flag), len(_SEVERITY))


def _text(value: object) -> str:
    return value if isinstance(value, str) else ""
