// The leg viewer: a leg in the sand, the force on each of its elements, and the curves beside it.

const SCENE = { width: 400, height: 400, cm: 20, top: 11 };
const ARROW_CM = 3.2;

/** Pixels of a position x, cm. */
function sceneX(x) {
  return SCENE.width / 2 + x * (SCENE.width / SCENE.cm);
}

/** Pixels of a height z, cm. */
function sceneY(z) {
  return (SCENE.top - z) * (SCENE.height / SCENE.cm);
}

/** Arrow that begins at (x, z) and is (dx, dz) long, cm; null where it is too short to be seen. */
function arrow(x, z, dx, dz) {
  const [x0, y0, x1, y1] = [sceneX(x), sceneY(z), sceneX(x + dx), sceneY(z + dz)];
  const length = Math.hypot(x1 - x0, y1 - y0);
  if (!(length > 0.5)) return null;
  const [ux, uy] = [(x1 - x0) / length, (y1 - y0) / length];
  const head = Math.min(6, length);
  const [bx, by] = [x1 - head * ux, y1 - head * uy];
  const group = svg("g", { class: "arrow" });
  group.append(svg("line", { x1: x0, y1: y0, x2: bx, y2: by }));
  const half = 0.4 * head;
  const tip = [[x1, y1], [bx - half * uy, by + half * ux], [bx + half * uy, by - half * ux]];
  group.append(svg("polygon", { points: tip.map((p) => p.map((v) => v.toFixed(2)).join(",")).join(" "), "stroke-width": 0 }));
  return group;
}

/** The line of a leg's elements, end to end. */
function outlineOf(placed) {
  const ends = placed.map((e) => [e.x - e.half * e.tx, e.z - e.half * e.tz]);
  const last = placed[placed.length - 1];
  ends.push([last.x + last.half * last.tx, last.z + last.half * last.tz]);
  return pathOf(ends.map(([x, z]) => [sceneX(x), sceneY(z)]));
}

/** Draw a leg in the sand and the forces on its `elements`, as `elementForces` returns them; `scale`: cm of arrow a newton. */
function drawScene(image, leg, theta, rate, elements, scale) {
  image.replaceChildren();
  image.setAttribute("viewBox", `0 0 ${SCENE.width} ${SCENE.height}`);
  const surface = sceneY(0);
  image.append(svg("rect", { class: "sand", x: 0, y: surface, width: SCENE.width, height: SCENE.height - surface }));
  image.append(svg("line", { class: "surface", x1: 0, x2: SCENE.width, y1: surface, y2: surface }));
  image.append(svg("text", { x: 8, y: surface - 6 }, "surface"));
  image.append(svg("text", { x: SCENE.width - 8, y: surface - 6, "text-anchor": "end" }, "+x"));
  const bar = 5 * (SCENE.width / SCENE.cm);
  image.append(svg("line", { class: "axis", x1: 12, x2: 12 + bar, y1: SCENE.height - 14, y2: SCENE.height - 14 }));
  image.append(svg("text", { x: 12 + bar / 2, y: SCENE.height - 20, "text-anchor": "middle" }, "5 cm"));
  const placed = placeElements(leg, theta, rate);
  image.append(svg("path", { class: "leg", d: outlineOf(placed) }));
  const [ax, ay] = [sceneX(0), sceneY(leg.hip_height_cm)];
  // the way the leg turns: over the top toward +x, below toward -x
  image.append(svg("path", { class: "turning", d: `M${ax - 22} ${ay}A22 22 0 0 1 ${ax + 22} ${ay}l-5 -8m5 8l6 -7` }));
  image.append(svg("circle", { class: "axle", cx: ax, cy: ay, r: 5 }));
  for (const [fz, fx, x, z] of elements) {
    const drawn = arrow(x, z, fx * scale, fz * scale);
    if (drawn) image.append(drawn);
  }
}

/** Largest force on any one element over the whole turn, N. */
function largestElement(profile, leg, thetaDeg, rate) {
  let largest = 0;
  for (const degrees of thetaDeg) {
    for (const [fz, fx] of elementForces(profile, leg, (degrees * Math.PI) / 180, rate)) {
      const size = Math.hypot(fz, fx);
      if (size > largest) largest = size;
    }
  }
  return largest;
}

const NINE_TERMS = ["fourier", "generic"];

/** Profile by which the forces on a medium are predicted: its table, its map where that has holes; null where it has neither. */
function bestProfile(profiles) {
  if (profiles.table && !profiles.table.reason) return "table";
  return ["map", "table"].find((name) => profiles[name]) ?? null;
}

/** Ends of an interval over theta; undefined where a profile has none. `which`: "" of alpha, "model_" with the model's own error. */
function bandOf(curves, theta, c, which) {
  const [lo, hi] = ["lo", "hi"].map((end) => curves?.[`force_${c}_${which}${end}_N`]);
  return lo && hi && { theta: curves.theta_deg ?? theta, lo, hi };
}

function startViewer(data) {
  const [medium, legBox, profileBox, slider] = ["medium", "leg", "profile", "theta"].map((id) => byId(`viewer-${id}`));
  const play = byId("viewer-play");
  const theta = Array.from({ length: 271 }, (_, i) => i - 135);
  let state = null;

  function choose() {
    const own = data.profiles[medium.value];
    const names = Object.keys(data.profile_names).filter((name) => own[name]);
    fillSelect(profileBox, names.map((name) => [name, data.profile_names[name]]), profileBox.value);
    if (!names.length) {
      byId("viewer-readout").textContent = "No profile of this medium is known; the summary says why.";
      for (const id of ["scene", "z", "x"]) byId(`viewer-${id}`).replaceChildren();
      state = null;
      return;
    }
    const [profile, leg] = [own[profileBox.value], data.legs[legBox.value]];
    const predicted = sweepLeg(profile, leg, theta, data.rate);
    const measured = data.measured[medium.value]?.[legBox.value];
    const curves = data.predicted[medium.value]?.[legBox.value]?.[profileBox.value];
    const pick = (t) => {
      slider.value = t;
      turn();
    };
    const charts = ["z", "x"].map((c) =>
      drawChart(byId(`viewer-${c}`), `F_${c}`, {
        predicted: { theta, y: predicted[c] },
        measured: measured && { theta: measured.theta_deg, y: measured[`force_${c}_N`] },
        outer: bandOf(curves, theta, c, "model_"),
        band: bandOf(curves, theta, c, ""),
      }, pick),
    );
    const largest = largestElement(profile, leg, theta, data.rate);
    const beside = NINE_TERMS.includes(profileBox.value) ? bestProfile(own) : null;
    state = { profile, leg, charts, measured, beside: beside && [beside, own[beside]], scale: largest > 0 ? ARROW_CM / largest : 0, largest };
    turn();
  }

  function turn() {
    const degrees = Number(slider.value);
    byId("viewer-theta-out").textContent = sayAngle(degrees);
    slider.setAttribute("aria-valuetext", `${degrees} degrees`);
    if (!state) return;
    const elements = elementForces(state.profile, state.leg, (degrees * Math.PI) / 180, data.rate);
    drawScene(byId("viewer-scene"), state.leg, (degrees * Math.PI) / 180, data.rate, elements, state.scale);
    for (const chart of state.charts) chart.cursor(degrees);
    readOut(degrees, netForce(elements, state.leg));
  }

  function readOut(degrees, net) {
    const at = state.measured ? state.measured.theta_deg.indexOf(degrees) : -1;
    const measured = at < 0 ? [null, null] : [state.measured.force_z_N[at], state.measured.force_x_N[at]];
    const rows = [
      ["predicted", say(net[0], 2), say(net[1], 2), say(net[2], 1)],
      ["measured", say(measured[0], 2), say(measured[1], 2), "not recorded"],
    ];
    let limit = "";
    if (state.beside) {
      const [name, profile] = state.beside;
      const by = netForce(elementForces(profile, state.leg, (degrees * Math.PI) / 180, data.rate), state.leg);
      rows.push([`${name} of the same medium`, say(by[0], 2), say(by[1], 2), say(by[2], 1)]);
      limit = ` Nine terms have no interval with the model\u2019s own error: no error of alpha explains a difference from the ${name}.`;
    }
    const why = Number.isFinite(net[0]) ? "" : state.profile.reason || "";
    byId("viewer-readout").replaceChildren(
      tableOf([`θ = ${sayAngle(degrees)}`, [...quantity("F", "z"), ", N"], [...quantity("F", "x"), ", N"], "moment, N cm"], rows),
      html("p", {}, why || `Longest arrow of this turn: ${say(state.largest, 3)} N on one element.${limit}`),
    );
  }

  let playing = 0;
  function stop() {
    cancelAnimationFrame(playing);
    playing = 0;
    play.textContent = "Play";
    play.setAttribute("aria-pressed", "false");
  }
  function step(start, from) {
    playing = requestAnimationFrame((now) => {
      const begun = start ?? now;
      const degrees = Math.round(from + (now - begun) * 0.045);
      slider.value = Math.min(135, degrees);
      turn();
      if (degrees >= 135) stop();
      else step(begun, from);
    });
  }
  play.addEventListener("click", () => {
    if (playing) {
      stop();
      return;
    }
    play.textContent = "Pause";
    play.setAttribute("aria-pressed", "true");
    const from = Number(slider.value);
    step(null, from >= 135 ? -135 : from);
  });

  fillSelect(medium, data.media.map(({ key, title }) => [key, title]));
  fillSelect(legBox, Object.keys(data.legs).map((name) => [name, data.leg_names[name]]));
  for (const box of [medium, legBox, profileBox]) box.addEventListener("change", choose);
  slider.addEventListener("input", turn);
  addEventListener("resize", choose);
  choose();
}
