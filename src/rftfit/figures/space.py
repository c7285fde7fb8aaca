"""Forces on a mesh along its path, with interval and error of the law, and the mesh where they are largest."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.figures import style
from rftfit.forces.faces import face_alpha, moving_faces

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.forces.mesh import Mesh, Motion3D
    from rftfit.model.profiles import Profile

_COLOURS = dict(zip("xyz", ("vermillion", "bluish green", "blue"), strict=True))
_MOST_DRAWN = 20_000
_KEYS = {"t_s": "time (s)", "depth_cm": "depth (cm)", "wheel_turn_deg": "turn of the wheel (deg)"}
"""Names of the first column of a motion, with units."""


@style.styled()
def draw_forces(
    forces: pd.DataFrame, profile: Profile, mesh: Mesh, motion: Motion3D, level: str
) -> Figure:
    """Draw the table of `rftfit.predict` of a mesh over its first column, and the mesh at the largest force."""
    page = style.new_figure(style.DOUBLE_CM, 10.0)
    total = np.sqrt((forces[[f"force_{axis}_N" for axis in "xyz"]] ** 2).sum(axis=1, skipna=False))
    pose = 0 if total.isna().all() else int(total.idxmax())
    key = next(iter(motion.columns))
    abscissa = forces[key].to_numpy()
    for row, axis in enumerate("xyz"):
        axes = style.axes_cm(page, 1.6, 0.5 + 2.7 * row, 7.6, 2.4)
        _component(axes, forces, abscissa, axis)
        axes.axvline(abscissa[pose], color=style.GREY, linewidth=0.4, linestyle=":")
        style.name_below(axes, _KEYS.get(key, key), axis == "z")
    entries = {"force": style.line("black")}
    if level:
        entries[level] = style.band(0.35)
    if forces["closure_N"].notna().any():
        entries["error of the law in space, worst case"] = style.line(
            "black", linestyle="--", linewidth=0.6
        )
    style.legend(page, entries, loc="lower left")
    _body(page, profile, mesh, motion, pose)
    pose_text = f"{mesh.name} at {key.partition('_')[0]} = {abscissa[pose]:.4g}"
    style.text_cm(page, 10.0, 0.5, style.plain(pose_text), va="top")
    return page


def _component(axes: Axes, forces: pd.DataFrame, abscissa: np.ndarray, axis: str) -> None:
    """One component of the force over time; interval shaded, error of the law dashed."""
    colour, name = style.OKABE_ITO[_COLOURS[axis]], f"force_{axis}"
    value, closure = forces[f"{name}_N"], forces["closure_N"]
    if f"{name}_lo_N" in forces:
        axes.fill_between(
            abscissa,
            forces[f"{name}_lo_N"],
            forces[f"{name}_hi_N"],
            color=colour,
            alpha=0.35,
            linewidth=0,
        )
    for sign in (-1, 1):
        axes.plot(abscissa, value + sign * closure, "--", color=colour, linewidth=0.6)
    axes.plot(abscissa, value, color=colour)
    style.zero_line(axes)
    style.ticks(axes.yaxis, 4)
    axes.set(ylabel=f"force {axis} (N)", xlim=(abscissa.min(), abscissa.max()))


def _body(page: Figure, profile: Profile, mesh: Mesh, motion: Motion3D, pose: int) -> None:
    """The mesh in a pose; the faces that count are coloured by the size of their stress."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    frame = motion.frames[pose]
    turned, place = frame[9:].reshape(3, 3), frame[:3]
    counts, _, normal, moves, arm = moving_faces(mesh, frame, motion.rolling[pose])
    stress = np.zeros(len(mesh.faces))
    alpha = face_alpha(profile, normal, moves)
    stress[counts] = np.linalg.norm(alpha.reshape(-1, 3), axis=-1) * -(place + arm)[:, 2]
    shade = Normalize(0, float(np.nanmax(stress, initial=0)) or 1)
    colours = colormaps[style.SEQUENTIAL](shade(stress))
    colours[~np.isin(np.arange(stress.size), counts)] = (0.88, 0.88, 0.88, 1)
    corners = mesh.triangles @ turned.T + place
    chosen = slice(None, None, 1 + len(corners) // _MOST_DRAWN)
    axes: Any = page.add_axes((0.535, 0.14, 0.35, 0.76), projection="3d", computed_zorder=False)
    face_style = {"facecolors": colours[chosen], "edgecolors": "none", "rasterized": True}
    axes.add_collection3d(Poly3DCollection(corners[chosen], **face_style))
    middle = (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1))) / 2
    half_width = 0.55 * float(np.ptp(corners, axis=(0, 1)).max())
    x, y, z = middle[:, None] + half_width * np.array([-1, 1])
    surface = [[(x[0], y[0], 0), (x[1], y[0], 0), (x[1], y[1], 0), (x[0], y[1], 0)]]
    if abs(middle[2]) < half_width:
        face_style = {"facecolor": style.SURFACE, "edgecolor": style.SURFACE, "alpha": 0.2}
        axes.add_collection3d(Poly3DCollection(surface, **face_style))
    axes.set(xlim=x, ylim=y, zlim=z, box_aspect=(1, 1, 1))
    axes.set(xlabel="x (cm)", ylabel="y (cm)", zlabel="z (cm)")
    axes.view_init(elev=-12 if moves.size and moves[:, 2].mean() < 0 else 18, azim=-60)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        style.ticks(axis, 4)
    place = page.add_axes((0.935, 0.3, 0.012, 0.45))
    mappable = ScalarMappable(shade, style.SEQUENTIAL)
    page.colorbar(mappable, cax=place, label=f"stress ({style.PER_CM2})")
