"""Force-transducer logs to resistive-force models of granular media, with honest intervals.

Units at every public boundary: cm, N, N/cm^2, N/cm^3, s; angles in rad inside functions and in
degrees in run sheets, tables and figures (then named ``_deg``).
"""

__version__ = "0.1.0"
