"""The robot: a planar rigid body on turning legs, stepped through time on granular forces (Eq. 3)."""

PROFILES = ("table", "map", "generic", "depth_only")
"""Kinds of profile on which the robot runs. Table, generic and depth-only are those of the paper's Fig. S13. The map
is used if the table has holes; without holes it has the same alpha as the table."""
