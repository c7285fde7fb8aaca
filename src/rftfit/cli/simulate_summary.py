"""What a run of the robot came to, for people and as JSON."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.cli.output import count, table

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.robot.run import Run


def ranges(tail: pd.DataFrame) -> dict[str, tuple[float, float]]:
    """Least and greatest of what matters, over the last two strides.

    Parameters
    ----------
    tail : pandas.DataFrame
        From `rftfit.stages.robot_figures.tail_of`.

    Returns
    -------
    dict of str to (float, float)
        By column.
    """
    names = ["velocity_x_cm_per_s", "z_cm", "pitch_deg"]
    names += [n for n in tail.columns if n.startswith(("force_z_tripod", "force_x_tripod"))]
    return {name: (float(tail[name].min()), float(tail[name].max())) for name in names}


def as_text(run: Run, tail: pd.DataFrame) -> str:
    """Write a run for people.

    Parameters
    ----------
    run : Run
    tail : pandas.DataFrame
        Its last two strides.

    Returns
    -------
    str
    """
    if run.outcome == "steady":
        sd = run.speed_sd_cm_per_s
        between = f", s.d. between strides {sd:.2g}" if math.isfinite(sd) else ""
        speed = f"{run.speed_cm_per_s:.4g} cm/s (mean of the last {count(run.averaged, 'stride')}{between})"
    else:
        speed = "none"
    lines = [f"Speed: {speed}", f"Outcome: {run.outcome} after {count(run.strides, 'stride')}"]
    if run.reason:
        lines[-1] += f": {run.reason}"
    rows = [[name, f"{low:.4g}", f"{high:.4g}"] for name, (low, high) in ranges(tail).items()]
    return "\n".join(lines) + "\n\n" + table(["last two strides", "least", "greatest"], rows)


def as_json(names: dict[str, str], run: Run, tail: pd.DataFrame, files: dict[str, str]) -> str:
    """Write a run as JSON; what is not known is null.

    Parameters
    ----------
    names : dict of str to str
        What was run on what.
    run : Run
    tail : pandas.DataFrame
    files : dict of str to str
        What is written where.

    Returns
    -------
    str
    """

    def number(value: float) -> float | None:
        return float(value) if np.isfinite(value) else None

    content: dict[str, Any] = {
        **names,
        "frequency_Hz": run.condition.frequency_Hz,
        "curvature_times_R": run.condition.curvature_times_R,
        "phase_turns": run.condition.phase_turns,
        "speed_cm_per_s": number(run.speed_cm_per_s),
        "speed_sd_cm_per_s": number(run.speed_sd_cm_per_s),
        "outcome": run.outcome,
        "reason": run.reason,
        "warning": run.warning,
        "strides": run.strides,
        "averaged": run.averaged,
        "last_two_strides": {
            name: [number(low), number(high)] for name, (low, high) in ranges(tail).items()
        },
        "files": files,
    }
    return json.dumps(content, indent=2)
