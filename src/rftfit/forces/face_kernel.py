"""The compiled kernel in space: forces on the triangles of bodies, for both laws of `rftfit.forces.faces`.

Also the elastic-plastic faces by which a body rests: a face's displacement u follows its velocity v, no
farther than delta; the law is read along u + tau v and grows with that up to the length delta. Without them a body at
rest, whose velocity is 0, would have no force.

As in `rftfit.model.kernel`, all that is compiled stands in this one file: a change of another file would not make numba
compile it anew. Vectors are three numbers, such as nx, ny, nz, since arrays of three are slow in compiled code.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.model.kernel import _compiled, _step
from rftfit.model.packs import Pack

IntArray = npt.NDArray[np.int64]

# weight of a corner that does not count, and size of a vector that counts as 0: as in `rftfit.model.packs` and
# `rftfit.model.rft3d`, which the cache does not watch
_NEGLIGIBLE, _NONE = 1e-9, 1e-9
# speed along the normal over the speed up to which a face moves along itself: as in `rftfit.forces.leading`
_ALONG_ITSELF = 1e-4
_LEVEL = 1e-9
"""Greatest part of its unit normal by which a face of a wheel faces back, or distance by which it lies behind the axle
(cm), that may be rounding."""

_ASIDE = 1e-9
"""Largest horizontal part of n x v, for unit vectors, with which a face moves in the plane of its normal and the vertical."""


@_step
def _find(angle: float, nodes: FloatArray, bins: IntArray) -> tuple[int, float]:
    """Return the index of the node below an angle, and the position of the angle between this node and the next, 0 to 1.

    `angle`, `nodes`: rad. `bins`: node below the start of each of many equal bins of the range of angles; at most one
    further node lies in a bin. So no search is needed.
    """
    bin_number = (angle - nodes[0]) * (bins.size / (nodes[-1] - nodes[0]))
    node = bins[int(min(max(bin_number, 0.0), bins.size - 1.0))]
    if node + 2 < nodes.size and angle >= nodes[node + 1]:
        node += 1
    return node, (angle - nodes[node]) / (nodes[node + 1] - nodes[node])


@_step
def _read(pack: Pack, row: int, u: float, gamma: float) -> tuple[float, float]:
    """Interpolate alpha_z and alpha_x, N/cm^3, bilinearly between the nodes of the map; `row`, `u`: from `_find`, for beta.

    `gamma`: rad. `pack.cells`: alpha_z at the four corners of each cell, (beta, gamma) low low, low high, high low,
    high high, then alpha_x at these: shape (rows, columns, 8).
    """
    column, v = _find(gamma, pack.gamma, pack.gamma_bins)
    corner = pack.cells[row, column]
    a, b, c, d = (1 - u) * (1 - v), (1 - u) * v, u * (1 - v), u * v
    z = a * corner[0] + b * corner[1] + c * corner[2] + d * corner[3]
    x = a * corner[4] + b * corner[5] + c * corner[6] + d * corner[7]
    if math.isnan(z + x):  # a missing corner without weight does not count
        z, x = 0.0, 0.0
        for k, weight in enumerate((a, b, c, d)):
            if weight >= _NEGLIGIBLE or not math.isnan(corner[k]):
                z += weight * corner[k]
            if weight >= _NEGLIGIBLE or not math.isnan(corner[4 + k]):
                x += weight * corner[4 + k]
    return z, x


@_step
def _measured(
    pack: Pack, across: float, nx: float, ny: float, nz: float, vx: float, vy: float, vz: float
) -> tuple[float, float, float]:
    """Return the stress over depth x, y, z, N/cm^3, by the measured map, as `faces._measured_stress`, where it is explained.

    `across`: alpha_x(0, 0), with which a face slides sideways. n, v: unit normal and unit velocity. e, r: their
    horizontal directions. An upright face is read in the plane of e, a level one in the plane of r, others in both.
    """
    tilt, speed = math.sqrt(nx * nx + ny * ny), math.sqrt(vx * vx + vy * vy)
    ex, ey = (nx / tilt, ny / tilt) if tilt > 0 else (1.0, 0.0)
    rx, ry = (vx / speed, vy / speed) if speed > 0 else (1.0, 0.0)
    beta = math.atan2(tilt, nz)
    beta = beta - math.pi if beta >= math.pi / 2 else beta
    row, u = _find(beta, pack.beta, pack.beta_bins)
    upright = tilt * tilt
    x, y, z = 0.0, 0.0, 0.0
    if upright >= _NEGLIGIBLE:
        along = vx * ex + vy * ey
        aside = vy * ex - vx * ey
        in_plane = math.sqrt(along * along + vz * vz)
        up, ahead = _read(pack, row, u, math.atan2(-vz, -along))
        x = upright * (in_plane * ahead * ex + across * aside * ey)
        y = upright * (in_plane * ahead * ey - across * aside * ex)
        z = upright * in_plane * up
    if 1 - upright >= _NEGLIGIBLE:
        gamma = math.atan2(-vz, -speed)
        cos_p, sin_p = ex * rx + ey * ry, ey * rx - ex * ry
        z1, x1 = _read(pack, row, u, gamma)
        row, u = _find(-beta, pack.beta, pack.beta_bins)
        z2, x2 = _read(pack, row, u, gamma)
        level = (1 - upright) / 2
        ahead, aside = x1 + x2 + (x1 - x2) * cos_p, (x1 - x2) * sin_p
        x += level * (ahead * rx - aside * ry)
        y += level * (ahead * ry + aside * rx)
        z += level * (z1 + z2 + (z1 - z2) * cos_p)
    return x, y, z


@_step
def _rft3d(
    c: FloatArray, nx: float, ny: float, nz: float, vx: float, vy: float, vz: float
) -> tuple[float, float, float]:
    """Return the stress over depth x, y, z, N/cm^3, by 3D-RFT, as `rft3d.law`, where it is explained.

    `c`: xi (the level of the medium) times the coefficients (3, 20), with the terms in the order of `rft3d`. n, v: unit
    normal and unit velocity. The stress has parts along n (factor m), along v (factor v) and along the vertical (g).
    """
    forward = nx * vx + ny * vy + nz * vz
    if (-nz if abs(nz) > _NONE else forward) < -_NONE:
        nx, ny, nz, forward = -nx, -ny, -nz, -forward
    p, q, r = -vz, -nz, forward
    terms = (
        1.0,
        p,
        q,
        r,
        p * p,
        q * q,
        r * r,
        p * q,
        q * r,
        r * p,
        p * p * p,
        q * q * q,
        r * r * r,
        p * q * q,
        q * p * p,
        q * r * r,
        r * q * q,
        r * p * p,
        p * r * r,
        p * q * r,
    )
    # each of the three factors is a polynomial of third degree in p, q, r
    m, v, g = 0.0, 0.0, 0.0
    for k in range(20):
        m, v, g = m + c[0, k] * terms[k], v + c[1, k] * terms[k], g + c[2, k] * terms[k]
    return m * nx + v * vx, m * ny + v * vy, m * nz + v * vz - g


@_compiled
def face_forces(
    pack: Pack,
    across: float,
    coefficients: FloatArray,
    friction: float,
    faces: FloatArray,
    ranges: IntArray,
    frames: FloatArray,
    rolling: FloatArray,
    elastic: tuple[float, float, float],
    shifts: FloatArray,
    sums: FloatArray,
) -> None:
    """Sum the forces on bodies, each the faces of one range in one frame, and write them to `sums` (p, 7 or 19).

    `pack`: `TableProfile.pack`. `across`: alpha_x(0, 0) of it. `coefficients`: shape (3, 20), times xi, for 3D-RFT;
    shape (0, 0) for the measured law. `friction`: most stress along a face over that across it; below 0: no limit.
    `faces`: rows of `space.face_rows`, (m, 17): corners (9), centroid (3), unit normal (3), area, 1 for a sheet, in the
    axes of the mesh. `ranges`: first face and the one behind the last, (p, 2). `frames`: `Motion3D.frames`, (p, 18):
    position, velocity, rate of turning, rotation matrix. `rolling`: `rftfit.forces.rolling.rolling_rows`, (p, 4);
    zeros: no wheel. `elastic`: time since the last call (s), delta (cm), tau (s), and `shifts` the displacements u (m,
    3), cm, changed in place; delta 0: the plain law.

    `sums`: force x, y, z (N), moment x, y, z about the reference point (N cm), and
    depth times area of the leading faces that leave their plane (cm^3). Where it has 19 columns, also what faces bear
    without cancellation: the sums of the sizes of the vertical parts, of the horizontal parts and of the whole forces
    (N); of the whole sizes times the arm x, y, z (N cm); and by direction the sum of f f^T / |f| over forces f: xx, yy,
    zz, xy, xz, yz (N). `rftfit.forces.faces` is the same in numpy, step by step.
    """
    passed, delta, tau = elastic
    wants_load = sums.shape[1] > 7
    for p in range(len(ranges)):
        # f[0:3] position, f[3:6] velocity, f[6:9] rate of turning, f[9:18] rotation matrix, row by row
        f = frames[p]
        ahead_x, ahead_y, least_lead = rolling[p, 0], rolling[p, 1], rolling[p, 2]
        track = rolling[p, 3]
        # NaN where a number of the frame is missing, else 0: the sums begin with it
        lost = 0.0
        for k in range(18):
            lost += 0.0 * f[k]
        sx, sy, sz, mx, my, mz, leaving = lost, lost, lost, lost, lost, lost, lost
        up, level, whole, cx, cy, cz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        xx, yy, zz, xy, xz, yz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(ranges[p, 0], ranges[p, 1]):
            # t[0:9] corners, t[9:12] centroid, t[12:15] unit normal, t[15] area, t[16] 1 for a sheet
            t = faces[i]
            # heights of the three corners above the surface
            z1 = f[2] + f[15] * t[0] + f[16] * t[1] + f[17] * t[2]
            z2 = f[2] + f[15] * t[3] + f[16] * t[4] + f[17] * t[5]
            z3 = f[2] + f[15] * t[6] + f[16] * t[7] + f[17] * t[8]
            below = int(z1 < 0) + int(z2 < 0) + int(z3 < 0)
            if below == 0:
                # a face in the air forgets its displacement
                if delta > 0:
                    shifts[i, 0], shifts[i, 1], shifts[i, 2] = 0.0, 0.0, 0.0
                continue
            # centroid of the wet part, in the frame of the mesh, and its share of the area
            mid_x, mid_y, mid_z, share = t[9], t[10], t[11], 1.0
            if below < 3:  # as `faces.submerged_parts`: a is the corner that is alone on its side
                corner_below = below == 1
                a = 0 if (z1 < 0) == corner_below else (3 if (z2 < 0) == corner_below else 6)
                b, c = (a + 3) % 9, (a + 6) % 9
                za, zb, zc = (z1, z2, z3) if a == 0 else ((z2, z3, z1) if a == 3 else (z3, z1, z2))
                # shares of both edges from a at which the surface cuts them, and the triangle that it cuts off: its
                # share of the area and its centroid p
                to_b, to_c = za / (za - zb), za / (za - zc)
                share = to_b * to_c
                px = t[a] + (to_b * (t[b] - t[a]) + to_c * (t[c] - t[a])) / 3
                py = t[a + 1] + (to_b * (t[b + 1] - t[a + 1]) + to_c * (t[c + 1] - t[a + 1])) / 3
                pz = t[a + 2] + (to_b * (t[b + 2] - t[a + 2]) + to_c * (t[c + 2] - t[a + 2])) / 3
                if not corner_below:
                    # the small triangle is dry: the rest is wet
                    mid_x, mid_y, mid_z = mid_x - share * px, mid_y - share * py, mid_z - share * pz
                    share = 1 - share
                    px, py, pz = mid_x / share, mid_y / share, mid_z / share
                mid_x, mid_y, mid_z = px, py, pz
            # arm from the reference point, and velocity, in the world
            ax = f[9] * mid_x + f[10] * mid_y + f[11] * mid_z
            ay = f[12] * mid_x + f[13] * mid_y + f[14] * mid_z
            az = f[15] * mid_x + f[16] * mid_y + f[17] * mid_z
            vx = f[3] + f[7] * az - f[8] * ay
            vy = f[4] + f[8] * ax - f[6] * az
            vz = f[5] + f[6] * ay - f[7] * ax
            # share of the stress that counts
            weight = 1.0
            lead = least_lead
            if delta > 0:
                if lead > 0:  # in the unit of u + tau v, along which the law is read
                    lead = lead / max(math.sqrt(vx * vx + vy * vy + vz * vz), _NONE)
                u = shifts[i]
                ux, uy, uz = u[0] + passed * vx, u[1] + passed * vy, u[2] + passed * vz
                length = math.sqrt(ux * ux + uy * uy + uz * uz)
                if length > delta:
                    ux, uy, uz = ux * delta / length, uy * delta / length, uz * delta / length
                u[0], u[1], u[2] = ux, uy, uz
                vx, vy, vz = ux + tau * vx, uy + tau * vy, uz + tau * vz
                length = math.sqrt(vx * vx + vy * vy + vz * vz)
                weight = min(1.0, length / delta)
                lead = lead * length
            # outward unit normal in the world; of a sheet that of the side that leads
            nx = f[9] * t[12] + f[10] * t[13] + f[11] * t[14]
            ny = f[12] * t[12] + f[13] * t[13] + f[14] * t[14]
            nz = f[15] * t[12] + f[16] * t[13] + f[17] * t[14]
            outward = nx * vx + ny * vy + nz * vz
            if t[16] > 0 and outward < 0:
                nx, ny, nz, outward = -nx, -ny, -nz, -outward
            # a wheel: part of the normal along its travel; with a travel of at least `lead` more, does the face lead?
            ahead = nx * ahead_x + ny * ahead_y
            if lead > 0:
                outward += lead * ahead
            speed = math.sqrt(vx * vx + vy * vy + vz * vz)
            lead_share = 1.0
            if t[16] == 0:
                lead_share = min(max(0.5 + outward / (2 * _ALONG_ITSELF * speed), 0.0), 1.0)
            if not (lead_share > 0 and speed > 0):
                lost += 0.0 * outward
                continue
            weight = weight * lead_share
            # faces behind the axle that face back lie in the wheel's own track
            if track > 0 and ahead < -_LEVEL and ax * ahead_x + ay * ahead_y < -_LEVEL:
                if track >= 1:
                    continue
                weight = weight * (1 - track)
            vx, vy, vz = vx / speed, vy / speed, vz / speed
            if coefficients.size > 0:
                x, y, z = _rft3d(coefficients, nx, ny, nz, vx, vy, vz)
            else:
                x, y, z = _measured(pack, across, nx, ny, nz, vx, vy, vz)
            if (
                friction >= 0
            ):  # as `rft3d.turn_and_cap`: the part along the normal, and (x, y, z) the part along the face
                normal = nx * x + ny * y + nz * z
                x, y, z = x - normal * nx, y - normal * ny, z - normal * nz
                along = max(math.sqrt(x * x + y * y + z * z), _NONE)
                friction_share = min(1.0, friction * abs(normal) / along)
                friction_share = (
                    -friction_share if x * vx + y * vy + z * vz > _NONE else friction_share
                )
                normal = abs(normal)
                x, y, z = (
                    friction_share * x - normal * nx,
                    friction_share * y - normal * ny,
                    friction_share * z - normal * nz,
                )
            load = -(f[2] + az) * share * t[15]
            x, y, z = weight * load * x, weight * load * y, weight * load * z
            sx, sy, sz = sx + x, sy + y, sz + z
            mx, my, mz = mx + ay * z - az * y, my + az * x - ax * z, mz + ax * y - ay * x
            # the horizontal parts of n and v differ: the face leaves the plane of its normal and the vertical
            if abs(nx * vy - ny * vx) > _ASIDE:
                leaving += load
            if wants_load:
                size = math.sqrt(x * x + y * y + z * z)
                up, level, whole = up + abs(z), level + math.sqrt(x * x + y * y), whole + size
                cx, cy, cz = cx + size * ax, cy + size * ay, cz + size * az
                if size > 0:
                    dx, dy, dz = x / size, y / size, z / size
                    xx, yy, zz = xx + dx * x, yy + dy * y, zz + dz * z
                    xy, xz, yz = xy + dx * y, xz + dx * z, yz + dy * z
        row = sums[p]
        row[0], row[1], row[2], row[3], row[4], row[5], row[6] = sx, sy, sz, mx, my, mz, leaving
        if wants_load:
            row[7], row[8], row[9], row[10], row[11], row[12] = up, level, whole, cx, cy, cz
            row[13], row[14], row[15], row[16], row[17], row[18] = xx, yy, zz, xy, xz, yz
