// Bakes the blocks of the scene that the page begins with, for which it then needs no builder: node bake.js
// The program examples/bake makes the same of a mesh in a file.

import { readFile, writeFile } from 'node:fs/promises';
import { blockOf, structures } from './builder.js';
import { baked } from './scenes.js';

const here = (name) => new URL(name, import.meta.url);
const { instance } = await WebAssembly.instantiate(await readFile(here('build.wasm')));
for (const structure of Object.keys(structures)) {
  await writeFile(here(`${structure}.block`), blockOf(instance, baked(), structure));
}
