"use strict";
// The page's own script: choices, frames, playing. Plotly draws; its licence stands above its code.
(async () => {
  const GREY = "#b9b4a7", WIRE = "#55524a", BLUE = "#0072b2", OBSTACLE = "#7a6a9a", RED = "#b3261e";
  const LOWEST = 1e-12, HIGHEST = 1e6; // errors outside are drawn on the rim, whatever the axis
  const at = (id) => document.getElementById(id);
  const scenes = JSON.parse(at("scenes").textContent);
  const unpacked = new WeakMap();
  let shown = null; // {scene, run, full, reduced, faces, edges, bodies}
  let timer = null, syncing = false;
  let wanted = null, drawing = null; // what is still to be drawn: null, "frame" or "all"; who draws

  async function bytes(text) {
    const raw = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const stream = new Blob([raw]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(stream).arrayBuffer();
  }

  // Corners of packed triangles.
  async function corners(text) {
    const all = new Uint32Array(await bytes(text)), pick = (corner) => all.filter((_, i) => i % 3 === corner);
    return { i: pick(0), j: pick(1), k: pick(2) };
  }

  // Frames of packed positions: three arrays of coordinates each.
  async function positions(packed) {
    if (unpacked.has(packed)) return unpacked.get(packed);
    const changes = new Uint16Array(await bytes(packed.changes));
    const n = packed.vertices, level = new Uint16Array(3 * n), frames = [];
    for (let f = 0; f < packed.frames; f++) {
      const xyz = [new Float32Array(n), new Float32Array(n), new Float32Array(n)];
      for (let i = 0; i < 3 * n; i++) {
        level[i] += changes[3 * n * f + i];
        xyz[i % 3][(i / 3) | 0] = packed.low[i % 3] + packed.step[i % 3] * level[i];
      }
      frames.push(xyz);
    }
    unpacked.set(packed, frames);
    return frames;
  }

  function fill(select, values, words = String) {
    const before = select.value;
    select.replaceChildren(...values.map((value) => new Option(words(value), value)));
    if (values.map(String).includes(before)) select.value = before;
    select.disabled = values.length < 2;
  }

  const distinct = (values) => [...new Set(values)];

  function chosenRun() {
    const scene = scenes[at("scene").value];
    fill(at("group"), distinct(scene.runs.map((run) => run.group)), (g) => g.replaceAll("_", " "));
    const ofGroup = scene.runs.filter((run) => run.group === at("group").value);
    fill(at("method"), distinct(ofGroup.map((run) => run.method)));
    const ofMethod = ofGroup.filter((run) => run.method === at("method").value);
    fill(at("r"), ofMethod.map((run) => run.r));
    return [scene, ofMethod.find((run) => String(run.r) === at("r").value) || null];
  }

  function space(ranges, domain, camera, uirevision) {
    const axis = (range) => ({ range, visible: false });
    const [x, y, z] = ranges.map(axis);
    return { xaxis: x, yaxis: y, zaxis: z, domain, camera, aspectmode: "cube", uirevision };
  }

  const vector = ([x, y, z]) => ({ x, y, z });

  // Plotly's light goes with the camera: from the upper left, near enough to reach faces seen from the front. Ambient
  // and diffuse add up to one: more is cut off, and every face looks the same.
  function surface(name, xyz, faces, scene, look) {
    const [x, y, z] = xyz;
    return { type: "mesh3d", name, x, y, z, ...faces, scene, flatshading: true, hoverinfo: "skip",
      lighting: { ambient: 0.2, diffuse: 0.8, specular: 0, fresnel: 0 },
      lightposition: { x: -1500, y: 1000, z: 0 }, ...look };
  }

  // Edges (a, b, a, b, ...) of a surface, each once.
  function edgesOf({ i, j, k }) {
    const seen = new Set(), edges = [];
    const add = (a, b) => {
      const key = Math.min(a, b) * 2 ** 26 + Math.max(a, b);
      if (!seen.has(key)) edges.push(a, b);
      seen.add(key);
    };
    i.forEach((a, f) => { add(a, j[f]); add(j[f], k[f]); add(k[f], a); });
    return edges;
  }

  // Coordinates of all edges one after the other, with a gap behind each.
  function lines(xyz, edges) {
    return xyz.map((values) => {
      const out = [];
      for (let e = 0; e < edges.length; e += 2) out.push(values[edges[e]], values[edges[e + 1]], null);
      return out;
    });
  }

  function wires(name, [x, y, z]) {
    return { type: "scatter3d", mode: "lines", name, x, y, z, scene: "scene", hoverinfo: "skip", showlegend: false,
      line: { color: WIRE, width: 1 } };
  }

  function distance(a, b) {
    return Float32Array.from(a[0], (v, i) => Math.hypot(v - b[0][i], a[1][i] - b[1][i], a[2][i] - b[2][i]));
  }

  // Whether both runs are in one picture, the full order as wires: two surfaces in one place would flicker.
  const above = () => at("view").value === "above" && shown.reduced;

  // Frame of the page -> what is stored; a run that ended early keeps its last frame.
  const full = (k) => shown.full[k];
  const reduced = (k) => shown.reduced && shown.reduced[Math.min(k, shown.reduced.length - 1)];

  // One thing is drawn at a time; what is asked for meanwhile is drawn afterwards, once.
  function update(what) {
    if (wanted !== "all") wanted = what;
    drawing = drawing || drawWanted().finally(() => { drawing = null; });
    return drawing;
  }

  async function drawWanted() {
    while (wanted) {
      const now = wanted;
      wanted = null;
      if (now === "all") await choose();
      else await showFrame();
    }
  }

  async function choose() {
    const [scene, run] = chosenRun();
    shown = { scene, run, faces: await corners(scene.triangles), full: await positions(scene.full),
      reduced: run && await positions(run.positions), bodies: [] };
    for (const { points, triangles } of scene.bodies) shown.bodies.push([points, await corners(triangles)]);
    shown.edges = edgesOf(shown.faces);
    at("frame").max = shown.full.length - 1;
    at("frame").value = Math.min(at("frame").value, shown.full.length - 1);
    await drawShapes();
    await drawErrors();
    await showFrame();
  }

  async function drawShapes() {
    const k = Number(at("frame").value), beside = shown.reduced && !above();
    const { up, eye } = shown.scene.view, own = { up: vector(up), eye: vector(eye) };
    const old = at("shapes").layout, revision = `camera ${up}`; // scenes with one up share the camera
    const camera = old && old.uirevision === revision ? old.scene.camera : own;
    const traces = [above() ? wires("full order", lines(full(k), shown.edges))
      : surface("full order", full(k), shown.faces, "scene", { color: GREY })];
    if (shown.reduced) {
      const size = Math.max(...shown.scene.ranges.map((range) => range[1] - range[0])) / 1.4;
      // intensity in any case: a surface that once had one keeps it, whatever its colour
      const scale = at("colour").checked ? { colorscale: "Viridis" }
        : { colorscale: [[0, BLUE], [1, BLUE]], showscale: false };
      const colour = { intensity: distance(reduced(k), full(k)), cmin: 0, cmax: 0.1 * size,
        colorbar: { title: { text: "distance, m" }, thickness: 12, len: 0.6 }, ...scale };
      traces.push(surface("reduced", reduced(k), shown.faces, beside ? "scene2" : "scene", colour));
    }
    const sides = beside ? ["scene", "scene2"] : ["scene"];
    for (const side of sides) for (const [points, faces] of shown.bodies) {
      const flatshading = points[0].length < 100; // a ball is round, a box has edges
      traces.push(surface("obstacle", points, faces, side, { color: OBSTACLE, opacity: 0.3, flatshading }));
    }
    const note = (text, x) => ({ text, x, y: 1, xref: "paper", yref: "paper", showarrow: false, font: { size: 14 } });
    const layout = { margin: { l: 0, r: 0, t: 24, b: 0 }, uirevision: revision,
      scene: space(shown.scene.ranges, { x: [0, beside ? 0.48 : 0.95], y: [0, 1] }, camera, revision),
      annotations: beside ? [note("full order", 0.2), note("reduced", 0.7)]
        : [note(shown.reduced ? "full order (wires) and reduced" : "full order", 0.45)] };
    if (beside) layout.scene2 = space(shown.scene.ranges, { x: [0.48, 0.95], y: [0, 1] }, camera, revision);
    await Plotly.react(at("shapes"), traces, layout, { displaylogo: false, responsive: true });
  }

  const time = (frame) => frame * shown.scene.timeStep;
  const clipped = (error) => (error === null ? null : Math.min(Math.max(error, LOWEST), HIGHEST));

  // Decades of the axis: those of the scene's errors and of its floor, for all its runs the same ones.
  function decades(scene) {
    const values = [scene.floor, ...scene.runs.map((run) => run.error)].flat().filter((error) => error > 0).map(clipped);
    if (!values.length) return [-2, 0];
    const least = values.reduce((a, b) => Math.min(a, b)), most = values.reduce((a, b) => Math.max(a, b));
    const low = Math.floor(Math.log10(least)), high = Math.ceil(Math.log10(most));
    return [low, Math.max(high, low + 1)];
  }

  // Largest and last error of a run, in words.
  function told(run) {
    const known = run.error.flatMap((error, f) => (error === null ? [] : [[error, f + 1]]));
    if (!known.length) return "no frame has a relative error";
    const [largest, when] = known.reduce((a, b) => (b[0] > a[0] ? b : a)), [last, end] = known[known.length - 1];
    return `largest ${largest.toPrecision(2)} (frame ${when}), last ${last.toPrecision(2)} (frame ${end})`;
  }

  async function drawErrors() {
    const { scene, run } = shown, [low, high] = decades(scene);
    const series = (values) => ({ x: values.map((_, f) => time(f + 1)), y: values.map(clipped) });
    const traces = [];
    if (scene.floor.length) traces.push({ ...series(scene.floor), name: "sensitivity floor", fill: "tozeroy",
      mode: "lines", line: { color: "#c9c4b8" } });
    if (run) traces.push({ ...series(run.error), name: "relative error", mode: "lines", line: { color: BLUE } });
    traces.push({ x: [0, 0], y: [10 ** low, 10 ** high], name: "now", mode: "lines", line: { color: "#222", width: 1 } });
    const shapes = scene.horizon === null ? [] : [{ type: "line", x0: time(scene.horizon), x1: time(scene.horizon),
      yref: "paper", y0: 0, y1: 1, line: { dash: "dot", color: RED } }];
    await Plotly.react(at("errors"), traces, { margin: { l: 60, r: 10, t: 24, b: 40 }, shapes,
      legend: { orientation: "h", y: -0.18 }, xaxis: { title: { text: "time, s" }, range: [0, time((shown.full.length - 1) * scene.stride)] },
      yaxis: { type: "log", range: [low, high], dtick: Math.max(1, Math.ceil((high - low) / 10)), title: { text: "relative error" }, exponentformat: "power" } },
      { displaylogo: false, responsive: true });
    const ms = (value) => (value === null ? "not timed" : `${value.toPrecision(3)} ms a frame`);
    const parts = [`${scene.title}.`, `Full order: ${ms(scene.ms)}.`];
    if (run) parts.push(`Reduced: ${ms(run.ms)}.`);
    if (run) parts.push(`Relative error: distance of the two runs over the full order's motion (its distance from the start, root mean square over the frames); ${told(run)}.`);
    if (run && run.blowup !== null) parts.push(`The reduced run blew up at frame ${run.blowup}.`);
    parts.push(!scene.floor.length ? "Sensitivity floor and horizon are not known here."
      : scene.horizon === null ? "The floor stays below the threshold: the whole run can be judged."
        : `Beyond frame ${scene.horizon} (dotted line) errors cannot be told from chaos.`);
    at("about").textContent = parts.join(" ");
  }

  async function showFrame() {
    const k = Number(at("frame").value), frame = k * shown.scene.stride;
    const first = above() ? lines(full(k), shown.edges) : full(k);
    const runs = shown.reduced ? [first, reduced(k)] : [first];
    const change = { x: runs.map((r) => r[0]), y: runs.map((r) => r[1]), z: runs.map((r) => r[2]) };
    if (shown.reduced) change.intensity = [undefined, distance(reduced(k), full(k))];
    await Plotly.restyle(at("shapes"), change, runs.map((_, i) => i));
    const line = at("errors").data.length - 1;
    await Plotly.restyle(at("errors"), { x: [[time(frame), time(frame)]] }, [line]);
    at("status").textContent = words(k, frame);
    at("frame").setAttribute("aria-valuetext", `frame ${frame}`);
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    document.body.dataset.frame = k;
  }

  function words(k, frame) {
    const told = [`frame ${frame}, ${time(frame).toFixed(2)} s`];
    const { run } = shown;
    if (run && shown.reduced.length <= k) told.push("the reduced run had ended");
    else if (run && frame > 0 && run.error[frame - 1] != null) told.push(`relative error ${run.error[frame - 1].toPrecision(2)}`);
    if (shown.scene.horizon !== null && frame > shown.scene.horizon) told.push("past the horizon");
    return told.join(", ");
  }

  function stop() {
    clearInterval(timer);
    timer = null;
    at("play").textContent = "Play";
    at("play").setAttribute("aria-pressed", "false");
  }

  function play() {
    if (timer !== null) return stop();
    at("play").textContent = "Pause";
    at("play").setAttribute("aria-pressed", "true");
    const beat = Math.max(40, 1000 * shown.scene.timeStep * shown.scene.stride);
    timer = setInterval(() => {
      if (drawing) return;
      const input = at("frame");
      input.value = input.value === input.max ? 0 : Number(input.value) + 1;
      update("frame");
    }, beat);
  }

  // One camera for both pictures.
  function follow(change) {
    const moved = ["scene", "scene2"].find((name) => change[`${name}.camera`]);
    if (!moved || syncing || !at("shapes").layout.scene2) return;
    syncing = true;
    const other = moved === "scene" ? "scene2" : "scene";
    Plotly.relayout(at("shapes"), { [`${other}.camera`]: change[`${moved}.camera`] }).then(() => { syncing = false; });
  }

  async function changed() {
    stop();
    document.body.dataset.ready = "no";
    await update("all");
    document.body.dataset.ready = "yes";
  }

  fill(at("scene"), scenes.map((_, i) => i), (i) => scenes[i].name.replaceAll("_", " "));
  at("choice").addEventListener("change", changed);
  at("choice").addEventListener("submit", (event) => event.preventDefault());
  at("frame").addEventListener("input", () => update("frame"));
  at("play").addEventListener("click", play);
  await changed();
  at("shapes").on("plotly_relayout", follow);
})();
