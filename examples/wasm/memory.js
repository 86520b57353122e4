// The memory of a module of WebAssembly, handed out from the end of the module's own and taken back all at once.

export class Memory {
  constructor({ memory, __heap_base }) {
    this.memory = memory;
    this.end = this.begin = __heap_base.value;
  }

  clear() {
    this.end = this.begin;
  }

  // The address of so many bytes, a multiple of 64.
  room(size) {
    const start = (this.end + 63) & ~63;
    this.end = start + size;
    const missing = this.end - this.memory.buffer.byteLength;
    if (missing > 0) this.memory.grow(Math.ceil(missing / 65536));
    return start;
  }

  // The address of a copy of an array.
  put(array) {
    const start = this.room(array.byteLength);
    new array.constructor(this.memory.buffer, start, array.length).set(array);
    return start;
  }

  // The address of a mesh, as both modules take it.
  putMesh({ vertices, indices }) {
    return this.put(new Uint32Array([this.put(vertices), vertices.length / 3, this.put(indices), indices.length / 3]));
  }
}
