// A chart of force against theta: lines, a band, a cursor that a click moves.

const CHART = { height: 230, left: 48, right: 20, top: 22, bottom: 40 };

const LINES = ["measured", "routine", "predicted", "map"];

/** Path of an svg through points (pixels), broken where one is not finite. */
function pathOf(points) {
  let text = "";
  let pen = "M";
  for (const [x, y] of points) {
    if (Number.isFinite(x) && Number.isFinite(y)) {
      text += `${pen}${x.toFixed(2)} ${y.toFixed(2)}`;
      pen = "L";
    } else pen = "M";
  }
  return text;
}

/** Stretches of rows whose numbers are all finite. */
function finiteStretches(rows) {
  const stretches = [];
  let current = null;
  for (const row of rows) {
    if (!row.every(Number.isFinite)) current = null;
    else if (current) current.push(row);
    else stretches.push((current = [row]));
  }
  return stretches;
}

/** The finite numbers of a list, which may be missing. */
function numbersIn(values) {
  return (values || []).filter((v) => v !== null && Number.isFinite(v));
}

/**
 * Draw curves. `curves` has {theta, y} of any of `LINES`, and band and outer {theta, lo, hi}, each optional.
 * Gives {cursor(theta)}; `picked(theta)` is told where the chart was clicked.
 */
function drawChart(image, title, curves, picked) {
  const all = [
    0, ...LINES.flatMap((kind) => numbersIn(curves[kind]?.y)),
    ...numbersIn(curves.band?.lo), ...numbersIn(curves.band?.hi), ...numbersIn(curves.outer?.lo), ...numbersIn(curves.outer?.hi),
  ];
  let low = Math.min(...all);
  let high = Math.max(...all);
  const pad = 0.06 * (high - low || 1);
  low -= pad;
  high += pad;
  // as wide as it will be shown, so that text is as large on a phone as anywhere
  const width = Math.round(Math.max(300, Math.min(640, image.clientWidth || 520)));
  const right = width - CHART.right;
  const px = (t) => CHART.left + ((t + 135) / 270) * (right - CHART.left);
  const py = (v) => (v === null ? NaN : CHART.top + ((high - v) / (high - low)) * (CHART.height - CHART.top - CHART.bottom));
  image.replaceChildren();
  image.setAttribute("viewBox", `0 0 ${width} ${CHART.height}`);
  const floor = CHART.height - CHART.bottom;
  for (const t of [-135, -90, -45, 0, 45, 90, 135]) {
    image.append(svg("line", { class: "grid", x1: px(t), x2: px(t), y1: CHART.top, y2: floor }));
    image.append(svg("text", { x: px(t), y: floor + 15, "text-anchor": "middle" }, sayAngle(t)));
  }
  const { ticks, digits } = ticksOf(low, high);
  for (const v of ticks) {
    image.append(svg("line", { class: "grid", x1: CHART.left, x2: right, y1: py(v), y2: py(v) }));
    image.append(svg("text", { x: CHART.left - 6, y: py(v) + 4, "text-anchor": "end" }, say(v, digits)));
  }
  image.append(svg("line", { class: "zero", x1: CHART.left, x2: right, y1: py(0), y2: py(0) }));
  for (const [name, band] of [["outer", curves.outer], ["band", curves.band]]) {
    if (!band) continue;
    const { theta, lo, hi } = band;
    const stretches = finiteStretches(theta.map((t, i) => [px(t), py(lo[i]), py(hi[i])]));
    const outlines = stretches.map((ends) => `${pathOf([...ends.map(([x, , y]) => [x, y]), ...ends.map(([x, y]) => [x, y]).reverse()])}Z`);
    image.append(svg("path", { class: name, d: outlines.join("") }));
  }
  for (const kind of LINES) {
    if (!curves[kind]) continue;
    const { theta, y } = curves[kind];
    image.append(svg("path", { class: kind, d: pathOf(theta.map((t, i) => [px(t), py(y[i])])) }));
  }
  const [letter, component] = title.split("_");
  const label = svg("text", { x: CHART.left, y: 14 }, letter);
  label.append(svg("tspan", { dy: 3, "font-size": "9" }, component), svg("tspan", { dy: -3 }, ", N"));
  image.append(label);
  drawLegend(image, curves, right);
  image.append(svg("text", { x: px(0), y: CHART.height - 6, "text-anchor": "middle" }, "θ (0: leg straight down)"));
  const cursor = svg("line", { class: "cursor", y1: CHART.top, y2: floor });
  if (picked) {
    image.append(cursor);
    image.onclick = (event) => {
      const box = image.getBoundingClientRect();
      const x = ((event.clientX - box.left) / box.width) * width;
      picked(Math.round(((x - CHART.left) / (right - CHART.left)) * 270 - 135));
    };
  }
  return {
    cursor(theta) {
      cursor.setAttribute("x1", px(theta));
      cursor.setAttribute("x2", px(theta));
    },
  };
}

/** Write the names of the drawn `LINES` above a chart, from its `right` edge (pixels) leftward. */
function drawLegend(image, curves, right) {
  let x = right;
  for (const kind of [...LINES].reverse()) {
    if (!curves[kind]) continue;
    const text = kind === "routine" ? "paper\u2019s routine" : kind;
    image.append(svg("text", { x, y: 14, "text-anchor": "end" }, text));
    x -= 6.2 * text.length + 9;
    image.append(svg("line", { class: kind, x1: x - 26, x2: x - 2, y1: 10, y2: 10 }));
    x -= 36;
  }
}
