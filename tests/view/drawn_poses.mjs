// SPDX-License-Identifier: BSD-3-Clause
// Where a page or a glTF file draws the bodies of a scene, at random times.
// The page's own modules evaluate the page; a glTF file is read here, by the definition of the format.
// Usage: node drawn_poses.mjs PAGE_SOURCES SCENE.json RUN.html|RUN.glb COUNT OUT.poses.json
import fs from 'node:fs';
import path from 'node:path';
import {pathToFileURL} from 'node:url';

const [sources, sceneFile, drawn, count, out] = process.argv.slice(2);
const scene = JSON.parse(fs.readFileSync(sceneFile, 'utf8'));
const names = scene.bodies.map((body) => body.name);

// Numbers in [0, 1), the same each time.
let seed = 17;
function random() {
  seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
  return seed / 4294967296;
}

async function poseOfPage() {
  const module = (name) => import(pathToFileURL(path.resolve(sources, name)));
  const {bytesFromBase64, readBlock} = await module('blocks.js');
  const {Run} = await module('run.js');
  const html = fs.readFileSync(drawn, 'utf8');
  const blocks = [...html.matchAll(/<script[^>]* class="block">([^<]*)</g)].map((found) => found[1]);
  const run = new Run(await readBlock(bytesFromBase64(blocks[0].trim())));
  for (const block of blocks.slice(1)) run.append(await readBlock(bytesFromBase64(block.trim())));
  const bodies = names.map((name) => run.bodies.find((body) => body.name === name));
  return (k, t) => {
    const {p, q} = run.state(bodies[k], t);
    return [...p, ...q];
  };
}

// The value of a CUBICSPLINE, or STEP, sampler at t: glTF 2.0, appendix C.
function sample({times, rows, width, isCubic}, t) {
  let key = 0;
  while (key + 2 < times.length && times[key + 1] <= t) ++key;
  const at = (place, part) => rows.subarray(((isCubic ? 3 * place + part : place)) * width).subarray(0, width);
  if (!isCubic || times.length === 1) return [...at(t >= times[key + 1] ? key + 1 : key, 1)];
  const h = times[key + 1] - times[key];
  const s = Math.min(Math.max((t - times[key]) / h, 0), 1);
  const [a, b, c, d] = [2 * s ** 3 - 3 * s * s + 1, h * (s ** 3 - 2 * s * s + s), -2 * s ** 3 + 3 * s * s,
                        h * (s ** 3 - s * s)];
  const [x, out, y, into] = [at(key, 1), at(key, 2), at(key + 1, 1), at(key + 1, 0)];
  return [...x].map((value, k) => a * value + b * out[k] + c * y[k] + d * into[k]);
}

function poseOfGltf() {
  const bytes = fs.readFileSync(drawn);
  const length = bytes.readUInt32LE(12);
  const model = JSON.parse(bytes.toString('utf8', 20, 20 + length));
  const data = bytes.subarray(28 + length);
  const kWidths = {SCALAR: 1, VEC3: 3, VEC4: 4};
  const numbers = (accessor) => {
    const {bufferView, byteOffset = 0, count: rows, type} = model.accessors[accessor];
    const from = (model.bufferViews[bufferView].byteOffset ?? 0) + byteOffset;
    const values = new Float32Array(rows * kWidths[type]);
    for (let k = 0; k < values.length; ++k) values[k] = data.readFloatLE(from + 4 * k);
    return values;
  };
  const [animation] = model.animations;
  const bodies = names.map((name) => {
    const number = model.nodes.findIndex((node) => node.name === name);
    const samplerOf = (kind, width) => {
      const channel = animation.channels.find(({target}) => target.node === number && target.path === kind);
      if (!channel) return undefined;
      const {input, output, interpolation} = animation.samplers[channel.sampler];
      return {times: numbers(input), rows: numbers(output), width, isCubic: interpolation === 'CUBICSPLINE'};
    };
    return {node: model.nodes[number], place: samplerOf('translation', 3), turn: samplerOf('rotation', 4)};
  });
  return (k, t) => {
    const {node, place, turn} = bodies[k];
    return [...(place ? sample(place, t) : node.translation ?? [0, 0, 0]),
            ...(turn ? sample(turn, t) : node.rotation ?? [0, 0, 0, 1])];
  };
}

const pose = drawn.endsWith('.glb') ? poseOfGltf() : await poseOfPage();
const end = scene.time.end;
const times = [0, end];
for (let k = 0; k < Number(count); ++k) times.push(end * random());
times.sort((a, b) => a - b);
fs.writeFileSync(out, JSON.stringify({
  times, poses: times.map((t) => names.flatMap((_, k) => pose(k, t))),
}));
