// Builds blocks while the page goes on tracing: a mesh comes, a block goes.

import { blockOf } from './builder.js';

const builder = WebAssembly.instantiateStreaming(fetch('build.wasm'));

onmessage = async ({ data: { number, mesh, structure } }) => {
  try {
    const { instance } = await builder;
    const start = performance.now();
    const block = blockOf(instance, mesh, structure);
    postMessage({ number, block, ms: performance.now() - start }, [block.buffer]);
  } catch (error) {
    postMessage({ number, error: error.message });
  }
};
