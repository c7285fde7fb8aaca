// Small helpers: elements, numbers, colours. Text goes in as text only, never as markup.

const SVG = "http://www.w3.org/2000/svg";
const MINUS = "\u2212";
const DEGREE = "\u00b0";

/** Make an element of a drawing. */
function svg(name, attributes = {}, text = "") {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text) element.textContent = text;
  return element;
}

/** Make an element of the page. */
function html(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

/** A letter with its component as an index. */
function quantity(letter, component) {
  return [letter, html("sub", {}, component)];
}

function byId(id) {
  return document.getElementById(id);
}

/** Number with a true minus sign; "no value" where it is missing. */
function say(value, digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "no value";
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", MINUS);
}

function sayAngle(degrees) {
  return say(degrees, Math.abs(degrees - Math.round(degrees)) < 0.005 ? 0 : 1) + DEGREE;
}

/** Interval in words, with so many digits that its ends differ; "by symmetry" for one at zero without width. */
function sayInterval(lo, hi, digits = 3) {
  if (!Number.isFinite(lo) || !Number.isFinite(hi)) return "";
  if (hi - lo < 1e-9) return Math.abs(lo) < 1e-9 ? "by symmetry" : "";
  const ends = [lo, hi].map((end) => say(end, digits));
  return ends[0] === ends[1] ? sayInterval(lo, hi, digits + 1) : ends.join(" to ");
}

/** A number with its intervals below it, of alpha and with the model's own error, as a cell of `tableOf`. */
function valueCell({ value, lo, hi, modelLo, modelHi, unmeasured }, digits) {
  // without a sensor only symmetry knows a number
  if (unmeasured) return Number.isFinite(value) && value !== null ? [say(value, digits), html("small", {}, "by symmetry")] : ["not measured"];
  const ofModel = sayInterval(modelLo, modelHi, digits);
  const intervals = [sayInterval(lo, hi, digits), ofModel && `model ${ofModel}`].filter(Boolean);
  return [say(value, digits), ...intervals.map((interval) => html("small", {}, interval))];
}

/** A table from rows of text; the first cell of each row is its header. */
function tableOf(head, rows) {
  const body = rows.map((row) =>
    html("tr", {}, ...row.map((cell, i) => html(i ? "td" : "th", i ? { class: "num" } : { scope: "row" }, ...[cell].flat()))),
  );
  const top = html("tr", {}, ...head.map((cell, i) => html(cell === "" ? "td" : "th", { ...(cell === "" ? {} : { scope: "col" }), class: i ? "num" : "" }, ...[cell].flat())));
  const table = html("table", {}, html("thead", {}, top), html("tbody", {}, ...body));
  return html("div", { class: "scroll" }, table);
}

/** Fill a list of choices with [value, text] pairs. */
function fillSelect(select, options, chosen) {
  select.replaceChildren(...options.map(([value, text]) => html("option", { value }, text)));
  if (options.some(([value]) => value === chosen)) select.value = chosen;
}

// as in the figures: from blue (negative) over near white (0) to red (positive), told apart by every colour vision
const COLOURS = [
  [5, 48, 97], [33, 102, 172], [67, 147, 195], [146, 197, 222], [209, 229, 240], [247, 247, 247],
  [253, 219, 199], [244, 165, 130], [214, 96, 77], [178, 24, 43], [103, 0, 31],
];

/** Colour of a number from -`largest` to `largest`. */
function colourOf(value, largest) {
  const place = (Math.max(-1, Math.min(1, value / (largest || 1))) + 1) * 0.5 * (COLOURS.length - 1);
  const i = Math.min(COLOURS.length - 2, Math.floor(place));
  const part = place - i;
  const mix = COLOURS[i].map((c, k) => Math.round(c + part * (COLOURS[i + 1][k] - c)));
  return `rgb(${mix.join(",")})`;
}

/** About `count` round numbers from `low` to `high`. */
function ticksOf(low, high, count = 5) {
  const raw = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find((m) => m * power >= raw * 0.7);
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) ticks.push(k * step);
  return { ticks, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}
