// The field calculator: one push or many in, a whole medium out.

const PLAUSIBLE = [0.05, 5];
const MOST_PUSHES = 100;
const PUSH_COLUMNS = [
  { name: "beta_deg", label: "β, \u00b0", limits: [-90, 90] },
  { name: "gamma_deg", label: "γ, \u00b0", limits: [-90, 90] },
  { name: "alpha_z_N_per_cm3", label: "α_z", limits: [-1000, 1000] },
  { name: "alpha_x_N_per_cm3", label: "α_x", limits: [-1000, 1000], optional: true },
  { name: "se_z", label: "error of z", limits: [0, 1000], optional: true },
  { name: "se_x", label: "error of x", limits: [0, 1000], optional: true },
];

function readNumber(text) {
  const trimmed = text.trim().replace(MINUS, "-");
  return /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(trimmed) ? Number(trimmed) : NaN;
}

/** Pushes of rows of text, and what is wrong: [row, column, words]. A row without alpha and errors is none yet. */
function pushesOf(rows) {
  const wrong = [];
  const pushes = rows.flatMap((texts, row) => {
    if (texts.slice(2).every((text) => !text.trim())) return [];
    const [beta_deg, gamma_deg, z, x, seZ, seX] = PUSH_COLUMNS.map(({ label, limits, optional }, c) => {
      const text = texts[c] || "";
      const value = readNumber(text);
      const fits = value >= limits[0] && value <= limits[1];
      const hint = /^\s*[+-]?\d*,\d+\s*$/.test(text) ? ` Write a decimal point: ${text.trim().replace(",", ".")}` : "";
      const allowed = `a number from ${say(limits[0], 0)} to ${limits[1]}${optional ? ", or nothing" : ""}`;
      if (!fits && (text.trim() || !optional)) wrong.push([row, c, `Push ${row + 1}, ${label}: found "${text.trim().slice(0, 40)}"; ${allowed} is wanted.${hint}`]);
      return value;
    });
    return [{ beta_deg, gamma_deg, alpha: [z, x], se: [seZ, seX] }];
  });
  return { pushes, wrong };
}

/** Rows of the pushes behind a profile of rftfit export. */
function rowsOfProfile(text) {
  const pushes = (() => { try { return JSON.parse(text).pushes; } catch { return null; } })();
  const columns = PUSH_COLUMNS.map(({ name }) => pushes?.[name]);
  if (!columns.every((column) => Array.isArray(column) && column.length === columns[0].length && column.length)) {
    return { wrong: "This is no profile as rftfit export writes it: it has no pushes." };
  }
  return { rows: columns[0].map((_, i) => columns.map((column) => (column[i] === null ? "" : String(Number(Number(column[i]).toPrecision(6)))))) };
}

/** Rows of a table that was pasted: with the program's names of columns, or in their order. */
function rowsOfText(text) {
  if (text.trimStart().startsWith("{")) return rowsOfProfile(text);
  const lines = text.split(/\r?\n/).filter((line) => line.trim() && !line.startsWith("#"));
  if (lines.length > MOST_PUSHES + 1) return { wrong: `Found ${lines.length} rows; at most ${MOST_PUSHES} pushes fit here. rftfit scale --pushes takes any number.` };
  const mark = ["\t", ";", ","].find((one) => lines[0]?.includes(one)) || ",";
  const cells = lines.map((line) => line.split(mark).map((cell) => cell.trim().replace(/^"(.*)"$/, "$1")));
  const named = cells.length > 0 && cells[0].some((cell) => PUSH_COLUMNS.some(({ name }) => name === cell));
  const places = PUSH_COLUMNS.map(({ name }, c) => (named ? cells[0].indexOf(name) : c));
  const lacking = PUSH_COLUMNS.filter(({ optional }, c) => !optional && places[c] < 0).map(({ name }) => name);
  if (lacking.length) return { wrong: `The table has no column ${lacking.join(", ")}.` };
  const rows = cells.slice(named ? 1 : 0).map((line) => places.map((place) => line[place] || ""));
  return rows.length ? { rows } : { wrong: "Found no row; one push a line is wanted." };
}

function startCalculator(data) {
  const [form, body, message, from, legBox, pasted] = ["form", "rows", "message", "reference", "leg", "paste"].map((id) => byId(`calc-${id}`));
  const grid = makeGrid(data.shapes, data.beta_deg, data.gamma_deg);
  const wide = normalQuantile(data.confidence);
  const level = `${say(100 * data.confidence, 0)} %`;
  const theta = Array.from({ length: 271 }, (_, i) => i - 135);
  const band = ([value, deviation]) => [value, value - wide * deviation, value + wide * deviation];
  const cell = ([value, lo, hi], digits) => valueCell({ value, lo, hi }, digits);
  // of the map, and of the paper's routine where there is a push straight down
  let [map, routine, reference, curves] = [null, null, null, {}];

  const read = (beta, gamma) => {
    const node = (beta === -90 ? data.beta_deg.length - 2 : data.beta_deg.indexOf(beta) - 1) * data.gamma_deg.length + data.gamma_deg.indexOf(gamma);
    // a plate at -90 degrees is the one at 90
    const of = (place) => {
      const [value, lo, hi] = band([map.alpha[place], Math.sqrt(map.covariance[place][place])]);
      return { value, lo, hi };
    };
    return { z: of(node), x: of(grid.nodes.length + node), note: map.measured[node] ? "Measured: what was pushed, with its error." : "Estimated from the pushes and the known media." };
  };
  const maps = makeMaps(byId("calc-maps"), (beta, gamma) => {
    const { z, x, note } = read(beta, gamma);
    const other = routine && scaledAlpha(routine, reference, beta * RADIAN, gamma * RADIAN);
    const rows = [["z", z], ["x", x]].map(([component, v], c) => [quantity("α", component), valueCell(v, 4), ...(other ? [cell(other[c], 4)] : [])]);
    const head = [`β = ${sayAngle(beta)}, γ = ${sayAngle(gamma)}`, "map, N/cm\u00b3", ...(other ? ["paper\u2019s routine"] : [])];
    byId("calc-readout").replaceChildren(tableOf(head, rows), html("p", {}, note));
  });

  function showNumbers() {
    const zeta = band(zetaOfMap(grid, map));
    const rows = [["ζ", cell(zeta, 4), ...(routine ? [cell(routine.zeta, 4)] : [])]];
    if (routine) rows.push(["χ", "", cell(routine.chi, 4)]);
    byId("calc-terms").hidden = !routine;
    if (routine) byId("calc-terms").lastElementChild.replaceChildren(tableOf(["", "N/cm\u00b3"], scaledCoefficients(routine, reference).map((one, i) => [data.terms[i], cell(one, 4)])));
    const note = routine
      ? `The routine takes the push straight down alone, for a nine-term profile whose alpha_z(0, 90\u00b0) is zeta, N/cm\u00b3; its intervals are for one further medium, from the scatter between ${reference.media.join(", ")}.`
      : "The paper\u2019s routine needs a push at β 0\u00b0, γ 90\u00b0.";
    byId("calc-numbers").replaceChildren(tableOf(["", "map", ...(routine ? ["paper\u2019s routine"] : [])], rows), html("p", { class: "note" }, note));
  }

  function showPeaks() {
    const rows = Object.entries(curves).flatMap(([name, each]) => each.map(({ z, x }, i) => {
      const top = z.reduce((best, v, k) => (v[0] > z[best][0] ? k : best), 0);
      const side = x.reduce((best, v, k) => (Math.abs(v[0]) > Math.abs(x[best][0]) ? k : best), 0);
      const who = i ? html("span", { class: "faint" }, "paper\u2019s routine") : data.leg_names[name];
      return [who, cell(z[top], 2), sayAngle(theta[top]), cell(x[side], 2), sayAngle(theta[side])];
    }));
    byId("calc-peaks")?.replaceChildren(tableOf(["Leg", ["peak ", ...quantity("F", "z"), ", N"], "at θ", ["peak ", ...quantity("F", "x"), ", N"], "at θ"], rows));
  }

  function showCurves() {
    if (!legBox || !map) return;
    const [own, other] = curves[legBox.value];
    for (const c of ["z", "x"]) {
      const at = (one, k) => one[c].map((v) => v[k]);
      drawChart(byId(`calc-${c}`), `F_${c}`, {
        map: { theta, y: at(own, 0) },
        band: { theta, lo: at(own, 1), hi: at(own, 2) },
        ...(other ? { routine: { theta, y: at(other, 0) } } : {}),
      });
    }
  }

  function showAgreement() {
    const { dof, distance, horizontal, belongs, farthest } = map;
    const percent = (share) => (share < 1e-4 ? "less than 0.01" : String(Number((100 * share).toPrecision(2))));
    const known = `the known media (${data.shapes.media.join(", ")})`;
    const strong = Number.isFinite(horizontal) ? `, and alpha_x is ${say(horizontal, 2)} times as strong beside alpha_z` : "";
    const told = [dof
      ? `Agreement with ${known}: χ\u00b2 = ${say(distance, 1)} for ${dof}${strong}. Of media that have their shape, ${percent(belongs)} % lie as far from it or farther.`
      : `One number tells how strong the medium is, not whether it has the shape of ${known}.`];
    const doubt = `This medium does not have the shape of the known media. The push farthest from it: β ${sayAngle(farthest.place.beta / RADIAN)}, γ ${sayAngle(farthest.place.gamma / RADIAN)}, α_${"zx"[farthest.c]}: found ${say(farthest.value)}, expected by the others ${say(farthest.value - farthest.off)} \u00b1 ${say(farthest.error)} N/cm\u00b3. A wet, cohesive or angular medium, or a wrong sign or angle: do not trust what is estimated.`;
    byId("calc-agreement").replaceChildren(html("p", {}, ...told), ...(belongs < data.shapes.not_alike ? [html("p", { class: "bad" }, doubt)] : []));
    const next = nextPush(data.shapes, grid, map);
    const [beta, gamma] = [next.beta, next.gamma].map((angle) => Math.round((100 * angle) / RADIAN) / 100);
    const button = html("button", { type: "button", id: "calc-next" }, "Add it to the table");
    button.addEventListener("click", () => addRow([String(beta), String(gamma)]));
    byId("calc-advice").replaceChildren(
      html("p", {}, html("strong", {}, `Next best push: β ${sayAngle(beta)}, γ ${sayAngle(gamma)}. `),
        `It narrows the ${level} intervals of alpha from typically \u00b1${percent(wide * next.before)} % of the largest alpha to \u00b1${percent(wide * next.after)} %${next.runs > 1 ? `, for ${next.runs} runs, one at each depth` : ""}.`), button);
  }

  /** What the rows give; words about what is wrong with them, or nothing. */
  function calculate() {
    const rows = [...body.rows];
    const { pushes, wrong } = pushesOf(rows.map((row) => [...row.querySelectorAll("input")].map((box) => box.value)));
    rows.forEach((row, i) => {
      row.cells[0].textContent = `Push ${i + 1}`;
      row.querySelectorAll("input").forEach((box, c) => {
        box.setAttribute("aria-label", `Push ${i + 1}, ${PUSH_COLUMNS[c].label}`);
        box.setAttribute("aria-invalid", String(wrong.some(([k, column]) => k === i && column === c)));
      });
      row.querySelector("button").setAttribute("aria-label", `Remove push ${i + 1}`);
      row.querySelector("button").disabled = rows.length === 1;
    });
    byId("calc-add").disabled = rows.length >= MOST_PUSHES;
    if (wrong.length) return wrong[0][2];
    if (!pushes.length) return "Type α_z of at least one push.";
    map = estimateMap(data.shapes, grid, pushes);
    if (!map) return "The pushes tell nothing of the medium, or meet no resistance: look at the signs of α and at the angles.";
    reference = data.references[Number(from.value)];
    const down = pushes.find(({ beta_deg, gamma_deg }) => Math.abs(beta_deg) <= SAME_DIRECTION && Math.abs(gamma_deg - 90) <= SAME_DIRECTION);
    routine = down && down.alpha[0] > 0 ? scaleNewMedium(down.alpha[0], down.se[0] || 0, reference, data.confidence) : null;
    const sweep = (leg) => {
      const { z, x } = sweepMap(grid, map, leg, theta, data.rate);
      return [{ z: z.map(band), x: x.map(band) }, ...(routine ? [scaledSweep(routine, reference, leg, theta, data.rate)] : [])];
    };
    curves = Object.fromEntries(Object.entries(data.legs).map(([name, leg]) => [name, sweep(leg)]));
    showAgreement();
    showNumbers();
    showPeaks();
    const points = pushes.map(({ beta_deg, gamma_deg, alpha: [z, x] }) => [beta_deg, gamma_deg, z, Number.isFinite(x) ? x : null]);
    maps.show({ beta_deg: data.beta_deg, gamma_deg: data.gamma_deg, points }, read);
    return "";
  }

  function update() {
    map = null;
    const wrong = calculate();
    byId("calc-result").hidden = wrong !== "";
    const largest = map ? Math.max(...map.alpha.map(Math.abs)) : NaN;
    message.textContent = wrong || (largest < PLAUSIBLE[0] || largest > PLAUSIBLE[1]
      ? `The largest alpha is ${largest.toPrecision(3)} N/cm\u00b3, outside ${PLAUSIBLE[0]} to ${PLAUSIBLE[1]}, where dry granular media lie: is it in another unit? 1 N/cm\u00b3 = 1000 kN/m\u00b3.`
      : "");
    if (!wrong) showCurves();
  }

  function rowOf(texts) {
    const boxes = PUSH_COLUMNS.map(({ label }, c) => html("td", { "data-label": label }, html("input", { autocomplete: "off", spellcheck: "false", value: texts[c] || "", "aria-describedby": "calc-message" })));
    const button = html("button", { type: "button" }, "Remove");
    const row = html("tr", {}, html("th", { scope: "row" }), ...boxes, html("td", {}, button));
    button.addEventListener("click", () => {
      const near = row.nextElementSibling || row.previousElementSibling;
      row.remove();
      update();
      near.querySelector("input").focus();
    });
    return row;
  }

  function addRow(texts) {
    const row = rowOf(texts);
    body.append(row);
    update();
    row.querySelectorAll("input")[texts.length].focus();
  }

  function take(text) {
    const { rows, wrong } = rowsOfText(text);
    if (wrong) byId("calc-pasted").textContent = wrong;
    else {
      byId("calc-pasted").textContent = `Took ${rows.length} ${rows.length === 1 ? "row" : "rows"}.`;
      body.replaceChildren(...rows.map(rowOf));
      update();
    }
  }

  // the published media first, as rftfit scale does it
  fillSelect(from, data.references.map(({ name }, i) => [String(i), name]), String(data.references.length - 1));
  if (legBox) fillSelect(legBox, Object.keys(data.legs).map((name) => [name, data.leg_names[name]]));
  form.addEventListener("submit", (event) => event.preventDefault());
  body.addEventListener("input", update);
  body.addEventListener("paste", (event) => {
    const text = event.clipboardData.getData("text");
    if (!/[\n\t]/.test(text.trim())) return;
    event.preventDefault();
    take(text);
  });
  byId("calc-add").addEventListener("click", () => addRow([]));
  byId("calc-take").addEventListener("click", () => take(pasted.value));
  byId("calc-file").addEventListener("change", async (event) => {
    const [file] = event.target.files;
    if (file) take(await file.text());
  });
  from.addEventListener("change", update);
  legBox?.addEventListener("change", showCurves);
  addEventListener("resize", showCurves);
  // what the campaign itself measured straight down, where it did
  const down = Object.values(data.alpha).map(({ beta_deg, gamma_deg, z }) => z[beta_deg.indexOf(0)]?.[gamma_deg.indexOf(90)]);
  body.append(rowOf(["0", "90", say(down.find((v) => v > 0) ?? 0.35, 4)]));
  update();
}
