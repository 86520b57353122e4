// What the page shows, as indexed meshes.

// A point of the knot's middle line.
function middle(u) {
  const r = 1 + 0.4 * Math.cos(1.5 * u);
  return [r * Math.cos(u), 0.4 * Math.sin(1.5 * u), r * Math.sin(u)];
}

const cross = (p, q) => [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
const unit = (p) => p.map((x) => x / Math.hypot(...p));

// `along` times `around` squares of two triangles each, and two for the floor.
export function knot(along, around) {
  const vertices = [], indices = [];
  for (let i = 0; i < along; i++) {
    const u = 4 * Math.PI * i / along;
    const [p, next] = [middle(u), middle(u + 1e-3)];
    const ahead = unit(next.map((x, k) => x - p[k]));
    const side = unit(cross(ahead, [0, 1, 0]));
    const over = cross(side, ahead);
    for (let j = 0; j < around; j++) {
      const v = 2 * Math.PI * j / around, radius = 0.16 + 0.02 * Math.sin(9 * v + 40 * u);
      for (let k = 0; k < 3; k++) vertices.push(p[k] + radius * (Math.cos(v) * side[k] + Math.sin(v) * over[k]));
    }
  }
  for (let i = 0; i < along; i++) {
    for (let j = 0; j < around; j++) {
      const at = (i, j) => (i % along) * around + j % around;
      const [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
      indices.push(a, b, c, a, c, d);
    }
  }
  const first = vertices.length / 3;
  for (const [x, z] of [[-3, -3], [3, -3], [3, 3], [-3, 3]]) vertices.push(x, -0.7, z);
  indices.push(first, first + 1, first + 2, first, first + 2, first + 3);
  return { vertices: new Float32Array(vertices), indices: new Uint32Array(indices) };
}

// The scene whose blocks are baked.
export const baked = () => knot(200, 12);

// The triangles of a file of Wavefront's, moved and scaled to where the knot is.
export function obj(text) {
  const vertices = [], indices = [];
  for (const line of text.split('\n')) {
    const [what, ...words] = line.trim().split(/\s+/);
    if (what === 'v') vertices.push(...words.slice(0, 3).map(Number));
    if (what !== 'f') continue;
    const corners = words.map((word) => parseInt(word)).map((n) => (n < 0 ? vertices.length / 3 + n : n - 1));
    for (let i = 2; i < corners.length; i++) indices.push(corners[0], corners[i - 1], corners[i]);
  }
  const extents = [0, 1, 2].map((k) => {
    let [lower, upper] = [Infinity, -Infinity];
    for (let i = k; i < vertices.length; i += 3) {
      lower = Math.min(lower, vertices[i]);
      upper = Math.max(upper, vertices[i]);
    }
    return [lower, upper];
  });
  const scale = 2.6 / Math.max(...extents.map(([lower, upper]) => upper - lower));
  const fitted = vertices.map((x, i) => scale * (x - (extents[i % 3][0] + extents[i % 3][1]) / 2));
  return { vertices: new Float32Array(fitted), indices: new Uint32Array(indices) };
}
