"""The re-enacted lab: logs the way the real lab would have recorded them, from published results.

Shares no force code with the analysis. `reenact` writes a campaign, `FAULTS` lists what can be
broken in it on purpose, `DISTURBANCES` what can be off.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rftfit.lab.disturb import DISTURBANCES
    from rftfit.lab.enact import Summary, reenact
    from rftfit.lab.plan import Run, plan_runs
    from rftfit.lab.rig import FAULTS, Fault

__all__ = ["DISTURBANCES", "FAULTS", "Fault", "Run", "Summary", "plan_runs", "reenact"]

_HOME = {
    "DISTURBANCES": "disturb",
    "FAULTS": "rig",
    "Fault": "rig",
    "Run": "plan",
    "Summary": "enact",
    "plan_runs": "plan",
    "reenact": "enact",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
