"""Check of errors that many runs share: a gain, a turn of the mount or an angle that is off, by all runs together.

The evidence is the table ``causes`` (`rftfit.compare.causes`). A *cause* is an error that a group of runs may share. A
row is a cause, or the causes of one kind and group together: its `kind` (such as ``gain``), `group` (how the runs are
grouped: ``all``, ``holder``, ``from-run``, ``window``, ``trend``, or a column of labels of the run sheet), `place`
(which runs of the group), `verdict` (``told``, ``not seen``, ``not checked``) with a `reason`, `size` with its interval
(a share, or degrees), `least_seen` (least size that would be told), `run_ids` and `inseparable` (other causes that fit
as well).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from rftfit.campaign.columns import LABELS
from rftfit.checks.declared import (
    SOUND_ALPHA,
    Check,
    MediumMeasurements,
    Sentences,
    declare_check,
    flags_on,
)
from rftfit.measure.alpha import alpha_columns
from rftfit.measure.flags import Remark, format_remarks, remark
from rftfit.measure.lab_frame import measures_force_x
from rftfit.measure.verdict_words import DOUBTFUL, FEWEST_RUNS, MIXED_UP, NO_RUNS

_ALLOWED = "less than would be seen by chance in one of 100 sound campaigns"


@declare_check(
    "shared",
    title="errors that many runs share",
    effect=DOUBTFUL,
    good="no gain, turn or angle is off in many runs",
    fault="a gain, a turn or an angle is off in many runs",
    after=(*SOUND_ALPHA, "axes"),
    quotes_found=True,
    needed=True,
    outcomes={
        "shared": Sentences("nothing that many runs share is seen; {seen} would be", _ALLOWED),
        "shared-labels-open": Sentences(
            "nothing that many runs share is seen; {seen} would be; an error of the runs with {labels} cannot be told from their "
            "directions, which few or no other runs have: push one of these directions without that label",
            _ALLOWED,
        ),
        "shared-told": Sentences("{causes}", _ALLOWED, "{causes}: {cures}."),
        "shared-open": Sentences(
            "these runs do not tell whether many of them share an error ({missing}): repeat some directions at the beginning and "
            "at the end"
        ),
        "shared-few": Sentences(
            "errors that many runs share cannot be seen: {wanted} runs with both alpha_z and alpha_x are needed, here: {count}"
        ),
        "shared-no-x": Sentences(
            "errors that many runs share cannot be seen: alpha_x is needed, which these runs do not measure"
        ),
    },
)
def check_shared(measured: MediumMeasurements) -> Check:
    """Check that no gain, turn of the mount or angle is off in many runs.

    The medium is not checked where neither a gain from some run on nor a turn of the mount would have been seen.
    """
    causes = measured.tables["causes"]
    is_told = causes["verdict"] == "told"
    if "symmetry" in measured.medium.accept:
        # the config accepts a turned mount
        is_told &= ~((causes["group"] == "all") & causes["kind"].isin(["turn", "crosstalk"]))
    if is_told.any():
        return _fail_by_causes(causes[is_told].to_dict("records"), measured)
    # both are None where they would not have been seen
    least_gain = _describe_least("gain", "from-run", causes)
    least_turn = _describe_least("turn", "all", causes)
    if least_gain is None or least_turn is None:
        return _skip_causes(measured)
    seen = f"{least_gain} and {least_turn}"
    # a label that only runs of certain directions have: its error looks like alpha of these directions
    is_mixed_up = causes["group"].isin(LABELS) & (causes["reason"] == MIXED_UP)
    if is_mixed_up.any():
        labels = (causes["group"] + " " + causes["place"].astype(str))[is_mixed_up]
        names = " or ".join(dict.fromkeys(labels))
        return Check.judge("shared", True, code="shared-labels-open", seen=seen, labels=names)
    return Check.judge("shared", True, seen=seen)


def _fail_by_causes(told_causes: list[dict[Any, Any]], measured: MediumMeasurements) -> Check:
    """Fail the medium by errors that many runs share, with a flag on each of these runs if they are not all runs.

    `told_causes`: Rows of the table of causes, with the verdict ``told``.
    """
    described = [_describe_told(row, measured) for row in told_causes]
    flags: list[Remark] = []
    for row, cause in zip(told_causes, described, strict=True):
        if row["group"] != "all":
            flags += flags_on(row["run_ids"].split(), "shared-cause", cause=str(cause))
    cures = dict.fromkeys(remark(f"cure-{_name_fault(row)}") for row in told_causes)
    return Check.judge(
        "shared",
        False,
        flags,
        code="shared-told",
        causes=format_remarks(described),
        cures=format_remarks(cures),
    )


def _skip_causes(measured: MediumMeasurements) -> Check:
    """Make the outcome of a medium whose shared errors would not be seen: no force along x, too few runs or repeats."""
    causes, fits = measured.tables["causes"], measured.tables["fits"]
    if not (causes["reason"] == NO_RUNS).all():
        # there are enough runs, but not enough repeats to tell some kinds of causes
        kinds = causes.loc[causes["verdict"] == "not checked", "kind"].unique()
        missing = ", ".join(sorted(str(remark(f"kind-{kind}")) for kind in kinds))
        return Check.skip("shared", "shared-open", missing=missing)
    sheet, config = measured.sheet, measured.config
    if not any(measures_force_x(config, sheet[run]) for run in fits["run_id"]):
        return Check.skip("shared", "shared-no-x")
    count = int(np.isfinite(alpha_columns(fits)).all(axis=0).sum())
    return Check.skip("shared", "shared-few", count=count, wanted=FEWEST_RUNS)


def _describe_least(kind: str, group: str, causes: pd.DataFrame) -> Remark | None:
    """Describe the least size at which a cause would have been seen; None where it was not checked.

    `kind`, `group`: Of the cause, in the table of causes.
    """
    rows = causes[(causes["kind"] == kind) & (causes["group"] == group)]
    rows = rows[rows["verdict"] == "not seen"]
    return None if rows.empty else remark(f"least-{kind}", least=float(rows["least_seen"].iloc[0]))


def _describe_told(row: Mapping[Any, Any], measured: MediumMeasurements) -> Remark:
    """Describe a cause that runs share: kind, size, runs, and other causes that fit as well.

    `row`: Row of the table of causes. The remark is put together of three: where the runs stand, what is wrong with
    them, and what else it may be.
    """
    size: dict[str, Any] = {"size": row["size"], "low": row["size_lo"], "high": row["size_hi"]}
    group, run_ids = row["group"], row["run_ids"].split()
    if group in ("from-run", "window"):
        first, last = measured.sheet[run_ids[0]], measured.sheet[run_ids[-1]]
        of_last: dict[str, Any] = {}
        if group == "window":
            of_last = {"last_row": last.row, "last_run": last.run_id}
        location = remark(
            f"where-{group}", row=first.row, run=first.run_id, count=row["n_runs"], **of_last
        )
    elif group in ("trend", "all", "holder"):
        location = remark(f"where-{group}", angle=row["place"])
    else:
        location = remark("where-label", column=group, label=row["place"], count=row["n_runs"])
    fault = _name_fault(row)
    if fault != row["kind"]:
        # a change of a force below -1 is a force of the opposite sign
        size = {
            "times": -1 - size["size"],
            "low_times": -1 - size["high"],
            "high_times": -1 - size["low"],
        }
    told_cause = remark(f"told-{fault}", where=str(location), **size)
    rivals = [cause.split() for cause in str(row["inseparable"]).split("; ") if cause]
    if not rivals:
        return told_cause
    # kind and group of a rival, then its place
    described = dict.fromkeys(_describe_rival(kind, group) for kind, group, *_ in rivals)
    return remark("told-or", told=str(told_cause), others=", ".join(described))


def _name_fault(row: Mapping[Any, Any]) -> str:
    """Return the kind of a cause, with the ending ``-reversed`` where a gain has the opposite sign.

    `row`: Row of the table of causes. A gain is stated as a ratio less 1, so below -1 the force is reversed.
    """
    is_reversed = row["kind"] in ("gain", "gain-x") and row["size"] < -1
    return f"{row['kind']}-reversed" if is_reversed else str(row["kind"])


def _describe_rival(kind: str, group: str) -> str:
    """Describe another cause that fits as well: its kind, and the runs that would share it."""
    runs = group if group in ("trend", "all", "from-run", "window", "holder") else "label"
    return str(remark(f"other-{runs}", kind=str(remark(f"kind-{kind}")), column=group))
