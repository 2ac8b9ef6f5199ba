// SPDX-License-Identifier: BSD-3-Clause
// Reads the blocks of PageEncoder: a zlib stream of a JSON header and columns of numbers.

const kTypes = {f64: Float64Array, f32: Float32Array, u32: Uint32Array, u16: Uint16Array, u8: Uint8Array};

export function bytesFromBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; ++k) bytes[k] = letters.charCodeAt(k);
  return bytes;
}

async function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Byte planes back to numbers.
function columnOf(bytes, {type, at, count}) {
  const column = new kTypes[type](count);
  const width = column.BYTES_PER_ELEMENT;
  if (width === 1) {
    column.set(bytes.subarray(at, at + count));
    return column;
  }
  const out = new Uint8Array(column.buffer);
  for (let plane = 0; plane < width; ++plane) {
    const from = at + plane * count;
    for (let k = 0, to = plane; k < count; ++k, to += width) out[to] = bytes[from + k];
  }
  return column;
}

const kChunk = 0x44;  // D, where a zlib stream has 0x78

// A chunk of a large run, which is read when its time is looked at: D, the begin and the end of its
// time, a zlib stream. Its bytes are left to the browser, which may keep them outside its memory.
function chunkOf(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset);
  const rest = new Blob([bytes.subarray(17)]);
  return {block: 'chunk', begin: view.getFloat64(1, true), end: view.getFloat64(9, true),
          read: async () => readBlock(new Uint8Array(await rest.arrayBuffer()))};
}

// The header, with `columns` turned into typed arrays.
export async function readBlock(compressed) {
  if (compressed[0] === kChunk) return chunkOf(compressed);
  const bytes = await inflate(compressed);
  const length = new DataView(bytes.buffer).getUint32(0, true);
  const block = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
  const data = bytes.subarray(4 + length);
  for (const [name, place] of Object.entries(block.columns)) {
    block.columns[name] = columnOf(data, place);
  }
  return block;
}

// Vectors that are rounded to their box, as differences.
export function readRounded(differences, {low, high}) {
  const count = differences.length / 3;
  const most = differences instanceof Uint16Array ? 0xffff : 0xffffff;
  const vectors = new Float32Array(3 * count);
  for (let axis = 0; axis < 3; ++axis) {
    const step = (high[axis] - low[axis]) / most;
    let level = 0;
    for (let k = 0; k < count; ++k) {
      const z = differences[axis * count + k];
      level = (level + ((z >>> 1) ^ -(z & 1))) & most;
      vectors[3 * k + axis] = low[axis] + step * level;
    }
  }
  return vectors;
}

// Positions and triangle indices of a shape, and of what stands for it while the picture moves.
export function readSurface({shapes, columns}, number) {
  const moving = (shapes[number].moving ?? []).map((box) => surfaceOf(columns, box.name, box));
  return {...surfaceOf(columns, `shape${number}`, shapes[number]), moving};
}

function surfaceOf(columns, name, box) {
  const back = columns[`${name}.triangles`];
  const positions = readRounded(columns[`${name}.vertices`], box);
  const indices = new Uint32Array(3 * box.triangles);
  let next = 0;
  for (let k = 0; k < indices.length; ++k) indices[k] = back[k] === 0 ? next++ : next - back[k];
  return {positions, indices};
}
