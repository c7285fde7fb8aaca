"""Alpha of a profile.json in numpy: python alpha.py profile.json < angles."""

import json
import sys
from pathlib import Path

import numpy as np


def alpha(profile, beta_deg, gamma_deg):
    """Return alpha_z and alpha_x in N/cm^3, shape (2, n); the angles in degrees have shape (n,)."""
    names = ("beta_deg", "gamma_deg", "alpha_z_N_per_cm3", "alpha_x_N_per_cm3")
    beta, gamma, z, x = (np.array(profile["directions"][name], float) for name in names)
    # mirror images; the grid begins at (-90, -180) and its last lines are the first ones
    rows, i = np.unique(np.round(np.append(beta, -beta) + 90, 6) % 180, return_inverse=True)
    columns, j = np.unique(
        np.round(np.append(gamma, 180 - gamma) + 180, 6) % 360, return_inverse=True
    )
    table = np.full((2, rows.size + 1, columns.size + 1), np.nan)
    table[:, i, j] = np.append(z, z), np.append(x, -x)
    table[:, -1], table[:, :, -1] = table[:, 0], table[:, :, 0]
    rows, columns = np.append(rows, 180), np.append(columns, 360)
    # bilinear
    b, g = (beta_deg + 90) % 180, (gamma_deg + 180) % 360
    i = np.clip(np.searchsorted(rows, b, "right") - 1, 0, rows.size - 2)
    j = np.clip(np.searchsorted(columns, g, "right") - 1, 0, columns.size - 2)
    u = (b - rows[i]) / (rows[i + 1] - rows[i])
    v = (g - columns[j]) / (columns[j + 1] - columns[j])
    corners = ((0, 0, (1 - u) * (1 - v)), (0, 1, (1 - u) * v), (1, 0, u * (1 - v)), (1, 1, u * v))
    return sum(np.where(w > 1e-6, w * table[:, i + k, j + m], 0) for k, m, w in corners)


if __name__ == "__main__":
    given = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    np.savetxt(sys.stdout, np.transpose(alpha(given, *np.loadtxt(sys.stdin, ndmin=2).T)), "%.17g")
