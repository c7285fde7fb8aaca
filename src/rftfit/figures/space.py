"""Figure of forces on a mesh along its path, with intervals and the error of the law in space; the mesh beside it.

A pose is a position and rotation of the mesh along its path, a row of the table of forces. Off the plane of the
measurements the law of forces is a generalization: `closure_N` is its error in the worst case, zero for a mesh whose
faces all move as plates of the measurements did.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rftfit.figures import style
from rftfit.forces.faces import face_alpha, moving_faces
from rftfit.forces.mesh import Mesh, Motion3D
from rftfit.model.draws import end_names, model_end_names, next_end_names

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.forces.force_answer import ForceAnswer
    from rftfit.model.profiles import Profile

_COLOURS = dict(zip("xyz", ("vermillion", "bluish green", "blue"), strict=True))
_ABSCISSAS = {
    "t_s": ("time", "s"),
    "depth_cm": ("depth", "cm"),
    "wheel_turn_deg": ("turn of the wheel", "deg"),
}
"""Name and unit of each quantity that can be the first column of a motion, against which forces are drawn."""


@style.styled()
def draw_forces(answer: ForceAnswer) -> Figure:
    """Draw the forces on a mesh over the first column of its motion with their intervals, and the mesh at the largest force.

    `answer`: Of `rftfit.predict` for a mesh; its table ``forces`` has a row for each pose.
    """
    forces, mesh, motion = answer.forces, answer.body, answer.motion
    assert isinstance(mesh, Mesh)
    assert isinstance(motion, Motion3D)
    page = style.new_figure(style.DOUBLE_CM, 10.0)
    # `pose`: index of the largest force, whose mesh is drawn at the right; the first if no force is known
    total = np.sqrt((forces[[f"force_{axis}_N" for axis in "xyz"]] ** 2).sum(axis=1, skipna=False))
    pose = 0 if total.isna().all() else int(total.idxmax())
    key = next(iter(motion.columns))
    quantity, unit = _ABSCISSAS[key]
    abscissa = forces[key].to_numpy()
    bands = choose_bands(answer)
    for row, axis in enumerate("xyz"):
        axes = style.axes_cm(page, 1.6, 0.5 + 2.7 * row, 7.6, 2.4)
        _draw_component(axes, forces, abscissa, axis, bands)
        axes.axvline(abscissa[pose], color=style.GREY, linewidth=0.4, linestyle=":")
        style.name_below(axes, f"{quantity} ({unit})", axis == "z")
    entries = {"force": style.line("black")}
    entries |= {band.meaning: style.band(band.opacity) for band in bands}
    if _has_closure(forces):
        entries["error of the law in space, worst case"] = style.line(
            "black", linestyle="--", linewidth=0.6
        )
    style.legend(page, entries, loc="lower left")
    _draw_body(page, answer.profile, mesh, motion, pose)
    pose_text = f"{mesh.name}: {quantity} {abscissa[pose]:.4g} {unit}"
    style.text_cm(page, 10.0, 0.5, style.plain(pose_text), va="top")
    return page


class Band(NamedTuple):
    """Interval that is drawn.

    `meaning`: Its name in the legend; empty if the answer has no such interval. `name_ends`: Function that returns the
    columns of its lower and upper end for a quantity such as ``force_z_N``. `opacity`: Of its shade.
    """

    meaning: str
    name_ends: Callable[[str], tuple[str, str]]
    opacity: float


def choose_bands(answer: ForceAnswer) -> list[Band]:
    """Choose the widest interval of an answer, and the one of alpha, to be drawn in this order.

    The widest is that of the next bed, else that with the model's own error. An interval without width is left out.
    """
    widest = ((answer.interval_of_bed, next_end_names), (answer.interval_of_model, model_end_names))
    bands = [Band(meaning, names, style.WIDER_OPACITY) for meaning, names in widest if meaning][:1]
    bands.append(Band(answer.interval_of_alpha, end_names, style.INTERVAL_OPACITY))
    return [band for band in bands if band.meaning and _has_width(answer.forces, band)]


def _has_width(forces: pd.DataFrame, band: Band) -> bool:
    """Return True if an interval is wider than zero for any component in any pose; False if its columns are missing."""
    ends = [band.name_ends(f"force_{axis}_N") for axis in "xyz"]
    return any((forces[high] > forces[low]).any() for low, high in ends if {low, high} <= {*forces})


def _has_closure(forces: pd.DataFrame) -> bool:
    """Return True if the law in space may err on this body; it cannot where every face moves as in the measured plane."""
    return bool((forces["closure_N"] > 0).any())


def _draw_component(
    axes: Axes, forces: pd.DataFrame, abscissa: np.ndarray, axis: str, bands: Sequence[Band]
) -> None:
    """Draw one component of the force against `abscissa`, its intervals shaded, the error of the law in space dashed.

    `abscissa`: Time, depth or turn in each pose, shape (p,). `axis`: ``x``, ``y`` or ``z``.
    """
    colour, column = style.OKABE_ITO[_COLOURS[axis]], f"force_{axis}_N"
    value = forces[column]
    for band in bands:
        low, high = band.name_ends(column)
        style.draw_band(axes, abscissa, forces[low], forces[high], colour, band.opacity)
    if _has_closure(forces):
        for edge in (value - forces["closure_N"], value + forces["closure_N"]):
            axes.plot(abscissa, edge, "--", color=colour, linewidth=0.6)
    axes.plot(abscissa, value, color=colour)
    style.zero_line(axes)
    style.ticks(axes.yaxis, 4)
    axes.set(ylabel=f"force {axis} (N)", xlim=(abscissa.min(), abscissa.max()))


def _draw_body(page: Figure, profile: Profile, mesh: Mesh, motion: Motion3D, pose: int) -> None:
    """Draw the mesh in a pose; faces that push the medium are coloured by the size of their stress, N/cm^2.

    `pose`: Its index. Stress is alpha by the profile (x, y, z) times depth; other faces are grey.
    """
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    # a row of `Motion3D.frames`: position (3), velocity and angular velocity (6), rotation matrix by rows (9)
    frame = motion.frames[pose]
    rotation, position = frame[9:].reshape(3, 3), frame[:3]
    # `faces`: those that push the medium, with `numbers` as their indices in the mesh
    faces = moving_faces(mesh, frame, motion.rolling[pose])
    stress = np.zeros(len(mesh.faces))
    alpha = face_alpha(profile, faces.area_vectors, faces.velocity)
    depth = -(position + faces.arm_cm)[:, 2]
    stress[faces.numbers] = np.linalg.norm(alpha.reshape(-1, 3), axis=-1) * depth
    shade = Normalize(0, float(np.nanmax(stress, initial=0)) or 1)
    colours = colormaps[style.SEQUENTIAL](shade(stress))
    colours[np.delete(np.arange(stress.size), faces.numbers)] = (0.88, 0.88, 0.88, 1)
    corners = mesh.triangles @ rotation.T + position
    # of a large mesh only every second or further face
    drawn = slice(None, None, 1 + len(corners) // 20_000)
    axes: Any = page.add_axes((0.535, 0.14, 0.35, 0.76), projection="3d", computed_zorder=False)
    surface_of_body = Poly3DCollection(
        corners[drawn], facecolors=colours[drawn], edgecolors="none", rasterized=True
    )
    axes.add_collection3d(surface_of_body)
    middle = (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1))) / 2
    half_width = 0.55 * float(np.ptp(corners, axis=(0, 1)).max())
    x, y, z = middle[:, None] + half_width * np.array([-1, 1])
    # the free surface z = 0, a square around the mesh; not drawn where it lies beyond the axes
    surface = [[(x[0], y[0], 0), (x[1], y[0], 0), (x[1], y[1], 0), (x[0], y[1], 0)]]
    if abs(middle[2]) < half_width:
        look = {"facecolor": style.SURFACE, "edgecolor": style.SURFACE, "alpha": 0.2}
        axes.add_collection3d(Poly3DCollection(surface, **look))
    axes.set(xlim=x, ylim=y, zlim=z, box_aspect=(1, 1, 1))
    axes.set(xlabel="x (cm)", ylabel="y (cm)", zlabel="z (cm)")
    # a body that moves down is seen from below
    goes_down = faces.velocity.size and faces.velocity[:, 2].mean() < 0
    axes.view_init(elev=-12 if goes_down else 18, azim=-60)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        style.ticks(axis, 4)
    bar_axes = page.add_axes((0.935, 0.3, 0.012, 0.45))
    mappable = ScalarMappable(shade, style.SEQUENTIAL)
    page.colorbar(mappable, cax=bar_axes, label=f"stress ({style.PER_CM2})")
