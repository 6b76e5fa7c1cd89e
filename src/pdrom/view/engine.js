"use strict";
// Runs models of position subspaces with the arithmetic of pdrom.reduction.subspace, in doubles. It uses no document
// and no clock, so that it runs in a page as in a test. Matrices are Float64Arrays by rows; coordinates are (K, 3).
const pdromEngine = (() => {
  const SWEEPS = 12, ORTHOGONAL = 1e-15, LAST_TANGENT = 1e-8, RANK = 1e-15; // as in svd3.py
  const STEPS = 16, WELL_CONDITIONED = 1e-2, LAST_STEP = 1e-18; // as in tetrahedron.py
  const FLAT = 1e-2, EQUAL = 1e-17, LOW = 1e-60, HIGH = 1e60; // as in triangle_strain.py
  const SMALLEST = 1e-300;

  // ---- small linear algebra ----

  // (m, n) times (n, 3); four rows together read x once
  function times(a, x, n, out) {
    const m = out.length / 3, whole = m - m % 4;
    for (let i = 0; i < whole; i += 4) {
      let a0 = 0, a1 = 0, a2 = 0, b0 = 0, b1 = 0, b2 = 0, c0 = 0, c1 = 0, c2 = 0, d0 = 0, d1 = 0, d2 = 0;
      for (let k = 0, at = i * n, from = 0; k < n; k++, at++, from += 3) {
        const u = x[from], v = x[from + 1], w = x[from + 2], p = a[at], q = a[at + n], r = a[at + 2 * n], s = a[at + 3 * n];
        a0 += p * u; a1 += p * v; a2 += p * w;
        b0 += q * u; b1 += q * v; b2 += q * w;
        c0 += r * u; c1 += r * v; c2 += r * w;
        d0 += s * u; d1 += s * v; d2 += s * w;
      }
      const to = 3 * i;
      out[to] = a0; out[to + 1] = a1; out[to + 2] = a2; out[to + 3] = b0; out[to + 4] = b1; out[to + 5] = b2;
      out[to + 6] = c0; out[to + 7] = c1; out[to + 8] = c2; out[to + 9] = d0; out[to + 10] = d1; out[to + 11] = d2;
    }
    for (let i = whole; i < m; i++) for (let axis = 0; axis < 3; axis++) {
      let total = 0;
      for (let k = 0; k < n; k++) total += a[i * n + k] * x[3 * k + axis];
      out[3 * i + axis] = total;
    }
    return out;
  }

  // adds the transpose of (m, n) times (m, 3) to (n, 3), four rows together
  function addTransposed(a, x, n, out) {
    const m = x.length / 3, whole = m - m % 4;
    for (let i = 0; i < whole; i += 4) {
      const f = 3 * i, a0 = x[f], a1 = x[f + 1], a2 = x[f + 2], b0 = x[f + 3], b1 = x[f + 4], b2 = x[f + 5];
      const c0 = x[f + 6], c1 = x[f + 7], c2 = x[f + 8], d0 = x[f + 9], d1 = x[f + 10], d2 = x[f + 11];
      for (let k = 0, at = i * n, to = 0; k < n; k++, at++, to += 3) {
        const p = a[at], q = a[at + n], r = a[at + 2 * n], s = a[at + 3 * n];
        out[to] += p * a0 + q * b0 + r * c0 + s * d0;
        out[to + 1] += p * a1 + q * b1 + r * c1 + s * d1;
        out[to + 2] += p * a2 + q * b2 + r * c2 + s * d2;
      }
    }
    for (let i = whole; i < m; i++) for (let k = 0; k < n; k++) for (let axis = 0; axis < 3; axis++) {
      out[3 * k + axis] += a[i * n + k] * x[3 * i + axis];
    }
    return out;
  }

  // Cholesky factor of a matrix (n, n); an error if it is not positive definite.
  function cholesky(a, n) {
    const factor = new Float64Array(n * n);
    for (let i = 0; i < n; i++) for (let j = 0; j <= i; j++) {
      let value = a[n * i + j];
      for (let k = 0; k < j; k++) value -= factor[n * i + k] * factor[n * j + k];
      if (i === j && !(value > 0)) throw new Error("the reduced system is not positive definite");
      factor[n * i + j] = i === j ? Math.sqrt(value) : value / factor[n * j + j];
    }
    return factor;
  }

  function inverse(a, n) {
    const factor = cholesky(a, n), result = new Float64Array(n * n), x = new Float64Array(n);
    for (let column = 0; column < n; column++) {
      x.fill(0);
      for (let i = column; i < n; i++) {
        let value = i === column ? 1 : 0;
        for (let k = column; k < i; k++) value -= factor[n * i + k] * x[k];
        x[i] = value / factor[n * i + i];
      }
      for (let i = n - 1; i >= 0; i--) {
        for (let k = i + 1; k < n; k++) x[i] -= factor[n * k + i] * x[k];
        x[i] /= factor[n * i + i];
      }
      for (let i = 0; i < n; i++) result[n * i + column] = x[i];
    }
    return result;
  }

  function block(a, n, rows, columns) {
    const result = new Float64Array(rows.length * columns.length);
    rows.forEach((r, i) => columns.forEach((c, j) => { result[columns.length * i + j] = a[n * r + c]; }));
    return result;
  }

  // ---- projections of one element: d and p are (rows, 3) at place `at` of arrays ----

  function toLength(d, p, at, length, rest) {
    const x = d[at], y = d[at + 1], z = d[at + 2], square = x * x + y * y + z * z;
    const factor = length / Math.sqrt(square);
    p[at] = square === 0 ? rest[0] : factor * x;
    p[at + 1] = square === 0 ? rest[1] : factor * y;
    p[at + 2] = square === 0 ? rest[2] : factor * z;
  }

  const clamp = (value, low, high) => (value < low ? low : value > high ? high : value);
  const dot = (a, i, b, j) => a[i] * b[j] + a[i + 1] * b[j + 1] + a[i + 2] * b[j + 2];

  function rotatePair(a, i, j, c, s) {
    for (let axis = 0; axis < 3; axis++) {
      const x = a[i + axis], y = a[j + axis];
      a[i + axis] = c * x - s * y;
      a[j + axis] = s * x + c * y;
    }
  }

  // Jacobi rotation of the columns i and j of b; its |tangent|.
  function rotate(b, v, i, j) {
    const alpha = dot(b, i, b, i), beta = dot(b, j, b, j), gamma = dot(b, i, b, j);
    const half = 0.5 * (beta - alpha), root = Math.abs(half) + Math.sqrt(half * half + gamma * gamma);
    if (gamma * gamma <= ORTHOGONAL * ORTHOGONAL * alpha * beta || root === 0) return 0;
    const tangent = gamma / root, c = 1 / Math.sqrt(1 + tangent * tangent), s = half < 0 ? -c * tangent : c * tangent;
    rotatePair(b, i, j, c, s);
    rotatePair(v, i, j, c, s);
    return Math.abs(tangent);
  }

  function largerFirst(b, v, i, j) {
    if (!(dot(b, i, b, i) < dot(b, j, b, j))) return;
    for (const a of [b, v]) for (let axis = 0; axis < 3; axis++) {
      const x = a[i + axis];
      a[i + axis] = a[j + axis];
      a[j + axis] = -x;
    }
  }

  const B = new Float64Array(9), V = new Float64Array(9), U = new Float64Array(9), N = new Float64Array(9);

  // Directions of the orthogonal columns 0 and 1 of b, the longer first, in U; their norms.
  function orthonormalPair(b) {
    const s0 = Math.sqrt(dot(b, 0, b, 0));
    for (let i = 0; i < 3; i++) U[i] = s0 > 0 ? b[i] / s0 : i === 0 ? 1 : 0;
    const rest = dot(U, 0, b, 3);
    for (let i = 0; i < 3; i++) b[3 + i] -= rest * U[i];
    const s1 = Math.sqrt(dot(b, 3, b, 3));
    if (s1 > RANK * s0) for (let i = 0; i < 3; i++) U[3 + i] = b[3 + i] / s1;
    else perpendicular();
    return [s0, s1];
  }

  // A unit vector across column 0 of U, in column 1: with the axis along which that is smallest.
  function perpendicular() {
    const [x, y, z] = U, [a, b, c] = U.subarray(0, 3).map(Math.abs);
    const turned = a <= b && a <= c ? [0, z, -y] : b <= c ? [-z, 0, x] : [y, -x, 0];
    const length = Math.sqrt(turned[0] ** 2 + turned[1] ** 2 + turned[2] ** 2);
    for (let i = 0; i < 3; i++) U[3 + i] = turned[i] / length;
  }

  function clampBySvd(d, p, at, low, high) {
    let scale = SMALLEST;
    for (let i = 0; i < 9; i++) scale += Math.abs(d[at + i]);
    for (let i = 0; i < 9; i++) {
      B[i] = d[at + i] / scale;
      V[i] = i % 4 === 0 ? 1 : 0;
    }
    for (let sweep = 0; sweep < SWEEPS; sweep++) {
      const t = Math.max(rotate(B, V, 0, 3), rotate(B, V, 0, 6), rotate(B, V, 3, 6));
      if (!(t > LAST_TANGENT)) break;
    }
    largerFirst(B, V, 0, 3);
    largerFirst(B, V, 3, 6);
    largerFirst(B, V, 0, 3);
    const [s0, s1] = orthonormalPair(B);
    U[6] = U[1] * U[5] - U[2] * U[4];
    U[7] = U[2] * U[3] - U[0] * U[5];
    U[8] = U[0] * U[4] - U[1] * U[3];
    const a = clamp(scale * s0, low, high) + 0 * scale, b = clamp(scale * s1, low, high);
    const c = clamp(scale * dot(U, 6, B, 6), low, high);
    for (let i = 0; i < 3; i++) for (let axis = 0; axis < 3; axis++) {
      p[at + 3 * i + axis] = a * U[axis] * V[i] + b * U[3 + axis] * V[3 + i] + c * U[6 + axis] * V[6 + i];
    }
  }

  // Nearest rotation by Newton's iteration; false if F does not suit the iteration.
  function toRotation(d, p, at) {
    let square = 0;
    for (let i = 0; i < 9; i++) square += d[at + i] * d[at + i];
    square /= 3;
    if (!(square > SMALLEST)) return false;
    const factor = 1 / Math.sqrt(square);
    let a = factor * d[at], b = factor * d[at + 1], c = factor * d[at + 2], e = factor * d[at + 3];
    let f = factor * d[at + 4], g = factor * d[at + 5], h = factor * d[at + 6], k = factor * d[at + 7];
    let l = factor * d[at + 8];
    if (!(a * (f * l - g * k) + b * (g * h - e * l) + c * (e * k - f * h) > WELL_CONDITIONED)) return false;
    for (let step = 0; step < STEPS; step++) {
      const A = f * l - g * k, Bx = g * h - e * l, C = e * k - f * h; // x1 x x2
      const D = k * c - l * b, E = l * a - h * c, F = h * b - k * a; // x2 x x0
      const G = b * g - c * f, H = c * e - a * g, I = a * f - b * e; // x0 x x1
      const half = 0.5 / (a * A + b * Bx + c * C);
      const na = 0.5 * a + half * A, nb = 0.5 * b + half * Bx, nc = 0.5 * c + half * C;
      const ne = 0.5 * e + half * D, nf = 0.5 * f + half * E, ng = 0.5 * g + half * F;
      const nh = 0.5 * h + half * G, nk = 0.5 * k + half * H, nl = 0.5 * l + half * I;
      const moved = (na - a) ** 2 + (nb - b) ** 2 + (nc - c) ** 2 + (ne - e) ** 2 + (nf - f) ** 2 + (ng - g) ** 2
        + (nh - h) ** 2 + (nk - k) ** 2 + (nl - l) ** 2;
      a = na; b = nb; c = nc; e = ne; f = nf; g = ng; h = nh; k = nk; l = nl;
      if (moved < LAST_STEP) {
        p[at] = a; p[at + 1] = b; p[at + 2] = c; p[at + 3] = e; p[at + 4] = f;
        p[at + 5] = g; p[at + 6] = h; p[at + 7] = k; p[at + 8] = l;
        return true;
      }
    }
    return false;
  }

  // Copies F where its singular values surely lie in the range.
  function withinRange(d, p, at, low, high) {
    const slack = Math.min(1 - low * low, high * high - 1);
    const g0 = dot(d, at, d, at) - 1, g1 = dot(d, at + 3, d, at + 3) - 1, g2 = dot(d, at + 6, d, at + 6) - 1;
    const h0 = dot(d, at + 3, d, at + 6), h1 = dot(d, at + 6, d, at), h2 = dot(d, at, d, at + 3);
    const distance = g0 * g0 + g1 * g1 + g2 * g2 + 2 * (h0 * h0 + h1 * h1 + h2 * h2);
    const det = d[at] * (d[at + 4] * d[at + 8] - d[at + 5] * d[at + 7])
      + d[at + 1] * (d[at + 5] * d[at + 6] - d[at + 3] * d[at + 8])
      + d[at + 2] * (d[at + 3] * d[at + 7] - d[at + 4] * d[at + 6]);
    if (!(distance < slack * slack && det > 0)) return false;
    for (let i = 0; i < 9; i++) p[at + i] = d[at + i];
    return true;
  }

  function clamp3(d, p, at, low, high) {
    const found = low === 1 && high === 1 ? toRotation(d, p, at) : withinRange(d, p, at, low, high);
    if (!found) clampBySvd(d, p, at, low, high);
  }

  function clamp2(d, p, at, low, high) {
    const a = dot(d, at, d, at), b = dot(d, at + 3, d, at + 3), off = dot(d, at, d, at + 3);
    const mean = 0.5 * (a + b), half = 0.5 * (a - b), h = Math.sqrt(half * half + off * off) + EQUAL * mean;
    const nx = d[at + 1] * d[at + 5] - d[at + 2] * d[at + 4], ny = d[at + 2] * d[at + 3] - d[at] * d[at + 5];
    const nz = d[at] * d[at + 4] - d[at + 1] * d[at + 3], product = Math.sqrt(nx * nx + ny * ny + nz * nz);
    if (!(mean > LOW && mean < HIGH && product > FLAT * mean)) return clamp2Flat(d, p, at, low, high);
    const large = Math.sqrt(mean + h), reciprocal = 1 / (large * product * h);
    const ofLarge = reciprocal * product * h, ofProduct = reciprocal * large * h, ofH = reciprocal * large * product;
    const first = clamp(large, low, high) * ofLarge;
    const second = clamp(product * ofLarge, low, high) * (large * ofProduct);
    const middle = 0.5 * (first + second), slope = 0.5 * (first - second) * ofH;
    for (let i = 0; i < 3; i++) {
      const x = d[at + i], y = d[at + 3 + i];
      p[at + i] = (middle + slope * half) * x + slope * off * y;
      p[at + 3 + i] = slope * off * x + (middle - slope * half) * y;
    }
  }

  function clamp2Flat(d, p, at, low, high) {
    let scale = SMALLEST;
    for (let i = 0; i < 6; i++) scale += Math.abs(d[at + i]);
    for (let i = 0; i < 6; i++) B[i] = d[at + i] / scale;
    V.fill(0);
    V[0] = V[4] = 1;
    rotate(B, V, 0, 3); // afterwards the rows of V are (c, s) and (-s, c)
    const c = V[0], s = V[3], swapped = dot(B, 0, B, 0) < dot(B, 3, B, 3);
    for (let i = 0; i < 6; i++) N[i] = B[swapped ? (i + 3) % 6 : i];
    const [s0, s1] = orthonormalPair(N), x = clamp(scale * s0, low, high) + 0 * scale, y = clamp(scale * s1, low, high);
    for (let i = 0; i < 3; i++) {
      const a = swapped ? y * U[3 + i] : x * U[i], b = swapped ? x * U[i] : y * U[3 + i];
      p[at + i] = c * a + s * b;
      p[at + 3 + i] = c * b - s * a;
    }
  }

  // ---- operators of an element from its rest shape: S_e (rows, corners) ----

  // Rows of D^-T behind their negative sum, for D^-1 by rows.
  function withFirst(rows, inverted) {
    const out = [];
    for (let i = 0; i < rows; i++) {
      let sum = 0;
      for (let j = 0; j < rows; j++) sum += inverted[rows * j + i];
      out.push(-sum);
      for (let j = 0; j < rows; j++) out.push(inverted[rows * j + i]);
    }
    return out;
  }

  function triangleOperator(q) {
    const [a, b, c] = q, first = b.map((x, i) => x - a[i]), second = c.map((x, i) => x - a[i]);
    const length = Math.sqrt(first[0] ** 2 + first[1] ** 2 + first[2] ** 2);
    const along = (first[0] * second[0] + first[1] * second[1] + first[2] * second[2]) / length;
    const n = [first[1] * second[2] - first[2] * second[1], first[2] * second[0] - first[0] * second[2],
      first[0] * second[1] - first[1] * second[0]];
    const height = Math.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2) / length;
    return withFirst(2, [1 / length, -along / (length * height), 0, 1 / height]);
  }

  function tetrahedronOperator(q) {
    const e = [1, 2, 3].map((corner) => q[corner].map((x, i) => x - q[0][i])); // columns of D
    const cross = (u, v) => [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    const rows = [cross(e[1], e[2]), cross(e[2], e[0]), cross(e[0], e[1])];
    const det = e[0][0] * rows[0][0] + e[0][1] * rows[0][1] + e[0][2] * rows[0][2];
    return withFirst(3, rows.flat().map((x) => x / det));
  }

  // ---- one group of a model: strain D (m p, K) of its sampled elements, and their projections ----

  class Group {
    constructor(file, kind, samples, basis) {
      const clamped = kind.kind === "clamped", rows = kind.rows, corners = rows + 1, K = basis.size;
      const m = samples.stencil.length / corners;
      this.kind = clamped ? rows : 1;
      this.count = m;
      this.rows = rows;
      [this.low, this.high] = kind.range || [0, 0];
      this.strain = new Float64Array(m * rows * K);
      this.rest = new Float64Array(3 * m * rows);
      this.length = new Float64Array(m);
      this.projected = new Float64Array(3 * m * rows);
      this.gradients = new Float64Array(3 * m * rows);
      this.weights = samples.weights || null;
      this.interpolated = samples.operator ? samples : null;
      for (let e = 0; e < m; e++) {
        const vertices = [...samples.stencil.subarray(corners * e, corners * (e + 1))];
        const q = vertices.map((v) => [...file.points.subarray(3 * v, 3 * v + 3)]);
        const operator = clamped ? (rows === 3 ? tetrahedronOperator(q) : triangleOperator(q)) : [-1, 1];
        for (let i = 0; i < rows; i++) for (let c = 0; c < corners; c++) {
          const value = operator[corners * i + c], row = (rows * e + i) * K, from = vertices[c] * K;
          for (let k = 0; k < K; k++) this.strain[row + k] += value * basis.B[from + k];
        }
        if (!clamped) {
          for (let i = 0; i < 3; i++) this.rest[3 * e + i] = q[1][i] - q[0][i];
          this.length[e] = Math.sqrt(dot(this.rest, 3 * e, this.rest, 3 * e));
        }
      }
      // weights of rows times strains
      this.weighted = this.weights && this.strain.map((x, i) => x * this.weights[Math.floor(i / (K * rows))]);
    }

    // Adds its stiffness to a matrix (K, K).
    addStiffness(matrix, K) {
      if (this.interpolated) {
        this.interpolated.stiffness.forEach((x, i) => { matrix[i] += x; });
        return;
      }
      for (let row = 0; row < this.strain.length; row += K) for (let i = 0; i < K; i++) {
        const value = this.weighted[row + i];
        if (value !== 0) for (let j = 0; j < K; j++) matrix[K * i + j] += value * this.strain[row + j];
      }
    }

    project() {
      const { gradients: d, projected: p, low, high } = this, size = 3 * this.rows;
      for (let e = 0, at = 0; e < this.count; e++, at += size) {
        if (this.kind === 3) clamp3(d, p, at, low, high);
        else if (this.kind === 2) clamp2(d, p, at, low, high);
        else toLength(d, p, at, this.length[e], this.rest.subarray(at, at + 3));
      }
    }

    // Adds the forces of its projections at z (K, 3) to rhs (K, 3).
    accumulate(z, K, rhs) {
      times(this.strain, z, K, this.gradients);
      this.project();
      if (!this.interpolated) return addTransposed(this.weighted, this.projected, K, rhs);
      const { operator, modes, offset } = this.interpolated, values = this.projected, n = values.length;
      const r = n ? operator.length / n : 0;
      for (let i = 0; i < 3 * K; i++) rhs[i] += offset[i];
      for (let row = 0; row < r; row++) {
        let c = 0;
        for (let i = 0; i < n; i++) c += operator[row * n + i] * values[i];
        for (let i = 0; i < 3 * K; i++) rhs[i] += modes[i * r + row] * c;
      }
      return rhs;
    }
  }

  // ---- bases ----

  class Basis {
    constructor(file, stored) {
      const n = file.points.length / 3;
      this.size = stored.positions.length / 3;
      this.vertices = n;
      this.B = Float64Array.from(stored.B);
      if (stored.exact) stored.exact.vertices.forEach((v, i) => {
        this.B.set(stored.exact.rows.subarray(this.size * i, this.size * (i + 1)), this.size * v);
      });
      Object.assign(this, { atoms: stored.atoms, atomColumns: stored.atomColumns,
        inertia: stored.inertia, forces: stored.forces, start: stored });
      this.file = file;
      this.moves = this.atoms.map((atom, a) => this._translation(atom, this.atomColumns[a]));
    }

    // Coordinates (m,) of an atom's columns that move all its vertices by one.
    _translation(atom, columns) {
      const m = columns.length, gram = new Float64Array(m * m), sums = new Float64Array(m);
      for (const v of atom) columns.forEach((c, i) => {
        sums[i] += this.B[this.size * v + c];
        columns.forEach((other, j) => { gram[m * i + j] += this.B[this.size * v + c] * this.B[this.size * v + other]; });
      });
      const inverted = inverse(gram, m);
      return columns.map((_, i) => sums.reduce((total, x, j) => total + inverted[m * i + j] * x, 0));
    }

    // Positions (vertices.length, 3) of coordinates z.
    lift(z, vertices, out) {
      const K = this.size;
      for (let i = 0; i < vertices.length; i++) {
        let x = 0, y = 0, w = 0;
        for (let k = 0, at = K * vertices[i]; k < 3 * K; k += 3, at++) {
          const value = this.B[at];
          x += value * z[k];
          y += value * z[k + 1];
          w += value * z[k + 2];
        }
        out[3 * i] = x;
        out[3 * i + 1] = y;
        out[3 * i + 2] = w;
      }
      return out;
    }

    // Coordinates of the field nearest to the positions of all vertices, in the mass inner product.
    coordinates(q) {
      const K = this.size, { masses } = this.file, h = this.file.timeStep;
      if (!this._mass) {
        const scale = new Float64Array(K).map((_, i) => 1 / Math.sqrt(this.inertia[K * i + i] * h * h));
        const scaled = this.inertia.map((x, i) => x * h * h * scale[Math.floor(i / K)] * scale[i % K]);
        this._mass = inverse(scaled, K).map((x, i) => x * scale[Math.floor(i / K)] * scale[i % K]);
      }
      const rhs = new Float64Array(3 * K);
      for (let v = 0; v < this.vertices; v++) for (let k = 0; k < K; k++) {
        const value = this.B[K * v + k] * masses[v];
        if (value !== 0) for (let axis = 0; axis < 3; axis++) rhs[3 * k + axis] += value * q[3 * v + axis];
      }
      return times(this._mass, rhs, K, new Float64Array(3 * K));
    }
  }

  // ---- a run ----

  class Run {
    // file: unpacked content of a model file; model: one of its models; basis: of that model
    constructor(file, model, basis) {
      this.file = file;
      this.basis = basis;
      this.iterations = file.iterations;
      const K = this.K = basis.size;
      this.groups = Object.entries(model.groups).map(([name, s]) => new Group(file, file.groups[name], s, basis));
      this.matrix = Float64Array.from(basis.inertia);
      for (const group of this.groups) group.addStiffness(this.matrix, K);
      this.eliminations = new Map();
      const n = basis.vertices, count = Math.min(file.probes, n);
      this.probes = file.floors.length
        ? [...new Set(Array.from({ length: count }, (_, i) => halfEven(i * (n - 1) / Math.max(1, count - 1))))] : [];
      this.z = Float64Array.from(basis.start.positions);
      this.v = Float64Array.from(basis.start.velocities);
      this.frame = 0;
      this.taken = new Map(); // atom -> coordinates at which the reader took it
    }

    // Atoms that the scene holds in a frame.
    scheduled(frame) {
      const held = new Set();
      for (const hold of this.file.holds) {
        if (frame < hold.from || (hold.until !== null && frame >= hold.until)) continue;
        const vertices = new Set(hold.vertices);
        this.basis.atoms.forEach((atom, a) => { if (vertices.has(atom[0])) held.add(a); });
      }
      return held;
    }

    _elimination(held) {
      const key = held.join(" ");
      if (!this.eliminations.has(key)) {
        const K = this.K, fixed = held.flatMap((a) => this.basis.atomColumns[a]).sort((a, b) => a - b);
        const inside = new Set(fixed), free = Array.from({ length: K }, (_, i) => i).filter((i) => !inside.has(i));
        this.eliminations.set(key, { fixed, free, inverse: inverse(block(this.matrix, K, free, free), free.length),
          coupling: block(this.matrix, K, free, fixed) });
      }
      return this.eliminations.get(key);
    }

    // Computes a frame. held: Map atom -> offset [x, y, z] m from the place where it was taken; default: as in the scene.
    step(held = new Map([...this.scheduled(this.frame)].map((a) => [a, [0, 0, 0]]))) {
      const K = this.K, h = this.file.timeStep, { z, v } = this, s = new Float64Array(3 * K);
      const a = this._acceleration(v);
      for (let i = 0; i < 3 * K; i++) s[i] = z[i] + h * v[i] + h * h * a[i];
      this._hold(held, s);
      const atoms = [...held.keys()].sort((x, y) => x - y), elimination = this._elimination(atoms);
      const base = times(this.basis.inertia, s, K, new Float64Array(3 * K));
      const y = this._iterate(s, base, elimination);
      this._correct(y, atoms);
      for (let i = 0; i < 3 * K; i++) v[i] = (y[i] - z[i]) / h;
      this.z = y;
      this.frame++;
    }

    _acceleration(v) {
      const total = new Float64Array(3 * this.K);
      for (const { constant, rate } of this.basis.forces) {
        const braked = rate.length === 1 ? v.map((x) => rate[0] * x) : times(rate, v, this.K, new Float64Array(3 * this.K));
        for (let i = 0; i < total.length; i++) total[i] += constant[i] + braked[i];
      }
      return total;
    }

    _hold(held, s) {
      for (const atom of this.taken.keys()) if (!held.has(atom)) this.taken.delete(atom);
      for (const [atom, offset] of held) {
        const columns = this.basis.atomColumns[atom], move = this.basis.moves[atom];
        if (!this.taken.has(atom)) this.taken.set(atom, columns.map((c) => [...this.z.subarray(3 * c, 3 * c + 3)]));
        const anchor = this.taken.get(atom);
        columns.forEach((c, i) => {
          for (let axis = 0; axis < 3; axis++) s[3 * c + axis] = anchor[i][axis] + move[i] * offset[axis];
        });
      }
    }

    _iterate(s, base, { fixed, free, inverse: inverted, coupling }) {
      const K = this.K, n = free.length, y = s.slice(), rhs = new Float64Array(3 * K);
      const right = new Float64Array(3 * n), solved = new Float64Array(3 * n), load = new Float64Array(3 * n);
      const targets = Float64Array.from(fixed.flatMap((c) => [s[3 * c], s[3 * c + 1], s[3 * c + 2]]));
      times(coupling, targets, fixed.length, load);
      for (let iteration = 0; iteration < this.iterations; iteration++) {
        rhs.set(base);
        for (const group of this.groups) group.accumulate(y, K, rhs);
        for (let i = 0; i < n; i++) for (let axis = 0; axis < 3; axis++) {
          right[3 * i + axis] = rhs[3 * free[i] + axis] - load[3 * i + axis];
        }
        times(inverted, right, n, solved);
        for (let i = 0; i < n; i++) for (let axis = 0; axis < 3; axis++) y[3 * free[i] + axis] = solved[3 * i + axis];
      }
      return y;
    }

    // Floors: if a probe is below a floor, all vertices below it that are not held are lifted.
    _correct(y, atoms) {
      for (const height of this.file.floors) {
        const heldVertices = new Set(atoms.flatMap((a) => this.basis.atoms[a]));
        const probed = this.basis.lift(y, this.probes, new Float64Array(3 * this.probes.length));
        if (!this.probes.some((v, i) => !heldVertices.has(v) && probed[3 * i + 1] < height)) continue;
        const n = this.basis.vertices, all = Uint32Array.from({ length: n }, (_, i) => i);
        const q = this.basis.lift(y, all, new Float64Array(3 * n));
        for (let v = 0; v < n; v++) if (!heldVertices.has(v) && q[3 * v + 1] < height) q[3 * v + 1] = height;
        y.set(this.basis.coordinates(q));
      }
    }

    get elements() {
      return this.groups.reduce((total, group) => total + group.count, 0);
    }

    get finite() {
      return this.z.every(Number.isFinite);
    }
  }

  // Rounds as NumPy does: halves to the even neighbour.
  function halfEven(x) {
    const below = Math.floor(x), half = x - below;
    return half < 0.5 || (half === 0.5 && below % 2 === 0) ? below : below + 1;
  }

  return { Basis, Run, clamp3, clamp2 };
})();
