"""Triangle meshes: files, ready shapes (wheel, sphere, sheet), checks; motions in space: press, roll, any path.

x, y level, z up, in cm; a mesh has its own axes, and the axes of the world have z = 0 at the free surface. A mesh of n
vertices and m triangles is `vertices_cm` (n, 3) and `faces` (m, 3), the indices of the corners of each triangle,
counterclockwise seen from outside. A frame is a pose as a row of 18 numbers: position (3, cm), velocity (3, cm/s), rate
of turning about the axes of the world (3, rad/s), and rotation from mesh to world (9, row by row).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rftfit.campaign.problems import choose
from rftfit.campaign.rows import TableColumn
from rftfit.conventions import FloatArray
from rftfit.errors import InputError
from rftfit.forces.motion import SCHEMA, as_increasing, rates_of_steps, read_path_columns
from rftfit.forces.outlines import Outline
from rftfit.forces.rolling import (
    NO_RULE,
    NO_WHEEL,
    TRACK_RULE,
    Rim,
    fills_hull,
    find_rim,
    lowest_radius,
    measure_radius,
    rolling_rows,
)
from rftfit.table.units import LENGTH_TO_CM

IntArray = NDArray[np.int64]

UNITS_CM = {unit: LENGTH_TO_CM[unit] for unit in ("mm", "cm", "m", "in")}
"""Size of each unit that a file of a mesh may have, cm."""

FORMATS = (".stl", ".obj", ".ply")
"""Endings of files that are read."""

SIZES_CM = (0.2, 100.0)
"""Least and greatest length of a body from a file: a body outside of them was probably read in a wrong unit."""

PATH = replace(
    SCHEMA,
    columns=(
        SCHEMA.columns[0],
        *(
            TableColumn(f"{axis}_cm", meaning=f"{axis} of the reference point", unit="cm")
            for axis in "xyz"
        ),
        *(
            TableColumn(
                f"turn_{axis}_deg", meaning=f"{axis} of the vector of rotation", unit="degrees"
            )
            for axis in "xyz"
        ),
    ),
)
"""Columns of a file with a path in space: time, position, vector of rotation."""

_RIM_FACETS, _FLANK_CM, _SECTION_CM = 96, 0.4, 0.8
"""Facets around the rim of a wheel with lugs, longest edge on the flank of a lug and longest edge across the wheel, cm."""

_SAME = 1e-7
"""Distance over the mesh's size below which two vertices are one: an STL file repeats them in each triangle."""


class Mesh:
    """The skin of a solid body, or a thin sheet, as triangles about its reference point (0, 0, 0).

    A mesh that is turned inside out, has repeated faces or faces without area is mended with a warning, and
    `notes` says so; one that is open or not wound consistently is refused, because its forces
    would be wrong and look possible.

    Parameters
    ----------
    vertices_cm : array_like, shape (n, 3)
        x, y horizontal, z up, cm.
    faces : array_like, shape (m, 3)
        Numbers of the three vertices of each triangle, counterclockwise seen from outside.
    name : str, optional
    sheet : bool, optional
        True for a thin sheet, on which the medium acts from either side and which need not be closed.

    Raises
    ------
    ValueError
        If the mesh cannot be used; the text says why and where.

    Examples
    --------
    >>> import rftfit
    >>> wheel = rftfit.Mesh.cylinder(radius_cm=6.25, width_cm=6)
    >>> round(wheel.area_cm2)
    481
    """

    def __init__(
        self, vertices_cm: ArrayLike, faces: ArrayLike, name: str = "mesh", sheet: bool = False
    ) -> None:
        vertices, corners = np.array(vertices_cm, dtype=float), np.array(faces, dtype=np.int64)
        for what, array in (("vertices", vertices), ("faces", corners)):
            if (
                array.ndim != 2
                or array.shape[1] != 3
                or not array.size
                or not np.isfinite(array).all()
            ):
                raise ValueError(f"finite {what} of shape (n, 3) wanted, found {array.shape}")
        if corners.min() < 0 or corners.max() >= len(vertices):
            lowest_to_highest = f"{corners.min()} to {corners.max()}"
            raise ValueError(
                f"faces name vertices 0 to {len(vertices) - 1}, found {lowest_to_highest}"
            )
        vertices, corners = _merge_vertices(vertices, corners)
        notes = []
        # a face with one vertex twice has no area
        distinct_corners = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]
        if lost := len(corners) - len(distinct_corners):
            notes.append(f"left out {lost} faces without area")
        _, once = np.unique(np.sort(distinct_corners, axis=1), axis=0, return_index=True)
        if lost := len(distinct_corners) - len(once):
            notes.append(f"left out {lost} faces that were there twice")
        corners = distinct_corners[np.sort(once)]
        if not sheet:
            _check_closed(vertices, corners)
            part_of_face = _number_parts(len(vertices), corners)
            if _turned_inside_out(vertices, corners, part_of_face):
                corners = corners[:, ::-1]
                notes.append(
                    "mended, was turned inside out: faces were wound clockwise seen from outside"
                )
            if crossing := _count_crossing_parts(vertices, corners, part_of_face):
                notes.append(
                    f"{crossing} of {part_of_face.max() + 1} closed parts reach into another one: faces that lie inside count "
                    "as if they touched the medium; unite the parts"
                )
        for note in notes:
            warnings.warn(f"{name}: {note}", stacklevel=2)
        self.vertices_cm, self.faces, self.name, self.sheet = vertices, corners, name, sheet
        self.notes = tuple(notes)
        self.triangles_given = len(corners)

    def describe_size(self) -> str:
        """Say how long the body is along x, y and z of the mesh; z is up."""
        x, y, z = np.ptp(self.vertices_cm, axis=0)
        return f"{x:.4g} cm along its x, {y:.4g} along y, {z:.4g} along z (up)"

    def __repr__(self) -> str:
        x, y, z = np.ptp(self.vertices_cm, axis=0)
        kind = "sheet" if self.sheet else "Mesh"
        return (
            f"<{kind} {self.name}: {describe_triangles(len(self.faces), self.triangles_given)}, {self.area_cm2:.4g} cm^2, "
            f"{x:.4g} x {y:.4g} x {z:.4g} cm>"
        )

    @property
    def triangles(self) -> FloatArray:
        """Corners of the faces, cm, shape (m, 3, 3)."""
        return np.ascontiguousarray(self.vertices_cm[self.faces])

    @property
    def edges_cm(self) -> FloatArray:
        """Longest edge of each triangle, shape (m,)."""
        return np.asarray(_edge_lengths(self.triangles).max(axis=1))

    @property
    def points_cm(self) -> FloatArray:
        """Points that span the body: its vertices, shape (n, 3). An outline has a property of this name, too."""
        return self.vertices_cm

    @property
    def area_cm2(self) -> float:
        """Area of all faces (of a sheet: of one side)."""
        return float(np.linalg.norm(area_vectors(self.triangles), axis=-1).sum())

    @cached_property
    def is_convex(self) -> bool:
        """True for a solid body that fills its convex hull: no wheel with lugs does."""
        return fills_hull(self.vertices_cm, self.volume_cm3)

    @cached_property
    def lowest_radius_cm(self) -> float:
        """Least radius of the outline of a wheel about y through (0, 0, 0), between its lugs."""
        return lowest_radius(self.triangles)

    @property
    def volume_cm3(self) -> float:
        """Volume that the faces enclose, as the sum of signed tetrahedra below them; of a sheet it means nothing."""
        return float(np.linalg.det(self.triangles - self.vertices_cm.mean(axis=0)).sum()) / 6

    def moved(self, rotation: FloatArray, by_cm: FloatArray) -> Mesh:
        """Return the mesh turned by a matrix about its reference point, then moved.

        Parameters
        ----------
        rotation : numpy.ndarray, shape (3, 3)
        by_cm : numpy.ndarray, shape (3,)

        Returns
        -------
        Mesh
        """
        return self._with_faces(self.vertices_cm @ np.transpose(rotation) + by_cm, self.faces)

    def refined(self, longest_cm: float) -> Mesh:
        """Return the same body with triangles halved until no edge is longer: its forces are nearer to those of the law.

        `predict` and `wheel` do so by themselves where a mesh is coarse (`rftfit.forces.fineness`); `Ground` by
        its `triangle_cm`.

        Parameters
        ----------
        longest_cm : float
            Greatest length of an edge.

        Returns
        -------
        Mesh
        """
        short_enough, too_long = [], self.triangles
        while len(too_long):
            lengths = _edge_lengths(too_long)
            short = lengths.max(axis=1) <= longest_cm
            short_enough.append(too_long[short])
            too_long, lengths = too_long[~short], lengths[~short]
            # the corners of each triangle in a cycle, so that a to b is the longest edge
            order = (lengths.argmax(axis=1)[:, None] + np.arange(3)) % 3
            a, b, c = np.moveaxis(np.take_along_axis(too_long, order[..., None], axis=1), 1, 0)
            middle = (a + b) / 2
            too_long = np.concatenate([np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)])
        corners = np.concatenate(short_enough).reshape(-1, 3)
        return self._with_faces(corners, np.arange(len(corners)).reshape(-1, 3))

    def _with_faces(self, vertices: FloatArray, faces: IntArray) -> Mesh:
        """Return this mesh, moved or cut finer, with other vertices and faces, which are not checked."""
        changed_mesh = copy(self)
        changed_mesh.vertices_cm, changed_mesh.faces = vertices, faces
        # a copy holds what was calculated of this mesh; the radius about the axle is another one where it was moved
        vars(changed_mesh).pop("lowest_radius_cm", None)
        return changed_mesh

    @classmethod
    def read(cls, file: str | Path, unit: str, sheet: bool = False) -> Mesh:
        """Read an STL, OBJ or PLY file by the package trimesh (``pip install 'rftfit[mesh]'``).

        Parameters
        ----------
        file : str or Path
        unit : str
            Unit of the coordinates, which the file does not state: ``mm``, ``cm``, ``m`` or ``in``.
        sheet : bool, optional
            True for a thin sheet, see `Mesh`.

        Returns
        -------
        Mesh
            Named after the file.

        Raises
        ------
        InputError
            If there is no such file, trimesh is missing, the mesh cannot be used, or it is shorter than 2 mm
            or longer than 1 m (``Mesh(vertices_cm, faces)`` takes any size).
        """
        file = Path(file)
        choose("unit", unit, tuple(UNITS_CM))
        choose(f"{file}: ending", file.suffix.lower(), FORMATS)
        if not file.is_file():
            raise InputError(f"{file}: no such file")
        try:
            import trimesh
        except ImportError:
            raise InputError("to read meshes needs trimesh: pip install 'rftfit[mesh]'") from None
        try:
            solid = trimesh.load_mesh(file, process=False)
            vertices, faces = UNITS_CM[unit] * np.asarray(solid.vertices), np.asarray(solid.faces)
            mesh = cls(vertices, faces, file.stem, sheet)
        except Exception as error:  # noqa: BLE001 - a reader of foreign files fails in any way
            raise InputError(f"{file}: no mesh that can be used: {error}") from None
        size = float(np.ptp(mesh.vertices_cm, axis=0).max())
        if not SIZES_CM[0] <= size <= SIZES_CM[1]:
            raise InputError(
                f"{file}: {size:.4g} cm long if its unit is {unit}; allowed: {SIZES_CM[0]:g} to "
                f"{SIZES_CM[1]:g} cm. Is the unit another one of {', '.join(UNITS_CM)}?"
            )
        return mesh

    @classmethod
    def extrude(cls, outline: Outline) -> Mesh:
        """Make a sheet from an outline in the plane: two triangles for each element, as wide in y as the outline.

        Parameters
        ----------
        outline : Outline
            A thin outline: `model_leg`, `arc`, `polyline`.

        Returns
        -------
        Mesh

        Raises
        ------
        ValueError
            If the outline is the skin of a solid body.
        """
        if outline.solid:
            raise ValueError(f"{outline.name} is solid; allowed: a thin outline")
        x, z, along_x, along_z, half_length = outline.body.T
        along = half_length * np.stack([along_x, 0 * x, along_z])
        centre = np.stack([x, 0 * x, z])
        # shape (elements, 2, 3)
        ends = np.stack([centre - along, centre + along]).transpose(2, 0, 1)
        side = np.array([0.0, outline.width_cm / 2, 0.0])
        # four corners of each element: both ends on one side, both on the other
        corners = np.concatenate([ends - side, ends + side], axis=1).reshape(-1, 3)
        first_corner = 4 * np.arange(len(x))[:, None]
        # both halves of each rectangle, by the number of its corner
        faces = np.concatenate([first_corner + np.array(half) for half in ([0, 1, 3], [0, 3, 2])])
        return cls(corners, faces, outline.name, sheet=True)

    @classmethod
    def sphere(cls, radius_cm: float, facets: int = 32) -> Mesh:
        """Make a sphere of `facets` latitudes and twice as many longitudes, with its vertices on the sphere.

        Parameters
        ----------
        radius_cm : float
        facets : int, optional

        Returns
        -------
        Mesh
        """
        polar = np.linspace(-np.pi / 2, np.pi / 2, facets + 1)
        profile = radius_cm * np.stack([np.cos(polar), np.sin(polar)], axis=-1)
        # the poles lie exactly on the axis
        profile[[0, -1], 0] = 0.0
        return cls(*_revolve(profile, 2 * facets), "sphere")

    @classmethod
    def cylinder(cls, radius_cm: float, width_cm: float, facets: int = 96) -> Mesh:
        """Make a cylinder or wheel about the y axis, with y = 0 in the middle of its width.

        Parameters
        ----------
        radius_cm, width_cm : float
        facets : int, optional
            Number around the axis; across the width and on the two ends triangles are as large.

        Returns
        -------
        Mesh
        """
        # points r, y from the centre of one end out to the rim, across the width, and in to the centre of the other end
        radii = radius_cm * np.linspace(0, 1, facets // 6 + 1)
        rows = max(1, round(facets * width_cm / (2 * np.pi * radius_cm)))
        r = np.concatenate([radii[:-1], np.full(rows + 1, radius_cm), radii[-2::-1]])
        y = np.linspace(-width_cm / 2, width_cm / 2, rows + 1)
        y = np.concatenate([np.full(radii.size - 1, y[0]), y, np.full(radii.size - 1, y[-1])])
        vertices, faces = _revolve(np.stack([r, y], axis=-1), facets)
        # about the y axis instead of z; an exchange of two axes turns the faces over
        return cls(vertices[:, [0, 2, 1]], faces[:, ::-1], "cylinder")

    @classmethod
    def wheel(
        cls,
        radius_cm: float,
        width_cm: float,
        lug_cm: float = 0.0,
        lugs: int = 0,
        thickness_cm: float = 0.5,
    ) -> Mesh:
        """Make a wheel about the y axis with straight lugs from the numbers of a drawing; without lugs a cylinder.

        Parameters
        ----------
        radius_cm, width_cm : float
            Radius and width of the rim.
        lug_cm : float, optional
            Height of a lug over the rim.
        lugs : int, optional
            Number of lugs, evenly spaced.
        thickness_cm : float, optional
            Thickness of a lug, along the rim.

        Returns
        -------
        Mesh

        Raises
        ------
        ValueError
            If a length is not positive, only one of height and number of lugs is given, or the lugs overlap.

        Examples
        --------
        >>> import rftfit
        >>> rftfit.Mesh.wheel(9, 6, lug_cm=1, lugs=12).is_convex
        False
        """
        if not (radius_cm > 0 and width_cm > 0 and thickness_cm > 0):
            raise ValueError("radius, width and thickness of lugs: positive numbers wanted")
        if lug_cm < 0 or lugs < 0 or (lug_cm > 0) != (lugs > 0):
            raise ValueError(f"lugs: a height and a number wanted, found {lug_cm:g} cm and {lugs}")
        if not lugs:
            return cls.cylinder(radius_cm, width_cm)
        pitch = 2 * np.pi / lugs
        if not thickness_cm < pitch * radius_cm:
            raise ValueError(f"{lugs} lugs of {thickness_cm:g} cm do not fit on the rim")
        # angles are those about the axle, rad: of a lug half of what it takes at its root and at its tip
        root = np.arcsin(thickness_cm / 2 / radius_cm)
        tip = np.arcsin(thickness_cm / 2 / (radius_cm + lug_cm))
        height = np.linspace(0, 1, max(1, int(np.ceil(lug_cm / _FLANK_CM))) + 1)
        steps = max(2, int(np.ceil((pitch - 2 * root) / (2 * np.pi / _RIM_FACETS))))
        # the same at all heights of the flank, from root to tip
        flank = root + (tip - root) * height
        rim = np.linspace(root, pitch - root, steps + 1)[1:-1]
        # one lug and the rim behind it: up a flank, over the tip, down, along the rim
        radius_of_lug = radius_cm + lug_cm * np.concatenate([height, height[::-1], 0 * rim])
        angle_of_lug = np.concatenate([-flank, flank[::-1], rim])
        radius = np.tile(radius_of_lug, lugs)
        angle = np.concatenate([angle_of_lug + lug * pitch for lug in range(lugs)])
        sections = max(1, round(width_cm / _SECTION_CM))
        across = np.linspace(-width_cm / 2, width_cm / 2, sections + 1)
        x, z = radius * np.sin(angle), radius * np.cos(angle)
        vertices = [np.stack([x, np.full_like(x, y), z], axis=1) for y in across]
        hubs = np.array([[0, -width_cm / 2, 0], [0, width_cm / 2, 0]])
        # numbers of the vertices of the first outline; those of the next one across are larger by their count
        count = radius.size
        nodes = np.arange(count)
        next_nodes = np.roll(nodes, -1)
        # two triangles for each edge of each section of the tread, then the two ends around their hubs
        faces = []
        for first in count * np.arange(sections):
            a, b = first + nodes, first + next_nodes
            faces += [[a, b, b + count], [a, b + count, a + count]]
        hub, last = count * (sections + 1) + 0 * nodes, count * sections
        faces += [[hub, next_nodes, nodes], [hub + 1, last + nodes, last + next_nodes]]
        return cls(
            np.concatenate([*vertices, hubs]),
            np.concatenate([np.stack(corners, axis=1) for corners in faces]),
            "lugged wheel",
        )


def _edge_lengths(triangles: FloatArray) -> FloatArray:
    """Return the lengths of the edges of triangles (m, 3, 3), from corner to next corner, shape (m, 3)."""
    return np.asarray(np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=-1))


def describe_triangles(count: int, given: int) -> str:
    """Say that a mesh has `count` triangles, and from how many, `given`, they were made by refining."""
    return f"{count} triangles" + (f", made of {given}" if count > given else "")


def _revolve(profile: FloatArray, longitudes: int) -> tuple[FloatArray, IntArray]:
    """Return vertices (n, 3) and faces (m, 3) of the solid that a line describes when it turns about the z axis.

    `profile`: points r, z of the line, shape (k, 2), from the lower end of the axis to the upper one. `longitudes`:
    number of points around the axis.
    """
    angle = 2 * np.pi * np.arange(longitudes) / longitudes
    r, z = profile.T[..., None]
    vertices = np.stack([r * np.cos(angle), r * np.sin(angle), z + 0 * angle], axis=-1)
    # numbers of the vertices, a row for each point of the profile; all of a point on the axis are the first of its row
    number = np.arange(r.size * longitudes).reshape(r.size, longitudes)
    number = np.where(r == 0, number[:, :1], number)
    right = np.roll(number, -1, axis=1)
    # two triangles for each quadrilateral; next to the axis one of them has no area
    first = np.stack([number[:-1], right[:-1], right[1:]], axis=-1)
    second = np.stack([number[:-1], right[1:], number[1:]], axis=-1)
    faces = np.stack([first, second], axis=2).reshape(-1, 3)
    return vertices.reshape(-1, 3), faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]


def _merge_vertices(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray]:
    """Return vertices and faces with vertices nearer to each other than `_SAME` merged, and those of no face left out.

    Only then a face shares its edges with its neighbours, which `_check_closed` looks for. Raises ValueError where all
    vertices are one point.
    """
    used = np.unique(faces)
    size = np.ptp(vertices[used], axis=0).max()
    if not size > 0:
        raise ValueError("all vertices are one point")
    rounded = np.round(vertices[used] / (_SAME * size))
    _, kept, merged = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    new_number = np.zeros(len(vertices), dtype=np.int64)
    new_number[used] = merged.ravel()
    return vertices[used][kept], new_number[faces]


def area_vectors(triangles: FloatArray) -> FloatArray:
    """Return the normal times the area of triangles (..., 3, 3), cm^2, shape (..., 3): outward where they are wound so."""
    a, b, c = np.moveaxis(triangles, -2, 0)
    return np.cross(b - a, c - a) / 2


_OPEN = (
    "belong to one face only: the mesh is open, as where a corner lies on the edge of another face (a thin sheet: --sheet, in "
    "Python sheet=True)"
)
"""Fault of an edge with one face, as the end of a sentence."""


def _check_closed(vertices: FloatArray, faces: IntArray) -> None:
    """Raise ValueError unless each edge belongs to two faces that run through it in opposite directions.

    Only such a mesh has an inside and an outside, and so a side of each face that the medium touches. `vertices` (n,
    3), cm, say where the first wrong edge is.
    """
    # the three sides of every face, each from a corner to the next one, (3 m, 2)
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    forward = np.where(sides[:, 0] < sides[:, 1], 1, -1)
    edges, edge_of_side, count = np.unique(
        np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    # 0 where both faces run through an edge in opposite directions
    direction = np.bincount(edge_of_side.ravel(), forward)
    for wrong, fault in (
        (count == 1, _OPEN),
        (count > 2, "belong to more than two faces: walls inside, or bodies that touch"),
        (direction != 0, "are run through twice in the same direction: some faces are turned over"),
    ):
        if wrong.any():
            position = ", ".join(
                f"{x:.4g}" for x in vertices[edges[wrong][0]].mean(axis=0).round(6) + 0.0
            )
            raise ValueError(
                f"{wrong.sum()} of {len(edges)} edges {fault}; the first at ({position}) cm"
            )


def _number_parts(n_vertices: int, faces: IntArray) -> IntArray:
    """Return the number of the part of each of the faces (m, 3), from 0, shape (m,): parts have no vertex in common.

    `n_vertices`: of the whole mesh.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    ends = faces.ravel(), np.roll(faces, 1, axis=1).ravel()
    links = coo_array((np.ones(faces.size), ends), (n_vertices, n_vertices))
    part_of_vertex = connected_components(links)[1]
    return np.asarray(np.unique(part_of_vertex[faces[:, 0]], return_inverse=True)[1]).ravel()


def _count_crossing_parts(vertices: FloatArray, faces: IntArray, part_of_face: IntArray) -> int:
    """Return the number of closed parts with an edge inside another part, tried at eight points of each edge.

    Faces that lie inside another part touch no medium, but would count. `part_of_face`: from `_number_parts`.
    """
    # triangles of each part, (faces of the part, 3, 3), and the box around each
    order = np.argsort(part_of_face, kind="stable")
    ends = np.cumsum(np.bincount(part_of_face))
    triangles = np.split(vertices[faces[order]], ends[:-1])
    lowest = np.array([part.min(axis=(0, 1)) for part in triangles])
    highest = np.array([part.max(axis=(0, 1)) for part in triangles])
    crossing = 0
    for inner, inner_part in enumerate(triangles):
        # only parts whose boxes overlap can cross
        meets = ((lowest < highest[inner]) & (highest > lowest[inner])).all(axis=1)
        meets[inner] = False
        if not meets.any():
            continue
        edges = np.roll(inner_part, -1, axis=1) - inner_part
        along_edges = [inner_part + share * edges for share in np.arange(8) / 8]
        points = np.concatenate(along_edges).reshape(-1, 3)
        for outer in np.flatnonzero(meets):
            candidates = points[((points > lowest[outer]) & (points < highest[outer])).all(axis=1)]
            # at most 300 of them, evenly chosen
            candidates = candidates[:: max(1, -(-len(candidates) // 300))]
            if any(_winding(point, triangles[outer]) > 0.5 for point in candidates):
                crossing += 1
                break
    return crossing


def _winding(point: FloatArray, triangles: FloatArray) -> float:
    """Return the winding number of a closed surface around a point (3,): 1 inside, 0 outside.

    By the solid angles w of its triangles (m, 3, 3), van Oosterom and Strackee (1983): tan(w / 2) = a (b x c) /
    (|a||b||c| + (a b) |c| + (b c) |a| + (c a) |b|).
    """
    a, b, c = np.moveaxis(triangles - point, 1, 0)
    length_a, length_b, length_c = (np.linalg.norm(corner, axis=1) for corner in (a, b, c))
    volume = (a * np.cross(b, c)).sum(axis=1)
    across = length_a * length_b * length_c + (a * b).sum(axis=1) * length_c
    across += (b * c).sum(axis=1) * length_a + (c * a).sum(axis=1) * length_b
    # halves of the solid angles add up to 2 pi inside
    return abs(float(np.arctan2(volume, across).sum())) / (2 * np.pi)


def _turned_inside_out(vertices: FloatArray, faces: IntArray, part_of_face: IntArray) -> bool:
    """Tell whether all parts have a negative volume: their faces are wound clockwise seen from outside.

    Raises ValueError where only some have, or a part has none. `part_of_face`: from `_number_parts`.
    """
    signed = np.linalg.det(vertices[faces] - vertices.mean(axis=0)) / 6
    volumes = np.bincount(part_of_face, signed)
    if (np.abs(volumes) < _SAME * np.ptp(vertices, axis=0).max() ** 3).any():
        raise ValueError(
            "the mesh encloses no volume; a thin sheet needs --sheet, in Python sheet=True"
        )
    if (volumes < 0).any() and (volumes > 0).any():
        raise ValueError(
            f"{(volumes < 0).sum()} of {volumes.size} closed parts are turned inside out: a part turned over, or "
            "a hollow inside, which does not touch the medium and has to be taken out"
        )
    return bool((volumes < 0).all())


class Motion3D:
    """Poses of a mesh: where its reference point is, how it is turned, and how it moves.

    Parameters
    ----------
    position_cm, velocity_cm_per_s : array_like, shape (p, 3) or (3,)
        Position and velocity of the reference point; z = 0 is the free surface.
    rate_rad_per_s : array_like, shape (p, 3) or (3,), optional
        Angular velocity about the axes of the world: positive about y turns z toward x. Default 0.
    rotation : array_like, shape (p, 3, 3) or (3, 3), or scipy.spatial.transform.Rotation, optional
        Rotation from the mesh to the world. Default: not turned.
    name : str, optional

    Attributes
    ----------
    frames : numpy.ndarray, shape (p, 18)
        Position, velocity, rate, and rotation row by row.
    columns : dict of str to numpy.ndarray, shape (p,)
        ``x_cm, y_cm, z_cm``; of a path ``t_s`` before and ``turn_x_deg, turn_y_deg, turn_z_deg`` after them; of
        `press` and `roll` depth or turn before them.
    rule : str
        ``own-track`` where faces of a rolling wheel behind its axle that face back do not count, else ``none``.
    rim : Rim or None
        Radius to which slip and sinkage of a rolling wheel belong, and where it was taken from; None of another motion.
    rolling : numpy.ndarray, shape (p, 4)
        Rows of `rftfit.forces.rolling.rolling_rows`, by which some faces of a rolling wheel do not count; zeros of
        another motion.
    rates_of_steps : numpy.ndarray, shape (2, p, 6), or None
        Velocities and rates of a path over the step before each pose and over the one after it; None of another motion.

    Raises
    ------
    ValueError
        If a shape does not fit, or a matrix is no rotation.

    Examples
    --------
    >>> import rftfit
    >>> down = rftfit.Motion3D(position_cm=[0, 0, -1], velocity_cm_per_s=[0, 0, -1])
    """

    def __init__(
        self,
        position_cm: ArrayLike,
        velocity_cm_per_s: ArrayLike,
        rate_rad_per_s: ArrayLike | None = None,
        rotation: Any = None,
        name: str = "poses in space",
    ) -> None:
        # a Rotation of scipy, or matrices
        matrices = getattr(rotation, "as_matrix", lambda: rotation)()
        arguments = {
            "position_cm": (position_cm, 3),
            "velocity_cm_per_s": (velocity_cm_per_s, 3),
            "rate_rad_per_s": (np.zeros(3) if rate_rad_per_s is None else rate_rad_per_s, 3),
            "rotation": (np.eye(3) if matrices is None else matrices, 9),
        }
        arrays = []
        for name_of_argument, (argument, size) in arguments.items():
            array = np.asarray(argument, dtype=float)
            if array.size % size or array.shape[-1:] != (3,):
                fault = f"{size} numbers a pose wanted, found {array.shape}"
                raise ValueError(f"{name_of_argument}: {fault}")
            arrays.append(array.reshape(-1, size))
        lengths = [len(array) for array in arrays]
        if len({*lengths} - {1}) > 1:
            raise ValueError(f"poses differ in number: {lengths}")
        poses = max(lengths)
        self.frames = np.hstack([np.broadcast_to(a, (poses, a.shape[1])) for a in arrays])
        self.name = name
        self.rolling = np.zeros((poses, len(NO_WHEEL)))
        self.rule = NO_RULE
        self.rim: Rim | None = None
        self.rates_of_steps: FloatArray | None = None
        self.columns = {f"{axis}_cm": self.frames[:, k] for k, axis in enumerate("xyz")}
        turned = self.frames[np.isfinite(self.frames).all(axis=1), 9:].reshape(-1, 3, 3)
        square = turned @ turned.swapaxes(1, 2)
        if not (np.allclose(square, np.eye(3), atol=1e-6) and (np.linalg.det(turned) > 0).all()):
            raise ValueError("a matrix of rotation is not orthogonal, or mirrors")

    def __repr__(self) -> str:
        return f"<Motion3D {self.name}: {len(self.frames)} poses>"

    def at_poses(self, numbers: Sequence[int]) -> Motion3D:
        """Return some poses alone, by their indices, with their rates: not those of a path through these poses."""
        motion = copy(self)
        motion.frames, motion.rolling = self.frames[numbers], self.rolling[numbers]
        motion.columns = {name: column[numbers] for name, column in self.columns.items()}
        motion.rates_of_steps = None
        return motion

    def depth_of(self, mesh: Mesh) -> float:
        """Return the depth of the lowest point of a mesh in its deepest pose, cm; negative above the surface."""
        # the last row of a rotation, frame[15:], gives the height of a vertex above the reference point, frame[2]
        lowest_cm = [frame[2] + (mesh.vertices_cm @ frame[15:]).min() for frame in self.frames]
        return -float(np.nanmin(lowest_cm))

    def at_rates(self, rates: FloatArray) -> Motion3D:
        """Return the same poses of a path at other velocities (cm/s) and rates of turning (rad/s), shape (p, 6)."""
        motion = copy(self)
        motion.frames = np.hstack([self.frames[:, :3], rates, self.frames[:, 9:]])
        return motion

    @classmethod
    def press(cls, mesh: Mesh, depth_cm: float, poses: int = 50) -> Motion3D:
        """Press a mesh straight down, without turning it, from the surface until its lowest point is at a depth.

        Parameters
        ----------
        mesh : Mesh
        depth_cm : float
            Depth of the lowest point at the end.
        poses : int, optional
            Number of poses, in equal steps of depth.

        Returns
        -------
        Motion3D
            At 1 cm/s; ``depth_cm`` before ``x_cm, y_cm, z_cm``.

        Raises
        ------
        ValueError
            If the depth is not positive.
        """
        if not 0 < depth_cm < np.inf:
            raise ValueError(f"a depth above 0 cm wanted, found {depth_cm:g}")
        depth = depth_cm * np.arange(1, poses + 1) / poses
        lowest = mesh.vertices_cm[:, 2].min()
        position = np.zeros((poses, 3))
        position[:, 2] = -lowest - depth
        name = f"pressed straight down, {depth_cm:g} cm deep"
        motion = cls(position, [0.0, 0.0, -1.0], name=name)
        motion.columns = {"depth_cm": depth} | motion.columns
        return motion

    @classmethod
    def roll(
        cls,
        mesh: Mesh,
        sinkage_cm: float,
        slip: float,
        poses: int = 72,
        *,
        track: bool = True,
        rim_cm: float | None = None,
    ) -> Motion3D:
        """Roll a wheel toward +x for one turn, at a sinkage and with a slip.

        Parameters
        ----------
        mesh : Mesh
            The axle lies along y through the reference point (0, 0, 0).
        sinkage_cm : float
            Depth of the lowest point of the rim.
        slip : float
            1 less travel over rim speed where the rim is faster (it drives: 0 to 1), rim speed over travel less 1
            where it is slower (it brakes: -1 to 0; -1 is a locked wheel).
        poses : int, optional
            Number of poses, in equal steps of the turn.
        track : bool, optional
            True where a wheel that is not convex leaves a rut, so that behind its axle faces that face back do not
            count. A sheet leaves none.
        rim_cm : float, optional
            Radius of the rim, to which sinkage and slip belong. Default: to the farthest vertex, over the lugs.

        Returns
        -------
        Motion3D
            The faster of rim and axle moves at 1 cm/s; ``wheel_turn_deg`` before ``x_cm, y_cm, z_cm``.

        Raises
        ------
        ValueError
            If the axle does not lie along y through the middle, or sinkage, slip or rim are impossible.
        """
        rim = find_rim(mesh.vertices_cm, rim_cm, mesh.lowest_radius_cm)
        radius = rim.radius_cm
        if not 0 < sinkage_cm < 2 * radius:
            raise ValueError(
                f"a sinkage above 0 and below the diameter of {2 * radius:.4g} cm wanted, found {sinkage_cm:g}"
            )
        if not -1 <= slip <= 1:
            raise ValueError(f"a slip from -1 to 1 wanted (20 % is 0.2), found {slip:g}")
        rim_speed, travel = (1.0, 1 - slip) if slip >= 0 else (1 + slip, 1.0)
        turn = np.arange(poses) / poses * 2 * np.pi
        cos, sin = np.cos(turn), np.sin(turn)
        zeros = np.zeros(poses)
        # about y, z toward x
        matrices = np.stack([cos, zeros, sin, zeros, zeros + 1, zeros, -sin, zeros, cos], axis=-1)
        motion = cls(
            [0.0, 0.0, radius - sinkage_cm],
            [travel, 0.0, 0.0],
            [0.0, rim_speed / radius, 0.0],
            matrices.reshape(-1, 3, 3),
            f"rolled, {sinkage_cm:g} cm deep, slip {slip:g}",
        )
        motion.columns = {"wheel_turn_deg": np.degrees(turn)} | motion.columns
        motion.rim = rim
        # a sheet has no outside, and neither rule
        if not mesh.sheet:
            has_track = track and not mesh.is_convex
            velocity, rate = motion.frames[:, 3:6], motion.frames[:, 6:9]
            farthest_cm = measure_radius(mesh.vertices_cm)
            motion.rolling = rolling_rows(velocity, rate, farthest_cm, has_track)
            motion.rule = TRACK_RULE if has_track else NO_RULE
        return motion

    @classmethod
    def path(
        cls,
        time_s: ArrayLike,
        position_cm: ArrayLike,
        turn_deg: ArrayLike,
        name: str = "a path in space",
    ) -> Motion3D:
        """Move along a path; velocity and rate of a pose are the means over the steps before and after it.

        Parameters
        ----------
        time_s : array_like, shape (p,)
            Increasing times, at least two.
        position_cm : array_like, shape (p, 3)
        turn_deg : array_like, shape (p, 3)
            Vector of rotation: along the axis, as long as the angle. Less than half a turn from one time to
            the next.
        name : str, optional

        Returns
        -------
        Motion3D

        Raises
        ------
        ValueError
            If there are fewer than two times, or time does not increase.
        """
        from scipy.spatial.transform import Rotation

        time = as_increasing(time_s)
        position, turn = (np.asarray(series, dtype=float) for series in (position_cm, turn_deg))
        turned = Rotation.from_rotvec(np.radians(turn))
        # small turns from pose to pose, in the axes of the world, add up to angles whose rate is that of turning
        steps = np.cumsum((turned[1:] * turned[:-1].inv()).as_rotvec(), axis=0)
        angle = np.concatenate([np.zeros((1, 3)), steps])
        velocity, rate = (np.gradient(series, time, axis=0) for series in (position, angle))
        motion = cls(position, velocity, rate, turned.as_matrix(), name)
        motion.rates_of_steps = rates_of_steps(np.hstack([position, angle]), time)
        numbers = (time, *position.T, *turn.T)
        motion.columns = dict(zip([column.name for column in PATH.columns], numbers, strict=True))
        return motion

    @classmethod
    def read(cls, file: str | Path) -> Motion3D:
        """Read a path from a table with ``t_s, x_cm, y_cm, z_cm, turn_x_deg, turn_y_deg, turn_z_deg``.

        Parameters
        ----------
        file : str or Path
            csv, tsv or xlsx; the columns are those of `path`.

        Returns
        -------
        Motion3D

        Raises
        ------
        CampaignError
            With every cell that is wrong, and every time that does not increase.
        """
        time, *numbers = read_path_columns(Path(file), PATH)
        return cls.path(time, np.transpose(numbers[:3]), np.transpose(numbers[3:]), f"along {file}")
