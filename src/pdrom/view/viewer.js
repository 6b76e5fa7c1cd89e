"use strict";
// Script of the page of runs: choices, frames, playing, the chart of errors.
(async () => {
  const { Drawing, Layer, colour, fill } = pdromDrawing;
  const LOWEST = 1e-12, HIGHEST = 1e6; // errors outside are drawn on the rim of the chart
  const WIDTH = 400, HEIGHT = 360, LEFT = 52, RIGHT = 8, TOP = 24, BOTTOM = 64; // of the chart, in its own units
  const CUBE = 0.5; // of the shown cube's side: radius of the ball that the camera sees
  const at = (id) => document.getElementById(id);
  const scenes = JSON.parse(at("scenes").textContent);
  const unpacked = new WeakMap();
  let shown = null; // {scene, run, full, reduced, triangles, bodies}
  let drawing = null, layers = {}, chart = {}, up = "", playing = null;

  async function once(packed, read) {
    if (!unpacked.has(packed)) unpacked.set(packed, await read(packed));
    return unpacked.get(packed);
  }

  const positions = (packed) => once(packed, pdromPacked.frames);
  const corners = (data) => pdromPacked.unpack({ kind: "u4", data });

  function chosenRun() {
    const scene = scenes[at("scene").value];
    fill(at("run"), scene.runs.map((_, i) => i), (i) => scene.runs[i].title);
    return [scene, scene.runs[at("run").value] || null];
  }

  // Whether both runs are in one picture, the full-order run as wires: two surfaces in one place would flicker.
  const above = () => at("view").value === "above" && shown.reduced;

  async function choose() {
    const [scene, run] = chosenRun(), bodies = [];
    for (const body of scene.bodies) {
      const [x, y, z] = body.points;
      bodies.push({ q: Float32Array.from(x.flatMap((v, i) => [v, y[i], z[i]])), triangles: await corners(body.triangles) });
    }
    shown = { scene, run, bodies, triangles: await corners(scene.triangles), full: await positions(scene.full),
      reduced: run && await positions(run.positions) };
    at("frame").max = shown.full.length - 1;
    at("frame").value = Math.min(at("frame").value, shown.full.length - 1);
    makeLayers();
    drawErrors();
    tell();
    show(Number(at("frame").value));
  }

  const side = () => Math.max(...shown.scene.ranges.map(([low, high]) => high - low));

  function makeLayers() {
    const { scene, triangles } = shown, n = scene.full.vertices, beside = shown.reduced && !above();
    drawing ??= new Drawing(at("shapes"), { ...scene.view, plain: location.hash === "#plain" });
    if (up !== String(scene.view.up)) drawing.from(scene.view); // scenes with one up share the camera
    up = String(scene.view.up);
    drawing.clear();
    drawing.views = beside ? 2 : 1;
    drawing.camera.look(scene.ranges.map(([low, high]) => 0.5 * (low + high)), CUBE * side());
    layers = { full: drawing.add(new Layer({ triangles, n, look: above() ? "wires" : "surface",
      colour: colour(above() ? "--ghost" : "--surface") })) };
    if (shown.reduced) layers.reduced = drawing.add(new Layer({ triangles, n, view: beside ? 1 : 0, colour: colour("--reduced") }));
    for (let view = 0; view < drawing.views; view++) for (const { q, triangles: faces } of shown.bodies) {
      const body = new Layer({ triangles: faces, n: q.length / 3, view, alpha: 0.3, colour: colour("--obstacle") });
      body.set(q);
      drawing.add(body);
    }
    at("left").textContent = above() ? `${scene.method} (wires) and reduced` : scene.method;
    at("right").textContent = beside ? "reduced" : "";
    at("legend").hidden = !(shown.reduced && at("colour").checked);
    at("largest").textContent = `${(0.1 * side() / 1.4).toPrecision(2)} and more`;
  }

  // Draws frame k of the stored frames; k may lie between two of them.
  function show(k) {
    const full = pdromPacked.between(shown.full, k);
    layers.full.set(full);
    if (shown.reduced) {
      const reduced = pdromPacked.between(shown.reduced, k);
      layers.reduced.set(reduced);
      layers.reduced.shade(at("colour").checked ? distances(reduced, full, 0.1 * side() / 1.4) : null);
    }
    drawing.draw();
    const place = x(k * shown.scene.stride);
    chart.now.setAttribute("x1", place);
    chart.now.setAttribute("x2", place);
    const stored = Math.floor(k + 1e-9), frame = stored * shown.scene.stride;
    at("status").textContent = words(stored, frame);
    at("frame").setAttribute("aria-valuetext", `frame ${frame}`);
    document.body.dataset.frame = stored;
  }

  // Distances of vertices, relative to the largest distance.
  function distances(a, b, most) {
    const values = new Float32Array(a.length / 3);
    for (let i = 0, v = 0; v < values.length; v++, i += 3) {
      values[v] = Math.min(Math.hypot(a[i] - b[i], a[i + 1] - b[i + 1], a[i + 2] - b[i + 2]) / most, 1);
    }
    return values;
  }

  // ---- errors ----

  const time = (frame) => frame * shown.scene.timeStep;
  const clipped = (error) => (error === null ? null : Math.min(Math.max(error, LOWEST), HIGHEST));
  const x = (frame) => LEFT + (WIDTH - LEFT - RIGHT) * frame / Math.max(1, (shown.full.length - 1) * shown.scene.stride);
  const y = (error, [low, high]) => TOP + (HEIGHT - TOP - BOTTOM) * (high - Math.log10(error)) / (high - low);

  // Decades of the error axis, the same for all runs of the scene.
  function decades(scene) {
    const values = scene.runs.flatMap((run) => run.error).filter((error) => error > 0).map(clipped);
    if (!values.length) return [-2, 0];
    const least = values.reduce((a, b) => Math.min(a, b)), most = values.reduce((a, b) => Math.max(a, b));
    const low = Math.floor(Math.log10(least)), high = Math.ceil(Math.log10(most));
    return [low, Math.max(high, low + 1)];
  }

  function element(name, attributes, text = "") {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.textContent = text;
    return made;
  }

  function word(left, down, text, anchor = "middle") {
    return element("text", { x: left, y: down, "text-anchor": anchor }, text);
  }

  // Path through the known errors, with gaps where the error is unknown.
  function path(values, range) {
    let pen = "M";
    return values.map((error, f) => {
      if (!(error > 0)) {
        pen = "M";
        return "";
      }
      const step = `${pen}${x(f + 1).toFixed(1)} ${y(clipped(error), range).toFixed(1)}`;
      pen = "L";
      return step;
    }).join("");
  }

  function drawErrors() {
    const { scene, run } = shown, range = decades(scene), [low, high] = range, bottom = HEIGHT - BOTTOM, parts = [];
    at("errors").setAttribute("viewBox", `0 0 ${WIDTH} ${HEIGHT}`);
    const every = Math.max(1, Math.ceil((high - low) / 10));
    for (let decade = low; decade <= high; decade += every) {
      const place = y(10 ** decade, range);
      parts.push(element("line", { class: "grid", x1: LEFT, x2: WIDTH - RIGHT, y1: place, y2: place }));
      parts.push(word(LEFT - 5, place + 4, `1e${decade}`, "end"));
    }
    const last = (shown.full.length - 1) * scene.stride;
    for (let i = 0; i <= 4; i++) {
      parts.push(word(x(i * last / 4), bottom + 16, time(i * last / 4).toPrecision(2), i < 4 ? "middle" : "end"));
    }
    if (run) parts.push(element("path", { class: "error", d: path(run.error, range) }));
    chart.now = element("line", { class: "now", x1: LEFT, x2: LEFT, y1: TOP, y2: bottom });
    parts.push(chart.now, word((LEFT + WIDTH) / 2, bottom + 34, "time, s"), word(4, 14, "relative error", "start"));
    at("errors").replaceChildren(...parts);
    at("errors").dataset.decades = range.join(" ");
  }

  // ---- words ----

  // Largest and last error of a run.
  function told(run) {
    const known = run.error.flatMap((error, f) => (error === null ? [] : [[error, f + 1]]));
    if (!known.length) return "No frame has a relative error";
    const [largest, when] = known.reduce((a, b) => (b[0] > a[0] ? b : a)), [last, end] = known[known.length - 1];
    return `Largest error ${largest.toPrecision(2)} (frame ${when}); last error ${last.toPrecision(2)} (frame ${end})`;
  }

  function tell() {
    const { scene, run } = shown, ms = (value) => (value === null ? "not timed" : `${value.toPrecision(3)} ms a frame`);
    const parts = [`${scene.title}.`, `${scene.method[0].toUpperCase()}${scene.method.slice(1)}: ${ms(scene.ms)}.`];
    if (run) parts.push(`Reduced: ${ms(run.ms)}.`);
    if (run) parts.push(`Relative error: distance between the two runs, divided by the full-order displacement (root mean square over all frames). ${told(run)}.`);
    if (run && run.blowup !== null) parts.push(`The reduced run blew up at frame ${run.blowup}.`);
    if (!drawing.accelerated) parts.push("This browser has no WebGL2: pictures are drawn on the processor, and slower.");
    at("about").textContent = parts.join(" ");
  }

  function words(k, frame) {
    const parts = [`frame ${frame}, ${time(frame).toFixed(2)} s`], { run } = shown;
    if (run && shown.reduced.length <= k) parts.push("the reduced run had ended");
    else if (run && frame > 0 && run.error[frame - 1] != null) parts.push(`relative error ${run.error[frame - 1].toPrecision(2)}`);
    return parts.join(", ");
  }

  // ---- playing: in the time of the scene ----

  function stop() {
    playing = null;
    at("play").textContent = "Play";
    at("play").setAttribute("aria-pressed", "false");
  }

  function play() {
    if (playing) return stop();
    at("play").textContent = "Pause";
    at("play").setAttribute("aria-pressed", "true");
    playing = { from: Number(at("frame").value), since: performance.now() };
    requestAnimationFrame(beat);
  }

  function beat(now) {
    if (!playing) return;
    const last = shown.full.length - 1, seconds = Math.max(0, now - playing.since) / 1000;
    const k = (playing.from + seconds / (shown.scene.timeStep * shown.scene.stride)) % (last + 1);
    at("frame").value = Math.floor(k);
    show(Math.min(k, last));
    requestAnimationFrame(beat);
  }

  async function changed() {
    stop();
    document.body.dataset.ready = "no";
    await choose();
    document.body.dataset.ready = "yes";
  }

  fill(at("scene"), scenes.map((_, i) => i), (i) => scenes[i].name.replaceAll("_", " "));
  at("choice").addEventListener("change", changed);
  at("choice").addEventListener("submit", (event) => event.preventDefault());
  at("frame").addEventListener("input", () => {
    stop();
    show(Number(at("frame").value));
  });
  at("play").addEventListener("click", play);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", changed);
  await changed();
  at("state").remove();
})();
