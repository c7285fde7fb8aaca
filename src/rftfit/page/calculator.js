// The field calculator: one push straight down in, a whole medium out.

// alpha_z, N/cm^3: what dry granular media have, and what the calculator accepts
const PLAUSIBLE = [0.05, 5];
const LIMITS = [0.001, 1000];

/** Number in a text that a user typed; NaN for anything else. */
function readNumber(text) {
  const trimmed = text.trim().replace(MINUS, "-");
  return /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(trimmed) ? Number(trimmed) : NaN;
}

/** Words on what is wrong with a text, of which `allowed` tells what it may be. */
function wrongText(what, text, allowed) {
  const hint = /^\s*\d*,\d+\s*$/.test(text) ? ` Write a decimal point: ${text.trim().replace(",", ".")}` : "";
  return `${what}: found ${text.trim() ? `"${text.trim().slice(0, 40)}"` : "nothing"}; allowed: ${allowed}.${hint}`;
}

/** alpha_z and its standard error (NaN: not known) of two texts; words for each that is wrong. */
function readPush(alphaText, seText) {
  const [alpha, se] = [alphaText, seText].map(readNumber);
  const fits = alpha >= LIMITS[0] && alpha <= LIMITS[1];
  const errorFits = !seText.trim() || (se >= 0 && !(fits && se > alpha));
  return {
    alpha, se,
    wrong: [
      fits ? "" : wrongText("α_z", alphaText, `a number from ${LIMITS[0]} to ${LIMITS[1]}, N/cm\u00b3`),
      errorFits ? "" : wrongText("Standard error", seText, "a number from 0 to α_z, N/cm\u00b3, or nothing"),
    ],
  };
}

/**
 * The map of a push and the forces on legs, each number as [value, lower, upper]; a force has the ends of its interval
 * with the model's own error after those of alpha; an end that is not there is NaN. All are proportional to the push. Where
 * its error is not known, they are those of a push with the usual one. Else the value lies between that and the one of an
 * exact push, and the error of the push, which is independent of the shape and of the model, is added to the exact one.
 */
function scaleMap(push, alpha, se) {
  const { exact } = push;
  const isKnown = Number.isFinite(se);
  const share = isKnown ? Math.min(se / alpha / push.usual, 1) : 1;
  const scaled = (usual, ofExact) => {
    if (!isKnown) return usual.map((number) => (number === null ? NaN : alpha * number));
    const value = ofExact[0] + share * (usual[0] - ofExact[0]);
    const error = push.quantile * se * value;
    // ends in turn: lower, upper
    const ends = ofExact.slice(1).map((end, i) =>
      end === null || usual[i + 1] === null ? NaN : alpha * value + (i % 2 ? 1 : -1) * Math.hypot(alpha * (end - ofExact[0]), error),
    );
    return [alpha * value, ...ends];
  };
  const numbersOf = (leg, c, i) => ["", "lo_", "hi_", "model_lo_", "model_hi_"].map((end) => leg[`force_${c}_${end}N`][i]);
  const legs = Object.entries(push.legs).map(([name, leg]) => {
    const exactLeg = exact.legs[name];
    const curve = (c) => leg[`force_${c}_N`].map((_, i) => scaled(numbersOf(leg, c, i), numbersOf(exactLeg, c, i)));
    const peaks = ["z", "x"].map((c) => {
      const [at, ...numbers] = leg.peaks[c];
      const [exactAt, ...exactNumbers] = exactLeg.peaks[c];
      // the greatest force of one sign is none of the other one
      const clipped = numbers[0] < 0 ? Math.min : Math.max;
      return [scaled(numbers, exactNumbers).map((end) => clipped(end, 0)), share < 0.5 ? exactAt : at];
    });
    return [name, { z: curve("z"), x: curve("x"), peaks }];
  });
  return {
    alpha(beta, gamma) {
      const [cell, exactCell] = [push.map, exact.map].map((grid) => cellAt(grid, beta, gamma));
      const rowOf = ({ value, lo, hi }) => [value, lo, hi];
      return ["z", "x"].map((c) => scaled(rowOf(cell[c]), rowOf(exactCell[c])));
    },
    zeta: scaled(push.zeta, exact.zeta),
    legs: Object.fromEntries(legs),
  };
}

/** Largest lift and largest horizontal force of curves, each with its theta. */
function peaksOf({ z, x }, theta) {
  const top = z.reduce((best, v, k) => (v[0] > z[best][0] ? k : best), 0);
  const side = x.reduce((best, v, k) => (Math.abs(v[0]) > Math.abs(x[best][0]) ? k : best), 0);
  return [[z[top], theta[top]], [x[side], theta[side]]];
}

function startCalculator(data) {
  const { push } = data;
  const [mediumBox, alphaBox, seBox, message, from, legBox] = ["medium", "alpha", "se", "message", "reference", "leg"].map((id) => byId(`calc-${id}`));
  const theta = Array.from({ length: 271 }, (_, i) => i - 135);
  // four significant digits, and at most so many after the point
  const cell = ([value, lo, hi, modelLo, modelHi], most) =>
    valueCell({ value, lo, hi, modelLo, modelHi }, Math.max(0, Math.min(most, 3 - Math.floor(Math.log10(Math.abs(value) || 1)))));
  let [map, routine, reference, curves] = [null, null, null, {}];

  const maps = makeMaps(byId("calc-maps"), (beta, gamma) => {
    const own = map.alpha(beta, gamma);
    if (!routine) {
      const alone = ["z", "x"].map((component, c) => [quantity("α", component), cell(own[c], 4)]);
      byId("calc-readout").replaceChildren(tableOf([`β = ${sayAngle(beta)}, γ = ${sayAngle(gamma)}`, `${map.kind}, N/cm\u00b3`], alone));
      return;
    }
    const other = scaledAlpha(routine, reference, (beta * Math.PI) / 180, (gamma * Math.PI) / 180);
    const rows = ["z", "x"].map((component, c) => [quantity("α", component), cell(own[c], 4), cell(other[c], 4)]);
    const head = [`β = ${sayAngle(beta)}, γ = ${sayAngle(gamma)}`, "map of one push, N/cm\u00b3", "paper\u2019s routine"];
    byId("calc-readout").replaceChildren(tableOf(head, rows));
  });

  function showNumbers() {
    byId("calc-terms").hidden = !routine;
    if (!routine) {
      const rows = [["ζ", cell(map.zeta, 4)]];
      byId("calc-numbers").replaceChildren(tableOf(["", "this campaign"], rows), html("p", { class: "note" }, "As in the table of the media."));
      return;
    }
    const rows = [["ζ", cell(map.zeta, 4), cell(routine.zeta, 4)], ["χ", "", cell(routine.chi, 4)]];
    const note = `ζ is alpha_z(0, 90\u00b0) of the nine terms, N/cm\u00b3; χ, without unit, is the measured one over it. The routine\u2019s intervals are for a new medium like these, from the scatter between ${reference.media} media.`;
    byId("calc-numbers").replaceChildren(tableOf(["", "from one push: map", "paper\u2019s routine"], rows), html("p", { class: "note" }, note));
    const terms = scaledCoefficients(routine, reference).map((one, i) => [data.terms[i], cell(one, 4)]);
    byId("calc-terms").lastElementChild.replaceChildren(tableOf(["", "N/cm\u00b3"], terms));
  }

  function showPeaks() {
    const rows = Object.entries(curves).flatMap(([name, { own, other }]) => [
      [data.leg_names[name], own.peaks],
      // nine terms: no interval holds their forces
      ...(other ? [[html("span", { class: "faint" }, "paper\u2019s routine"), peaksOf(other, theta).map(([force, at]) => [force.slice(0, 1), at])]] : []),
    ]).map(([who, peaks]) => [who, ...peaks.flatMap(([force, at]) => [cell(force, 2), sayAngle(at)])]);
    byId("calc-peaks")?.replaceChildren(tableOf(["Leg", ["peak ", ...quantity("F", "z"), ", N"], "at θ", ["peak ", ...quantity("F", "x"), ", N"], "at θ"], rows));
  }

  function showCurves() {
    if (!legBox || !map) return;
    const { own, other } = curves[legBox.value];
    for (const c of ["z", "x"]) {
      const at = (one, k) => one[c].map((v) => v[k]);
      drawChart(byId(`calc-${c}`), `F_${c}`, {
        [map.kind === "table" ? "predicted" : "map"]: { theta, y: at(own, 0) },
        band: { theta, lo: at(own, 1), hi: at(own, 2) },
        outer: { theta, lo: at(own, 3), hi: at(own, 4) },
        ...(other && { routine: { theta, y: at(other, 0) } }),
      });
    }
  }

  /** A medium of the campaign as the other sections have it; without a typed push. */
  function showMedium(name) {
    const profiles = data.profiles[name];
    const kind = bestProfile(profiles) ?? "generic";
    const profile = profiles[kind];
    const grid = (kind === "map" && data.maps[name]) || data.alpha[name];
    const zeta = data.zeta[name];
    const ends = (leg, c) => ["", "model_"].flatMap((which) => {
      const band = bandOf(data.predicted[name]?.[leg]?.[kind], theta, c, which);
      return band && !data.predicted[name][leg][kind].theta_deg ? [band.lo, band.hi] : [[], []];
    });
    const sweeps = Object.entries(data.legs).map(([leg, outline]) => {
      const sweep = sweepLeg(profile, outline, theta, data.rate);
      const curve = (c) => sweep[c].map((value, i) => [value, ...ends(leg, c).map((along) => along[i] ?? NaN)]);
      const own = { z: curve("z"), x: curve("x") };
      // intervals of peaks are in the section on legs
      own.peaks = peaksOf(own, theta).map(([force, at]) => [force.slice(0, 1), at]);
      return [leg, { own, other: null }];
    });
    [routine, reference, curves] = [null, null, Object.fromEntries(sweeps)];
    const alphaAt = (beta, gamma) => {
      const cellOf = cellAt(grid, beta, gamma);
      const values = alphaOf(profile, (beta * Math.PI) / 180, (gamma * Math.PI) / 180);
      return ["z", "x"].map((c, i) => (cellOf && cellOf[c].value !== null ? [cellOf[c].value, cellOf[c].lo, cellOf[c].hi] : [values[i]]));
    };
    map = { kind, alpha: alphaAt, zeta };
    maps.show(grid, (beta, gamma) => {
      const [z, x] = map.alpha(beta, gamma).map(([value]) => ({ value }));
      return { z, x };
    });
  }

  function update() {
    if (mediumBox.value) {
      [alphaBox, seBox].forEach((box) => box.setAttribute("aria-invalid", "false"));
      byId("calc-result").hidden = false;
      message.textContent = "";
      alphaBox.value = say(down[mediumBox.value], 4);
      seBox.value = "";
      showMedium(mediumBox.value);
      showNumbers();
      showPeaks();
      showCurves();
      return;
    }
    const { alpha, se, wrong } = readPush(alphaBox.value, seBox.value);
    [alphaBox, seBox].forEach((box, i) => box.setAttribute("aria-invalid", String(wrong[i] !== "")));
    const found = wrong.find(Boolean);
    map = null;
    byId("calc-result").hidden = found !== undefined;
    const unit = `${alpha} N/cm\u00b3 is outside ${PLAUSIBLE[0]} to ${PLAUSIBLE[1]}, where dry granular media lie: is it in another unit? 1 N/cm\u00b3 = 1000 kN/m\u00b3.`;
    message.textContent = found ?? (alpha < PLAUSIBLE[0] || alpha > PLAUSIBLE[1] ? unit : "");
    if (found) return;
    map = { kind: "map", ...scaleMap(push, alpha, se) };
    reference = data.references[Number(from.value)];
    routine = scaleNewMedium(alpha, se || 0, reference);
    const sweep = (leg) => scaledSweep(routine, reference, leg, theta, data.rate);
    curves = Object.fromEntries(Object.entries(map.legs).map(([name, own]) => [name, { own, other: sweep(data.legs[name]) }]));
    maps.show(push.map, (beta, gamma) => {
      const [z, x] = map.alpha(beta, gamma).map(([value]) => ({ value }));
      return { z, x };
    });
    showNumbers();
    showPeaks();
    showCurves();
  }

  // the published media first, as rftfit scale does it
  fillSelect(from, data.references.map(({ name }, i) => [String(i), name]), String(data.references.length - 1));
  if (legBox) fillSelect(legBox, Object.keys(data.legs).map((name) => [name, data.leg_names[name]]));
  byId("calc-form").addEventListener("submit", (event) => event.preventDefault());
  mediumBox.addEventListener("change", update);
  for (const box of [alphaBox, seBox]) box.addEventListener("input", () => {
    mediumBox.value = "";
    update();
  });
  from.addEventListener("change", () => {
    mediumBox.value = "";
    update();
  });
  legBox?.addEventListener("change", showCurves);
  addEventListener("resize", showCurves);
  // what the campaign itself measured straight down, where it did: its media come first, with their own zeta
  const down = data.down;
  const known = data.media.filter(({ key }) => down[key] > 0 && data.zeta[key][0] !== null && Object.keys(data.profiles[key]).length);
  fillSelect(mediumBox, [...known.map(({ key, title }) => [key, title]), ["", "from one push"]], known[0]?.key ?? "");
  if (!known.length) alphaBox.value = say(Object.values(down).find((v) => v > 0) ?? 0.35, 4);
  update();
}
