// The element kernel: the same physics as rftfit.forces.reference_kernel. Angles in rad, cm, N.

const TWO_PI = 2 * Math.PI;

/** Remainder with the sign of `b`, as in Python. */
function mod(a, b) {
  return a - b * Math.floor(a / b);
}

/**
 * Elements of a leg turned by `angle` (rad) on its axle at x = 0, in a turn at `rate` (rad/s): middle x, z, tangent tx, tz
 * and half length, area (cm^2), velocity vx, vz (cm/s).
 */
function placeElements(leg, angle, rate) {
  const c = Math.cos(angle);
  const s = Math.sin(angle);
  return leg.body.map(([bx, bz, btx, btz, half]) => {
    const x = bx * c + bz * s;
    const z = bz * c - bx * s;
    return {
      x, z: leg.hip_height_cm + z, tx: btx * c + btz * s, tz: btz * c - btx * s, half,
      area: 2 * half * leg.width_cm, vx: rate * z, vz: -rate * x,
    };
  });
}

/**
 * Depth times area of the part of an element below the surface (`load`, cm^3; 0 for an element that does not move), and the
 * middle of that part.
 */
function submerge(e) {
  const rise = e.half * Math.abs(e.tz);
  const low = rise - e.z;
  const high = -rise - e.z;
  const crossing = low > 0 && high < 0;
  const part = crossing ? low / (2 * rise) : 1;
  const idle = low <= 0 || (e.vx === 0 && e.vz === 0);
  const along = -(e.tz > 0 ? 1 : -1) * e.half * (1 - part);
  return {
    load: idle ? 0 : (crossing ? low / 2 : -e.z) * part * e.area,
    x: e.x + along * e.tx,
    z: e.z + along * e.tz,
  };
}

/** Index of the interval of ascending `nodes` that holds `at`, and the place in it, from 0 to 1. */
function intervalOf(nodes, at) {
  let i = 0;
  while (i < nodes.length - 2 && at >= nodes[i + 1]) i += 1;
  return [i, (at - nodes[i]) / (nodes[i + 1] - nodes[i])];
}

/** Row, column and weight of the four nodes around a point of the torus, which has the lines `beta` and `gamma`. */
function cornersOf(lines, beta, gamma) {
  const b = mod(beta + Math.PI / 2, Math.PI) - Math.PI / 2;
  const g = Math.PI - mod(Math.PI - gamma, TWO_PI);
  const [row, u] = intervalOf(lines.beta, b);
  const [col, v] = intervalOf(lines.gamma, g);
  return [
    [row, col, (1 - u) * (1 - v)], [row, col + 1, (1 - u) * v],
    [row + 1, col, u * (1 - v)], [row + 1, col + 1, u * v],
  ];
}

/** Bilinear on the torus; a missing node spoils only the points that depend on it. */
function tableAlpha(profile, beta, gamma) {
  const corners = cornersOf(profile, beta, gamma);
  return [profile.z, profile.x].map((values) => {
    let total = 0;
    for (const [i, k, weight] of corners) {
      const value = values[i][k];
      if (value === null) {
        if (weight >= 1e-9) return NaN;
      } else total += weight * value;
    }
    return total;
  });
}

/** alpha_z, alpha_x of the nine terms `m`: A00, A10, B11, B01, Bm1, C11, C01, Cm1, D10. */
function fourierAlpha(m, beta, gamma) {
  const b = 2 * beta;
  return [
    m[0] + m[1] * Math.cos(b) + m[2] * Math.sin(b + gamma) + m[3] * Math.sin(gamma) + m[4] * Math.sin(gamma - b),
    m[5] * Math.cos(b + gamma) + m[6] * Math.cos(gamma) + m[7] * Math.cos(gamma - b) + m[8] * Math.sin(b),
  ];
}

/**
 * alpha_z, alpha_x of the depth-only model: each component opposes its velocity component; rounding does not choose its side.
 * `values`: alpha_z of a push straight down and of a pull straight up, alpha_x of a level push toward -x.
 */
function depthOnlyAlpha(values, beta, gamma) {
  const still = 1e-12;
  const down = Math.sin(gamma);
  const left = Math.cos(gamma);
  const z = down > still ? values[0] : down < -still ? values[1] : 0;
  const x = left > still ? values[2] : left < -still ? -values[2] : 0;
  return [Math.abs(Math.cos(beta)) * z, Math.abs(Math.sin(beta)) * x];
}

/** alpha_z, alpha_x of any profile, N/cm^3. */
function alphaOf(profile, beta, gamma) {
  if (profile.kind === "table") return tableAlpha(profile, beta, gamma);
  if (profile.kind === "depth_only") return depthOnlyAlpha(profile.values, beta, gamma);
  return fourierAlpha(profile.values, beta, gamma);
}

/** beta and gamma of an element that is placed and moves. */
function directionOf(e) {
  return [Math.atan2(-e.tz, e.tx), Math.atan2(0 - e.vz, 0 - e.vx)];
}

/** Force on each element of a leg at theta (rad): [force z, force x, x, z of where it acts]. */
function elementForces(profile, leg, theta, rate) {
  return placeElements(leg, theta, rate).map((e) => {
    const part = submerge(e);
    if (part.load === 0) return [0, 0, part.x, part.z];
    const [az, ax] = alphaOf(profile, ...directionOf(e));
    return [part.load * az, part.load * ax, part.x, part.z];
  });
}

/** Net force z, force x (N) and moment about the axle (N cm, from z toward x). */
function netForce(elements, leg) {
  let fz = 0;
  let fx = 0;
  let moment = 0;
  for (const [z, x, atX, atZ] of elements) {
    fz += z;
    fx += x;
    moment += (atZ - leg.hip_height_cm) * x - atX * z;
  }
  return [fz, fx, moment];
}

/** Net force at each theta in degrees. */
function sweepLeg(profile, leg, thetaDeg, rate) {
  const z = [];
  const x = [];
  const moment = [];
  for (const degrees of thetaDeg) {
    const net = netForce(elementForces(profile, leg, (degrees * Math.PI) / 180, rate), leg);
    z.push(net[0]);
    x.push(net[1]);
    moment.push(net[2]);
  }
  return { z, x, moment };
}
