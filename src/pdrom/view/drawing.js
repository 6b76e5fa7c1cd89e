"use strict";
// Draws moving surfaces by WebGL2, or without it by lines and triangles of the canvas. A layer has
// positions (n, 3), or a basis (n, K) that maps coordinates (K, 3) to positions, on the graphics card if there is one.
const pdromDrawing = (() => {
  const WIDTH = 2048; // of a texture that holds a basis
  const MOST = 200; // coordinates that are lifted on the graphics card; more are lifted here
  const FOCUS = 4, NEAREST = 0.25, FARTHEST = 6; // cotangent of half the angle of view; distances over the radius
  const FILLED = 0.88; // part of the picture that a fitted shape takes

  // Viridis, by a polynomial of six degrees for each colour (Zucker's fit; errors below 0.01).
  const VIRIDIS = [
    [0.2777273, 0.0054073, 0.3340998], [0.1050930, 1.4046135, 1.3845902], [-0.3308618, 0.2148476, 0.0950952],
    [-4.6342305, -5.7991010, -19.3324410], [6.2282699, 14.1799334, 56.6905526], [4.7763850, -13.7451454, -65.3530326],
    [-5.4354559, 4.6458526, 26.3124352]];

  function viridis(t) {
    const x = Math.min(Math.max(t, 0), 1);
    return [0, 1, 2].map((c) => VIRIDIS.reduceRight((total, row) => total * x + row[c], 0));
  }

  const VERTEX = (lifted) => `#version 300 es
    precision highp float; precision highp int; precision highp sampler2D;
    uniform mat4 toClip; uniform float size;
    ${lifted ? `uniform sampler2D basis; uniform int texels; uniform vec3 z[${MOST}];` : "in vec3 position;"}
    in float value; out vec3 at; out float shade;
    void main() {
      ${lifted ? `vec3 q = vec3(0.0);
      for (int t = 0; t < texels; t++) {
        int i = gl_VertexID * texels + t;
        vec4 b = texelFetch(basis, ivec2(i % ${WIDTH}, i / ${WIDTH}), 0);
        q += b.x * z[4 * t] + b.y * z[4 * t + 1] + b.z * z[4 * t + 2] + b.w * z[4 * t + 3];
      }` : "vec3 q = position;"}
      at = q; shade = value; gl_Position = toClip * vec4(q, 1.0); gl_PointSize = size;
    }`;

  const FRAGMENT = `#version 300 es
    precision highp float;
    uniform vec3 colour; uniform float alpha; uniform int look; uniform vec3 towards; uniform vec3 scale[7];
    in vec3 at; in float shade; out vec4 result;
    void main() {
      vec3 own = colour;
      if (look == 2) { if (length(gl_PointCoord - 0.5) > 0.5) discard; }
      if (shade >= 0.0) { own = scale[6]; for (int i = 5; i >= 0; i--) own = own * min(shade, 1.0) + scale[i]; }
      if (look == 0) own *= 0.35 + 0.65 * abs(dot(normalize(cross(dFdx(at), dFdy(at))), towards));
      result = vec4(own * alpha, alpha);
    }`;

  const LOOKS = { surface: 0, wires: 1, points: 2 };
  const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => a.map((x) => x / Math.hypot(...a));

  // Every edge of triangles once: a, b, a, b, ...
  function edgesOf(triangles) {
    const seen = new Set(), edges = [];
    for (let i = 0; i < triangles.length; i++) {
      const a = triangles[i], b = triangles[i % 3 === 2 ? i - 2 : i + 1], key = Math.min(a, b) * 2 ** 26 + Math.max(a, b);
      if (!seen.has(key)) edges.push(a, b);
      seen.add(key);
    }
    return Uint32Array.from(edges);
  }

  class Layer {
    // look: "surface", "wires" or "points"; indices: triangles, or vertices of points; view: number of the picture
    constructor({ triangles, n, look = "surface", points = null, view = 0, alpha = 1, colour = [0.5, 0.5, 0.5] }) {
      this.indices = points ? Uint32Array.from(points) : look === "wires" ? edgesOf(triangles) : triangles;
      Object.assign(this, { n, look, view, alpha, colour, visible: true, basis: null, size: 6, version: 0, valued: 0 });
      this.positions = new Float32Array(3 * n);
      this.values = null;
    }

    set(positions) {
      this.positions = positions;
      this.version++;
    }

    // Values (n,) from 0 to 1 in place of the colour; null for none.
    shade(values) {
      this.values = values;
      this.valued++;
    }

    // B: Float32Array (n, K), for the graphics card; lift writes the positions (n, 3) where that does not
    lifted(B, K, lift) {
      this.basis = { B, K };
      this.lift = lift;
    }

    move(z) {
      this.z = z;
      this.stale = true;
      this.version++;
    }

    // Positions (n, 3), computed from the coordinates unless that was done before.
    get current() {
      if (this.basis && this.stale) this.lift(this.positions);
      this.stale = false;
      return this.positions;
    }
  }

  const focuses = (shape) => (shape < 1 ? [FOCUS, FOCUS * shape] : [FOCUS / shape, FOCUS]);

  class Camera {
    constructor(up, eye) {
      this.up = unit(up);
      this.eye = unit(eye);
      this.far = 1;
      this.home = this.eye;
    }

    // Centre and radius, m, of a ball that the picture shows completely.
    look(centre, radius) {
      Object.assign(this, { centre, radius });
    }

    reset() {
      this.eye = this.home;
      this.far = 1;
    }

    turn(right, down) {
      const about = (v, axis, angle) => {
        const c = Math.cos(angle), s = Math.sin(angle), along = dot(v, axis) * (1 - c), turned = cross(axis, v);
        return v.map((x, i) => c * x + s * turned[i] + along * axis[i]);
      };
      const eye = about(this.eye, this.up, -right), tilted = about(eye, this.axes(eye)[0], -down);
      this.eye = Math.abs(dot(tilted, this.up)) < 0.985 ? tilted : eye;
    }

    zoom(factor) {
      this.far = Math.min(Math.max(this.far * factor, NEAREST), FARTHEST);
    }

    // Directions to the right, up and towards the eye.
    axes(eye = this.eye) {
      const right = unit(cross(this.up, eye));
      return [right, cross(eye, right), eye];
    }

    // Direction to the light, from above and left of the eye.
    get light() {
      const [x, y, z] = this.axes();
      return unit(z.map((v, i) => v + 0.5 * y[i] - 0.45 * x[i]));
    }

    get distance() {
      return this.far * this.radius * Math.hypot(1, FOCUS);
    }

    // Matrix to clip coordinates by columns, for a picture of this shape (width over height).
    matrix(shape) {
      const [x, y, z] = this.axes(), d = this.distance, near = 0.05 * d, end = d + 6 * this.radius;
      const focus = focuses(shape);
      const rows = [[...x.map((v) => focus[0] * v), -focus[0] * dot(x, this.centre)],
        [...y.map((v) => focus[1] * v), -focus[1] * dot(y, this.centre)],
        [...z, -dot(z, this.centre) - d]];
      const a = (end + near) / (near - end), b = 2 * end * near / (near - end);
      const all = [rows[0], rows[1], rows[2].map((v, i) => a * v + (i === 3 ? b : 0)), rows[2].map((v) => -v)];
      return Float32Array.from({ length: 16 }, (_, i) => all[i % 4][Math.floor(i / 4)]);
    }
  }

  function applied(m, x, y, z) {
    const w = m[3] * x + m[7] * y + m[11] * z + m[15];
    return [(m[0] * x + m[4] * y + m[8] * z + m[12]) / w, (m[1] * x + m[5] * y + m[9] * z + m[13]) / w, w];
  }

  // ---- WebGL2 ----

  class Card {
    constructor(gl) {
      this.gl = gl;
      this.programs = [false, true].map((lifted) => this._program(VERTEX(lifted)));
      this.buffers = new WeakMap(); // the card frees the buffers of removed layers
      this.scale = Float32Array.from(VIRIDIS.flat());
    }

    _program(vertex) {
      const { gl } = this, program = gl.createProgram();
      for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
        const shader = gl.createShader(kind);
        gl.shaderSource(shader, text);
        gl.compileShader(shader);
        gl.attachShader(program, shader);
      }
      gl.bindAttribLocation(program, 0, "value");
      gl.bindAttribLocation(program, 1, "position");
      gl.linkProgram(program);
      if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
      return program;
    }

    _own(layer) {
      const { gl } = this;
      if (!this.buffers.has(layer)) {
        const own = { indices: gl.createBuffer(), positions: gl.createBuffer(), values: gl.createBuffer(), version: -1,
          valued: -1 };
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, own.indices);
        gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, layer.indices, gl.STATIC_DRAW);
        if (layer.basis?.K <= MOST) own.basis = this._texture(layer);
        this.buffers.set(layer, own);
      }
      return this.buffers.get(layer);
    }

    _texture({ basis: { B, K }, n }) {
      const { gl } = this, texels = Math.ceil(K / 4), rows = Math.ceil(n * texels / WIDTH);
      const data = new Float32Array(4 * WIDTH * rows), texture = gl.createTexture();
      for (let v = 0; v < n; v++) data.set(B.subarray(K * v, K * (v + 1)), 4 * texels * v);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, WIDTH, rows, 0, gl.RGBA, gl.FLOAT, data);
      for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
        gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
      }
      return { texture, texels };
    }

    draw(layers, views, camera) {
      const { gl } = this, { width, height } = gl.canvas;
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.enable(gl.DEPTH_TEST);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      gl.enable(gl.POLYGON_OFFSET_FILL);
      gl.polygonOffset(1, 1);
      for (let view = 0; view < views; view++) {
        const left = Math.round(view * width / views), right = Math.round((view + 1) * width / views);
        gl.viewport(left, 0, right - left, height);
        const toClip = camera.matrix((right - left) / height);
        for (const layer of layers) if (layer.visible && layer.view === view) this._layer(layer, toClip, camera);
      }
    }

    _layer(layer, toClip, camera) {
      const { gl } = this, own = this._own(layer), program = this.programs[own.basis ? 1 : 0];
      const at = (name) => gl.getUniformLocation(program, name);
      gl.useProgram(program);
      gl.uniformMatrix4fv(at("toClip"), false, toClip);
      gl.uniform3fv(at("colour"), layer.colour);
      gl.uniform1f(at("alpha"), layer.alpha);
      gl.uniform1f(at("size"), layer.size * (window.devicePixelRatio || 1));
      gl.uniform1i(at("look"), LOOKS[layer.look]);
      gl.uniform3fv(at("towards"), camera.light);
      gl.uniform3fv(at("scale"), this.scale);
      if (own.basis) {
        gl.bindTexture(gl.TEXTURE_2D, own.basis.texture);
        gl.uniform1i(at("texels"), own.basis.texels);
        gl.uniform3fv(at("z"), layer.z);
      } else this._attribute(1, own.positions, layer.current, 3, own.version !== layer.version);
      own.version = layer.version;
      if (layer.values) this._attribute(0, own.values, layer.values, 1, own.valued !== layer.valued);
      else {
        gl.disableVertexAttribArray(0);
        gl.vertexAttrib1f(0, -1);
      }
      own.valued = layer.valued;
      gl.depthMask(layer.alpha === 1);
      gl.depthFunc(layer.look === "wires" && layer.alpha < 1 ? gl.ALWAYS : gl.LESS); // visible through surfaces in front of them
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, own.indices);
      const mode = { surface: gl.TRIANGLES, wires: gl.LINES, points: gl.POINTS }[layer.look];
      gl.drawElements(mode, layer.indices.length, gl.UNSIGNED_INT, 0);
      gl.depthMask(true);
      gl.disableVertexAttribArray(1);
    }

    _attribute(place, buffer, data, size, changed) {
      const { gl } = this;
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      if (changed) gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 0, 0);
    }
  }

  // ---- without WebGL2: the farthest triangle first ----

  class Plain {
    constructor(context) {
      this.context = context;
    }

    draw(layers, views, camera) {
      const { context } = this, { width, height } = context.canvas;
      context.clearRect(0, 0, width, height);
      for (let view = 0; view < views; view++) {
        const left = view * width / views, wide = width / views;
        context.save();
        context.beginPath();
        context.rect(left, 0, wide, height);
        context.clip();
        const toClip = camera.matrix(wide / height);
        for (const layer of layers) if (layer.visible && layer.view === view) {
          const q = layer.current, seen = new Float32Array(3 * layer.n);
          for (let v = 0; v < layer.n; v++) {
            const [x, y, w] = applied(toClip, q[3 * v], q[3 * v + 1], q[3 * v + 2]);
            seen[3 * v] = left + 0.5 * (x + 1) * wide;
            seen[3 * v + 1] = 0.5 * (1 - y) * height;
            seen[3 * v + 2] = w;
          }
          context.globalAlpha = layer.alpha;
          this[`_${layer.look}`](layer, seen, camera);
        }
        context.restore();
      }
    }

    _surface(layer, seen, camera) {
      const { context } = this, t = layer.indices, count = t.length / 3, q = layer.current;
      const towards = camera.light;
      const depth = (f) => seen[3 * t[3 * f] + 2] + seen[3 * t[3 * f + 1] + 2] + seen[3 * t[3 * f + 2] + 2];
      const depths = Float32Array.from({ length: count }, (_, f) => depth(f));
      const order = Uint32Array.from({ length: count }, (_, f) => f).sort((a, b) => depths[b] - depths[a]);
      for (const f of order) {
        const [a, b, c] = [t[3 * f], t[3 * f + 1], t[3 * f + 2]], at = (v) => [q[3 * v], q[3 * v + 1], q[3 * v + 2]];
        const normal = cross(minus(at(b), at(a)), minus(at(c), at(a))), size = Math.hypot(...normal);
        const light = 0.35 + 0.65 * Math.abs(size > 0 ? dot(normal, towards) / size : 0);
        const own = layer.values ? viridis((layer.values[a] + layer.values[b] + layer.values[c]) / 3) : layer.colour;
        context.fillStyle = context.strokeStyle = `rgb(${own.map((v) => Math.round(255 * light * v))})`;
        context.beginPath();
        for (const v of [a, b, c]) context.lineTo(seen[3 * v], seen[3 * v + 1]);
        context.closePath();
        context.fill();
        if (layer.alpha === 1) context.stroke(); // closes the hairlines between neighbours
      }
    }

    _wires(layer, seen) {
      const { context } = this;
      context.strokeStyle = `rgb(${layer.colour.map((v) => Math.round(255 * v))})`;
      context.beginPath();
      for (let e = 0; e < layer.indices.length; e += 2) {
        const a = 3 * layer.indices[e], b = 3 * layer.indices[e + 1];
        context.moveTo(seen[a], seen[a + 1]);
        context.lineTo(seen[b], seen[b + 1]);
      }
      context.stroke();
    }

    _points(layer, seen) {
      const { context } = this, radius = 0.5 * layer.size * (window.devicePixelRatio || 1);
      context.fillStyle = `rgb(${layer.colour.map((v) => Math.round(255 * v))})`;
      for (const v of layer.indices) {
        context.beginPath();
        context.arc(seen[3 * v], seen[3 * v + 1], radius, 0, 2 * Math.PI);
        context.fill();
      }
    }
  }

  // ---- a canvas with layers and a camera that pointers and keys move ----

  class Drawing {
    // options: up and eye (directions); plain: whether to do without WebGL; grab(x, y, looking) at a place on the canvas,
    // CSS pixels: something with move(right, down) and end(), or null where the pointer turns the camera; looking: whether
    // it is only asked what is there
    constructor(canvas, { up = [0, 1, 0], eye = [0.85, 0.55, 1.45], plain = false, grab = () => null } = {}) {
      const gl = plain ? null : canvas.getContext("webgl2", { antialias: true, premultipliedAlpha: true });
      Object.assign(this, { canvas, grab, layers: [], views: 1, camera: new Camera(up, eye), accelerated: Boolean(gl) });
      this.pen = gl ? new Card(gl) : new Plain(canvas.getContext("2d"));
      if (gl) canvas.addEventListener("webglcontextlost", () => this._lost());
      this._watch();
    }

    // The graphics card is lost: a canvas cannot change its kind, so another canvas replaces it.
    _lost() {
      const other = this.canvas.cloneNode(false);
      this.canvas.replaceWith(other);
      Object.assign(this, { canvas: other, accelerated: false, pen: new Plain(other.getContext("2d")) });
      this._watch();
      this.redraw();
    }

    // Views the canvas from another direction.
    from({ up, eye }) {
      Object.assign(this.camera, new Camera(up, eye));
    }

    add(layer) {
      this.layers.push(layer);
      return layer;
    }

    clear() {
      this.layers = [];
    }

    redraw() {
      if (this._asked) return;
      this._asked = true;
      requestAnimationFrame(() => {
        this._asked = false;
        this.draw();
      });
    }

    draw() {
      const { canvas } = this, ratio = window.devicePixelRatio || 1;
      const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      if (!this.camera.radius) return;
      // translucent layers are drawn last
      const ordered = [...this.layers].sort((a, b) => b.alpha - a.alpha);
      this.pen.draw(ordered, this.views, this.camera);
    }

    // Place of a point on the canvas, CSS pixels, in a picture.
    seen(point, view = 0) {
      const wide = this.canvas.clientWidth / this.views, high = this.canvas.clientHeight;
      const [x, y] = applied(this.camera.matrix(wide / high), ...point);
      return [(view + 0.5 * (x + 1)) * wide, 0.5 * (1 - y) * high];
    }

    // Centre and radius of a camera with this eye in whose picture points (n, 3) take the part FILLED.
    fit(q) {
      const { canvas, camera } = this, axes = camera.axes(), [f, g] = focuses(canvas.clientWidth / this.views / canvas.clientHeight);
      const seen = Array.from({ length: q.length / 3 }, (_, v) => axes.map((axis) => dot(axis, q.subarray(3 * v))));
      // distance from the origin at which a point is inside a rim of the picture, or in front of the eye
      const most = (x, y, z) => Math.max(...seen.map((p) => (x * p[0] + y * p[1]) / FILLED + z * p[2]));
      const [right, left, up, down] = [most(f, 0, 1), most(-f, 0, 1), most(0, g, 1), most(0, -g, 1)], near = most(0, 0, 1), end = -most(0, 0, -1);
      const middle = [(right - left) * FILLED / f, (up - down) * FILLED / g, near + end].map((x) => 0.5 * x);
      const away = Math.max(right + left, up + down, 2.5 * near - 0.5 * end) / 2 - middle[2];
      return [[0, 1, 2].map((i) => dot(axes.map((axis) => axis[i]), middle)), away / Math.hypot(1, FOCUS)];
    }

    // Displacement in space that a move on the canvas (CSS pixels) means at the depth of a point.
    moved(right, down, point) {
      const wide = this.canvas.clientWidth / this.views, high = this.canvas.clientHeight, m = this.camera.matrix(wide / high);
      const w = applied(m, ...point)[2], [x, y] = this.camera.axes(), least = Math.min(wide, high);
      const scale = 2 * w / (FOCUS * least);
      return x.map((v, i) => scale * (right * v - down * y[i]));
    }

    _watch() {
      const { canvas, camera } = this, fingers = new Map();
      new ResizeObserver(() => this.redraw()).observe(canvas);
      let held = null;
      const place = (event) => {
        const box = canvas.getBoundingClientRect();
        return [event.clientX - box.left, event.clientY - box.top];
      };
      // a finger on a handle must not scroll the page
      canvas.addEventListener("touchstart", (event) => {
        const touch = event.touches[0];
        if (event.touches.length > 1 || this.grab(...place(touch), true)) event.preventDefault();
      }, { passive: false });
      canvas.addEventListener("pointerdown", (event) => {
        fingers.set(event.pointerId, place(event));
        canvas.setPointerCapture(event.pointerId);
        if (fingers.size === 1) held = this.grab(...place(event), false);
      });
      canvas.addEventListener("pointermove", (event) => {
        if (!fingers.has(event.pointerId)) {
          canvas.style.cursor = this.grab(...place(event), true) ? "grab" : "";
          return;
        }
        const [x, y] = place(event), [a, b] = fingers.get(event.pointerId), before = spread(fingers);
        fingers.set(event.pointerId, [x, y]);
        if (fingers.size > 1) camera.zoom(before / spread(fingers));
        else if (held) held.move(x - a, y - b);
        else camera.turn(0.008 * (x - a), 0.008 * (y - b));
        this.redraw();
      });
      const leave = (event) => {
        fingers.delete(event.pointerId);
        if (held) held.end();
        held = null;
      };
      canvas.addEventListener("pointerup", leave);
      canvas.addEventListener("pointercancel", leave);
      canvas.addEventListener("wheel", (event) => {
        if (!event.ctrlKey && document.activeElement !== canvas) return; // the page scrolls
        event.preventDefault();
        camera.zoom(Math.exp(0.0015 * event.deltaY));
        this.redraw();
      }, { passive: false });
      canvas.addEventListener("keydown", (event) => {
        const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
        if (turns[event.key]) camera.turn(...turns[event.key]);
        else if (event.key === "+" || event.key === "-") camera.zoom(event.key === "+" ? 0.9 : 1 / 0.9);
        else if (event.key === "Home") camera.reset();
        else return;
        event.preventDefault();
        this.redraw();
      });
    }
  }

  function spread(fingers) {
    const [a, b] = [...fingers.values()];
    return b ? Math.max(Math.hypot(a[0] - b[0], a[1] - b[1]), 1) : 1;
  }

  // A colour of the page's style sheet, by the name of its variable: from 0 to 1.
  function colour(name) {
    const text = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    return [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16) / 255);
  }

  // The entries of a list; a list with a single entry is shown as text.
  function fill(select, values, words = String) {
    const before = select.value;
    select.replaceChildren(...values.map((value) => new Option(words(value), value)));
    if (values.map(String).includes(before)) select.value = before;
    select.hidden = values.length < 2;
    select.nextElementSibling.textContent = select.hidden ? values.map(words).join("") : "";
  }

  return { Drawing, Layer, colour, fill };
})();
