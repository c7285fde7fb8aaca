"""Force-transducer logs to resistive-force models of granular media, with honest intervals.

Units at every public boundary: cm, N, N/cm^2, N/cm^3, s; angles in rad inside functions and in
degrees in run sheets, tables and figures (then named ``_deg``).
"""

import os

# Else numba takes it from a .numba_config.yaml in the current folder, and unpickles what lies there.
os.environ.setdefault("NUMBA_CACHE_DIR", "")

__version__ = "0.1.0"
