// Checks format=original of GLB with glTF-Transform, which shares nothing with our reader and writer:
//   node original.mjs make FILE              writes a scene with everything that must stay
//   node original.mjs compare FILE ORIGINAL  compares the two, field by field, apart from positions and normals
import { readFileSync, writeFileSync } from "node:fs";
import { Document, NodeIO } from "@gltf-transform/core";
import { ALL_EXTENSIONS, KHRMaterialsUnlit } from "@gltf-transform/extensions";
import assert from "node:assert/strict";

const io = new NodeIO().registerExtensions(ALL_EXTENSIONS);
const [, , command, file, original] = process.argv;

// A sphere of 12 times 24 squares, with a seam of texture coordinates.
function sphere(document, buffer, is_skinned) {
  const rows = 12, columns = 24;
  const positions = [], texture = [], colours = [], joints = [], weights = [], indices = [];
  for (let row = 0; row <= rows; ++row) {
    for (let column = 0; column <= columns; ++column) {
      const polar = (Math.PI * row) / rows, around = (2 * Math.PI * (column % columns)) / columns;
      const bump = 1 + 0.01 * Math.sin(7 * row + 3 * (column % columns));
      positions.push(bump * Math.sin(polar) * Math.cos(around), bump * Math.sin(polar) * Math.sin(around), bump * Math.cos(polar));
      texture.push(column / columns, row / rows);
      colours.push(row / rows, column / columns, 0.5, 1);
      joints.push(0, 1, 0, 0);
      weights.push(0.5, 0.5, 0, 0);
      if (row === rows || column === columns) continue;
      const here = row * (columns + 1) + column, below = here + columns + 1;
      indices.push(here, below, below + 1, here, below + 1, here + 1);
    }
  }
  const accessor = (type, array) => document.createAccessor().setType(type).setArray(array).setBuffer(buffer);
  const normals = new Float32Array(positions.length).map((_, i) => (i % 3 === 2 ? 1 : 0));
  const primitive = document.createPrimitive()
    .setAttribute("POSITION", accessor("VEC3", new Float32Array(positions)))
    .setAttribute("NORMAL", accessor("VEC3", normals))
    .setAttribute("TEXCOORD_0", accessor("VEC2", new Float32Array(texture)))
    .setAttribute("COLOR_0", accessor("VEC4", new Float32Array(colours)))
    .setIndices(accessor("SCALAR", new Uint16Array(indices)));
  if (!is_skinned) return primitive;
  return primitive.setAttribute("JOINTS_0", accessor("VEC4", new Uint8Array(joints)))
    .setAttribute("WEIGHTS_0", accessor("VEC4", new Float32Array(weights)));
}

async function make() {
  const document = new Document();
  const buffer = document.createBuffer();
  const image = Buffer.from("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==", "base64");
  const texture = document.createTexture("paint").setImage(new Uint8Array(image)).setMimeType("image/png");
  const unlit = document.createExtension(KHRMaterialsUnlit).createUnlit();
  const material = document.createMaterial("steel").setBaseColorTexture(texture).setMetallicFactor(0.25)
    .setExtension("KHR_materials_unlit", unlit).setExtras({ made: "by hand" });
  const mesh = document.createMesh("ball").addPrimitive(sphere(document, buffer, false).setMaterial(material)).setExtras({ part: 7 });
  const plain = document.createNode("plain").setMesh(mesh).setTranslation([3, 0, 0]).setRotation([0, 0.6, 0, 0.8]).setScale([2, 1, 1]);
  const joints = [document.createNode("hip"), document.createNode("knee").setTranslation([0, 1, 0])];
  const matrices = new Float32Array(32).map((_, i) => (i % 16 % 5 === 0 ? 1 : 0));
  const skin = document.createSkin("bones").addJoint(joints[0]).addJoint(joints[1])
    .setInverseBindMatrices(document.createAccessor().setType("MAT4").setArray(matrices).setBuffer(buffer));
  const skinned = document.createNode("skinned").setSkin(skin)
    .setMesh(document.createMesh("body").addPrimitive(sphere(document, buffer, true).setMaterial(material)));
  const camera = document.createNode("eye").setCamera(document.createCamera("lens").setType("perspective").setYFov(0.7).setZNear(0.1));
  const scene = document.createScene("all").addChild(plain).addChild(skinned).addChild(camera);
  joints[0].addChild(joints[1]);
  scene.addChild(joints[0]);
  const times = document.createAccessor().setType("SCALAR").setArray(new Float32Array([0, 1])).setBuffer(buffer);
  const turns = document.createAccessor().setType("VEC4").setArray(new Float32Array([0, 0, 0, 1, 0, 1, 0, 0])).setBuffer(buffer);
  const sampler = document.createAnimationSampler().setInput(times).setOutput(turns);
  const channel = document.createAnimationChannel().setTargetNode(joints[1]).setTargetPath("rotation").setSampler(sampler);
  document.createAnimation("bend").addSampler(sampler).addChannel(channel);
  document.getRoot().setDefaultScene(scene);
  writeFileSync(file, await io.writeBinary(document));
}

const geometry = (document) => {
  const moved = new Set();
  for (const mesh of document.getRoot().listMeshes()) {
    for (const primitive of mesh.listPrimitives()) {
      for (const name of ["POSITION", "NORMAL"]) {
        const accessor = primitive.getAttribute(name);
        if (accessor) moved.add(accessor);
      }
    }
  }
  return moved;
};

async function compare() {
  const [before, after] = await Promise.all([file, original].map((path) => io.readBinary(new Uint8Array(readFileSync(path)))));
  const moved = geometry(before), movedAfter = geometry(after);
  const accessors = [before, after].map((document) => document.getRoot().listAccessors());
  assert.equal(accessors[1].length, accessors[0].length);
  let changed = 0;
  accessors[0].forEach((accessor, i) => {
    assert.equal(movedAfter.has(accessors[1][i]), moved.has(accessor));
    assert.equal(accessors[1][i].getCount(), accessor.getCount());
    if (!moved.has(accessor)) return assert.deepEqual(accessors[1][i].getArray(), accessor.getArray());
    changed += accessor.getArray().some((value, k) => value !== accessors[1][i].getArray()[k]) ? 1 : 0;
  });
  assert.ok(changed > 0, "nothing has moved");
  // With the data of the one in the other, the two are equal in all that they have.
  accessors[0].forEach((accessor, i) => accessors[1][i].setArray(accessor.getArray()));
  assert.ok(before.getRoot().equals(after.getRoot()), "something else than positions and normals differs");
  console.log(`${original}: everything but ${changed} accessors of positions and normals is as in ${file}`);
}

if (command === "make" && file) await make();
else if (command === "compare" && original) await compare();
else {
  console.error("usage: node original.mjs make FILE | compare FILE ORIGINAL");
  process.exit(2);
}
