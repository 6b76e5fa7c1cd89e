"use strict";
// Reads arrays that pdrom.core.packed wrote.
const pdromPacked = (() => {
  async function bytes(text) {
    const raw = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const stream = new Blob([raw]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(stream).arrayBuffer();
  }

  const KINDS = { f8: Float64Array, f4: Float32Array, u4: Uint32Array };

  async function unpack(packed) {
    return new KINDS[packed.kind](await bytes(packed.data));
  }

  // Replaces every packed array inside a value.
  async function unpacked(value) {
    if (Array.isArray(value)) return Promise.all(value.map(unpacked));
    if (value === null || typeof value !== "object") return value;
    if (value.kind && value.data !== undefined) return unpack(value);
    const parts = await Promise.all(Object.entries(value).map(async ([k, v]) => [k, await unpacked(v)]));
    return Object.fromEntries(parts);
  }

  // Frames (n, 3) of packed positions.
  async function frames(packed) {
    const changes = new Uint16Array(await bytes(packed.changes)), size = 3 * packed.vertices;
    const level = new Uint16Array(size), all = [];
    for (let f = 0; f < packed.frames; f++) {
      const q = new Float32Array(size);
      for (let i = 0; i < size; i++) {
        level[i] += changes[size * f + i];
        q[i] = packed.low[i % 3] + packed.step[i % 3] * level[i];
      }
      all.push(q);
    }
    return all;
  }

  // Positions at a place between stored frames; after the end the last ones.
  function between(all, place) {
    const first = Math.min(Math.floor(place), all.length - 1), part = place - first, next = all[first + 1];
    return part === 0 || !next ? all[first] : all[first].map((x, i) => x + part * (next[i] - x));
  }

  return { unpack, unpacked, frames, between };
})();
