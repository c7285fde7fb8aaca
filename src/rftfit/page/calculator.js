// The field calculator: one penetration test in, a whole medium out.

const PLAUSIBLE = [0.05, 5];

function readNumber(text) {
  const trimmed = text.trim();
  return /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(trimmed) ? Number(trimmed) : NaN;
}

/** What is wrong with an input, in words; empty if nothing. */
function complaint(alphaText, seText) {
  const hint = (text) => (/^\s*\d+,\d+\s*$/.test(text) ? ` Write a decimal point: ${text.trim().replace(",", ".")}` : "");
  if (!(readNumber(alphaText) > 0)) return `alpha: found "${alphaText}"; a positive number of N/cm\u00b3 is wanted.${hint(alphaText)}`;
  if (!(readNumber(seText) >= 0)) return `standard error: found "${seText}"; 0 or a positive number of N/cm\u00b3 is wanted.${hint(seText)}`;
  return "";
}

/** Everything that the calculator shows, from numbers alone. */
function calculate(data, reference, alpha, se) {
  const scaled = scaleNewMedium(alpha, se, reference, data.confidence);
  const theta = Array.from({ length: 271 }, (_, i) => i - 135);
  const legs = Object.entries(data.legs).map(([name, leg]) => [name, scaledSweep(scaled, reference, leg, theta, data.rate)]);
  return { scaled, coefficients: scaledCoefficients(scaled, reference), theta, legs: Object.fromEntries(legs) };
}

function startCalculator(data) {
  const [alphaBox, seBox, from, legBox] = ["alpha", "se", "reference", "leg"].map((id) => byId(`calc-${id}`));
  let result = null;
  let reference = null;
  const radians = (degrees) => (degrees * Math.PI) / 180;
  const read = (beta, gamma) => {
    const [z, x] = scaledAlpha(result.scaled, reference, radians(beta), radians(gamma));
    const of = ([value, lo, hi]) => ({ value, lo, hi });
    return { z: of(z), x: of(x), note: "" };
  };
  const maps = makeMaps(byId("calc-maps"), (beta, gamma) => {
    const { z, x } = read(beta, gamma);
    const place = `beta = ${sayAngle(beta)}, gamma = ${sayAngle(gamma)}`;
    const rows = [["alpha_z", z], ["alpha_x", x]].map(([name, v]) => [name, valueCell(v, 4)]);
    byId("calc-readout").replaceChildren(tableOf([place, "N/cm\u00b3"], rows));
  });

  function showNumbers() {
    const { scaled, coefficients } = result;
    const row = (name, [value, lo, hi]) => [name, say(value, 4), sayInterval(lo, hi, 4)];
    const rows = [row("zeta", scaled.zeta), row("chi", scaled.chi), ...data.terms.map((term, i) => row(term, coefficients[i]))];
    const note = `Coefficients in N/cm\u00b3. ${say(100 * data.confidence, 0)} % interval for one further medium, from the scatter between ${reference.media.join(", ")}. It is for the nine-term profile, whose alpha_z(0, 90\u00b0) is zeta: the measured one lies above it by the factor chi.`;
    byId("calc-numbers").replaceChildren(tableOf(["", "value", "interval"], rows), html("p", { class: "note" }, note));
  }

  function showPeaks() {
    const rows = Object.entries(result.legs).map(([name, { z, x }]) => {
      const top = z.reduce((best, v, i) => (v[0] > z[best][0] ? i : best), 0);
      const side = x.reduce((best, v, i) => (Math.abs(v[0]) > Math.abs(x[best][0]) ? i : best), 0);
      const cell = ([value, lo, hi]) => valueCell({ value, lo, hi }, 2);
      return [data.leg_names[name], cell(z[top]), sayAngle(result.theta[top]), cell(x[side]), sayAngle(result.theta[side])];
    });
    const head = ["Leg", "peak F_z, N", "at theta", "peak F_x, N", "at theta"];
    byId("calc-peaks")?.replaceChildren(tableOf(head, rows));
  }

  function showCurves() {
    const curves = legBox && result.legs[legBox.value];
    if (!curves) return;
    for (const c of ["z", "x"]) {
      const at = (k) => curves[c].map((v) => v[k]);
      drawChart(byId(`calc-${c}`), `F_${c}`, {
        predicted: { theta: result.theta, y: at(0) },
        band: { theta: result.theta, lo: at(1), hi: at(2) },
      });
    }
  }

  function update() {
    const wrong = complaint(alphaBox.value, seBox.value);
    alphaBox.setAttribute("aria-invalid", String(wrong.startsWith("alpha")));
    seBox.setAttribute("aria-invalid", String(wrong.startsWith("standard")));
    byId("calc-result").hidden = wrong !== "";
    const alpha = readNumber(alphaBox.value);
    const odd = !wrong && (alpha < PLAUSIBLE[0] || alpha > PLAUSIBLE[1]);
    byId("calc-message").textContent = wrong || (odd
      ? `Outside ${PLAUSIBLE[0]} to ${PLAUSIBLE[1]} N/cm\u00b3, where dry granular media lie: is it in another unit? 1 N/cm\u00b3 = 1000 kN/m\u00b3.`
      : "");
    if (wrong) return;
    reference = data.references[Number(from.value)];
    result = calculate(data, reference, alpha, readNumber(seBox.value));
    showNumbers();
    showPeaks();
    maps.show(data, read);
    showCurves();
  }

  fillSelect(from, data.references.map(({ name }, i) => [String(i), name]));
  if (legBox) fillSelect(legBox, Object.keys(data.legs).map((name) => [name, data.leg_names[name]]));
  byId("calc-form").addEventListener("submit", (event) => event.preventDefault());
  for (const box of [alphaBox, seBox]) box.addEventListener("input", update);
  from.addEventListener("change", update);
  legBox?.addEventListener("change", showCurves);
  addEventListener("resize", () => result && showCurves());
  update();
}
