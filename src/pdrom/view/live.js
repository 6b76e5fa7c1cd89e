"use strict";
// Script of the page of models: choices, handles, the loop of frames, and texts about them.
(() => {
  const { Drawing, Layer, colour, fill } = pdromDrawing;
  const SPEED = 0.03; // a handle moves at most this part of the scene's size a frame
  const REACH = 26; // CSS pixels from a handle's vertex within which a pointer takes it
  const KEY_STEP = 0.04; // of the scene's size
  const LAG = 0.25; // fraction of the distance to the shape by which the camera moves in a frame
  const SAMPLE = 400; // largest number of vertices by which the camera follows the shape
  const TOLD = 200; // ms between two updates of the numbers
  const MOST_ITERATIONS = 40; // largest choice of a reader, unless the scene has more
  const EARLY = 4; // ms: screens do not keep time exactly
  const FORMAT = 1; // of the data, as in exported.py
  const METHODS = { all: "all elements", elements: "sampled elements (ECSW)", joint: "one shared row for x, y, z" };
  const at = (id) => document.getElementById(id);
  const scenes = JSON.parse(at("scenes").textContent);
  const loaded = new Map(); // scene -> promise of its unpacked file
  const waiting = new Map(); // scene -> function that takes its file when it has arrived
  let shown = null; // {data, frames, bases}: the scene
  let run = null, handles = [], times = [], dragging = false;
  let playing = true, told = 0, due = 0, drawing = null, layers = {}, unknown = "", measured = "";

  window.pdromLive = (content) => waiting.get(content.scene)?.(content);

  function load(index) {
    const { content: inside, file } = scenes[index];
    if (!loaded.has(index)) loaded.set(index, inside ? unpacked(inside) : new Promise((resolve, reject) => {
      waiting.set(scenes[index].scene, resolve);
      const script = document.createElement("script");
      script.src = file;
      script.onerror = () => reject(new Error(`${file} is missing; put it next to this page`));
      // a complete file has made its call already
      script.onload = () => reject(new Error(`${file} is cut, or belongs to another scene`));
      document.head.append(script);
    }).then(unpacked));
    return loaded.get(index);
  }

  async function unpacked({ format, shown: { full, ...rest } = {}, ...others }) {
    if (format !== FORMAT) throw new Error("its data are from another version of pdrom");
    const [data, frames] = await Promise.all([
      pdromPacked.unpacked({ ...others, shown: rest }), pdromPacked.frames(full)]).catch(() => { throw new Error("its data are damaged"); });
    return { data, frames, bases: new Map() };
  }

  function basis(number) {
    if (!shown.bases.has(number)) shown.bases.set(number, new pdromEngine.Basis(shown.data, shown.data.bases[number]));
    return shown.bases.get(number);
  }

  // ---- choices ----

  const distinct = (values) => [...new Set(values)];

  function chosen() {
    const { models } = shown.data;
    fill(at("method"), distinct(models.map((model) => model.family)), (family) => METHODS[family]);
    const ofMethod = models.filter((model) => model.family === at("method").value);
    fill(at("k"), distinct(ofMethod.map((model) => model.k)));
    const ofSize = ofMethod.filter((model) => String(model.k) === at("k").value);
    fill(at("tau"), ofSize.filter((model) => model.tau).map((model) => model.tau), (tau) => String(tau));
    at("tolerance").hidden = at("tau").options.length === 0;
    return ofSize.find((model) => !model.tau || String(model.tau) === at("tau").value);
  }

  // Nothing of a scene is shown while another one is read.
  function leave() {
    [run, handles] = [null, []];
    buttons();
    say("", false);
    for (const id of ["about", "elements", "frame", "ms", "distance"]) at(id).textContent = "";
    drawing.clear();
    drawing.redraw();
  }

  async function scene() {
    document.body.dataset.ready = "no";
    leave();
    const index = Number(at("scene").value);
    const found = await load(index).catch((error) => {
      loaded.delete(index); // the file may exist the next time
      return error;
    });
    if (index !== Number(at("scene").value)) return; // another scene was chosen in the meantime
    if (found instanceof Error) return say(`This scene cannot be shown: ${found.message}.`, true);
    shown = found;
    for (const id of ["wires", "apart"]) at(id).hidden = shown.data.motion === null;
    const { iterations: own, models } = shown.data, sizes = distinct(models.filter((m) => m.tau).map((m) => m.k));
    Object.assign(at("iterations"), { max: Math.max(MOST_ITERATIONS, own), value: own });
    chosen();
    if (sizes.includes(20)) at("k").value = 20;
    chosen();
    if ([...at("tau").options].some((option) => option.value === "0.01")) at("tau").value = 0.01;
    start();
  }

  // ---- a run ----

  function start() {
    const model = chosen(), { data } = shown;
    run = new pdromEngine.Run(data, model, basis(model.basis));
    iterations();
    handles = run.basis.atoms.map((vertices, number) => ({ number, vertices, own: false, held: true, offset: [0, 0, 0],
      wanted: [0, 0, 0], name: nameOf(vertices, number) }));
    times = [];
    measured = "";
    make();
    buttons();
    at("elements").textContent = `${run.elements} of ${all()}`;
    at("drag").hidden = handles.length === 0;
    const parts = [`${data.title}.`, model.family === "joint"
      ? `As in the preprint, ${model.r} modes of the projections are interpolated at ${run.elements} elements, with one shared row for x, y, z.`
      : model.family === "all" ? "All elements are evaluated."
      : "A few weighted elements replace all elements (energy-conserving sampling and weighting, ECSW).", drawing.accelerated
      ? data.motion === null ? "" : "The distance is relative to the mean displacement of the full-order run." : "This browser has no WebGL2: the picture is drawn on the processor, and slower."];
    at("about").textContent = parts.join(" ");
    play(true);
    document.body.dataset.ready = "yes";
  }

  const all = () => Object.values(shown.data.groups).reduce((total, group) => total + group.elements, 0);

  function nameOf(vertices, number) {
    const hold = shown.data.holds.find((each) => each.vertices.includes(vertices[0]));
    return hold ? hold.name : `number ${number + 1}`;
  }

  function iterations() {
    const count = Number(at("iterations").value);
    at("iterationsShown").textContent = count;
    run.iterations = count;
  }

  // Atom -> offset in the coming frame, as prescribed by the scene and by the reader.
  function held() {
    const scheduled = run.scheduled(run.frame), result = new Map();
    for (const handle of handles) {
      if (!handle.own) handle.held = scheduled.has(handle.number);
      if (!handle.held) continue;
      follow(handle);
      result.set(handle.number, handle.offset);
    }
    return result;
  }

  // A handle moves towards its target at a bounded speed.
  function follow(handle) {
    const most = SPEED * drawing.camera.radius, way = handle.wanted.map((x, i) => x - handle.offset[i]);
    const length = Math.hypot(...way), part = length > most ? most / length : 1;
    handle.offset = handle.offset.map((x, i) => x + part * way[i]);
  }

  function frame() {
    const where = held(), before = performance.now();
    run.step(where);
    times.push(performance.now() - before);
    if (times.length > 60) times.shift();
    if (!run.finite) play(false);
  }

  const mine = () => handles.some((handle) => handle.own);

  // Positions of some vertices.
  function sampled() {
    const { vertices } = shown.data.shown, every = Math.ceil(vertices.length / SAMPLE);
    if (!run.sample) run.sample = vertices.filter((_, i) => i % every === 0);
    return run.basis.lift(run.z, run.sample, new Float64Array(3 * run.sample.length));
  }

  // ---- pictures ----

  // Layers of a run: its surface, the full-order run as wires, the handles, the floor.
  function make() {
    const { data } = shown, { vertices, triangles } = data.shown, K = run.K, n = vertices.length;
    const B = new Float32Array(n * K);
    vertices.forEach((v, i) => B.set(run.basis.B.subarray(K * v, K * (v + 1)), K * i));
    if (shown !== make.of) drawing.camera.reset();
    make.of = shown;
    dragging = false;
    drawing.clear();
    drawing.camera.look(...drawing.fit(sampled()));
    layers = { body: new Layer({ triangles, n, colour: colour("--surface") }),
      ghost: new Layer({ triangles, n, look: "wires", colour: colour("--ghost"), alpha: 0.45 }) };
    layers.body.lifted(B, K, (out) => run.basis.lift(run.z, vertices, out));
    run.held = Uint32Array.from(handles.flatMap((handle) => handle.vertices));
    layers.handles = new Layer({ n: run.held.length, look: "points", points: run.held.map((_, i) => i),
      colour: colour("--handle") });
    for (const height of data.floors) layers.floor = floor(height);
    Object.values(layers).forEach((layer) => drawing.add(layer));
    show();
  }

  function floor(height) {
    const { centre: [x, , z], radius } = drawing.camera, r = 2 * radius;
    const layer = new Layer({ triangles: Uint32Array.of(0, 1, 2, 0, 2, 3), n: 4, colour: colour("--floor"), alpha: 0.3 });
    layer.set(Float32Array.of(x - r, height, z - r, x + r, height, z - r, x + r, height, z + r, x - r, height, z + r));
    return layer;
  }

  // The camera follows the shape and keeps all of it in view, but stays still while a reader drags a handle.
  function followShape() {
    if (dragging || !run.finite) return;
    const { camera } = drawing, [centre, radius] = drawing.fit(sampled());
    camera.look(camera.centre.map((x, i) => x + LAG * (centre[i] - x)), camera.radius + LAG * Math.max(0, radius - camera.radius));
  }

  function show() {
    layers.body.move(Float32Array.from(run.z));
    followShape();
    layers.handles.set(run.basis.lift(run.z, run.held, new Float32Array(3 * run.held.length)));
    const recorded = recordedAt(run.frame);
    layers.ghost.visible = at("ghost").checked && recorded !== null;
    if (recorded) layers.ghost.set(recorded);
    drawing.redraw();
  }

  // Positions of the full-order run at a frame, interpolated between stored frames; null after its end.
  function recordedAt(frame) {
    const { frames, data: { motion, shown: { stride } } } = shown, place = frame / stride;
    return motion === null || place > frames.length - 1 ? null : pdromPacked.between(frames, place);
  }

  // ---- words ----

  function say(text, bad) {
    at("verdict").classList.toggle("bad", bad);
    if (at("verdict").textContent !== text) at("verdict").textContent = text;
  }

  function percent(x) {
    if (!Number.isFinite(x)) return "no number";
    return `${100 * x < 100 ? (100 * x).toPrecision(2) : Math.round(100 * x)} %`;
  }

  function tell() {
    say(run.finite ? unknown : "The simulation blew up: its numbers are not finite. Start again.", !run.finite || unknown !== "");
    const { data } = shown, sorted = [...times].sort((a, b) => a - b), recorded = recordedAt(run.frame);
    at("frame").textContent = `${run.frame}, ${(run.frame * data.timeStep).toFixed(2)} s`;
    at("ms").textContent = sorted.length ? `${sorted[sorted.length >> 1].toFixed(2)} ms` : "";
    if (recorded && !mine() && run.frame % data.shown.stride === 0) measured = percent(difference(recorded));
    at("distance").textContent = mine() ? "unknown: you moved a handle" : recorded ? measured : "unknown: the full-order run has ended";
    document.body.dataset.frame = run.frame;
    at("handles").querySelectorAll("button.hold").forEach((button, i) => {
      const { held: on, name } = handles[i], text = on ? `Let go of ${name}` : `Hold ${name}`;
      button.classList.toggle("on", on);
      if (button.textContent !== text) button.textContent = text;
    });
  }

  // Distance of the surface from that of the full-order run, over its mean displacement, as in the study's tables.
  function difference(recorded) {
    const { vertices } = shown.data.shown, q = run.basis.lift(run.z, vertices, new Float64Array(3 * vertices.length));
    let square = 0;
    for (let i = 0; i < q.length; i++) square += (q[i] - recorded[i]) ** 2;
    return Math.sqrt(square * shown.data.masses.length / vertices.length) / shown.data.motion;
  }

  // ---- handles ----

  function take(handle) {
    const before = handle.held && run.taken.has(handle.number);
    handle.own = true;
    handle.held = true;
    if (!before) Object.assign(handle, { offset: [0, 0, 0], wanted: [0, 0, 0] });
  }

  function grab(x, y, looking) {
    if (!run) return null;
    const q = layers.handles.positions;
    let best = REACH, found = -1;
    run.held.forEach((_, i) => {
      const [u, v] = drawing.seen([q[3 * i], q[3 * i + 1], q[3 * i + 2]]), away = Math.hypot(u - x, v - y);
      if (away < best) [best, found] = [away, i];
    });
    if (found < 0) return null;
    const handle = handles.find((each) => each.vertices.includes(run.held[found]));
    if (looking) return handle;
    take(handle);
    dragging = true;
    play(true);
    const point = [...q.slice(3 * found, 3 * found + 3)];
    return {
      move: (right, down) => { handle.wanted = drawing.moved(right, down, point).map((d, i) => d + handle.wanted[i]); },
      end: () => { dragging = false; },
    };
  }

  function push(handle, event) {
    const [x, y, z] = drawing.camera.axes(), step = KEY_STEP * drawing.camera.radius;
    const ways = { ArrowLeft: [x, -1], ArrowRight: [x, 1], ArrowUp: [y, 1], ArrowDown: [y, -1], PageUp: [z, -1], PageDown: [z, 1] };
    if (!ways[event.key]) return;
    event.preventDefault();
    take(handle);
    play(true);
    const [way, sign] = ways[event.key];
    handle.wanted = handle.wanted.map((w, i) => w + sign * step * way[i]);
  }

  function buttons() {
    at("handles").replaceChildren(...handles.flatMap((handle) => {
      const mover = document.createElement("button"), holder = document.createElement("button");
      mover.type = holder.type = "button";
      mover.textContent = `Handle ${handle.name}`;
      mover.setAttribute("aria-label", `Handle ${handle.name}: arrow keys move it, page up and page down away and towards you`);
      mover.addEventListener("keydown", (event) => push(handle, event));
      holder.className = "hold";
      holder.addEventListener("click", () => {
        if (handle.held) Object.assign(handle, { own: true, held: false });
        else take(handle);
        play(true);
        tell();
      });
      return [mover, holder];
    }));
  }

  // ---- the loop ----

  function play(on) {
    playing = on && run.finite;
    at("play").textContent = playing ? "Pause" : "Play";
  }

  // A frame is shown for its time step, also on faster screens; on slower screens the run takes longer.
  function beat(now) {
    requestAnimationFrame(beat);
    if (!run) return;
    if (playing && now >= due - EARLY) {
      due = Math.max(due + 1000 * shown.data.timeStep, now);
      frame();
      show();
    }
    if (now - told > TOLD) {
      told = now;
      tell();
    }
  }

  drawing = new Drawing(at("picture"), { grab, plain: location.hash === "#plain", ...scenes[0]?.view });
  fill(at("scene"), scenes.map((_, i) => i), (i) => scenes[i].words ?? scenes[i].scene.replaceAll("_", " "));
  at("choice").addEventListener("submit", (event) => event.preventDefault());
  at("scene").addEventListener("change", () => {
    unknown = "";
    scene();
  });
  addEventListener("unhandledrejection", ({ reason }) => say(`This scene cannot be shown: ${reason.message}.`, true));
  const whileRunning = (id, event, action) => at(id).addEventListener(event, () => run && action());
  for (const id of ["method", "k", "tau"]) whileRunning(id, "change", start);
  whileRunning("ghost", "change", show);
  whileRunning("iterations", "input", iterations);
  whileRunning("again", "click", start);
  whileRunning("play", "click", () => play(!playing));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => run && make());
  const names = scenes.map(({ scene: name }) => name), asked = [...new URLSearchParams(location.search).keys()];
  const named = names.findIndex((name) => asked.includes(name));
  const foreign = [...asked, location.hash].filter((word) => !["", "#plain", ...names].includes(word));
  if (scenes.length === 0) say("There is nothing to show: the configuration lists no scene with models.", true);
  else {
    at("scene").value = Math.max(named, 0);
    if (foreign.length) unknown = `This page has no ${foreign.join(", ")}: it shows ${names[Math.max(named, 0)]}.`;
    scene().then(() => requestAnimationFrame(beat));
  }
})();
