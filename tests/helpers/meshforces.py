"""Forces on a mesh in plain numpy, to check and to time the compiled ones."""

import numpy as np

from rftfit.forces import faces


def mesh_forces(profile, mesh, motion, law="measured", friction=None):
    """Force and moment in each pose, shape (p, 6), in plain numpy."""
    forces_of_poses = []
    for frame, rolling in zip(motion.frames, motion.rolling, strict=True):
        loaded = faces.moving_faces(mesh, frame, rolling)
        alpha = faces.face_alpha(profile, loaded.area_vectors, loaded.velocity, law, friction)
        force = loaded.load_cm3[:, None] * alpha
        forces_of_poses.append(np.hstack([force, np.cross(loaded.arm_cm, force)]).sum(axis=0))
    return np.stack(forces_of_poses)
