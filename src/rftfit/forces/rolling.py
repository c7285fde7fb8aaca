"""Rules for rolling wheels: no force from the wheel's own track, and facets that stand for a round rim.

A rolling wheel leaves a rut. Behind the axle what faces back would push into that rut, not into the bed at its depth:
on a wheel that is not convex such faces do not count (`TRACK_RULE`; the rear contact angle 0 of Wong and Reece 1967,
doi:10.1016/0022-4898(67)90105-X). On a convex wheel no point of the surface behind the axle pushes back.

Rotation alone moves one half of a flat facet outward, but no part of the round rim that the facet stands for. Where the
travel is slow beside the rim, that half would lead and bear a load. Whether a face leads is therefore decided with a
travel of at least `least_travel` of the rim speed; below a slip of 0.5 nothing changes.

The axle lies along y through (0, 0, 0) of the mesh. The rim is the radius to which slip and sinkage belong: of a wheel
with lugs that between the lugs, if the user states it, else that of the farthest point.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.store.chosen import chosen

_CHOSEN = chosen("forces", "rolling")

TRACK_RULE = "own-track"
"""Name of the rule: behind the axle, faces that face back do not count."""

NO_RULE = "none"
"""Name of the rule that leaves no face out."""

RULES = {
    TRACK_RULE: "behind the axle, faces that face back push into the wheel's own track and do not count",
    NO_RULE: "every face that leads counts",
}
"""Rules in words, by name."""


def describe_friction(friction: float | None) -> str:
    """Say which friction the surface of a body has; None: the law states it, by the plates of the measured map."""
    if friction is None:
        return "none stated: as that of the measured plates"
    return f"{friction:g}, of the stress along a face over that across it"


NO_WHEEL = np.zeros(4)
"""Row of `rolling_rows` for a body that is no wheel: no direction of travel, no least travel, no track."""

LEVEL = 1e-9
"""Most that rounding makes a face face back, lie behind the axle (cm), or a travel fall short of the least one."""


def measure_radius(vertices_cm: FloatArray) -> float:
    """Return the radius of a wheel whose axle lies along y through (0, 0, 0), to its farthest point, cm.

    `vertices_cm`: x, y, z, shape (n, 3). Raises ValueError where the extents in x and z show that its axle lies
    elsewhere.
    """
    # a wheel reaches as far forward as backward, up and down
    x, _, z = vertices_cm.T
    radius = float(np.hypot(x, z).max())
    ends = np.array([x.min(), x.max(), z.min(), z.max()]) / radius
    if np.abs(np.abs(ends) - 1).max() > _CHOSEN.out_of_round:
        raise ValueError(
            "a wheel's axle lies along y through (0, 0, 0) of the mesh; found x from "
            f"{x.min():.4g} to {x.max():.4g} and z from {z.min():.4g} to {z.max():.4g} cm: turn or move it"
        )
    return radius


RIM_SOURCES = {
    "given": "as given",
    "farthest-point": "to the farthest point of the mesh, over any lugs: no rim was given",
}
"""Sources of the radius of a rim in words, by `Rim.taken_from`."""


class Rim(NamedTuple):
    """Radius to which slip and sinkage of a wheel belong, cm, and where it was taken from: a key of `RIM_SOURCES`.

    `lowest_cm`: least radius of the outline of the mesh about its axle, cm; NaN where the rim was given.
    """

    radius_cm: float
    taken_from: str
    lowest_cm: float = np.nan

    def describe(self) -> str:
        """Say which radius it is."""
        return f"{self.radius_cm:.4g} cm, {RIM_SOURCES[self.taken_from]}"

    @property
    def is_doubtful(self) -> bool:
        """True where no rim was given for a wheel that is not round, such as one with lugs."""
        return bool(self.lowest_cm < (1 - _CHOSEN.round_within) * self.radius_cm)

    def list_doubts(self) -> list[str]:
        """List one sentence, that slip and sinkage were taken to the tips of lugs and what to give instead, or none."""
        if not self.is_doubtful:
            return []
        cure = f"--rim {self.lowest_cm:.4g} (in Python rim_cm={self.lowest_cm:.4g}) takes them to the rim between lugs"
        least_cm = _CHOSEN.least_rim * self.radius_cm
        if self.lowest_cm < least_cm:
            cure = f"--rim (in Python rim_cm) takes them to another radius, of at least {least_cm:.4g} cm"
        doubt = (
            f"no rim was given, and the wheel is not round: the radius of its outline is {self.lowest_cm:.4g} to "
            f"{self.radius_cm:.4g} cm. Slip and sinkage are to its farthest point; {cure}"
        )
        return [doubt]


def lowest_radius(corners_cm: FloatArray) -> float:
    """Return the least radius of the outline of a wheel about its axle, cm: between lugs it is less than at their tips.

    `corners_cm`: triangles, shape (m, 3, 3). The outline has in each of `rays` directions of x and z (chosen.toml) the
    farthest point of the triangles; where a direction meets no triangle, the radius is 0.
    """
    # both ends of every edge of every triangle, x and z, shape (3 m, 2)
    starts = corners_cm[..., ::2].reshape(-1, 2)
    ends = np.roll(corners_cm, -1, axis=1)[..., ::2].reshape(-1, 2)
    # every edge in the sense in which its angle grows; one in line with the axle has no angle and does not count
    cross = starts[:, 0] * ends[:, 1] - starts[:, 1] * ends[:, 0]
    counts = np.abs(cross) > 0
    is_reversed = (cross < 0)[:, None]
    starts, ends = (
        np.where(is_reversed, ends, starts)[counts],
        np.where(is_reversed, starts, ends)[counts],
    )
    # rays that each edge meets: all from its first to its last one
    step = 2 * np.pi / _CHOSEN.rays
    first = np.arctan2(starts[:, 1], starts[:, 0])
    span = np.mod(np.arctan2(ends[:, 1], ends[:, 0]) - first, 2 * np.pi)
    first_ray = np.ceil(first / step).astype(int)
    rays_of_edge = np.floor((first + span) / step).astype(int) - first_ray + 1
    edges = np.repeat(np.arange(len(starts)), rays_of_edge)
    # pairs of an edge and a ray that meets it: the rays of an edge follow one another
    first_pair = np.repeat(np.cumsum(rays_of_edge) - rays_of_edge, rays_of_edge)
    rays = np.repeat(first_ray, rays_of_edge) + np.arange(edges.size) - first_pair
    along = ends[edges] - starts[edges]
    # a ray of direction u meets the line through s along d at the radius (s x d) / (u x d)
    outward = np.cos(rays * step) * along[:, 1] - np.sin(rays * step) * along[:, 0]
    radius_on_ray = np.abs(cross[counts][edges]) / outward
    farthest = np.zeros(_CHOSEN.rays)
    np.maximum.at(farthest, np.mod(rays, _CHOSEN.rays), radius_on_ray)
    return float(farthest.min())


def find_rim(vertices_cm: FloatArray, rim_cm: float | None, lowest_cm: float) -> Rim:
    """Return the rim that is given, or a rim through the farthest point of the wheel where none is given.

    `vertices_cm`: shape (n, 3). `rim_cm`: radius, or None. `lowest_cm`: `lowest_radius` of the wheel, from which is
    seen whether a rim should have been given. Raises ValueError where the wheel has no such rim, or its axle lies
    elsewhere.
    """
    radius = measure_radius(vertices_cm)
    if rim_cm is None:
        return Rim(radius, "farthest-point", lowest_cm)
    if not _CHOSEN.least_rim * radius <= rim_cm <= radius * (1 + 1e-9):
        raise ValueError(
            f"a rim of {_CHOSEN.least_rim * radius:.4g} to {radius:.4g} cm wanted, the farthest point of the mesh; found {rim_cm:g}"
        )
    return Rim(float(rim_cm), "given")


def fills_hull(vertices_cm: FloatArray, volume_cm3: float) -> bool:
    """Tell whether a solid body of this volume nearly fills the convex hull of its vertices (n, 3): it is convex.

    A wheel with lugs is not, and has the rule of its own track by default.
    """
    from scipy.spatial import ConvexHull

    return bool(volume_cm3 > _CHOSEN.filled * ConvexHull(vertices_cm).volume)


def rolling_rows(
    velocity: FloatArray,
    rate: FloatArray,
    radius_cm: npt.ArrayLike,
    track: npt.ArrayLike,
    begun: npt.ArrayLike = 1.0,
) -> FloatArray:
    """Describe rolling wheels to the kernel, a row for each pose, shape (p, 4).

    Columns: unit direction of travel x, y (for a wheel that turns in place its heading); the speed by which the travel
    falls short of `least_travel` of the rim speed (cm/s); and the share to which the track's rule holds, `track`: 1 or
    0, between them for a wheel that has just begun to move. `begun`: from 0 to 1 for such a wheel, whose direction of
    travel is not yet certain; 1: moving. `velocity` of the axle (cm/s), `rate` of turning (rad/s): x, y, z of
    the world, shape (p, 3).
    `radius_cm`: to the farthest point of the wheel, which moves at the rim speed.
    """
    travel = np.linalg.norm(velocity[:, :2], axis=1)
    heading = np.stack([rate[:, 1], -rate[:, 0]], axis=1)
    turn = np.linalg.norm(heading, axis=1)
    ahead = np.where(travel[:, None] > 0, velocity[:, :2], heading)
    length = np.linalg.norm(ahead, axis=1, keepdims=True)
    rim_speed = turn * np.asarray(radius_cm)
    short_of = np.maximum(_CHOSEN.least_travel * rim_speed - travel, 0.0) * begun
    # a slip of 0.5 itself is not short of it by rounding
    short_of = np.where(short_of > LEVEL * rim_speed, short_of, 0.0)
    track = np.broadcast_to(np.asarray(track, dtype=float), travel.shape)
    return np.column_stack([ahead / np.where(length > 0, length, 1.0), short_of, track])


def leading_speed(outward: FloatArray, normal: FloatArray, rolling: FloatArray) -> FloatArray:
    """Return the speed along the normal that decides whether a face leads: with a travel of at least `least_travel`.

    `outward`: speed along the normal as the face moves, times the length of `normal`, (m,). `normal`, of any length:
    (m, 3). `rolling`: a row of `rolling_rows`; of a body that is no wheel nothing changes.
    """
    return np.asarray(outward + rolling[2] * (normal[:, :2] @ rolling[:2]))


def lies_in_track(
    normal: FloatArray, arm: FloatArray, rolling: FloatArray
) -> npt.NDArray[np.bool_]:
    """Tell which faces push into the wheel's own track: they lie behind the axle and face back.

    `normal`, of any length, and `arm` from the axle: (m, 3). `rolling`: a row of `rolling_rows`; False where its rule
    does not hold in full.
    """
    ahead = normal[:, :2] @ rolling[:2]
    faces_back = ahead < -LEVEL * np.linalg.norm(normal, axis=-1)
    return np.asarray((rolling[3] >= 1) & faces_back & (arm[:, :2] @ rolling[:2] < -LEVEL))
