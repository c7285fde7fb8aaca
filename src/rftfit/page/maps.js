// Maps of alpha over (beta, gamma): coloured cells at their true angles, one of them chosen.

const MAP = { width: 420, height: 300, left: 46, right: 20, top: 8, bottom: 78 };

/** Borders of the cells around ascending angles, degrees, as rftfit.figures.maps.edges. */
function edgesOf(nodes) {
  if (nodes.length === 1) return [Math.max(-90, nodes[0] - 5), Math.min(90, nodes[0] + 5)];
  const middle = nodes.slice(1).map((v, i) => (v + nodes[i]) / 2);
  const [first, last] = [nodes[0], nodes[nodes.length - 1]];
  const ends = [Math.max(-90, 2 * first - middle[0]), Math.min(90, 2 * last - middle[middle.length - 1])];
  return [ends[0], ...middle, ends[1]];
}

/**
 * Two maps (alpha_z, alpha_x) that share their chosen cell.
 * `show(beta, gamma)` is told of the choice. Of what is made, `show(grid, read)` draws a medium:
 * `grid` has beta_deg, gamma_deg, and points [beta, gamma, z, x] of pushes that lie on no grid;
 * `read(beta, gamma)`, degrees, gives {z: {value, lo, hi}, x: ..., note, isRun}; isRun is false where nobody pushed.
 */
function makeMaps(parent, show) {
  const state = { row: 0, col: 0, read: null, points: [] };
  let [beta, gamma, edges] = [[], [], null];
  const maps = ["z", "x"].map((component) => {
    const image = svg("svg", {
      viewBox: `0 0 ${MAP.width} ${MAP.height}`, tabindex: "0", role: "application", class: "map",
      "aria-roledescription": "map; arrow keys move the chosen cell", "data-component": component,
    });
    const caption = html("figcaption", {}, ...quantity("α", component), ", N/cm\u00b3");
    parent.append(html("figure", {}, caption, image));
    return { component, image };
  });

  const px = (g) => MAP.left + ((g + 90) / 180) * (MAP.width - MAP.left - MAP.right);
  const py = (b) => MAP.top + ((90 - b) / 180) * (MAP.height - MAP.top - MAP.bottom);

  const hatchOf = (image) => `${parent.id}-${image.dataset.component}-hatch`;

  function drawFrame(image) {
    const hatch = svg("pattern", { id: hatchOf(image), width: 6, height: 6, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)" });
    hatch.append(svg("line", { x1: 0, y1: 0, x2: 0, y2: 6, stroke: "var(--hatch)", "stroke-width": 3 }));
    image.append(svg("defs"));
    image.firstChild.append(hatch);
    const floor = MAP.height - MAP.bottom;
    for (const g of [-90, -45, 0, 45, 90]) {
      image.append(svg("line", { class: "axis", x1: px(g), x2: px(g), y1: floor, y2: floor + 4 }));
      image.append(svg("text", { x: px(g), y: floor + 17, "text-anchor": "middle" }, sayAngle(g)));
    }
    for (const b of [-90, -60, -30, 0, 30, 60, 90]) {
      const shift = b === 90 ? 9 : b === -90 ? 0 : 4;
      image.append(svg("text", { x: MAP.left - 6, y: py(b) + shift, "text-anchor": "end" }, sayAngle(b)));
    }
    image.append(svg("text", { x: px(0), y: floor + 32, "text-anchor": "middle" }, "γ"));
    image.append(svg("text", { x: 12, y: py(15), "text-anchor": "middle", transform: `rotate(-90 12 ${py(15)})` }, "β"));
  }

  function drawKey(image, largest) {
    const width = 200;
    const left = px(0) - width / 2;
    const top = MAP.height - 36;
    for (let i = 0; i < 40; i += 1) {
      const fill = colourOf((i / 39) * 2 - 1, 1);
      image.append(svg("rect", { x: left + (i * width) / 40, y: top, width: width / 40 + 0.5, height: 10, fill }));
    }
    [-largest, 0, largest].forEach((v, i) =>
      image.append(svg("text", { x: left + (i * width) / 2, y: top + 24, "text-anchor": "middle" }, say(v, 2))),
    );
  }

  function draw() {
    for (const { component, image } of maps) {
      image.replaceChildren();
      drawFrame(image);
      let largest = 0;
      const cells = beta.map((b) => gamma.map((g) => state.read(b, g)));
      const isNumber = (value) => value !== null && Number.isFinite(value);
      for (const cell of cells.flat()) if (isNumber(cell[component].value)) largest = Math.max(largest, Math.abs(cell[component].value));
      drawKey(image, largest);
      cells.forEach((line, row) =>
        line.forEach((cell, col) => {
          const value = cell[component].value;
          const box = boxOf(row, col);
          const attributes = { ...box, class: "cell", "data-row": row, "data-col": col };
          // hatched: there were runs, and none gave a number; a direction without a run stays empty
          const empty = cell.isRun === false ? "transparent" : `url(#${hatchOf(image)})`;
          attributes.fill = isNumber(value) ? colourOf(value, largest) : empty;
          image.append(svg("rect", attributes));
        }),
      );
      for (const point of state.points) {
        const value = point[component === "z" ? 2 : 3];
        const dot = svg("circle", { class: "push", cx: px(point[1]), cy: py(point[0]), r: 4, fill: value === null ? "none" : colourOf(value, largest) });
        dot.append(svg("title", {}, `push at β ${sayAngle(point[0])}, γ ${sayAngle(point[1])}: ${say(value)} N/cm\u00b3`));
        image.append(dot);
      }
      image.append(svg("rect", { class: "chosen" }), svg("rect", { class: "chosen-in" }));
    }
    choose(state.row, state.col);
  }

  function boxOf(row, col) {
    const x = px(edges.gamma[col]);
    const y = py(edges.beta[row + 1]);
    return { x, y, width: px(edges.gamma[col + 1]) - x, height: py(edges.beta[row]) - y };
  }

  function choose(row, col) {
    state.row = Math.max(0, Math.min(beta.length - 1, row));
    state.col = Math.max(0, Math.min(gamma.length - 1, col));
    const found = state.read(beta[state.row], gamma[state.col]);
    for (const { component, image } of maps) {
      for (const mark of image.querySelectorAll(".chosen, .chosen-in")) {
        for (const [key, value] of Object.entries(boxOf(state.row, state.col))) mark.setAttribute(key, value);
      }
      const place = `β ${sayAngle(beta[state.row])}, γ ${sayAngle(gamma[state.col])}`;
      image.setAttribute("aria-label", `α_${component} at ${place}: ${say(found[component].value)} N/cm\u00b3`);
    }
    show(beta[state.row], gamma[state.col]);
  }

  const moves = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };
  for (const { image } of maps) {
    image.addEventListener("keydown", (event) => {
      const move = moves[event.key];
      if (!move) return;
      event.preventDefault();
      choose(state.row + move[0], state.col + move[1]);
    });
    for (const kind of ["pointermove", "pointerdown"]) {
      image.addEventListener(kind, (event) => {
        const { row, col } = event.target.dataset;
        if (row !== undefined && (Number(row) !== state.row || Number(col) !== state.col)) choose(Number(row), Number(col));
      });
    }
  }
  return {
    show(grid, read) {
      if (grid.beta_deg !== beta || grid.gamma_deg !== gamma) {
        [beta, gamma] = [grid.beta_deg, grid.gamma_deg];
        edges = { beta: edgesOf(beta), gamma: edgesOf(gamma) };
        state.row = Math.max(0, beta.indexOf(0));
        state.col = gamma.indexOf(90) < 0 ? gamma.length - 1 : gamma.indexOf(90);
      }
      [state.read, state.points] = [read, grid.points || []];
      draw();
    },
  };
}

/** alpha_z and alpha_x of a grid at a direction, degrees, with their intervals; nothing where it has none. */
function cellAt(grid, beta, gamma) {
  // a plate at -90 degrees is the one at 90
  const place = (lines, at, period) => {
    const exact = lines.indexOf(at);
    return exact < 0 ? lines.findIndex((v) => Math.abs(mod(v - at + period / 2, period) - period / 2) <= grid.tolerance_deg) : exact;
  };
  const [row, col] = [place(grid.beta_deg, beta, 180), place(grid.gamma_deg, gamma, 360)];
  if (row < 0 || col < 0) return null;
  const of = (c) => ({
    value: grid[c][row][col], lo: grid[`${c}_lo`][row][col], hi: grid[`${c}_hi`][row][col],
    unmeasured: c === "x" && grid.unmeasured_x.includes(`${row},${col}`),
  });
  return { z: of("z"), x: of("x"), note: grid.notes[`${row},${col}`] };
}

/** The maps section: every medium and profile, with what the other profiles say of the cell. */
function startMaps(data) {
  const [medium, profile] = [byId("map-medium"), byId("map-profile")];
  const radians = (degrees) => (degrees * Math.PI) / 180;
  const readers = () => {
    const own = data.profiles[medium.value];
    const cells = data.alpha[medium.value];
    const between = cells.points.length ? "Interpolated between the pushes, which are the dots." : "";
    const cellsOf = (grid, otherwise) => (beta, gamma) => {
      const cell = cellAt(grid, beta, gamma);
      if (!cell) return otherwise(beta, gamma);
      const isRun = [cell.z, cell.x].some(({ value }) => value !== null) || Boolean(cell.note);
      return { ...cell, isRun, note: isRun ? cell.note || between : "No run in this direction." };
    };
    const modelOf = (name) => (beta, gamma) => {
      const [z, x] = alphaOf(own[name], radians(beta), radians(gamma));
      return { z: { value: z }, x: { value: x }, note: "" };
    };
    const result = [["measured", cellsOf(cells, () => ({ z: { value: null }, x: { value: null }, note: "" }))]];
    if (own.map) result.push(["map", cellsOf(data.maps[medium.value], modelOf("map"))]);
    for (const name of ["fourier", "generic", "depth_only"]) if (own[name]) result.push([name, modelOf(name)]);
    return result;
  };
  const names = { ...data.profile_names, measured: "measured" };
  const maps = makeMaps(byId("map-pair"), (beta, gamma) => {
    const head = ["", quantity("α", "z"), quantity("α", "x")];
    const all = readers().map(([name, read]) => [name, read(beta, gamma)]);
    const rows = all.map(([name, { z, x }]) => [names[name], valueCell(z, 4), valueCell(x, 4)]);
    const title = `β = ${sayAngle(beta)}, γ = ${sayAngle(gamma)}, N/cm\u00b3`;
    const note = new Map(all).get(profile.value)?.note || all[0][1].note;
    const tolerance = data.alpha[medium.value].tolerance_deg;
    const symmetric = Math.abs(Math.abs(gamma) - 90) < tolerance && Math.min(Math.abs(beta), 90 - Math.abs(beta)) < tolerance;
    const measuredX = all[0][1].x;
    const aside = symmetric && !measuredX.unmeasured && measuredX.value
      ? ["By symmetry ", ...quantity("α", "x"), " is 0 here: what was measured instead shows errors, as of mount or axes, which its interval need not hold. "] : [];
    byId("map-readout").replaceChildren(html("p", {}, html("strong", {}, title)), tableOf(head, rows), html("p", {}, ...aside, note));
  });
  const update = () => {
    const all = readers();
    const own = data.profiles[medium.value];
    // a few pushes are seen best in the map that is made of them
    const known = data.alpha[medium.value].z.flat();
    const whole = own.table && known.filter((v) => v !== null).length > 9;
    const chosen = profile.value || (whole ? "measured" : ["map", "generic", "measured"].find((name) => name === "measured" || own[name]));
    fillSelect(profile, all.map(([name]) => [name, names[name]]), chosen);
    // a model is known everywhere, also where one push was made
    const cells = data.alpha[medium.value];
    const one = cells.beta_deg.length * cells.gamma_deg.length === 1;
    const model = profile.value !== "measured" && one ? data : cells;
    const grid = profile.value === "map" ? { ...data.maps[medium.value], points: cells.points } : model;
    maps.show(grid, new Map(all).get(profile.value));
  };
  fillSelect(medium, data.media.map(({ key, title }) => [key, title]));
  medium.addEventListener("change", () => {
    if (!data.profiles[medium.value].table) profile.value = "";
    update();
  });
  profile.addEventListener("change", update);
  update();
}
