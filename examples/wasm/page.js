// The page: makes a mesh, has a structure built over it, and shows what is traced.

import { knot } from './knot.js';

const { instance } = await WebAssembly.instantiateStreaming(fetch('page.wasm'));
const { memory, needs, build, trace, __heap_base } = instance.exports;

// Memory is handed out from the end of the module's own and never taken back, but for what follows a mark.
let end = __heap_base.value;
function room(size) {
  const start = (end + 63) & ~63;
  end = start + size;
  const missing = end - memory.buffer.byteLength;
  if (missing > 0) memory.grow(Math.ceil(missing / 65536));
  return start;
}

const canvas = document.getElementById('picture');
const { width, height } = canvas;
const context = canvas.getContext('2d');

const made = knot(600, 24);
const vertices = room(made.vertices.byteLength);
const indices = room(made.indices.byteLength);
const mesh = room(16), camera = room(72), pixels = room(4 * width * height);
new Float32Array(memory.buffer, vertices).set(made.vertices);
new Uint32Array(memory.buffer, indices).set(made.indices);
new Uint32Array(memory.buffer, mesh).set([vertices, made.vertices.length / 3, indices, made.indices.length / 3]);
const mark = end;

let block = 0, size = 0;
function rebuild() {
  const structure = Number(document.querySelector('[name=structure]:checked').value);
  end = mark;
  const wanted = needs(mesh, structure);
  block = room(wanted);
  const start = performance.now();
  size = build(mesh, structure, block, wanted);
  const ms = performance.now() - start;
  document.getElementById('built').value =
    `${(made.indices.length / 3).toLocaleString('en')} triangles built in ${ms.toFixed(0)} ms, ` +
    `${(size / 1024).toFixed(0)} KiB`;
}

let angle = 0.6, shown = 0, spent = 0;
function frame(now) {
  if (document.getElementById('turn').checked) angle = 0.6 + now / 4000;
  const [s, c] = [Math.sin(angle), Math.cos(angle)];
  const aspect = 0.45, wide = aspect * width / height;
  // Eye, ahead, right, up, light.
  new Float32Array(memory.buffer, camera, 15).set(
    [4 * s, 1.2, 4 * c, -4 * s, -1.0, -4 * c, 4 * wide * c, 0, -4 * wide * s, -0.45 * s, 1.75, -0.45 * c, 3, 4, 1]);
  const heat = document.getElementById('heat').checked;
  new Uint32Array(memory.buffer, camera + 60, 3).set([width, height, heat ? 1 : 0]);
  const start = performance.now();
  const steps = trace(mesh, block, size, camera, pixels);
  spent += performance.now() - start;
  if (steps < 0) throw new Error('the block was refused');
  const bytes = new Uint8ClampedArray(memory.buffer.slice(pixels, pixels + 4 * width * height));
  context.putImageData(new ImageData(bytes, width, height), 0, 0);
  shown++;
  document.getElementById('speed').value =
    `${(shown * width * height / spent / 1000).toFixed(2)} million pixels a second, ` +
    `${(steps / width / height).toFixed(1)} steps each`;
  requestAnimationFrame(frame);
}

document.getElementById('structure').addEventListener('change', () => {
  shown = spent = 0;
  rebuild();
});
rebuild();
requestAnimationFrame(frame);
