// Builds blocks by the module build.wasm. Runs wherever JavaScript does: in the page's worker, and in what bakes its blocks.

import { Memory } from './memory.js';

export const structures = { bvh: 0, nested: 1, grid: 2 };

// The bytes of a block over a mesh, which hold no addresses: they may be copied anywhere.
export function blockOf({ exports }, mesh, structure) {
  const memory = new Memory(exports), number = structures[structure];
  const address = memory.putMesh(mesh);
  const wanted = exports.needs(address, number);
  const block = memory.room(wanted);
  const size = wanted && exports.build(address, number, block, wanted);
  if (!size) throw new Error('there is no block of this mesh');
  return new Uint8Array(exports.memory.buffer.slice(block, block + size));
}
