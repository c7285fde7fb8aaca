"""Alpha of a profile.json in numpy: python alpha.py profile.json < angles."""

import json
import sys
from pathlib import Path

import numpy as np


def alpha(profile, beta_deg, gamma_deg):
    """Return alpha_z and alpha_x in N/cm^3; the angles in degrees are arrays of one shape."""
    nodes = profile["nodes"]
    rows, columns = np.array(nodes["beta_deg"]), np.array(nodes["gamma_deg"])
    beta = (beta_deg + 90) % 180 - 90
    gamma = (gamma_deg + 180) % 360 - 180
    i = np.clip(np.searchsorted(rows, beta, "right") - 1, 0, rows.size - 2)
    j = np.clip(np.searchsorted(columns, gamma, "right") - 1, 0, columns.size - 2)
    u = (beta - rows[i]) / (rows[i + 1] - rows[i])
    v = (gamma - columns[j]) / (columns[j + 1] - columns[j])
    corners = ((0, 0, (1 - u) * (1 - v)), (0, 1, (1 - u) * v), (1, 0, u * (1 - v)), (1, 1, u * v))
    found = []
    for name in ("alpha_z_N_per_cm3", "alpha_x_N_per_cm3"):
        table = np.array(nodes[name], dtype=float)  # null becomes NaN
        parts = [np.where(w > 1e-9, w * table[i + k, j + m], 0) for k, m, w in corners]
        found.append(sum(parts))
    return found


if __name__ == "__main__":
    given = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    np.savetxt(sys.stdout, np.transpose(alpha(given, *np.loadtxt(sys.stdin, ndmin=2).T)), "%.17g")
