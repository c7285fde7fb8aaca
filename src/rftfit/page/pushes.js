// Alpha over all directions from a few pushes: the same as rftfit.model.shapes.estimate and planning.plan.
// A map's numbers are in one list: alpha_z at all nodes, then alpha_x. N/cm^3, rad.

const NO_VARIANCE = 1e-9;
const SIZES = 80;
const WIDEST = 30;
const SAME_DIRECTION = 0.5;
const PAPER_RULE = 0.05;
const RADIAN = Math.PI / 180;

function dot(a, b) {
  let sum = 0;
  for (let i = 0; i < a.length; i += 1) sum += a[i] * b[i];
  return sum;
}

/** Lower triangle whose product with itself is a matrix that is positive, but for rounding. */
function cholesky(matrix) {
  const lower = [];
  matrix.forEach((line, i) => {
    const row = new Float64Array(matrix.length);
    lower.push(row);
    for (let j = 0; j <= i; j += 1) {
      const other = lower[j];
      let rest = line[j];
      for (let k = 0; k < j; k += 1) rest -= row[k] * other[k];
      row[j] = j < i ? rest / other[j] : Math.sqrt(Math.max(rest, 1e-15 * line[i]));
    }
  });
  return lower;
}

function solve(lower, values) {
  const found = Float64Array.from(values);
  for (let i = 0; i < found.length; i += 1) {
    for (let k = 0; k < i; k += 1) found[i] -= lower[i][k] * found[k];
    found[i] /= lower[i][i];
  }
  for (let i = found.length - 1; i >= 0; i -= 1) {
    for (let k = i + 1; k < found.length; k += 1) found[i] -= lower[k][i] * found[k];
    found[i] /= lower[i][i];
  }
  return found;
}

/** Correlation of two directions that are `beta` and `gamma` apart, without symmetry. */
function alikeness(by, beta, gamma) {
  const chordBeta = 2 * Math.sin(beta);
  const chordGamma = 2 * Math.sin(gamma / 2);
  const smooth = (chordBeta / by.smooth_beta) ** 2 + (chordGamma / by.smooth_gamma) ** 2;
  const rough = Math.sqrt(3) * Math.hypot(chordBeta / by.rough_beta, chordGamma / by.rough_gamma);
  return by.smooth * Math.exp(-smooth / 2) + (1 - by.smooth) * (1 + rough) * Math.exp(-rough);
}

/** What is known beforehand of a direction: mean, deviations of the known media, amplitude; of z and x. */
function placeOf(shapes, beta, gamma) {
  const known = shapes.tables.map((table) => tableAlpha(table, beta, gamma));
  const centre = [0, 1].map((c) => mean(known.map((pair) => pair[c])));
  return {
    beta, gamma, mean: centre,
    off: [0, 1].map((c) => known.map((pair) => pair[c] - centre[c])),
    amplitude: centre.map((m) => shapes.variation.floor + shapes.variation.share * Math.abs(m)),
    scale: Math.sqrt(1 + alikeness(shapes.variation, 2 * beta, 2 * gamma - Math.PI)),
  };
}

/** Covariance of component `c` at place `p` with component `d` at place `q`, of a medium of size 1. */
function priorCovariance(shapes, p, c, q, d) {
  const [by, count] = [shapes.variation, shapes.tables.length];
  const between = (by.media * (1 + 1 / count) * dot(p.off[c], q.off[d])) / (count - 1);
  if (c !== d) return between;
  const direct = alikeness(by, p.beta - q.beta, p.gamma - q.gamma);
  const turned = alikeness(by, p.beta + q.beta, p.gamma + q.gamma - Math.PI);
  const alike = c === 0 ? (direct + turned) / p.scale / q.scale : direct - turned;
  return between + p.amplitude[c] * q.amplitude[c] * alike;
}

function priorMatrix(shapes, rows, columns) {
  return rows.map(([p, c]) => Float64Array.from(columns, ([q, d]) => priorCovariance(shapes, p, c, q, d)));
}

/** The published grid as nodes, and where each line of the whole torus finds its node. */
function makeGrid(shapes, betaDeg, gammaDeg) {
  // a plate at -90 degrees is the one at 90
  const lines = betaDeg.slice(1);
  const nodes = lines.flatMap((b) => gammaDeg.map((g) => placeOf(shapes, b * RADIAN, g * RADIAN)));
  const entries = [0, 1].flatMap((c) => nodes.map((node) => [node, c]));
  const own = gammaDeg.map((g, k) => [g, k, 1]);
  const behind = own.filter(([g]) => g > -90 && g <= 0).map(([g, k]) => [-180 - g, k, -1]).reverse();
  const ahead = own.filter(([g]) => g >= 0 && g < 90).map(([g, k]) => [180 - g, k, -1]).reverse();
  const columns = [...behind, ...own, ...ahead];
  const rowOf = (row) => (row === 0 ? lines.length : row) - 1;
  return {
    nodes, entries, prior: priorMatrix(shapes, entries, entries),
    beta: betaDeg.map((b) => b * RADIAN),
    gamma: columns.map(([g]) => g * RADIAN),
    /** Node of a point of the torus, and the sign of alpha_x there. */
    at(row, column) {
      const [, k, sign] = columns[column];
      return [rowOf(sign > 0 ? row : betaDeg.length - 1 - row) * gammaDeg.length + k, sign];
    },
  };
}

/** Numbers that were measured, each with its place, component, value and variance; symmetry tells nothing new. */
function numbersOf(shapes, pushes) {
  const largest = Math.max(0, ...pushes.flatMap(({ alpha }) => alpha.filter(Number.isFinite).map(Math.abs)));
  const usual = (value) => Math.hypot((shapes.usual_percent / 100) * value, (shapes.least_percent / 100) * largest);
  const places = pushes.map(({ beta_deg, gamma_deg }) => placeOf(shapes, beta_deg * RADIAN, gamma_deg * RADIAN));
  const all = pushes.flatMap(({ alpha, se }, i) => {
    // the first push in this direction, or in that of its mirror image
    const [[push, turned]] = sameDirection(places, places[i]);
    const signs = [1, turned];
    return alpha.map((value, c) => ({
      place: places[push], push, c, value: signs[c] * value, error: (Number.isFinite(se[c]) ? se[c] : usual(value)) ** 2,
    }));
  });
  const known = all.filter(({ place, c, value }) => Number.isFinite(value) && priorCovariance(shapes, place, c, place, c) > NO_VARIANCE);
  return merged(known, largest);
}

/** Each number once: those of one direction are one, weighted with their errors. */
function merged(numbers, largest) {
  const once = [];
  for (const number of numbers) {
    const weight = 1 / Math.max(number.error, (1e-9 * largest) ** 2);
    const same = once.find((one) => one.push === number.push && one.c === number.c);
    if (same) {
      same.value = (same.value * same.weight + number.value * weight) / (same.weight + weight);
      same.weight += weight;
      same.error = 1 / same.weight;
    } else once.push({ ...number, weight });
  }
  return once;
}

/** Numbers seen of a shape whose size is unknown: what follows from a size. */
function makeGiven(shapes, numbers) {
  const columns = numbers.map(({ place, c }) => [place, c]);
  const prior = priorMatrix(shapes, columns, columns);
  const centre = numbers.map(({ place, c }) => place.mean[c]);
  const y = numbers.map(({ value }) => value);
  // exact numbers have the error of rounding
  const rounding = (1e-6 * Math.max(...y.map(Math.abs)) || 1e-6) ** 2;
  const errors = numbers.map(({ error }) => error + rounding);
  return {
    columns, prior, centre, y, errors,
    of(size) {
      const lower = cholesky(prior.map((row, i) => row.map((v, j) => size ** 2 * v + (i === j ? errors[i] : 0))));
      const rest = y.map((v, i) => v - size * centre[i]);
      const pulled = solve(lower, rest);
      const distance = dot(rest, pulled);
      const likelihood = -0.5 * distance - lower.reduce((sum, row, i) => sum + Math.log(row[i]), 0);
      return { size, lower, pulled, distance, likelihood };
    },
  };
}

/** Sizes with their weights: the likelihood on a grid of their logarithm. Null if the pushes meet no resistance. */
function sizesOf(given) {
  const weight = given.errors.map((e, i) => 1 / (e + (0.2 * given.y[i]) ** 2));
  const first = dot(weight, given.y.map((v, i) => v * given.centre[i])) / dot(weight, given.centre.map((m) => m * m));
  if (!(first > 0)) return null;
  let [low, high] = [Math.log(first / WIDEST), Math.log(first * WIDEST)];
  let each = [];
  for (let round = 0; round < 3; round += 1) {
    const step = (high - low) / (SIZES - 1);
    each = Array.from({ length: SIZES }, (_, i) => given.of(Math.exp(low + i * step)));
    const top = Math.max(...each.map(({ likelihood }) => likelihood));
    for (const one of each) one.weight = Math.exp(one.likelihood - top);
    const there = each.flatMap(({ weight: w }, i) => (w > 1e-6 ? [i] : []));
    low = Math.log(each[Math.max(there[0] - 1, 0)].size);
    high = Math.log(each[Math.min(there[there.length - 1] + 1, SIZES - 1)].size);
  }
  const total = each.reduce((sum, one) => sum + one.weight, 0);
  for (const one of each) one.weight /= total;
  return each;
}

/** Nodes that are the direction of a push or its mirror image, and the sign of alpha_x there. */
function sameDirection(nodes, place) {
  const near = (a, b, period) => Math.abs(mod((a - b) / RADIAN + period / 2, period) - period / 2) <= SAME_DIRECTION;
  return nodes.flatMap((node, i) => {
    if (near(node.beta, place.beta, 180) && near(node.gamma, place.gamma, 360)) return [[i, 1]];
    return near(node.beta, -place.beta, 180) && near(node.gamma, Math.PI - place.gamma, 360) ? [[i, -1]] : [];
  });
}

/**
 * Estimate alpha at the nodes. `pushes`: {beta_deg, gamma_deg, alpha: [z, x], se: [z, x]}, NaN where not known.
 * Gives alpha with its covariance, and how far the pushes agree with the known shape.
 */
function estimateMap(shapes, grid, pushes) {
  // in any order the same numbers
  const keys = ({ beta_deg, gamma_deg, alpha: [z, x] }) => [beta_deg, gamma_deg, z, Number.isFinite(x) ? x : Infinity];
  const difference = (a, b) => a.map((v, i) => (v === b[i] ? 0 : v - b[i])).find((v) => v !== 0) || 0;
  const numbers = numbersOf(shapes, [...pushes].sort((a, b) => difference(keys(a), keys(b))));
  const given = numbers.length ? makeGiven(shapes, numbers) : null;
  const each = given && sizesOf(given);
  if (!each) return null;
  const across = priorMatrix(shapes, grid.entries, given.columns);
  const means = each.map(({ size, pulled }) => grid.entries.map(([node, c], i) => size * node.mean[c] + size ** 2 * dot(across[i], pulled)));
  const alpha = grid.entries.map((_, i) => each.reduce((sum, { weight }, k) => sum + weight * means[k][i], 0));
  const middle = given.of(Math.sqrt(each.reduce((sum, { weight, size }) => sum + weight * size ** 2, 0)));
  const square = middle.size ** 2;
  const gain = across.map((row) => solve(middle.lower, row).map((v) => square * v));
  // a node that was pushed keeps its number, and its error
  const measured = new Array(grid.nodes.length).fill(false);
  const fixed = new Array(alpha.length).fill(false);
  for (const [k, { place, push, c, value }] of numbers.entries()) {
    if (!numbers.some((one) => one.push === push && one.c === 0)) continue;
    for (const [node, sign] of sameDirection(grid.nodes, place)) {
      const i = c * grid.nodes.length + node;
      measured[node] = fixed[i] = true;
      alpha[i] = (c ? sign : 1) * value;
      gain[i] = gain[i].map((_, j) => (j === k ? (c ? sign : 1) : 0));
    }
  }
  const noise = gain.map((row) => row.map((v, k) => numbers[k].error * v));
  const rest = gain.map((row, i) => row.map((_, k) => dot(given.prior[k], row) - across[i][k]));
  const moved = alpha.map((best, i) => Float64Array.from(each, ({ weight }, k) => Math.sqrt(weight) * (means[k][i] - best)));
  const covariance = alpha.map(() => new Float64Array(alpha.length));
  for (let i = 0; i < alpha.length; i += 1) {
    for (let j = 0; j <= i; j += 1) {
      let sum = dot(gain[i], noise[j]);
      if (!fixed[i] && !fixed[j]) {
        sum += dot(moved[i], moved[j]) + square * (grid.prior[i][j] - dot(across[i], gain[j]) + dot(gain[i], rest[j]));
      }
      // of a number that symmetry fixes rounding alone is left
      covariance[i][j] = covariance[j][i] = i === j ? Math.max(sum, 0) : sum;
    }
  }
  const expected = each.reduce((sum, { weight, size }) => sum + weight * size, 0);
  return { alpha, covariance, measured, size: expected, ...agreement(shapes, given, numbers, given.of(expected)) };
}

/** How far numbers lie from the known shape of a size, and which of them lies farthest from the others. */
function agreement(shapes, given, numbers, at) {
  const dof = numbers.length - 1;
  const parts = [0, 1].map((c) => given.centre.map((m, i) => (numbers[i].c === c ? m : 0)));
  const solved = parts.map((part) => solve(at.lower, part));
  const [zz, zx, xx] = [dot(parts[0], solved[0]), dot(parts[0], solved[1]), dot(parts[1], solved[1])];
  const [zy, xy] = solved.map((part) => dot(part, given.y));
  const [z, x] = [xx * zy - zx * xy, zz * xy - zx * zy];
  const whole = zz * xx - zx * zx;
  const chances = dof ? [upperGamma(dof / 2, at.distance / 2)] : [];
  let horizontal = NaN;
  if (whole > 0) {
    horizontal = z > 0 && x > 0 ? x / z : 0;
    const seen = whole * Math.max(xx / z ** 2 + zz / x ** 2 + (2 * zx) / (z * x), 0);
    const [known, allowed] = shapes.horizontal;
    const error = Math.sqrt(known ** 2 + Math.max(seen - allowed ** 2, 0));
    chances.push(horizontal > 0 ? upperGamma(0.5, (Math.log(horizontal) / error) ** 2 / 2) : 0);
  }
  const each = numbers.map(({ place, c, value }, i) => {
    const spread = 1 / solve(at.lower, numbers.map((_, j) => Number(i === j)))[i];
    return { place, c, value, off: at.pulled[i] * spread, error: Math.sqrt(spread) };
  });
  const far = ({ off, error }) => Math.abs(off) / error;
  return {
    dof, distance: at.distance, horizontal,
    belongs: dof ? Math.min(chances.length * Math.min(...chances), 1) : NaN,
    farthest: each.reduce((worst, one) => (far(one) > far(worst) ? one : worst)),
  };
}

/** Value and standard deviation of a sum over nodes of one component, 0: z, 1: x. */
function sumOver(map, component, weights) {
  const first = component * weights.length;
  const used = weights.flatMap((w, i) => (w ? [i] : []));
  let [value, variance] = [0, 0];
  for (const i of used) {
    value += weights[i] * map.alpha[first + i];
    for (const j of used) variance += weights[i] * weights[j] * map.covariance[first + i][first + j];
  }
  return [value, Math.sqrt(Math.max(variance, 0))];
}

/** zeta of the nine terms fitted to a map, with its standard deviation. */
function zetaOfMap(grid, map) {
  const basis = grid.nodes.map(({ beta, gamma }) => [0, 1, 2, 3, 4].map((t) => fourierAlpha([0, 1, 2, 3, 4, 5, 6, 7, 8].map((k) => Number(k === t)), beta, gamma)[0]));
  const fit = (terms, wanted) => {
    const product = (t, values) => basis.reduce((sum, row, i) => sum + row[t] * values(row, i), 0);
    const lower = cholesky(terms.map((t) => terms.map((u) => product(t, (row) => row[u]))));
    return solve(lower, terms.map((t, k) => wanted((values) => product(t, values), k)));
  };
  const all = fit([0, 1, 2, 3, 4], (product) => product((_, i) => map.alpha[i]));
  const kept = [0, 1, 2, 3, 4].filter((t) => t === 0 || Math.abs(all[t]) > PAPER_RULE * Math.abs(all[0]));
  const sums = fit(kept, () => 1);
  return sumOver(map, 0, basis.map((row) => dot(sums, kept.map((t) => row[t]))));
}

/** Forces z and x on a leg at each theta in degrees, each a list of [value, standard deviation]. */
function sweepMap(grid, map, leg, thetaDeg, rate) {
  const found = { z: [], x: [] };
  for (const degrees of thetaDeg) {
    const weights = { z: new Array(grid.nodes.length).fill(0), x: new Array(grid.nodes.length).fill(0) };
    for (const e of placeElements(leg, degrees * RADIAN, rate)) {
      const { load } = submerge(e);
      if (load === 0) continue;
      for (const [row, column, weight] of cornersOf(grid, ...directionOf(e))) {
        const [node, sign] = grid.at(row, column);
        weights.z[node] += load * weight;
        weights.x[node] += load * weight * sign;
      }
    }
    found.z.push(sumOver(map, 0, weights.z));
    found.x.push(sumOver(map, 1, weights.x));
  }
  return found;
}

/** The push that narrows the whole map most for its runs; spread over the largest alpha before and after it. */
function nextPush(shapes, grid, map) {
  const { alpha, covariance } = map;
  const [count, largest] = [grid.nodes.length, Math.max(...alpha.map(Math.abs))];
  const noise = (i) => ((shapes.usual_percent / 100) * alpha[i]) ** 2 + ((shapes.least_percent / 100) * largest) ** 2;
  const before = covariance.reduce((sum, row, i) => sum + row[i], 0);
  const typical = (total) => Math.sqrt(Math.max(total, 0) / alpha.length) / largest;
  let best = null;
  grid.nodes.forEach(({ beta, gamma }, node) => {
    const [z, x] = [covariance[node], covariance[count + node]];
    const [zz, xx, zx] = [z[node] + noise(node), x[count + node] + noise(count + node), x[node]];
    const whole = zz * xx - zx * zx;
    const less = (xx * dot(z, z) - 2 * zx * dot(z, x) + zz * dot(x, x)) / whole;
    const runs = gamma === 0 ? shapes.horizontal_runs : 1;
    const gain = Math.round((-1e9 * Math.log(Math.max(1 - less / before, 1e-12))) / runs);
    if (!best || gain > best.gain) best = { beta, gamma, gain, runs, before: typical(before), after: typical(before - less) };
  });
  return best;
}
