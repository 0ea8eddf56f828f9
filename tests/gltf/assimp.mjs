// Checks format=original with Assimp, which shares nothing with our readers and writers:
//   node assimp.mjs CREASE FOLDER     smooths meshes in FOLDER, and some of its own, with the command CREASE
// Everything that Assimp reads of an upload must be in its original, field by field, apart from positions and normals.
import { execFileSync } from "node:child_process";
import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { basename, extname, join } from "node:path";
import assert from "node:assert/strict";

const [, , crease, folder] = process.argv;
if (!folder) {
  console.error("usage: node assimp.mjs CREASE FOLDER");
  process.exit(2);
}
const path = (name) => join(folder, name);

/** What Assimp reads of a file: its dump without comments and its own name, and the numbers of what may move. */
function read(name) {
  const dump = path(`${name}.assxml`);
  execFileSync("assimp", ["dump", path(name), dump], { stdio: "pipe" });
  const moving = { Positions: [], Normals: [] };
  const rest = readFileSync(dump, "utf8").replace(/<!--.*?-->/s, "").replaceAll(basename(name), "")
    .replace(/<(Positions|Normals) ([^>]*)>(.*?)<\/\1>/gs, (_, what, attributes, numbers) => {
      moving[what].push(...numbers.trim().split(/\s+/).map(Number));
      return `<${what} ${attributes}/>`;
    });
  return { rest: rest.split("\n").map((line) => line.trim()), ...moving };
}

function compare(name, fields) {
  const original = `${basename(name, extname(name))}-assimp${extname(name)}`;
  execFileSync(crease, ["smooth", "--local", path(name), "-o", path(original), "-p", "noise_sigma=0.1", "-q"], { stdio: "pipe" });
  const before = read(name), after = read(original);
  for (const field of ["FaceList", ...fields]) assert.ok(before.rest.some((line) => line.startsWith(`<${field}`)), `${name} has ${field}`);
  assert.deepEqual(after.rest, before.rest, `${name}: something else than positions and normals differs`);
  for (const what of ["Positions", "Normals"]) assert.equal(after[what].length, before[what].length);
  const moves = after.Positions.map((x, i) => Math.abs(x - before.Positions[i]));
  assert.ok(Math.max(...moves) > 1e-4, `${name}: nothing has moved`);
  assert.ok(Math.max(...moves) < 0.2, `${name}: a position is not that of its vertex`);
  // Normals that are 0 stay 0.
  for (let i = 0; i < after.Normals.length; i += 3) {
    const [length, expected] = [after, before].map(({ Normals }) => Math.hypot(...Normals.slice(i, i + 3)));
    assert.ok(Math.abs(length - expected) < 1e-3, `${name}: normal ${i / 3} has the length ${length}, not ${expected}`);
  }
  console.log(`${name}: Assimp reads the same of ${original} but ${after.Positions.length / 3} positions and ${after.Normals.length / 3} normals`);
}

// A bumpy square of polygons with colours, normals and attribute bytes: what the other meshes do not have.
const kSide = 9;
const grid = Array.from({ length: kSide * kSide }, (_, v) => [Math.floor(v / kSide), v % kSide, 0.1 * Math.sin(9 * v)]);
const squares = [];
for (let v = 0; v < kSide * (kSide - 1); ++v) if ((v + 1) % kSide > 0) squares.push([v, v + kSide, v + kSide + 1, v + 1]);

writeFileSync(path("grid.off"), ["OFF", `${grid.length} ${squares.length} 0`, ...grid.map((p) => p.join(" ")),
  ...squares.map((corners, i) => `4 ${corners.join(" ")} 0.5 ${(i % 5) / 5} 1`)].join("\n") + "\n");
writeFileSync(path("grid.ply"), ["ply", "format ascii 1.0", `element vertex ${grid.length}`,
  ...["x", "y", "z", "nx", "ny", "nz", "s", "t"].map((name) => `property float ${name}`),
  ...["red", "green", "blue", "alpha"].map((name) => `property uchar ${name}`), `element face ${squares.length}`,
  "property list uchar int vertex_indices", "end_header",
  ...grid.map((p, v) => `${p.join(" ")} 0 0 1 ${p[0] / 8} ${p[1] / 8} ${v} ${255 - v} 7 255`),
  ...squares.map((corners) => `4 ${corners.join(" ")}`)].join("\n") + "\n");
writeFileSync(path("grid.mtl"), "newmtl steel\nKd 0.5 0.25 1\nnewmtl brass\nKd 1 0.75 0\n");
writeFileSync(path("grid.obj"), ["mtllib grid.mtl", ...grid.map((p) => `v ${p.join(" ")}`),
  ...grid.map((p) => `vt ${p[0] / 8} ${p[1] / 8}`), "vn 0 0 1",
  ...squares.flatMap((corners, i) => [...(i % 32 === 0 ? [`o part${i}`, `usemtl ${i === 0 ? "steel" : "brass"}`] : []),
    `f ${corners.map((v) => `${v + 1}/${v + 1}/1`).join(" ")}`])].join("\n") + "\n");
const at = (v) => grid[v].join(" ");
writeFileSync(path("grid.stl"), ["solid grid", ...squares.flatMap(([a, b, c, d]) => [[a, b, c], [a, c, d]]).map((corners) =>
  `facet normal 0 0 1\nouter loop\n${corners.map((v) => `vertex ${at(v)}`).join("\n")}\nendloop\nendfacet`), "endsolid grid"].join("\n") + "\n");

compare("grid.obj", ["Material", "TextureCoords", "Normals"]);
compare("grid.ply", ["Colors", "Normals"]);
compare("grid.off", []);
compare("grid.stl", ["Normals", "Node"]);
// Those that the other checks leave in the folder.
for (const [name, fields] of [["tube.obj", ["Material", "TextureCoords", "Colors"]], ["tube.stl", []],
  ["scene.glb", ["Material", "TextureCoords", "Colors", "Bone", "AnimationList", "Node"]]]) {
  assert.ok(existsSync(path(name)), `${name} is missing: run readers.mjs and original.mjs before`);
  compare(name, fields);
}
