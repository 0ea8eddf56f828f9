// Runs the Khronos validator over every .glb of a folder: node validate.mjs FOLDER
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import validator from "gltf-validator";

// The validator throws when a file is not glTF at all.
async function issues_of(path) {
  try {
    return (await validator.validateBytes(new Uint8Array(readFileSync(path)))).issues;
  } catch (error) {
    return { numErrors: 1, numWarnings: 0, messages: [{ code: "UNREADABLE", message: String(error) }] };
  }
}

const folder = process.argv[2];
if (!folder) {
  console.error("usage: node validate.mjs FOLDER");
  process.exit(2);
}

const files = readdirSync(folder).filter((name) => name.endsWith(".glb")).sort();
let failed = 0;
for (const name of files) {
  const { numErrors, numWarnings, messages } = await issues_of(join(folder, name));
  const passed = numErrors === 0 && numWarnings === 0;
  if (!passed) failed += 1;
  console.log(`${passed ? "passed" : "FAILED"} ${name}: ${numErrors} errors, ${numWarnings} warnings`);
  for (const { code, message, pointer } of messages) console.log(`  ${code} ${pointer ?? ""}: ${message}`);
}
console.log(`glTF validator: ${files.length - failed} passed, ${failed} failed`);
process.exit(failed === 0 && files.length > 0 ? 0 : 1);
