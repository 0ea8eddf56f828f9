// Checks what files keep with readers that share nothing with ours, three.js and glTF-Transform:
//   node readers.mjs CREASE FOLDER     smooths meshes of its own with the command CREASE, in FOLDER
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { NodeIO } from "@gltf-transform/core";
import { ALL_EXTENSIONS, EXTMeshoptCompression, KHRDracoMeshCompression } from "@gltf-transform/extensions";
import draco3d from "draco3dgltf";
import { MeshoptDecoder, MeshoptEncoder } from "meshoptimizer";
import { OBJLoader } from "three/examples/jsm/loaders/OBJLoader.js";
import { PLYLoader } from "three/examples/jsm/loaders/PLYLoader.js";
import { STLLoader } from "three/examples/jsm/loaders/STLLoader.js";
import assert from "node:assert/strict";

const [, , crease, folder] = process.argv;
if (!folder) {
  console.error("usage: node readers.mjs CREASE FOLDER");
  process.exit(2);
}

await Promise.all([MeshoptDecoder.ready, MeshoptEncoder.ready]);
const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({
  "meshopt.decoder": MeshoptDecoder,
  "meshopt.encoder": MeshoptEncoder,
  "draco3d.decoder": await draco3d.createDecoderModule(),
  "draco3d.encoder": await draco3d.createEncoderModule(),
});

const path = (name) => join(folder, name);
const smooth = (input, output, ...options) =>
  execFileSync(crease, ["smooth", "--local", path(input), "-o", path(output), "-p", "noise_sigma=0.1", "-q", ...options],
    { stdio: "pipe" });

// A bumpy tube whose texture has a seam: the vertices of the last column are those of the first.
const kRows = 9, kColumns = 16;
const corners = [], positions = [], colours = [];
for (let row = 0; row < kRows; ++row) {
  for (let column = 0; column < kColumns; ++column) {
    const around = (2 * Math.PI * column) / kColumns, bump = 1 + 0.02 * Math.sin(5 * row + 3 * column);
    positions.push([bump * Math.cos(around), bump * Math.sin(around), row / 3]);
    colours.push([Math.round((255 * row) / kRows), Math.round((255 * column) / kColumns), 128]);
    if (row === kRows - 1) continue;
    const at = (r, c) => ({ vertex: r * kColumns + (c % kColumns), uv: [c / kColumns, r / kRows] });
    const [a, b, c, d] = [at(row, column), at(row, column + 1), at(row + 1, column + 1), at(row + 1, column)];
    corners.push(a, b, c, a, c, d);
  }
}

function writeObj(name) {
  const lines = ["mtllib tube.mtl"];
  positions.forEach((p, i) => lines.push(`v ${p.join(" ")} ${colours[i].map((c) => c / 255).join(" ")}`));
  corners.forEach(({ uv }) => lines.push(`vt ${uv.join(" ")}`));
  for (let i = 0; i < corners.length; i += 3) {
    if (i % 300 === 0) lines.push(`usemtl ${i % 600 === 0 ? "red" : "blue"}`);
    lines.push(`f ${[0, 1, 2].map((k) => `${corners[i + k].vertex + 1}/${i + k + 1}`).join(" ")}`);
  }
  writeFileSync(path(name), lines.join("\n") + "\n");
}

function writePly(name) {
  const lines = ["ply", "format ascii 1.0", `element vertex ${positions.length}`, "property float x", "property float y",
    "property float z", "property uchar red", "property uchar green", "property uchar blue", "property float s",
    "property float t", `element face ${corners.length / 3}`, "property list uchar int vertex_indices", "end_header"];
  positions.forEach((p, i) => lines.push(`${p.join(" ")} ${colours[i].join(" ")} ${p[2] / 4} 0.${i % 10}`));
  for (let i = 0; i < corners.length; i += 3) lines.push(`3 ${[0, 1, 2].map((k) => corners[i + k].vertex).join(" ")}`);
  writeFileSync(path(name), lines.join("\n") + "\n");
}

function writeStl(name) {
  const bytes = Buffer.alloc(84 + (50 * corners.length) / 3);
  bytes.writeUInt32LE(corners.length / 3, 80);
  corners.forEach(({ vertex }, i) => positions[vertex].forEach((x, k) =>
    bytes.writeFloatLE(x, 84 + 50 * Math.floor(i / 3) + 12 + 12 * (i % 3) + 4 * k)));
  writeFileSync(path(name), bytes);
}

// The values at the corners of all faces, in order: { position, color, uv, normal } and the material of each face.
function cornersOfThree(geometry, materials = []) {
  const flat = geometry.index ? geometry.toNonIndexed() : geometry;
  const read = (name) => {
    const attribute = flat.getAttribute(name), whole = attribute?.array instanceof Uint8Array ? 255 : 1;
    return attribute && Array.from(attribute.array, (value) => value / whole);
  };
  const names = materials.length > 0 ? Array(flat.getAttribute("position").count / 3).fill("") : undefined;
  for (const { start, count, materialIndex } of names ? geometry.groups : []) {
    names.fill(materials[materialIndex].name, start / 3, (start + count) / 3);
  }
  return { position: read("position"), color: read("color"), uv: read("uv"), normal: read("normal"), names };
}

function readObj(name) {
  const [mesh, ...others] = new OBJLoader().parse(readFileSync(path(name), "utf8")).children;
  assert.equal(others.length, 0);
  return cornersOfThree(mesh.geometry, [mesh.material].flat());
}
const bytesOf = (name) => new Uint8Array(readFileSync(path(name))).buffer;
const readPly = (name) => cornersOfThree(new PLYLoader().parse(bytesOf(name)));
const readStl = (name) => cornersOfThree(new STLLoader().parse(bytesOf(name)));

async function readGlb(name) {
  const document = await io.readBinary(new Uint8Array(readFileSync(path(name))));
  const read = { position: [], color: [], uv: [], names: [] };
  for (const node of document.getRoot().listNodes()) {
    for (const primitive of node.getMesh()?.listPrimitives() ?? []) {
      if (primitive.getMode() !== 4) continue;
      const indices = primitive.getIndices().getArray();
      const add = (list, semantic, size, change = (x) => x) => {
        const accessor = primitive.getAttribute(semantic);
        for (const index of accessor ? indices : []) list.push(...change(accessor.getElement(index, [])).slice(0, size));
      };
      const matrix = node.getWorldMatrix();
      add(read.position, "POSITION", 3, ([x, y, z]) => [0, 1, 2].map((k) => matrix[k] * x + matrix[4 + k] * y + matrix[8 + k] * z + matrix[12 + k]));
      add(read.color, "COLOR_0", 3);
      add(read.uv, "TEXCOORD_0", 2, ([u, v]) => [u, 1 - v]);
      for (let i = 0; i < indices.length; i += 3) read.names.push(primitive.getMaterial()?.getName());
    }
  }
  return read;
}

function near(is, expected, tolerance, what) {
  assert.equal(is?.length, expected?.length, what);
  expected?.forEach((value, i) => assert.ok(Math.abs(is[i] - value) <= tolerance, `${what} ${i}: ${is[i]} is not ${value}`));
}

// Everything but positions and normals is as it was, and positions are those of another file.
function same(is, expected, like, what, tolerance = 1e-6) {
  near(is.uv, expected.uv, 1e-6, `${what}: uv`);
  near(is.color, expected.color, tolerance, `${what}: colour`);
  assert.deepEqual(is.names, expected.names, `${what}: materials`);
  near(is.position, like.position, 1e-6, `${what}: position`);
  assert.ok(is.position.some((x, i) => Math.abs(x - expected.position[i]) > 1e-5), `${what}: nothing has moved`);
  console.log(`${what}: kept`);
}

const readers = { obj: readObj, ply: readPly, stl: readStl, glb: readGlb };
writeObj("tube.obj");
writePly("tube.ply");
writeStl("tube.stl");

for (const format of ["obj", "ply", "stl"]) {
  smooth(`tube.${format}`, `tube-original.${format}`);
  const before = readers[format](`tube.${format}`), after = readers[format](`tube-original.${format}`);
  same(after, before, after, `${format} as the original`);
}

// Colours are rounded to bytes, which is up to 2.3 times as much in linear light, and three.js rounds that again.
const kByte = (2.3 * 0.5 + 0.5) / 255;
smooth("tube.obj", "obj.glb");
smooth("tube.obj", "obj.ply");
smooth("tube.ply", "ply.glb");
smooth("tube.ply", "ply.obj");
const obj = readObj("tube.obj"), ply = readPly("tube.ply");
same(await readGlb("obj.glb"), obj, readObj("tube-original.obj"), "obj as glb");
same({ ...(await readGlb("ply.glb")), names: undefined }, ply, readPly("tube-original.ply"), "ply as glb", kByte);
same({ ...readObj("ply.obj"), names: undefined }, ply, readPly("tube-original.ply"), "ply as obj", kByte);
// three.js reads no texture coordinates of faces.
const objAsPly = readPly("obj.ply");
near(objAsPly.color, obj.color, kByte, "obj as ply: colour");

// Of a GLB the first conversion is the upload.
smooth("obj.glb", "again.obj");
smooth("obj.glb", "again-original.glb");
same(readObj("again.obj"), await readGlb("obj.glb"), await readGlb("again-original.glb"), "glb as obj");

const plain = await readGlb("obj.glb");
const extent = Math.max(...[0, 1, 2].map((k) => {
  const values = plain.position.filter((_, i) => i % 3 === k);
  return Math.max(...values) - Math.min(...values);
}));
for (const [options, tolerance] of [[["--compress", "meshopt"], 0], [["--quantized"], extent / 131070 + 1e-6],
  [["--compress", "meshopt", "--quantized"], extent / 131070 + 1e-6]]) {
  const name = `obj${options.join("")}.glb`;
  smooth("tube.obj", name, ...options);
  const small = await readGlb(name);
  near(small.position, plain.position, tolerance, `${name}: position`);
  near(small.uv, plain.uv, 0, `${name}: uv`);
  near(small.color, plain.color, tolerance === 0 ? 0 : 0.5 / 65535 + 1e-7, `${name}: colour`);
  assert.deepEqual(small.names, plain.names);
  console.log(`${name}: ${readFileSync(path(name)).length} of ${readFileSync(path("obj.glb")).length} bytes, as the plain one`);
}

// Draco refuses to decode a primitive of more vertices than three times its faces, as those that share theirs may have.
function dropUnusedVertices(primitive) {
  const used = [...new Set(primitive.getIndices().getArray())];
  const place = new Map(used.map((index, i) => [index, i]));
  for (const semantic of primitive.listSemantics()) {
    const shared = primitive.getAttribute(semantic), array = shared.getArray();
    const own = shared.clone().setArray(new array.constructor(used.length * shared.getElementSize()));
    used.forEach((index, i) => own.setElement(i, shared.getElement(index, [])));
    primitive.setAttribute(semantic, own);
  }
  const indices = primitive.getIndices();
  primitive.setIndices(indices.clone().setArray(indices.getArray().map((index) => place.get(index))));
}

// Uploads that other programs have compressed. They have a folder of their own: the validator has no say about them.
mkdirSync(path("uploads"), { recursive: true });
for (const [name, extension, options] of [
  ["draco", KHRDracoMeshCompression, { method: KHRDracoMeshCompression.EncoderMethod.EDGEBREAKER }],
  ["sequential", KHRDracoMeshCompression, { method: KHRDracoMeshCompression.EncoderMethod.SEQUENTIAL }],
  ["meshopt", EXTMeshoptCompression, { method: EXTMeshoptCompression.EncoderMethod.FILTER }]]) {
  const document = await io.readBinary(new Uint8Array(readFileSync(path("obj.glb"))));
  for (const mesh of document.getRoot().listMeshes()) {
    for (const primitive of mesh.listPrimitives()) {
      if (primitive.getMode() !== 4) {
        primitive.dispose();
        continue;
      }
      for (const semantic of primitive.listSemantics()) if (semantic.startsWith("_")) primitive.setAttribute(semantic, null);
      dropUnusedVertices(primitive);
    }
  }
  document.createExtension(extension).setRequired(true).setEncoderOptions(options);
  const upload = `uploads/${name}.glb`;
  writeFileSync(path(upload), await io.writeBinary(document));
  const before = await readGlb(upload);
  smooth(upload, `${name}-original.glb`);
  const after = await readGlb(`${name}-original.glb`);
  same(after, before, after, `${name} as the original`);
  smooth(upload, `${name}.obj`);
  same(readObj(`${name}.obj`), before, after, `${name} as obj`, 1e-4);
}
