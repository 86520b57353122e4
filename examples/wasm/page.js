// The page: fetches a block that was baked, or has one built, and shows what is traced.

import { Memory } from './memory.js';
import { baked, knot, obj } from './scenes.js';

const { instance: { exports: module } } = await WebAssembly.instantiateStreaming(fetch('page.wasm'));
const memory = new Memory(module);
const element = (id) => document.getElementById(id);
const canvas = element('picture');
const { width, height } = canvas;
const context = canvas.getContext('2d');

// A worker has the other module, and is not fetched before something is to be built.
let worker, asked = 0;
const waiting = new Map();
function build(mesh, structure) {
  if (!worker) {
    worker = new Worker('worker.js', { type: 'module' });
    worker.onmessage = ({ data: { number, ...answer } }) => waiting.get(number)(answer);
  }
  worker.postMessage({ number: ++asked, mesh, structure });
  return new Promise((done) => waiting.set(asked, done));
}

// A block of the chosen scene, and where it is from.
let own = null;
async function made(scene, structure) {
  if (scene === 'baked') {
    const answer = await fetch(`${structure}.block`);
    if (!answer.ok) throw new Error('the block is not there: build.sh bakes it');
    return { mesh: baked(), block: new Uint8Array(await answer.arrayBuffer()), how: 'baked' };
  }
  const mesh = scene === 'own' ? own : knot(...scene.split('x').map(Number));
  const { block, ms, error } = await build(mesh, structure);
  if (error) throw new Error(error);
  return { mesh, block, how: `built in ${ms.toFixed(0)} ms` };
}

// What is shown, by address. What is chosen later is shown last, whatever takes longer.
let shown = null, chosen = 0, pictures = 0, spent = 0;
async function choose() {
  const ticket = ++chosen;
  try {
    const { value: structure, parentNode: label } = document.querySelector('[name=structure]:checked');
    const { mesh, block, how } = await made(element('scene').value, structure);
    if (ticket !== chosen) return;
    memory.clear();
    const [camera, pixels] = [memory.room(72), memory.room(4 * width * height)];
    shown = { mesh: memory.putMesh(mesh), block: memory.put(block), size: block.length, camera, pixels };
    pictures = spent = 0;
    const triangles = (mesh.indices.length / 3).toLocaleString('en');
    const size = `${(block.length / 1024).toFixed(0)} KiB`;
    element('built').value = `${triangles} triangles, ${label.innerText.trim()} of ${size}, ${how}`;
    element('speed').value = '';
  } catch (error) {
    if (ticket === chosen) element('built').value = error.message;
  }
}

let angle = 0.6;
function trace({ mesh, block, size, camera, pixels }) {
  const [s, c] = [Math.sin(angle), Math.cos(angle)];
  const aspect = 0.45, wide = aspect * width / height;
  // Eye, ahead, right, up, light.
  new Float32Array(module.memory.buffer, camera, 15).set(
    [4 * s, 1.2, 4 * c, -4 * s, -1.0, -4 * c, 4 * wide * c, 0, -4 * wide * s, -0.45 * s, 1.75, -0.45 * c, 3, 4, 1]);
  new Uint32Array(module.memory.buffer, camera + 60, 3).set([width, height, element('heat').checked ? 1 : 0]);
  const start = performance.now();
  const steps = module.trace(mesh, block, size, camera, pixels);
  spent += performance.now() - start;
  if (steps < 0) {
    shown = null;
    element('built').value = 'the block was refused';
    return;
  }
  const bytes = new Uint8ClampedArray(module.memory.buffer.slice(pixels, pixels + 4 * width * height));
  context.putImageData(new ImageData(bytes, width, height), 0, 0);
  pictures++;
  element('speed').value =
    `${(pictures * width * height / spent / 1000).toFixed(2)} million pixels a second, ` +
    `${(steps / width / height).toFixed(1)} steps each`;
}

function frame(now) {
  if (element('turn').checked) angle = 0.6 + now / 4000;
  if (shown) trace(shown);
  requestAnimationFrame(frame);
}

element('structure').addEventListener('change', choose);
element('scene').addEventListener('change', choose);
element('file').addEventListener('change', async ({ target: { files: [file] } }) => {
  if (!file) return;
  own = obj(await file.text());
  element('own').hidden = false;
  element('scene').value = 'own';
  await choose();
});
await choose();
requestAnimationFrame(frame);
