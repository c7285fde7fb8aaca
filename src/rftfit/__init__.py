"""Force-transducer logs to resistive-force models of granular media, with honest intervals.

Units at every public boundary: cm, N, N/cm^2, N/cm^3, s; angles in rad inside functions and in
degrees in run sheets, tables and figures (then named ``_deg``).
"""

import os
from importlib import import_module

from rftfit.version import __version__ as __version__

# Without this numba reads the folder of its cache from a .numba_config.yaml in the current folder, and unpickles
# files that lie there.
os.environ.setdefault("NUMBA_CACHE_DIR", "")

__all__ = [
    "BodyError",
    "Comparison",
    "Contact",
    "DepthOnlyProfile",
    "FourierProfile",
    "Ground",
    "KnownMedium",
    "LimitWarning",
    "Map",
    "Medium",
    "Mesh",
    "Motion",
    "Motion3D",
    "Outline",
    "Peak",
    "Plan",
    "Profile",
    "Reference",
    "Results",
    "RftfitError",
    "Rig",
    "ScaledMedium",
    "Shapes",
    "TableProfile",
    "WheelAnswer",
    "arc",
    "beyond_measured",
    "check",
    "compare_media",
    "draw_wheel",
    "estimate_map",
    "find_peaks",
    "fit_slope",
    "learn_body_error",
    "model_leg",
    "open",
    "path",
    "plan",
    "polyline",
    "predict",
    "published_medium",
    "published_reference",
    "published_shapes",
    "published_table",
    "read_log",
    "read_profile",
    "rft3d_profile",
    "rotation",
    "run",
    "scale",
    "scale_by_paper",
    "scaled_generic",
    "simulate",
    "wheel",
    "write_profile",
]

_NAMES_OF_MODULE = {
    "api": ("check", "fit_slope", "read_log", "run", "simulate"),
    "compare.contrast": ("Comparison",),
    "compare.media": ("compare_media",),
    "errors": ("LimitWarning", "RftfitError"),
    "figures.wheel": ("draw_wheel",),
    "forces.body_error": ("BodyError",),
    "forces.contacts": ("Contact", "learn_body_error"),
    "forces.limits": ("beyond_measured",),
    "forces.mesh": ("Mesh", "Motion3D"),
    "forces.motion": ("Motion", "path", "rotation"),
    "forces.outlines": ("Outline", "arc", "model_leg", "polyline"),
    "forces.peaks": ("Peak",),
    "forces.planning": ("Plan", "Rig", "plan"),
    "forces.prediction": ("find_peaks", "predict"),
    "forces.wheel": ("WheelAnswer", "wheel"),
    "model.profile_file": ("read_profile", "write_profile"),
    "model.profiles": (
        "DepthOnlyProfile",
        "FourierProfile",
        "KnownMedium",
        "Profile",
        "TableProfile",
        "published_medium",
        "scaled_generic",
    ),
    "model.rft3d": ("rft3d_profile",),
    "model.scaling": ("Reference", "ScaledMedium", "published_reference", "scale_by_paper"),
    "model.maps": ("Map", "estimate_map", "scale"),
    "model.shapes": ("Shapes", "published_shapes"),
    "reference": ("published_table",),
    "results": ("Medium", "Results", "open"),
    "robot.ground": ("Ground",),
}
"""Public names by the module that defines them, which is imported when one of its names is first used."""

_INNER_NAMES = {
    "open": "open_results",
    "published_reference": "published",
    "published_table": "load",
}
"""Public names whose object has another name in its module."""

# type checkers take any variable of this name as true; importing it from typing would take longer than the rest of
# this module
TYPE_CHECKING = False
if TYPE_CHECKING:
    from rftfit.api import check, fit_slope, read_log, run, simulate
    from rftfit.compare.contrast import Comparison
    from rftfit.compare.media import compare_media
    from rftfit.errors import LimitWarning, RftfitError
    from rftfit.figures.wheel import draw_wheel
    from rftfit.forces.body_error import BodyError
    from rftfit.forces.contacts import Contact, learn_body_error
    from rftfit.forces.limits import beyond_measured
    from rftfit.forces.mesh import Mesh, Motion3D
    from rftfit.forces.motion import Motion, path, rotation
    from rftfit.forces.outlines import Outline, arc, model_leg, polyline
    from rftfit.forces.peaks import Peak
    from rftfit.forces.planning import Plan, Rig, plan
    from rftfit.forces.prediction import find_peaks, predict
    from rftfit.forces.wheel import WheelAnswer, wheel
    from rftfit.model.maps import Map, estimate_map, scale
    from rftfit.model.profile_file import read_profile, write_profile
    from rftfit.model.profiles import (
        DepthOnlyProfile,
        FourierProfile,
        KnownMedium,
        Profile,
        TableProfile,
        published_medium,
        scaled_generic,
    )
    from rftfit.model.rft3d import rft3d_profile
    from rftfit.model.scaling import Reference, ScaledMedium, scale_by_paper
    from rftfit.model.scaling import published as published_reference
    from rftfit.model.shapes import Shapes, published_shapes
    from rftfit.reference import load as published_table
    from rftfit.results import Medium, Results
    from rftfit.results import open_results as open
    from rftfit.robot.ground import Ground


def __getattr__(name: str) -> object:
    """Import the module of a public name when the name is first used: all of them would take long to import."""
    if name == "mujoco":  # a module, not in __all__ since the package mujoco is optional
        return import_module("rftfit.robot.mujoco")
    for module, names in _NAMES_OF_MODULE.items():
        if name in names:
            public_object = getattr(import_module(f"rftfit.{module}"), _INNER_NAMES.get(name, name))
            globals()[name] = public_object
            return public_object
    raise AttributeError(f"module 'rftfit' has no attribute {name!r}")


def __dir__() -> list[str]:
    dunders = (name for name in globals() if name.startswith("__"))
    return sorted({*dunders, *__all__})
