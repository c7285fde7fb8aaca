"""The robot: a planar rigid body on turning legs, stepped through time on granular forces (Eq. 3)."""

PROFILES = ("table", "map", "generic", "depth_only")
"""Measured table, scaled generic coefficients, depth-only model: those of the paper's Fig. S13. The map
is run on where the table has holes: of a medium that was pushed in every direction they are one."""
