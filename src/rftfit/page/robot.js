// The robot: speed against stride frequency, and the robot itself, running.

const ROBOT_SCENE = { width: 640, height: 300, cm: 26, top: 8 };
const ROBOT_ARROW_CM = 4;

/** Colours of curvatures: blue for reversed legs, orange-brown for c-legs, dark for strong ones. */
function robotColours(curvatures) {
  const colours = new Map();
  for (const sign of [-1, 1]) {
    const own = curvatures.filter((k) => k * sign > 0).sort((a, b) => (a - b) * sign);
    own.forEach((k, i) => colours.set(k, colourOf(sign * (own.length > 1 ? 0.45 + (0.55 * i) / (own.length - 1) : 0.75), 1)));
  }
  return (k) => colours.get(k) || "var(--ink)";
}

/** Places of body and legs in one pose: x from the centre of mass, cm. */
function robotLines(frames, legPoints, [, z, noseUp, theta]) {
  const pitch = -noseUp; // angles turn from z toward x
  const place = ([x, y]) => [x * Math.cos(pitch) + y * Math.sin(pitch), z + y * Math.cos(pitch) - x * Math.sin(pitch)];
  const plates = frames.plates.map(([x0, z0, x1, z1]) => [place([x0, z0]), place([x1, z1])]);
  const legs = frames.hips.map(([hx, hz, phase]) => {
    const turned = pitch + theta + 2 * Math.PI * phase;
    const [ox, oz] = place([hx, hz]);
    const points = legPoints.map(([x, y]) => [
      ox + x * Math.cos(turned) + y * Math.sin(turned),
      oz + y * Math.cos(turned) - x * Math.sin(turned),
    ]);
    return { points, second: phase > 0 };
  });
  return { plates, legs };
}

/** Draw pose number `at` of a run with the forces on its elements; returns the sums of force x and force z, mN. */
function drawRobot(image, frames, run, at) {
  const { width, height, cm, top } = ROBOT_SCENE;
  const px = (x) => width / 2 + x * (width / cm);
  const py = (z) => (top - z) * (width / cm);
  const pose = run.pose[at];
  image.replaceChildren();
  image.setAttribute("viewBox", `0 0 ${width} ${height}`);
  image.append(svg("rect", { class: "sand", x: 0, y: py(0), width, height: height - py(0) }));
  image.append(svg("line", { class: "surface", x1: 0, x2: width, y1: py(0), y2: py(0) }));
  // marks that stay on the ground, so that the eye sees it pass by
  for (let mark = -2 * cm; mark < 2 * cm; mark += 5) {
    const x = px(mark - (pose[0] % 5));
    image.append(svg("line", { class: "surface", x1: x, x2: x, y1: py(0), y2: py(-0.4) }));
  }
  const { plates, legs } = robotLines(frames, frames.legs[String(run.curvature)], pose);
  for (const ends of plates) image.append(svg("path", { class: "leg", d: pathOf(ends.map(([x, z]) => [px(x), py(z)])) }));
  for (const leg of legs) {
    image.append(svg("path", { class: leg.second ? "leg second" : "leg first", d: pathOf(leg.points.map(([x, z]) => [px(x), py(z)])) }));
  }
  const arrows = run.arrows[at];
  let sums = [0, 0];
  for (let i = 0; i < arrows.length; i += 4) {
    const [x, z, fx, fz] = arrows.slice(i, i + 4);
    sums = [sums[0] + fx, sums[1] + fz];
    const scale = ROBOT_ARROW_CM / run.largest;
    image.append(svg("line", { class: "arrow push", x1: px(x), y1: py(z), x2: px(x + fx * scale), y2: py(z + fz * scale) }));
  }
  image.append(svg("text", { x: 8, y: 16 }, `longest arrow of this stride: ${say(run.largest, 0)} mN`));
  return sums;
}

/** Draw speed against stride frequency by one profile, a curve a curvature, with the measured points. */
function robotChart(image, robot, profile) {
  const [height, left, top, bottom] = [320, 44, 22, 44];
  const width = Math.round(Math.max(300, Math.min(640, image.clientWidth || 520)));
  const right = width - 64;
  const all = [...robot.curves[profile].flatMap((c) => c.v), ...robot.measured.measured_cm_per_s];
  const high = 1.06 * Math.max(1, ...numbersIn(all));
  const low = Math.min(0, ...numbersIn(all));
  const longest = Math.max(1, ...robot.curves[profile].flatMap((c) => c.f), ...numbersIn(robot.measured.frequency_Hz));
  const px = (f) => left + (f / longest) * (right - left);
  const py = (v) => (v === null ? NaN : top + ((high - v) / (high - low)) * (height - top - bottom));
  const colour = robotColours(robot.curves[profile].map((c) => c.curvature));
  image.replaceChildren();
  image.setAttribute("viewBox", `0 0 ${width} ${height}`);
  for (const f of ticksOf(0, longest).ticks) {
    image.append(svg("line", { class: "grid", x1: px(f), x2: px(f), y1: top, y2: height - bottom }));
    image.append(svg("text", { x: px(f), y: height - bottom + 15, "text-anchor": "middle" }, say(f, 0)));
  }
  const { ticks, digits } = ticksOf(low, high);
  for (const v of ticks) {
    image.append(svg("line", { class: "grid", x1: left, x2: right, y1: py(v), y2: py(v) }));
    image.append(svg("text", { x: left - 6, y: py(v) + 4, "text-anchor": "end" }, say(v, digits)));
  }
  const ends = [];
  for (const { curvature, f, v } of robot.curves[profile]) {
    const points = [[0, 0], ...f.map((one, i) => [one, v[i]])].filter(([, y]) => y !== null);
    image.append(svg("path", { fill: "none", "stroke-width": 1.8, stroke: colour(curvature), d: pathOf(points.map(([x, y]) => [px(x), py(y)])) }));
    ends.push([py(points[points.length - 1][1]), curvature]);
  }
  // names at the ends of the lines, none on another
  ends.sort((a, b) => a[0] - b[0]);
  ends.reduce((above, [y, curvature]) => {
    const at = Math.max(y + 4, above + 13);
    image.append(svg("text", { x: right + 6, y: at }, say(curvature, 2)));
    return at;
  }, -Infinity);
  const { curvature_times_R: k, frequency_Hz: f, measured_cm_per_s: v, calibrated } = robot.measured;
  f.forEach((one, i) => {
    if (one === null || v[i] === null) return;
    const fill = calibrated[i] ? "var(--paper)" : colour(k[i]);
    const dot = svg("circle", { cx: px(one), cy: py(v[i]), r: 4, fill, stroke: colour(k[i]), "stroke-width": 1.5 });
    dot.append(svg("title", {}, `R'/r ${say(k[i], 2)}, ${say(one, 2)} Hz: measured ${say(v[i], 1)} cm/s`));
    image.append(dot);
  });
  image.append(svg("text", { x: left, y: 14 }, "speed, cm/s"));
  image.append(svg("text", { x: right + 6, y: 14 }, "R'/r"));
  image.append(svg("text", { x: (left + right) / 2, y: height - 8, "text-anchor": "middle" }, "stride frequency, Hz"));
}

function startRobot(data) {
  const { robot } = data;
  const { frames } = robot;
  const [profile, curvature, frequency, slider, play] =
    ["profile", "curvature", "frequency", "frame", "play"].map((id) => byId(`robot-${id}`));
  for (const run of frames.runs) {
    run.largest = 1;
    for (const arrows of run.arrows) {
      for (let i = 0; i < arrows.length; i += 4) run.largest = Math.max(run.largest, Math.hypot(arrows[i + 2], arrows[i + 3]));
    }
  }
  const chosen = () => frames.runs.find((r) => String(r.curvature) === curvature.value && String(r.frequency_Hz) === frequency.value);

  function show() {
    const run = chosen();
    const at = Math.min(Number(slider.value), run.pose.length - 1);
    slider.max = run.pose.length - 1;
    const time = (at / run.pose.length) * run.stride_s;
    slider.setAttribute("aria-valuetext", `${say(time, 2)} seconds`);
    byId("robot-frame-out").textContent = `${say(time, 2)} s`;
    const [thrust, lift] = drawRobot(byId("robot-scene"), frames, run, at);
    const speed = run.speed_cm_per_s === null ? `no steady speed (${run.outcome})` : `${say(run.speed_cm_per_s, 1)} cm/s`;
    byId("robot-readout").replaceChildren(
      tableOf(["now", "value"], [
        ["mean speed", speed],
        ["lift of the ground, N", say(lift / 1000, 2)],
        ["thrust of the ground, N", say(thrust / 1000, 2)],
        ["height of the centre of mass, cm", say(run.pose[at][1], 2)],
        ["pitch, nose up", sayAngle((run.pose[at][2] * 180) / Math.PI)],
      ]),
      ...(run.warning ? [html("p", { class: "note" }, run.warning)] : []),
    );
  }

  let playing = 0;
  function stop() {
    cancelAnimationFrame(playing);
    playing = 0;
    play.textContent = "Play";
    play.setAttribute("aria-pressed", "false");
  }
  function step(begun) {
    playing = requestAnimationFrame((now) => {
      const start = begun ?? now;
      const run = chosen();
      // a stride takes two seconds, whatever it takes the robot
      slider.value = Math.floor(((now - start) / 2000) * run.pose.length) % run.pose.length;
      show();
      step(start);
    });
  }
  play.addEventListener("click", () => {
    if (playing) {
      stop();
      return;
    }
    play.textContent = "Pause";
    play.setAttribute("aria-pressed", "true");
    step(null);
  });

  const chart = () => robotChart(byId("robot-chart"), robot, profile.value);
  fillSelect(profile, Object.entries(robot.profiles));
  const unique = (values) => [...new Set(values)].map((v) => [String(v), say(v, Number.isInteger(v) ? 0 : 2)]);
  fillSelect(curvature, unique(frames.runs.map((r) => r.curvature)));
  fillSelect(frequency, unique(frames.runs.map((r) => r.frequency_Hz)), "2");
  profile.addEventListener("change", chart);
  for (const box of [curvature, frequency]) box.addEventListener("change", show);
  slider.addEventListener("input", () => {
    if (playing) stop();
    show();
  });
  addEventListener("resize", chart);
  chart();
  show();
}
