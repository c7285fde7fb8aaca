"""The robot: a planar rigid body on turning legs, stepped through time on granular forces (Eq. 3)."""
